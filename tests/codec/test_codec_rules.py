"""Decision constants and rules of the codec: each has a test here that dies with it."""

from fractions import Fraction

import numpy as np
import pytest

import fba
from fba import Animation, FaceTrack
from fba.codec import EncoderOptions, FrameRate, TimeCode
from fba.codec._frame_buffers import TimeBase
from fba.codec._plane import slots
from fba.codec._plane.loops import SKIP_MAX
from fba.codec._ranges import Ranges
from fba.codec._runs import mask_types
from fba.codec._stream.clock import StreamClock, time_code
from fba.errors import RangeError

NTSC = Fraction(30000, 1001)
FASTEST = Fraction(4095, 16)


def clock_after(frames: int, rate: FrameRate) -> StreamClock:
    clock = StreamClock()
    assert clock.begin_intra(rate, None) == []
    if frames:
        clock.advance(np.zeros(frames, dtype=np.int64))
    return clock


def face(*values: int, fap: int = 3) -> Animation:
    """Frames that send one FAP."""
    table = np.zeros((len(values), 68), dtype=np.int32)
    mask = np.zeros(table.shape, dtype=bool)
    table[:, fap - 1] = values
    mask[:, fap - 1] = True
    count = len(values)
    track = FaceTrack(table, mask, np.zeros((count, 4), np.int16), np.zeros((count, 6), np.int16))
    return Animation(Fraction(25), np.arange(count), track, None)


# --- the decoder's clock ------------------------------------------------------------------------------


def test_a_stream_without_a_rate_has_25_frames_a_second() -> None:
    clock = StreamClock()
    (warning,) = clock.begin_intra(None, None)
    assert clock.rate == 25
    assert "no frame rate" in warning


def test_a_stream_may_begin_with_its_time_code() -> None:
    clock = StreamClock()
    assert (clock.begin_intra(FrameRate(25), TimeCode(0, 0, 0)), clock.index) == ([], 0)


def test_a_new_rate_begins_at_the_next_whole_frame() -> None:
    clock = clock_after(1, FrameRate(25))
    clock.begin_intra(FrameRate(30), None)  # 1/25 s is frame 1.2
    assert clock.index == 2


def test_a_time_code_of_the_present_moment_changes_nothing() -> None:
    clock = clock_after(25, FrameRate(25))
    assert (clock.begin_intra(None, TimeCode(0, 0, 1)), clock.index) == ([], 25)


@pytest.mark.parametrize(("rate", "index"), [(FrameRate(30, 0, 1), 30), (FrameRate(12, 8), 13)])
def test_a_time_code_is_the_nearest_frame(rate: FrameRate, index: int) -> None:
    clock = clock_after(0, rate)
    assert clock.begin_intra(None, TimeCode(0, 0, 1)) == []
    assert clock.index == index


def test_a_time_code_never_turns_the_index_back() -> None:
    clock = clock_after(1, FrameRate(25))
    clock.begin_intra(FrameRate(0, 1), None)
    assert clock.index == 1
    clock.begin_intra(None, TimeCode(0, 0, 1))  # a sixteenth of a frame, nearest to frame 0
    assert clock.index == 1


def test_a_time_code_without_its_marker_is_not_used() -> None:
    clock = clock_after(0, FrameRate(25))
    (warning,) = clock.begin_intra(None, TimeCode(0, 0, 9, marker=0))
    assert "marker" in warning
    assert clock.index == 0


def test_skipped_frames_count() -> None:
    clock = StreamClock()
    clock.begin_intra(FrameRate(25), None)
    assert (clock.advance(np.array([0, 2, 0])).tolist(), clock.index) == ([0, 1, 4], 5)


# --- one rate for a whole stream ----------------------------------------------------------------------


def test_two_rates_have_the_lowest_common_one() -> None:
    base = TimeBase(in_place=False)
    base.add(np.array([0]), Fraction(0), NTSC)
    base.add(np.array([2]), 1 / NTSC, Fraction(25))
    assert (base.rate, base.index().tolist()) == (30000, [0, 1001])


def test_rates_without_a_common_one_below_a_million_take_the_highest_and_round() -> None:
    base = TimeBase(in_place=False)
    base.add(np.array([0]), Fraction(0), NTSC)
    base.add(np.array([9]), 1 / NTSC, Fraction(4081, 16))  # frame 8.51 of that rate
    assert base.rate == Fraction(4081, 16)
    assert base.index().tolist() == [0, 9]


