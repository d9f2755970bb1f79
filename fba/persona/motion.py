"""How a face moves about its rest, as plain statistics: how far, how fast for that, and which side more.

A take's own mean and the tremble of its tracker do not count. So these say what masks, which are single
moments, do not: the same smile shown widely or narrowly, quickly or slowly, more on the left.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fba.arrays import Float64, Intp
from fba.persona.points.layout import part_vertices, standard_mask

FEWEST = 8
"""Frames of a class that tell how it is moved; a class with fewer has the values of all frames."""
STILL = 0.15
"""Millimetres that are added to each deviation, in squares: below this, nothing is told."""
LAG = 0.13
"""Seconds between the frames whose difference tells a speed."""
APART = 1.5
"""Natural logarithm by which the speed of a class differs from that of all frames at most."""
SPEEDS = (0.05, 50.0)
"""Least and greatest speed for an amplitude, per second."""
TRUST_ALL, TRUST_CLASS = 1.5, 6.0
"""Seconds of motion that count as much as the assumption that an actor and a user move alike; and, for a
class, that it differs as all frames do."""
MOST_GAIN = float(np.log(2.5))
"""Natural logarithm of the greatest change of an amplitude."""
SIDE = 3.0
"""Millimetres from the middle of the face at which a side begins."""


@dataclass(frozen=True, eq=False)
class Motion:
    """How a part moves, in each of C classes and, in the last row, in all frames.

    seconds: float64 (C + 1,), how long each was seen. spread: (C + 1, 2V), natural logarithm of the standard
    deviation of each coordinate of the part's vertices, all x and then all y, millimetres on the standard
    face: displacements are from the rest, in the measures of the face at rest, and the tracker's tremble is
    taken off. speed: (C + 1,), natural logarithm of the root mean square speed over that deviation, 1/s.
    """

    seconds: Float64
    spread: Float64
    speed: Float64


class Tally:
    """Sums of a part's motion in one or several takes, of which `motion` gives the statistics.

    count: of classes. width: 2V, coordinates of the part.
    """

    def __init__(self, count: int, width: int) -> None:
        self._frames, self._seconds, self._pairs, self._energy = np.zeros((4, count + 1))
        self._total, self._square = np.zeros((2, count + 1, width))
        self._tremble = np.zeros(width)

    def add(self, moved: Float64, classes: Intp, frames: Intp, rate: float) -> None:
        """Add displacements (S, 2V) on the standard face.

        classes: (S,), -1 for none. frames: (S,), numbers, increasing; only frames without a gap between them
        tell a speed. rate: frames per second.
        """
        member = np.zeros((len(self._frames), len(moved)))
        member[-1] = 1.0
        seen = np.flatnonzero(classes >= 0)
        member[classes[seen], seen] = 1.0
        self._frames += member.sum(axis=1)
        self._seconds += member.sum(axis=1) / rate
        self._total += member @ moved
        self._square += member @ moved**2
        lag = max(2, round(LAG * rate))
        first = np.flatnonzero(frames[lag:] - frames[:-lag] == lag)
        near = (moved[first + 1] - moved[first]) ** 2
        far = (moved[first + lag] - moved[first]) ** 2
        # tremble adds the same to both, so their difference is what the face has moved
        pace = (far - near) / (lag**2 - 1)
        within = member[:, first + lag // 2]
        self._pairs += within.sum(axis=1)
        self._energy += within @ pace.sum(axis=1) * rate**2
        self._tremble += ((near - pace) / 2).sum(axis=0)

    def motion(self) -> Motion:
        """Return the statistics of what was added."""
        frames = np.maximum(self._frames, 1.0)[:, None]
        variance = self._square / frames - (self._total / frames) ** 2
        tremble = np.maximum(self._tremble / max(self._pairs[-1], 1.0), 0.0)
        variance = np.maximum(variance - tremble, 0.0) + STILL**2
        few = self._frames < FEWEST
        variance[few] = variance[-1]
        speed = (
            np.log(np.maximum(self._energy / np.maximum(self._pairs, 1.0), 1e-12) / variance.sum(axis=1)) / 2
        )
        speed[-1] = np.clip(speed[-1], *np.log(SPEEDS))
        speed[few | (self._pairs < FEWEST)] = speed[-1]
        speed = np.clip(speed, speed[-1] - APART, speed[-1] + APART)
        return Motion(self._seconds.copy(), np.log(variance) / 2, speed)


def flatten(moved: Float64) -> Float64:
    """Return displacements (S, V, 2) as (S, 2V): all x, then all y."""
    return np.concatenate([moved[..., 0], moved[..., 1]], axis=1)


def unflatten(moved: Float64) -> Float64:
    """Return displacements (S, 2V) as (S, V, 2)."""
    return np.stack(np.split(moved, 2, axis=1), axis=2)


def measure_motion(moved: Float64, classes: Intp, frames: Intp, rate: float, count: int) -> Motion:
    """Return the statistics of one take; see `Tally.add`. count: of classes."""
    tally = Tally(count, moved.shape[1])
    tally.add(moved, classes, frames, rate)
    return tally.motion()


def find_gains(actor: Motion, user: Motion) -> Float64:
    """Return by how much the actor moves each coordinate further than the user, in each class and in all
    frames: float64 (C + 1, 2V), natural logarithms.

    What few frames tell is drawn to what all frames tell, and this to no change.
    """
    seen = np.minimum(actor.seconds, user.seconds)
    whole = (actor.spread[-1] - user.spread[-1]) * _trust(seen[-1], TRUST_ALL)
    gains = whole + (actor.spread - user.spread - whole) * _trust(seen, TRUST_CLASS)[:, None]
    gains[-1] = whole
    return np.asarray(np.clip(gains, -MOST_GAIN, MOST_GAIN))


def find_pace(actor: Motion, user: Motion) -> float:
    """Return by how much faster than the user the actor moves for the same amplitude: a natural logarithm."""
    seen = np.minimum(actor.seconds[-1], user.seconds[-1])
    return float((actor.speed[-1] - user.speed[-1]) * _trust(seen, TRUST_ALL))


def _trust(seconds: Float64, enough: float) -> Float64:
    return np.asarray(seconds / (seconds + enough))


def shift_reference(user: Motion, before: Motion, after: Motion) -> Motion:
    """Return a user's usual statistics as they are once a take has been changed.

    before, after: the take's statistics without and with the change.
    """
    return Motion(
        user.seconds, user.spread + after.spread - before.spread, user.speed + after.speed - before.speed
    )


def describe_motion(motions: Mapping[str, Motion] | None) -> dict[str, Any] | None:
    """Return how an actor moves, in plain numbers; None where that is not known.

    motions: `Persona.motions`. In the result, left_over_right: how many times as far the left side moves as
    the right, of mouth, eyes and brows. parts: by name, millimetres on the standard face (root mean square of
    the deviations), and speed, per second of that amplitude.
    """
    if motions is None:
        return None
    mouth = motions["mouth"].spread[-1]
    across = np.tile(standard_mask()[part_vertices("mouth"), 0], 2)
    sides = {"mouth": mouth[across > SIDE].mean() - mouth[across < -SIDE].mean()}
    for name in ("eye", "brow"):
        left, right = (motions[f"{side}_{name}"].spread[-1].mean() for side in ("left", "right"))
        sides[f"{name}s"] = left - right
    return {
        "left_over_right": {name: float(np.exp(value)) for name, value in sides.items()},
        "parts": {
            part: {
                "millimetres": float(np.sqrt(np.exp(2 * one.spread[-1]).mean())),
                "speed": float(np.exp(one.speed[-1])),
            }
            for part, one in motions.items()
        },
    }
