"""Streams cut at every byte and with every single bit flipped: an error or a salvaged result, never else."""

import warnings
from collections.abc import Iterator
from fractions import Fraction
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from codec_streams import END, OBJECT, content, decoded, flipped
from fba import (
    Animation,
    BitstreamError,
    EncoderOptions,
    FaceTrack,
    FbaError,
    FbaWarning,
    Frame,
    UnsupportedError,
    decode,
    encode,
)
from tools import synthetic_motion as motion

NAMES = ["face", "body", "high level", "both in sections"]


@cache
def stream(name: str) -> bytes:
    """Some 50 to 300 bytes each, without marks; all but the first with start codes."""
    bare = EncoderOptions(mark=False)
    sections = EncoderOptions(intra_period=Fraction(3, 25), start_codes=True, mark=False)
    face = motion.face(9, faps_sent=(3, 4, 48))
    if name == "face":
        return encode(motion.animation(face), bare)
    if name == "body":
        return encode(motion.animation(None, motion.body(9, baps_sent=(1, 2, 124))), sections)
    if name == "high level":
        return encode(motion.animation(motion.face(6, faps_sent=(), high_level=True)), sections)
    face = face[:8]
    mask = face.mask.copy()
    mask[4:6] = False  # planes without FAPs
    gone = FaceTrack(face.values, mask)
    return encode(motion.animation(gone, motion.body(8, baps_sent=(1, 181))), sections)


@cache
def truth(name: str) -> list[Frame]:
    frames, error, _ = decoded(stream(name))
    assert error is None
    return frames


def start_codes(data: bytes) -> list[int]:
    """Bytes at which start codes begin."""
    return [at for at in range(len(data) - 3) if data[at : at + 3] == b"\0\0\1"]


def is_good(frame: Frame, same: Frame) -> bool:
    return content(frame) == content(same) and frame.time == same.time


def checked_animation(data: bytes, mode: str) -> Animation | FbaError:
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        try:
            animation = decode(data, on_error=mode)  # type: ignore[arg-type]
        except (BitstreamError, UnsupportedError) as error:
            return error
    assert len(animation)
    if animation.face is not None:  # once more, through all checks of the constructor
        track = animation.face
        FaceTrack(track.values.copy(), track.mask.copy(), track.viseme.copy(), track.expression.copy())
    return animation


@pytest.mark.parametrize("name", NAMES)
def test_cut_at_every_byte(name: str) -> None:
    """All planes that are whole come out; the error says where the data ends."""
    data, frames = stream(name), truth(name)
    for length in range(len(data) - 4):
        whole = [f for f in frames if f.plane.bit + f.plane.bits <= 8 * length]
        got, error, _ = decoded(data[:length])
        assert len(got) == len(whole)
        assert all(map(is_good, got, whole))
        at_border = any(f.plane.bit + f.plane.bits > 8 * length - 8 for f in whole)
        in_code = any(at < length <= at + 4 for at in start_codes(data))
        assert isinstance(error, BitstreamError) or at_border or in_code
        salvaged, fatal, decoder = decoded(data[:length], mode="salvage")
        assert len(salvaged) == len(whole)
        assert all(map(is_good, salvaged, whole))
        assert fatal is None or length < 4
        if error is not None and length >= 4:
            damage = decoder.damage[-1]
            end = max((f.plane.bit + f.plane.bits for f in whole), default=32)
            assert damage.start in {end >> 3, (end + 7 >> 3) + 4}  # behind a start code, if there is one
            assert damage.stop == length
        assert isinstance(checked_animation(data[:length], "salvage"), Animation) == bool(whole)


@pytest.mark.parametrize("name", NAMES)
def test_every_bit_flipped(name: str) -> None:
    data, frames = stream(name), truth(name)
    codes = [at for at in start_codes(data) if data[at + 3] in {0xBB, 0xB1}]
    for bit in range(8 * len(data)):
        bad = flipped(data, bit)
        before = [f for f in frames if f.plane.bit + f.plane.bits <= bit]
        got, error, _ = decoded(bad)
        assert error is None or isinstance(error, (BitstreamError, UnsupportedError))
        assert len(got) >= len(before) - (bit >= 8 * len(data) - 32)
        assert all(is_good(*pair) for pair in zip(got, before, strict=False))
        salvaged, fatal, decoder = decoded(bad, mode="salvage")
        assert fatal is None or not salvaged
        assert len(salvaged) >= len(got)
        assert all(is_good(*pair) for pair in zip(salvaged, before, strict=False))
        at = 0
        for damage in decoder.damage:
            assert at <= damage.start <= damage.stop <= len(data)
            assert damage.stop == len(data) or bad[damage.stop : damage.stop + 3] == b"\0\0\1"
            at = damage.stop
        if error is not None:
            assert decoder.damage
            # What is found wrong may be found planes later, but never before the flipped bit's plane.
            assert decoder.damage[0].start >= max((f.plane.bit for f in before), default=0) >> 3
        # Decoding goes on at the next start code behind the flipped bit, with exactly the true values.
        following = next((at for at in codes if 8 * at > bit and data[at + 3] == 0xBB), None)
        if following is not None:
            joined = next(f for f in frames if 0 < 8 * following - f.plane.bit <= 8)  # its alignment
            tail = frames[joined.plane.number :]
            assert joined.plane.settings.start_code
            assert [content(f) for f in salvaged[-len(tail) :]] == [content(f) for f in tail]


