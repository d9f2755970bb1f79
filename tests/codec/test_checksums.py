"""The CRC-32 of each I period behind the end of a stream: flipped bits are noticed."""

import itertools
import warnings
from functools import cache
from zlib import crc32

import numpy as np
import pytest

import fba
from codec_streams import flipped
from fba import Animation, BitstreamError, Decoder, EncoderOptions, FbaError, FbaWarning
from fba.codec import Damage, Encoder, probe_stream, verify_stream, write_mark
from fba_conformance.trace import planes as read_planes
from fba_conformance.trace import trace
from tools import synthetic_motion as motion
from tools.fuzz.small_streams import doubtful_marks
from tools.look_ahead import random_options

PERIOD = 10
SECTIONS = EncoderOptions(
    intra_period=PERIOD / 25, start_codes=True, time_codes=False, bap_steps="visage", clamp=True
)
UNALIGNED = EncoderOptions(intra_period=PERIOD / 25, bap_steps="visage", clamp=True)


@cache
def performance(frames: int = 60) -> Animation:
    return motion.animation(motion.face(frames, faps_sent=(3, 4, 48)), motion.body(frames, baps_sent=(1, 31)))


@cache
def stream(options: EncoderOptions) -> bytes:
    return fba.encode(performance(), options)


def bare(options: EncoderOptions) -> bytes:
    return stream(EncoderOptions(**{**options.__dict__, "mark": False}))


def written(crc: int) -> bytes:
    return crc.to_bytes(4, "big").replace(b"\0", b"\xff")


