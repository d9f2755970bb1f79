"""Skeletons that are damaged or meant to hurt: an error that names the place, or what is there and a word."""

import warnings
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fba
from fba.animation import Animation, BodyTrack
from fba.capture import SkeletonMotion
from fba.errors import FbaWarning, FormatError
from fba.formats.bvh import _reader as reader
from fba.parameters import BAP_COUNT, bap_numbers
from gltf_edits import edited

FRAMES = 5
BVH = """HIERARCHY
ROOT Hips
{{ OFFSET 0 {offset} 0 CHANNELS 3 Zrotation Xrotation Yrotation
  End Site {{ OFFSET 0 1 0 }} }}
MOTION
Frames: {frames}
Frame Time: {time}
"""


def text(rows: list[str], offset: str = "0", time: str = "0.1") -> str:
    return BVH.format(offset=offset, frames=len(rows), time=time) + "\n".join(rows) + "\n"


def test_more_frames_than_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SkeletonMotion, "MAX_FRAMES", 3)
    assert reader.parse(text(["0 0 0"] * 3)).rotations.shape[0] == 3
    with pytest.raises(FormatError, match="more than 3 frames; cut the motion into pieces") as caught:
        reader.parse(text(["0 0 0"] * 9))
    assert caught.value.line == 11
    monkeypatch.setattr(reader, "MAX_LINES", 15)
    with pytest.raises(FormatError, match="more than 15 lines"):
        reader.parse(text(["0 0 0"] * 9))


@pytest.mark.parametrize("word", ["nan", "-inf", "1e400", "1e13", "x"])
@pytest.mark.parametrize("row", range(7))
def test_a_wrong_number_anywhere(monkeypatch: pytest.MonkeyPatch, word: str, row: int) -> None:
    """Rows are read three at a time."""
    monkeypatch.setattr(reader, "BATCH_LINES", 3)
    rows = ["1 2 3"] * 7
    rows[row] = f"1 {word} 3"
    with pytest.raises(FormatError) as caught:
        reader.parse(text(rows))
    assert (caught.value.line, caught.value.token) == (8 + row, word)


def test_lengths_beyond_all_measure() -> None:
    with pytest.raises(FormatError) as caught:
        reader.parse(text(["0 0 0"], offset="1e300"))
    assert (caught.value.line, caught.value.token) == (3, "1e300")


def test_a_frame_an_hour() -> None:
    assert reader.parse(text(["0 0 0"] * 2, time="3600")).rate == Fraction(1, 3600)
    assert reader.parse(text(["0 0 0"] * 2, time="2.5")).rate == Fraction(2, 5)


@pytest.fixture(scope="module")
def bones(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A skeleton whose left knee bends, as of another program."""
    path = tmp_path_factory.mktemp("glb") / "a.glb"
    values = np.zeros((FRAMES, BAP_COUNT), dtype=np.int32)
    values[:, bap_numbers()["l_knee_flexion"] - 1] = -10_000 * np.arange(FRAMES)
    track = BodyTrack(values, np.ones(values.shape, dtype=bool))
    fba.write(path, Animation(Fraction(25), np.arange(FRAMES), None, track), mesh=False)
    return edited(path.read_bytes(), lambda whole: whole["animations"][0].pop("extras"))


def node(whole: dict[str, Any], name: str) -> dict[str, Any]:
    found: dict[str, Any] = next(entry for entry in whole["nodes"] if entry["name"] == name)
    return found


def number(whole: dict[str, Any], name: str) -> int:
    return [entry["name"] for entry in whole["nodes"]].index(name)


def circle(whole: dict[str, Any]) -> None:
    node(whole, "l_knee")["children"].append(0)


def two_parents(whole: dict[str, Any]) -> None:
    node(whole, "l_knee")["children"].append(number(whole, "l_hip"))


def no_length(whole: dict[str, Any]) -> None:
    for entry in whole["nodes"]:
        entry["translation"] = [0, 0, 0]
    del whole["skins"]


def no_turn(whole: dict[str, Any]) -> None:
    whole["nodes"][0]["rotation"] = [0, 0, 0, 0]


def too_many_keys(whole: dict[str, Any]) -> None:
    whole["accessors"][0]["count"] = 10**7


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (circle, r"nodes\[0\]: is its own ancestor"),
        (two_parents, "as a child, which is already a child of node"),
        (no_length, "no human skeleton is found: there .* all at one place"),
        (no_turn, "the quaternion has length 0"),
        (too_many_keys, "more than the 4194304 elements"),
    ],
)
def test_damaged_skeletons_are_refused(
    tmp_path: Path, bones: bytes, change: Callable[[dict[str, Any]], None], message: str
) -> None:
    path = tmp_path / "a.glb"
    path.write_bytes(edited(bones, change))
    with pytest.raises(FormatError, match=message):
        fba.read(path)


def rename_shoulders(whole: dict[str, Any]) -> None:
    for side in "lr":
        node(whole, f"{side}_shoulder")["name"] = f"{side} something"


def split(whole: dict[str, Any]) -> None:
    spine = number(whole, "vl5")
    whole["nodes"][0]["children"].remove(spine)
    whole["scenes"][0]["nodes"].append(spine)


@pytest.mark.parametrize(
    ("change", "message"),
    [(split, "has several skeletons; 'HumanoidRoot' is read, the others are left out: vl5")],
)
def test_the_rest_of_a_damaged_skeleton_is_read_with_a_warning(
    tmp_path: Path, bones: bytes, change: Callable[[dict[str, Any]], None], message: str
) -> None:
    path = tmp_path / "a.glb"
    path.write_bytes(edited(bones, change))
    with pytest.warns(FbaWarning, match=message):
        body = fba.read(path).body
    knee = body.values[:, bap_numbers()["l_knee_flexion"] - 1]
    # feet are kept on the ground with what is left, so the knee bends a little more or less
    assert np.abs(knee - -10_000 * np.arange(FRAMES)).max() <= 5000


def test_a_shoulder_is_found_by_where_it_hangs(tmp_path: Path, bones: bytes) -> None:
    """All other joints keep their names: they are not read word by word for its sake."""
    path = tmp_path / "a.glb"
    values = []
    for content in (bones, edited(bones, rename_shoulders)):
        path.write_bytes(content)
        with warnings.catch_warnings(action="error"):
            body = fba.read(path, plant=False).body
        values.append(body.values)
    apart = np.abs(values[0] - values[1]).max(axis=0)
    apart[[bap_numbers()[f"{side}_metatarsal_flexion"] - 1 for side in "lr"]] = 0  # the ground bends toes
    assert apart.max() < 5000  # 0.05 rad
