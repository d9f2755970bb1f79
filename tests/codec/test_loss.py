"""What was lost, and when it goes on: time codes at restart points, lost frames counted, planes in doubt.

Streams that readers with any kind of look-ahead for start codes read alike.
"""

import warnings
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from codec_streams import END, OBJECT, PLANE, content, decoded, flipped, jaw_intra, jaw_predicted, packed
from fba import (
    Animation,
    BitstreamError,
    Decoder,
    Encoder,
    EncoderOptions,
    FaceTrack,
    FbaWarning,
    decode,
    encode,
)
from fba.codec import Damage, FrameRate, PlaneSettings, RangeLists, TimeCode, encode_planes
from fba.codec._stream.clock import StreamClock
from fba.codec._stream.damage import DamageLog
from fba.codec._stream.plane_times import PlaneTimes, RestartPoints
from fba.parameters import FAP_COUNT, faps
from tools import synthetic_motion as motion
from tools.look_ahead import compare, planes_read

EVERY_SECOND = EncoderOptions(intra_period=1, start_codes=True, mark=False)


def performance(count: int, rate: Fraction | int = 25, *, start: int = 0) -> Animation:
    face = motion.face(count, faps_sent=(3, 4, 48, 49, 50))
    return motion.animation(face, rate=rate, index=list(range(start, start + count)))


def restarts(data: bytes | bytearray) -> list[int]:
    """Bytes at which plane start codes begin."""
    return [at for at in range(len(data) - 3) if data[at : at + 4] == b"\0\0\1\xbb"]


def intra_planes(data: bytes) -> list[tuple[int, str]]:
    """Index and time code of every I plane."""
    frames, error, _ = decoded(data)
    assert error is None
    planes = [(frame.index, frame.plane.settings) for frame in frames]
    return [(index, str(settings.time_code or "")) for index, settings in planes if settings.intra]


def destroyed(data: bytes, section: int) -> bytes:
    """The stream with the I plane of a section made unreadable: fba_object_mask 0."""
    at = restarts(data)[section] + 4
    return data[:at] + b"\x80" + data[at + 1 :]


@pytest.mark.parametrize(
    ("rate", "period", "planes"),
    [
        (25, 1, [(0, ""), (25, "0:00:01"), (50, "0:00:02"), (75, "0:00:03")]),
        (25, Fraction(5, 2), [(0, ""), (50, "0:00:02")]),  # not 62, which no time code names
        (25, Fraction(3, 5), [(0, ""), (15, ""), (25, "0:00:01"), (40, ""), (50, "0:00:02"), (65, ""),
                              (75, "0:00:03"), (90, "")]),
        (Fraction(30000, 1001), 1, [(0, ""), (30, "0:00:01"), (60, "0:00:02"), (90, "0:00:03")]),
        (Fraction(30000, 1001), 2, [(0, ""), (30, "0:00:01"), (60, "0:00:02"), (90, "0:00:03")]),
        (Fraction(25, 2), 2, [(0, ""), (25, "0:00:02"), (50, "0:00:04"), (75, "0:00:06")]),
    ],
)  # fmt: skip
def test_i_planes_come_where_a_time_code_says_their_time(
    rate: Fraction, period: Fraction, planes: list[tuple[int, str]]
) -> None:
    animation = performance(100, rate)
    options = EncoderOptions(intra_period=period, start_codes=True)
    data = encode(animation, options)
    assert intra_planes(data) == planes
    assert np.array_equal(decode(data).index, animation.index)
    one_by_one = Encoder(options)
    pieces = [one_by_one.push(frame) for frame in animation]
    assert intra_planes(b"".join([*pieces, one_by_one.finish()])) == planes


def test_time_codes_can_be_left_out_and_take_18_bits() -> None:
    animation = performance(100)
    without = encode(animation, replace(EVERY_SECOND, time_codes=False))
    assert intra_planes(without) == [(0, ""), (25, ""), (50, ""), (75, "")]
    assert 0 <= len(encode(animation, EVERY_SECOND)) - len(without) - 3 * 18 // 8 <= 3
    assert encode(animation) == encode(
        animation, EncoderOptions(time_codes=False)
    )  # nothing without start codes


def test_time_codes_count_from_the_start_of_the_stream() -> None:
    """An animation that starts at 13/25 s, which no time code says, is coded as if it started at 0."""
    with pytest.warns(FbaWarning, match="the stream starts at 0"):
        data = encode(performance(60, start=13), EVERY_SECOND)
    assert intra_planes(data) == [(0, ""), (25, "0:00:01"), (50, "0:00:02")]
    later = encode(performance(60, start=75), EVERY_SECOND)
    assert intra_planes(later) == [(75, "0:00:03"), (100, "0:00:04"), (125, "0:00:05")]


