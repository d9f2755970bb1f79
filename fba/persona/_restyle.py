"""A user's motion with an actor's amplitude, speed and sides: what `perform` and `LivePersona` do with the
statistics of a Persona.

Expressions keep their moments: nothing is moved in time. A lip or lid that the user shuts stays shut.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Float64, Intp
from fba.persona.motion import Motion, Tally, find_gains, find_pace, measure_motion, shift_reference
from fba.persona.points.layout import standard_points

EASE = 0.15
"""Seconds (deviation of a Gaussian) over which gains pass from one class to the next."""
RETIMED = ("mouth", "left_brow", "right_brow")
"""Parts that become slower or faster. Lids do not: a blink that is drawn out does not shut."""
MOST_PACE = float(np.log(2.0))
"""Natural logarithm of the greatest change of a speed."""
SLOWEST, SHARPEST, STEPS = 0.4, 3.0, 7
"""Seconds (deviation) of the broadest smoothing, strength of the greatest sharpening, halvings that find
either."""
SHARP, WIDE, REACH = 0.17, 0.1, 0.17
"""Seconds: deviations of the smoothings by which motion is sharpened, and how far away the values are that
it does not pass."""
BEYOND, BEND = 1.15, 0.8
"""Share of the actor's own reach that is the limit, and share of the limit where motion begins to yield."""
LIDS = ((14, 11), (18, 16), (20, 12), (23, 13), (25, 24), (26, 22))
"""Points of upper and lower lids that meet."""
LIPS = ((29, 32), (30, 33), (31, 34))
"""Points of the inner edges of the lips that meet."""
UPPER, LOWER = (29, 30, 31, 43, 44, 46, 47, 48, 49, 50, 51), (32, 33, 34, *range(35, 42), 52, 53)
"""Points of the upper and the lower lip."""
LID_SHUT, LIP_SHUT = (0.15, 0.4), (0.4, 1.6)
"""Openings at which lids and lips count as shut, and above which as open: shares of the lids' at rest;
millimetres between the lips."""
UPPER_LID = 0.8
"""Share of a lid's closing that the upper one does."""


class Take(NamedTuple):
    """Frames of a take. classes: (S,), -1 for none. frames: (S,), their numbers. rate: frames per second."""

    classes: Intp
    frames: Intp
    rate: float


def restyle(
    part: str,
    own: Float64,
    mapped: Float64,
    take: Take,
    actor: Motion,
    reach: Float64,
    user: Motion | None,
) -> Float64:
    """Return displacements (S, 2V) of a part, on the standard face, that move as the actor does.

    own: the user's. mapped: what the actor's curves make of them. reach: (2V,), of the actor, see
    `PartStyle.reach`. user: how the user moves as a rule; None: as in this take.
    """
    classes, frames, rate = take
    count = len(actor.seconds) - 1
    moved = mix(own, mapped)
    shown = measure_motion(moved, *take, count)
    known = shown
    if user is not None:
        known = shift_reference(user, measure_motion(own, *take, count), shown)
    gains = fill_gaps(find_gains(actor, known)[classes], frames)
    moved = moved * np.exp(smooth(gains, EASE * rate)[frames - frames[0]])
    if part in RETIMED:
        before = measure_motion(moved, *take, count)
        goal = shown.speed[-1] + np.clip(find_pace(actor, known), -MOST_PACE, MOST_PACE)
        every = fill_gaps(moved, frames)
        moved = retime(every, rate, float(goal - before.speed[-1]))[frames - frames[0]]
        after = measure_motion(moved, *take, count)
        moved = moved * np.exp((before.spread[-1] - after.spread[-1]).mean())
    return limit_reach(moved, own, reach)


def mix(own: Float64, mapped: Float64) -> Float64:
    """Return the mean of a user's displacements and of what the actor's curves make of them.

    The curves have what the actor adds (a brow that goes with the smile), the user's own what is lively and
    exact; each alone comes less near to the actor.
    """
    return (own + mapped) / 2


def fill_gaps(values: Float64, frames: Intp) -> Float64:
    """Return values (S, N) of some frames (S,) for every frame from the first to the last one."""
    every = np.arange(frames[0], frames[-1] + 1)
    if len(every) == len(frames):
        return values
    return np.stack([np.interp(every, frames, column) for column in values.T], axis=1)


def smooth(values: Float64, deviation: float) -> Float64:
    """Return values (S, N) smoothed in time by a Gaussian, with its deviation in frames; ends are held."""
    half = int(np.ceil(3 * deviation))
    if half < 1 or not len(values):
        return values
    weights = np.exp(-0.5 * (np.arange(-half, half + 1) / max(deviation, 1e-6)) ** 2)
    weights /= weights.sum()
    held = np.pad(values, ((half, half), (0, 0)), mode="edge")
    return np.asarray(np.lib.stride_tricks.sliding_window_view(held, 2 * half + 1, axis=0) @ weights)


def sharpen(values: Float64, rate: float, strength: float) -> Float64:
    """Return values (S, N) whose changes are steeper, at the same moments; they go no further than values
    near them do, so that nothing rings."""
    base, half = smooth(values, WIDE * rate), max(1, round(REACH * rate))
    held = np.pad(base, ((half, half), (0, 0)), mode="edge")
    near = np.lib.stride_tricks.sliding_window_view(held, 2 * half + 1, axis=0)
    steep = values + strength * (base - smooth(values, SHARP * rate))
    return np.clip(steep, np.minimum(near.min(axis=2), values), np.maximum(near.max(axis=2), values))


