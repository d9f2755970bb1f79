"""Time codes and times of day; a face and a body on one clock: offsets, rates, what only one covers."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fba import Animation, BodyTrack, FaceTrack
from fba.capture.markers._motion import MarkerMotion
from fba.errors import FbaWarning, FormatError, OptionError
from fba.formats import format_of
from fba.formats.synchronisation import Recording, join
from fba.formats.text.frame_rates import format_rate, parse_rate
from fba.formats.time_codes import parse_time_code, parse_time_of_day, read_time_codes, seconds_between
from fba.sampling import regular_times
from tools.captures import marker_files


def times_of(*codes: str) -> tuple[list[float], Fraction, float]:
    found = read_time_codes(codes, range(2, 2 + len(codes)), "a.csv")
    return found.seconds.tolist(), found.rate, found.start


def test_drop_frame_goes_with_the_clock() -> None:
    """Behind 00:00:59;29 comes 00:01:00;02, a 30000/1001th later; an hour of codes is 3599.9964 s."""
    times, rate, start = times_of("00:00:59;29", "00:01:00;02", "00:01:00;03", "00:10:00;00", "01:00:00;00")
    assert rate == Fraction(30000, 1001)
    np.testing.assert_allclose(np.diff(times)[:2], 1001 / 30000, atol=1e-9)
    assert start + times[3] == pytest.approx(17982 * 1001 / 30000)  # frames of ten minutes
    assert start + times[4] == pytest.approx(3599.9964)


def test_colons_count_every_frame() -> None:
    times, rate, start = times_of("00:00:59:29", "00:01:00:00", "00:01:00:15.5")
    assert (rate, start) == (30, pytest.approx(59 + 29 / 30))
    np.testing.assert_allclose(times, [0, 1 / 30, 16.5 / 30], atol=1e-9)


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("24:00:00:00", "a time that no clock shows"),
        ("12:60:00:00", "a time that no clock shows"),
        ("12:00:60:00", "a time that no clock shows"),
        ("12:00", "no time code"),
    ],
)
def test_no_time_codes(code: str, message: str) -> None:
    with pytest.raises(FormatError, match=rf"a\.csv:3: this is {message}; expected HH:MM:SS:FF\.fff"):
        times_of("12:00:00:00", code)
    assert parse_time_code(code) is None


def test_single_codes() -> None:
    assert parse_time_code("18:48:59:30") == pytest.approx(67739.5)
    assert parse_time_code("18:48:59:12", Fraction(24)) == pytest.approx(67739.5)
    assert parse_time_code("01:00:00;00", Fraction(30000, 1001)) == pytest.approx(3599.9964)
    assert parse_time_code("18:48:59:24", Fraction(24)) is None


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("2018-05-18 12.06.28.340 PM", 43588.34),
        ("2018-05-18 12.06.28.340 AM", 388.34),
        ("2018-05-18 01.06.28.340 PM", 47188.34),
        ("2022-06-03, 10:47:36.627", 38856.627),
        ("2022-06-03, 10:47:36", None),  # to the second: too coarse
        ("2022-06-03, 25:47:36.5", None),
        ("", None),
    ],
)
def test_times_of_day(text: str, seconds: float | None) -> None:
    found = parse_time_of_day(text)
    assert found == (None if seconds is None else pytest.approx(seconds))


def test_times_on_both_sides_of_midnight() -> None:
    assert seconds_between(86399.0, 2.5) == pytest.approx(3.5)
    assert seconds_between(2.5, 86399.0) == pytest.approx(-3.5)
    assert seconds_between(100.0, 130.0) == pytest.approx(30.0)


@pytest.mark.filterwarnings("ignore:.*without a label")
def test_when_takes_of_markers_begin(tmp_path: Path) -> None:
    positions = np.arange(60.0).reshape(5, 4, 3) / 100
    motion = MarkerMotion(tuple("ABCD"), positions, regular_times(5, Fraction(25), 1.0), Fraction(25))

    def start(name: str, *changes: tuple[bytes, bytes]) -> float | None:
        path = marker_files.write(tmp_path, name, motion)
        data = path.read_bytes()
        for old, new in changes:
            assert old in data
            data = data.replace(old, new)
        path.write_bytes(data)
        reader = format_of(path)
        return reader.read_face(path).start

    stamp = (b"Take Name,smile", b"Take Name,smile,Capture Start Time,2018-05-18 12.06.28.340 PM")
    assert start("motive.csv") is None
    assert start("motive.csv", stamp) == pytest.approx(43589.34)  # its first frame is at 1.00 s
    assert start("motive_code.csv", stamp) == pytest.approx(15 * 3600 + 26 * 60 + 46, abs=0.01)
    assert start("motive_code.csv", stamp, (b"15:26:46", b"code")) == pytest.approx(43589.34)
    assert start("qualisys.tsv") == pytest.approx(43200)
    assert start("usual.trc") is None


@pytest.mark.parametrize(
    ("text", "rate"),
    [
        ("25", Fraction(25)),
        ("25.0", Fraction(25)),
        ("12.5", Fraction(25, 2)),
        ("29.97", Fraction(30000, 1001)),
        (29.97, Fraction(30000, 1001)),
        ("23.976", Fraction(24000, 1001)),
        ("23.98", Fraction(24000, 1001)),
        ("59.94", Fraction(60000, 1001)),
        ("2997/100", Fraction(2997, 100)),
        ("30000/1001", Fraction(30000, 1001)),
        (".5", Fraction(1, 2)),
        (Fraction(1, 3), Fraction(1, 3)),
        (30, Fraction(30)),
    ],
)
def test_parse(text: str | float | Fraction, rate: Fraction) -> None:
    assert parse_rate(text) == rate


@pytest.mark.parametrize(
    "text",
    [
        "",
        "0",
        "0.0",
        "-25",
        "nan",
        "inf",
        "1e3",
        "1/0",
        "25fps",
        "2 5",
        "1_0",
        "٣",
        0,
        -1,
        float("nan"),
        "9" * 5000,
    ],
)
def test_invalid_rates_are_refused(text: str | float) -> None:
    with pytest.raises(FormatError):
        parse_rate(text)


@pytest.mark.parametrize(
    ("rate", "text"),
    [
        (Fraction(25), "25"),
        (Fraction(30000, 1001), "29.97"),
        (Fraction(24000, 1001), "23.976"),
        (Fraction(25, 2), "12.5"),
        (Fraction(2997, 100), "2997/100"),
        (Fraction(1, 3), "1/3"),
    ],
)
def test_format(rate: Fraction, text: str) -> None:
    assert format_rate(rate) == text


@given(st.fractions(Fraction(1, 1000), 10**9, max_denominator=10**9))
def test_text_reads_back_exactly(rate: Fraction) -> None:
    assert parse_rate(format_rate(rate)) == rate


JAW, TURN = 2, 183


def face(seconds: float = 4.0, rate: int = 60, start: float | None = None) -> Recording:
    """The jaw opens by 100 a second."""
    count = round(seconds * rate)
    values = np.zeros((count, 68), np.int32)
    values[:, JAW] = np.rint(np.arange(count) * 100 / rate)
    mask = np.zeros((count, 68), bool)
    mask[:, JAW] = True
    return Recording("a.csv", Animation(Fraction(rate), np.arange(count), FaceTrack(values, mask)), start)


def body(seconds: float = 4.0, rate: int = 60, start: float | None = None) -> Recording:
    """The body turns by 1000 a second."""
    count = round(seconds * rate)
    values = np.zeros((count, 296), np.int32)
    values[:, TURN] = np.rint(np.arange(count) * 1000 / rate)
    mask = np.zeros((count, 296), bool)
    mask[:, TURN] = True
    animation = Animation(Fraction(rate), np.arange(count), None, BodyTrack(values, mask))
    return Recording("b.bvh", animation, start)


def difference(animation: Animation) -> float:
    """Return by how many seconds the body begins after the face, as their values say."""
    both = animation.face.mask[:, JAW] & animation.body.mask[:, TURN]
    late = animation.face.values[both, JAW] / 100 - animation.body.values[both, TURN] / 1000
    assert np.ptp(late) < 0.011  # one unit of the jaw
    return float(np.median(late))


def test_both_begin_together() -> None:
    result = join(face(), body(2.0))
    assert (result.how, len(result.animation), result.start) == ("offset", 240, None)
    assert difference(result.animation) == pytest.approx(0)
    assert result.spans == ((0.0, 4.0), (0.0, 2.0))


@pytest.mark.parametrize("later", [0.5, 0.507, 1.2345, -0.7, -1.2345])
@pytest.mark.parametrize("first", ["face", "body"])
def test_an_offset(later: float, first: str) -> None:
    """To a hundredth of a second, between frames, too; the body's frames stay as they are."""
    inputs = (face(), body()) if first == "face" else (body(), face())
    result = join(*inputs, offset=later)
    expected = later if first == "face" else -later
    assert difference(result.animation) == pytest.approx(expected, abs=0.0045)
    assert int(result.animation.index[0]) == 0
    turns = result.animation.body.values[result.body_rows, TURN]
    np.testing.assert_array_equal(turns, body().animation.body.values[:, TURN])  # type: ignore[union-attr]


