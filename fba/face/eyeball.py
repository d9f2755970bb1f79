"""Measures the eyeballs of a face model: the sphere through each, its gaze and its pupil."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fba.arrays import Float64, Floating
from fba.face.feature_points import row_of
from fba.face.tables import FaceDefMesh, FaceDefTables

if TYPE_CHECKING:
    from fba.face.model import FaceModel, Part


PUPIL_FAP = {"left": 29, "right": 30}
PUPIL_POINT = {"left": "3.5", "right": "3.6"}
LID_POINTS = {"left": ("3.1", "3.3"), "right": ("3.2", "3.4")}
"""Middles of the upper and the lower lid margin."""
FEWEST_VERTICES = 8
"""Fewest vertices that determine a sphere."""


@dataclass(frozen=True, eq=False)
class Eyeball:
    """One eyeball of a model.

    part: name of the part. side: "left" or "right", the subject's. centre: (3,), radius: metres, of the
    sphere that fits its vertices best, a bulging cornea or a flat iris left out. error: root mean
    square distance of the vertices on the sphere from it, metres. share: of the vertices on the sphere.
    """

    part: str
    side: str
    centre: Float64
    radius: float
    error: float
    share: float


def eyeballs(model: FaceModel) -> dict[str, Eyeball]:
    """The eyeballs by side: the biggest part of kind "eye" on each; a side without one is missing."""
    found: dict[str, Eyeball] = {}
    middle = symmetry_plane(model.points)
    for part in model.of_kind("eye"):
        fitted = sphere(part)
        if fitted is None:
            continue
        centre, radius, error, share = fitted
        side = "left" if centre[0] > middle else "right"
        if side not in found or radius > found[side].radius:
            found[side] = Eyeball(part.name, side, centre, radius, error, share)
    return found


def symmetry_plane(points: Float64) -> float:
    """The x of the plane between left and right: half way between the pupils, 0 where they are unknown."""
    pair = points[[row_of()["3.5"], row_of()["3.6"]], 0]
    return float(pair.mean()) if np.isfinite(pair).all() else 0.0


def sphere(part: Part) -> tuple[Float64, float, float, float] | None:
    """(centre, radius, error, share) of the sphere through most of a part's vertices, None for too few.

    Least squares, repeated without outliers, so that a cornea or an iris has no influence.
    """
    vertices = np.unique(part.vertices.astype(np.float64), axis=0)
    if len(vertices) < FEWEST_VERTICES:
        return None
    on_sphere = np.ones(len(vertices), dtype=bool)
    centre, radius = vertices.mean(axis=0), 0.0
    for _ in range(8):
        origin = vertices[on_sphere].mean(axis=0)
        near = vertices[on_sphere] - origin
        system = np.column_stack([2 * near, np.ones(len(near))])
        solution, _, rank, _ = np.linalg.lstsq(system, (near**2).sum(axis=1), rcond=None)
        if rank < 4:
            return None
        centre = solution[:3] + origin
        radius = float(np.sqrt(max(solution[3] + solution[:3] @ solution[:3], 0.0)))
        away = np.abs(np.linalg.norm(vertices - centre, axis=1) - radius)
        limit = max(3 * float(np.median(away)), 1e-6 * radius)
        again = away <= limit
        if again.sum() < FEWEST_VERTICES or (again == on_sphere).all():
            break
        on_sphere = again
    if not radius > 0:
        return None
    away = np.abs(np.linalg.norm(vertices[on_sphere] - centre, axis=1) - radius)
    return centre, radius, float(np.sqrt((away**2).mean())), float(on_sphere.mean())


def gaze(model: FaceModel, eye: Eyeball) -> Float64 | None:
    """Unit vector from the eyeball's centre to its pupil point, None where the model has none."""
    arm = model.points[row_of()[PUPIL_POINT[eye.side]]] - eye.centre
    length = float(np.linalg.norm(arm))
    return arm / length if np.isfinite(length) and length > 0 else None


def pupil_diameter(model: FaceModel, eye: Eyeball) -> float | None:
    """Metres across the pupil: across the vertices that dilate_pupil moves most; None where unknown."""
    table = model.table_of.get(PUPIL_FAP[eye.side])
    direction = gaze(model, eye)
    if table is None or direction is None:
        return None
    across = [
        diameter
        for mesh in table.meshes
        if model.part(mesh.part).kind == "eye"
        for diameter in _rim(model.part(mesh.part), mesh, eye.centre, direction)
    ]
    return max(across) if across else _scaled_part(model, table, eye.centre, direction)


def _rim(part: Part, mesh: FaceDefMesh, centre: Float64, direction: Float64) -> list[float]:
    from_axis = _off_axis(part.vertices[mesh.vertices], centre, direction)
    moves = np.linalg.norm(mesh.displacements, axis=2).max(axis=1)
    if not len(moves) or not moves.max() > 0:
        return []
    return [2 * float(np.median(from_axis[moves > 0.95 * moves.max()]))]


def _scaled_part(model: FaceModel, table: FaceDefTables, centre: Float64, direction: Float64) -> float | None:
    """A pupil that is a part of its own, and scaled as a whole."""
    for transform in table.transforms:
        if transform.kind == "scale" and transform.part in model.starts:
            return 2 * float(_off_axis(model.part(transform.part).vertices, centre, direction).max())
    return None


def _off_axis(vertices: Floating, centre: Float64, direction: Float64) -> Float64:
    arms = vertices.astype(np.float64) - centre
    distances: Float64 = np.linalg.norm(arms - np.outer(arms @ direction, direction), axis=1)
    return distances
