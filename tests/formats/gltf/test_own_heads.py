"""Heads of foreign bodies: FAPs mix their shapes, by name or as VRM declares them, and turn their eyes.

Heads that captured markers move, as glTF. VRM animations that are written: expressions, gaze and head come
back; the document is as VRM wants it.
"""

import json
import struct
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import fba
from fba import Animation, BodyTrack, FaceTrack
from fba.body.own_head import HeadShape, OwnHead
from fba.capture import shape_faps
from fba.capture.markers._motion import MarkerMotion
from fba.capture.markers._targets import target_points
from fba.capture.virtual_markers import MarkerMapping, VirtualMarker, head_of_model, move_head
from fba.errors import FbaWarning, FormatError
from fba.formats.gltf.bodies import import_body
from fba.formats.gltf.moved_head import write_moved_head
from fba.parameters import FAP_COUNT, fap_numbers, point_rows
from gltf_edits import edit
from small_head import small_head
from small_people import BONES, write_person

FRAMES = 13
RAMP = np.linspace(0, 1, FRAMES)
HEAD = slice(8 * list(BONES).index("head"), 8 * list(BONES).index("head") + 8)
RISE = 0.01
"""Metres by which every morph target of the small person raises its head's box, in the file's size."""


def faps(**values: float) -> np.ndarray:
    result = np.zeros(FAP_COUNT)
    for name, value in values.items():
        result[fap_numbers()[name] - 1] = value
    return result


def risen(path: Path, values: np.ndarray) -> np.ndarray:
    """By how much FAPs raise vertices, in metres of the file."""
    body = import_body(path)
    size = float(body.notes["size"].split()[0])
    moved: np.ndarray = body.own_head.move(body.vertices, values) - body.vertices
    return moved / size


def test_shapes_with_known_names_move_the_head(tmp_path: Path) -> None:
    morphs = {"jawOpen": [0.0], "eyeBlink_L": [0.0], "Wobble": [0.0]}
    path = write_person(tmp_path / "p.glb", morphs=morphs)
    body = import_body(path)
    assert [shape.name for shape in body.own_head.shapes] == ["jawOpen", "eyeBlinkLeft"]
    moved = risen(path, faps(close_t_l_eyelid=1024))
    np.testing.assert_allclose(moved[HEAD], np.tile([0, RISE, 0], (8, 1)), atol=2e-5)
    moved[HEAD] = 0
    assert not moved.any()
    assert not risen(path, faps(close_t_r_eyelid=1024)).any()
    jaw = shape_faps("jawOpen")
    assert jaw is not None
    np.testing.assert_allclose(risen(path, jaw / 2)[HEAD, 1], RISE / 2, rtol=0.03)


def test_one_shape_that_two_names_mean_moves_once(tmp_path: Path) -> None:
    path = write_person(tmp_path / "p.glb", morphs={"Fcl_EYE_Close_L": [0.0], "eyeBlinkLeft": [0.0]})
    np.testing.assert_allclose(risen(path, faps(close_t_l_eyelid=1024))[HEAD, 1], RISE, atol=2e-5)
    edit(path, lambda document: document["meshes"][0]["primitives"][0]["targets"][0].clear())
    np.testing.assert_allclose(risen(path, faps(close_t_l_eyelid=1024))[HEAD, 1], RISE, atol=2e-5)


@pytest.mark.parametrize("extension", ["VRM", "VRMC_vrm"])
def test_expressions_that_vrm_declares(tmp_path: Path, extension: str) -> None:
    """The target's own name says nothing; the declaration says "open mouth", at 40 %."""
    path = write_person(tmp_path / "p.vrm", extension=extension, morphs={"n1": [0.0]})

    def declare(document: dict) -> None:  # type: ignore[type-arg]
        content = document["extensions"][extension]
        node = next(n for n, entry in enumerate(document["nodes"]) if "mesh" in entry)
        if extension == "VRM":
            group = {"presetName": "a", "binds": [{"mesh": 0, "index": 0, "weight": 40}]}
            content["blendShapeMaster"] = {"blendShapeGroups": [group]}
        else:
            binds = [{"node": node, "index": 0, "weight": 0.4}]
            content["expressions"] = {"preset": {"aa": {"morphTargetBinds": binds}}}

    edit(path, declare)
    open_mouth = shape_faps("aa")
    assert open_mouth is not None
    np.testing.assert_allclose(risen(path, open_mouth)[HEAD, 1], 0.4 * RISE, rtol=0.02)


def test_eyes_turn_with_their_bones(tmp_path: Path) -> None:
    """The bone of the left hand is called an eye here: its box turns about it."""
    path = write_person(tmp_path / "p.glb", extension="VRMC_vrm")

    def rename(document: dict) -> None:  # type: ignore[type-arg]
        bones = document["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"]
        bones["leftEye"] = bones.pop("leftMiddleProximal")

    edit(path, rename)
    body = import_body(path)
    (eye,) = body.own_head.eyes
    box = 8 * list(BONES).index("leftMiddleProximal")
    assert eye.rows.tolist() == list(range(box, box + 8))
    quarter = faps(yaw_l_eyeball=np.pi / 2 * 1e5)
    before, after = body.vertices[eye.rows] - eye.centre, body.own_head.move(body.vertices, quarter)[eye.rows]
    # to the subject's left: what points ahead, +z, points to +x then
    np.testing.assert_allclose(after - eye.centre, before[:, [2, 1, 0]] * [1, 1, -1], atol=1e-5)
    down = body.own_head.move(body.vertices, faps(pitch_l_eyeball=np.pi / 2 * 1e5))[eye.rows] - eye.centre
    np.testing.assert_allclose(down, before[:, [0, 2, 1]] * [1, -1, 1], atol=1e-5)


