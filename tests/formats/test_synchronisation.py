"""A face and a body on one clock: time codes, offsets, rates, and what only one of them covers."""

from fractions import Fraction

import numpy as np
import pytest

from fba import Animation, BodyTrack, FaceTrack
from fba.errors import FbaWarning, FormatError, OptionError
from fba.formats.synchronisation import Recording, join

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