@pytest.mark.parametrize("options", [SECTIONS, UNALIGNED, EncoderOptions(clamp=True)])
def test_the_list_has_the_documented_bytes(options: EncoderOptions) -> None:
    """Borders come from the second decoder: an I plane's first bit, or the start code before it."""
    data, plain = stream(options), bare(options)
    borders = []
    for plane in read_planes(plain, bap_steps=options.bap_steps):
        if plane["intra"]:
            aligned = -(-(plane["bit"] + 1) // 8) * 8 if plane["start_code"] is not None else plane["bit"]
            borders.append(aligned)
    borders[0] = 0
    ends = [*borders[1:], 8 * (len(plain) - 4)]
    checks = b"".join(
        written(crc32(plain[begin >> 3 : (end + 7) >> 3])) for begin, end in zip(borders, ends, strict=True)
    )
    table = options.bap_steps.encode()
    words = b"fba bap_steps=%s;crc32=%d;" % (table, len(borders)) + checks
    assert data == plain + b"\0\0\1\xb2" + words + written(crc32(words))
    assert len(borders) == (6 if options.intra_period else len(borders))


def test_every_flipped_bit_is_noticed() -> None:
    """Without checks, some of these give wrong values, and nobody says so."""
    for options in (SECTIONS, UNALIGNED):
        for data, complete in ((stream(options), True), (bare(options), False)):
            steps = None if complete else "visage"
            true, unsaid = fba.decode(data, bap_steps=steps), 0
            for bit in range(0, 8 * len(data), 5):
                with warnings.catch_warnings(record=True, action="always") as said:
                    try:
                        found = fba.decode(flipped(data, bit), bap_steps=steps)
                    except FbaError:
                        continue
                unsaid += not said and found != true
            assert (unsaid == 0) == complete


def silent_flip(options: EncoderOptions, period: int) -> tuple[bytes, range]:
    """A stream with one bit flipped in an I period, which reads without an error if nobody checks it."""
    plain, data = bare(options), stream(options)
    true = fba.decode(plain, bap_steps="visage")
    info = probe_stream(plain)
    assert info.plane_bits is not None
    ends = 32 + np.cumsum(info.plane_bits)
    for bit in range(int(ends[PERIOD * period]) + 40, int(ends[PERIOD * period + PERIOD - 2])):
        changed = flipped(plain, bit)
        try:
            with warnings.catch_warnings(action="error"):
                found = fba.decode(changed, bap_steps="visage")
        except (FbaError, FbaWarning):
            continue
        if len(found) == len(true) and found != true:
            return flipped(data, bit), range(PERIOD * period, PERIOD * (period + 1))
    raise AssertionError("no such bit")


@pytest.mark.parametrize("options", [SECTIONS, UNALIGNED])
@pytest.mark.parametrize("period", [0, 2, 5])
def test_a_wrong_period_is_named_and_left_out(options: EncoderOptions, period: int) -> None:
    data, planes = silent_flip(options, period)
    true = fba.decode(stream(options))
    with pytest.raises(BitstreamError, match="does not match its CRC-32") as caught:
        fba.decode(data)
    assert caught.value.plane == planes.start
    with pytest.warns(FbaWarning, match="does not match its CRC-32"):
        rescued = fba.decode(data, on_error="salvage")
    kept = np.array([frame not in planes for frame in range(60)])
    assert rescued.index.tolist() == true.index[kept].tolist()
    assert (rescued.body.values == true.body.values[kept]).all()
    found = verify_stream(data)
    assert (found.intact, found.ended, found.doubtful, found.frames) == (False, True, PERIOD, 50)
    assert [damage.doubtful for damage in probe_stream(data).damage] == [planes]


@pytest.mark.parametrize("size", [1, 11, 100_000])
def test_readers_of_pieces_report_wrong_periods_at_the_end(size: int) -> None:
    data, planes = silent_flip(SECTIONS, 3)
    for mode in ("raise", "salvage"):
        decoder, frames = Decoder(on_error=mode, bap_steps="visage"), 0  # type: ignore[arg-type]
        error = None
        try:
            for start in range(0, len(data), size):
                frames += len(decoder.push(data[start : start + size]))
            decoder.finish()
        except BitstreamError as raised:
            error = raised
        assert frames == 60
        assert (error is not None) == (mode == "raise")
        if mode == "salvage":
            (damage,) = decoder.damage
            assert isinstance(damage, Damage)
            assert (damage.doubtful, damage.start, damage.stop) == (planes, damage.start, damage.start)
            assert "planes 30..39 does not match" in str(damage)


def test_the_only_period_is_returned_as_doubtful() -> None:
    options = EncoderOptions(bap_steps="visage", clamp=True, intra_period=100)
    data = flipped(stream(options), 8 * (len(bare(options)) - 20))
    try:
        with pytest.warns(FbaWarning):
            found = fba.decode(data, on_error="salvage")
    except BitstreamError:
        pytest.fail("nothing was returned")
    assert len(found) > 0
    assert verify_stream(data).doubtful > 0


def test_missing_periods_are_reported() -> None:
    data = stream(SECTIONS)
    codes = [at for at in range(len(data)) if data.startswith(b"\0\0\1\xbb", at)]
    with pytest.raises(BitstreamError, match="1 of 6 I periods of the object are missing"):
        fba.decode(data[: codes[1]] + data[codes[2] :])


def test_checksums_can_be_switched_off() -> None:
    for options in (EncoderOptions(mark=False, clamp=True), EncoderOptions(checksums=False, clamp=True)):
        assert b"crc32" not in stream(options)
    face = motion.animation(motion.face(9))
    data = fba.encode(face, EncoderOptions(mark=False))
    assert fba.encode(face).startswith(data)
    assert fba.encode(face)[len(data) :].startswith(b"\0\0\1\xb2fba crc32=1;")
    assert len(fba.encode(face)) - len(data) == 4 + len("fba crc32=1;") + 8


def test_frame_by_frame_gives_the_same_list() -> None:
    for options in (SECTIONS, UNALIGNED):
        at_once, frames = Encoder(options), Encoder(options)
        whole = at_once.push_animation(performance()) + at_once.finish()
        assert b"".join(frames.push(frame) for frame in performance()) + frames.finish() == whole
        assert fba.decode(whole).body is not None
    ending = Encoder(SECTIONS)
    data = ending.push_animation(performance())
    assert fba.decode(data + ending.ending()) == fba.decode(stream(SECTIONS))[:-1]


def test_undamaged_streams_match_their_checks() -> None:
    """Planes that had to be moved apart by start codes, empty ones, parts that come and go."""
    from random import Random

    from tools.look_ahead import random_animation

    random = Random(8)
    with warnings.catch_warnings(action="error"):
        warnings.filterwarnings("ignore", message=".*(limited to what|time code|starts at).*")
        for _ in range(60):
            options = EncoderOptions(**{**random_options(random).__dict__, "mark": True})
            animation = random_animation(random)
            data = fba.encode(animation, options)
            assert len(fba.decode(data)) == len(animation)
            decoder = Decoder(on_error="salvage", bap_steps=options.bap_steps)
            for start in range(0, len(data), 5):
                decoder.push(data[start : start + 5])
            decoder.finish()
            assert decoder.damage == []


@pytest.mark.parametrize("name", doubtful_marks())
@pytest.mark.parametrize("size", [1, 9, 10_000])
def test_doubtful_marks_do_not_hide_what_can_be_decoded(name: str, size: int) -> None:
    """However wrong the mark, every plane is returned, and something is said."""
    data = doubtful_marks()[name]
    decoder = Decoder(on_error="salvage")
    with warnings.catch_warnings(record=True, action="always") as said:
        frames = [f for start in range(0, len(data), size) for f in decoder.push(data[start : start + size])]
        frames += decoder.finish()
    assert len(frames) == 5
    assert said or decoder.damage or name == "several_marks"


def test_a_list_that_claims_too_much_is_not_waited_for() -> None:
    """A live stream goes on behind it; it would be held back for ever."""
    data = bare(SECTIONS) + b"\0\0\1\xb2fba crc32=999999999;" + bytes(range(1, 60))
    decoder = Decoder(bap_steps="visage")
    with pytest.warns(FbaWarning, match="list of 999999999 checks behind the end was cut off"):
        decoder.push(data)
    frames = decoder.push(bare(SECTIONS)) + decoder.finish()
    assert len(frames) == 60


def test_the_tracer_shows_the_checks() -> None:
    names = [(one.name, one.value) for one in trace(stream(SECTIONS), bap_steps="visage")][-3:]
    assert [name for name, _ in names] == ["user_data_start_code", "user_data", "checks"]
    assert names[1][1] == "fba bap_steps=visage;crc32=6;"
    assert len(str(names[2][1])) == 2 * 4 * 7


def test_write_mark() -> None:
    assert write_mark(None) == b""
    assert write_mark(None, b"abcd").startswith(b"\0\0\1\xb2fba crc32=1;abcd")
    assert b"\0" not in write_mark("iso", b"\xff" * 400)[4:]


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_a_plane_behind_the_end_of_a_damaged_stream_is_reported_once() -> None:
    """It was found again and again, until the list of damage exceeded its limit."""
    data = bare(SECTIONS)
    at = data.rindex(b"\0\0\1\xbb")
    bad = data[:at] + b"\x80\xff\0\0\1\xb1\0\0\1\xb2\0\0\1\xbb\x20"
    decoder = Decoder(on_error="salvage", bap_steps="visage")
    decoder.push(bad)
    decoder.finish()
    assert 0 < len(decoder.damage) < 5


@pytest.mark.parametrize(
    "data",
    [
        "ffffffff93a53217000001bbd19001b24924924924925824921f0fffffffffffff0ffffffff83ffffffffffff8"
        "7fffffffc3ffffffffffffc3fffffffe0ffffffffffffe2ffffffff4a5bf000001b1000001b266626120626170"
        "5f73746570ff733d69736f3b63726333323d333b010203040506070809000001bbd97a",
        "000001b1000001b2666261206261705f73746570733d69736f3bf0fc3ffffffffff83c107fffffff07c3ffffff"
        "ffff87c30fffffffffab9cbc0cee4f1fce41bfa6cf13da6cad050f000001bbf19001f68002e00492c921f087c2"
        "1ff17e00f801fe0fc22f087fc5f803e007f83fd84b9fd78cecae8d086c9251249249241f",
    ],
)
def test_an_end_code_before_the_damage_does_not_end_it(data: str) -> None:
    """Found by fuzzing: what was lost was listed twice, and out of order."""
    decoder = Decoder(on_error="salvage")
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        decoder.push(bytes.fromhex(data))
        decoder.finish()
    borders = [(damage.start, damage.stop) for damage in decoder.damage]
    assert len(borders) > 1
    assert all(start <= stop for start, stop in borders)
    assert all(before[1] <= after[0] for before, after in itertools.pairwise(borders))
