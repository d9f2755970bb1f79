"""What is to come, of which nothing is known yet: how far and how fast parameters move."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64, Int32, Int64
from fba.parameters import BAP_COUNT, FAP_COUNT, Bap, Fap, bap_steps, baps, fap_steps, faps
from fba.tracks import BodyTrack, FaceTrack

SLOW_SECONDS = 1.0
"""Shortest time, in seconds, in which most parameters go from one end to the other."""
FAST_SECONDS = 0.06
"""The same for lids, eyes and tongue."""
FAST_FAPS = [*range(18, 26), *range(42, 47)]
LIMB_SECONDS = 0.3
"""The same for the angles of a body; those of a shoulder may all jump at once, and the pose hardly moves."""
SHOULDERS = slice(31, 37)
GAP = 0.05
"""Seconds between two planes that are reckoned with; frames may come faster."""
UNKNOWN = 60
"""Table steps that a parameter without limits in the standard reaches."""
BITS_OF_FINEST = 8.0
"""Bits for a parameter in a frame at which quantiser 1 serves; at half of them quantiser 2, and so on."""
COARSEST_QUANTISER = 6
"""With a coarser one, a slow turn of the head is seen in steps."""


def expected_motion(frame: Animation, extremes: Animation | None = None) -> Animation:
    """Return motion of what a frame sends, from the least values to the largest and back, as fast as it goes.

    extremes: an animation that reaches the least and the largest values; the standard's limits count for what
    it does not move. What goes faster than this lags behind by a frame or two.
    """
    rate = min(float(frame.rate), 1 / GAP)
    turn = math.ceil(SLOW_SECONDS * rate)
    index = np.arange(2 * (turn + 1))
    face: FaceTrack | None = None
    body: BodyTrack | None = None
    if frame.face is not None:
        seconds = np.full(FAP_COUNT, SLOW_SECONDS)
        seconds[FAST_FAPS] = FAST_SECONDS
        ends = _ends(None if extremes is None else extremes.face, faps(), fap_steps())
        values = _there_and_back(*ends, seconds * rate, turn)
        values[:, :2] = 0
        face = FaceTrack(values, np.broadcast_to(frame.face.mask[0], values.shape))
    if frame.body is not None:
        ends = _ends(None if extremes is None else extremes.body, baps(), bap_steps("iso"))
        seconds = np.full(BAP_COUNT, LIMB_SECONDS)
        seconds[SHOULDERS] = FAST_SECONDS
        values = _there_and_back(*ends, seconds * rate, turn)
        body = BodyTrack(values, np.broadcast_to(frame.body.mask[0], values.shape))
    return Animation(frame.rate, index, face, body)


def quantiser_for(frame: Animation, rate: float) -> int:
    """Return the fap_quant and bap_quant that suits a rate, in bits a second, for what a frame sends."""
    tracks = [track for track in (frame.face, frame.body) if track is not None]
    count = max(1, sum(int(track.mask.sum()) for track in tracks))
    wanted = BITS_OF_FINEST * count * float(frame.rate) / rate
    return min(max(round(wanted), 1), COARSEST_QUANTISER)


def _ends(
    track: FaceTrack | BodyTrack | None, table: Sequence[Fap | Bap], steps: Int64
) -> tuple[Float64, Float64]:
    """Return the least and the largest values: those of a track, or else of the table."""
    limits = np.array([one.i_limits or (-UNKNOWN, UNKNOWN) for one in table]) * steps[:, None]
    least, most = limits[:, 0].astype(np.float64), limits[:, 1].astype(np.float64)
    if track is not None:
        moved = np.asarray(track.values.any(axis=0))
        least[moved] = track.values.min(axis=0)[moved]
        most[moved] = track.values.max(axis=0)[moved]
    return least, most


def _there_and_back(least: Float64, most: Float64, frames: Float64, turn: int) -> Int32:
    """Return int32 (2 (turn + 1), columns): from `least` to `most` in `frames` each, and back."""
    share = np.minimum(np.arange(turn + 1)[:, None] / np.maximum(frames, 1.0), 1.0)
    there = np.rint(least + (most - least) * share).astype(np.int32)
    return np.concatenate([there, there[::-1]])
