"""Checks each FAP of a model: its point, its region, and the triangles at the limits of its range."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np

from fba.arrays import Bool, Float64, Integer
from fba.errors import OptionError
from fba.face.checks._findings import Finding
from fba.face.checks._posing import Poser
from fba.face.model import Part
from fba.face.points import HEAD_PITCH, HEAD_ROLL, HEAD_YAW, OPEN_JAW, TONGUE_ROLL
from fba.geometry import nearest_rotation
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP, faps, point_rows
from fba.parameters import faps as fap_table
from fba.rotations import cross, dot, lengths
from fba.text_files import packaged_rows

if TYPE_CHECKING:
    from fba.face.model import FaceModel

TESTED_VALUE = 300.0
"""Value at which regions are checked; for FAPs in units of angle, 100 times it."""
EYE_FAPS = range(23, 31)
"""FAPs that move eyeballs."""
STILL_SHARE = 0.03
"""Vertices that move less than this share of the largest motion count as still."""
TURNING = {OPEN_JAW, 19, 20, 21, 22, TONGUE_ROLL}
"""FAPs that rotate the skin: under these a triangle has turned over if it faces away from its neighbours."""
HAIR = ("lash", "hair")
"""Kinds of parts that are two-sided: their triangles cannot turn over."""
LID_FAPS = {19, 20, 21, 22}
EYE_CORNERS = ("3.7", "3.11", "3.8", "3.12")
CORNER_RADIUS = 0.12
"""Radius about the eye's corners that is not checked, as a share of the eye's width."""
RIGID = {HEAD_PITCH, HEAD_YAW, HEAD_ROLL}
MAX_STRETCH = 8.0
"""Factor by which an edge may grow."""
SHORT_EDGE = 0.3
"""Share of the typical edge length, which stands for shorter edges there."""
MAX_TURNED_SHARE = 0.003
"""Share of the moving surface that may turn over in the folds of skin at the corners of eyes."""
DEGENERATE = 1e-5
"""Triangles smaller than this share of the median area are ignored."""
TURNED_COSINE = -0.3
"""A triangle has turned over if the cosine between its normal and its neighbours' is below this."""


def check_faps(model: FaceModel, faps: Iterable[int] | None = None) -> list[Finding]:
    """Return the deviations of a face's motions from the standard; an empty list without deviations.

    faps: numbers of the FAPs to check (3..68), all by default; those in `model.lost` are left out. For
    each: its feature point moves by value x FAPU in the standard's direction (within 5 % at small values;
    on arcs, along the direction), its mate stays, nothing outside its region moves, and no triangle turns
    over or tears at the limits of its range. For combinations: lids meet where their values add up to 1024
    and do not cut the eyeball; lips stay in touch where theirs add up to 0; the jaw moves lower teeth and
    tongue but not lips and upper teeth.

    Raises OptionError for a number outside 3..68.
    """
    from fba.face.checks._posing import Poser

    wanted = list(range(FIRST_LOW_LEVEL_FAP, FAP_COUNT + 1)) if faps is None else list(faps)
    for fap in wanted:
        if not FIRST_LOW_LEVEL_FAP <= fap <= FAP_COUNT:
            raise OptionError(f"FAP {fap} cannot be checked: there are {FIRST_LOW_LEVEL_FAP}..{FAP_COUNT}")
    return check_posed(Poser(model), wanted)


def check_posed(poser: Poser, wanted: Iterable[int], *, combined: bool = True) -> list[Finding]:
    """Return what `check_faps` does, for a `Poser`. combined: also what several FAPs do together."""
    wanted = list(wanted)
    findings = [finding for fap in wanted for finding in _findings_of_one(poser, fap)]
    if not combined:
        return findings
    return [*findings, *_check_combinations(poser, set(wanted))]


def count_errors(poser: Poser, wanted: Iterable[int], *, combined: bool = True) -> int:
    """Return the number of errors that `check_posed` finds."""
    return sum(finding.severity == "error" for finding in check_posed(poser, wanted, combined=combined))


