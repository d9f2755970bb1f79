"""Measures the eyeballs of a face model, sphere, gaze and pupil; one limit for the gaze of every source."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fba.arrays import Float64, Floating
from fba.errors import FbaWarning
from fba.face.points import EYEBALL_PER_IRIS, PITCH_EYE, YAW_EYE
from fba.geometry import principal_axes
from fba.parameters import point_rows

if TYPE_CHECKING:
    from fba.face.model import FaceModel, Part


PUPIL_FAP = {"left": 29, "right": 30}
PUPIL_POINT = {"left": "3.5", "right": "3.6"}
LID_POINTS = {"left": ("3.1", "3.3"), "right": ("3.2", "3.4")}
"""Middles of the upper and the lower lid margin."""
FLAT_RATIO = 0.3
"""Depth of an eye by its width below which it is a drawn iris, not a ball; of half a ball it is 0.5."""
FEWEST_VERTICES = 8
"""Fewest vertices that determine a sphere."""


@dataclass(frozen=True, eq=False)
class Eyeball:
    """One eyeball of a model.

    part: name of the part. side: "left" or "right", the subject's. centre: (3,), radius: metres, of the
    sphere that fits its vertices best, without a bulging cornea or a flat iris. error: root mean square
    distance of the vertices on the sphere from it, metres. share: proportion of the vertices on the sphere.
    """

    part: str
    side: str
    centre: Float64
    radius: float
    error: float
    share: float


def eyeballs(model: FaceModel) -> dict[str, Eyeball]:
    """Return the eyeballs by side, "left" and "right": the biggest part of kind "eye" on each, if any."""
    result: dict[str, Eyeball] = {}
    middle = _middle_x(model.points)
    for part in model.of_kind("eye"):
        own = float(part.vertices[:, 0].min() + part.vertices[:, 0].max()) / 2 if len(part.vertices) else 0.0
        side = "left" if own > middle else "right"
        fitted = fit_eyeball(part, model.points[point_rows()[PUPIL_POINT[side]]])
        if fitted is None:
            continue
        centre, radius, error, share = fitted
        if side not in result or radius > result[side].radius:
            result[side] = Eyeball(part.name, side, centre, radius, error, share)
    return result


def fit_eyeball(part: Part, pupil: Float64) -> tuple[Float64, float, float, float] | None:
    """Return (centre, radius, error, share) of an eyeball, as in `Eyeball`; None for too few vertices.

    A flat eye, as drawn figures have, stands for a ball of usual size behind its pupil. pupil: (3,), NaN
    where unknown.
    """
    width = flat_width(part)
    if width is None or not np.isfinite(pupil).all():
        return sphere(part)
    radius = EYEBALL_PER_IRIS * width
    centre = pupil - (0.0, 0.0, radius)
    away = np.linalg.norm(part.vertices.astype(np.float64) - centre, axis=1) - radius
    return centre, radius, float(np.sqrt((away**2).mean())), 1.0


def flat_width(part: Part) -> float | None:
    """Return the width of a flat eye, an iris without a ball, in the part's unit; None for others."""
    vertices = np.unique(part.vertices.astype(np.float64), axis=0)
    if len(vertices) < FEWEST_VERTICES:
        return None
    extents = np.ptp(vertices @ principal_axes(vertices)[0].T, axis=0)
    return float(extents.max()) if extents[2] < FLAT_RATIO * extents.max() else None


def _middle_x(points: Float64) -> float:
    """Return the x halfway between the pupils, or 0 where they are unknown."""
    pair = points[[point_rows()["3.5"], point_rows()["3.6"]], 0]
    return float(pair.mean()) if np.isfinite(pair).all() else 0.0


def sphere(part: Part) -> tuple[Float64, float, float, float] | None:
    """Return (centre, radius, error, share) of the sphere through most of a part's vertices, as in `Eyeball`.

    Least squares, repeated without outliers, such as a cornea or an iris. None for too few vertices.
    """
    vertices = np.unique(part.vertices.astype(np.float64), axis=0)
    if len(vertices) < FEWEST_VERTICES:
        return None
    on_sphere = np.ones(len(vertices), dtype=bool)
    centre, radius = vertices.mean(axis=0), 0.0
    for _ in range(8):
        centre, radius, determined = fit_sphere(vertices[on_sphere])
        if not determined:
            return None
        away = np.abs(np.linalg.norm(vertices - centre, axis=1) - radius)
        limit = max(3 * float(np.median(away)), 1e-6 * radius)
        inliers = away <= limit
        if inliers.sum() < FEWEST_VERTICES or (inliers == on_sphere).all():
            break
        on_sphere = inliers
    if not radius > 0:
        return None
    away = np.abs(np.linalg.norm(vertices[on_sphere] - centre, axis=1) - radius)
    return centre, radius, float(np.sqrt((away**2).mean())), float(on_sphere.mean())


