"""Frame rates, skips and time codes, in exact fractions."""

from contextlib import nullcontext
from dataclasses import replace
from fractions import Fraction
from math import floor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codec_streams import END, OBJECT, RATES, decoded, jaw_intra, packed
from fba import Animation, Decoder, EncoderOptions, FbaWarning, RangeError, decode, encode
from fba.codec import Block, FrameBuffer, FrameRate, PlaneSettings, TimeCode, encode_planes
from fba.codec._frame_buffers import CompactBuffer
from fba.limits import DEFAULT_LIMITS
from tools import synthetic_motion as motion

SKIP_MAX = 15 << 20
NTSC = Fraction(1000, 1001)


@given(RATES)
def test_every_rate_of_the_syntax(rate: Fraction) -> None:
    face = motion.face(2, faps_sent=(3,))
    frames, error, _ = decoded(encode(motion.animation(face, rate=rate)))
    assert error is None
    assert [frame.time for frame in frames] == [0, 1 / rate]
    fields = frames[0].plane.settings.frame_rate
    assert (fields.frame_rate + Fraction(fields.seconds, 16)) * (
        NTSC if fields.frequency_offset else 1
    ) == rate


@pytest.mark.parametrize(
    ("rate", "nearest"),
    [
        (Fraction(256), "255.938"),
        (Fraction(1000), "255.938"),
        (Fraction(1, 32), "0.0625"),
        (Fraction(1, 100), "0.0625"),
        (Fraction(2997, 100), "30"),  # not 30000/1001
        (Fraction(2501, 100), "25"),
        (Fraction(4096, 16) * NTSC, "255.75"),
    ],
)
def test_other_rates_are_refused(rate: Fraction, nearest: str) -> None:
    with pytest.raises(
        RangeError,
        match=rf"^{rate} frames/s cannot be coded.* e\.g\. with Animation\.resample\(rate={nearest}\)$",
    ):
        encode(motion.animation(motion.face(2, faps_sent=(3,)), rate=rate))


@pytest.mark.parametrize(
    ("rate", "fields"),
    [
        (Fraction(25), (25, 0, 0)),
        (Fraction(61, 2), (30, 8, 0)),
        (Fraction(30000, 1001), (30, 0, 1)),
        (Fraction(1, 16), (0, 1, 0)),
        (Fraction(4095, 16), (255, 15, 0)),
        (Fraction(479, 16) * NTSC, (29, 15, 1)),
    ],
)
def test_fields_of_a_rate(rate: Fraction, fields: tuple[int, int, int]) -> None:
    assert FrameRate.from_fraction(rate) == FrameRate(*fields)
    assert FrameRate(*fields).fraction == rate


@pytest.mark.parametrize("skip", [0, 1, 14, 15, 16, 29, 30, 31, 225, 226, 1000])
def test_skips(skip: int) -> None:
    """An I plane and a P plane that each leave out so many frames."""
    animation = motion.animation(motion.face(3, faps_sent=(3,)), index=[0, skip + 1, 2 * skip + 2])
    frames, error, _ = decoded(encode(animation))
    assert error is None
    assert [frame.plane.settings.skip for frame in frames] == [skip, skip, 0]
    assert [frame.time * 25 for frame in frames] == [0, skip + 1, 2 * skip + 2]


def test_the_longest_skip() -> None:
    face = motion.face(3, faps_sent=(3,))
    longest = motion.animation(face, index=[0, SKIP_MAX + 1, 2 * SKIP_MAX + 2])
    assert np.array_equal(decode(encode(longest)).index, longest.index)
    for gaps, frame in (([0, SKIP_MAX + 2, SKIP_MAX + 3], 0), ([0, 1, SKIP_MAX + 3], 1), ([0, 1, 10**18], 1)):
        with pytest.raises(RangeError, match=f"a plane can skip {SKIP_MAX}") as caught:
            encode(motion.animation(face, index=gaps))
        assert caught.value.frame == frame


@pytest.mark.parametrize("rate", [Fraction(25), Fraction(30000, 1001), Fraction(61, 2), Fraction(1, 16)])
@pytest.mark.parametrize("seconds", [1, 59, 60, 3599, 31 * 3600 + 59 * 60 + 30])
def test_an_animation_that_starts_at_a_whole_second(rate: Fraction, seconds: int) -> None:
    start = floor(seconds * rate + Fraction(1, 2))
    if rate < 1 and start == 0:
        start = 1
    animation = motion.animation(
        motion.face(3, faps_sent=(3,)), rate=rate, index=[start, start + 1, start + 2]
    )
    frames, error, _ = decoded(encode(animation))
    assert error is None
    assert [frame.index for frame in frames] == [start, start + 1, start + 2]
    said = frames[0].plane.settings.time_code
    assert abs(said.total_seconds - start / rate) <= 1 / rate / 2
    assert (said.minutes < 60, said.seconds < 60, said.marker) == (True, True, 1)


