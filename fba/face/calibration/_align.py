"""Aligns a person's feature points, in any unit and pose, with a face model, in metres."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64
from fba.errors import ModelError
from fba.face.feature_points import names
from fba.geometry import fit_similarity, principal_axes
from fba.parameters import point_rows

UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
"""Units of length of files, in metres."""
HUMAN_SIZES = (0.7, 1.4)
"""Range of a person's size relative to the model, from a child of two to a giant. Beyond it, the unit is
wrong."""
RIGHT_ANGLE_TOLERANCE = np.radians(15.0)
"""Rotations this close to multiples of 90 degrees are rounded to them: the rest is a difference of faces."""
FEWEST_POINTS = 4
FLAT_RATIO = 0.02
"""Ratio of smallest to largest spread below which points lie in a plane, as those of a photograph do."""
MIRRORED_FIT = 0.6
"""Points are taken as mirrored if their mirror image fits with less than this share of the error."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """A person's feature points in the frame of the model, and the transform that brought them there.

    points: (84, 3), metres. scale: metres for one unit of the file. unit: its name, "" if none fits and the
    size is the model's. angle: of the rotation, radians. mirrored: left and right were swapped. flat: the
    points had no depth and got the model's. expected: (84, 3), the model's points at the person's size.
    """

    points: Float64
    scale: float
    unit: str
    angle: float
    mirrored: bool
    flat: bool
    expected: Float64


def align(given: Float64, reference: Float64, *, unit: str | float | None = None) -> Alignment:
    """Return a person's feature points (84, 3), scaled, rotated and shifted to match a reference (84, 3).

    NaN marks unknown points. unit: a name in `UNITS`, or metres for one unit of the file; None finds it.
    Raises ModelError where fewer than four points are known in both, or where they coincide or lie on one
    line.
    """
    known = known_rows(given, reference)
    _check(given, known)
    here, there = given[known], reference[known]
    flatness = [spread[2] / spread[0] for _, spread in (principal_axes(here), principal_axes(there))]
    flat = bool(flatness[0] < FLAT_RATIO and flatness[1] > 2 * FLAT_RATIO)
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
    points, expected = posed * scale, reference * scale / size
    if flat:
        points[:, 2] = np.where(np.isfinite(points[:, 2]), expected[:, 2], np.nan)
    # The median shift of those points that fit best.
    points += np.median((expected - points)[known][weight >= np.median(weight)], axis=0)
    return Alignment(points, scale, name, angle, mirrored, flat, expected)


def known_rows(*points: Float64) -> Bool:
    """Return (N,) mask of the rows that are finite in all of the arrays (N, 3)."""
    return np.asarray(np.isfinite(np.hstack(points)).all(axis=1))


def _check(given: Float64, known: Bool) -> None:
    if known.sum() < FEWEST_POINTS:
        raise ModelError(
            f"only {int(known.sum())} feature points are known to both the person and the face "
            f"({', '.join(np.array(names())[known]) or 'none'}); at least {FEWEST_POINTS} are needed"
        )
    _, spread = principal_axes(given[known])
    if not spread[0] > 0 or not np.isfinite(spread).all() or spread[1] < 1e-4 * spread[0]:
        fault = "lie on one line" if spread[0] > 0 else "coincide"
        raise ModelError(
            f"the {int(known.sum())} feature points {', '.join(np.array(names())[known][:6])} ... "
            f"{fault}: these are not the points of a face"
        )


def _find_pose(here: Float64, there: Float64) -> tuple[Float64, bool]:
    """Return the rotation (3, 3) from here to there, and whether here must first be mirrored by x -> -x."""
    plain = _fit_rotation(here, there)
    mirrored = _fit_rotation(here, there, reflected=True)
    if mirrored[1] < MIRRORED_FIT * plain[1]:
        return np.diag([-1.0, 1.0, 1.0]) @ mirrored[0], True
    return plain[0], False


def _fit_rotation(here: Float64, there: Float64, *, reflected: bool = False) -> tuple[Float64, float]:
    """Return the orthogonal matrix with there ~ size * matrix @ here, and the median error.

    Procrustes analysis, iteratively reweighted: distant points count less (Geman-McClure weights).
    """
    weight = np.ones(len(here))
    matrix, error = np.eye(3), np.inf
    for _ in range(30):
        fit = fit_similarity(here, there, weight, reflected=reflected)
        away = np.linalg.norm(fit.apply(here) - there, axis=1)
        matrix, error = fit.rotation, float(np.median(away))
        weight = _robust_weights(away, there - fit.target)
    return matrix, error


def _robust_weights(errors: Float64, points: Float64) -> Float64:
    """Return (N,) Geman-McClure weights of points (N, 3) by errors (N,), near 1 below the median error."""
    usual = max(1.5 * float(np.median(errors)), 1e-9 * float(np.abs(points).max()))
    return 1.0 / (1.0 + (errors / (2 * usual)) ** 2) ** 2


def _find_flat_pose(here: Float64, there: Float64) -> Float64:
    """Return (3, 3) rotation of points in a plane onto the model from the front, the better side forward."""
    axes, _ = principal_axes(here)
    axes[2] = np.cross(axes[0], axes[1])
    flat = (here - here.mean(axis=0)) @ axes.T
    poses = []
    for side in (1.0, -1.0):
        plane = flat * (1.0, side, 0.0)
        matrix, error = _fit_rotation(plane, there * (1.0, 1.0, 0.0))
        poses.append((error, matrix @ np.diag([1.0, side, side]) @ axes))
    return min(poses, key=lambda pair: pair[0])[1]


def _snap_to_axes(matrix: Float64) -> Float64:
    """Return the nearest rotation by right angles within `RIGHT_ANGLE_TOLERANCE`, else the matrix itself."""
    right_angled = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            turn = np.zeros((3, 3))
            turn[range(3), order] = signs
            if np.linalg.det(turn) > 0:
                right_angled.append(turn)
    nearest = min(right_angled, key=lambda turn: _angle(matrix @ turn.T))
    return nearest if _angle(matrix @ nearest.T) < RIGHT_ANGLE_TOLERANCE else matrix


def _angle(matrix: Float64) -> float:
    return float(np.arccos(np.clip((np.trace(matrix) - 1) / 2, -1.0, 1.0)))


def _robust_size(posed: Float64, there: Float64) -> tuple[float, Float64]:
    """Return (size of there relative to posed, (N,) weight of each point), robust against outliers."""
    weight = np.ones(len(posed))
    size = 1.0
    for _ in range(20):
        share = weight / weight.sum()
        a, b = posed - share @ posed, there - share @ there
        size = float(np.sqrt((share @ (b**2).sum(axis=1)) / (share @ (a**2).sum(axis=1))))
        weight = _robust_weights(np.linalg.norm(a * size - b, axis=1), b)
    return size, weight


def _find_unit(size: float, unit: str | float | None) -> tuple[float, str]:
    """Return (metres for one unit, its name or ""). size: factor by which the points fit the model best."""
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
        if HUMAN_SIZES[0] <= UNITS[name] / size <= HUMAN_SIZES[1]:
            return UNITS[name], name
    return size, ""


def centre_on_pupils(points: Float64, reference: Float64) -> Float64:
    """Return the points (84, 3), the middle of the pupils shifted to the reference's if both are known."""
    rows = [point_rows()["3.5"], point_rows()["3.6"]]
    shift = reference[rows].mean(axis=0) - points[rows].mean(axis=0)
    return points + shift if np.isfinite(shift).all() else points
