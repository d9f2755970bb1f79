"""The data model: what it accepts, that it cannot be changed, slices, joins, resampling."""

import math
import re
import sys
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fba import Animation, BodyTrack, FaceTrack, Frame, OptionError

FACE, BODY = 68, 296


def face(count: int, **fields: object) -> FaceTrack:
    values = np.zeros((count, FACE), dtype=np.int32)
    values[:, 2] = np.arange(count) * 10
    mask = np.zeros((count, FACE), dtype=bool)
    mask[:, :3] = True
    return FaceTrack(values, mask, **fields)  # type: ignore[arg-type]


def body(count: int) -> BodyTrack:
    values = np.zeros((count, BODY), dtype=np.int32)
    values[:, 0] = np.arange(count) * -7
    mask = np.zeros((count, BODY), dtype=bool)
    mask[:, 0] = True
    return BodyTrack(values, mask)


def animation(count: int = 4, start: int = 0, rate: Fraction | int = 25) -> Animation:
    return Animation(Fraction(rate), np.arange(start, start + count), face(count), body(count), "test")


def test_what_was_not_sent_is_0() -> None:
    values = np.full((2, BODY), 5, dtype=np.int32)
    mask = np.zeros((2, BODY), dtype=bool)
    mask[0, 3] = True
    track = BodyTrack(values, mask)
    assert (track.values.sum(), track.values[0, 3]) == (5, 5)
    assert (values == 5).all()  # the caller's array is not touched
    fields = np.ones((2, 4), dtype=np.int16)
    assert not FaceTrack(
        np.zeros((2, FACE), dtype=np.int32), np.zeros((2, FACE), dtype=bool), fields
    ).viseme.any()


def test_nothing_of_it_can_be_changed() -> None:
    values, mask = np.zeros((2, BODY), dtype=np.int32), np.ones((2, BODY), dtype=bool)
    index = np.arange(2)
    whole = Animation(Fraction(25), index, None, BodyTrack(values, mask))
    values[0, 0] = index[0] = 9
    mask[0, 0] = False
    track = whole.body
    assert (track.values[0, 0], track.mask[0, 0], whole.index[0]) == (0, True, 0)
    for array in (track.values, track.mask, whole.index, whole[:1].index):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    with pytest.raises(AttributeError):
        whole.rate = Fraction(1)  # type: ignore[misc]
    with pytest.raises(AttributeError):
        track.values = values  # type: ignore[misc]
    with pytest.raises(TypeError, match="unhashable"):
        hash(whole)


