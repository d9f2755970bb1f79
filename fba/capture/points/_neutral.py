"""The neutral face of a film, which nobody names: lips that are shut, open eyes, a head that looks ahead.

A face that mostly smiles or speaks has no rest that it comes back to, as markers' takes have.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64, Intp
from fba.capture.markers._targets import PUPILS
from fba.errors import FbaWarning, Remedy

WINDOW = 0.1
"""Seconds whose median is the neutral face."""
LID_SHARE = 75
"""Percentile of the openings of eyes that is usual for eyes that are open."""
SPREADS = {
    "gap": 0.04, "width": 0.07, "corners": 0.03, "jaw": 0.12, "lids": 0.15, "brows": 0.045, "apart": 0.05,
}  # fmt: skip
"""How far measures of neutral faces are from those of a known one, in distances of the eyes."""
WIDTH = 0.8
"""Width of mouths at rest, in distances of the eyes: that of the known face is at the broad end."""
BROWS = 0.017
"""How much higher brows rest than those of the known face, in distances of the eyes."""
CROWD_COST = 4.0
"""Cost of a height of the brows for each factor e by which fewer frames have it."""
SAME_HEIGHT = 0.02
"""Difference of heights of the brows, in distances of the eyes, that count as the same."""
HIGHEST = 2.0
"""Spreads by which brows rest higher or lower than usual at most: those that always do are held so."""
HELD_DISTANCE = 0.06
"""Distance between brows at rest and held ones, in distances of the eyes."""
HELD_SHARE = 0.15
"""Share of frames in which held brows matter."""
SURE_LEAD = 6.0
"""Lead in cost that a rest has where it is beyond doubt."""
NEEDED = ("3.7", "3.8", "3.11", "3.12", "9.15")
"""Places without which nothing is measured."""
AHEAD = 3.0
"""Cost of turns up to which heads look ahead enough to see how high their brows are."""
BROW = "4.1"
"""The place that stands for the brows."""
TURNED = 0.25
"""Radians by which heads of neutral faces may be turned from the camera."""
MOVING = 0.2
"""Change of a measure from frame to frame, in spreads, that is as bad as one spread: rests do not move."""
OTHERS = ("3.11", "3.12", "9.12", "9.15")
"""Points that begin alike, but do not move."""
LIDS = ("3.1", "3.2", "3.3", "3.4")
PARTS = (
    (("gap", "width", "corners", "jaw"), ("2.", "8.", "9.1", "9.2", "9.3", "5.")),
    (("lids",), LIDS),
    (("brows", "apart"), ("4.",)),
)
"""Measures that tell the rest of a part of the face, and how the names of its points begin."""
OPEN = 2.0
"""Spreads of the lids up to which eyes are open enough to see where they usually look."""


@dataclass(frozen=True)
class Rests:
    """Frames of the neutral face. whole: of the head and the face; parts: of points, by their place.

    raised: metres by which brows are held above their rest in the frames of theirs.
    """

    whole: slice
    parts: dict[str, Intp]
    raised: float = 0.0


def find_rests(points: Float64, places: Mapping[str, str], template: Float64, times: Float64) -> Rests | None:
    """Return frames of the neutral face; None if the places do not tell. Warns where brows leave a doubt.

    points: float64 (T, M, 3), to the right, up and towards the camera, NaN where missing. places: of each
    point. template: (M, 3), where they are on a neutral face. times: (T,), seconds.
    """
    where = {place: n for n, place in enumerate(places.values())}
    if not set(NEEDED) <= set(where):
        return None
    turned = _turn_costs(points, template[None], where)
    costs = _shape_costs(points, template[None], where)
    measures = _measures(points, where)
    if "brows" in costs:
        costs["brows"] += _crowd_costs(measures["brows"], turned)
    length = max(1, int(np.searchsorted(times - times[0], WINDOW)))
    whole = _best(sum(costs.values(), turned), length)
    parts: dict[str, Intp] = {}
    for names, beginnings in PARTS:
        told = [costs[name] for name in names if name in costs]
        if told:
            frames = _best(sum(told, turned), length)
            rest = np.arange(frames.start, frames.stop)
            parts |= {place: rest for place in where if place.startswith(beginnings) and place not in OTHERS}
    raised = 0.0
    if "brows" in costs:
        usual = float(_measures(template[None], where)["brows"][0]) + BROWS
        cost = sum(costs[name] for name in ("brows", "apart") if name in costs) + turned
        raised = _judge_brows(
            measures["brows"] - usual,
            np.asarray(cost),
            parts[BROW],
            times,
            turned,
            _eye_distance(points, where),
        )
    if "lids" in costs:
        open_eyes = np.flatnonzero(costs["lids"] < OPEN**2)
        parts |= {place: open_eyes for place in PUPILS if place in where and len(open_eyes)}
    return Rests(whole, parts, raised)


def _crowd_costs(heights: Float64, turned: Float64) -> Float64:
    """Return what frames (T,) cost for being few of their height of brows. turned: cost of turns (T,)."""
    ahead = np.isfinite(heights) & (turned < AHEAD)
    ordered = np.sort(heights[ahead] if ahead.any() else heights[np.isfinite(heights)])
    first, last = (np.searchsorted(ordered, heights + side * SAME_HEIGHT) for side in (-1, 1))
    return np.asarray(CROWD_COST * np.log(len(ordered) / np.maximum(last - first, 1)))


def _judge_brows(
    heights: Float64, cost: Float64, rest: Intp, times: Float64, turned: Float64, eyes: float
) -> float:
    """Return metres by which brows are held up even in the frames of their rest. Warns where they are held.

    heights: (T,), above those of usual faces. cost: (T,), of frames as rests. eyes: their distance, metres.
    """
    there = float(np.nanmedian(heights[rest]))
    excess = float(there - np.clip(there, -HIGHEST * SPREADS["brows"], HIGHEST * SPREADS["brows"]))
    ahead = turned < AHEAD
    others = ahead & (np.abs(heights - there) > HELD_DISTANCE)
    at = f"{float(times[rest].mean() - times[0]):.1f} s"
    said = []
    if excess:
        said.append(
            f"brows are {1000 * abs(there) * eyes:.1f} mm {_way(excess)} than they usually rest, even then: "
            f"{1000 * abs(excess) * eyes:.1f} mm of that are shown, the other as this face's own"
        )
    if others.sum() > HELD_SHARE * ahead.sum():
        apart = float(np.median(heights[others])) - there
        share = f"{100 * others.sum() / ahead.sum():.0f} % of the film"
        text = f"for {share} they are held {1000 * abs(apart) * eyes:.0f} mm {_way(apart)}"
        if float(np.nanmin(cost[others])) - float(np.nanmin(cost[rest])) < SURE_LEAD:
            text += ", or it is the other way round, which is hard to tell"
        said.append(text)
    if said:
        warnings.warn(
            FbaWarning(f"brows rest as at {at}; " + "; ".join(said)).with_remedies(
                Remedy("neutral", "if that is wrong, say which frame is neutral with {}", "12")
            ),
            stacklevel=6,
        )
    return excess * eyes


def _way(height: float) -> str:
    return "higher" if height > 0 else "lower"


def _eye_distance(points: Float64, where: Mapping[str, int]) -> float:
    """Return the usual distance of the eyes, metres."""
    left, right = (
        np.mean([points[:, where[name]] for name in names], axis=0)
        for names in (("3.7", "3.11"), ("3.8", "3.12"))
    )
    return float(np.nanmedian(np.linalg.norm(left - right, axis=1)))


def _best(costs: Float64, length: int) -> slice:
    """Return the window of this many frames with the least sum of costs (T,)."""
    if len(costs) <= length:
        return slice(0, len(costs))
    known = np.minimum(np.where(np.isnan(costs), np.inf, costs), 1e6)
    first = int(np.convolve(known, np.ones(length), mode="valid").argmin())
    return slice(first, first + length)


def _shape_costs(points: Float64, template: Float64, where: Mapping[str, int]) -> dict[str, Float64]:
    """Return how far each measure of the face is from that of a neutral one: float64 (T,)."""
    result = {}
    usual = _measures(template, where) | {"width": np.array([WIDTH])}
    if "brows" in usual:
        usual["brows"] = usual["brows"] + BROWS
    for name, values in _measures(points, where).items():
        off = (values - usual[name]) / SPREADS[name]
        moving = np.abs(np.gradient(values)) / SPREADS[name] if len(values) > 1 else np.zeros(len(values))
        result[name] = off**2 + (moving / MOVING) ** 2
    return result


def _measures(points: Float64, where: Mapping[str, int]) -> dict[str, Float64]:
    """Return measures of the face in each frame, those whose points are there."""

    def at(*names: str) -> Float64:
        return np.asarray(np.mean([points[:, where[name]] for name in names], axis=0))

    def has(*names: str) -> bool:
        return all(name in where for name in names)

    def apart(one: Float64, other: Float64) -> Float64:
        return np.asarray(np.linalg.norm(one - other, axis=1))

    left, right = at("3.7", "3.11"), at("3.8", "3.12")
    eyes = apart(left, right)
    found = {}
    if has("2.2", "2.3"):
        found["gap"] = apart(at("2.2"), at("2.3")) / eyes
    if has("8.3", "8.4"):
        width = apart(at("8.3"), at("8.4"))
        found["width"] = width / eyes
        if has("8.1", "8.2", "9.15"):
            up = (left + right) / 2 - at("9.15")
            up /= np.linalg.norm(up, axis=1, keepdims=True)
            found["corners"] = ((at("8.3", "8.4") - at("8.1", "8.2")) * up).sum(axis=1) / width
    if has("9.15", "2.1"):
        found["jaw"] = apart(at("9.15"), at("2.1")) / eyes
    for upper, lower in (("3.1", "3.3"), ("3.2", "3.4")):
        if has(upper, lower):
            opening = apart(at(upper), at(lower)) / eyes
            found["lids"] = opening / np.nanpercentile(opening, LID_SHARE)
    if has("4.1", "4.2", "9.15"):
        up = (left + right) / 2 - at("9.15")
        up /= np.linalg.norm(up, axis=1, keepdims=True)
        brows = at(*(place for place in ("4.1", "4.2", "4.3", "4.4") if place in where))
        found["brows"] = ((brows - (left + right) / 2) * up).sum(axis=1) / eyes
        found["apart"] = apart(at("4.1"), at("4.2")) / eyes
    return found


def _turn_costs(points: Float64, template: Float64, where: Mapping[str, int]) -> Float64:
    """Return how far the head of each frame is turned from the camera: float64 (T,)."""
    off = _angles(points, where) - _angles(template, where)
    return np.asarray(((off / TURNED) ** 2).sum(axis=1))


def _angles(points: Float64, where: Mapping[str, int]) -> Float64:
    """Return roll, yaw and pitch of each head, radians: float64 (T, 3)."""
    left = np.mean([points[:, where[name]] for name in ("3.7", "3.11")], axis=0)
    right = np.mean([points[:, where[name]] for name in ("3.8", "3.12")], axis=0)
    across = left - right
    up = (left + right) / 2 - points[:, where["9.15"]]
    front = np.cross(across, up)
    angles = [
        np.arctan2(across[:, 1], across[:, 0]),
        np.arctan2(front[:, 0], front[:, 2]),
        np.arctan2(front[:, 1], front[:, 2]),
    ]
    return np.stack(angles, axis=1)
