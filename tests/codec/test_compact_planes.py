"""Planes that hold nearly nothing: they take little memory and time, however many there are."""

import tracemalloc
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest

from codec_streams import OBJECT, PLANE, TIME_25, fap_masks, packed
from fba import Animation, BodyTrack, Decoder, FaceTrack, LimitError, Limits, decode, encode, probe

EMPTY = {1: "00001" + fap_masks() + "000000" + "01", 2: "00001" + "100" * 24 + "000000" + "01"}
"""Parts of an I plane that send nothing, up to the bits that close their arithmetic segment."""
SIZE = 80_000


def intra(parts: int, time: str = TIME_25) -> str:
    return f"1{parts:02b}" + time + "".join(EMPTY[part] for part in (1, 2) if parts & part)


def predicted(parts: int) -> str:
    return f"0{parts:02b}0" + "01" * (1 + (parts == 3))


def repeated(first: str, bits: str, size: int = SIZE) -> bytes:
    """An object that begins with these bits and goes on with the others, again and again."""
    start = np.frombuffer(first.encode(), dtype=np.uint8) - ord("0")
    piece = np.frombuffer(bits.encode(), dtype=np.uint8) - ord("0")
    count = 8 * size // len(piece)
    return OBJECT + np.packbits(np.concatenate([start, np.tile(piece, count)])).tobytes()