@pytest.mark.parametrize(
    ("values", "mask", "message"),
    [
        (np.zeros((2, 67), dtype=np.int32), np.zeros((2, 67), dtype=bool), r"shape \(T, 68\), not \(2, 67\)"),
        (np.zeros(68, dtype=np.int32), np.zeros(68, dtype=bool), r"shape \(T, 68\), not \(68,\)"),
        (np.zeros((2, 68)), np.zeros((2, 68), dtype=bool), "must be integers, not float64"),
        (np.full((2, 68), np.nan), np.zeros((2, 68), dtype=bool), "must be integers"),
        (np.zeros((2, 68), dtype=np.int32), np.zeros((2, 68), dtype=int), "mask must be bool, not int64"),
        (np.zeros((2, 68), dtype=np.int32), np.zeros((3, 68), dtype=bool), r"mask has shape \(3, 68\)"),
        (np.full((2, 68), 2**31), np.ones((2, 68), dtype=bool), "must fit int32: found 2147483648"),
        (np.ones((2, 68), dtype=np.int32), np.ones((2, 68), dtype=bool), "columns 0 and 1"),
    ],
)
def test_wrong_tracks(values: np.ndarray, mask: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        FaceTrack(values, mask)


@pytest.mark.parametrize(
    ("field", "column", "value", "message"),
    [
        ("viseme", 0, 15, r"viseme_select1 must lie in 0\.\.14, found 15"),
        ("viseme", 1, -1, r"viseme_select2 must lie in 0\.\.14, found -1"),
        ("viseme", 3, 2, r"viseme_def must lie in 0\.\.1, found 2"),
        ("expression", 0, 7, r"expression_select1 must lie in 0\.\.6, found 7"),
        ("expression", 2, 7, r"expression_select2 must lie in 0\.\.6, found 7"),
        ("expression", 4, 2, r"init_face must lie in 0\.\.1, found 2"),
        ("expression", 5, -1, r"expression_def must lie in 0\.\.1, found -1"),
        ("expression", 1, 40_000, "must fit int16"),
    ],
)
def test_wrong_fields(field: str, column: int, value: int, message: str) -> None:
    fields = np.zeros((2, 4 if field == "viseme" else 6), dtype=np.int64)
    fields[1, column] = value
    with pytest.raises(ValueError, match=message):
        face(2, **{field: fields})
    with pytest.raises(ValueError, match="must have shape"):
        face(3, **{field: np.zeros_like(fields)})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0, [0, 1], face(2)), "frame rate must be positive, not 0"),
        ((-25, [0, 1], face(2)), "frame rate must be positive"),
        ((25, [0, 0], face(2)), "index must increase, but frame 1 has 0 after 0"),
        ((25, [0, 5, 4], face(3)), "frame 2 has 4 after 5"),
        ((25, [[0, 1]], face(2)), r"shape \(T,\)"),
        ((25, [0.0, 1.5], face(2)), "index must be integers"),
        ((25, [0, 1]), "needs a face track, a body track, or both"),
        ((25, [0, 1, 2], face(2)), "3 frame indices, but 2 face frames"),
        ((25, [0, 1, 2], None, body(2)), "3 frame indices, but 2 body frames"),
    ],
)
def test_wrong_animations(arguments: tuple[object, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Animation(*arguments)  # type: ignore[arg-type]


def test_frames_and_slices() -> None:
    whole = animation(6, start=10)
    assert whole.duration == Fraction(6, 25)
    assert np.allclose(whole.times, np.arange(10, 16) / 25)
    frame = whole[-2]
    assert (frame.index, frame.time) == (14, Fraction(14, 25))
    assert frame.face.values.shape == (1, FACE)
    assert frame.face.values[0, 2] == 40
    assert (whole[2:4].index.tolist(), whole[::2].index.tolist()) == ([12, 13], [10, 12, 14])
    assert whole[::2].face == face(6)[::2]
    assert whole[3:3].duration == 0
    with pytest.raises(IndexError):
        whole[6]
    with pytest.raises(ValueError, match="backwards"):
        whole[::-1]
    assert Animation.from_frames(list(whole), "test") == whole
    assert [f.index for f in whole] == list(range(10, 16))


def test_equality_is_of_content() -> None:
    one, other = animation(), animation()
    assert one == other
    assert Animation(one.rate, one.index, one.face, one.body, "another name") == one
    assert one != Animation(one.rate, one.index + 1, one.face, one.body)
    assert one != Animation(Fraction(30), one.index, one.face, one.body)
    assert one != Animation(one.rate, one.index, one.face)
    assert one != "an animation"
    assert one.face != one.body
    assert face(3) != face(3, viseme=np.array([[1, 0, 63, 0]] * 3))
    assert one[0] == other[0]
    assert one[0] != one[1]


def test_from_frames() -> None:
    """Frames that lack a part leave it unsent."""
    whole = animation(3)
    frames = [Frame(0, Fraction(25), whole[0].face), Frame(2, Fraction(25), None, whole[2].body)]
    joined = Animation.from_frames(frames)
    assert (joined.index.tolist(), joined.face.mask.any(axis=1).tolist()) == ([0, 2], [True, False])
    assert joined.body.mask.any(axis=1).tolist() == [False, True]
    with pytest.raises(ValueError, match="no frames"):
        Animation.from_frames([])
    with pytest.raises(ValueError, match="several rates: 25, 30"):
        Animation.from_frames([Frame(0, Fraction(25), whole[0].face), Frame(1, Fraction(30), whole[1].face)])


def test_concatenate() -> None:
    faces = Animation(Fraction(25), np.array([100, 103]), face(2))
    joined = Animation.concatenate([animation(3), faces, animation(2, start=7)])
    assert joined.index.tolist() == [0, 1, 2, 3, 6, 7, 8]
    assert joined.body.mask.any(axis=1).tolist() == [True] * 3 + [False] * 2 + [True] * 2
    assert joined.name == "test"
    assert Animation.concatenate([animation(0), animation(2)]).index.tolist() == [0, 1]
    with pytest.raises(ValueError, match="no parts"):
        Animation.concatenate([])
    with pytest.raises(ValueError, match="different frame rates"):
        Animation.concatenate([animation(), animation(rate=30)])


def test_resample_up_and_down() -> None:
    """A ramp of 10 a frame, at twice the rate 5 a frame; at half the rate every other frame."""
    double = animation(4).resample(50)
    assert double.index.tolist() == list(range(7))
    assert double.face.values[:, 2].tolist() == [0, 5, 10, 15, 20, 25, 30]
    assert double.body.values[:, 0].tolist() == [0, -4, -7, -10, -14, -18, -21]  # halves to even
    half = animation(4).resample(Fraction(25, 2))
    assert (half.index.tolist(), half.face.values[:, 2].tolist()) == ([0, 1], [0, 20])
    assert animation(4).resample(25) == animation(4)


def test_resample_holds_masks_and_selects() -> None:
    """What a frame does not send is not made up; selects hold; flags are set once."""
    values = np.zeros((3, FACE), dtype=np.int32)
    values[:, 2] = [0, 100, 0]
    mask = np.zeros((3, FACE), dtype=bool)
    mask[:, 0] = True
    mask[:2, 2] = True
    viseme = np.array([[3, 0, 63, 1], [5, 0, 63, 0], [5, 0, 31, 0]])
    track = FaceTrack(values, mask, viseme)
    got = Animation(Fraction(25), np.arange(3), track).resample(100).face
    assert got.mask[:, 2].tolist() == [True] * 8 + [False]
    assert got.values[:, 2].tolist() == [0, 25, 50, 75, 100, 100, 100, 100, 0]
    assert got.viseme[:, 0].tolist() == [3] * 4 + [5] * 5
    assert got.viseme[:, 2].tolist() == [63] * 4 + [63, 55, 47, 39, 31]
    assert got.viseme[:, 3].tolist() == [1] + [0] * 8


def test_resample_fills_gaps() -> None:
    gap = Animation(Fraction(10), np.array([0, 4]), None, body(2)).resample(10)
    assert gap.index.tolist() == [0, 1, 2, 3, 4]
    assert gap.body.values[:, 0].tolist() == [0, -2, -4, -5, -7]


def test_resample_turns_angles_the_short_way() -> None:
    """From 172 to -166 degrees it is 22 degrees, not 338; a root that is moved has no such way."""
    values = np.zeros((2, BODY), dtype=np.int32)
    mask = np.zeros((2, BODY), dtype=bool)
    mask[:, [0, 180, 183, 184]] = True
    values[:, 0] = [300_000, -290_000]
    values[:, 180] = [300_000, -300_000]  # millimetres
    values[:, 183] = [700_000, 60_000]  # the end is 688319 in turns that go on from the start
    values[:, 184] = [-100_000, 200_000]
    got = Animation(Fraction(10), np.arange(2), None, BodyTrack(values, mask)).resample(40).body
    np.testing.assert_allclose(got.values[:, 0], [300_000, 309_580, -309_159, -299_580, -290_000], atol=1)
    assert got.values[:, 180].tolist() == [300_000, 150_000, 0, -150_000, -300_000]
    np.testing.assert_allclose(got.values[:, 183], [700_000, 697_080, 694_159, 691_239, 60_000], atol=1)
    assert got.values[:, 184].tolist() == [-100_000, -25_000, 50_000, 125_000, 200_000]


@pytest.mark.parametrize("rate", [0, -1, Fraction(-1, 2)])
def test_resample_to_no_rate(rate: Fraction | int) -> None:
    with pytest.raises(ValueError, match="must be positive"):
        animation().resample(rate)


def test_resample_does_not_fill_the_memory() -> None:
    far = Animation(Fraction(1, 16), np.array([0, 10**12]), face(2))
    with pytest.raises(ValueError, match="lasts 16000000000016 s, more than the 604800"):
        far.resample(25)
    late = Animation(Fraction(1, 16), np.array([10**18]), face(1))
    with pytest.raises(ValueError, match="do not fit 64 bits"):
        late.resample(25)
    assert late.times.tolist() == [1.6e19]


def test_rates_of_many_digits() -> None:
    """As they come from floats: exact all the same."""
    source = animation(100, rate=Fraction(29.97))
    assert np.allclose(source.times, np.arange(100) / 29.97, rtol=1e-15)
    assert source.resample(Fraction(29.97)) == source
    got = source.resample(2 * Fraction(29.97))
    assert got.face.values[:, 2].tolist() == list(range(0, 991, 5))


@given(st.integers(1, 20), st.fractions("1/4", 100), st.fractions("1/4", 100), st.integers(-50, 50))
@settings(max_examples=100)
def test_resampled_times_lie_within(count: int, rate: Fraction, wanted: Fraction, start: int) -> None:
    source = animation(count, start, rate)
    got = source.resample(wanted)
    assert got.rate == wanted
    assert (np.diff(got.index) == 1).all()
    first, last = (Fraction(int(source.index[i])) / rate for i in (0, -1))
    assert Fraction(int(got.index[0])) / wanted >= first
    assert len(got) == 1 or Fraction(int(got.index[-1])) / wanted <= last
    assert Fraction(int(got.index[-1]) + 1) / wanted > last
    assert (np.diff(got.face.values[:, 2]) >= 0).all()


def test_empty_tracks() -> None:
    nothing = Animation(Fraction(25), np.array([], dtype=np.int64), FaceTrack.empty(0))
    assert len(nothing) == 0
    assert list(nothing) == []
    assert nothing.resample(30).rate == 30
    assert BodyTrack.join([(None, 2)]) is None
    joined = BodyTrack.join([(None, 2), (body(1), 1)])
    assert len(joined) == 3


# --- what a user of NumPy tries first -----------------------------------------------------------------


def test_numpy_takes_a_track_as_its_values() -> None:
    for track in (face(3), body(3)):
        array = np.asarray(track)
        assert array.dtype == np.int32
        assert np.array_equal(array, track.values)
        assert not array.flags.writeable
        copied = np.array(track)
        copied[:] = 9
        assert np.array_equal(np.asarray(track), array)
        assert np.asarray(track, dtype=np.float64).dtype == np.float64
        with pytest.raises(ValueError, match="copy"):
            np.asarray(track, dtype=np.float64, copy=False)


@pytest.mark.parametrize(
    ("track", "key", "column"),
    [
        (face(4), "open_jaw", 2),
        (face(4), 3, 2),
        (face(4), np.int64(3), 2),
        (face(4)[1:3], "open_jaw", 2),
        (body(4), "sacroiliac_tilt", 0),
        (body(4), 1, 0),
        (body(4), "l_knee_flexion", 15),
        (body(4), 296, 295),
    ],
)
def test_a_parameter_by_name_or_number(track: FaceTrack | BodyTrack, key: str | int, column: int) -> None:
    values = track[key]
    assert values.dtype == np.int32
    assert np.array_equal(values, track.values[:, column])


@pytest.mark.parametrize(
    ("track", "key", "text"),
    [
        (face(2), "opn_jaw", "there is no FAP 'opn_jaw' (did you mean 'open_jaw'?); their names are in"),
        (body(2), "open_jaw", "there is no BAP 'open_jaw'"),
        (face(2), 0, "FAPs are numbered from 1 to 68, not 0; frames are taken by slices"),
        (face(2), -1, "from 1 to 68, not -1"),
        (body(2), 297, "BAPs are numbered from 1 to 296, not 297"),
        (face(2), "viseme", "FAP 1 viseme has fields in place of a value: use .viseme"),
        (face(2), 2, "use .expression"),
        (face(2), True, "by the name or the number of a FAP, not by bool; index its .values like an array"),
        (body(2), (0, 3), "not by tuple"),
    ],
)
def test_what_is_no_parameter_says_what_is(track: FaceTrack | BodyTrack, key: Any, text: str) -> None:
    with pytest.raises(OptionError, match=re.escape(text)):
        track[key]


def test_a_track_is_no_sequence_of_its_parameters() -> None:
    for track in (face(2), body(2)):
        with pytest.raises(TypeError, match="not iterable"):
            list(track)  # type: ignore[call-overload]


@pytest.mark.parametrize(
    ("shown", "text"),
    [
        (face(250), "<FaceTrack 250 frames, 3 FAPs sent>"),
        (body(1), "<BodyTrack 1 frame, 1 BAP sent>"),
        (FaceTrack.empty(0), "<FaceTrack 0 frames, 0 FAPs sent>"),
        (animation(4), "<Animation test: 4 frames at 25 frames/s, 0.16 s, face, body>"),
        (
            animation(4)[2],
            "Frame(index=2, rate=Fraction(25, 1), face=<FaceTrack 1 frame, 3 FAPs sent>, "
            "body=<BodyTrack 1 frame, 1 BAP sent>)",
        ),
    ],
)
def test_shown_in_a_line(shown: object, text: str) -> None:
    assert repr(shown) == text


@pytest.mark.parametrize(
    ("start", "end", "frames"),
    [
        (0, 0.16, [0, 1, 2, 3]),
        (0.04, 0.12, [1, 2]),
        (Fraction(1, 25), Fraction(3, 25), [1, 2]),
        (0.041, math.inf, [2, 3]),
        (-5, 0.001, [0]),
        (0.08, 0.08, []),
        (9, 10, []),
    ],
)
def test_frames_between_two_times(start: Fraction | float, end: Fraction | float, frames: list[int]) -> None:
    whole = animation(4)
    part = whole.between(start, end)
    assert part.index.tolist() == frames
    assert part == whole[slice(frames[0], frames[-1] + 1) if frames else slice(0, 0)]


def test_frames_between_times_that_are_none() -> None:
    assert len(animation(4).between(0.04)) == 3
    for start, end in ((2, 1), (math.nan, 1)):
        with pytest.raises(ValueError, match="must not be before the start"):
            animation(4).between(start, end)


def test_a_table_for_pandas(monkeypatch: pytest.MonkeyPatch) -> None:
    """With a stand-in for pandas, which is no dependency: what it is given."""
    pandas = SimpleNamespace(
        DataFrame=lambda columns, index: (columns, index),
        Index=lambda values, name: (name, values.tolist()),
        arrays=SimpleNamespace(IntegerArray=lambda values, absent: (values.tolist(), absent.tolist())),
    )
    monkeypatch.setitem(sys.modules, "pandas", pandas)
    values, mask = np.zeros((2, FACE), dtype=np.int32), np.zeros((2, FACE), dtype=bool)
    values[0, 2], mask[0, 2], mask[1, 0] = 7, True, True
    viseme = np.array([[0, 0, 0, 0], [10, 0, 63, 0]], dtype=np.int16)
    columns, index = Animation(
        Fraction(25), np.array([0, 3]), FaceTrack(values, mask, viseme), body(2)
    ).to_dataframe()
    assert index == ("seconds", [0.0, 0.12])
    assert columns == {
        "viseme_select1": ([0, 10], [True, False]),
        "viseme_select2": ([0, 0], [True, False]),
        "viseme_blend": ([0, 63], [True, False]),
        "viseme_def": ([0, 0], [True, False]),
        "open_jaw": ([7, 0], [False, True]),
        "sacroiliac_tilt": ([0, -7], [False, False]),
    }


def test_a_table_without_pandas(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(OptionError, match="needs the package pandas, which is not installed"):
        animation(2).to_dataframe()