def test_time_codes() -> None:
    result = join(face(start=100.25), body(start=101.0))
    assert (result.how, result.start) == ("timecode", pytest.approx(100.25))
    assert difference(result.animation) == pytest.approx(0.75)
    assert result.common == (pytest.approx(0.75), pytest.approx(4.0))
    assert difference(join(face(start=100.25), body(start=101.0), sync="offset").animation) == 0
    assert difference(join(face(start=100.25), body(), begins=101.0).animation) == pytest.approx(0.75)


def test_midnight_lies_between() -> None:
    result = join(face(start=86_399.0), body(start=0.5))
    assert difference(result.animation) == pytest.approx(1.5)
    assert join(body(start=0.5), face(start=86_399.0)).start == pytest.approx(86_399.0)


def test_frames_that_only_one_recording_covers() -> None:
    """It is kept, and the other part not sent; with trim it is left out."""
    result = join(face(2.0), body(2.0), offset=1.0)
    animation = result.animation
    assert len(animation) == 180
    assert np.flatnonzero(animation.face.mask[:, JAW]).tolist() == list(range(120))
    assert np.flatnonzero(animation.body.mask[:, TURN]).tolist() == list(range(60, 180))
    assert (result.body_rows, result.body_lead) == (slice(60, 180), 0)
    trimmed = join(face(2.0), body(2.0), offset=1.0, trim=True)
    assert len(trimmed.animation) == 60
    assert difference(trimmed.animation) == pytest.approx(1.0)
    assert (trimmed.body_rows, trimmed.body_lead) == (slice(0, 60), 0)
    trimmed = join(face(2.0), body(2.0), offset=-0.5, trim=True)
    assert (trimmed.body_rows, trimmed.body_lead, len(trimmed.animation)) == (slice(0, 90), 30, 90)


