"""Moving a figure by hand, and recording that, without a window.

What the puppeteer's sliders are: every FAP once, the body within human limits, left and right mirrored.
"""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import fba
from fba.animation import Animation, BodyTrack
from fba.body import BapSolver, Skeleton
from fba.body.solve.limits import JointLimits
from fba.errors import FormatError
from fba.face import resolve
from fba_player._ui.panels._puppet_rows import Group, Row, groups
from fba_player.session._puppet import Expression, Puppet, Viseme
from fba_player.session._takes import TakeRecorder, Takes, take_rate


def played() -> tuple[np.ndarray, np.ndarray]:
    """FAPs 1000 + number, BAPs 2000 + number."""
    return np.arange(1001, 1069, dtype=np.float32), np.arange(2001, 2297, dtype=np.float64)


def shown(puppet: Puppet) -> tuple[np.ndarray, np.ndarray]:
    """What the puppet makes of what is played."""
    faps, baps = played()
    puppet(faps, baps)
    return faps, baps


def test_an_untouched_puppet_changes_nothing() -> None:
    puppet = Puppet()
    faps, baps = shown(puppet)
    assert puppet.idle
    np.testing.assert_array_equal(faps, played()[0])
    np.testing.assert_array_equal(baps, played()[1])


def test_what_is_moved_stays_until_released() -> None:
    puppet = Puppet()
    puppet.move_fap(3, 400)
    puppet.move_bap(32, -5e4)
    faps, baps = shown(puppet)
    assert (faps[2], faps[3], baps[31], baps[32]) == (400, 1004, -5e4, 2033)
    assert (puppet.motion[0][2], puppet.motion[1][31]) == (1003, 2032)  # what is played is still known
    assert puppet.shown[0][2] == 400
    puppet.release(faps=(3,))
    faps, baps = shown(puppet)
    assert (faps[2], baps[31]) == (1003, -5e4)
    puppet.release_all()
    assert puppet.idle


def test_a_viseme_takes_the_mouth_and_leaves_the_brows() -> None:
    puppet = Puppet()
    puppet.viseme = Viseme(10, 0, 63)  # A:
    faps = shown(puppet)[0]
    assert 0 < faps[2] < 1000  # open_jaw as the table has it
    assert faps[30] == 1031  # raise_l_i_eyebrow
    half = Puppet()
    half.viseme = Viseme(10, 0, 21)
    assert shown(half)[0][2] == pytest.approx(faps[2] / 3)


def test_an_expression_is_added_and_a_slider_wins() -> None:
    puppet = Puppet()
    puppet.expression = Expression(6, 63)  # surprise
    raised = shown(puppet)[0][30]
    assert raised > 1031
    puppet.move_fap(31, -7)
    faps = shown(puppet)[0]
    assert (faps[30], faps[31]) == (-7, pytest.approx(raised + 1))
    puppet.release(faps=(31,))
    puppet.expression = Expression(6, 63, 6, 63)  # twice the same is not twice as much
    faps = shown(puppet)[0]
    assert faps[30] == pytest.approx(raised)


@pytest.mark.parametrize("wrong", [lambda: Viseme(15), lambda: Viseme(1, 1, 64), lambda: Expression(7)])
def test_there_are_no_other_visemes_and_expressions(wrong: object) -> None:
    with pytest.raises(ValueError, match="whole number"):
        wrong()  # type: ignore[operator]


def test_there_are_no_other_parameters() -> None:
    puppet = Puppet()
    for number in (0, 1, 2, 69):
        with pytest.raises(ValueError, match="expected a FAP from 3 to 68"):
            puppet.move_fap(number, 1)
    for number, value in ((0, 1.0), (297, 1.0), (1, float("nan"))):
        with pytest.raises(ValueError, match="expected a BAP from 1 to 296"):
            puppet.move_bap(number, value)
    assert puppet.idle


def ramp(recorder: TakeRecorder, moments: np.ndarray) -> None:
    """open_jaw and l_shoulder_flexion go up by 100 and 10000 a second."""
    for moment in moments:
        faps, baps = np.zeros(68, np.float32), np.zeros(296)
        faps[2], baps[31] = 100 * moment, 10000 * moment
        recorder.add(float(moment), faps, baps)


@pytest.mark.parametrize("pictures", [7, 25, 60, 144])
def test_a_take_does_not_depend_on_how_often_it_is_drawn(pictures: int) -> None:
    recorder = TakeRecorder(Fraction(25), body=True)
    ramp(recorder, np.arange(2 * pictures + 1) / pictures)
    take = recorder.take()
    assert (len(take), take.rate) == (51, 25)
    assert take.face.values[:, 2].tolist() == [4 * t for t in range(51)]
    assert take.body.values[:, 31].tolist() == [400 * t for t in range(51)]


