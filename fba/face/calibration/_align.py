"""Aligns a person's feature points, in any unit and pose, with a face model: metres, in its frame."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64
from fba.errors import ModelError
from fba.face.feature_points import names, row_of

UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
"""Units of length that files are in, in metres."""
HUMAN = (0.7, 1.4)
"""A person's size relative to the model: from a child of two to a giant. Outside it the unit is wrong."""
OWN_AXES = np.radians(15.0)
"""A rotation this close to whole right angles is rounded to them: the rest is a difference of faces."""
FEWEST_POINTS = 4
FLAT = 0.02
"""Ratio of smallest to largest spread below which points lie in a plane, as those of a photograph do."""
MIRRORED_FIT = 0.6
"""Points are mirrored where their mirror image leaves less than this share of the error."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """A person's feature points in the frame of the model, and the transform that brought them there.

    points: (84, 3), metres. scale: metres for one unit of the file. unit: its name, "" where none fits
    and the size was taken from the model. angle: of the rotation, radians. mirrored:
    left and right were swapped. flat: the points had no depth, and were given the model's. expected:
    (84, 3), where the model's points would be on a person of that size; residual: (84,), metres between
    the two, NaN where unknown.
    """

    points: Float64
    scale: float
    unit: str
    angle: float
    mirrored: bool
    flat: bool
    expected: Float64
    residual: Float64


def align(given: Float64, reference: Float64, *, unit: str | float | None = None) -> Alignment:
    """A person's feature points (84, 3) scaled, rotated and shifted into the frame of reference (84, 3).

    NaN marks unknown points. unit: a name of `UNITS`, or metres for one unit of the file; None finds it.
    Raises ModelError where fewer than four points are known to both, or where they coincide or lie on one
    line.
    """
    known = known_rows(given, reference)
    _check(given, known)
    here, there = given[known], reference[known]
    flat = _flatness(here) < FLAT and _flatness(there) > 2 * FLAT
    if flat:
        rotation, mirrored = _find_flat_pose(here, there), False
        angle = _angle(rotation)
    else:
        rotation, mirrored = _find_pose(here, there)
        angle = _angle(rotation)
        rotation = _snap_to_axes(rotation)
    if mirrored:
        rotation = np.diag([-1.0, 1.0, 1.0]) @ rotation
    posed = given @ rotation.T
    # Size and position are found last: rounding the rotation to right angles changes the best fit.
    size, weight = _robust_size(posed[known], there)
    scale, name = _find_unit(size, unit)
    placed = posed * scale
    if flat:
        placed[:, 2] = np.where(np.isfinite(placed[:, 2]), reference[:, 2] * scale / size, np.nan)
    shift = _trusted_median(there * scale / size - placed[known], weight)
    placed += shift
    expected = reference * scale / size
    residual = np.linalg.norm(placed - expected, axis=1)
    return Alignment(placed, scale, name, angle, mirrored, flat, expected, residual)


def known_rows(*points: Float64) -> Bool:
    """(N,) mask of the rows that are finite in all of the arrays (N, 3)."""
    return np.asarray(np.isfinite(np.hstack(points)).all(axis=1))


def _check(given: Float64, known: Bool) -> None:
    if known.sum() < FEWEST_POINTS:
        raise ModelError(
            f"only {int(known.sum())} feature points are known to both the person and the face "
            f"({', '.join(np.array(names())[known]) or 'none'}); at least {FEWEST_POINTS} are needed"
        )
    spread = np.linalg.svd(given[known] - given[known].mean(axis=0), compute_uv=False)
    if not spread[0] > 0 or not np.isfinite(spread).all() or spread[1] < 1e-4 * spread[0]:
        what = "one spot" if not spread[0] > 0 else "one line"
        raise ModelError(
            f"the {int(known.sum())} feature points {', '.join(np.array(names())[known][:6])} ... "
            f"stand on {what}: that is no face"
        )


def _flatness(points: Float64) -> float:
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return float(spread[2] / spread[0])


def _find_pose(here: Float64, there: Float64) -> tuple[Float64, bool]:
    """((3, 3) rotation from here to there, whether here must first be mirrored by x -> -x)."""
    plain = _rotation(here, there, 1.0)
    mirrored = _rotation(here, there, -1.0)
    if mirrored[1] < MIRRORED_FIT * plain[1]:
        return np.diag([-1.0, 1.0, 1.0]) @ mirrored[0], True
    return plain[0], False


def _rotation(here: Float64, there: Float64, handed: float) -> tuple[Float64, float]:
    """(orthogonal matrix of determinant `handed`, median error) with there ~ size * matrix @ here.

    Procrustes analysis, iteratively reweighted: distant points count less (Geman-McClure weights).
    """
    weight = np.ones(len(here))
    matrix, error = np.eye(3), np.inf
    for _ in range(30):
        share = weight / weight.sum()
        a, b = here - share @ here, there - share @ there
        u, _, vt = np.linalg.svd((b * share[:, None]).T @ a)
        flip = np.diag([1.0, 1.0, handed * np.sign(np.linalg.det(u @ vt)) or 1.0])
        matrix = u @ flip @ vt
        turned = a @ matrix.T
        size = float((share @ (turned * b).sum(axis=1)) / (share @ (a**2).sum(axis=1)))
        away = np.linalg.norm(turned * size - b, axis=1)
        error = float(np.median(away))
        usual = max(1.5 * error, 1e-9 * float(np.abs(b).max()))
        weight = 1.0 / (1.0 + (away / (2 * usual)) ** 2) ** 2
    return matrix, error


def _find_flat_pose(here: Float64, there: Float64) -> Float64:
    """(3, 3) rotation of points in a plane onto the model seen from the front, on the better of two sides."""
    _, _, axes = np.linalg.svd(here - here.mean(axis=0), full_matrices=True)
    axes[2] = np.cross(axes[0], axes[1])
    flat = (here - here.mean(axis=0)) @ axes.T
    found = []
    for side in (1.0, -1.0):
        plane = flat * (1.0, side, 0.0)
        matrix, error = _rotation(plane, there * (1.0, 1.0, 0.0), 1.0)
        found.append((error, matrix @ np.diag([1.0, side, side]) @ axes))
    best: Float64 = min(found, key=lambda pair: pair[0])[1]
    return best


def _snap_to_axes(matrix: Float64) -> Float64:
    """The nearest rotation by whole right angles if it is within `OWN_AXES`, else the matrix unchanged."""
    quarter = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            turn = np.zeros((3, 3))
            turn[range(3), order] = signs
            if np.linalg.det(turn) > 0:
                quarter.append(turn)
    nearest = min(quarter, key=lambda turn: _angle(matrix @ turn.T))
    return nearest if _angle(matrix @ nearest.T) < OWN_AXES else matrix


def _angle(matrix: Float64) -> float:
    return float(np.arccos(np.clip((np.trace(matrix) - 1) / 2, -1.0, 1.0)))


def _robust_size(posed: Float64, there: Float64) -> tuple[float, Float64]:
    """(size of there relative to posed, (N,) weight of each point), robust against outliers."""
    weight = np.ones(len(posed))
    size = 1.0
    for _ in range(20):
        share = weight / weight.sum()
        a, b = posed - share @ posed, there - share @ there
        size = float(np.sqrt((share @ (b**2).sum(axis=1)) / (share @ (a**2).sum(axis=1))))
        away = np.linalg.norm(a * size - b, axis=1)
        usual = max(1.5 * float(np.median(away)), 1e-9 * float(np.abs(b).max()))
        weight = 1.0 / (1.0 + (away / (2 * usual)) ** 2) ** 2
    return size, weight


def _find_unit(size: float, unit: str | float | None) -> tuple[float, str]:
    if isinstance(unit, str):
        if unit not in UNITS:
            raise ModelError(f"there is no unit of length {unit!r}; there are {', '.join(UNITS)}")
        return UNITS[unit], unit
    if unit is not None:
        if not (np.isfinite(unit) and unit > 0):
            raise ModelError(f"a unit of length must be a positive number of metres, not {unit}")
        return float(unit), ""
    for name in ("mm", "cm", "m"):
        # `size` scales the points to the model; the true unit may differ from it by as much as people do.
        if HUMAN[0] <= UNITS[name] / size <= HUMAN[1]:
            return UNITS[name], name
    return size, ""


def _trusted_median(rows: Float64, weight: Float64) -> Float64:
    trusted = rows[weight >= np.median(weight)]
    middle: Float64 = np.median(trusted, axis=0)
    return middle


def centre_on_pupils(points: Float64, reference: Float64) -> Float64:
    """Points (84, 3) shifted so that the pupils' midpoint is the reference's; unchanged if unknown."""
    rows = [row_of()["3.5"], row_of()["3.6"]]
    shift = reference[rows].mean(axis=0) - points[rows].mean(axis=0)
    return points + shift if np.isfinite(shift).all() else points