def objects() -> bytes:
    one = OBJECT + packed(intra(1, "000"))
    return one * (SIZE // len(one))


def start_codes() -> bytes:
    one = PLANE + packed(predicted(1))
    return OBJECT + packed(intra(1)) + one * (SIZE // len(one))


def time_codes() -> bytes:
    """An I plane every second, each with its time code."""
    planes = []
    for second in range(1, SIZE * 8 // 80):
        clock = f"{second // 3600:05b}{second // 60 % 60:06b}1{second % 60:06b}"
        planes.append(intra(1, f"01{clock}0"))
    return OBJECT + packed(intra(1) + "".join(planes))


def frame_rates() -> bytes:
    """An I plane with another frame rate each."""
    rates = (f"1{1 + number % 255:08b}{number % 16:04b}{number // 7 % 2}00" for number in range(300))
    return OBJECT + packed("".join(intra(1, rate) for rate in rates))


HOSTILE: dict[str, Callable[[], bytes]] = {
    "faces": lambda: repeated(intra(1), predicted(1)),
    "bodies": lambda: repeated(intra(2), predicted(2)),
    "both": lambda: repeated(intra(3), predicted(3)),
    "by turns": lambda: repeated(intra(3), predicted(1) + predicted(2)),
    "I planes": lambda: repeated(intra(1), intra(1, "000"), SIZE // 20),
    "I planes by turns": lambda: repeated(intra(3), intra(1, "000") + intra(2, "000"), SIZE // 20),
    "objects": lambda: objects()[: SIZE // 20],
    "start codes": lambda: start_codes()[: SIZE // 20],
    "time codes": lambda: time_codes()[: SIZE // 20],
    "frame rates": frame_rates,
}


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
@pytest.mark.parametrize("name", HOSTILE)
def test_memory_is_bounded_by_the_input(name: str) -> None:
    """20 bytes for each of the input, and what a decoder needs in any case."""
    data = HOSTILE[name]()
    decode(OBJECT + packed(intra(3)))  # compiled and cached what there is
    for work in (partial(decode, on_error="salvage"), probe):
        tracemalloc.start()
        try:
            assert work(data) is not None
        finally:
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
        assert peak < 20 * len(data) + 12_000_000


@pytest.mark.parametrize("name", ["faces", "bodies", "both", "by turns"])
def test_planes_come_in_large_blocks(name: str) -> None:
    """Whatever parts they carry: a block costs as much as a hundred planes."""
    decoder = Decoder()
    data = HOSTILE[name]()
    starts = range(0, len(data), 1 << 14)
    blocks = [block for start in starts for block in decoder.push_blocks(data[start : start + (1 << 14)])]
    assert sum(len(block.index) for block in blocks) > 6 * SIZE / 10
    assert len(blocks) < decoder.planes / 400


def parts_by_turns() -> tuple[Animation, bytes]:
    """A stream in which planes carry the face, the body, or both, and what is to come out."""
    rng = np.random.default_rng(6)
    count = 90
    face, body = np.zeros((count, 68), dtype=np.int32), np.zeros((count, 296), dtype=np.int32)
    face_mask, body_mask = np.zeros(face.shape, dtype=bool), np.zeros(body.shape, dtype=bool)
    for frame, parts in enumerate([3, *rng.integers(1, 4, count - 1).tolist()]):
        face_mask[frame, [2, 47]] = parts & 1
        body_mask[frame, [0, 120, 295]] = parts & 2
        face[frame, [2, 47]] = rng.integers(0, 9, 2) * [4, 170] * (parts & 1)
        body[frame, [0, 120, 295]] = rng.integers(-9, 9, 3) * [64, 256, 1] * (parts >> 1)
    animation = Animation(25, np.arange(count), FaceTrack(face, face_mask), BodyTrack(body, body_mask))
    return animation, encode(animation)


def test_planes_of_changing_parts() -> None:
    animation, data = parts_by_turns()
    assert decode(data) == animation
    whole, bytewise = Decoder(), Decoder()
    frames = whole.push(data) + whole.finish()
    again = [frame for byte in data for frame in bytewise.push(bytes([byte]))] + bytewise.finish()
    assert frames == again
    for frame, given in zip(frames, animation, strict=True):
        assert (frame.face is None, frame.body is None) == (
            not given.face.mask.any(), not given.body.mask.any()
        )  # fmt: skip
        assert frame.plane.settings.face_frame == (None if frame.face is None else frame.index)
        assert frame.face is None or frame.face == given.face
        assert frame.body is None or frame.body == given.body


@pytest.mark.filterwarnings("ignore:.*without the end code")
def test_arrays_are_made_when_they_are_asked_for() -> None:
    """Slices of decoded tracks, their lengths and comparisons do not expand them."""
    data = HOSTILE["by turns"]()
    tracemalloc.start()
    try:
        animation = decode(data)
        assert animation == decode(data)
        assert (len(animation[1000:2000]), animation.body[5:7].values.shape) == (1000, (2, 296))
        assert animation.body[10:0:1].values.shape == (0, 296)
        assert animation.body[1:9:3].mask.shape == (3, 296)
        assert tracemalloc.get_traced_memory()[1] < 20 * len(data) + 48_000_000
        body = animation.body[:10_000]
        assert body.values is body.values
        with pytest.raises(ValueError, match="read-only"):
            body.values[0] = 1
        with pytest.raises(AttributeError, match="no attribute 'valeus'"):
            body.valeus  # type: ignore[attr-defined]  # noqa: B018
    finally:
        tracemalloc.stop()


def test_a_still_body_in_full_is_refused_at_the_limit() -> None:
    """Values that are sent need memory, and a plane of 296 that do not change takes 7 bits."""
    count = 3000
    mask = np.broadcast_to(np.ones(296, dtype=bool), (count, 296))
    still = Animation(25, np.arange(count), None, BodyTrack(np.zeros((count, 296), dtype=np.int32), mask))
    data = encode(still)
    with pytest.raises(LimitError, match="the decoded stream takes"):
        decode(data, limits=Limits(bytes=1_000_000))
    assert decode(data) == still


def test_one_call_returns_a_bounded_number_of_frames() -> None:
    """Those up to the limit, then the error."""
    data = HOSTILE["faces"]()
    decoder = Decoder(limits=Limits(bytes=1_000_000))
    frames = decoder.push(data)
    allowed = (1_000_000 + 20 * len(data)) // 500
    assert allowed <= len(frames) <= allowed + 512
    with pytest.raises(LimitError, match="what one call returns takes"):
        decoder.push(b"")
    patient = Decoder(limits=Limits(bytes=1_000_000))
    pieces = [patient.push(data[start : start + 1000]) for start in range(0, len(data), 1000)]
    assert sum(map(len, pieces)) == patient.planes > len(frames)
