"""FAPs read back from glTF: the same as were written, told by the motion that the file shows."""

import math
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fba
from fba.animation import Animation, BodyTrack, FaceTrack
from fba.body import BodyModel
from fba.errors import FbaWarning, FormatError, ModelError
from fba.face import resolve
from fba.gltf import read_gltf
from fba.parameters import BAP_COUNT, FAP_COUNT, fap_numbers
from gltf_edits import document, edit

FRAMES = 9


def face_track(columns: dict[str, list[int]], frames: int = FRAMES) -> FaceTrack:
    """A track that sends all FAPs; those named have these values, spread evenly over the frames."""
    values = np.zeros((frames, FAP_COUNT), dtype=np.int32)
    at = np.linspace(0, 1, frames)
    for name, points in columns.items():
        values[:, fap_numbers()[name] - 1] = np.rint(np.interp(at, np.linspace(0, 1, len(points)), points))
    mask = np.zeros(values.shape, dtype=bool)
    mask[:, 2:] = True
    return FaceTrack(values, mask)


def everything() -> FaceTrack:
    """Each FAP 3..68 with values of its own, of both signs."""
    numbers = np.arange(FAP_COUNT)
    swing = np.sin(np.arange(FRAMES)[:, None] / 2 + numbers)
    values = np.rint(swing * (100 + 3 * numbers)).astype(np.int32)
    for name in ("yaw_l_eyeball", "pitch_l_eyeball", "head_pitch", "head_yaw", "head_roll"):
        values[:, fap_numbers()[name] - 1] *= 97
    values[:, :2] = 0
    mask = np.zeros(values.shape, dtype=bool)
    mask[:, 2:] = True
    return FaceTrack(values, mask)


def animation(face: FaceTrack, body: bool = False) -> Animation:
    index = np.array([3, 4, 6, *range(7, 4 + len(face))])
    track = None
    if body:
        values = np.zeros((len(face), BAP_COUNT), dtype=np.int32)
        values[:, 47] = np.linspace(0, 20000, len(face))  # BAP 48, skullbase
        track = BodyTrack(values, np.ones(values.shape, dtype=bool))
    return Animation(Fraction(30000, 1001), index, face, track, "face")