@pytest.mark.parametrize("rate", [Fraction(25), Fraction(30000, 1001)])
def test_frames_behind_damage_keep_their_time(rate: Fraction) -> None:
    animation = performance(130, rate)
    data = encode(animation, EncoderOptions(intra_period=2, start_codes=True))
    codes = [index for index, _ in intra_planes(data)]
    for section in range(len(codes) - 1):
        frames, error, decoder = decoded(destroyed(data, section), mode="salvage")
        assert error is None
        lost = range(codes[section + 1], codes[section + 2] if section + 2 < len(codes) else 130)
        assert [frame.index for frame in frames] == [i for i in range(130) if i not in lost]
        (damage,) = decoder.damage
        if section + 2 < len(codes):
            assert (damage.frames_lost, damage.uncertainty) == (len(lost), 0)
        else:  # up to the end code: an estimate
            assert damage.frames_lost is not None
            assert damage.uncertainty is not None
            assert abs(damage.frames_lost - len(lost)) <= damage.uncertainty


def test_lost_frames_are_estimated_without_time_codes() -> None:
    animation = performance(400)
    data = encode(animation, replace(EVERY_SECOND, time_codes=False))
    misses = []
    for section in range(2, 14):
        frames, _, decoder = decoded(destroyed(data, section), mode="salvage")
        (damage,) = decoder.damage
        behind = next(f for f in frames if f.plane.number == 25 * (section + 1))
        assert behind.index == 25 * (section + 1) + damage.frames_lost
        misses.append(abs(damage.frames_lost - 25) <= damage.uncertainty)
    assert all(misses)


@pytest.mark.parametrize("section", [0, 1, 2])
def test_a_join_in_mid_stream_starts_at_the_right_time(section: int) -> None:
    animation = performance(100)
    data = encode(animation, EVERY_SECOND)
    frames, error, decoder = decoded(data[restarts(data)[section] :], mode="salvage")
    assert error is None
    assert [frame.index for frame in frames] == list(range(25 * (section + 1), 100))
    assert not any(frame.plane.doubtful for frame in frames)  # all ranges come with the restart point
    (damage,) = decoder.damage
    assert (damage.frames_lost, damage.uncertainty) == (None, None)


def test_every_bit_flipped_leaves_the_times_behind_it_alone() -> None:
    """But for bits of time codes and rates. Frames stay in order, however much was misread."""
    animation = motion.animation(motion.face(9, faps_sent=(3,)), rate=3)
    data = encode(animation, EVERY_SECOND)
    true, _, _ = decoded(data)
    codes = restarts(data)
    ends = {f.plane.bit + f.plane.bits: f for f in true}
    in_code = {8 * at + 32 + bit for at in codes for bit in range(4 + 13, 4 + 13 + 1 + 18)}
    shifted, misread = 0, 0
    for bit in range(8 * codes[0] - 8 * 12, 8 * codes[1], 2):
        bad = flipped(data, bit)
        frames, _, decoder = decoded(bad, mode="salvage")
        if all(frame.rate == 3 for frame in frames):
            assert all(a.index < b.index for a, b in pairwise(frames))
        with warnings.catch_warnings(action="ignore", category=FbaWarning):
            whole = decode(bad, on_error="salvage")
        section = next((at for at in codes if 8 * at > bit), codes[-1])
        behind = {f.index for f in true if f.plane.bit >= 8 * section - 8}
        if bit not in in_code and all(frame.rate == 3 for frame in frames):
            shifted += not behind <= set(whole.index.tolist())
        doubtful = {number for damage in decoder.damage for number in damage.doubtful}
        for number, frame in enumerate(frames):
            same = ends.get(frame.plane.bit + frame.plane.bits)
            if decoder.damage and (same is None or content(same) != content(frame)):
                misread += number not in doubtful
    assert shifted == 0
    assert misread == 0


def test_a_misread_skip_does_not_delay_later_frames() -> None:
    """`decode` leaves out frames that the time code behind them overtakes; a `Decoder` closes up to them."""
    rate = "1" + f"{25:08b}" + "00000"
    skipping = jaw_intra(5, time=rate + "0" + "1" + "1111" * 20 + "0000")  # 300 frames
    second = jaw_intra(5, time=rate + "1" + f"{0:05b}{0:06b}1{1:06b}" + "0")
    data = OBJECT + packed(skipping + jaw_predicted(-2) + "000") + PLANE + packed(second) + END
    with pytest.warns(FbaWarning, match=r"fba_object_mask is 0.*; planes 0\.\.1 before it may be wrong"):
        assert decode(data, on_error="salvage").index.tolist() == [0, 25]
    frames, _, decoder = decoded(data, mode="salvage")
    assert [frame.index for frame in frames] == [0, 301, 302]
    assert [d.frames_lost for d in decoder.damage] == [0]


