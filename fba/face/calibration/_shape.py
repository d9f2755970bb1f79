"""Deforms the parts of a face: skin smoothly, eyeballs and teeth rigidly but for their size."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from fba.arrays import Bool, Float64, Floating
from fba.face.calibration._align import known_rows
from fba.face.calibration._eyes import REACH, FittedEye, fit_eye, lay_lids_on
from fba.face.calibration._field import Field, bump_field
from fba.face.eyeball import LID_POINTS, PUPIL_POINT, eyeballs
from fba.face.feature_points import FREE_POINTS, names
from fba.geometry import Similarity, fit_similarity
from fba.mesh import vertex_normals
from fba.parameters import point_rows
from fba.rotations import apply, between_all

if TYPE_CHECKING:
    from fba.face.model import FaceModel, Part


TEETH = {"upper": ("9.10", "9.8"), "lower": ("9.11", "9.9")}
"""Points of each jaw: the edge of the teeth first, then the gums."""
TONGUE = ("6.1", "6.2", "6.3", "6.4")
INNER = ("3.5", "3.6", *TEETH["upper"], *TEETH["lower"], *TONGUE, *FREE_POINTS)
"""Points on rigid parts, inside the mouth or on no surface: they do not deform the skin."""
ON_LIDS = ("lash", "brow", "hair", "other")
"""Kinds of parts that move with the skin under them."""
LIPS = ("2.2", "2.3", "2.4", "2.5", "2.6", "2.7", "2.8", "2.9")
SNAP_DISTANCE = 2e-5
"""Metres: vertices this close to a target are moved onto it; the difference is invisible."""
BEHIND_LIPS_DISTANCE = 0.005
"""Teeth within this many metres of a point of the lips, in x and y, are behind it."""
TONGUE_WIDTH = 0.012
"""A given point moves the tongue within about this many metres."""


Map = Callable[[Floating], Float64]
"""A function from points (N, 3) to where they move, (N, 3)."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A deformed face: vertices by part name, feature points (84, 3), and the eyes by side.

    rotations: by part name, (V, 3, 3), rotation of the deformation at each vertex of parts not rigid.
    """

    vertices: Mapping[str, Float64]
    points: Float64
    eyes: Mapping[str, FittedEye]
    rotations: Mapping[str, Float64]


def deform(model: FaceModel, field: Field, targets: Float64, given: Bool, iris: tuple[float, float]) -> Shape:
    """Return all parts and feature points of a model after a deformation.

    targets: (84, 3), required positions of the feature points in metres, NaN where the field gives them.
    given: (84,), mask of the points that are reliable in the person's data. iris: its diameter before and
    after, metres.
    """
    row = point_rows()
    vertices = {part.name: field(part.vertices) for part in model.parts}
    fixed = _surface_points(model, targets)
    eyes: dict[str, FittedEye] = {}
    lids = {side: [row[name] for name in pair if given[row[name]]] for side, pair in LID_POINTS.items()}
    skin = [part for part in model.parts if part.kind in ("skin", "mouth")]
    joined = np.concatenate([part.vertices for part in skin]).astype(np.float64) if skin else np.zeros((0, 3))
    moved = np.concatenate([vertices[part.name] for part in skin]) if skin else joined
    plain = moved
    for side, eye in eyeballs(model).items():
        pupil = model.points[row[PUPIL_POINT[side]]]
        if np.isnan(pupil).any():
            pupil = eye.centre + np.array([0.0, 0.0, eye.radius])
        wanted = targets[row[PUPIL_POINT[side]]]
        wanted = field(pupil[None])[0] if np.isnan(wanted).any() else wanted
        around = float(fit_size(model.part(eye.part).vertices, vertices[eye.part]).scale)
        eyes[side] = fit_eye(
            eye,
            (joined, moved),
            (pupil, wanted),
            size=around,
            pupil_given=bool(given[row[PUPIL_POINT[side]]]),
            iris=iris,
            given=(model.points[lids[side]], targets[lids[side]]),
        )
        moved = lay_lids_on(eyes[side], joined, moved, *fixed)
    start = 0
    for part in skin:
        vertices[part.name] = moved[start : start + len(part.vertices)]
        start += len(part.vertices)
    for part in model.of_kind("eye"):
        if eyes:
            middle = part.vertices.mean(axis=0)
            nearest = min(eyes.values(), key=lambda eye: float(np.linalg.norm(eye.was.centre - middle)))
            vertices[part.name] = nearest(part.vertices)
    for part in model.parts:
        if part.kind in ON_LIDS and eyes and len(joined):
            vertices[part.name] += _lid_shift_at(part.vertices, joined, moved - plain, eyes)
    _snap_to_points(model, vertices, targets)
    teeth, tongue = _fit_teeth_and_tongue(model, field, targets, given)
    for part in model.of_kind("teeth"):
        vertices[part.name] = teeth[_jaw(model, part)].apply(part.vertices)
    for part in model.of_kind("tongue"):
        vertices[part.name] = tongue(part.vertices)
    points = _points(model, vertices, field, targets, teeth, tongue)
    soft = [part for part in model.parts if part.kind not in ("eye", "teeth", "tongue")]
    rotations = {part.name: field.rotations(part.vertices) for part in soft} if model.tables else {}
    return Shape(vertices, points, eyes, rotations)


def _snap_to_points(model: FaceModel, vertices: dict[str, Float64], targets: Float64) -> None:
    """Move vertices of feature points that are within SNAP_DISTANCE of their target onto it, in place.

    Points that nearly coincide, such as those of two lips, share one source point of the deformation.
    """
    for row in np.flatnonzero(known_rows(targets) & (model.bound >= 0)):
        for part in model.parts:
            own = int(model.bound[row]) - model.starts[part.name]
            if part.kind not in ("skin", "mouth") or not 0 <= own < len(part.vertices):
                continue
            if np.linalg.norm(vertices[part.name][own] - targets[row]) < SNAP_DISTANCE:
                vertices[part.name][own] = targets[row]


def _surface_points(model: FaceModel, targets: Float64) -> tuple[Float64, Float64]:
    """Return ((K, 3), (K, 3)): the known points on the surface before, and their targets."""
    outer = np.array([name not in INNER for name in names()])
    known = known_rows(targets, model.points) & outer
    return model.points[known], targets[known]


def fit_size(before: Floating, after: Float64) -> Similarity:
    """Return the scale and shift that bring vertices (N, 3) closest to those after; they are not turned."""
    fit = fit_similarity(before, after, rotation=np.eye(3))
    scale = fit.scale if np.isfinite(fit.scale) else np.asarray(1.0)
    return Similarity(fit.rotation, scale, fit.centre, fit.target)


def _fit_teeth_and_tongue(
    model: FaceModel, field: Field, targets: Float64, given: Bool
) -> tuple[dict[str, Similarity], Map]:
    """Return (map of the teeth by jaw, map of the tongue)."""
    row = point_rows()
    teeth = [part.vertices for part in model.of_kind("teeth")]
    inside = teeth or [part.vertices for part in model.of_kind("tongue")] or [model.vertices]
    vertices = np.concatenate(inside).astype(np.float64)
    both = fit_size(vertices, field(vertices))
    both = _behind_lips(model, field, both) if teeth else both
    jaws = {}
    for jaw, (edge, gum) in TEETH.items():
        jaws[jaw] = both
        here, there = model.points[[row[edge], row[gum]]], targets[[row[edge], row[gum]]]
        if np.isfinite(here[0]).all() and np.isfinite(there[0]).all() and given[row[edge]]:
            size = float(both.scale)
            if given[row[gum]] and np.isfinite(here).all() and np.isfinite(there).all():
                height = float(np.linalg.norm(there[1] - there[0]) / np.linalg.norm(here[1] - here[0]))
                size = height if 0.7 * size < height < 1.4 * size else size
            jaws[jaw] = Similarity(both.rotation, np.asarray(size), here[0], there[0])
    wanted = [row[name] for name in TONGUE if given[row[name]] and np.isfinite(model.points[row[name]]).all()]
    return jaws, _fit_tongue(jaws["lower"], model.points[wanted], targets[wanted])


def _behind_lips(model: FaceModel, field: Field, teeth: Similarity) -> Similarity:
    """Return the map of the teeth, shifted back so that they are as far behind the inner lips as before."""
    known = [row for row in (point_rows()[name] for name in LIPS) if np.isfinite(model.points[row]).all()]
    vertices = np.concatenate([part.vertices for part in model.of_kind("teeth")]).astype(np.float64)
    lips, moved = field(model.points[known]), teeth.apply(vertices)
    back = 0.0
    for before, after in zip(model.points[known], lips, strict=True):
        room = before[2] - _foremost_z(vertices, before)
        wanted = after[2] - teeth.scale * room
        if np.isfinite(room):
            back = max(back, _foremost_z(moved, after) - wanted)
    return replace(teeth, target=teeth.target - (0.0, 0.0, max(back, 0.0)))


def _foremost_z(points: Float64, point: Float64) -> float:
    """Return the greatest z of points (N, 3) right behind or before a point; -inf without such points."""
    near = np.hypot(points[:, 0] - point[0], points[:, 1] - point[1]) < BEHIND_LIPS_DISTANCE
    return float(points[near, 2].max()) if near.any() else -np.inf


def _fit_tongue(base: Similarity, here: Float64, there: Float64) -> Map:
    """Return the map of the tongue: as the lower teeth (`base`), but given points go to their targets."""
    if not len(here):
        return base.apply
    rest = bump_field(here, there - base.apply(here), TONGUE_WIDTH)
    return lambda points: base.apply(points) + rest(np.asarray(points, dtype=np.float64))


def _jaw(model: FaceModel, part: Part) -> str:
    """Return the jaw of a part of the teeth, "upper" or "lower": above or below the line where they meet."""
    edges = model.points[[point_rows()["9.10"], point_rows()["9.11"]], 1]
    heights = [float(one.vertices[:, 1].mean()) for one in model.of_kind("teeth")]
    boundary = float(edges.mean()) if np.isfinite(edges).all() else float(np.mean(heights))
    return "upper" if float(part.vertices[:, 1].mean()) >= boundary else "lower"


def _lid_shift_at(
    vertices: Floating, skin: Float64, shift: Float64, eyes: Mapping[str, FittedEye]
) -> Float64:
    """Return (V, 3) shift of the nearby skin by `lay_lids_on`, for parts that stand on the skin."""
    from scipy.spatial import cKDTree

    near = np.zeros(len(skin), dtype=bool)
    for eye in eyes.values():
        near |= np.linalg.norm(skin - eye.was.centre, axis=1) < 1.2 * REACH * eye.was.radius
    if near.sum() < 4:
        return np.zeros(np.shape(vertices))
    distance, nearest = cKDTree(skin[near]).query(vertices, k=4)
    weight = 1.0 / np.maximum(distance, 1e-6)
    weight /= weight.sum(axis=1, keepdims=True)
    return np.asarray((shift[near][nearest] * weight[..., None]).sum(axis=1))


def _points(
    model: FaceModel,
    vertices: Mapping[str, Float64],
    field: Field,
    targets: Float64,
    teeth: Mapping[str, Similarity],
    tongue: Map,
) -> Float64:
    """Return (84, 3) feature points after the deformation: bound ones at their vertices, others as given."""
    points = field(np.nan_to_num(model.points))
    for jaw, group in TEETH.items():
        for name in group:
            points[point_rows()[name]] = teeth[jaw].apply(model.points[point_rows()[name]][None])[0]
    for name in TONGUE:
        points[point_rows()[name]] = tongue(model.points[point_rows()[name]][None])[0]
    known = known_rows(targets)
    free = [point_rows()[name] for name in FREE_POINTS]
    points[free] = np.where(known[free, None], targets[free], points[free])
    joined = np.concatenate([vertices[part.name].astype(np.float32) for part in model.parts])
    bound = model.bound >= 0
    points[bound] = joined[model.bound[bound]]
    loose = ~bound & known & np.array([name not in INNER for name in names()])
    points[loose] = targets[loose]
    points[np.isnan(model.points).any(axis=1)] = np.nan
    return points


def rebuild_part(part: Part, vertices: Float64) -> Part:
    """Return the part with other vertices, its normals turned with the surface to keep seams invisible."""
    before, after = (
        vertex_normals(corners, part.triangles).astype(np.float64) for corners in (part.vertices, vertices)
    )
    normals = apply(between_all(before, after), np.asarray(part.normals, dtype=np.float64))
    return replace(part, vertices=vertices.astype(np.float32), normals=normals.astype(np.float32))
