"""From a person's aligned feature points to what the face is fitted to: doubtful ones left out, missing
ones mirrored from the other side, the mouth shut."""

from __future__ import annotations

import warnings

import numpy as np

from fba.arrays import Float64
from fba.errors import FbaWarning
from fba.face.feature_points import MIRRORED, names, row_of

APART = 0.012
"""Points that the face has further apart than this share of the pupils' distance are not one point."""
TOGETHER = 0.1
"""Points given nearer to each other than this share of their distance on the face stand on one spot."""
FAR_OFF = 0.75
"""A single point this share of the pupils' distance from where all others say, is a mistake ..."""
FAR_OFF_USUAL = 6.0
"""... if it is also so many times as far off as points usually are, and its mate on the other side is not."""
TURNED = np.radians(20.0)
"""The plane of symmetry is found from the points unless it were turned by more."""
PUPIL = 0.2
"""Of the iris: how far from the middle between the lids a pupil may be."""
LIPS = (("2.2", "2.3", "8.2"), ("2.6", "2.8", "8.7"), ("2.7", "2.9", "8.8"))
"""Upper and lower inner lip, and the outer lip below."""
OPEN = 0.01
"""Share of the mouth's width by which lips may be apart before it is worth a word."""
KEPT = 0.25
"""Share of the distance between two such points by which the person's may differ and stay as given."""
TEETH = ("9.10", "9.11")
FREE = ("7.1", "11.5")
"""Points that stand on no surface: they say nothing about its shape, and vary from author to author."""

_MEET = (
    *({upper, lower} for upper, lower, _ in LIPS),
    *(set(TEETH), {"6.1", "9.10"}, {"6.1", "9.11"}),
    *({"3.5", "3.1"}, {"3.5", "3.3"}, {"3.6", "3.2"}, {"3.6", "3.4"}),
)
"""Points that may well be one, or that `shut` and `between_lids` part."""
_OTHER = {**MIRRORED, **{right: left for left, right in MIRRORED.items()}}


def without_mistakes(points: Float64, expected: Float64, *, stacklevel: int = 2) -> Float64:
    """Points (84, 3) without those that cannot be meant; an FbaWarning names each.

    expected: where they would be on a person of that size. Two points on one spot that the face has
    apart: the one that is less like its mate on the other side goes, or that is further from its place.
    A single point far from its place: it goes.
    """
    kept = points.copy()
    away = np.linalg.norm(points - expected, axis=1)
    unit = _between(expected, "3.5", "3.6")
    told = []
    rows = np.flatnonzero(np.isfinite(away))
    unlike = _unlike_mates(points)
    for place, a in enumerate(rows):
        for b in rows[place + 1 :]:
            apart = float(np.linalg.norm(expected[a] - expected[b]))
            found = float(np.linalg.norm(points[a] - points[b]))
            meet = {names()[a], names()[b]} in _MEET
            if meet or apart < APART * unit or found > TOGETHER * apart or np.isnan(kept[[a, b], 0]).any():
                continue
            worst = unlike if abs(unlike[a] - unlike[b]) > 0.01 * unit else away
            worse = a if worst[a] > worst[b] else b
            kept[worse] = np.nan
            told.append(
                f"{names()[a]} and {names()[b]} stand on one spot, but the face has them "
                f"{apart * 1000:.0f} mm apart: {names()[worse]} is left out"
            )
    usual = float(np.median(away[rows])) if len(rows) else 0.0
    limit = max(FAR_OFF * unit, FAR_OFF_USUAL * usual)
    shift = points - expected
    for row in rows:
        if np.isnan(kept[row, 0]) or names()[row] in FREE or not away[row] > limit:
            continue
        other = _OTHER.get(names()[row])
        mate = shift[row_of()[other]] * (-1.0, 1.0, 1.0) if other else np.full(3, np.nan)
        if not np.linalg.norm(mate - shift[row]) < 0.5 * away[row]:
            kept[row] = np.nan
            told.append(f"{names()[row]} is {away[row] * 1000:.0f} mm from where the others put it: left out")
    if told:
        _warn("; ".join(told), stacklevel)
    return kept


def _unlike_mates(points: Float64) -> Float64:
    """(84,) metres between each point and the mirror image of its mate; 0 where there is none."""
    normal, offset = symmetry_plane(points)
    image = points - 2 * np.outer(points @ normal - offset, normal)
    apart = np.zeros(len(points))
    for name, other in _OTHER.items():
        apart[row_of()[name]] = np.linalg.norm(points[row_of()[name]] - image[row_of()[other]])
    return np.nan_to_num(apart)


