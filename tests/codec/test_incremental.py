"""Chunks of any size, frames as soon as they are whole, flat memory; the encoder frame by frame."""

import copy
import gc
import tracemalloc
import weakref
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codec_streams import END, OBJECT, content, decoded, jaw_intra, jaw_predicted, packed, steps
from fba import (
    Animation,
    BitstreamError,
    BodyTrack,
    Decoder,
    Encoder,
    EncoderOptions,
    FaceTrack,
    Frame,
    decode,
    encode,
)
from tools import synthetic_motion as motion

EVERY = ["talking", "walking", "both", "part comes and goes"]


def performance(name: str) -> Animation:
    face = motion.face(12, faps_sent=(3, 5, 19, 48, 60), high_level=name == "talking")
    body = motion.body(12, baps_sent=(1, 19, 50, 124, 181))
    if name == "part comes and goes":
        mask = face.mask.copy()
        mask[3:8] = False
        face = FaceTrack(face.values, mask)
    return motion.animation(face if name != "walking" else None, body if name != "talking" else None)


def within(animation: Animation, largest: int) -> Animation:
    face, body = animation.face, animation.body
    if face is not None:
        face = FaceTrack(np.clip(face.values, -largest, largest), face.mask, face.viseme, face.expression)
    if body is not None:
        body = BodyTrack(np.clip(body.values, -largest, largest), body.mask)
    return Animation(animation.rate, animation.index, face, body)


def stream(name: str) -> bytes:
    return encode(performance(name), EncoderOptions(intra_period=Fraction(5, 25), start_codes=True))


def described(frame: Frame) -> tuple[object, ...]:
    plane = frame.plane
    return frame.index, frame.rate, plane.number, plane.bit, plane.bits, plane.settings.skip, content(frame)


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("chunk", [1, 7])
def test_small_chunks(name: str, chunk: int) -> None:
    data = stream(name)
    whole, error, _ = decoded(data)
    assert error is None
    assert len(whole) == 12
    pieces, error, _ = decoded(data, chunk=chunk)
    assert error is None
    assert [described(frame) for frame in pieces] == [described(frame) for frame in whole]


@given(st.data())
@settings(max_examples=60)
def test_any_chunks(data: st.DataObject) -> None:
    """Empty chunks too, of any type of bytes."""
    coded = stream(data.draw(st.sampled_from(EVERY)))
    cuts = sorted(data.draw(st.lists(st.integers(0, len(coded)), max_size=12)))
    kind = data.draw(st.sampled_from([bytes, bytearray, memoryview]))
    decoder = Decoder()
    frames = []
    for start, stop in zip([0, *cuts], [*cuts, len(coded)], strict=True):
        frames += decoder.push(kind(coded[start:stop]))
    frames += decoder.finish()
    assert [described(frame) for frame in frames] == [described(frame) for frame in decoded(coded)[0]]


@given(st.data())
@settings(max_examples=80)
def test_the_same_error_whatever_the_chunks(data: st.DataObject) -> None:
    coded = bytearray(stream(data.draw(st.sampled_from(EVERY))))
    at = data.draw(st.integers(4, len(coded) - 1))
    coded[at] ^= data.draw(st.integers(1, 255))
    if data.draw(st.booleans()):
        del coded[data.draw(st.integers(5, len(coded))) :]
    whole, error, _ = decoded(bytes(coded))
    pieces, same, _ = decoded(bytes(coded), chunk=data.draw(st.sampled_from([1, 2, 7, 50])))
    assert str(same) == str(error)
    assert [described(frame) for frame in pieces] == [described(frame) for frame in whole]


@pytest.mark.parametrize("name", EVERY)
def test_a_frame_comes_with_the_byte_of_its_last_bit(name: str) -> None:
    data = stream(name)
    decoder = Decoder()
    came = {}
    for position in range(len(data)):
        for frame in decoder.push(data[position : position + 1]):
            came[frame.plane.number] = (position, frame.plane.bit + frame.plane.bits - 1)
    assert len(came) == 12
    assert all(position == last >> 3 for position, last in came.values())