def test_a_time_code_that_jumps_where_none_did_before_is_reported() -> None:
    data = encode(performance(100), EVERY_SECOND)
    _, second, third = restarts(data)
    frames, error, decoder = decoded(data[:second] + data[third:], mode="salvage")
    assert error is None
    assert [frame.index for frame in frames] == [*range(50), *range(75, 100)]
    (damage,) = decoder.damage
    assert (damage.start, damage.stop, damage.frames_lost, damage.uncertainty) == (
        second + 4,
        second + 4,
        25,
        0,
    )
    assert "time code 0:00:03 says that 25 frames are missing" in str(damage)


def test_a_damaged_time_code_does_not_move_the_clock_by_hours() -> None:
    data = encode(performance(100), EVERY_SECOND)
    at = 8 * restarts(data)[1] + 32 + 4 + 13 + 1  # the first bit of the hours: 16 more
    with pytest.warns(FbaWarning, match="time code 16:00:02 is far ahead of the count of planes"):
        animation = decode(flipped(data, at), on_error="salvage")
    assert animation.index.tolist() == list(range(100))


def test_a_cut_between_planes_is_noticed() -> None:
    data = encode(performance(30), EncoderOptions(mark=False))
    frames, _, _ = decoded(data)
    borders = [f.plane.bit + f.plane.bits for f in frames]
    aligned = [bit >> 3 for bit in borders[:-1] if bit % 8 == 0]
    assert aligned
    for length in [*aligned, *range(len(data) - 4, len(data))]:
        part = data[:length]
        with pytest.warns(FbaWarning, match="ends without the end code 00 00 01 b1"):
            decode(part)
        salvaged, error, decoder = decoded(part, mode="salvage")
        assert error is None
        assert not decoder.ended
        (damage,) = decoder.damage
        assert (damage.stop, damage.frames_lost, damage.uncertainty) == (length, None, None)
        assert len(salvaged) == sum(bit <= 8 * length for bit in borders)
    decoder = Decoder()
    decoder.push(data)
    assert decoder.finish() == []
    assert decoder.ended


def test_ranges_that_may_have_been_replaced_are_in_doubt() -> None:
    """A reader that joins at an I plane without range lists takes those of the standard's tables."""
    animation = performance(6)
    frames, _, _ = decoded(encode(animation, EncoderOptions(intra_period=Fraction(3, 25), start_codes=True)))
    planes = [frame.plane.settings for frame in frames]
    part = planes[3].face
    assert part is not None
    planes[3] = replace(planes[3], face=replace(part, ranges=RangeLists()))
    planes[4:] = [replace(plane, face=planes[3].face) for plane in planes[4:]]
    data = encode_planes(animation, planes)
    assert not any(frame.plane.doubtful for frame in decoded(data)[0])
    joined, _, _ = decoded(data[restarts(data)[0] :], mode="salvage")
    assert all(frame.plane.doubtful for frame in joined)


def test_damage_as_a_line_of_text() -> None:
    error = ValueError("it broke")
    assert str(Damage(error, 4, 9)) == "bytes 4..9 were lost: it broke"  # type: ignore[arg-type]
    assert str(Damage(error, 9, 9)) == "it broke"  # type: ignore[arg-type]
    known = Damage(error, 4, 9, 25, 0, range(3, 6))  # type: ignore[arg-type]
    assert str(known) == "bytes 4..9 were lost: it broke; 25 frames lost; planes 3..5 before it may be wrong"
    guessed = Damage(error, 4, 9, 1, 2)  # type: ignore[arg-type]
    assert str(guessed) == "bytes 4..9 were lost: it broke; about 1 frame (give or take 2) lost"


def test_restart_points_are_expected_at_past_intervals() -> None:
    """Half a second at 25 frames/s: 13 and 12 frames in turn. The estimate alone would be some frames off."""
    options = EncoderOptions(intra_period=Fraction(1, 2), start_codes=True, time_codes=False)
    animation = performance(200)
    data = encode(animation, options)
    points = [index for index, _ in intra_planes(data)]
    assert points[:5] == [0, 13, 26, 39, 52]
    for section in range(4, len(points) - 2):
        frames, _, decoder = decoded(destroyed(data, section), mode="salvage")
        lost = range(points[section + 1], points[section + 2])
        assert [frame.index for frame in frames] == [i for i in range(200) if i not in lost]
        assert decoder.damage[0].frames_lost == len(lost)


