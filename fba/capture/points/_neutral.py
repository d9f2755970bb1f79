"""The neutral face of a film: shut lips, open eyes, a head that looks ahead.

Takes of markers return to the neutral face. A face that mostly smiles or speaks does not.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64, Intp
from fba.capture.markers._targets import LIDS, LOWER_LIDS, PUPILS
from fba.errors import FbaWarning, Remedy

SPREADS = {
    "gap": 0.04, "width": 0.07, "corners": 0.03, "jaw": 0.12, "lids": 0.15, "brows": 0.045, "apart": 0.05,
}  # fmt: skip
"""Usual differences between neutral faces and a known face, in distances of the eyes."""
EYE_CORNERS = (("3.7", "3.11"), ("3.8", "3.12"))
"""Corners of the left and the right eye."""
NOSE = "9.15"
"""The point below the nose."""
BROW = "4.1"
"""The place that stands for the brows."""
STILL = ("3.11", "3.12", "9.12", NOSE)
"""Points that do not move with the parts whose names begin alike."""
PARTS = (
    (("gap", "width", "corners", "jaw"), ("2.", "8.", "9.1", "9.2", "9.3", "5.")),
    (("lids",), LIDS),
    (("brows", "apart"), ("4.",)),
)
"""Measures that show the rest of a part of the face, and the beginnings of the names of its points."""


@dataclass(frozen=True)
class Tuning:
    """Constants of the search for a neutral face; distances in distances of the eyes."""

    neutral_seconds: float = 0.1  # length of the window, in seconds, whose median is the neutral face
    open_percentile: int = 75  # percentile of the openings of eyes that is the usual opening of open eyes
    # usual width of mouths at rest, in distances of the eyes: that of the known face is large
    mouth_width: float = 0.8
    # usual height of brows at rest above those of the known face, in distances of the eyes
    brow_height: float = 0.017
    # difference of brows at rest from that, in spreads: brows that are always beyond are held there
    max_brow_height: float = 2.0
    crowd_cost: float = 4.0  # cost of a height of the brows for each factor e by which fewer frames have it
    # largest difference of heights of brows that count as the same, in distances of the eyes
    same_height: float = 0.02
    min_held_distance: float = 0.06  # distance between brows at rest and held brows, in distances of the eyes
    min_held_share: float = 0.15  # share of frames with held brows that needs a warning
    min_sure_lead: float = 6.0  # lead in cost of a rest that is beyond doubt
    max_ahead_cost: float = 3.0  # cost of turns of heads that look ahead: only their brows count
    max_open_spreads: float = 2.0  # difference of open lids from usual, in spreads
    turn_spread: float = 0.25  # usual angle, in radians, between heads of neutral faces and the camera
    step_spread: float = 0.2  # change between frames, in spreads, that costs as much as a spread


TUNING = Tuning()


@dataclass(frozen=True)
class Rests:
    """Frames of the neutral face. whole: of the head and the face. parts: place of a point -> its frames.

    raised: metres by which brows are above their rest even in their frames.
    """

    whole: slice
    parts: dict[str, Intp]
    raised: float = 0.0


def find_rests(points: Float64, places: Mapping[str, str], template: Float64, times: Float64) -> Rests | None:
    """Return frames of the neutral face; None if needed places are missing. Warns of doubtful brows.

    points: float64 (T, M, 3), to the right, up and towards the camera, NaN where missing. places: of each
    point. template: (M, 3), the points on a neutral face. times: (T,), seconds.
    """
    where = {place: n for n, place in enumerate(places.values())}
    if not {NOSE, *EYE_CORNERS[0], *EYE_CORNERS[1]} <= set(where):
        return None
    turned = _turn_costs(points, template[None], where)
    costs = _shape_costs(points, template[None], where)
    measures = _measures(points, where)
    if "brows" in costs:
        costs["brows"] += _crowd_costs(measures["brows"], turned)
    length = max(1, int(np.searchsorted(times - times[0], TUNING.neutral_seconds)))
    whole = _best(sum(costs.values(), turned), length)
    parts: dict[str, Intp] = {}
    for names, beginnings in PARTS:
        measured = [costs[name] for name in names if name in costs]
        if measured:
            frames = _best(sum(measured, turned), length)
            rest = np.arange(frames.start, frames.stop)
            parts |= {place: rest for place in where if place.startswith(beginnings) and place not in STILL}
    raised = 0.0
    if "brows" in costs:
        usual = float(_measures(template[None], where)["brows"][0]) + TUNING.brow_height
        cost = np.asarray(costs["brows"] + costs["apart"] + turned)
        left, right = _eyes(points, where)
        distance = float(np.nanmedian(np.linalg.norm(left - right, axis=1)))
        raised = _judge_brows(measures["brows"] - usual, cost, parts[BROW], times, turned, distance)
    if "lids" in costs:
        open_eyes = np.flatnonzero(costs["lids"] < TUNING.max_open_spreads**2)
        parts |= {place: open_eyes for place in PUPILS if place in where and len(open_eyes)}
    return Rests(whole, parts, raised)


def _crowd_costs(heights: Float64, turned: Float64) -> Float64:
    """Return the cost (T,) of frames whose height of brows few frames have. turned: cost of turns (T,)."""
    ahead = np.isfinite(heights) & (turned < TUNING.max_ahead_cost)
    ordered = np.sort(heights[ahead] if ahead.any() else heights[np.isfinite(heights)])
    first, last = (np.searchsorted(ordered, heights + side * TUNING.same_height) for side in (-1, 1))
    return np.asarray(TUNING.crowd_cost * np.log(len(ordered) / np.maximum(last - first, 1)))


def _judge_brows(
    heights: Float64, cost: Float64, rest: Intp, times: Float64, turned: Float64, eyes: float
) -> float:
    """Return metres by which brows are held up even in the frames of their rest. Warns of held brows.

    heights: (T,), above those of usual faces. cost: (T,), of frames as rests. eyes: their distance, metres.
    """
    there = float(np.nanmedian(heights[rest]))
    most = TUNING.max_brow_height * SPREADS["brows"]
    excess = float(there - np.clip(there, -most, most))
    ahead = turned < TUNING.max_ahead_cost
    others = ahead & (np.abs(heights - there) > TUNING.min_held_distance)
    at = f"{float(times[rest].mean() - times[0]):.1f} s"
    said = []
    if excess:
        said.append(
            f"brows are {1000 * abs(there) * eyes:.1f} mm {_comparative(excess)} than they usually rest, "
            f"even then: {1000 * abs(excess) * eyes:.1f} mm of that are shown, the other as this face's own"
        )
    if others.sum() > TUNING.min_held_share * ahead.sum():
        apart = float(np.median(heights[others])) - there
        share = f"{100 * others.sum() / ahead.sum():.0f} % of the film"
        text = f"for {share} they are held {1000 * abs(apart) * eyes:.0f} mm {_comparative(apart)}"
        if float(np.nanmin(cost[others])) - float(np.nanmin(cost[rest])) < TUNING.min_sure_lead:
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


def _comparative(height: float) -> str:
    return "higher" if height > 0 else "lower"


def _eyes(points: Float64, where: Mapping[str, int]) -> tuple[Float64, Float64]:
    """Return the middles (T, 3) of the left and the right eye."""
    left, right = (np.mean([points[:, where[name]] for name in names], axis=0) for names in EYE_CORNERS)
    return left, right


def _best(costs: Float64, length: int) -> slice:
    """Return the window of `length` frames with the least sum of costs (T,)."""
    if len(costs) <= length:
        return slice(0, len(costs))
    known = np.minimum(np.where(np.isnan(costs), np.inf, costs), 1e6)
    first = int(np.convolve(known, np.ones(length), mode="valid").argmin())
    return slice(first, first + length)


def _shape_costs(points: Float64, template: Float64, where: Mapping[str, int]) -> dict[str, Float64]:
    """Return by measure the cost (T,) of its difference from a neutral face, and of its change."""
    result = {}
    usual = _measures(template, where) | {"width": np.array([TUNING.mouth_width])}
    if "brows" in usual:
        usual["brows"] = usual["brows"] + TUNING.brow_height
    for name, values in _measures(points, where).items():
        off = (values - usual[name]) / SPREADS[name]
        moving = np.abs(np.gradient(values)) / SPREADS[name] if len(values) > 1 else np.zeros(len(values))
        result[name] = off**2 + (moving / TUNING.step_spread) ** 2
    return result


def _measures(points: Float64, where: Mapping[str, int]) -> dict[str, Float64]:
    """Return measures (T,) of the face, without those whose points are missing."""

    def at(*names: str) -> Float64:
        return np.asarray(np.mean([points[:, where[name]] for name in names], axis=0))

    def has(*names: str) -> bool:
        return all(name in where for name in names)

    def apart(one: Float64, other: Float64) -> Float64:
        return np.asarray(np.linalg.norm(one - other, axis=1))

    left, right = _eyes(points, where)
    eyes = apart(left, right)
    up = (left + right) / 2 - at(NOSE)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    found = {}
    if has("2.2", "2.3"):
        found["gap"] = apart(at("2.2"), at("2.3")) / eyes
    if has("8.3", "8.4"):
        width = apart(at("8.3"), at("8.4"))
        found["width"] = width / eyes
        if has("8.1", "8.2"):
            found["corners"] = ((at("8.3", "8.4") - at("8.1", "8.2")) * up).sum(axis=1) / width
    if has("2.1"):
        found["jaw"] = apart(at(NOSE), at("2.1")) / eyes
    for upper, lower in LOWER_LIDS.items():
        if has(upper, lower):
            opening = apart(at(upper), at(lower)) / eyes
            found["lids"] = opening / np.nanpercentile(opening, TUNING.open_percentile)
    if has("4.1", "4.2"):
        brows = at(*(place for place in ("4.1", "4.2", "4.3", "4.4") if place in where))
        found["brows"] = ((brows - (left + right) / 2) * up).sum(axis=1) / eyes
        found["apart"] = apart(at("4.1"), at("4.2")) / eyes
    return found


def _turn_costs(points: Float64, template: Float64, where: Mapping[str, int]) -> Float64:
    """Return the cost (T,) of the head's turn from the camera."""
    off = _angles(points, where) - _angles(template, where)
    return np.asarray(((off / TUNING.turn_spread) ** 2).sum(axis=1))


def _angles(points: Float64, where: Mapping[str, int]) -> Float64:
    """Return roll, yaw and pitch of each head, radians: float64 (T, 3)."""
    left, right = _eyes(points, where)
    across = left - right
    up = (left + right) / 2 - points[:, where[NOSE]]
    front = np.cross(across, up)
    angles = [
        np.arctan2(across[:, 1], across[:, 0]),
        np.arctan2(front[:, 0], front[:, 2]),
        np.arctan2(front[:, 1], front[:, 2]),
    ]
    return np.stack(angles, axis=1)