@pytest.mark.parametrize(("one", "other"), [(60, 30), (25, 120)])
def test_rates_become_the_higher_one(one: int, other: int) -> None:
    result = join(face(rate=one), body(rate=other), offset=0.4)
    assert result.animation.rate == max(one, other)
    assert difference(result.animation) == pytest.approx(0.4, abs=0.011)
    assert list(result.resampled.values()) == [min(one, other)]


def test_no_common_moment() -> None:
    spans = r"a\.csv lasts from 00:01:40\.25 to 00:01:44\.25, b\.bvh lasts from 00:02:00\.00 to 00:02:04\.00"
    with pytest.raises(FormatError, match=spans + ": they share no moment.*sync='offset'"):
        join(face(start=100.25), body(start=120.0))
    with pytest.raises(FormatError, match=r"b\.bvh lasts from 4\.00 s to 8\.00 s: they share no moment$"):
        join(face(), body(), offset=4.0)


def test_missing_time_codes() -> None:
    with pytest.warns(FbaWarning, match=r"no time code in b\.bvh: both begin together.*offset=2\.4"):
        result = join(face(start=100.25), body(), sync="timecode")
    assert difference(result.animation) == 0
    assert join(body(), face(start=100.25), offset=-1.0).start == pytest.approx(100.25)
    with pytest.raises(OptionError, match=r"a\.csv has no time code; give the offset in seconds"):
        join(face(), body(), begins=3.0)
    with pytest.raises(OptionError, match="sync must be one of timecode, offset"):
        join(face(), body(), sync="clock")