def test_few_shapes_are_mixed_and_none_overdone() -> None:
    rows, shifts = np.zeros(1, dtype=np.intp), np.ones((1, 3), dtype=np.float32)
    close = HeadShape("close", faps(close_t_l_eyelid=960, close_b_l_eyelid=64), rows, shifts)
    wide = HeadShape("wide", faps(close_t_l_eyelid=-260, close_b_l_eyelid=-60), rows, shifts)
    half = HeadShape("half", faps(close_t_l_eyelid=480, close_b_l_eyelid=32), rows, shifts)
    head = OwnHead(np.full(FAP_COUNT, 960.0), [close, wide, half])
    np.testing.assert_allclose(head.weights(faps(close_t_l_eyelid=1024)), [1, 0, 0], atol=0.1)
    np.testing.assert_allclose(head.weights(faps(close_t_l_eyelid=3000))[0], 1)
    np.testing.assert_allclose(
        head.weights(faps(close_t_l_eyelid=-260, close_b_l_eyelid=-60)), [0, 1, 0], atol=0.03
    )
    assert not head.weights(np.zeros(FAP_COUNT)).any()
    assert not head.weights(faps(raise_l_ear=500)).any()


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


MARKED = ("2.1", "8.1", "8.2", "8.3", "8.4", "9.3", "11.1", "11.2", "11.3")
FIXED = ("9.3", "11.1", "11.2", "11.3")


def capture(frames: int = 20) -> MarkerMotion:
    """Markers at points of the small head; that of the lower lip goes down by 8 mm, and the head turns."""
    places = target_points(small_head().points)
    positions = np.repeat(np.array([places[name] for name in MARKED])[None], frames, axis=0)
    positions[10:, MARKED.index("8.2"), 1] -= 0.008
    turn = np.array([[0.96, 0.0, 0.28], [0.0, 1.0, 0.0], [-0.28, 0.0, 0.96]])
    positions[15:] = positions[15:] @ turn.T
    return MarkerMotion(MARKED, positions, np.arange(frames) / 50, Fraction(50), "m", "+y", "lip")


def mapping() -> MarkerMapping:
    bound = small_head().bound
    return MarkerMapping(
        {name: VirtualMarker(int(bound[point_rows()[name]]), 0.02, 0.02, name in FIXED) for name in MARKED}
    )


def test_shapes_weights_and_turns(tmp_path: Path) -> None:
    moved = tmp_path / "moved.glb"
    head = head_of_model(small_head())
    shown = move_head(capture(), head, mapping())
    write_moved_head(moved, shown)
    data = moved.read_bytes()
    size = struct.unpack("<I", data[12:16])[0]
    document, body = json.loads(data[20 : 20 + size]), data[28 + size :]

    def numbers(index: int) -> np.ndarray:
        entry = document["accessors"][index]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[entry["type"]]
        result = np.zeros((entry["count"], width), np.float32)
        if "bufferView" in entry:
            result = block(entry["bufferView"], entry.get("byteOffset", 0), "<f4", result.size).reshape(
                -1, width
            )
        if "sparse" in entry:
            sparse = entry["sparse"]
            kind = {5123: "<u2", 5125: "<u4"}[sparse["indices"]["componentType"]]
            rows = block(
                sparse["indices"]["bufferView"], sparse["indices"].get("byteOffset", 0), kind, sparse["count"]
            )
            values = sparse["values"]
            result = result.copy()
            result[rows] = block(
                values["bufferView"], values.get("byteOffset", 0), "<f4", sparse["count"] * width
            ).reshape(-1, width)
        return result

    def block(view: int, offset: int, kind: str, count: int) -> np.ndarray:
        start = document["bufferViews"][view].get("byteOffset", 0) + offset
        return np.frombuffer(body, kind, count, start)

    node = next(number for number, one in enumerate(document["nodes"]) if one["name"] == "skin")
    primitive = document["meshes"][document["nodes"][node]["mesh"]]["primitives"][0]
    channels = {
        (one["target"]["node"], one["target"]["path"]): document["animations"][0]["samplers"][one["sampler"]]
        for one in document["animations"][0]["channels"]
    }
    weights = numbers(channels[node, "weights"]["output"]).reshape(20, -1)
    targets = np.stack([numbers(one["POSITION"]) for one in primitive["targets"]])
    positions = numbers(primitive["attributes"]["POSITION"]) + np.einsum("k,kvc->vc", weights[12], targets)
    expected = shown.vertices(12)[head.rows[0]] * head.metres
    np.testing.assert_allclose(positions, expected, atol=1e-6)
    assert np.abs(positions - numbers(primitive["attributes"]["POSITION"])).max() > 0.007
    top = next(number for number, one in enumerate(document["nodes"]) if one["name"] == "head")
    assert document["nodes"][top]["children"]
    x, y, z, w = numbers(channels[top, "rotation"]["output"])[17]
    assert np.degrees(2 * np.arcsin(y)) == pytest.approx(np.degrees(np.arcsin(0.28)), abs=0.01)
    assert max(abs(x), abs(z)) < 1e-3
    assert w > 0.9
    np.testing.assert_allclose(
        numbers(channels[top, "rotation"]["input"])[:, 0], np.arange(20) / 50, atol=1e-6
    )
