"""Eyes and lids: eyes hold their gaze while the head moves, lids follow them and blink."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from performance.curves import RATE, Float, read_table, sample_times

SHUT_TOP, SHUT_BOTTOM = 930.0, 110.0
"""FAP values of both lids of a closed eye: together more than 1024, the height of the opening."""
FOLLOW_TOP, FOLLOW_BOTTOM = 13.0, -6.0
"""FAP units by which a lid moves for each degree that the eye looks down."""
OPEN = 60.0
"""FAP units by which awake eyes are opened wider than those of the neutral face."""
STILL = 30
"""Samples (0.1 s) between the small flicks that eyes make all the time."""


def eyeballs(yaw: Float, pitch: Float, head: Rotation) -> tuple[Float, Float]:
    """((T,) left, (T,) down) of the eyeballs in the head, degrees, for a gaze in the world, degrees."""
    turn = np.deg2rad([yaw, pitch])
    looked = np.stack(
        [np.sin(turn[0]) * np.cos(turn[1]), -np.sin(turn[1]), np.cos(turn[0]) * np.cos(turn[1])], axis=-1
    )
    x, y, z = head.inv().apply(looked).T
    return np.rad2deg(np.arctan2(x, z)), np.rad2deg(np.arctan2(-y, np.hypot(x, z)))


def lids(pitch: Float, squint: Float, smile: Float) -> tuple[Float, Float]:
    """(top (T,), bottom (T,)) FAP values of the lids. squint: -1 wide .. 1 narrow."""
    shut = _blinks()
    top = FOLLOW_TOP * pitch - OPEN + np.where(squint < 0, 190, 60) * squint
    bottom = FOLLOW_BOTTOM * pitch + 150 * np.maximum(squint, 0) + 85 * smile
    top, bottom = np.clip(top, -250, 850), np.clip(bottom, -150, 300)
    return top + (SHUT_TOP - top) * shut, bottom + (SHUT_BOTTOM - bottom) * shut


def _blinks() -> Float:
    """(T,) closure by blinks, 0 open .. 1 shut: down fast, up slower, and slower still at the end."""
    time = sample_times()
    result = np.zeros(round(len(time)))
    for row in read_table("blinks.csv"):
        start, closing, shut, opening = (float(row[k]) for k in ("time", "closing", "shut", "opening"))
        down = np.clip((time - start) / closing, 0, 1)
        up = np.clip((time - start - closing - shut) / opening, 0, 1)
        result = np.maximum(result, down**2 * (3 - 2 * down) * (1 - up) ** 2 * (1 + 2 * up))
    return result


def flicks(seed: int) -> Float:
    """(T,) degrees: random steps of about a third of a degree, each held until the next."""
    steps = np.arange(round(len(sample_times()) / STILL))
    held = 0.45 * (np.modf((steps // (2 + steps % 3 % 2) * 7 + seed) * 0.6180339887498949)[0] - 0.5)
    assert RATE % 10 == 0
    return np.repeat(held, STILL)
