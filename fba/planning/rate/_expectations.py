"""Expected motion of parameters in a live stream: how far and how fast they move."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64, Int32, Int64
from fba.parameters import BAP_COUNT, FAP_COUNT, Bap, Fap, bap_steps, baps, fap_steps, faps
from fba.tracks import BodyTrack, FaceTrack

FAST_FAPS = [*range(18, 26), *range(42, 47)]
"""Columns of lids, eyes and tongue."""
SHOULDERS = slice(31, 37)
"""Columns of BAPs that may all jump at once, although the pose hardly moves."""


@dataclass(frozen=True)
class Tuning:
    """Constants of the expectations. Seconds are the shortest from the least value to the largest."""

    slow_seconds: float = 1.0  # of most FAPs
    fast_seconds: float = 0.06  # of `FAST_FAPS` and `SHOULDERS`
    limb_seconds: float = 0.3  # of the other BAPs
    gap: float = 0.05  # s between two planes to be expected; frames may come faster
    unknown_limit: int = 60  # table steps that a parameter without limits in the standard reaches
    bits_of_finest: float = 8.0  # for a parameter in a frame, at which quantiser 1 suits; at half of it, 2
    max_quantiser: int = 6  # with a coarser quantiser, slow turns of the head visibly move in steps


TUNING = Tuning()


def expected_motion(frame: Animation, extremes: Animation | None) -> Animation:
    """Return motion of the sent parameters, from the least values to the largest and back at full speed.

    extremes: an animation with the least and the largest values; parameters that it does not move get the
    standard's limits. Faster motion will lag behind by a frame or two.
    """
    rate = min(float(frame.rate), 1 / TUNING.gap)
    turn = math.ceil(TUNING.slow_seconds * rate)
    index = np.arange(2 * (turn + 1))
    face: FaceTrack | None = None
    body: BodyTrack | None = None
    if frame.face is not None:
        seconds = np.full(FAP_COUNT, TUNING.slow_seconds)
        seconds[FAST_FAPS] = TUNING.fast_seconds
        ends = _ends(None if extremes is None else extremes.face, faps(), fap_steps())
        values = _there_and_back(*ends, seconds * rate, turn)
        values[:, :2] = 0
        face = FaceTrack(values, np.broadcast_to(frame.face.mask[0], values.shape))
    if frame.body is not None:
        ends = _ends(None if extremes is None else extremes.body, baps(), bap_steps("iso"))
        seconds = np.full(BAP_COUNT, TUNING.limb_seconds)
        seconds[SHOULDERS] = TUNING.fast_seconds
        values = _there_and_back(*ends, seconds * rate, turn)
        body = BodyTrack(values, np.broadcast_to(frame.body.mask[0], values.shape))
    return Animation(frame.rate, index, face, body)


def quantiser_for(frame: Animation, rate: float) -> int:
    """Return the fap_quant and bap_quant for a rate, in bits a second, and the parameters of a frame."""
    tracks = [track for track in (frame.face, frame.body) if track is not None]
    count = max(1, sum(int(track.mask.sum()) for track in tracks))
    wanted = TUNING.bits_of_finest * count * float(frame.rate) / rate
    return min(max(round(wanted), 1), TUNING.max_quantiser)


def _ends(
    track: FaceTrack | BodyTrack | None, table: Sequence[Fap | Bap], steps: Int64
) -> tuple[Float64, Float64]:
    """Return the least and the largest values: those of a track, or else of the table."""
    limits = (
        np.array([parameter.i_limits or (-TUNING.unknown_limit, TUNING.unknown_limit) for parameter in table])
        * steps[:, None]
    )
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