@pytest.mark.parametrize("start", [1, 13, -25, 25 * 32 * 3600, 10**15])
def test_a_start_without_a_possible_time_code(start: int) -> None:
    animation = motion.animation(motion.face(2, faps_sent=(3,)), index=[start, start + 1])
    with pytest.warns(FbaWarning, match=r"starts at .* s, which no time code says; the stream starts at 0"):
        coded = encode(animation)
    assert decode(coded).index.tolist() == [0, 1]


def written(*planes: PlaneSettings) -> bytes:
    """Planes of a jaw that opens, with the settings of an ordinary I plane in all of them."""
    animation = motion.animation(motion.face(len(planes), faps_sent=(3,)))
    frames, _, _ = decoded(encode(animation))
    part = frames[0].plane.settings.face
    return encode_planes(
        animation, [replace(plane, face=part, face_frame=number) for number, plane in enumerate(planes)]
    )


INTRA, PREDICTED = PlaneSettings(True), PlaneSettings(False)


def test_a_rate_that_changes() -> None:
    """Planes at 25/s with skips, then at 50/s, then at 10/s: worked out by hand, in 10 ms."""
    data = written(
        replace(INTRA, frame_rate=FrameRate(25)),
        PREDICTED,
        replace(PREDICTED, skip=1),
        replace(INTRA, frame_rate=FrameRate(50), skip=2),
        PREDICTED,
        replace(INTRA, frame_rate=FrameRate(10)),
        PREDICTED,
    )
    times = [Fraction(n, 100) for n in (0, 4, 8, 16, 22, 24, 34)]
    decoder = Decoder()
    with pytest.warns(FbaWarning, match="the frame rate changes from") as caught:
        blocks = decoder.push_blocks(data) + decoder.finish_blocks()
    assert [str(w.message).split(": ")[1] for w in caught] == [
        "the frame rate changes from 25 to 50",
        "the frame rate changes from 50 to 10",
    ]
    exact = [
        block.start + Fraction(int(i - block.index[0])) / block.rate for block in blocks for i in block.index
    ]
    assert exact == times
    with pytest.warns(FbaWarning, match="frame rate changes"):
        animation = decode(data)
    assert animation.rate == 50
    assert [Fraction(int(index)) / 50 for index in animation.index] == times


@pytest.mark.filterwarnings("ignore:.*the frame rate changes")
@pytest.mark.parametrize(
    ("rates", "common"),
    [
        ((FrameRate(25), FrameRate(30), FrameRate(50)), Fraction(150)),
        ((FrameRate(30, 0, 1), FrameRate(30)), Fraction(30000)),
        ((FrameRate(30, 0, 1), FrameRate(255, 1)), Fraction(4081, 16)),  # 30000 x 4081 would be too fine
        ((FrameRate(255, 1), FrameRate(30, 0, 1), FrameRate(255, 15)), Fraction(4095, 16)),
    ],
)
def test_rates_that_change_get_a_common_rate(rates: tuple[FrameRate, ...], common: Fraction) -> None:
    """The lowest that holds all times, or the highest of the stream; however it is cut into blocks."""
    planes = [replace(INTRA, frame_rate=rate) if not t else PREDICTED for rate in rates for t in range(40)]
    data = written(*planes)
    exact, time = [], Fraction(0)
    for rate in rates:
        exact += [time + t / rate.fraction for t in range(40)]
        time += 40 / rate.fraction
    animation = decode(data)
    decoder = Decoder()
    blocks = [block for byte in data for block in decoder.push_blocks(bytes([byte]))]
    blocks += decoder.finish_blocks()
    assert animation.rate == common
    assert animation.index.tolist() == [floor(time * common + Fraction(1, 2)) for time in exact]
    assert len(blocks) > len(rates)
    looked, waited = FrameBuffer(), CompactBuffer(DEFAULT_LIMITS, len(data))
    earlier: list[tuple[Animation, Animation]] = []
    for block in blocks:
        looked.add(block)
        waited.add(block)
        seen = looked.decoded().animation()
        earlier.append((seen, replace(seen, index=seen.index.copy())))
    assert looked.decoded().animation() == waited.animation() == animation
    assert all(seen == copy for seen, copy in earlier)  # what was looked at did not change


