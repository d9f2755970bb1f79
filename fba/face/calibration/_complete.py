"""Prepares a person's aligned feature points: drops doubtful ones, mirrors missing ones, shuts the mouth."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.errors import warn
from fba.face.feature_points import FREE_POINTS, MATES, MIRRORED, names
from fba.parameters import point_rows

MIN_DISTANCE = 0.012
"""Points further apart on the face than this share of the pupils' distance must not coincide."""
COINCIDENT_SHARE = 0.1
"""Points nearer to each other than this share of their distance on the face coincide."""
MISTAKE_DISTANCE = 0.75
"""A point is a mistake if its error exceeds this share of the pupils' distance and `MISTAKE_RATIO`, and its
mate differs."""
MISTAKE_RATIO = 6.0
"""Multiple of the median error, see `MISTAKE_DISTANCE`."""
MAX_TILT = np.radians(20.0)
"""The plane of symmetry is computed from the points unless it deviates from x = 0 by more than this."""
MAX_PUPIL_OFFSET = 0.2
"""Share of the lid opening by which a pupil may be off the middle of the lids."""
LIPS = (("2.2", "2.3", "8.2"), ("2.6", "2.8", "8.7"), ("2.7", "2.9", "8.8"))
"""Points of the upper and the lower inner lip, and of the outer lip below."""
MAX_LIP_GAP = 0.01
"""Share of the mouth's width by which lips may be apart without a warning."""
TOLERATED_GAP = 0.25
"""Lips stay unchanged if they are off by less than this share of the distance between two such points."""
TEETH = ("9.10", "9.11")

_MEET = (
    *({upper, lower} for upper, lower, _ in LIPS),
    *(set(TEETH), {"6.1", "9.10"}, {"6.1", "9.11"}),
    *({"3.5", "3.1"}, {"3.5", "3.3"}, {"3.6", "3.2"}, {"3.6", "3.4"}),
)
"""Pairs that may coincide, or that `shut_mouth` and `centre_pupils` separate."""


def drop_mistakes(points: Float64, expected: Float64) -> Float64:
    """Return the points (84, 3) with obvious mistakes set to NaN; an FbaWarning names each.

    expected: (84, 3), the model's points at the person's size, metres. Of two points that coincide but are
    apart on the model, the one less symmetric to its mate is dropped, or else the one further from its
    expected position. A single point far from its expected position is dropped.
    """
    result = points.copy()
    away = np.linalg.norm(points - expected, axis=1)
    unit = _between(expected, "3.5", "3.6")
    messages = []
    rows = np.flatnonzero(np.isfinite(away))
    asymmetry = _asymmetry(points)
    for k, a in enumerate(rows):
        for b in rows[k + 1 :]:
            apart = float(np.linalg.norm(expected[a] - expected[b]))
            given = float(np.linalg.norm(points[a] - points[b]))
            meet = {names()[a], names()[b]} in _MEET
            if (
                meet
                or apart < MIN_DISTANCE * unit
                or given > COINCIDENT_SHARE * apart
                or np.isnan(result[[a, b], 0]).any()
            ):
                continue
            error = asymmetry if abs(asymmetry[a] - asymmetry[b]) > 0.01 * unit else away
            worse = a if error[a] > error[b] else b
            result[worse] = np.nan
            messages.append(
                f"{names()[a]} and {names()[b]} coincide, but on the face they are "
                f"{apart * 1000:.0f} mm apart: {names()[worse]} is left out"
            )
    usual = float(np.median(away[rows])) if len(rows) else 0.0
    limit = max(MISTAKE_DISTANCE * unit, MISTAKE_RATIO * usual)
    shift = points - expected
    for row in rows:
        if np.isnan(result[row, 0]) or names()[row] in FREE_POINTS or not away[row] > limit:
            continue
        other = MATES.get(names()[row])
        mate = shift[point_rows()[other]] * (-1.0, 1.0, 1.0) if other else np.full(3, np.nan)
        if not np.linalg.norm(mate - shift[row]) < 0.5 * away[row]:
            result[row] = np.nan
            messages.append(
                f"{names()[row]} is {away[row] * 1000:.0f} mm from its position by the other points: left out"
            )
    if messages:
        warn("; ".join(messages), stacklevel=3)
    return result


def _asymmetry(points: Float64) -> Float64:
    """Return the distance of each point from the mirror image of its mate, metres (84,); 0 without a mate."""
    image = _mirror_image(points)
    apart = np.zeros(len(points))
    for name, other in MATES.items():
        apart[point_rows()[name]] = np.linalg.norm(points[point_rows()[name]] - image[point_rows()[other]])
    return np.nan_to_num(apart)


