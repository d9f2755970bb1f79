"""A user's motion with an actor's amplitude, speed and sides, for `perform` and `LivePersona`.

Expressions keep their moments: nothing is moved in time. A lip or lid that the user shuts stays shut.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64, Intp
from fba.persona.motion import Motion, Tally, find_gains, find_pace, measure_motion, shift_reference
from fba.persona.points.layout import standard_points

RETIMED = ("mouth", "left_brow", "right_brow")
"""Parts whose speed changes. The lids' does not: a blink that is drawn out would not shut."""
LIDS = ((14, 11), (18, 16), (20, 12), (23, 13), (25, 24), (26, 22))
"""Points of upper and lower lids that meet."""
LIPS = ((29, 32), (30, 33), (31, 34))
"""Points of the inner edges of the lips that meet."""
UPPER_LIP = (29, 30, 31, 43, 44, 46, 47, 48, 49, 50, 51)
LOWER_LIP = (32, 33, 34, *range(35, 42), 52, 53)


@dataclass(frozen=True)
class Opening:
    """Openings at which lids or lips count as shut, and above which as open; in between, in part."""

    shut: float
    open: float


@dataclass(frozen=True)
class Tuning:
    """Constants of restyling. Smoothing is by Gaussians, whose deviation is given in seconds."""

    gain_smoothing: float = 0.15  # s, over which gains pass from one class to the next
    max_pace: float = float(np.log(2.0))  # natural logarithm of the largest change of a speed
    max_smoothing: float = 0.4  # s, where motion becomes slower
    max_sharpening: float = 3.0  # factor of the difference that sharpening adds, where it becomes faster
    halvings: int = 7  # steps of the search for either
    sharpening: float = 0.17  # s, smoothing whose difference from the motion is added
    limit_smoothing: float = 0.1  # s, smoothing of the curve that sharpened motion must not pass
    limit_reach: float = 0.17  # s, before and after a frame, from which that limit is taken
    reach: float = 1.15  # limit of a displacement, relative to the actor's largest
    bend: float = 0.8  # share of that limit from which displacements are compressed
    lids: Opening = Opening(0.15, 0.4)  # shares of the opening at rest
    lips: Opening = Opening(0.4, 1.6)  # mm
    upper_lid: float = 0.8  # share of the upper lid in a closing of the eye


TUNING = Tuning()


def restyle(
    part: str,
    own: Float64,
    mapped: Float64,
    classes: Intp,
    frames: Intp,
    rate: float,
    actor: Motion,
    reach: Float64,
    user: Motion | None,
) -> Float64:
    """Return displacements (S, 2V) of a part, on the standard face, that move as the actor does.

    own: the user's displacements. mapped: the same, mapped by the actor's curves. classes: (S,), -1 for none.
    frames: (S,), their numbers. rate: frames per second. reach: (2V,), of the actor, see `PartStyle.reach`.
    user: how the user usually moves; by default, as in this take.
    """
    count = len(actor.seconds) - 1
    moved = mix(own, mapped)
    shown = measure_motion(moved, classes, frames, rate, count)
    usual = shown
    if user is not None:
        usual = shift_reference(user, measure_motion(own, classes, frames, rate, count), shown)
    gains = fill_gaps(find_gains(actor, usual)[classes], frames)
    moved = moved * np.exp(smooth(gains, TUNING.gain_smoothing * rate)[frames - frames[0]])
    if part in RETIMED:
        before = measure_motion(moved, classes, frames, rate, count)
        goal = shown.speed[-1] + np.clip(find_pace(actor, usual), -TUNING.max_pace, TUNING.max_pace)
        every = fill_gaps(moved, frames)
        moved = retime(every, rate, float(goal - before.speed[-1]))[frames - frames[0]]
        after = measure_motion(moved, classes, frames, rate, count)
        moved = moved * np.exp((before.spread[-1] - after.spread[-1]).mean())
    return limit_reach(moved, own, reach)


def mix(own: Float64, mapped: Float64) -> Float64:
    """Return the mean of a user's displacements and of the same, mapped by the actor's curves.

    The curves have what the actor adds (a brow that goes with the smile), the user's displacements have life
    and detail; each alone comes less near to the actor.
    """
    return (own + mapped) / 2


def fill_gaps(values: Float64, frames: Intp) -> Float64:
    """Return values (S, N) of frames (S,) interpolated for every frame from the first to the last."""
    every = np.arange(frames[0], frames[-1] + 1)
    if len(every) == len(frames):
        return values
    return np.stack([np.interp(every, frames, column) for column in values.T], axis=1)


def smooth(values: Float64, deviation: float) -> Float64:
    """Return values (S, N) smoothed in time by a Gaussian; deviation: in frames. The ends are extended."""
    half = int(np.ceil(3 * deviation))
    if half < 1 or not len(values):
        return values
    weights = np.exp(-0.5 * (np.arange(-half, half + 1) / max(deviation, 1e-6)) ** 2)
    weights /= weights.sum()
    return np.asarray(_windows(values, half) @ weights)


def sharpen(values: Float64, rate: float, strength: float) -> Float64:
    """Return values (S, N) whose changes are steeper, at the same moments.

    They stay within the values near them, so that nothing overshoots.
    """
    base = smooth(values, TUNING.limit_smoothing * rate)
    near = _windows(base, max(1, round(TUNING.limit_reach * rate)))
    steep = values + strength * (base - smooth(values, TUNING.sharpening * rate))
    return np.clip(steep, np.minimum(near.min(axis=2), values), np.maximum(near.max(axis=2), values))


