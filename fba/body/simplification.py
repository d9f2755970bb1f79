"""Bodies with fewer triangles, which joints still move: simplified with their skin weights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fba.arrays import Float32, Int32
from fba.body._model import BodyModel, BodyPart
from fba.body.solve.solver import BapSolver
from fba.errors import ModelError
from fba.mesh.simplify import Level, carry_parts, part_looks, simplify
from fba.parameters import bap_numbers

BENT = {
    "l_elbow_flexion": 150000, "r_elbow_flexion": 150000, "l_knee_flexion": -150000,
    "r_knee_flexion": -150000, "l_hip_flexion": 120000, "r_hip_flexion": 120000,
    "l_shoulder_abduct": 120000, "r_shoulder_abduct": -120000,
}  # fmt: skip
"""BAPs of a pose in which the body is simplified besides the one in which it is modelled: limbs bent."""
WEIGHTS = 4
"""Joints that carry a vertex, at most."""


def simplify_body(body: BodyModel, faces: int) -> BodyModel:
    """Return a body with at most this number of triangles, as far as its borders and seams allow.

    Vertices stay where limbs bend, as the mesh is simplified with the limbs bent too; each takes its skin
    weights, normal, texture and colour from the nearest point of the surface that it stands for.

    ModelError for a part without triangles, for fewer triangles than parts, and for a body whose head FAPs
    move by tables of its own.
    """
    for part in body.parts:
        if not len(part.triangles):
            raise ModelError(f"part {part.name!r} has no triangles; leave it out before simplifying")
    if faces < len(body.parts):
        raise ModelError(
            f"{faces} triangles are too few for a body of {len(body.parts)} parts: each keeps one at least"
        )
    if body.own_head is not None:
        raise ModelError("this body's own head is moved by FAPs, which a simplified one could not follow")
    baps = np.zeros(296)
    for name, value in BENT.items():
        baps[bap_numbers()[name] - 1] = value
    poses = np.stack([body.vertices, body.skin(BapSolver(body.skeleton).pose(baps))]).astype(np.float64)
    made = simplify(poses, body.triangles, faces, looks=part_looks(body))
    level = made.level(faces)
    parts = []
    for part, rows, arrays in carry_parts(body, level):
        joints, weights = _carry_weights(part, level, rows, body.starts[part.name], len(body.skeleton))
        parts.append(replace(part, joints=joints, weights=weights, **arrays))
    return replace(body, parts=tuple(parts))


def _carry_weights(
    part: BodyPart, level: Level, rows: slice, start: int, count: int
) -> tuple[Int32, Float32]:
    """Return joints and weights, (M, `WEIGHTS`), of a part's vertices on a level."""
    every = np.zeros((rows.stop - rows.start, count))
    for k in range(3):
        near, share = level.rows[rows, k] - start, level.weights[rows, k]
        for column in range(part.joints.shape[1]):
            carried = share * part.weights[near, column]
            np.add.at(every, (np.arange(len(every)), part.joints[near, column]), carried)
    joints = np.argsort(-every, axis=1, kind="stable")[:, :WEIGHTS].astype(np.int32)
    weights = np.take_along_axis(every, joints, axis=1)
    return joints, (weights / weights.sum(axis=1, keepdims=True)).astype(np.float32)
