"""Tables of blendshapes, written from known weights in all the ways that are found: they come back."""

from pathlib import Path

import numpy as np
import pytest

import fba
from fba.arrays import Float64
from fba.errors import FbaWarning, FormatError, LimitError, OptionError
from fba.formats.face_tables._livelink_csv import read_face
from fba.parameters import fap_numbers
from tools.captures.face_files import ANGLES, STEP, UDP_ORDER, camel, face_angles, face_weights, livelink_csv

ROWS = 90
WEIGHTS = face_weights(ROWS)
TURNS = face_angles(ROWS)


def saved(folder: Path, text: str, name: str = "face.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def shape(path: Path, name: str, **options: str) -> Float64:
    motion = read_face(path, **options)  # type: ignore[arg-type]
    return motion.weights[:, motion.names.index(name)]


def fap(path: Path, name: str) -> Float64:
    return fba.read(path).face.values[:, fap_numbers()[name] - 1].astype(float)


def jaw_forward(weights: Float64) -> dict[str, Float64]:
    """Columns in which a jaw alone moves, to thrust_jaw=400 at weight 1."""
    return {name: weights if name == "JawForward" else 0 * weights for name in UDP_ORDER}


@pytest.mark.parametrize("spelling", [str, camel, str.lower, str.upper])
@pytest.mark.parametrize("count", [51, 52, 61])
def test_names_in_any_case_and_order(tmp_path: Path, spelling: type[str], count: int) -> None:
    columns = {**WEIGHTS, **(TURNS if count == 61 else {})}
    if count == 51:
        del columns["TongueOut"]
    order = np.random.default_rng(count).permutation(list(columns))
    text = livelink_csv({spelling(name): columns[name] for name in order}, code=spelling("Timecode"))
    motion = read_face(saved(tmp_path, "\ufeff" + text), swap="no")
    assert sorted(motion.names) == sorted(camel(name) for name in columns if name not in ANGLES)
    for name in UDP_ORDER[: 51 if count == 51 else 52]:
        np.testing.assert_allclose(
            motion.weights[:, motion.names.index(camel(name))], WEIGHTS[name], atol=1e-9
        )
    assert (motion.head is not None) == (motion.eyes is not None) == (count == 61)


def test_times_are_those_of_the_codes(tmp_path: Path) -> None:
    """601 rows, 1.0016 of a 60th apart, last 10.016 s and not 10."""
    columns = jaw_forward(np.linspace(0, 1, 601))
    path = saved(tmp_path, livelink_csv(columns))
    motion = read_face(path)
    np.testing.assert_allclose(motion.times, np.arange(601) * STEP, atol=2e-5)  # codes have three digits
    assert motion.rate == 60
    assert motion.start == pytest.approx(67_739.66, abs=1e-4)
    animation = fba.read(path)
    assert (animation.rate, int(animation.index[-1])) == (60, 600)
    expected = np.arange(601) / 60 / (600 * STEP) * 400
    jaw = fap(path, "thrust_jaw")
    np.testing.assert_allclose(jaw, expected, atol=1)


def test_another_rate_keeps_the_times(tmp_path: Path) -> None:
    columns = jaw_forward(np.linspace(0, 1, 601))
    path = saved(tmp_path, livelink_csv(columns, step=1 / 60))
    slow = fba.read(path, rate=25)
    assert (slow.rate, slow.index[[0, -1]].tolist()) == (25, [0, 250])
    jaw = slow.face.values[:, fap_numbers()["thrust_jaw"] - 1]
    np.testing.assert_allclose(jaw, np.arange(251) / 250 * 400, atol=1)


@pytest.mark.parametrize(("counted", "rate"), [(60, 60), (30, 30), (25, 25), (24, 24)])
def test_the_rate_that_time_codes_count(tmp_path: Path, counted: int, rate: int) -> None:
    motion = read_face(saved(tmp_path, livelink_csv(WEIGHTS, rate=counted, step=1 / counted)))
    assert motion.rate == rate
    np.testing.assert_allclose(motion.times, np.arange(ROWS) / counted, atol=1e-6)


def test_midnight(tmp_path: Path) -> None:
    motion = read_face(saved(tmp_path, livelink_csv(WEIGHTS, start=86_399.5)))
    np.testing.assert_allclose(motion.times, np.arange(ROWS) * STEP, atol=2e-5)


def test_signs_of_angles(tmp_path: Path) -> None:
    """Up and left are positive for heads, down and right for eyes; FAPs count down, left and right."""
    turns = {name: np.zeros(ROWS) for name in ANGLES}
    for name, value in {
        "HeadYaw": 0.3, "HeadPitch": 0.2, "HeadRoll": 0.1, "LeftEyeYaw": 0.05, "RightEyeYaw": 0.06,
        "LeftEyePitch": 0.07, "RightEyePitch": 0.08,
    }.items():  # fmt: skip
        turns[name] = np.full(ROWS, value)
    path = saved(tmp_path, livelink_csv({**WEIGHTS, **turns}))
    expected = {
        "head_yaw": 30000, "head_pitch": -20000, "head_roll": 10000, "yaw_l_eyeball": -5000,
        "yaw_r_eyeball": -6000, "pitch_l_eyeball": 7000, "pitch_r_eyeball": 8000,
    }  # fmt: skip
    for name, value in expected.items():
        np.testing.assert_allclose(fap(path, name), value, atol=1)


def test_eyes_turn_by_shapes_where_no_angles_are_recorded(tmp_path: Path) -> None:
    still = {name: np.zeros(ROWS) for name in ANGLES}
    look = {**{name: np.zeros(ROWS) for name in UDP_ORDER}, "EyeLookOutLeft": np.full(ROWS, 0.5)}
    path = saved(tmp_path, livelink_csv({**look, **still}))
    with pytest.warns(FbaWarning, match="all angles of head and eyes are 0"):
        face = fba.read(path).face
    assert face.values[:, fap_numbers()["yaw_l_eyeball"] - 1].min() == 28750
    assert not face.mask[:, fap_numbers()["head_yaw"] - 1].any()


def smiling(mouth: float) -> dict[str, Float64]:
    """A smile on the left comes and goes; the mouth goes left along with it by `mouth`, else right."""
    wave = 0.5 + 0.5 * np.sin(np.arange(ROWS) / 9)
    columns = {name: np.zeros(ROWS) for name in UDP_ORDER}
    columns["MouthSmileLeft"] = wave
    columns["MouthLeft"] = np.maximum(mouth, 0) * wave
    columns["MouthRight"] = np.maximum(-mouth, 0) * wave
    return columns


APP_ORDER = [name for name in UDP_ORDER if name not in ("MouthLeft", "JawLeft")]
for _left, _right in (("MouthLeft", "MouthRight"), ("JawLeft", "JawRight")):
    APP_ORDER.insert(APP_ORDER.index(_right) + 1, _left)


@pytest.mark.parametrize(
    ("mouth", "order", "swap", "changed"),
    [
        (0.4, UDP_ORDER, "auto", False),
        (-0.4, UDP_ORDER, "auto", True),
        (0.4, APP_ORDER, "auto", False),
        (-0.4, APP_ORDER, "auto", True),
        (0.0, UDP_ORDER, "auto", False),
        (0.0, APP_ORDER, "auto", True),
        (0.4, UDP_ORDER, "yes", True),
        (-0.4, APP_ORDER, "no", False),
    ],
)
def test_mouths_that_go_to_the_wrong_side(
    tmp_path: Path, mouth: float, order: list[str], swap: str, changed: bool
) -> None:
    columns = smiling(mouth)
    columns["JawLeft"] = np.full(ROWS, 0.7)
    path = saved(tmp_path, livelink_csv({name: columns[name] for name in order}))
    motion = read_face(path, swap=swap)
    jaw = motion.weights[:, motion.names.index("jawRight" if changed else "jawLeft")]
    np.testing.assert_allclose(jaw, 0.7, atol=1e-9)
    assert any("the other way round" in finding for finding in motion.findings) == changed


def test_tables_of_other_programs(tmp_path: Path) -> None:
    """Seconds, milliseconds and numbers of frames; MediaPipe's names; semicolons and decimal commas."""
    names = ["_neutral", *(camel(name) for name in UDP_ORDER if name != "TongueOut")]
    rows = [[f"{0.01 * (row + column):.4f}" for column in range(len(names))] for row in range(40)]
    for head, cell in (
        ("timestamp", lambda row: f"{row / 30:.6f}"),
        ("time_ms", lambda row: f"{row * 1000 / 30:.3f}"),
    ):
        lines = [",".join([head, *names]), *(",".join([cell(n), *row]) for n, row in enumerate(rows))]
        motion = read_face(saved(tmp_path, "\r\n".join(lines)))
        assert motion.rate == 30
        np.testing.assert_allclose(motion.times, np.arange(40) / 30, atol=1e-5)
        assert "tongueOut" not in motion.names
        assert len(motion.names) == 51
        np.testing.assert_allclose(motion.weights[:, 0], 0.01 * (np.arange(40) + 1), atol=1e-9)
    semicolons = [";".join(["time", *names])]
    semicolons += [";".join([f"{n / 25:.3f}", *row]).replace(".", ",") for n, row in enumerate(rows)]
    motion = read_face(saved(tmp_path, "\n".join(semicolons)))
    assert motion.rate == 25
    np.testing.assert_allclose(motion.weights[:, 0], 0.01 * (np.arange(40) + 1), atol=1e-9)
    bare = [",".join(names), *(",".join(row) for row in rows)]
    path = saved(tmp_path, "\n".join(bare))
    with pytest.raises(
        FormatError, match=r"has no column of times.*give the rate of its rows with source_rate=30"
    ):
        fba.read(path)
    assert fba.read(path, source_rate=50).rate == 50


@pytest.mark.filterwarnings("ignore:eyes that turn further:fba.errors.FbaWarning")
def test_emotions_beside_the_shapes_are_left_out_and_named(tmp_path: Path) -> None:
    text = livelink_csv({**WEIGHTS, "Angry": np.ones(ROWS), "Happy": np.ones(ROWS)})
    path = saved(tmp_path, text)
    with pytest.warns(FbaWarning, match="mean nothing here are left out: Angry, Happy"):
        with_emotions = fba.read(path)
    assert with_emotions == fba.read(saved(tmp_path, livelink_csv(WEIGHTS), "b.csv"))


def test_rows_without_numbers_are_bridged(tmp_path: Path) -> None:
    ramp = jaw_forward(np.arange(ROWS) / ROWS)
    lines = livelink_csv(ramp, step=1 / 60).splitlines()
    for row in (10, 11, 12):
        cells = lines[row + 1].split(",")
        cells[2:] = ["", "NaN"] * 26
        lines[row + 1] = ",".join(cells)
    path = saved(tmp_path, "\n".join(lines))
    with pytest.warns(FbaWarning, match=r"3 of 90 rows have no face.*|0\.07 s after 0\.15 s"):
        jaw = fap(path, "thrust_jaw")
    np.testing.assert_allclose(jaw, np.arange(ROWS) / ROWS * 400, atol=1)
    assert read_face(path).describe()["unseen"] == 3


def test_a_long_gap_holds_and_then_goes_over(tmp_path: Path) -> None:
    columns = jaw_forward(np.repeat([0.0, 1.0], [30, 30]))
    lines = livelink_csv(columns, step=1 / 60, start=0.0).splitlines()
    late = livelink_csv(columns, step=1 / 60, start=2.0).splitlines()
    path = saved(tmp_path, "\n".join([*lines[:31], *late[31:]]))
    with pytest.warns(FbaWarning, match=r"frames are missing: 2\.02 s after 0\.48 s"):
        jaw = fap(path, "thrust_jaw")
    assert read_face(path).describe()["gaps"] == [[0.483, 2.017]]
    assert not jaw[: 2 * 60 + 30 - 12].any()  # 0.2 s before the face is back
    assert 0 < jaw[2 * 60 + 30 - 6] < 400
    assert (jaw[2 * 60 + 30 :] == 400).all()


@pytest.mark.filterwarnings("ignore:eyes that turn further:fba.errors.FbaWarning")
def test_a_row_that_was_cut_off(tmp_path: Path) -> None:
    path = saved(tmp_path, livelink_csv(WEIGHTS)[:-200])
    with pytest.warns(FbaWarning, match="the last row is incomplete"):
        assert len(fba.read(path)) == ROWS - 1


def broken(line: int, old: str, new: str) -> str:
    lines = livelink_csv(WEIGHTS, start=0.0).splitlines()
    assert old in lines[line - 1]
    lines[line - 1] = lines[line - 1].replace(old, new, 1)
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (broken(5, "00:00:00:03", "00:00:00:01"), r"face\.csv:5: the row is 0\.0.* s before the one before"),
        (broken(5, "00:00:00:03", "noon"), r"face\.csv:5: this is no time code.*found 'noon"),
        (broken(7, ",52,", ",52,wide,"), r"face\.csv:7: the row has 55 cells, and the header 54 names"),
        (broken(7, ",0.", ",x0."), r"face\.csv:7: column 'EyeBlinkLeft' holds no number"),
        (broken(7, ",0.", ",61."), r"face\.csv:7: eyeBlinkLeft has the weight 61\..*are these percent\?"),
        (broken(1, "EyeBlinkLeft", "JawOpen"), r"face\.csv:1: columns 'JawOpen' and 'JawOpen' are one shape"),
        (livelink_csv(WEIGHTS).split("\n", 1)[0], r"has no row behind the header"),
        (livelink_csv({"mouth open": np.ones(3)}), r"is in no format known here"),
        ("a,b\n1,2\n3,4\n", r"is in no format known here"),
    ],
)
def test_damaged_tables_are_refused(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(FormatError, match=said):
        fba.read(saved(tmp_path, text))


def test_a_face_that_is_never_seen(tmp_path: Path) -> None:
    lines = livelink_csv(WEIGHTS).splitlines()
    empty = [",".join([*line.split(",")[:2], *[""] * 52]) for line in lines[1:]]
    with (
        pytest.warns(FbaWarning, match="90 of 90 rows"),
        pytest.raises(FormatError, match=r"face\.csv: no face is seen in any of the 90 rows"),
    ):
        fba.read(saved(tmp_path, "\n".join([lines[0], *empty])))


def test_options_and_limits(tmp_path: Path) -> None:
    path = saved(tmp_path, livelink_csv(WEIGHTS))
    with pytest.raises(OptionError, match="swap must be one of auto, yes, no, not 'left'"):
        fba.read(path, swap="left")
    with pytest.raises(LimitError, match=r"face\.csv: .*`frames`"):
        fba.read(path, limits=fba.Limits(frames=50))
    with pytest.raises(LimitError, match=r"face\.csv: .*`frames`"):
        fba.read(path, rate=1000, limits=fba.Limits(frames=200))
