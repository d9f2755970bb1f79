"""Fits a camera to a moving body, and decides whether it must follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba_player.view._camera import Subject

BODY_SUBJECT = Subject((0.0, 0.88, 0.0), 0.98, 0.62)
"""A body that stands at the origin."""
HIPS = 0.78
MAX_STANDING_TRAVEL = 0.12
"""Legs that move by less than this (m) count as still."""
MAX_FIXED_TRAVEL = 4.0
"""The camera follows a performance that moves further than this (m)."""
MIN_APPROACH = 0.12
"""Movement (m) below which the camera's distance is not enlarged."""
ARM_REACH = 1.0
"""Half the width (m) of a person with stretched arms."""
LOWER = 0.09
"""Metres below the root of a person who walks away at which the middle of the picture is."""
HEAD_JOINT = "skullbase"
LEGS = ("l_knee", "r_knee", "l_ankle", "r_ankle")


@dataclass(frozen=True)
class Extent:
    """The space that a performance takes.

    follows: whether it goes too far for one fixed camera. legs_move: whether legs move by more than
    `MAX_STANDING_TRAVEL`.
    """

    subject: Subject
    follows: bool
    legs_move: bool

    @property
    def upper_half(self) -> Subject:
        subject = self.subject
        x, y, z = subject.centre
        top = y + subject.half_height
        bottom = min(HIPS, top - 0.8)
        half_width = min(subject.half_width, 0.55)
        return Subject((x, (top + bottom) / 2, z), (top - bottom) / 2, half_width, subject.half_depth)


HEADROOM = 0.14
"""Metres above the highest joint that a head takes."""


def body_extent(
    positions: Float64, names: tuple[str, ...], headroom: float = HEADROOM, *, follow: str | None = None
) -> Extent:
    """Return the extent of joints at positions (T, J, 3), metres, the root first, over T moments.

    headroom: metres above the highest joint. follow: what the camera was told to follow, see `FOLLOWS`.
    """
    legs = positions[:, [names.index(name) for name in LEGS if name in names]]
    legs_move = bool(legs.size) and bool(np.abs(legs - legs[0]).max() > MAX_STANDING_TRAVEL)
    low, high = positions.min(axis=(0, 1)), positions.max(axis=(0, 1))
    finite = bool(np.isfinite(high - low).all())
    far = not finite or (high - low).max() > MAX_FIXED_TRAVEL
    if (far and (follow != "none" or not finite)) or follow in ("hips", "head"):
        x, y, z = positions[0, 0].tolist()
        more = _head_above(positions, names, headroom) / 2
        subject = Subject((x, y - LOWER + more, z), BODY_SUBJECT.half_height + more, _reach(positions))
        return Extent(subject, follows=True, legs_move=legs_move)
    low, high = low - np.array([0.10, 0.06, 0.10]), high + np.array([0.10, max(headroom, HEADROOM), 0.10])
    aside = (low + high) / 2 * (1.0, 0.0, 1.0)  # for a body that does not stand at the origin
    low = np.minimum(low, np.array(BODY_SUBJECT.centre) - (0.35, 0.95, 0.3) + aside)
    x, y, z = ((low + high) / 2).tolist()
    wide = float(np.hypot(high[0] - low[0], high[2] - low[2])) / 2
    tall = max(float(high[1] - low[1]) / 2 * 1.06, 0.9)
    path = positions[:, 0, [0, 2]]
    towards = float(np.linalg.norm(path - (x, z), axis=1).max())  # from any side
    subject = Subject((x, y, z), tall, max(wide, BODY_SUBJECT.half_width), max(towards - MIN_APPROACH, 0.0))
    return Extent(subject, follows=False, legs_move=legs_move)


def _reach(positions: Float64) -> float:
    """Return half the width that a walker takes, metres: more than usual with arms stretched out."""
    if not np.isfinite(positions).all():
        return BODY_SUBJECT.half_width
    away = np.linalg.norm((positions - positions[:, :1])[..., [0, 2]], axis=2)
    return min(max(float(away.max()), BODY_SUBJECT.half_width), ARM_REACH)


def _head_above(positions: Float64, names: tuple[str, ...], headroom: float) -> float:
    """Return metres by which a head rises above `BODY_SUBJECT` at the root at most; 0 for usual ones."""
    if HEAD_JOINT not in names or not np.isfinite(positions).all():
        return 0.0
    height = float((positions[:, names.index(HEAD_JOINT), 1] - positions[:, 0, 1]).max())
    return max(height + headroom - (BODY_SUBJECT.half_height - LOWER), 0.0)
