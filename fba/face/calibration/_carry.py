"""Carries the FaceDefTables of a face over to the same face in another shape."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from fba.arrays import Float64, Floating, Integer
from fba.face._tables import HEAD, FaceDefMesh, FaceDefTables, FaceDefTransform
from fba.face.calibration._align import known_rows
from fba.face.calibration._eyes import FittedEye, eyeball_weight
from fba.face.calibration._shape import Shape, fit_size
from fba.parameters import faps, point_rows
from fba.rotations import between

if TYPE_CHECKING:
    from fba.face.fapu import Fapu
    from fba.face.model import FaceModel, Part


LID_FAPS = {19: "left", 20: "right", 21: "left", 22: "right"}
MEAN_STRETCH_WEIGHT = 1e-6
"""Weight of the average stretch, for directions in which a vertex has no edges."""


def carry_tables(
    model: FaceModel, parts: tuple[Part, ...], points: Float64, fapu: Fapu, shape: Shape
) -> tuple[FaceDefTables, ...]:
    """Return the model's tables for its parts in another shape, one for each.

    parts: the parts after fitting, in the model's order. points: (84, 3) fitted feature points, metres.
    fapu: of the fitted face. A displacement keeps its length in FAPU and rotates with the face around it.
    Displacements of lids stretch with the skin instead, as the opening between them does, and are
    corrected to keep the lid on the eyeball. Then displacements are corrected so that each FAP's own vertex
    moves by as many FAPU as before in the same direction. Transforms keep their angles; where a FAP's unit
    is a length, the angle is scaled so that the chin moves as many FAPU as before.
    """
    numbers = {part.name: number for number, part in enumerate(parts)}
    rotations = {part.name: shape.rotations.get(part.name) for part in model.parts}
    stretched = _lid_stretches(model, parts) if LID_FAPS.keys() & model.table_of.keys() else {}
    tables = []
    for table in model.tables:
        fap = faps()[table.fap - 1]
        units = model.fapu[fap.unit], fapu[fap.unit]
        lid = table.fap in LID_FAPS
        local = stretched if lid else rotations
        moved = {}
        for mesh in table.meshes:
            moves = mesh.displacements.astype(np.float64)
            matrices = local.get(mesh.part)
            if matrices is not None:
                moves = np.einsum("vij,vkj->vki", matrices[mesh.vertices], moves)
            if fap.unit == "AU":  # displacements by an angle scale with the part
                old, new = model.parts[numbers[mesh.part]], parts[numbers[mesh.part]]
                moves = moves * fit_size(old.vertices, new.vertices.astype(np.float64)).scale
            moved[mesh.part] = moves * (units[0] / units[1] if lid else 1.0)
        correction = _point_correction(model, table, moved) if fap.unit != "AU" else None
        meshes = []
        for mesh in table.meshes:
            moves = moved[mesh.part]
            if correction is not None and len(correction) == moves.shape[1]:
                moves = np.einsum("kij,vkj->vki", correction, moves)
            if lid:
                old, new = model.parts[numbers[mesh.part]], parts[numbers[mesh.part]]
                vertices = [part.vertices[mesh.vertices].astype(np.float64) for part in (old, new)]
                before = vertices[0], mesh.displacements.astype(np.float64) * units[0]
                after = vertices[1], moves * units[1]
                moves = keep_lid_on_eyeball(shape.eyes, table.fap, mesh.borders, before, after) / units[1]
            meshes.append(FaceDefMesh(mesh.part, mesh.borders, mesh.vertices, moves.astype(np.float32)))
        eyes = {eye.was.part: eye for eye in shape.eyes.values()}
        ratio = units[0] / units[1]
        transforms = [_carry_transform(model, one, points, fap.unit, ratio, eyes) for one in table.transforms]
        tables.append(FaceDefTables(table.fap, tuple(meshes), tuple(transforms)))
    return tuple(tables)


def _lid_stretches(model: FaceModel, parts: tuple[Part, ...]) -> dict[str, Float64]:
    """Return the stretch of the skin (V, 3, 3), for skin and for the parts on it, by name."""
    from scipy.spatial import cKDTree

    stretches = {
        old.name: surface_stretches(old, new.vertices)
        for old, new in zip(model.parts, parts, strict=True)
        if old.kind in ("skin", "mouth")
    }
    skin = [part for part in model.parts if part.name in stretches]
    if skin:
        tree = cKDTree(np.concatenate([part.vertices for part in skin]))
        joined = np.concatenate([stretches[part.name] for part in skin])
        for part in model.parts:
            if part.name not in stretches and len(part.vertices):
                stretches[part.name] = joined[tree.query(part.vertices)[1]]
    return stretches


def _carry_transform(
    model: FaceModel,
    transform: FaceDefTransform,
    points: Float64,
    unit: str,
    ratio: float,
    eyes: Mapping[str, FittedEye],
) -> FaceDefTransform:
    centre = np.array(transform.centre)
    amount = np.array(transform.amount)
    size = 1.0
    if transform.part in eyes:
        eye = eyes[transform.part]
        centre, size = eye(centre[None])[0], eye.size
    elif transform.part == HEAD:
        head = point_rows()["7.1"]
        if np.isfinite(points[head]).all() and np.isfinite(model.points[head]).all():
            centre = centre + points[head] - model.points[head]
    else:
        centre, size = _carry_hinge(model, points, centre)
    if transform.kind == "rotation" and unit != "AU":
        amount = amount / size  # a longer arm turns by less for the same distance
    if transform.kind == "scale":
        amount = amount * ratio
    return FaceDefTransform(transform.part, transform.kind, tuple(amount), tuple(centre))


def _carry_hinge(model: FaceModel, points: Float64, centre: Float64) -> tuple[Float64, float]:
    """Return (centre (3,), size): a hinge moved by the affine map of the feature points, and the ratio of the
    chin's new distance from it to the old one.
    """
    known = known_rows(points, model.points)
    here, there = model.points[known], points[known]
    a = np.column_stack([here - here.mean(axis=0), np.ones(len(here))])
    affine = np.linalg.lstsq(a.T @ a + 1e-6 * np.eye(4), a.T @ there, rcond=None)[0]
    moved: Float64 = np.append(centre - here.mean(axis=0), 1.0) @ affine
    chin = point_rows()["2.1"]
    if not known[chin]:
        return moved, 1.0
    after, before = (np.hypot(*arm[1:]) for arm in (points[chin] - moved, model.points[chin] - centre))
    return moved, float(after / before) if before > 0 else 1.0


def _point_correction(model: FaceModel, table: FaceDefTables, moved: Mapping[str, Float64]) -> Float64 | None:
    """Return (K, 3, 3) matrices that restore the motion of the FAP's point, in FAPU; None without one."""
    for name in faps()[table.fap - 1].feature_points:
        vertex = int(model.bound[point_rows()[name]])
        for mesh in table.meshes:
            rows = np.flatnonzero((mesh.vertices == vertex - model.starts[mesh.part]) & (vertex >= 0))
            if len(rows):
                wanted = mesh.displacements[rows[0]].astype(np.float64)
                got = moved[mesh.part][rows[0]]
                return np.stack([_rotation_and_scale(a, b) for a, b in zip(got, wanted, strict=True)])
    return None


