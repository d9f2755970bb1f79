"""Statistics of a face's motion about its rest: amplitude, speed for that amplitude, and sides.

The mean of a take and the jitter of its tracker are taken off. Masks are single moments; these statistics
tell whether the same smile is wide or narrow, quick or slow, or more on the left.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fba.arrays import Float64, Intp
from fba.persona.points.layout import part_vertices, standard_mask

SIDE = 3.0
"""Distance from the middle of the face at which a side begins, millimetres."""


@dataclass(frozen=True)
class Tuning:
    """Constants of the statistics. `prior`: seconds of motion that weigh as much as the assumption itself."""

    min_frames: int = 8  # of a class; with fewer it has the values of all frames
    noise: float = 0.15  # mm, added to each deviation in squares: smaller deviations show nothing
    lag: float = 0.13  # s between the frames whose difference gives a speed
    max_log_ratio: float = 1.5  # natural logarithm of a class's speed relative to that of all frames
    min_speed: float = 0.05  # amplitudes a second
    max_speed: float = 50.0
    prior: float = 1.5  # s; the assumption: an actor and a user move alike
    class_prior: float = 6.0  # s; the assumption: in a class they differ as in all frames
    max_gain: float = float(np.log(2.5))  # natural logarithm of the largest change of an amplitude


TUNING = Tuning()


@dataclass(frozen=True, eq=False)
class Motion:
    """Statistics of a part's motion, in each of C classes and, in the last row, in all frames.

    seconds: float64 (C + 1,), duration. spread: (C + 1, 2V), natural logarithm of the standard deviation of
    each coordinate of the part's vertices, all x and then all y, millimetres on the standard face, without
    the tracker's jitter. speed: (C + 1,), natural logarithm of the root mean square speed over that
    deviation, 1/s.
    """

    seconds: Float64
    spread: Float64
    speed: Float64


class Tally:
    """Sums of a part's motion over takes, from which `motion` computes the statistics.

    count: number of classes. width: 2V, coordinates of the part.
    """

    def __init__(self, count: int, width: int) -> None:
        self._frames, self._seconds, self._pairs, self._energy = np.zeros((4, count + 1))
        self._total, self._square = np.zeros((2, count + 1, width))
        self._jitter = np.zeros(width)

    def add(self, moved: Float64, classes: Intp, frames: Intp, rate: float) -> None:
        """Add displacements (S, 2V) on the standard face.

        classes: (S,), -1 for none. frames: (S,), increasing numbers; speeds are measured where there is no
        gap. rate: frames per second.
        """
        member = np.zeros((len(self._frames), len(moved)))
        member[-1] = 1.0
        seen = np.flatnonzero(classes >= 0)
        member[classes[seen], seen] = 1.0
        self._frames += member.sum(axis=1)
        self._seconds += member.sum(axis=1) / rate
        self._total += member @ moved
        self._square += member @ moved**2
        lag = max(2, round(TUNING.lag * rate))
        first = np.flatnonzero(frames[lag:] - frames[:-lag] == lag)
        near = (moved[first + 1] - moved[first]) ** 2
        far = (moved[first + lag] - moved[first]) ** 2
        # jitter adds the same to both, so their difference is the motion of the face
        pace = (far - near) / (lag**2 - 1)
        within = member[:, first + lag // 2]
        self._pairs += within.sum(axis=1)
        self._energy += within @ pace.sum(axis=1) * rate**2
        self._jitter += ((near - pace) / 2).sum(axis=0)

    def motion(self) -> Motion:
        """Return the statistics of all that was added."""
        frames = np.maximum(self._frames, 1.0)[:, None]
        variance = self._square / frames - (self._total / frames) ** 2
        jitter = np.maximum(self._jitter / max(self._pairs[-1], 1.0), 0.0)
        variance = np.maximum(variance - jitter, 0.0) + TUNING.noise**2
        few = self._frames < TUNING.min_frames
        variance[few] = variance[-1]
        energy = np.maximum(self._energy / np.maximum(self._pairs, 1.0), 1e-12)
        speed = np.log(energy / variance.sum(axis=1)) / 2
        speed[-1] = np.clip(speed[-1], np.log(TUNING.min_speed), np.log(TUNING.max_speed))
        speed[few | (self._pairs < TUNING.min_frames)] = speed[-1]
        speed = np.clip(speed, speed[-1] - TUNING.max_log_ratio, speed[-1] + TUNING.max_log_ratio)
        return Motion(self._seconds.copy(), np.log(variance) / 2, speed)


def flatten(moved: Float64) -> Float64:
    """Return displacements (S, V, 2) as (S, 2V): all x, then all y."""
    return np.concatenate([moved[..., 0], moved[..., 1]], axis=1)


def unflatten(moved: Float64) -> Float64:
    """Return displacements (S, 2V) as (S, V, 2)."""
    return np.stack(np.split(moved, 2, axis=1), axis=2)


def measure_motion(moved: Float64, classes: Intp, frames: Intp, rate: float, count: int) -> Motion:
    """Return the statistics of one take; see `Tally.add`. count: number of classes."""
    tally = Tally(count, moved.shape[1])
    tally.add(moved, classes, frames, rate)
    return tally.motion()


def find_gains(actor: Motion, user: Motion) -> Float64:
    """Return the amplitudes of the actor relative to the user's: float64 (C + 1, 2V), natural logarithms.

    Rows are classes, then all frames. Values from few frames shrink towards those from all frames, and these
    towards no change.
    """
    seen = np.minimum(actor.seconds, user.seconds)
    whole = (actor.spread[-1] - user.spread[-1]) * _trust(seen[-1], TUNING.prior)
    gains = whole + (actor.spread - user.spread - whole) * _trust(seen, TUNING.class_prior)[:, None]
    gains[-1] = whole
    return np.asarray(np.clip(gains, -TUNING.max_gain, TUNING.max_gain))


def find_pace(actor: Motion, user: Motion) -> float:
    """Return the speed of the actor relative to the user's, for the same amplitude: a natural logarithm."""
    seen = np.minimum(actor.seconds[-1], user.seconds[-1])
    return float((actor.speed[-1] - user.speed[-1]) * _trust(seen, TUNING.prior))


def _trust(seconds: Float64, prior: float) -> Float64:
    return np.asarray(seconds / (seconds + prior))


def shift_reference(user: Motion, before: Motion, after: Motion) -> Motion:
    """Return a user's usual statistics with the change that a take has undergone.

    before, after: statistics of the take without and with the change.
    """
    return Motion(
        user.seconds, user.spread + after.spread - before.spread, user.speed + after.speed - before.speed
    )


def describe_motion(motions: Mapping[str, Motion] | None) -> dict[str, Any] | None:
    """Return the statistics of `Persona.motions` in plain numbers; None without them.

    left_over_right: amplitude of the left side relative to the right, of mouth, eyes and brows. parts: by
    name, millimetres on the standard face (root mean square of the deviations), and speed, in such amplitudes
    a second.
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
                "millimetres": float(np.sqrt(np.exp(2 * motion.spread[-1]).mean())),
                "speed": float(np.exp(motion.speed[-1])),
            }
            for part, motion in motions.items()
        },
    }
