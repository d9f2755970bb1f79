"""Measures how an average face differs from the built-in head.

python -m tools.photos.measure_average FACE.obj LANDMARKS.json

FACE.obj: an average of faces, looking along +z. LANDMARKS.json: a list of the numbers of 68 of its vertices,
in dlib's order, or an object with that list as `idx_to_landmark_verts`, as ICT FaceKit has it. Writes the
table of `fba/face/fitting/_measures.py`, from the built-in head as it is now.
"""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

import fba
from fba.arrays import Bool, Float64, Integer, Intp
from fba.capture.points.places import numbers_of, point_places
from fba.face import FaceModel
from fba.face.calibration._field import deformation
from fba.face.feature_points import names
from fba.face.fitting import FRONT_POINTS, SIDE_POINTS
from fba.face.fitting._measures import forms
from fba.geometry import fit_similarity
from fba.mesh import connected, read_obj, triangulate, vertex_normals
from fba.parameters import point_rows
from tools.photos.measure_surface import foremost

OUTPUT = Path(fba.__file__).parent / "face/fitting/average_forms.csv"
ROUNDS = ((0.012, 3e-4), (0.009, 1e-4), (0.0075, 3e-5), (0.006, 1e-5), (0.0054, 3e-6))
"""Of laying the head on the face: metres between the places that are drawn to it, and smoothing."""
REACH, AGREEING = 0.02, 0.6
"""Places are drawn to a surface so near, metres, whose normal agrees so much."""
BEHIND = 0.06
"""Metres behind the pupils where the face ends."""
EYES, LIPS = 0.012, (0.028, 0.006)
"""Metres around pupils and along and across the mouth's line from which nothing is drawn."""
ELSEWHERE = ("9.1", "9.2", "2.1")
"""Points of the nose's wings and under the chin: dlib's landmarks of these names lie elsewhere."""
COUNT = 32
"""Places of the table of forms, on the left side and in the middle."""
APART, FROM_PUPILS = 0.010, 0.018
"""Metres of these from feature points and from pupils, at least."""
DAMPING = 0.03


Surface = tuple[Float64, Integer]
"""Vertices (V, 3), metres, and triangles (F, 3)."""


def read_face(path: Path, landmarks: Path) -> tuple[Surface, Float64]:
    """Return the skin of an average face, and its landmarks (68, 3), in the file's units."""
    mesh = read_obj(path)
    content = json.loads(landmarks.read_text(encoding="utf-8"))
    marks = content["idx_to_landmark_verts"] if isinstance(content, dict) else content
    triangles = triangulate(mesh, np.ones(len(mesh), dtype=bool)).corners
    piece = connected(np.concatenate([triangles[:, :2], triangles[:, 1:]]), len(mesh.vertices))
    skin = np.isin(piece[triangles[:, 0]], piece[marks])
    return (mesh.vertices, triangles[skin]), mesh.vertices[marks]


def average_head(base: FaceModel, face: Surface, landmarks: Float64) -> Float64:
    """Return the skin of the built-in head (V, 3) laid on an average face, in the head's size and axes."""
    row, part = point_rows(), base.part("skin")
    places_of = {
        place: own for own, place in point_places(68).items() if place in row and place not in ELSEWHERE
    }
    known = {row[place]: numbers_of(own, 68) for place, own in places_of.items()}
    rows = list(known)
    marks = np.array([landmarks[list(numbers)].mean(axis=0) for numbers in known.values()])
    laid = fit_similarity(marks, base.points[rows])
    marks, vertices = laid.apply(marks), laid.apply(face[0])
    normals = vertex_normals(vertices, face[1]).astype(np.float64)
    places = np.concatenate([vertices[np.unique(face[1])], vertices[face[1]].mean(axis=1)])
    facing = np.concatenate([normals[np.unique(face[1])], normals[face[1]].mean(axis=1)])
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    tree, own = cKDTree(places), part.vertices.astype(np.float64)
    skin = _warped(own, base.points[rows], marks, 1e-6)
    for apart, smoothing in ROUNDS:
        drawn = spread(own, np.flatnonzero(_is_drawn(base, own)), apart)
        to = vertex_normals(skin, part.triangles)[drawn]
        distance, near = tree.query(skin[drawn], k=8)
        agreeing = np.einsum("nc,nkc->nk", to, facing[near])
        best = (distance - 0.02 * agreeing).argmin(axis=1)[:, None]
        near, distance, agreeing = (
            np.take_along_axis(one, best, 1)[:, 0] for one in (near, distance, agreeing)
        )
        off = ((skin[drawn] - places[near]) * facing[near]).sum(axis=1)
        good = (agreeing > AGREEING) & (distance < REACH)
        target = (skin[drawn] - off[:, None] * facing[near])[good]
        smooth = np.repeat([smoothing, 10 * smoothing], [len(target), len(marks)])
        sources = np.concatenate([own[drawn][good], base.points[rows]])
        skin = _warped(own, sources, np.concatenate([target, marks]), smooth)
    near = tree.query(skin)[1]
    return skin - ((skin - places[near]) * facing[near]).sum(axis=1)[:, None] * facing[near]