def _windows(values: Float64, half: int) -> Float64:
    """Return the values (S, N, 2 half + 1) around each of (S, N), the ends extended."""
    extended = np.pad(values, ((half, half), (0, 0)), mode="edge")
    return np.lib.stride_tricks.sliding_window_view(extended, 2 * half + 1, axis=0)


def retime(moved: Float64, rate: float, pace: float) -> Float64:
    """Return displacements (S, N) that are exp(pace) times as fast for their amplitude.

    Slower motion is smoothed, symmetrically, so that each expression keeps the moment of its peak; faster
    motion is sharpened. The strength is determined by bisection.
    """
    if abs(pace) < 1e-3:
        return moved
    start = _pace(moved, rate)
    low, high = 0.0, TUNING.max_smoothing if pace < 0 else TUNING.max_sharpening
    for _ in range(TUNING.halvings):
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
    """Return displacements (S, 2V) that stay a little above the actor's reach (2V,), compressed near it.

    own: the user's displacements, which are never cut.
    """
    return moved * compression(np.abs(moved), np.maximum(TUNING.reach * reach, np.abs(own)))


def compression(size: Float64, limit: Float64) -> Float64:
    """Return the factors that keep sizes below the limit: 1 up to `Tuning.bend` of it."""
    start, room = TUNING.bend * limit, (1 - TUNING.bend) * limit + 1e-9
    over = np.maximum(size - start, 0.0)
    return np.where(over > 0, (start + room * np.tanh(over / room)) / np.maximum(size, 1e-9), 1.0)


def keep_shut(moved: Float64, own: Float64, face: Float64, user_face: Float64) -> None:
    """Shut lids and lips of masks (S, 86, 3), in place, in the frames in which the user's are shut.

    own: (S, 86, 3), the user's displacements. face, user_face: (64, 2), both at rest. Millimetres. Lids and
    lips that would cross are separated.
    """
    for upper, lower in LIDS:
        rest, user_rest = _gap(face, upper, lower), _gap(user_face, upper, lower)
        if min(rest, user_rest) <= 0:
            continue
        share = 1 + (own[:, upper - 1, 1] - own[:, lower - 1, 1]) / user_rest
        now = 1 + (moved[:, upper - 1, 1] - moved[:, lower - 1, 1]) / rest
        more = rest * _too_open(now, share, TUNING.lids)
        moved[:, upper - 1, 1] -= TUNING.upper_lid * more
        moved[:, lower - 1, 1] += (1 - TUNING.upper_lid) * more
    closing = np.zeros((len(moved), len(LIPS)))
    for n, (upper, lower) in enumerate(LIPS):
        rest, user_rest = (max(_gap(points, upper, lower), 0.0) for points in (face, user_face))
        apart = user_rest + own[:, upper - 1, 1] - own[:, lower - 1, 1]
        now = rest + moved[:, upper - 1, 1] - moved[:, lower - 1, 1]
        closing[:, n] = _too_open(now, apart, TUNING.lips)
    middles = standard_points()[[upper - 1 for upper, _ in LIPS], 0]
    for points, sign in ((UPPER_LIP, -0.5), (LOWER_LIP, 0.5)):
        rows = [point - 1 for point in points]
        nearest = np.abs(standard_points()[rows, 0][:, None] - middles).argmin(axis=1)
        moved[:, rows, 1] += sign * closing[:, nearest]


def _gap(points: Float64, upper: int, lower: int) -> float:
    return float(points[upper - 1, 1] - points[lower - 1, 1])


def _too_open(now: Float64, user: Float64, bounds: Opening) -> Float64:
    """Return how much openings (S,) must shrink, given the user's; negative where they cross."""
    closed = np.clip((bounds.open - user) / (bounds.open - bounds.shut), 0.0, 1.0)
    more = closed * np.maximum(now - np.maximum(user, 0.0), 0.0)
    return np.asarray(more + np.minimum(now - np.minimum(user, 0.0), 0.0))


class Follower:
    """Amplitude and sides of an actor for a part of a face, frame by frame.

    The user's habits are measured as frames come, and applied once a second. Speeds stay the user's:
    symmetric smoothing and sharpening need later frames.
    """

    def __init__(self, actor: Motion, reach: Float64, user: Motion | None, rate: float) -> None:
        count, width = len(actor.seconds) - 1, actor.spread.shape[1]
        self._actor, self._reach, self._user, self._rate = actor, reach, user, rate
        self._own, self._shown = Tally(count, width), Tally(count, width)
        self._frames: list[tuple[Float64, Float64, int, int]] = []
        self._gains = np.zeros((count + 1, width)) if user is None else find_gains(actor, user)
        self._now = np.zeros(width)

    def push(self, own: Float64, mapped: Float64, label: int, frame: int) -> Float64:
        """Return displacements (2V,) as `restyle` does. label: the class, -1 for none. frame: its number."""
        moved = mix(own, mapped)
        self._frames.append((own, moved, label, frame))
        if len(self._frames) >= self._rate:
            self._learn()
        share = 1 - np.exp(-1 / (TUNING.gain_smoothing * self._rate))
        self._now += (self._gains[label] - self._now) * share
        return limit_reach(moved * np.exp(self._now), own, self._reach)

    def _learn(self) -> None:
        own, moved, labels, frames = (np.array(column) for column in zip(*self._frames, strict=True))
        self._frames.clear()
        self._own.add(own, labels, frames, self._rate)
        self._shown.add(moved, labels, frames, self._rate)
        usual = self._shown.motion()
        if self._user is not None:
            usual = shift_reference(self._user, self._own.motion(), usual)
        self._gains = find_gains(self._actor, usual)