def note(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = document(path.read_bytes())["animations"][0]["extras"]["fba"]["face"]
    return found


def edit_note(path: Path, change: Callable[[dict[str, Any]], object]) -> None:
    edit(path, lambda whole: change(whole["animations"][0]["extras"]["fba"]["face"]))


@pytest.mark.parametrize("body", [False, True])
def test_every_fap_comes_back(tmp_path: Path, body: bool) -> None:
    written = animation(everything(), body)
    fba.write(tmp_path / "a.glb", written)
    back = fba.read(tmp_path / "a.glb")
    assert back.face == written.face
    assert (back.rate, back.index.tolist(), back.name) == (written.rate, written.index.tolist(), "face")
    assert (back.body is not None) == body
    # nearly all by what is to be seen; only where the built-in head does not move, by numbers
    assert len(note(tmp_path / "a.glb")["numbers"]) <= 8


def test_a_skeleton_carries_the_faps_as_numbers(tmp_path: Path) -> None:
    written = animation(everything(), True)
    fba.write(tmp_path / "a.glb", written, mesh=False)
    assert fba.read(tmp_path / "a.glb").face == written.face
    body = replace(BodyModel.default(), eyes=None)
    with pytest.warns(FbaWarning, match="has no position for a face; none is shown"):
        fba.write(tmp_path / "b.glb", written, body=body)
    assert fba.read(tmp_path / "b.glb").face == written.face


def test_a_body_without_a_face_is_read_without_a_face(tmp_path: Path) -> None:
    written = animation(everything(), True)
    fba.write(tmp_path / "a.glb", replace(written, face=None))
    assert fba.read(tmp_path / "a.glb").face is None


def test_it_is_the_motion_that_is_read(tmp_path: Path) -> None:
    """Twice the value at weight 1, and the same weights, are twice the FAP."""
    fba.write(
        tmp_path / "a.glb", animation(face_track({"open_jaw": [0, 480], "raise_l_i_eyebrow": [160, 0]}))
    )
    assert note(tmp_path / "a.glb")["numbers"] == []

    def change(found: dict[str, Any]) -> None:
        found["targets"]["raise_l_i_eyebrow"][1] *= 2

    edit_note(tmp_path / "a.glb", change)
    face = fba.read(tmp_path / "a.glb").face
    assert face.values[:, 2].tolist() == [0, 60, 120, 180, 240, 300, 360, 420, 480]
    assert face.values[:, 30].tolist() == [320, 280, 240, 200, 160, 120, 80, 40, 0]


def test_eyes_and_head_by_their_joints(tmp_path: Path) -> None:
    """FAP 23, in 1e-5 rad, turns the left eye about +y; 48 the head about +x, within what 49 turns."""
    track = face_track({"yaw_l_eyeball": [0, 30000], "head_pitch": [0, 20000], "head_yaw": [0, -40000]})
    fba.write(tmp_path / "a.glb", animation(track))
    gltf = read_gltf(tmp_path / "a.glb")
    last = {
        gltf.nodes[c.node].name: c.values[-1] for c in gltf.animations[0].channels if c.path == "rotation"
    }
    assert last["eye_left_joint"] == pytest.approx([0, math.sin(0.15), 0, math.cos(0.15)], abs=1e-6)
    # yaw -0.4 . pitch 0.2, as a product of quaternions
    (a, b), (c, d) = (math.cos(-0.2), math.sin(-0.2)), (math.cos(0.1), math.sin(0.1))
    assert last["head"] == pytest.approx([a * d, b * c, -b * d, a * c], abs=1e-6)
    assert {entry["node"] for entry in note(tmp_path / "a.glb")["joints"]} == {
        number
        for number, node in enumerate(gltf.nodes)
        if node.name in ("head", "eye_left_joint", "eye_right_joint")
    }
    assert fba.read(tmp_path / "a.glb").face == track


def test_an_eye_pushed_out_and_turned(tmp_path: Path) -> None:
    track = face_track(
        {"thrust_r_eyeball": [0, 100, -50], "pitch_r_eyeball": [0, 30000], "yaw_r_eyeball": [9]}
    )
    fba.write(tmp_path / "a.glb", animation(track))
    assert fba.read(tmp_path / "a.glb").face == track
    assert note(tmp_path / "a.glb")["numbers"] == []


def test_turns_that_a_rotation_does_not_tell(tmp_path: Path) -> None:
    """A head that has turned right round, and a roll past a quarter, look like other turns."""
    track = face_track({"head_yaw": [0, 1_000_000], "head_roll": [0, 200_000]})
    fba.write(tmp_path / "a.glb", animation(track))
    assert fba.read(tmp_path / "a.glb").face == track
    assert {fap for fap, _ in note(tmp_path / "a.glb")["numbers"]} >= {49, 50}


def test_visemes_become_what_they_show(tmp_path: Path) -> None:
    viseme = np.zeros((FRAMES, 4), dtype=np.int16)
    viseme[:, 0], viseme[:, 2] = 4, np.linspace(0, 63, FRAMES)
    mask = np.zeros((FRAMES, FAP_COUNT), dtype=bool)
    mask[:, 0] = True
    track = FaceTrack(np.zeros(mask.shape, dtype=np.int32), mask, viseme)
    fba.write(tmp_path / "a.glb", animation(track))
    back = fba.read(tmp_path / "a.glb").face
    assert not back.mask[:, :2].any()
    shown = resolve(track)
    assert shown[-1].any()
    assert np.abs(back.values - shown).max() <= 0.5
    assert np.abs(resolve(back) - shown).max() <= 0.5


def test_held_and_estimated_faps(tmp_path: Path) -> None:
    """FAP 12 is sent twice; it is kept in between, and its mate 13 follows without being sent."""
    values, mask = np.zeros((FRAMES, FAP_COUNT), dtype=np.int32), np.zeros((FRAMES, FAP_COUNT), dtype=bool)
    values[[0, 5], 11] = 50, -70
    mask[[0, 5], 11] = True
    track = FaceTrack(values, mask)
    fba.write(tmp_path / "a.glb", animation(track))
    back = fba.read(tmp_path / "a.glb").face
    assert back.values[:, 11].tolist() == [50] * 5 + [-70] * 4
    assert back.values[:, 12].tolist() == [50] * 5 + [-70] * 4
    assert not back.values[:, 2:11].any()


def test_only_what_was_sent_is_sent(tmp_path: Path) -> None:
    values, mask = np.zeros((FRAMES, FAP_COUNT), dtype=np.int32), np.zeros((FRAMES, FAP_COUNT), dtype=bool)
    values[:, [2, 47]] = np.arange(FRAMES)[:, None] * [20, -900]
    mask[:, [2, 47]] = True
    track = FaceTrack(values, mask)
    fba.write(tmp_path / "a.glb", animation(track))
    assert fba.read(tmp_path / "a.glb").face == track


def test_targets_that_are_gone(tmp_path: Path) -> None:
    fba.write(tmp_path / "a.glb", animation(face_track({"open_jaw": [0, 480], "head_yaw": [0, 800]})))

    def change(whole: dict[str, Any]) -> None:
        for mesh in whole["meshes"]:
            mesh.get("extras", {}).pop("targetNames", None)

    edit(tmp_path / "a.glb", change)
    with pytest.warns(FbaWarning, match=r"morph targets of FAPs are missing, and taken as 0: open_jaw"):
        face = fba.read(tmp_path / "a.glb").face
    assert not face.values[:, 2].any()
    assert face.values[-1, 48] == 800


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda face: face.update(sent=[2]), r"face\.sent\[0\]: 2 is not within 3\.\.68"),
        (lambda face: face.update(sent=[3] * 69), "69 elements, more than the 68"),
        (lambda face: face["targets"].update(open_jaw=[3]), "expected a FAP and its value"),
        (lambda face: face["targets"].update(open_jaw=[3, 1e300]), "is not within"),
        (lambda face: face["targets"].update(raise_nose=[63, 2**31]), "FAP 63 values that do not fit"),
        (lambda face: face["joints"][0].update(node=10**9), "node: 1000000000 is not within"),
        (lambda face: face["joints"][0].update(rest=[0] * 8), "a list of 9 numbers"),
        (lambda face: face["joints"][0].update(turns=[[49, [0, 0, 0]]]), "does not determine"),
        (
            lambda face: face["joints"][0].update(
                turns=[[49, [0, 1, 0]], [50, [0, 1, 1]]], shifts=[], told=[49, 50]
            ),
            "does not determine",
        ),
        (
            lambda face: face["joints"][0].update(
                turns=[], shifts=[[49, [0, 1, 0]], [50, [0, 2, 0]]], told=[49, 50]
            ),
            "does not determine",
        ),
        (lambda face: face["joints"][0].update(turns=[[49]]), "expected a FAP and its axis"),
        (lambda face: face.update(numbers=[[5]]), "expected a FAP and an accessor"),
        (lambda face: face["joints"][0].update(told=[5]), "does not determine"),
        (lambda face: face.update(numbers=[[5, 10**6]]), "1000000 is not within"),
        (lambda face: face.update(numbers=[[5, 0, 0]]), "more than the 2"),
        (lambda face: face.pop("joints"), "'joints' is missing"),
    ],
)
def test_a_note_that_lies(tmp_path: Path, change: Callable[[dict[str, Any]], object], message: str) -> None:
    track = face_track({"raise_nose": [0, 99], "head_yaw": [0, 800], "head_roll": [5]})
    fba.write(tmp_path / "a.glb", animation(track))
    edit_note(tmp_path / "a.glb", change)
    with pytest.raises((FormatError, ModelError), match=message):
        fba.read(tmp_path / "a.glb")