def _warped(points: Float64, sources: Float64, targets: Float64, smoothing: float | Float64) -> Float64:
    field = RBFInterpolator(sources, targets - sources, kernel="linear", degree=1, smoothing=smoothing)
    return np.asarray(points + field(points))


def _is_drawn(base: FaceModel, skin: Float64) -> Bool:
    """Return (V,), which of a head's skin is laid on another: the face, but no eyes and lips."""
    row = point_rows()
    chin, mouth = base.points[row["2.1"], 1], base.points[row["2.2"], 1]
    eyes = base.points[[row["3.5"], row["3.6"]]]
    result = (skin[:, 2] > eyes[0, 2] - BEHIND) & (skin[:, 1] > chin - 0.04)
    result &= np.linalg.norm(skin[:, None] - eyes, axis=2).min(axis=1) > EYES
    return result & ~((np.abs(skin[:, 0]) < LIPS[0]) & (np.abs(skin[:, 1] - mouth) < LIPS[1]))


def spread(points: Float64, rows: Intp, apart: float, count: int | None = None) -> Intp:
    """Return some rows of points (N, 3): each the furthest from those before, none nearer than `apart`."""
    chosen = [int(rows[points[rows, 2].argmax()])]
    distance = np.full(len(rows), np.inf)
    while len(chosen) != count:
        distance = np.minimum(distance, np.linalg.norm(points[rows] - points[chosen[-1]], axis=1))
        if distance.max() < apart:
            break
        chosen.append(int(rows[distance.argmax()]))
    return np.array(chosen)


def form_shifts(base: FaceModel, skin: Float64) -> tuple[Float64, Float64]:
    """Return places (K, 3) of the built-in head, on the left and in the middle, and metres (K,) outwards.

    By so much an average face is fuller than the head deformed to its feature points.
    """
    row, part = point_rows(), base.part("skin")
    own = part.vertices.astype(np.float64)
    bound = base.bound - base.starts["skin"]
    on_face = np.isin(names(), FRONT_POINTS + SIDE_POINTS) & (bound >= 0) & (bound < len(skin))
    rows = np.flatnonzero(on_face & (base.points[:, 2] > base.points[row["3.5"], 2] - BEHIND))
    given, targets = base.points[rows], skin[bound[rows]]
    laid = fit_similarity(targets, given)
    bent = deformation(given, laid.apply(targets), own, "multiquadric", 1.0)(own)
    normals = vertex_normals(own, part.triangles).astype(np.float64)
    out = ((laid.apply(skin) - bent) * normals).sum(axis=1)
    out = (out + out[cKDTree(own).query(own * (-1, 1, 1))[1]]) / 2
    eyes, chin = base.points[[row["3.5"], row["3.6"]]], base.points[row["2.1"], 1]
    face = (own[:, 1] < eyes[0, 1] + 0.06) & (own[:, 1] > chin) & (own[:, 2] > eyes[0, 2] - BEHIND)
    face &= (np.abs(own[:, 0]) < 0.07) & (normals[:, 2] > 0) & foremost(own)
    from_eyes = np.linalg.norm(own[:, None, :2] - eyes[:, :2], axis=2).min(axis=1)
    free = face & (own[:, 0] >= -1e-4) & (cKDTree(given).query(own)[0] > APART) & (from_eyes > FROM_PUPILS)
    places = np.round(own[spread(own, np.flatnonzero(free), 0.0, COUNT)], 3)
    corners = own[part.triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    weight = np.sqrt(np.bincount(part.triangles.ravel(), np.repeat(areas, 3), len(own)) * (from_eyes > 0.016))
    weight = (weight / np.linalg.norm(weight[face]))[face]
    known = forms(base.points, places, own[face]) * weight[:, None]
    damped = np.concatenate([known, DAMPING / np.sqrt(COUNT) * np.eye(COUNT)])
    return places, np.linalg.lstsq(damped, np.append(out[face] * weight, np.zeros(COUNT)), rcond=None)[0]


def main(path: str, landmarks: str) -> None:
    base = FaceModel.default()
    places, out = form_shifts(base, average_head(base, *read_face(Path(path), Path(landmarks))))
    with OUTPUT.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["x", "y", "z", "out"])
        for place, up in zip(1000 * places, 1000 * out, strict=True):
            table.writerow([*(f"{value:.0f}" for value in place), f"{up:.1f}"])


if __name__ == "__main__":
    main(*sys.argv[1:])
