"""Bit rate of a stream over time, and totals of its I and P planes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64
from fba.codec import StreamInfo
from fba.compiled import is_compiled

WINDOW = 1.0
"""Seconds over which the bit rate is averaged."""
MAX_VALUES = 3_000_000 if is_compiled() else 30_000
"""Most values of an animation that is encoded only to show its bit rate: about a second."""


@dataclass(frozen=True)
class Total:
    """Sum over one kind of planes. planes: number, None for bits outside of planes. share: of all bits."""

    name: str
    planes: int | None
    bits: int
    share: float


@dataclass(frozen=True, eq=False)
class Rates:
    """Bits of a stream over time.

    times: seconds of the planes (T,). bits, intra (T,): size and kind of each. rate: kbit/s (N,) in the
    second that ends with each of the last N planes; for those before, less than a second is known. totals: of
    I planes, P planes and the bits around them. mean: kbit/s.
    """

    times: Float64
    bits: Float64
    intra: Bool
    rate: Float64
    totals: tuple[Total, ...]
    mean: float


def measure_rates(info: StreamInfo) -> Rates | None:
    """Return the bit rates of a stream; None if it has no planes."""
    if info.plane_bits is None or info.plane_intra is None or info.frame_index is None or not info.frames:
        return None
    times = (info.frame_index - info.frame_index[0]) / float(info.rate) + float(info.start)
    bits, intra = info.plane_bits.astype(np.float64), info.plane_intra
    until = np.r_[0.0, np.cumsum(bits)]
    before = np.searchsorted(times, times - WINDOW + 1e-9, side="left")
    rate = (until[1:] - until[before]) / WINDOW / 1000
    first = min(int(np.searchsorted(times, times[0] + WINDOW - 1 / float(info.rate) - 1e-9)), len(times) - 1)
    all_bits = max(8 * info.size, int(bits.sum()), 1)
    rows = [
        Total(name, int(kind.sum()), int(bits[kind].sum()), float(bits[kind].sum()) / all_bits)
        for name, kind in (("I planes", intra), ("P planes", ~intra))
    ]
    rest = 8 * info.size - int(bits.sum())
    if rest > 0:
        rows.append(Total("around them", None, rest, rest / all_bits))
    return Rates(times, bits, intra, rate[first:], tuple(rows), info.bits_per_second / 1000)


def probe_encoded(animation: Animation) -> StreamInfo | None:
    """Return information about an animation as if encoded; None if it is too long or cannot be encoded."""
    tracks = [track for track in (animation.face, animation.body) if track is not None]
    if not len(animation) or sum(int(track.mask.sum()) for track in tracks) > MAX_VALUES:
        return None
    from fba.codec import probe_stream
    from fba.errors import FbaError
    from fba.planning import encode

    try:
        return probe_stream(encode(animation))
    except (FbaError, ValueError):
        return None


def bars_of_planes(
    times: Float64, bits: Float64, intra: Bool, low: float, high: float, count: int
) -> tuple[Float64, Bool]:
    """Return the bits (count,) of the largest plane in each equal part of low..high, and whether it has an I
    plane.

    Parts without a plane have 0.
    """
    tall, key = np.zeros(count), np.zeros(count, bool)
    if not high > low:
        return tall, key
    seen = (times >= low - 1e-9) & (times <= high + 1e-9)
    columns = np.clip(((times[seen] - low) / (high - low) * count).astype(int), 0, count - 1)
    np.maximum.at(tall, columns, bits[seen])
    key[columns[intra[seen]]] = True
    return tall, key