@pytest.mark.parametrize("name", NAMES)
def test_every_byte_changed(name: str) -> None:
    """To 0 and to 127 (alignment): other accidents than single bits."""
    data = stream(name)
    for at in range(len(data)):
        for value in (0, 127):
            bad = data[:at] + bytes([value]) + data[at + 1 :]
            _, error, _ = decoded(bad)
            assert error is None or isinstance(error, (BitstreamError, UnsupportedError))
            salvaged, fatal, _ = decoded(bad, mode="salvage")
            assert fatal is None or not salvaged


def test_a_plane_behind_damage_says_where_it_stands() -> None:
    """Its first bit is that of its own start code, not of one that was lost before."""
    data = stream("body")
    codes = [at for at in start_codes(data) if data[at + 3] == 0xBB]
    bad = bytearray(data)
    bad[codes[0] + 4] = 0x80  # the I plane of the second section: fba_object_mask 0
    frames, error, decoder = decoded(bytes(bad), mode="salvage")
    assert error is None
    assert [f.plane.number for f in frames] == list(range(6))
    third = frames[3].plane
    true = truth("body")[6].plane
    assert (third.bit + third.bits, third.settings.start_code) == (true.bit + true.bits, True)
    assert third.bit in {8 * codes[1], true.bit}
    (damage,) = decoder.damage
    assert (damage.start, damage.stop) == (codes[0] + 4, codes[1])
    assert isinstance(damage.error, BitstreamError)
    assert (damage.error.plane, damage.error.bit) == (3, 8 * (codes[0] + 4) + 1)