def _findings_of_one(poser: Poser, fap: int) -> tuple[Finding, ...]:
    if fap in poser.model.lost:
        return ()
    return poser.findings("one FAP", [fap], partial(_check_one, poser, fap))


def _check_one(poser: Poser, fap: int) -> Iterator[Finding]:
    from fba.face.checks._fap_points import check_point

    if fap not in poser.model.table_of:
        yield Finding(fap_table()[fap - 1].label, "it has tables or a reason", "neither", "FaceDefTables")
        return
    yield from check_point(poser, fap)
    yield from _check_region(poser, fap)
    yield from check_extremes(poser, fap)


def _check_combinations(poser: Poser, wanted: set[int]) -> Iterator[Finding]:
    from fba.face.checks._combined_rules import OUTER_PAIRS, PAIRS, SIDES, check_lids, check_mouth
    from fba.face.points import OPEN_JAW

    present = set(poser.model.table_of)
    for side, pair in SIDES.items():
        if set(pair) <= present and wanted & set(pair):
            yield from poser.findings(f"{side} lids", pair, partial(check_lids, poser, side))
    mouth = (OPEN_JAW, *(fap for pair in (*PAIRS, *OUTER_PAIRS) for fap in pair))
    if wanted & set(mouth):
        yield from poser.findings("mouth", mouth, partial(check_mouth, poser))


@cache
def region_table() -> dict[int, tuple[tuple[str, ...], float]]:
    """Return the points of each FAP's region, and how far from them its motion may reach, in ES0."""
    regions = {}
    for row in packaged_rows(__package__, "fap_regions.csv"):
        for fap in row["faps"].split():
            regions[int(fap)] = (tuple(row["points"].split()), float(row["reach"]))
    return regions


def _check_region(poser: Poser, fap: int) -> Iterator[Finding]:
    """Yield a finding where vertices move that are too far from the points of the FAP's region."""
    if fap not in region_table():
        return
    names, reach = region_table()[fap]
    points = poser.model.points[[point_rows()[name] for name in names]]
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return
    entry = fap_table()[fap - 1]
    value = TESTED_VALUE if entry.unit != "AU" else TESTED_VALUE * 100
    moved = np.linalg.norm(poser.shift({fap: value}), axis=1)
    if not moved.max() > 0:
        return
    moving = np.flatnonzero(moved > STILL_SHARE * moved.max())
    eyes = np.zeros(len(moved), dtype=np.bool_)
    for part in poser.model.of_kind("eye"):  # an eyeball belongs to its eye, however big it is
        start = poser.model.starts[part.name]
        eyes[start : start + len(part.vertices)] = fap in EYE_FAPS
    moving = moving[~eyes[moving]]
    if not len(moving):
        return
    away = np.min(np.linalg.norm(poser.neutral[moving][:, None] - points, axis=2), axis=1)
    es = poser.model.fapu.ES * 1024
    if away.max() > reach * es:
        worst = int(moving[away.argmax()])
        found = f"vertex {worst}, {away.max() * 1000:.0f} mm from it, moves {moved[worst] * 1000:.2f} mm"
        expected = f"within {reach * es * 1000:.0f} mm of {', '.join(names)}"
        yield Finding(entry.label, "nothing moves outside its region", found, expected)


def check_extremes(poser: Poser, fap: int) -> Iterator[Finding]:
    """Yield a finding per part whose triangles turn over or tear at either end of a FAP's range."""
    entry = faps()[fap - 1]
    if fap in RIGID or entry.i_limits is None:
        return
    for limit in entry.i_limits:
        if not limit:
            continue
        value = float(limit * entry.step)
        moved = poser.pose({fap: value})
        for part in poser.model.parts:
            own = slice(poser.model.starts[part.name], poser.model.starts[part.name] + len(part.vertices))
            before, after = poser.neutral[own], moved[own]
            if np.abs(after - before).max(initial=0.0) < 1e-9 or _moved_rigidly(before, after):
                continue
            over, torn, share = count_damage(
                before, after, _checked_triangles(poser, part, fap), turning=fap in TURNING
            )
            if part.kind in HAIR:
                over = 0
            if over and not (fap in TURNING and share <= MAX_TURNED_SHARE):
                found = f"{over} of part {part.name!r}, {share:.2%} of what moves, at {value:g}"
                yield Finding(entry.label, "no triangle turns over at the limits of its range", found, "none")
            if torn:
                yield Finding(
                    entry.label,
                    "no triangle explodes at the limits of its range",
                    f"{torn} edges of part {part.name!r} more than {MAX_STRETCH:g} times as long "
                    f"at {value:g}",
                    "none",
                )