def mirrored(points: Float64) -> tuple[Float64, tuple[str, ...]]:
    """Points with those missing on one side taken from the other, and the names of these."""
    normal, offset = symmetry_plane(points)
    full = points.copy()
    added = []
    for name, other in _OTHER.items():
        row, source = row_of()[name], row_of()[other]
        if np.isnan(points[row]).any() and np.isfinite(points[source]).all():
            full[row] = points[source] - 2 * (points[source] @ normal - offset) * normal
            added.append(name)
    return full, tuple(added)


def symmetry_plane(points: Float64) -> tuple[Float64, float]:
    """(unit normal, offset) of the plane between left and right, normal . x = offset.

    From the pairs and the midline points that are known; its normal is +x where they do not say.
    """
    rows = np.array([(row_of()[left], row_of()[right]) for left, right in MIRRORED.items()])
    known = np.isfinite(points[rows]).all(axis=(1, 2))
    left, right = points[rows[known, 0]], points[rows[known, 1]]
    normal = np.array([1.0, 0.0, 0.0])
    if known.any():
        across = (left - right).sum(axis=0)
        length = float(np.linalg.norm(across))
        if length > 0 and across[0] / length > np.cos(TURNED):
            normal = across / length
    middle = [row_of()[name] for name in names() if name not in _OTHER]
    halves = np.vstack([(left + right) / 2, points[middle][np.isfinite(points[middle]).all(axis=1)]])
    return normal, float(np.median(halves @ normal)) if len(halves) else 0.0


def between_lids(points: Float64, *, stacklevel: int = 2) -> tuple[Float64, tuple[str, ...]]:
    """Points with pupils half way up between the lids, and the names of those that were not.

    Lids are tangent to the iris in a neutral face, so the pupil is in the middle; an FbaWarning tells of
    one that is further off than a sleepy look explains.
    """
    full = points.copy()
    moved = []
    for pupil, upper, lower in (("3.5", "3.1", "3.3"), ("3.6", "3.2", "3.4")):
        y, top, bottom = (points[row_of()[name], 1] for name in (pupil, upper, lower))
        off = y - (top + bottom) / 2
        if abs(off) > PUPIL * (top - bottom) > 0:
            full[row_of()[pupil], 1] -= off
            moved.append((pupil, off))
    if moved:
        _warn(
            "; ".join(
                f"pupil {name} is {off * 1000:+.1f} mm off the middle between the lids: put there"
                for name, off in moved
            ),
            stacklevel,
        )
    return full, tuple(name for name, _ in moved)


def shut(points: Float64, reference: Float64, *, stacklevel: int = 2) -> Float64:
    """Points with lips and teeth that meet as those of the reference do; the upper ones stay.

    reference: (84, 3), the face's own points at the size of the person. Where the person's mouth is
    open, the lower lip comes up as a whole, and an FbaWarning tells how far.
    """
    full = points.copy()
    width = _between(full, "8.3", "8.4")
    widest = 0.0
    for upper, lower, below in LIPS:
        a, b, c = (row_of()[name] for name in (upper, lower, below))
        apart = reference[b] - reference[a]
        if np.isnan(apart).any():
            continue
        if np.isnan(full[a]).any():
            full[a] = full[b] - apart  # NaN where neither is known
        rise = full[a] + apart - full[b]
        if np.linalg.norm(rise) < KEPT * np.linalg.norm(apart):
            continue
        if np.isfinite(rise).all():
            full[b] += rise
            if abs(rise[1]) > OPEN * width:
                full[c] += rise
            widest = max(widest, float(rise[1]), key=abs)
        elif np.isfinite(full[a]).all():
            full[b] = full[a] + apart
    if abs(widest) > OPEN * width:
        found = "the mouth is open by" if widest > 0 else "the lower lip is in the upper one by"
        _warn(
            f"{found} {abs(widest) * 1000:.1f} mm, but the lips of a neutral face touch: "
            "the lower lip was moved",
            stacklevel,
        )
    a, b = (row_of()[name] for name in TEETH)
    apart = full[a] + reference[b] - reference[a] - full[b]
    if np.isfinite(apart).all():
        if np.linalg.norm(apart) > 2 * OPEN * width:
            _warn(
                f"upper and lower teeth are {np.linalg.norm(apart) * 1000:.1f} mm from touching as those "
                "of a neutral face do: the lower ones were moved",
                stacklevel,
            )
        full[[b, row_of()["9.9"]]] += apart
    return full


def _between(points: Float64, left: str, right: str) -> float:
    distance = float(points[row_of()[left], 0] - points[row_of()[right], 0])
    return distance if np.isfinite(distance) and distance > 0 else 0.06


def _warn(text: str, stacklevel: int) -> None:
    warnings.warn(text, FbaWarning, stacklevel=stacklevel + 2)