def test_alternating_intervals_of_restart_points() -> None:
    points = RestartPoints()
    for index in (0, 13, 25, 38, 50):
        points.add(index, behind_loss=False)
    assert [points.nearest(index) for index in (51, 60, 70, 90, 1000)] == [63, 63, 75, 88, 1000]
    points.add(75, behind_loss=True)  # 63 was lost
    assert points.nearest(80) == 88
    points.add(90, behind_loss=True)  # somewhere else
    assert points.nearest(100) is None


def test_a_time_code_that_was_too_high_is_corrected() -> None:
    """The one behind damage is believed; two behind it that agree with each other are believed more."""
    data = encode(performance(200), EVERY_SECOND)
    points = restarts(data)
    at = 8 * points[3] + 32 + 4 + 13 + 1 + 12 + 1  # seconds of 0:00:04, 16 of them more
    bad = flipped(destroyed(data, 2), at)  # without frames 75 to 99
    with warnings.catch_warnings(record=True, action="always", category=FbaWarning) as caught:
        animation = decode(bad, on_error="salvage")
    assert any("0:00:05 lies before the previous plane" in str(one.message) for one in caught)
    assert animation.index.tolist() == [*range(75), *range(150, 200)]


def test_the_next_time_code_corrects_a_jump_ahead() -> None:
    data = encode(performance(200), EVERY_SECOND)
    at = 8 * restarts(data)[3] + 32 + 4 + 13 + 1 + 12 + 5  # 0:00:04 becomes 0:00:05
    with pytest.warns(FbaWarning) as caught:
        animation = decode(flipped(data, at), on_error="salvage")
    said = [str(one.message) for one in caught]
    assert ["25 frames are missing" in text for text in said] == [True, False]
    assert "the planes before it are 25 frames late" in said[1]
    assert animation.index.tolist() == [*range(100), *range(125, 200)]


def test_a_single_plane_with_another_rate_is_not_believed() -> None:
    data = encode(performance(125), EVERY_SECOND)
    bad = flipped(data, 8 * restarts(data)[3] + 32 + 4 + 3)  # the third bit of frame_rate
    with pytest.warns(FbaWarning, match="the frame rate .* in place of 25 was not used"):
        assert decode(bad, on_error="salvage").index.tolist() == list(range(125))
    with pytest.warns(FbaWarning, match="the frame rate changes from 25"):
        decode(bad)


def test_a_rate_that_a_second_plane_confirms_is_used() -> None:
    clock = StreamClock()
    for _ in range(4):
        clock.begin_intra(FrameRate(25), None, repair=True)
        clock.advance(np.zeros(25, dtype=np.int64))
    clock.begin_intra(FrameRate(30), None, repair=True)
    assert (clock.rate, "30 in place of 25" in clock.refused) == (25, True)
    clock.begin_intra(FrameRate(30), None, repair=True)
    assert (clock.rate, clock.refused) == (30, "")


def test_a_stream_may_begin_hours_after_zero() -> None:
    """No time code has agreed with the count yet, so a code that is far ahead is believed."""
    animation = performance(60, start=25 * 3600)
    assert decode(encode(animation, EVERY_SECOND), on_error="salvage").index.tolist() == list(animation.index)


def test_time_codes_do_not_go_back_behind_their_object() -> None:
    """Those of a stream behind another one agree with each other, and are earlier all the same."""
    data = encode(performance(100), EVERY_SECOND)
    with pytest.warns(FbaWarning) as caught:
        assert decode(2 * data, on_error="salvage").index.tolist() == list(range(200))
    assert ["lies before the previous plane" in str(one.message) for one in caught] == [True] * 3


def behind_loss(*sections: tuple[int, PlaneSettings], lost: int) -> tuple[int, DamageLog]:
    """Index of the plane behind sections of so many planes, each of 10 bytes, and so many lost bytes."""
    log, planes = DamageLog(), 0
    times = PlaneTimes(log)
    for count, first in sections:
        zeros = np.zeros(count, dtype=np.int64)
        times.begin_intra(first, planes, 80 * planes)
        log.add_planes(80 * (planes + np.arange(count + 1)), zeros)
        times.advance(zeros)
        planes += count
    log.begin(BitstreamError("lost", plane=planes, bit=80 * planes), 10 * planes, planes)
    log.end(10 * planes + lost)
    times.begin_intra(PlaneSettings(intra=True, start_code=True), planes, 80 * planes + 8 * lost)
    return int(times.advance(np.zeros(1, dtype=np.int64))[1][0]), log