def _checked_triangles(poser: Poser, part: Part, fap: int) -> Integer:
    """Return (M, 3) triangles of a part; for lids without those at the eyes' corners, where skin folds."""
    if fap not in LID_FAPS:
        return part.triangles
    corners = np.array([poser.point(name) for name in EYE_CORNERS])
    wide = np.linalg.norm(corners[0] - corners[1]), np.linalg.norm(corners[2] - corners[3])
    away = np.linalg.norm(part.vertices[:, None] - corners, axis=2)
    within = (np.nan_to_num(away, nan=np.inf) < CORNER_RADIUS * np.nan_to_num(np.repeat(wide, 2))).any(axis=1)
    return part.triangles[~_touching(within, part.triangles)]


def _touching(mask: Bool, triangles: Integer) -> Bool:
    """Return (F,) mask of the triangles (F, 3) with a vertex in a mask (V,)."""
    return mask[triangles[:, 0]] | mask[triangles[:, 1]] | mask[triangles[:, 2]]


def count_damage(
    before: Float64, after: Float64, triangles: Integer, *, turning: bool
) -> tuple[int, int, float]:
    """Return (triangles turned over, edges torn, share of the moving area turned over)."""
    moves = np.abs(after - before) > 1e-9
    moved_triangles = triangles[_touching(moves[:, 0] | moves[:, 1] | moves[:, 2], triangles)]
    sides = [
        (
            before[moved_triangles[:, k]] - before[moved_triangles[:, k - 1]],
            after[moved_triangles[:, k]] - after[moved_triangles[:, k - 1]],
        )
        for k in range(3)
    ]
    normals = [cross(sides[0][which], sides[1][which]) for which in (0, 1)]
    areas = lengths(normals[0])
    not_degenerate = areas > DEGENERATE * np.median(areas) if len(areas) else areas > 0
    if turning:
        facing = [_facing(normal, moved_triangles, len(before)) for normal in normals]
        over = (facing[0] > 0) & (facing[1] < TURNED_COSINE)
    else:
        over = dot(normals[0], normals[1]) <= 0
    over &= not_degenerate
    edges = np.array([[lengths(side[which]) for side in sides] for which in (0, 1)])
    typical = float(np.median(edges[0])) if edges.size else 0.0
    torn = edges[1] > MAX_STRETCH * np.maximum(edges[0], SHORT_EDGE * typical)
    share = float(areas[over].sum() / max(areas.sum(), 1e-30))
    return int(over.sum()), int(torn.sum()), share


def _facing(normals: Float64, triangles: Integer, count: int) -> Float64:
    """Return (F,) cosine between each triangle's normal and that of the triangles around it."""
    sums = np.zeros((count, 3))
    for corner in range(3):
        np.add.at(sums, triangles[:, corner], normals)
    around = sums[triangles].sum(axis=1) - 3 * normals
    product = lengths(around) * lengths(normals)
    return np.where(product > 0, dot(around, normals) / np.maximum(product, 1e-300), 1.0)


def _moved_rigidly(before: Float64, after: Float64) -> bool:
    """Return whether the vertices moved as a rigid body, which harms no triangle."""
    a, b = before - before.mean(axis=0), after - after.mean(axis=0)
    return bool(np.abs(a @ nearest_rotation(a.T @ b) - b).max() < 1e-4 * max(float(np.ptp(a)), 1e-9))