def test_where_nothing_was_drawn_nothing_changed() -> None:
    recorder = TakeRecorder(Fraction(25))
    ramp(recorder, np.array([0.0, 2.0]))
    face = recorder.take().face
    assert face.values[:, 2].tolist() == [0] * 50 + [200]


def test_masks_say_all_faps_and_the_baps_that_moved() -> None:
    recorder = TakeRecorder(Fraction(25), body=True)
    ramp(recorder, np.arange(10) / 25)
    take = recorder.take()
    assert (np.flatnonzero(~take.face.mask.any(axis=0)) + 1).tolist() == [1, 2]
    assert (np.flatnonzero(take.body.mask.all(axis=0)) + 1).tolist() == [32, 181, 182, 183, 184, 185, 186]
    assert not take.body.mask[:, 32:180].any()


def test_a_take_of_a_face_has_no_body() -> None:
    recorder = TakeRecorder(Fraction(25))
    ramp(recorder, np.arange(3) / 25)
    assert recorder.take().body is None
    with pytest.raises(ValueError, match="nothing was recorded"):
        TakeRecorder(Fraction(25)).take()
    with pytest.raises(ValueError, match="go back"):
        recorder.add(0.0, np.zeros(68, np.float32), np.zeros(296))


@pytest.mark.parametrize(
    ("rate", "wanted"),
    [
        ("30", "30"),
        ("24000/1001", "24000/1001"),
        ("1", "25"),
        ("500", "25"),
        ("5", "5"),
        ("4", "25"),
        ("120", "120"),
        ("121", "25"),
    ],
)
def test_a_take_has_the_rate_of_the_stream_within_limits(rate: str, wanted: str) -> None:
    assert take_rate(Fraction(rate)) == Fraction(wanted)


def test_a_take_comes_back_from_its_file(tmp_path: Path) -> None:
    recorder = TakeRecorder(Fraction(30), body=True)
    rng = np.random.default_rng(3)
    wanted = np.zeros((40, 68), np.float32)
    wanted[:, 2:] = np.cumsum(rng.integers(-4, 5, (40, 66)), axis=0)
    turned = np.cumsum(rng.integers(-500, 500, (40, 186)), axis=0)
    for frame in range(40):
        recorder.add(frame / 30, wanted[frame], np.r_[turned[frame], np.zeros(110)])
    takes = Takes(tmp_path)
    takes.add(recorder.take())
    path, steps = takes.save("mine")
    assert steps == "iso"
    assert path == tmp_path / "mine.fba"
    back = fba.read(path)
    assert back.rate == 30
    assert back.face is not None
    fap_steps = fba.parameters.fap_steps()
    # predictive coding with the finest quantiser errs by half a step, and one for what was not a whole step
    assert (np.abs(resolve(back.face) - wanted).max(axis=0)[2:] <= fap_steps[2:]).all()
    assert (np.abs(back.body.values[:, :186] - turned) <= fba.parameters.bap_steps()[:186]).all()


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    takes = Takes(tmp_path)
    with pytest.raises(FormatError, match="nothing was recorded"):
        takes.save("mine")
    for height in (100, 200):
        recorder = TakeRecorder(Fraction(25))
        recorder.add(0.0, np.full(68, height, np.float32), np.zeros(296))
        takes.add(recorder.take())
    path, _ = takes.save("mine.fba")
    before = path.read_bytes()
    assert takes.free_name("mine") == "mine-2"
    with pytest.raises(FormatError, match=r"exists already.*mine-2"):
        takes.save("mine")
    assert path.read_bytes() == before
    undone = takes.undo()
    assert undone.face.values[0, 2] == 200
    assert takes.last.face.values[0, 2] == 100
    for name in ("", "  ", "folder/", ".."):
        with pytest.raises(FormatError, match="not a file name"):
            takes.save(name)


def test_an_arm_lifted_high_needs_the_wider_steps(tmp_path: Path) -> None:
    recorder = TakeRecorder(Fraction(25), face=False, body=True)
    for frame in range(5):
        baps = np.zeros(296)
        baps[33] = 232000 - 1000 * frame  # 133 degrees; the first frame goes up to 68 by the standard's steps
        recorder.add(frame / 25, np.zeros(68, np.float32), baps)
    takes = Takes(tmp_path)
    takes.add(recorder.take())
    path, steps = takes.save("lifted")
    assert steps == "visage"
    body = fba.read(path, bap_steps=steps).body
    assert np.abs(body.values[:, 33] - (232000 - 1000 * np.arange(5))).max() <= 170