def test_positions_of_errors_count_from_the_start_of_the_stream() -> None:
    """... although the decoder has let go of what was decoded long before."""
    animation = motion.animation(motion.face(400))
    good = encode(animation, EncoderOptions(mark=False))
    good = good[: -4 - 1]
    errors = {}
    for wrong in ("mask", "skip", "marker", "frame rate"):
        bits = {
            "mask": "100",
            "skip": "101" + "0" + "0" + "1" + "1111" * (1 << 20) + "0001",
            "marker": "101" + "000" + "00001" + "0",
            "frame rate": "101" + "1" + "0" * 13,
        }[wrong]
        bits += "1" * (-len(bits) % 8)
        bad = int("1" + bits, 2).to_bytes(len(bits) // 8 + 1, "big")[1:]
        stream = good + b"\0\0\1\xbb"
        _, error, _ = decoded(stream + bad, chunk=1000)
        assert isinstance(error, BitstreamError)
        errors[wrong] = (error.plane, error.bit - 8 * len(stream))
    assert len(good) > 10_000
    assert errors == {
        "mask": (400, 1),
        "skip": (400, 6 + 4 * (1 << 20)),
        "marker": (400, 11),
        "frame rate": (400, 4),
    }


def test_salvaging_reports_what_was_lost() -> None:
    data = stream("both in sections")
    bad = bytearray(data)
    at = start_codes(data)[1] + 4
    bad[at] = 0x80
    with pytest.warns(FbaWarning, match=rf"bytes {at}\.\.\d+ were lost: plane 3, bit {8 * at + 1}"):
        animation = decode(bytes(bad), on_error="salvage")
    assert len(animation) < 9
    with pytest.raises(BitstreamError, match="fba_object_mask is 0"):
        decode(bytes(bad))


@pytest.mark.parametrize("lost", [1, 4, 20])
def test_joining_a_stream_in_the_middle(lost: int) -> None:
    """Without the object's start code: salvaging starts at the first I plane behind a plane start code."""
    data, frames = stream("body"), truth("body")
    tail = data[lost:]
    got, error, decoder = decoded(tail, chunk=3, mode="salvage")
    assert error is None
    assert [content(f) for f in got] == [content(f) for f in frames[3:]]
    code = start_codes(data)[1] - lost
    assert [(d.start, d.stop) for d in decoder.damage] == [(0, code)]
    with pytest.raises(BitstreamError, match="expected the object start code 00 00 01 ba"):
        decode(tail)


def test_junk_before_the_object() -> None:
    data, frames = stream("body"), truth("body")
    got, error, decoder = decoded(b"junk" + data, mode="salvage")
    assert error is None
    assert [content(f) for f in got] == [content(f) for f in frames]
    assert [(d.start, d.stop) for d in decoder.damage] == [(0, 4)]
    assert "begins with 6a 75 6e 6b" in str(decoder.damage[0].error)


LAYERS = b"\0\0\1\xb0\x61" + b"\0\0\1\xb5\x41\xff"
"""Headers of a visual object sequence and of a visual object."""


@pytest.mark.parametrize("chunk", [None, 1, 7])
@pytest.mark.parametrize("code", [0x00, 0xB2, 0xE0, 0xB1, 0xB0, 0xB5])
def test_planes_behind_a_start_code_that_ends_the_object(code: int, chunk: int | None) -> None:
    """Whatever ended it, its planes are not left out without an error; salvaging goes on with them."""
    data, frames = stream("both in sections"), truth("both in sections")
    first, second = start_codes(data)[1:3]
    bad = data[: first + 3] + bytes([code]) + data[first + 4 :]
    got, error, _ = decoded(bad, chunk=chunk)
    assert [content(f) for f in got] == [content(f) for f in frames[:3]]
    assert isinstance(error, BitstreamError)
    assert (error.plane, error.bit) == (3, 8 * second)
    assert f"the object ended with start code 00 00 01 {code:02x} at byte {first}" in str(error)
    got, error, decoder = decoded(bad, chunk=chunk, mode="salvage")
    assert error is None
    assert [content(f) for f in got] == [content(f) for f in frames[:3] + frames[6:]]
    (damage,) = decoder.damage
    assert damage.stop == second
    assert damage.start in range(first - 1, first + 5)
    assert not damage.doubtful


@pytest.mark.parametrize(
    ("between", "warned"),
    [(END, ""), (LAYERS, ""), (END + LAYERS, ""), (LAYERS[5:], ""), (b"", ""), (b"\0\0\1\xb2fba", "b2")],
)
def test_what_ends_an_object_before_another(between: bytes, warned: str) -> None:
    """Headers of the next object do so in order; another start code is told."""
    data, frames = stream("body"), truth("body")
    assert data.endswith(END)
    with warnings.catch_warnings(record=True, action="always") as told:
        animation = decode(data[:-4] + between + data)
    assert len(animation) == 2 * len(frames)
    assert [f"start code 00 00 01 {warned} where" in str(one.message) for one in told] == [True] * bool(
        warned
    )
    with warnings.catch_warnings(record=True, action="always") as lost:
        assert decode(data[:-4] + between + data, on_error="salvage") == animation
    assert len(lost) == len(told)


def test_a_plane_before_the_first_object() -> None:
    data = stream("body")
    with pytest.raises(BitstreamError, match="outside of an object: no object has begun") as caught:
        decode(LAYERS + data[start_codes(data)[1] :] + data)
    assert (caught.value.plane, caught.value.bit) == (0, 8 * len(LAYERS))


def test_a_p_plane_before_the_first_object() -> None:
    """No decoding can begin there; salvaging tells of it, and goes on with the object."""
    data, frames = stream("body"), truth("body")
    junk = LAYERS + b"\0\0\1\xbb" + b"\x20\x7f"
    got, error, decoder = decoded(junk + data, mode="salvage")
    assert error is None
    assert [content(f) for f in got] == [content(f) for f in frames]
    (damage,) = decoder.damage
    assert (damage.start, damage.stop) == (0, len(junk))
    assert "no object has begun" in str(damage.error)


@pytest.mark.parametrize("chunk", [None, 5000, 5003, 64])
def test_many_bytes_of_headers_before_the_object(chunk: int | None) -> None:
    """Bytes of the buffer that are done with are dropped: what is left is not the beginning."""
    data, frames = stream("body"), truth("body")
    got, error, _ = decoded(LAYERS + b"\xff" * 20_000 + data, chunk=chunk)
    assert error is None
    assert [content(f) for f in got] == [content(f) for f in frames]


def sections(count: int) -> Iterator[bytes]:
    face = motion.face(count, faps_sent=(3,))
    options = EncoderOptions(intra_period=Fraction(1, 25), start_codes=True, mark=False)
    data = encode(motion.animation(face), options)
    borders = [*start_codes(data), len(data)]
    for start, stop in pairwise(borders):
        yield data[start:stop]


def test_sections_in_any_order_and_number() -> None:
    """Every section between start codes stands for itself: some lost, some damaged, some doubled."""
    first, *rest = sections(12)
    parts = rest[:-1]
    true, error, _ = decoded(first + b"".join(parts) + rest[-1])
    assert error is None
    values = [content(f) for f in true]
    random = np.random.default_rng(4)
    for _ in range(30):
        chosen = [(number, random.random() < 0.3) for number in random.integers(0, len(parts), 8).tolist()]
        pieces = [parts[n][:4] + (b"\x80" if bad else parts[n][4:5]) + parts[n][5:] for n, bad in chosen]
        got, error, decoder = decoded(first + b"".join(pieces) + rest[-1], mode="salvage")
        assert error is None
        assert [content(f) for f in got[1:]] == [values[n + 1] for n, bad in chosen if not bad]
        assert len(decoder.damage) == sum(bad for _, bad in chosen)


def test_streams_without_decodable_planes() -> None:
    for data in (b"", b"\0", OBJECT[:3], OBJECT, b"\0\0\1\xbb", b"\0" * 1000, b"text"):
        result = checked_animation(data, "raise")
        assert isinstance(result, BitstreamError)
        assert isinstance(checked_animation(data, "salvage"), BitstreamError)
