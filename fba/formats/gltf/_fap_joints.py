"""Joints that FAPs turn and shift, such as eyes and head; FAPs from their motion."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass
from typing import Any

import numpy as np

from fba.arrays import Float64
from fba.face import HEAD, FaceModel
from fba.face.deform.flat_tables import KIND_ORDER, flatten_transforms
from fba.gltf import Value
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP

Steps = tuple[tuple[int, Float64], ...]

MAX_PERPENDICULAR = 1e-6
"""Largest cosine of two axes that count as perpendicular."""
MAX_COORDINATE = 1e6
"""Largest coordinate that a note may have."""


@dataclass(frozen=True, eq=False)
class FapJoint:
    """A node and the FAPs that move it, in the frame of its parent.

    position (3,), rest (3, 3): position and rotation when all FAPs are 0. turns: FAPs with their axes (3,)
    times radians per step, the outermost first; axes are perpendicular. shifts: FAPs with their metres per
    step (3,), linearly independent. read_faps: the FAPs that a reader takes from the motion of this joint.
    """

    node: int
    position: Float64
    rest: Float64
    turns: Steps
    shifts: Steps
    read_faps: frozenset[int] = frozenset()

    @classmethod
    def for_part(
        cls, model: FaceModel, part: str, node: int, frame: Float64, rest: Float64
    ) -> FapJoint | None:
        """Return the joint of a part or of `HEAD`; None if its motion does not determine the FAPs.

        frame: (4, 4), from the face's frame to that of the node's parent, scaled uniformly. rest: (4, 4),
        matrix of the node when all FAPs are 0.
        """
        flat = flatten_transforms(model)
        number = [*(part.name for part in model.parts), HEAD].index(part)
        turns, shifts = [], []
        turns_in_place = True
        rotation = frame[:3, :3] / np.cbrt(np.linalg.det(frame[:3, :3]))
        for row in range(int(flat.start[number]), int(flat.start[number + 1])):
            kind, fap = KIND_ORDER[flat.kind[row]], int(flat.column[row]) + 1
            if kind == "translation":
                shifts.append((fap, frame[:3, :3] @ flat.amount[row]))
                continue
            centre = frame[:3, :3] @ flat.centre[row] + frame[:3, 3]
            turns_in_place = turns_in_place and np.allclose(centre, rest[:3, 3], atol=1e-9)
            if kind == "rotation":
                turns.append((fap, rotation @ flat.amount[row]))
        if not turns_in_place:  # turning also shifts the node
            shifts = []
        joint = cls(node, rest[:3, 3], rest[:3, :3], tuple(turns), tuple(shifts))
        return joint if (turns or shifts) and joint._is_invertible() else None

    def _is_invertible(self) -> bool:
        """Return whether the motion determines every FAP."""
        faps = [fap for fap, _ in (*self.turns, *self.shifts)]
        if len(self.turns) > 3 or len(self.shifts) > 3 or len(set(faps)) != len(faps):
            return False
        axes = np.array([axis for _, axis in self.turns]).reshape(-1, 3)
        lengths = np.linalg.norm(axes, axis=1)
        if not (lengths > 1e-12).all():
            return False
        axes = axes / lengths[:, None]
        if np.abs(axes @ axes.T - np.eye(len(axes))).max(initial=0) > MAX_PERPENDICULAR:
            return False
        offsets = np.array([offset for _, offset in self.shifts]).reshape(-1, 3)
        return bool(not len(offsets) or np.linalg.matrix_rank(offsets) == len(offsets))

    def values(self, rotations: Float64, positions: Float64) -> dict[int, Float64]:
        """Return FAPs (T,) by number, from rotations (T, 3, 3) and positions (T, 3) of the node."""
        values: dict[int, Float64] = {}
        if self.turns:
            axes = np.array([axis for _, axis in self.turns])
            lengths = np.linalg.norm(axes, axis=1)
            angles = _angles(rotations @ self.rest.T, axes / lengths[:, None])
            for column, (fap, _) in enumerate(self.turns):
                values[fap] = angles[column] / lengths[column]
        if self.shifts:
            steps = (positions - self.position) @ np.linalg.pinv(
                np.array([offset for _, offset in self.shifts])
            )
            for column, (fap, _) in enumerate(self.shifts):
                values[fap] = steps[:, column]
        return values

    def to_note(self, faps: Set[int]) -> dict[str, Any]:
        """Return the joint as JSON. faps: those that a reader takes from its motion."""
        return {
            "node": self.node,
            "place": self.position.tolist(),
            "rest": self.rest.ravel().tolist(),
            "turns": [[fap, axis.tolist()] for fap, axis in self.turns],
            "shifts": [[fap, offset.tolist()] for fap, offset in self.shifts],
            "told": sorted(faps),
        }

    @classmethod
    def from_note(cls, note: Value, nodes: int) -> FapJoint:
        """Return the joint that a note describes; ModelError if it is invalid. nodes: number of nodes."""
        joint = cls(
            note.member("node").index(nodes, "node"),
            np.array(note.member("place").numbers(3, -MAX_COORDINATE, MAX_COORDINATE)),
            np.array(note.member("rest").numbers(9, -1.01, 1.01)).reshape(3, 3),
            _read_steps(note.member("turns")),
            _read_steps(note.member("shifts")),
            frozenset(
                entry.integer(FIRST_LOW_LEVEL_FAP, FAP_COUNT)
                for entry in note.member("told").elements(FAP_COUNT)
            ),
        )
        moving_faps = {fap for fap, _ in (*joint.turns, *joint.shifts)}
        if not (joint._is_invertible() and joint.read_faps <= moving_faps):
            raise note.error(
                "the motion of this joint does not determine its FAPs: up to three perpendicular axes "
                "and three independent shifts are expected, each of another FAP"
            )
        return joint


def _read_steps(note: Value) -> Steps:
    """Return the FAPs and axes in a note."""
    steps = []
    for entry in note.elements(3):
        pair = entry.elements(2)
        if len(pair) != 2:
            raise entry.error("expected a FAP and its axis")
        fap = pair[0].integer(FIRST_LOW_LEVEL_FAP, FAP_COUNT)
        steps.append((fap, np.array(pair[1].numbers(3, -MAX_COORDINATE, MAX_COORDINATE))))
    return tuple(steps)


def _angles(rotations: Float64, axes: Float64) -> Float64:
    """Return angles (3, T), in radians, about up to three perpendicular axes, the outermost first.

    With fewer axes, the last angles are 0. In the frame of the axes, each rotation is a product of turns
    about x, y and z.
    """
    base = np.eye(3)
    base[: len(axes)] = axes
    if len(axes) == 1:  # it is never parallel to the coordinate axis of its smallest component
        across = np.eye(3)[int(np.abs(axes[0]).argmin())]
        base[1] = np.cross(axes[0], across)
        base[1] /= np.linalg.norm(base[1])
    if len(axes) < 3:
        base[2] = np.cross(base[0], base[1])
    mirrored = float(np.sign(np.linalg.det(base)))
    base[2] *= mirrored
    r = base @ rotations @ base.T
    second = np.arctan2(r[:, 0, 2], np.hypot(r[:, 0, 0], r[:, 0, 1]))
    first = np.arctan2(-r[:, 1, 2], r[:, 2, 2])
    third = np.arctan2(-r[:, 0, 1], r[:, 0, 0])
    return np.stack([first, second, third * mirrored])