def retime(moved: Float64, rate: float, pace: float) -> Float64:
    """Return displacements (S, N) that are faster, or slower, by exp(pace) for their amplitude.

    Slower: smoothed, evenly before and after, so that each expression is at its strongest when it was.
    Faster: sharpened. How much, is found by halving.
    """
    if abs(pace) < 1e-3:
        return moved
    start = _pace(moved, rate)
    low, high = 0.0, SLOWEST if pace < 0 else SHARPEST
    for _ in range(STEPS):
        middle = (low + high) / 2
        changed = smooth(moved, middle * rate) if pace < 0 else sharpen(moved, rate, middle)
        if abs(_pace(changed, rate) - start) < abs(pace):
            low = middle
        else:
            high = middle
    return smooth(moved, low * rate) if pace < 0 else sharpen(moved, rate, low)


def _pace(moved: Float64, rate: float) -> float:
    """Return the natural logarithm of speed over amplitude of all frames."""
    nothing = np.full(len(moved), -1)
    return float(measure_motion(moved, nothing, np.arange(len(moved)), rate, 0).speed[-1])


def limit_reach(moved: Float64, own: Float64, reach: Float64) -> Float64:
    """Return displacements (S, 2V) that go no further than the actor's masks and curves do, and a little:
    they yield as they come near. What the user does is no limit to less than it is."""
    return moved * yielding(np.abs(moved), np.maximum(BEYOND * reach, np.abs(own)))


def yielding(size: Float64, most: Float64) -> Float64:
    """Return by what sizes are multiplied so that they stay below `most`: 1 up to `BEND` of it."""
    start, room = BEND * most, (1 - BEND) * most + 1e-9
    over = np.maximum(size - start, 0.0)
    return np.where(over > 0, (start + room * np.tanh(over / room)) / np.maximum(size, 1e-9), 1.0)


def keep_shut(moved: Float64, own: Float64, face: Float64, users: Float64) -> None:
    """Shut lids and lips of masks (S, 86, 3), in place, in frames in which the user's are.

    own: (S, 86, 3), what the user does. face, users: (64, 2), both at rest. Millimetres. Lids and lips that
    would pass each other are brought back, too.
    """
    for upper, lower in LIDS:
        rest, theirs = _gap(face, upper, lower), _gap(users, upper, lower)
        if min(rest, theirs) <= 0:
            continue
        share = 1 + (own[:, upper - 1, 1] - own[:, lower - 1, 1]) / theirs
        now = 1 + (moved[:, upper - 1, 1] - moved[:, lower - 1, 1]) / rest
        more = rest * _too_open(now, share, LID_SHUT)
        moved[:, upper - 1, 1] -= UPPER_LID * more
        moved[:, lower - 1, 1] += (1 - UPPER_LID) * more
    closing = np.zeros((len(moved), len(LIPS)))
    for n, (upper, lower) in enumerate(LIPS):
        rest, theirs = max(_gap(face, upper, lower), 0.0), max(_gap(users, upper, lower), 0.0)
        apart = theirs + own[:, upper - 1, 1] - own[:, lower - 1, 1]
        now = rest + moved[:, upper - 1, 1] - moved[:, lower - 1, 1]
        closing[:, n] = _too_open(now, apart, LIP_SHUT)
    middles = standard_points()[[upper - 1 for upper, _ in LIPS], 0]
    for points, sign in ((UPPER, -0.5), (LOWER, 0.5)):
        rows = [point - 1 for point in points]
        nearest = np.abs(standard_points()[rows, 0][:, None] - middles).argmin(axis=1)
        moved[:, rows, 1] += sign * closing[:, nearest]


def _gap(points: Float64, upper: int, lower: int) -> float:
    return float(points[upper - 1, 1] - points[lower - 1, 1])


def _too_open(now: Float64, users: Float64, shut: tuple[float, float]) -> Float64:
    """Return by how much openings (S,) are to be less, for those of the user; negative where they are less
    than shut."""
    closed = np.clip((shut[1] - users) / (shut[1] - shut[0]), 0.0, 1.0)
    more = closed * np.maximum(now - np.maximum(users, 0.0), 0.0)
    return np.asarray(more + np.minimum(now - np.minimum(users, 0.0), 0.0))


class Follower:
    """Amplitude and sides of an actor for a part of a face that is seen frame by frame.

    What the user's way is, is learnt as frames come, and taken into account once a second. Speeds stay the
    user's: to smooth or to sharpen evenly, later frames would have to be known.
    """

    def __init__(self, actor: Motion, reach: Float64, user: Motion | None, rate: float) -> None:
        count, width = len(actor.seconds) - 1, actor.spread.shape[1]
        self._actor, self._reach, self._user, self._rate = actor, reach, user, rate
        self._own, self._shown = Tally(count, width), Tally(count, width)
        self._frames: list[tuple[Float64, Float64, int, int]] = []
        self._gains = np.zeros((count + 1, width)) if user is None else find_gains(actor, user)
        self._now = np.zeros(width)

    def push(self, own: Float64, mapped: Float64, label: int, frame: int) -> Float64:
        """Return displacements (2V,) for those of the user and what curves make of them, as in `restyle`.

        label: the class, -1 for none. frame: its number.
        """
        moved = mix(own, mapped)
        self._frames.append((own, moved, label, frame))
        if len(self._frames) >= self._rate:
            self._learn()
        self._now += (self._gains[label] - self._now) * (1 - np.exp(-1 / (EASE * self._rate)))
        return limit_reach(moved * np.exp(self._now), own, self._reach)

    def _learn(self) -> None:
        own, moved, labels, frames = (np.array(column) for column in zip(*self._frames, strict=True))
        self._frames.clear()
        self._own.add(own, labels, frames, self._rate)
        self._shown.add(moved, labels, frames, self._rate)
        known = self._shown.motion()
        if self._user is not None:
            known = shift_reference(self._user, self._own.motion(), known)
        self._gains = find_gains(self._actor, known)