# --- header fields ------------------------------------------------------------------------------------


def test_frame_rates_below_256_are_coded_without_an_offset_where_they_can_be() -> None:
    assert FrameRate.from_fraction(FASTEST) == FrameRate(255, 15, 0)
    assert FrameRate.from_fraction(Fraction(256)) is None
    assert FrameRate.from_fraction(Fraction(125, 2)) == FrameRate(62, 8, 0)  # also 1001/16 x 1000/1001


@pytest.mark.parametrize(
    ("index", "rate", "code"),
    [
        (30 * 3600 * 25, Fraction(25), TimeCode(30, 0, 0)),
        (30, NTSC, TimeCode(0, 0, 1)),  # 1.001 s
        (509, NTSC, TimeCode(0, 0, 17)),  # 16.98 s
    ],
)
def test_a_time_code_says_the_second_whose_nearest_frame_is_the_first(
    index: int, rate: Fraction, code: TimeCode
) -> None:
    assert time_code(index, rate) == code


def test_types_of_masks() -> None:
    mask = np.ones(68, dtype=bool)
    assert mask_types(slots.FACE_BIT, mask, None, "keep") == (3,) * 10
    mask[:] = False
    mask[2] = True
    assert mask_types(slots.FACE_BIT, mask, None, "keep") == (0, 1, *(0,) * 8)
    assert mask_types(slots.FACE_BIT, mask, None, "interpolate") == (0, 2, *(0,) * 8)
    assert mask_types(slots.FACE_BIT, mask, ~mask, "keep") == (2,) * 10


# --- ranges -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("quant", [1, 2, 5, 30])
def test_errors_name_the_largest_value_that_can_be_coded(quant: int) -> None:
    options = EncoderOptions(fap_quant=quant)
    with pytest.raises(RangeError) as caught:
        fba.encode(face(10**6), options)
    assert caught.value.limits is not None
    _, largest = caught.value.limits
    assert fba.decode(fba.encode(face(largest), options)).face is not None
    with pytest.raises(RangeError):
        fba.encode(face(largest + 1), options)
    with pytest.raises(RangeError):
        fba.encode(face(-largest - 1), options)


def test_a_range_that_was_widened_stays_wide() -> None:
    animation = face(0, 900, 0, 900, 0, -900, 0, 900)
    encoder = fba.Encoder(EncoderOptions(fap_quant=0))
    data = encoder.push_animation(animation) + encoder.finish()
    decoded = fba.decode(data)
    assert decoded.face.values[:, 2].tolist() == [0, 900, 0, 900, 0, -900, 0, 900]
    assert encoder.statistics.intra_planes <= 3  # the first, and one for each direction


def test_ranges_of_differences_exceed_what_a_clamped_value_lacks() -> None:
    ranges = Ranges(slots.FACE_BIT, EncoderOptions())
    column = np.array([slots.FAPS.start])
    ranges.widen_to_catch_up(column, np.array([1861]))  # 1 beyond 31 x 60, in the next step
    assert ranges.codes[2:, 2].tolist() == [2, 2]
    ranges.widen_to_catch_up(column, np.array([10**6]))
    assert ranges.codes[2:, 2].tolist() == [31, 31]


def test_a_plane_skips_as_many_frames_as_its_syntax_carries() -> None:
    two = face(1, 2)
    far = Animation(two.rate, np.array([0, SKIP_MAX + 1]), two.face, None)
    assert fba.decode(fba.encode(far)).index.tolist() == [0, SKIP_MAX + 1]
    with pytest.raises(RangeError, match="can skip"):
        fba.encode(Animation(two.rate, np.array([0, SKIP_MAX + 2]), two.face, None))


@pytest.mark.parametrize("clamp", [False, True])
def test_an_i_plane_that_cannot_carry_its_frame_is_put_off(clamp: bool) -> None:
    """P planes reach values that I planes do not."""
    beyond = face(3000, 9000, 12000, 3000, 3000)
    options = EncoderOptions(fap_quant=1, intra_period=0.04, start_codes=True, clamp=clamp)
    coded = fba.encode(beyond, options)
    frames = fba.Decoder().push(coded)
    assert [frame.plane.settings.intra for frame in frames if frame.plane] == [True, False, False, True, True]
    assert fba.decode(coded).face == beyond.face