@pytest.mark.parametrize(("gap", "joined"), [(0.19, True), (0.21, False)])
def test_a_gap_of_a_fifth_of_a_second_is_no_motion(gap: float, joined: bool) -> None:
    """The window was moved or hidden meanwhile: values are held, and jump when it is drawn again."""
    recorder = TakeRecorder(Fraction(100))
    ramp(recorder, np.array([0.0, gap]))
    face = recorder.take().face
    assert face.values[[10, -1], 2].tolist() == [10 * joined, round(100 * gap)]


def test_a_take_ends_after_an_hour() -> None:
    recorder = TakeRecorder(Fraction(5))
    ramp(recorder, np.array([0.0, 3599.0]))
    assert not recorder.full
    ramp(recorder, np.array([3601.0]))
    assert recorder.full
    assert len(recorder) == 3600 * 5 + 1
    ramp(recorder, np.array([1e9]))
    assert len(recorder) == 3600 * 5 + 1


def test_the_mouth_opens_jaw_and_lips_over_what_is_played() -> None:
    puppet = Puppet()
    puppet.mouth_opening = 50
    faps = shown(puppet)[0]
    assert not puppet.idle
    assert (faps[2], faps[4], faps[51], faps[18]) == (1003 + 295, 1005 - 480, 1052 - 480, 1019)
    puppet.release_all()
    assert puppet.idle


def test_every_fap_has_one_slider() -> None:
    numbers = [number for group in groups() if group.kind == "fap" for number in group.numbers]
    assert sorted(numbers) == list(range(3, 69))


def test_faps_that_go_one_way_begin_at_zero() -> None:
    rows = {row.numbers[0]: row for group in groups() if group.kind == "fap" for row in group.rows}
    one_way = [fap.number for fap in fba.parameters.faps() if fap.direction == "U"]
    assert [number for number, row in sorted(rows.items()) if row.low == 0] == one_way
    assert all(row.low in (0, -row.high) for row in rows.values())
    assert (rows[49].unit, rows[49].high) == ("deg", 40)  # the gallery shows 45000e-5 rad, 25.8 degrees


def test_names_are_short_and_tell_sides_apart() -> None:
    for group in groups():
        titles = [row.title for row in group.rows]
        assert len(set(titles)) == len(titles)
        assert max(map(len, titles)) < 24
        for row in group.rows:
            assert row.title.endswith((" L", " R")) == bool(row.side)


def mirrored_rows() -> list[tuple[Group, Row, Row]]:
    return [
        (group, row, group.rows[row.mirror])
        for group in groups()
        for row in group.rows
        if row.kind == "bap" and row.side == "l" and row.mirror is not None
    ]


@pytest.mark.parametrize(
    ("group", "row", "other"), mirrored_rows(), ids=lambda one: getattr(one, "title", "")
)
def test_both_sides_are_mirror_images(group: Group, row: Row, other: Row) -> None:
    skeleton = Skeleton.default()
    solver = BapSolver(skeleton)
    baps = np.zeros(296)
    angle = (row.high if row.high > -row.low else row.low) * 0.8
    for one, sign in ((row, 1.0), (other, -1.0 if row.flipped else 1.0)):
        for number in one.numbers:
            baps[number - 1] = sign * angle / row.scale / len(one.numbers)
    turned, rest = solver.pose(baps), solver.pose(np.zeros(296))
    names = list(skeleton.names)
    moved = 0.0
    for place, name in enumerate(names):
        if name.startswith("l_"):
            left, right = turned[place], turned[names.index("r_" + name[2:])]
            np.testing.assert_allclose(left[:3, 3] * (-1, 1, 1), right[:3, 3], atol=2e-3)
            flip = np.diag([-1.0, 1.0, 1.0])
            np.testing.assert_allclose(flip @ left[:3, :3] @ flip, right[:3, :3], atol=1e-6)
            moved = max(moved, float(np.abs(left - rest[place]).max()))
    assert moved > 0.05


def test_the_body_stays_within_human_limits_and_fits_a_stream() -> None:
    human = {limit.baps for limit in JointLimits.human().limits}
    for end in ("low", "high"):
        baps = np.zeros((2, 296), np.int32)
        limited = np.zeros((2, 296), np.int32)
        for group in groups():
            for row in group.rows:
                if row.kind == "bap":
                    for number in row.numbers:
                        value = round(getattr(row, end) / row.scale / len(row.numbers))
                        baps[1, number - 1] = value
                        if tuple(number - 1 for number in row.numbers) in human:
                            limited[1, number - 1] = value
        assert not JointLimits.human().check(limited[:, :186])
        assert np.count_nonzero(limited[1]) > 40
        take = Animation(25, np.arange(2), body=BodyTrack(baps, np.ones(baps.shape, bool)))  # type: ignore[arg-type]
        assert fba.encode(take, fba.EncoderOptions(bap_steps="visage"))
