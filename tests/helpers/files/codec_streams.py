"""Streams and animations that the codec's tests share: written bit by bit from the syntax tables, or drawn
by hypothesis."""

import math
import warnings
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import numpy.typing as npt
from hypothesis import strategies as st

from fba import Animation, BodyTrack, Decoder, FaceTrack, FbaError, FbaWarning, Frame
from fba.parameters import BapTable, bap_steps, fap_steps
from fba_conformance._textbook import FrequencyTable, encode_segment

OBJECT, PLANE, END = b"\0\0\1\xba", b"\0\0\1\xbb", b"\0\0\1\xb1"
FAP_GROUP_SIZES = (2, 16, 12, 8, 4, 5, 3, 10, 4, 4)
BAP_GROUPS = 24
BAP_SCALE = (
    0, 1, 2, 3, 5, 7, 9, 11, 14, 17, 20, 23, 27, 31, 35, 39, 43, 47, 52, 57, 62, 67, 72, 77, 82, 88, 94, 100,
    106, 113, 120, 127,
)  # fmt: skip
"""bap_pred_scale of the standard."""
WIDEST = 31 * 60
TIME_25 = "1" + f"{25:08b}" + "0000" + "0" + "0" + "0"
"""25 frames/s, no time code, no skip."""


def packed(bits: str) -> bytes:
    """Bits as bytes, the last one filled with a 0 and then 1s as before a start code, if there is room."""
    stuffing = -len(bits) % 8
    bits += "0" * (stuffing > 0) + "1" * (stuffing - 1)
    return int("1" + bits, 2).to_bytes(len(bits) // 8 + 1, "big")[1:]


def flipped(data: bytes, bit: int) -> bytes:
    """The stream with one bit changed."""
    changed = bytearray(data)
    changed[bit >> 3] ^= 128 >> (bit & 7)
    return bytes(changed)


def fap_masks(*sent: int, mask_type: int = 1) -> str:
    """Masks of the 10 FAP groups: of this type where something is sent, else of type 0."""
    bits, first = "", 1
    for size in FAP_GROUP_SIZES:
        flags = "".join("1" if first + i in sent else "0" for i in range(size))
        bits += f"1{mask_type:02b}{flags}" if "1" in flags else "100"
        first += size
    return bits


def segment(levels: Sequence[int], limits: Sequence[tuple[int, int]]) -> str:
    """An arithmetic segment whose models have learnt nothing yet, coded by the textbook."""
    return encode_segment(
        [level - low for level, (low, _) in zip(levels, limits, strict=True)],
        [FrequencyTable(high - low + 1) for low, high in limits],
        learn=False,
    )


def jaw_intra(level: int, *, time: str = TIME_25, quant: int = 1, kind: str = "0") -> str:
    """An I plane with FAP 3 open_jaw, no range lists: the table's limit is 1080 for it.

    time: is_frame_rate to skip_frames, and what they announce. kind: object_coding_type.
    """
    head = "101" + time + f"{quant:05b}" + fap_masks(3) + "0" + kind + "0000"
    return head + segment([level], [(-1080 // quant, 1080 // quant)])


def jaw_predicted(difference: int, *, skip: str = "0") -> str:
    """The first P plane after `jaw_intra`; the limit of the table for differences is 360."""
    return "001" + skip + segment([difference], [(-360, 360)])


def decoded(
    data: bytes, *, chunk: int | None = None, mode: str = "raise", bap_steps: BapTable = "iso"
) -> tuple[list[Frame], FbaError | None, Decoder]:
    """All frames that come out, what was raised, and the decoder."""
    decoder = Decoder(on_error=mode, bap_steps=bap_steps)  # type: ignore[arg-type]
    frames: list[Frame] = []
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        try:
            for start in range(0, len(data), chunk or len(data) or 1):
                frames += decoder.push(data[start : start + (chunk or len(data))])
            frames += decoder.finish()
        except FbaError as error:
            frames += [f for block in getattr(error, "blocks", None) or [] for f in block.frames()]
            return frames, error, decoder
    return frames, None, decoder


def content(frame: Frame) -> tuple[object, ...]:
    """What a frame says, its time left out, for comparisons."""
    parts: list[bytes | None] = []
    for track in (frame.face, frame.body):
        parts += [None] if track is None else [track.values.tobytes(), track.mask.tobytes()]
    if frame.face is not None:
        parts += [frame.face.viseme.tobytes(), frame.face.expression.tobytes()]
    return (frame.plane.settings.intra, *parts)


def steps(part: str, quant: int, table: BapTable = "iso") -> npt.NDArray[np.int64]:
    """Quantiser steps, by the standard's rule, of all FAPs or BAPs."""
    if part == "face":
        return fap_steps() * quant if quant else np.ones(68, dtype=np.int64)
    return bap_steps(table) * BAP_SCALE[quant] if quant else np.ones(296, dtype=np.int64)


def largest_level(part: str, quant: int) -> int:
    return WIDEST // max(quant if part == "face" else BAP_SCALE[quant], 1)


RATES = st.one_of(
    st.sampled_from([Fraction(25), Fraction(30), Fraction(50), Fraction(24), Fraction(120)]),
    st.integers(1, 4095).map(lambda n: Fraction(n, 16)),
    st.integers(1, 4095).map(lambda n: Fraction(n, 16) * Fraction(1000, 1001)),
)


@st.composite
def animations(draw: st.DrawFn, fap_quant: int, bap_quant: int, table: BapTable = "iso") -> Animation:
    """Any animation that these quantisers can carry: 1..30 frames, gaps, masks that change, absent parts."""
    count = draw(st.integers(1, 30))
    rate = draw(RATES)
    gaps = draw(
        st.lists(st.sampled_from([1, 1, 1, 2, 15, 16, 17, 31, 300]), min_size=count - 1, max_size=count - 1)
    )
    seconds = draw(st.sampled_from([0, 0, 1, 59, 3600, 7322, 31 * 3600]))
    start = math.floor(seconds * rate + Fraction(1, 2))
    index = start + np.concatenate([[0], np.cumsum(np.array(gaps, dtype=np.int64))]).astype(np.int64)
    parts = draw(st.sampled_from(["face", "body", "both"]))
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    masking = draw(st.sampled_from(["same", "few changes", "any"]))
    face = body = None
    if parts != "body":
        values, mask = _track(random, count, "face", fap_quant, table, masking)
        values[:, :2] = 0
        viseme = np.stack([random.integers(0, n + 1, count) for n in (14, 14, 63, 1)], axis=1)
        expression = np.stack([random.integers(0, n + 1, count) for n in (6, 63, 6, 63, 1, 1)], axis=1)
        face = FaceTrack(values, mask, viseme.astype(np.int16), expression.astype(np.int16))
    if parts != "face":
        body = BodyTrack(*_track(random, count, "body", bap_quant, table, masking))
    return Animation(rate, index, face, body)


def _track(
    random: np.random.Generator, count: int, part: str, quant: int, table: BapTable, masking: str
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.bool_]]:
    step = steps(part, quant, table)
    largest = largest_level(part, quant) * step
    jumps = random.random((count, len(step))) < random.choice([0.0, 0.05, 1.0])
    wander = np.cumsum(random.integers(-3, 4, (count, len(step))) * step // random.choice([1, 2, 3]), axis=0)
    values = np.where(jumps, random.integers(-largest, largest + 1, (count, len(step))), wander)
    values = np.clip(values, -largest, largest).astype(np.int32)
    mask = np.zeros((count, len(step)), dtype=bool)
    mask[:] = random.random(len(step)) < random.choice([0.0, 0.05, 0.9, 1.0])
    if masking != "same":
        for _ in range(2 if masking == "few changes" else count):
            at = random.integers(0, count)
            kind = random.integers(0, 3)
            mask[at:] = False if kind == 0 else random.random(len(step)) < random.choice([0.05, 0.9])
    return np.where(mask, values, 0).astype(np.int32), mask
