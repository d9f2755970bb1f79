"""VRM animations that are written: expressions, gaze and head come back; the document is as VRM wants it."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest

import fba
from fba import Animation, BodyTrack, FaceTrack
from fba.capture import shape_faps
from fba.errors import FbaWarning, FormatError
from fba.parameters import fap_numbers

FRAMES = 13
RAMP = np.linspace(0, 1, FRAMES)


def face(shapes: dict[str, np.ndarray], turns: dict[str, float] | None = None) -> Animation:
    """Return the FAPs of expressions with weights (T,), and of turns in radians that grow from 0."""
    values = np.zeros((FRAMES, 68))
    for name, weights in shapes.items():
        amounts = shape_faps(name)
        assert amounts is not None
        values += weights[:, None] * amounts
    for name, angle in (turns or {}).items():
        values[:, fap_numbers()[name] - 1] = angle * 1e5 * RAMP
    mask = np.ones((FRAMES, 68), bool)
    mask[:, :2] = False
    return Animation(25, np.arange(FRAMES), FaceTrack(np.rint(values).astype(np.int32), mask), name="talk")


def document(path: Path) -> dict[str, object]:
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    content: dict[str, object] = json.loads(data[20 : 20 + length])
    return content


def test_a_written_face_is_read_back(tmp_path: Path) -> None:
    turns = {"head_yaw": 0.4, "head_pitch": -0.3, "head_roll": 0.2}
    turns |= {
        f"{way}_{side}_eyeball": angle for side in "lr" for way, angle in (("yaw", 0.3), ("pitch", 0.2))
    }
    said = face({"aa": RAMP, "blinkLeft": RAMP, "happy": RAMP[::-1] / 2}, turns)
    path = tmp_path / "talk.vrma"
    fba.write(path, said)
    back = fba.read(path)
    assert (back.rate, len(back), back.body) == (25, FRAMES, None)
    for name in (*turns, "open_jaw", "raise_l_cornerlip", "close_t_l_eyelid", "close_t_r_eyelid"):
        column = fap_numbers()[name] - 1
        expected = said.face.values[:, column]
        np.testing.assert_allclose(
            back.face.values[:, column], expected, atol=0.03 * max(np.ptp(expected), 900)
        )


def test_the_document(tmp_path: Path) -> None:
    path = tmp_path / "talk.vrma"
    fba.write(path, face({"oh": RAMP}))
    content = document(path)
    assert content["extensionsUsed"] == ["VRMC_vrm_animation"]
    extension = content["extensions"]["VRMC_vrm_animation"]  # type: ignore[index]
    assert extension["specVersion"] == "1.0"
    nodes = [extension["lookAt"]["node"]]
    nodes += [entry["node"] for entry in extension["expressions"]["preset"].values()]
    nodes += [entry["node"] for entry in extension["humanoid"]["humanBones"].values()]
    assert sorted(nodes) == list(range(len(content["nodes"])))  # type: ignore[arg-type]
    assert {"aa", "ih", "ou", "ee", "oh", "blinkLeft", "blinkRight"} < set(extension["expressions"]["preset"])


def test_a_body_is_left_out(tmp_path: Path) -> None:
    body = BodyTrack(np.zeros((FRAMES, 296), np.int32), np.ones((FRAMES, 296), bool))
    said = face({"aa": RAMP})
    both = Animation(25, said.index, said.face, body)
    with pytest.warns(FbaWarning, match="VRMA holds no body; only the face was written"):
        fba.write(tmp_path / "a.vrma", both)
    with pytest.raises(FormatError, match="the animation has no face"):
        fba.write(tmp_path / "b.vrma", Animation(25, said.index, None, body))