def fit_sphere(points: Float64) -> tuple[Float64, float, bool]:
    """Return centre (3,) and radius of the sphere closest to points (N, 3), and whether they determine it."""
    origin = points.mean(axis=0)
    near = points - origin
    system = np.column_stack([2 * near, np.ones(len(near))])
    solution, _, rank, _ = np.linalg.lstsq(system, (near**2).sum(axis=1), rcond=None)
    radius = float(np.sqrt(max(solution[3] + solution[:3] @ solution[:3], 0.0)))
    return solution[:3] + origin, radius, bool(rank == 4)


def gaze(model: FaceModel, eye: Eyeball) -> Float64 | None:
    """Return the unit vector from the eyeball's centre to its pupil point, None where the model has none."""
    arm = model.points[point_rows()[PUPIL_POINT[eye.side]]] - eye.centre
    length = float(np.linalg.norm(arm))
    return arm / length if np.isfinite(length) and length > 0 else None


def pupil_diameter(model: FaceModel, eye: Eyeball) -> float | None:
    """Return the pupil's diameter, metres, from what dilate_pupil moves most; None where unknown."""
    table = model.table_of.get(PUPIL_FAP[eye.side])
    direction = gaze(model, eye)
    if table is None or direction is None:
        return None
    diameters = []
    for mesh in table.meshes:
        part = model.part(mesh.part)
        moves = np.linalg.norm(mesh.displacements, axis=2).max(axis=1, initial=0)
        if part.kind == "eye" and moves.max(initial=0) > 0:
            rim = part.vertices[mesh.vertices[moves > 0.95 * moves.max()]]
            diameters.append(2 * float(np.median(distances_from_axis(rim, eye.centre, direction))))
    if diameters:
        return max(diameters)
    for transform in table.transforms:
        if transform.kind == "scale" and transform.part in model.starts:  # a pupil that is a part of its own
            vertices = model.part(transform.part).vertices
            return 2 * float(distances_from_axis(vertices, eye.centre, direction).max())
    return None


def distances_from_axis(points: Floating, centre: Float64, direction: Float64) -> Float64:
    """Return (N,) distances of points (N, 3) from the line through a centre along a unit vector."""
    arms = points.astype(np.float64) - centre
    return np.asarray(np.linalg.norm(arms - np.outer(arms @ direction, direction), axis=1))


def polar(points: Float64, centre: Float64, axis: Float64) -> tuple[Float64, Float64]:
    """Return (angles (N,) from an axis, radians, distances (N,) from a centre) of points (N, 3)."""
    arms = points - centre
    distance = np.linalg.norm(arms, axis=1)
    return np.arccos(np.clip(arms @ axis / np.maximum(distance, 1e-12), -1, 1)), distance


LARGEST_GAZE = 0.6
"""Radians from straight ahead that an eye turns at most here, in any direction.

Eyes reach about 55 degrees at the very most (Guitton and Volle, 1987); beyond 30, people turn their heads."""
UNITS_PER_RADIAN = 1e5
"""FAP units per radian, of the FAPs that turn eyeballs."""


def limit_gaze(values: Float64, *, warn: bool = True) -> None:
    """Bring eyes in FAPs (T, 68) that turn too far back to the limit, in the same direction, in place.

    warn: whether to warn (FbaWarning) of eyes that turn further. What lies beyond is lost: the head turns as
    its own source says.
    """
    found = False
    for yaw, pitch in zip(YAW_EYE, PITCH_EYE, strict=True):
        columns = [yaw - 1, pitch - 1]
        angles = np.hypot(values[:, yaw - 1], values[:, pitch - 1]) / UNITS_PER_RADIAN
        values[:, columns] *= (LARGEST_GAZE / np.maximum(angles, LARGEST_GAZE))[:, None]
        found |= bool((angles > 1.01 * LARGEST_GAZE).any())
    if found and warn:
        warnings.warn(
            f"eyes that turn further than {np.degrees(LARGEST_GAZE):.0f} degrees from straight ahead are "
            "shown at that angle; what lies beyond is for the head, whose turns stay as they are",
            FbaWarning,
            stacklevel=3,
        )