def _rotation_and_scale(a: Float64, b: Float64) -> Float64:
    """Return (3, 3) smallest rotation and scale that take a to b; the unit matrix where either is zero."""
    lengths = float(np.linalg.norm(a)), float(np.linalg.norm(b))
    if min(lengths) < 1e-9:
        return np.eye(3)
    opposed = a @ b < -0.99 * lengths[0] * lengths[1]
    return (np.eye(3) if opposed else between(a, b)) * lengths[1] / lengths[0]


def surface_stretches(part: Part, after: Floating) -> Float64:
    """Return (V, 3, 3) linear maps of a part's surface around each vertex to vertices `after` (V, 3).

    Least squares over the edges at the vertex; its normal goes to the new normal, scaled as the surface is.
    """
    from fba.mesh import vertex_normals

    before = part.vertices.astype(np.float64)
    now = np.asarray(after, dtype=np.float64)
    normals = vertex_normals(before, part.triangles), vertex_normals(now, part.triangles)
    edges = np.concatenate([part.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    edges = np.unique(np.concatenate([edges, edges[:, ::-1]]), axis=0)
    old, new = before[edges[:, 1]] - before[edges[:, 0]], now[edges[:, 1]] - now[edges[:, 0]]
    squares, products = np.zeros((len(before), 3, 3)), np.zeros((len(before), 3, 3))
    np.add.at(squares, edges[:, 0], old[:, :, None] * old[:, None, :])
    np.add.at(products, edges[:, 0], new[:, :, None] * old[:, None, :])
    lengths = [np.bincount(edges[:, 0], (edge**2).sum(axis=1), len(before)) for edge in (old, new)]
    size = np.sqrt(lengths[1] / np.maximum(lengths[0], 1e-30))
    size[lengths[0] < 1e-20] = 1.0
    weight = np.maximum(lengths[0], 1e-20)
    along = [n.astype(np.float64) for n in normals]
    squares += weight[:, None, None] * along[0][:, :, None] * along[0][:, None, :]
    products += (weight * size)[:, None, None] * along[1][:, :, None] * along[0][:, None, :]
    squares += (MEAN_STRETCH_WEIGHT * weight)[:, None, None] * np.eye(3)
    products += (MEAN_STRETCH_WEIGHT * weight * size)[:, None, None] * np.eye(3)
    return products @ np.linalg.inv(squares)


def keep_lid_on_eyeball(
    eyes: Mapping[str, FittedEye],
    fap: int,
    borders: Integer,
    before: tuple[Float64, Float64],
    after: tuple[Float64, Float64],
) -> Float64:
    """Return the displacements (N, K - 1, 3), metres a step, corrected so that the lid keeps to the eyeball.

    before, after: neutral vertices (N, 3) and displacements (N, K - 1, 3) of the old and the new face. At
    every border a vertex gets as many radii from the eyeball's centre as on the old face, but for the
    difference of the neutral faces. Only depth is corrected, so that heights stay and lids meet.
    """
    eye = eyes.get(LID_FAPS[fap])
    moves = after[1]
    if eye is None:
        return moves
    steps = np.diff(borders.astype(np.float64))
    zero = int(np.flatnonzero(borders == 0)[0])
    old, new = (_positions_at_borders(*face, steps, zero) for face in (before, after))
    wanted = np.linalg.norm(old - eye.was.centre, axis=2) * eye.size
    arms = new - eye.centre
    depth = wanted**2 - arms[..., 0] ** 2 - arms[..., 1] ** 2
    forward = np.sqrt(np.maximum(depth, 0.0)) - arms[..., 2]
    near = eyeball_weight(eye, old.reshape(-1, 3)).reshape(old.shape[:2]).min(axis=1)
    # A vertex that ever leaves the front of the eyeball is not on a lid's edge.
    near *= ((arms[..., 2] > 0) & (depth > 0)).all(axis=1)
    forward = (forward - forward[:, [zero]]) * near[:, None]
    corrected = moves.copy()
    corrected[..., 2] += np.diff(forward, axis=1) / steps
    return corrected


def _positions_at_borders(vertices: Float64, moves: Float64, steps: Float64, zero: int) -> Float64:
    """Return (N, K, 3) position of each vertex at each border."""
    path = np.concatenate([np.zeros((len(vertices), 1, 3)), moves * steps[:, None]], axis=1).cumsum(axis=1)
    return np.asarray(vertices[:, None] + path - path[:, [zero]])