def test_the_last_frame_of_a_live_stream() -> None:
    """No end code: nothing is held back, or it comes with finish where its bits look like a start code."""
    planes = jaw_intra(5) + jaw_predicted(-2)
    decoder = Decoder()
    frames = decoder.push(OBJECT + packed(planes))
    frames += decoder.finish()
    assert [int(frame.face.values[0, 2]) for frame in frames if frame.face] == [20, 12]  # steps of 4


def test_a_stream_that_ends_in_half_a_start_code() -> None:
    data = stream("both")
    for cut in (1, 2, 3):
        frames, error, _ = decoded(data[:-cut])
        assert error is None
        assert len(frames) == 12


def test_errors_come_after_the_frames_before_them() -> None:
    good = packed(jaw_intra(5) + jaw_predicted(-2))
    bad = b"\0\0\1\xbb" + b"\x80"  # an I plane with fba_object_mask 0
    decoder = Decoder()
    assert len(decoder.push(OBJECT + good + bad)) == 2
    with pytest.raises(BitstreamError, match="fba_object_mask is 0") as caught:
        decoder.push(b"")
    assert caught.value.plane == 2
    assert caught.value.bit == 8 * (4 + len(good) + 4) + 1
    with pytest.raises(ValueError, match="finished"):
        decoder.push(b"")


def test_finish_twice_and_push_after_it() -> None:
    decoder = Decoder()
    decoder.push(stream("both"))
    assert (decoder.finish(), decoder.finish()) == ([], [])
    with pytest.raises(ValueError, match="this decoder is finished"):
        decoder.push(b"\0")


def test_wrong_arguments() -> None:
    with pytest.raises(ValueError, match="bap_steps must be one of iso, visage, not 'vissage'"):
        Decoder(bap_steps="vissage")
    with pytest.raises(ValueError, match='on_error must be "raise" or "salvage", not \'ignore\''):
        Decoder(on_error="ignore")  # type: ignore[arg-type]