@pytest.mark.filterwarnings("ignore:.*the frame rate changes")
def test_a_common_rate_makes_time_codes_exact() -> None:
    """60000/1001 frames/s would hold both rates, but not a frame at 8 s sharp."""
    data = written(
        replace(INTRA, frame_rate=FrameRate(30, 0, 1)),
        replace(INTRA, frame_rate=FrameRate(60, 0, 1), time_code=TimeCode(0, 0, 8)),
        PREDICTED,
    )
    animation = decode(data)
    assert animation.rate == 60000
    assert animation.index.tolist() == [0, 8 * 60000, 8 * 60000 + 1001]


def test_masks_that_change_from_plane_to_plane() -> None:
    frames = FrameBuffer()
    tracks = [
        motion.face(2, faps_sent=(3,)),
        motion.face(3, faps_sent=(3, 4)),
        motion.face(1, faps_sent=(3,)),
    ]
    blocks: list[Block] = []
    for track in tracks:
        decoder = Decoder()
        blocks += decoder.push_blocks(encode(motion.animation(track))) + decoder.finish_blocks()
    for block in blocks:
        frames.add(block)
    face = frames.decoded().face
    sent = [[3]] * 2 + [[3, 4]] * 3 + [[3]]
    assert [(np.flatnonzero(row) + 1).tolist() for row in face.mask] == sent


def test_a_repeated_rate_changes_nothing() -> None:
    rate = FrameRate(30, 0, 1)
    planes = [replace(INTRA, frame_rate=rate)] * 3
    frames, error, _ = decoded(written(*planes))
    assert error is None
    assert [frame.time for frame in frames] == [0, Fraction(1001, 30000), Fraction(2002, 30000)]


def test_time_codes_within_a_stream() -> None:
    data = written(
        replace(INTRA, frame_rate=FrameRate(25), time_code=TimeCode(0, 0, 7)),
        PREDICTED,
        replace(INTRA, time_code=TimeCode(1, 2, 3)),
        PREDICTED,
    )
    start = 25 * 3723
    assert decode(data).index.tolist() == [175, 176, start, start + 1]


@pytest.mark.parametrize(
    ("code", "message"),
    [
        (TimeCode(0, 0, 6), "time code 0:00:06 lies before the previous plane; it was not used"),
        (
            TimeCode(0, 0, 9, marker=0),
            "the marker bit of time code 0:00:09 is 0; that time code was not used",
        ),
    ],
)
def test_time_codes_that_are_ignored(code: TimeCode, message: str) -> None:
    data = written(
        replace(INTRA, frame_rate=FrameRate(25), time_code=TimeCode(0, 0, 7)), replace(INTRA, time_code=code)
    )
    with pytest.warns(FbaWarning, match=message):
        assert decode(data).index.tolist() == [175, 176]


def test_a_stream_without_a_rate() -> None:
    data = OBJECT + packed(jaw_intra(5, time="000")) + END
    with pytest.warns(FbaWarning, match="the first I plane says no frame rate; 25 frames/s assumed"):
        assert decode(data).rate == 25


@given(st.lists(RATES, min_size=1, max_size=6), st.lists(st.integers(0, 40), min_size=6, max_size=6))
@settings(max_examples=60)
def test_any_changes_of_rate(rates: list[Fraction], skips: list[int]) -> None:
    """Every plane's time is the sum of the periods before it, and the animation's times are near and rise."""
    planes = [
        replace(INTRA, frame_rate=FrameRate.from_fraction(rate), skip=skip)
        for rate, skip in zip(rates, skips, strict=False)
    ]
    times = [Fraction(0)]
    for rate, skip in zip(rates, skips, strict=False):
        times.append(times[-1] + (1 + skip) / rate)
    decoder = Decoder()
    data = written(*planes)
    with pytest.warns(FbaWarning) if len(set(rates)) > 1 else nullcontext():
        blocks = decoder.push_blocks(data) + decoder.finish_blocks()
    assert [block.start for block in blocks] == times[:-1]
    with pytest.warns(FbaWarning) if len(set(rates)) > 1 else nullcontext():
        animation = decode(data)
    assert (np.diff(animation.index) > 0).all()
    assert isinstance(animation, Animation)
    for index, time in zip(animation.index.tolist(), times, strict=False):
        assert abs(index / animation.rate - time) <= len(rates) / animation.rate


def test_intra_period_counts_time_not_frames() -> None:
    """An I plane at most every second: behind a gap of 3 s at once."""
    animation = motion.animation(motion.face(6, faps_sent=(3,)), rate=2, index=[0, 1, 2, 8, 9, 10])
    frames, _, _ = decoded(encode(animation, EncoderOptions(intra_period=1)))
    assert [frame.plane.settings.intra for frame in frames] == [True, False, True, True, False, True]
