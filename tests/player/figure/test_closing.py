"""What closes is closed, and what is inside stays inside: lips, lids, tongue and teeth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fba
from fba import figures
from fba.animation import Animation, BodyTrack
from fba.arrays import Float32
from fba.body import BodyModel
from fba.face import Deformer, FaceModel, resolve
from fba.face.macros import open_mouth
from fba.parameters import BAP_COUNT, baps, point_rows
from fba.parameters import faps as parameters
from fba.player import Offscreen
from fba_player._figure.face import FaceFigure
from tools.figure_checks import SAMPLES, Checked, main, pierced

SEEN = 12
"""Frames of a stream that are looked at."""
OPEN = {number: float(value) for number, value in enumerate(open_mouth(100), 1) if value}
TONGUE = (43, 44, 45, 46)


def vector(values: dict[int, float]) -> Float32:
    result = np.zeros(68, dtype=np.float32)
    for number, value in values.items():
        result[number - 1] = value
    return result


@pytest.fixture(scope="module")
def checked() -> Checked:
    return Checked(FaceModel.default(), BodyModel.default())


@pytest.fixture(scope="module")
def figure(checked: Checked) -> FaceFigure:
    return checked.figure


@pytest.mark.usefixtures("opengl")
@pytest.mark.parametrize("lines", [360, 720, 1080])
@pytest.mark.parametrize(
    "pose", [{}, {5: 60, 10: 60, 11: 60, 4: 60, 8: 60, 9: 60}, {6: 150, 7: 150, 12: 90, 13: 90}]
)
def test_closed_lips_show_nothing_of_the_mouth(checked: Checked, lines: int, pose: dict[int, float]) -> None:
    """Pictures of a whole person are equal, whatever colour walls of the mouth, teeth and tongue have."""
    plain, shining = checked.person(), checked.person(bright=checked.mouth())
    size, faps = (lines * 16 // 9, lines), vector(pose)
    camera = plain.camera("body", 16 / 9)
    with Offscreen(plain, size, camera) as one, Offscreen(shining, size, camera) as other:
        for yaw, pitch in ((0, 0), (25, 0), (-35, 15), (60, 0)):
            one.camera = other.camera = replace(camera, yaw=yaw, pitch=pitch)
            np.testing.assert_array_equal(one.still(faps), other.still(faps))


@pytest.mark.parametrize("split", [(1024, 0), (512, 512), (700, 324)])
def test_lids_meet_along_their_whole_length(checked: Checked, split: tuple[int, int]) -> None:
    upper, lower = split
    assert checked.lid_gap(vector({19: upper, 20: upper, 21: lower, 22: lower})) < 0.0002


def tongue_poses() -> Iterator[dict[int, float]]:
    for mouth in ({}, {3: 600}, OPEN):
        for number in TONGUE:
            for value in (-1080, -500, -150, 150, 500, 800, 1080):
                yield {**mouth, number: value}
        yield {**mouth, 43: -900, 44: 800, 45: 900}
        yield {**mouth, 44: -900, 45: 900, 46: 400}


@pytest.mark.slow
def test_the_tongue_pierces_no_skin(checked: Checked, figure: FaceFigure) -> None:
    edges, skin = checked.inner_edges(), checked.outer_skin()
    for values in tongue_poses():
        assert pierced(figure.pose(vector(values)).positions, edges, skin) == 0, values


def test_closed_lips_hold_the_tongue_back(figure: FaceFigure) -> None:
    lips = figure.model.bound[[point_rows()["2.2"], point_rows()["2.3"]]]
    tongue = figure.rows("tongue")
    for values in ({45: 1080}, {3: 600, 45: 800}, {44: 500, 45: 500}):
        positions = figure.pose(vector(values)).positions
        assert positions[tongue, 2].max() < positions[lips, 2].min()
    out = figure.pose(vector({**OPEN, 45: 1080})).positions
    assert out[tongue, 2].max() > out[lips, 2].max() + 0.015


def test_a_tongue_that_is_out_lies_on_the_lower_lip(figure: FaceFigure) -> None:
    lower = int(figure.model.bound[point_rows()["2.3"]])
    positions = figure.pose(vector({**OPEN, 45: 900})).positions
    tongue = positions[figure.rows("tongue")] - positions[lower]
    below = (np.abs(tongue[:, 0]) < 0.004) & (np.abs(tongue[:, 2]) < 0.008) & (tongue[:, 1] < 0.004)
    ahead, height = tongue[below][np.argsort(tongue[below, 2])][:, [2, 1]].T
    assert ahead[0] < 0 < ahead[-1]
    assert 0 <= np.interp(0.0, ahead, height) < 0.001


def test_a_tongue_that_rests_stays_where_its_tables_put_it(figure: FaceFigure) -> None:
    values = vector({3: 400, 5: -300})
    rows = figure.rows("tongue")
    np.testing.assert_array_equal(
        figure.pose(values).positions[rows], Deformer(figure.model).local(values)[rows]
    )


def test_lids_follow_the_gaze_unless_they_are_closed(figure: FaceFigure) -> None:
    upper = int(figure.model.bound[point_rows()["3.1"]])
    rest, down, up = (
        figure.pose(vector({25: way, 26: way})).positions[upper, 1] for way in (0, 25000, -25000)
    )
    assert down < rest - 0.001
    assert up > rest + 0.001
    shut = {19: 1024, 20: 1024}
    closed, looking = (figure.pose(vector({**shut, 25: way})).positions for way in (0, 25000))
    np.testing.assert_array_equal(closed[upper], looking[upper])


@pytest.mark.parametrize("name", list(figures.FIGURES))
@pytest.mark.parametrize("numbers", [(16,), (17,), (39, 40)])
def test_lips_and_cheeks_drawn_in_stop_before_what_is_inside(name: str, numbers: tuple[int, ...]) -> None:
    checked = Checked(figures.face(name), figures.body(name))
    edges, skin = checked.inner_edges(), checked.outer_skin()
    for value in (-1080, -450, -400, -300):
        values = vector(dict.fromkeys(numbers, float(value)))
        assert pierced(checked.figure.pose(values).positions, edges, skin) == 0, value


@pytest.mark.parametrize("sample", ["hello.fap"])
def test_frames_of_a_stream_keep_tongue_and_teeth_inside(
    checked: Checked, figure: FaceFigure, sample: str
) -> None:
    edges, skin = checked.inner_edges(), checked.outer_skin()
    animation = fba.read(SAMPLES / sample)
    assert animation.face is not None
    frames = resolve(animation.face, figure.model)
    for frame in np.random.default_rng(30).choice(len(frames), SEEN, replace=False):
        assert pierced(figure.pose(frames[frame].astype(np.float32)).positions, edges, skin) == 0, frame


@pytest.mark.slow
def test_faps_of_the_mouth_keep_tongue_and_teeth_inside(checked: Checked, figure: FaceFigure) -> None:
    edges, skin = checked.inner_edges(), checked.outer_skin()
    for parameter in parameters()[2:]:
        if parameter.group not in (2, 8):
            continue
        for value in (-200, 200):
            positions = figure.pose(vector({parameter.number: value})).positions
            assert pierced(positions, edges, skin) == 0, (parameter.number, value)


@pytest.mark.parametrize(("check", "code"), [("lids", 0), ("hands", 0)])
def test_the_command_fails_where_it_finds_something(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], check: str, code: int
) -> None:
    """Arms that hang and turn inwards at the shoulder by 20 degrees go through the thighs."""
    turned = {"l_shoulder_abduct": -35_000, "r_shoulder_abduct": 35_000}
    values = np.zeros((1, BAP_COUNT), np.int32)
    for bap in baps():
        values[0, bap.number - 1] = turned.get(bap.name, 0)
    assert values.any()
    body = BodyTrack(values, np.ones((1, BAP_COUNT), bool))
    fba.write(tmp_path / "inwards.bap", Animation(25, np.arange(1), None, body))
    assert main(["--only", check, str(SAMPLES / "hello.fap"), str(tmp_path / "inwards.bap")]) == code
    assert ("nothing found" in capsys.readouterr().out) == (code == 0)