@pytest.mark.parametrize("mode", ["raise", "salvage"])
def test_memory_stays_flat(mode: str) -> None:
    """Over 200 kB of planes, and then a megabyte behind the end of the object."""
    track = motion.face(40)
    piece = encode(motion.animation(track), EncoderOptions(intra_period=Fraction(10, 25), mark=False))
    body = piece[4:].removesuffix(END)  # ends with alignment, so that a start code must follow
    again = b"\0\0\1\xbb" + body
    decoder = Decoder(on_error=mode)  # type: ignore[arg-type]
    decoder.push(OBJECT + body)
    tracemalloc.start()
    try:
        frames = largest = 0
        for _ in range(200_000 // len(again)):
            for start in range(0, len(again), 900):
                frames += len(decoder.push(again[start : start + 900]))
            largest = max(largest, tracemalloc.get_traced_memory()[0])
        decoder.push(END)
        for _ in range(500):
            decoder.push(b"junk" * 500)
            largest = max(largest, tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert frames == 40 * (200_000 // len(again))
    assert largest < 400_000
    with pytest.warns(UserWarning, match="1000000 bytes follow the end of the FBA object"):
        decoder.finish()


@given(st.sampled_from(EVERY), st.integers(0, 31), st.integers(0, 31), st.booleans())
@settings(max_examples=30)
def test_encoder_frame_by_frame(name: str, fap_quant: int, bap_quant: int, start_codes: bool) -> None:
    """An encoder that does not know what comes next makes other planes, but the same values.

    Both come to a multiple of the quantiser step nearest to each value. Only where a value lies exactly
    between two of them does it depend on what was coded before which one is taken.
    """
    animation = performance(name)
    if not fap_quant or not bap_quant:
        animation = within(animation, 1860)
    options = EncoderOptions(fap_quant=fap_quant, bap_quant=bap_quant, clamp=True, start_codes=start_codes)
    encoder = Encoder(options)
    pieces = [encoder.push(frame) for frame in animation]
    data = b"".join([*pieces, encoder.finish()])
    assert encoder.statistics.clamped == 0
    ours, whole = decode(data), decode(encode(animation, options))
    assert np.array_equal(ours.index, whole.index)
    for part, one, other, quant in (
        ("face", ours.face, whole.face, fap_quant),
        ("body", ours.body, whole.body, bap_quant),
    ):
        if one is None or other is None:
            assert one is other
            continue
        assert np.array_equal(one.mask, other.mask)
        source = getattr(animation, part)
        step = steps(part, quant)
        between = 2 * (source.values % step) == step
        assert np.array_equal(one.values[~between], other.values[~between])
        assert (np.abs(one.values - other.values) <= step).all()


def test_frames_leave_the_encoder_one_behind() -> None:
    """A plane says how many frames are skipped after it: it can leave when the next is known."""
    animation = motion.animation(motion.face(4), index=[0, 1, 5, 6])
    encoder = Encoder()
    decoder = Decoder()
    got = [len(decoder.push(encoder.push(frame))) for frame in animation]
    assert got[0] == 0
    assert sum(got) <= 3
    frames = decoder.push(encoder.finish()) + decoder.finish()
    assert sum(got) + len(frames) == 4
    assert encoder.finish() == b""
    with pytest.raises(ValueError, match="this encoder is finished"):
        encoder.push(animation[0])


def test_an_encoder_refuses_frames_that_cannot_follow() -> None:
    face = motion.face(3)
    encoder = Encoder()
    with pytest.raises(ValueError, match="no frame to encode"):
        Encoder().finish()
    encoder.push(motion.animation(face, index=[0, 1, 2])[1])
    with pytest.raises(ValueError, match="frame index 1 comes after 1"):
        encoder.push(motion.animation(face, index=[0, 1, 2])[1])
    with pytest.raises(ValueError, match="the stream has 25 frames/s, this frame 30"):
        encoder.push(motion.animation(face, rate=30, index=[0, 1, 2])[2])


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("pushed", [1, 4, 9])
def test_copies_continue_like_their_originals(name: str, pushed: int) -> None:
    """A copy whose arrays are no longer parts of one another would code with some old ranges and steps."""
    animation = performance(name)
    original, begun = Encoder(), bytearray()
    for frame in animation[:pushed]:
        begun += original.push(frame)
    other = copy.deepcopy(original)
    ends = []
    for encoder in (original, other):
        encoder.begin_segment(animation[: pushed + 1], EncoderOptions(fap_quant=3, bap_quant=3))
        ends.append(b"".join(encoder.push(frame) for frame in animation[pushed:]) + encoder.finish())
    assert ends[0] == ends[1]

    stream = bytes(begun) + ends[0]
    half = len(stream) // 2
    decoder = Decoder()
    decoder.push(stream[:half])
    copied = copy.deepcopy(decoder)
    frames, same = (reader.push(stream[half:]) + reader.finish() for reader in (decoder, copied))
    assert frames == same
    assert frames[-1].index == 11


def test_decoders_are_freed_without_the_garbage_collector() -> None:
    """Each holds megabytes, and a program that reads many short streams makes many."""
    decoder = Decoder()
    decoder.push(encode(performance("talking")))
    decoder.finish()
    alive = weakref.ref(decoder)
    gc.disable()
    try:
        del decoder
        assert alive() is None
    finally:
        gc.enable()


def test_an_error_keeps_no_bytes_and_no_models_alive() -> None:
    """A program may collect the errors of thousands of streams."""
    data = encode(performance("walking")) + OBJECT + bytes(2_000_000)

    def error() -> BitstreamError:
        decoder = Decoder()
        decoder.push(data)
        with pytest.raises(BitstreamError) as caught:
            decoder.push(b"")
        return caught.value

    error()  # compiled functions are loaded
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        held = error()
        assert tracemalloc.get_traced_memory()[0] - before < 200_000
    finally:
        tracemalloc.stop()
    assert held.plane == 12