def mirror_missing(points: Float64) -> tuple[Float64, tuple[str, ...]]:
    """Return points (84, 3) with those missing on one side mirrored from the other, and their names."""
    image = _mirror_image(points)
    full = points.copy()
    added = []
    for name, other in MATES.items():
        row, source = point_rows()[name], point_rows()[other]
        if np.isnan(points[row]).any() and np.isfinite(points[source]).all():
            full[row] = image[source]
            added.append(name)
    return full, tuple(added)


def _mirror_image(points: Float64) -> Float64:
    """Return points (84, 3) reflected in the plane between left and right."""
    normal, offset = _symmetry_plane(points)
    return points - 2 * np.outer(points @ normal - offset, normal)


def _symmetry_plane(points: Float64) -> tuple[Float64, float]:
    """Return normal and offset of the plane between left and right, by the points given; else +x."""
    rows = np.array([(point_rows()[left], point_rows()[right]) for left, right in MIRRORED.items()])
    known = np.isfinite(points[rows]).all(axis=(1, 2))
    left, right = points[rows[known, 0]], points[rows[known, 1]]
    normal = np.array([1.0, 0.0, 0.0])
    if known.any():
        across = (left - right).sum(axis=0)
        length = float(np.linalg.norm(across))
        if length > 0 and across[0] / length > np.cos(MAX_TILT):
            normal = across / length
    middle = [point_rows()[name] for name in names() if name not in MATES]
    halves = np.vstack([(left + right) / 2, points[middle][np.isfinite(points[middle]).all(axis=1)]])
    return normal, float(np.median(halves @ normal)) if len(halves) else 0.0


def centre_pupils(points: Float64) -> tuple[Float64, tuple[str, ...]]:
    """Return (points (84, 3) with pupils at mid-height between the lids, names of those that were moved).

    Lids are tangent to the iris in a neutral face, so the pupil is in the middle. An FbaWarning names a
    pupil further off than drooping lids explain.
    """
    full = points.copy()
    moved = []
    for pupil, upper, lower in (("3.5", "3.1", "3.3"), ("3.6", "3.2", "3.4")):
        y, top, bottom = (points[point_rows()[name], 1] for name in (pupil, upper, lower))
        off = y - (top + bottom) / 2
        if abs(off) > MAX_PUPIL_OFFSET * (top - bottom) > 0:
            full[point_rows()[pupil], 1] -= off
            moved.append((pupil, off))
    texts = [
        f"pupil {p} is {off * 1000:+.1f} mm off the middle between the lids: moved there" for p, off in moved
    ]
    if texts:
        warn("; ".join(texts), stacklevel=3)
    return full, tuple(name for name, _ in moved)


def shut_mouth(points: Float64, reference: Float64) -> Float64:
    """Return the points (84, 3), lips and teeth meeting as the reference's do; the upper ones stay.

    reference: (84, 3), the model's points at the person's size. If the person's mouth is open, the whole
    lower lip is raised, and an FbaWarning says how far.
    """
    full = points.copy()
    width = _between(full, "8.3", "8.4")
    widest = 0.0
    for upper, lower, below in LIPS:
        a, b, c = (point_rows()[name] for name in (upper, lower, below))
        apart = reference[b] - reference[a]
        if np.isnan(apart).any():
            continue
        if np.isnan(full[a]).any():
            full[a] = full[b] - apart  # NaN where neither is known
        rise = full[a] + apart - full[b]
        if np.linalg.norm(rise) < TOLERATED_GAP * np.linalg.norm(apart):
            continue
        if np.isfinite(rise).all():
            full[b] += rise
            if abs(rise[1]) > MAX_LIP_GAP * width:
                full[c] += rise
            widest = max(widest, float(rise[1]), key=abs)
        elif np.isfinite(full[a]).all():
            full[b] = full[a] + apart
    if abs(widest) > MAX_LIP_GAP * width:
        fault = "the mouth is open by" if widest > 0 else "the lower lip is in the upper one by"
        warn(
            f"{fault} {abs(widest) * 1000:.1f} mm, but the lips of a neutral face touch: "
            "the lower lip was moved",
            stacklevel=3,
        )
    a, b = (point_rows()[name] for name in TEETH)
    apart = full[a] + reference[b] - reference[a] - full[b]
    if np.isfinite(apart).all():
        if np.linalg.norm(apart) > 2 * MAX_LIP_GAP * width:
            warn(
                f"upper and lower teeth are {np.linalg.norm(apart) * 1000:.1f} mm from touching as those "
                "of a neutral face do: the lower ones were moved",
                stacklevel=3,
            )
        full[[b, point_rows()["9.9"]]] += apart
    return full


def _between(points: Float64, left: str, right: str) -> float:
    """Return the distance of two points in x, metres; 0.06 where it is unknown or not positive."""
    distance = float(points[point_rows()[left], 0] - points[point_rows()[right], 0])
    return distance if np.isfinite(distance) and distance > 0 else 0.06