RESTART = PlaneSettings(intra=True, frame_rate=FrameRate(25), start_code=True)


@pytest.mark.parametrize(("code", "index"), [(None, 40), (TimeCode(0, 0, 1), 34)])
def test_with_time_codes_the_clock_is_behind_rather_than_ahead(code: TimeCode | None, index: int) -> None:
    """In 100 bytes, 10 planes had room, give or take 6; a time code may come later."""
    after, log = behind_loss((25, RESTART), (5, replace(RESTART, time_code=code)), lost=100)
    assert after == index
    assert (log.damage[0].frames_lost, log.damage[0].uncertainty) == (10, 6)


def test_lost_frames_end_where_a_restart_point_is_expected() -> None:
    after, log = behind_loss(*[(25, RESTART)] * 3, lost=200)
    assert after == 100
    assert log.damage[0].frames_lost == 25


def test_intervals_at_another_rate_are_forgotten() -> None:
    """40 frames at 25 frames/s are 50 at 31.25: no second interval of 25."""
    faster = replace(RESTART, frame_rate=FrameRate(31, 4))
    after, _ = behind_loss((25, RESTART), (15, RESTART), (5, faster), lost=100)
    assert after == 50 + 5 + 10


def face(values: dict[int, list[int]], *, viseme: bool = False) -> Animation:
    """A face that sends these FAPs, in steps of their tables, and in frame 0 a viseme."""
    count = len(next(iter(values.values())))
    array = np.zeros((count, FAP_COUNT), dtype=np.int32)
    mask = np.zeros((count, FAP_COUNT), dtype=bool)
    for number, levels in values.items():
        array[:, number - 1] = [level * faps()[number - 1].step for level in levels]
        mask[:, number - 1] = not viseme
    mask[0, 0] = viseme
    return Animation(25, np.arange(count), FaceTrack(array, mask), None)


def test_a_plane_whose_zeros_look_like_a_start_code_gets_one() -> None:
    """The plane began at bit 5 of a byte; its header and 22 zeros in its segment made 00 00 01."""
    jump = face({3: [0, 600], 4: [0, 600], 5: [0, 600]})
    data = encode(jump, EncoderOptions(mark=False))
    assert [piece[0] for piece in data.split(b"\0\0\1")[1:]] == [0xBA, 0xBB, 0xB1]
    assert len(list(planes_read(data, byte_aligned=True))) == 2
    assert decode(data).face == jump.face


def test_a_last_plane_of_six_bits_is_seen() -> None:
    """Without a start code before it, it lay in one byte with the alignment before the end code."""
    quiet = face({3: [0, 0, 0]}, viseme=True)
    data = encode(quiet)
    for byte_aligned in (False, True):
        assert len(list(planes_read(data, byte_aligned=byte_aligned))) == 3
    assert len(decode(data)) == 3


def test_a_plane_may_still_be_moved_when_its_first_byte_could_leave() -> None:
    """What the encoder hands out frame by frame is what it hands out at once."""
    quiet = face({3: [0] * 40}, viseme=True)

    for count in range(2, 40):
        part = quiet[:count]
        encoder = Encoder()
        live = b"".join([*(encoder.push(frame) for frame in part), encoder.finish()])
        again = Encoder()
        assert live == again.push_animation(part) + again.finish()
        assert len(list(planes_read(live, byte_aligned=True))) == count


def test_planes_without_content_take_six_bits() -> None:
    """The guard writes a start code before the last of them at most, not before each."""
    longer, shorter = (len(encode(face({3: [0] * count}, viseme=True))) for count in (401, 201))
    assert abs(longer - shorter - 200 * 6 / 8) <= 5


@pytest.mark.parametrize("start_codes", [False, True])
def test_an_i_plane_of_zeros_is_guarded_as_well(start_codes: bool) -> None:
    options = EncoderOptions(fap_quant=0, intra_period=0.04, start_codes=start_codes)
    for count in range(2, 12):
        many = face({67: [0] * count, 68: [0] * count})
        data = encode(many, options)
        assert len(list(planes_read(data, byte_aligned=True))) == count


def test_random_streams_are_read_alike() -> None:
    """`python -m tools.look_ahead` compares as many as one likes."""
    _, planes, differing = compare(500, seed=20)
    assert planes >= 500
    assert differing == []
