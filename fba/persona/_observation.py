"""Observes a face in each frame: registered points, displacements of parts, classes, the neutral one."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.errors import FbaWarning, ModelError, OptionError, Remedy
from fba.persona.points import Registered, TrackedFace, register
from fba.persona.points.layout import PARTS, flat_mask
from fba.persona.recognition import ClassRecogniser, Labels, decide, displacements

NEUTRAL_FRAMES = 30
"""Number of frames at the start whose median is the neutral face: a second."""
MIN_FRAMES = 5
"""Number of frames that a neutral face needs."""
# Points, as in `fba.persona.points.layout`
UPPER_LIDS = (14, 23)
LOWER_LIDS = (11, 13)
INNER_LIPS = (30, 33)
MOUTH_CORNERS = (42, 45)
BROWS = (5, 7)
EYE_CORNERS = (15, 17, 19, 21)


@dataclass(frozen=True)
class Tolerance:
    """Deviations of a neutral face from the film's usual face; a frame's cost is the sum of their squares."""

    opening: float = 0.15  # of the eyes, share of the usual opening
    width: float = 0.10  # of the mouth, share of the usual width
    millimetres: float = 3.0  # of the gap between the lips, and of the brows' height
    turn: float = 0.2  # of the head, radians
    max_cost: float = 4.0  # of the median frame in the first second
    open_percentile: float = 75.0  # of the openings of the eyes: the usual one
    seconds: float = 0.2  # duration of the neutral face if it is not in the first second


TOLERANCE = Tolerance()


def find_rest(points: Float64, angles: Float64, times: Float64) -> Intp:
    """Return the rows of the frames that show the neutral face.

    points: float64 (S, 64, 2), on the standard mask, millimetres. angles: (S, 3), radians: pitch, yaw, roll.
    times: (S,), seconds. Where the face is not neutral in the first second, an FbaWarning names the frames
    that are used.
    """
    first = np.arange(min(NEUTRAL_FRAMES, len(points)))
    costs = _costs(points, angles)
    if np.median(costs[first]) <= TOLERANCE.max_cost:
        return first
    length = max(MIN_FRAMES, int(np.searchsorted(times - times[0], TOLERANCE.seconds)))
    if length >= len(costs):
        return first
    start = int(np.convolve(costs, np.ones(length), mode="valid").argmin())
    if costs[start : start + length].mean() > costs[first].mean():
        return first
    warnings.warn(
        FbaWarning(
            "the face does not rest in the first second: eyes, mouth, brows or head are not as usual; the "
            f"frames from {times[start]:.2f} to {times[start + length - 1]:.2f} s are used as its rest"
        ).with_remedies(Remedy("neutral", "say where it rests with {}", "2.0-2.5")),
        stacklevel=4,
    )
    return np.arange(start, start + length)


def eye_opening(points: Float64) -> Float64:
    """Return the opening of the eyes in frames (..., 64, 2), the mean of both, millimetres: (...)."""
    upper, lower = ([number - 1 for number in pair] for pair in (UPPER_LIDS, LOWER_LIDS))
    opening: Float64 = (points[..., upper, 1] - points[..., lower, 1]).mean(axis=-1)
    return opening


def _costs(points: Float64, angles: Float64) -> Float64:
    """Return the cost of each frame, (S,): see `Tolerance`."""

    def at(*numbers: int) -> Float64:
        return np.asarray(points[:, [number - 1 for number in numbers]].mean(axis=1))

    opening = eye_opening(points)
    usual = max(float(np.percentile(opening, TOLERANCE.open_percentile)), 1e-6)
    gap = (at(INNER_LIPS[0]) - at(INNER_LIPS[1]))[:, 1]
    width = (at(MOUTH_CORNERS[0]) - at(MOUTH_CORNERS[1]))[:, 0]
    height = (at(*BROWS) - at(*EYE_CORNERS))[:, 1]
    usual_width = max(abs(float(np.median(width))), 1e-6)
    costs: Float64 = (
        ((opening / usual - 1) / TOLERANCE.opening) ** 2
        + (gap / TOLERANCE.millimetres) ** 2
        + ((np.abs(width) / usual_width - 1) / TOLERANCE.width) ** 2
        + ((height - np.median(height)) / TOLERANCE.millimetres) ** 2
        + (angles[:, 1] / TOLERANCE.turn) ** 2
        + ((angles[:, 0] - np.median(angles[:, 0])) / TOLERANCE.turn) ** 2
    )
    return costs


Neutral = int | tuple[float, float] | None
MAX_EYE_RATIO = 1.35
"""Largest ratio of the usual opening of the eyes to that of the neutral face."""


@dataclass(frozen=True, eq=False)
class Observation:
    """A face in the frames that are used: S of T.

    rows: int (S,), numbers of these frames. points: float64 (S, 64, 2), on the standard mask. neutral: (64,
    2). moved: part -> float64 (S, 2K), displacements. scores: part -> (S, D), principal components. labels:
    part -> classes. registered: of all frames.
    """

    rows: Intp
    points: Float64
    neutral: Float64
    moved: dict[str, Float64]
    scores: dict[str, Float64]
    labels: dict[str, Labels]
    registered: Registered

    def mask_motion(self, recogniser: ClassRecogniser) -> Float64:
        """Return the displacements of the face's mask: float64 (S, 86, 3), millimetres.

        Depth, which pictures lack, is taken from the nearest examples of the mouth's class.
        """
        moved = flat_mask(self.points) - flat_mask(self.neutral)
        moved[..., 2] = recogniser.find_depth(self.scores["mouth"], self.labels["mouth"].first)
        return np.asarray(moved)


def observe(
    face: TrackedFace, recogniser: ClassRecogniser, neutral: Neutral = None, *, warm_up: int = 0
) -> Observation:
    """Return the observation of a face.

    neutral: frames of the neutral face: one number, or (from, to) in seconds; by default the first second
    that is used, or, where the face does not rest then, the frames that `find_rest` returns. warm_up: number
    of frames left out at the start, until the tracker follows the face.

    Raises ModelError, with the reasons, where no frame can be used; OptionError where the frames of the
    neutral face cannot.
    """
    registered = register(face)
    usable = registered.kept.copy()
    usable[:warm_up] = False
    rows = np.flatnonzero(usable)
    if not len(rows):
        raise ModelError(_why_none(face, registered, warm_up))
    rest = (
        rows[find_rest(registered.points[rows], face.angles[rows], face.times[rows] - face.times[0])]
        if neutral is None
        else _neutral_rows(face, usable, neutral)
    )
    if len(rest) < MIN_FRAMES and neutral is None and len(rows) >= MIN_FRAMES:
        raise ModelError(f"only {len(rest)} frames show the neutral face; at least {MIN_FRAMES} are needed")
    still = np.asarray(np.median(registered.points[rest], axis=0))
    points = registered.points[rows]
    _check_eyes(points, still)
    moved = {part: displacements(points, still, part) for part in PARTS}
    scores = {part: recogniser.components[part].scores(moved[part]) for part in PARTS}
    labels = {part: decide(recogniser.components[part].network(scores[part])) for part in PARTS}
    return Observation(rows, points, still, moved, scores, labels, registered)


def _check_eyes(points: Float64, still: Float64) -> None:
    """Warn where the eyes are usually wider than in the neutral face, which then is not neutral."""
    if np.median(eye_opening(points)) > MAX_EYE_RATIO * float(eye_opening(still)):
        warnings.warn(
            FbaWarning(
                "the eyes are half closed in the frames of the neutral face, and wider in most others"
            ).with_remedies(Remedy("neutral", "say where the face rests with {}", "2.0-2.5")),
            stacklevel=3,
        )


def _neutral_rows(face: TrackedFace, usable: Bool, neutral: int | tuple[float, float]) -> Intp:
    """Return the frames of the neutral face."""
    if isinstance(neutral, int):
        if not 0 <= neutral < len(face) or not usable[neutral]:
            raise OptionError(f"neutral: frame {neutral} shows no face that looks into the camera")
        return np.array([neutral])
    start, end = neutral
    times = face.times - face.times[0]
    rows = np.flatnonzero(usable & (times >= start) & (times <= end))
    if not len(rows):
        raise OptionError(f"neutral: no face looks into the camera from {start:g} to {end:g} s")
    return rows


def _why_none(face: TrackedFace, registered: Registered, warm_up: int) -> str:
    """Return why no frame can be used."""
    count = len(face)
    if not count:
        return "the recording has no frames"
    turned, alien, lost = (int(mask.sum()) for mask in (registered.turned, registered.alien, ~face.tracked))
    reasons = [
        text
        for number, text in (
            (lost, f"{lost} without a face"),
            (turned, f"{turned} with a head turned by more than 30 degrees"),
            (alien, f"{alien} whose points are not arranged as in a face"),
        )
        if number
    ]
    if warm_up:
        reasons.append(f"the first {warm_up} while the tracker warms up")
    return f"none of the {count} frames can be used: {', '.join(reasons)}"
