"""Write avatar animation units: a face as ARKit's weights and the turn of the head, a body as its joints."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from fba.animation import Animation
from fba.arrays import Float64, Int64
from fba.atomic import atomic
from fba.capture import ShapeMotion, to_blendshapes
from fba.carriage.avatar_units import JOINTS, SHAPES, TICKS_MAX, write_configuration, write_units
from fba.errors import FormatError, Remedy
from fba.formats.avatar._container import (
    BODY_PROFILE,
    FACE_JOINTS,
    FACE_PROFILE,
    joint_names,
    joint_parents,
    resting_joints,
)
from fba.parameters import BAP_COUNT
from fba.source import Path, naming_file
from fba.tracks import BodyTrack, hold

EXACT_TICKS = 1 << 24
"""Ticks per second up to which float32 is exact."""


def write(path: Path, animation: Animation) -> None:
    """Write a face as ARKit's 52 weights, and a body as the matrices of the joints that move.

    Times are exact: the first frame of the animation is at its own time. Skipped frames have no units. Raises
    FormatError without frames, or for times that 32 bits do not hold.
    """
    if not len(animation):
        raise FormatError(
            "avatar animation units need a frame at least, and this animation has none", path=path
        )
    rate, index = animation.rate, np.asarray(animation.index, dtype=np.int64)
    ticks = index * rate.denominator
    if rate.numerator >= EXACT_TICKS or index[0] < 0 or index[-1] * rate.denominator > TICKS_MAX:
        raise FormatError(
            f"frame {index[-1]} at {rate} frames/s does not fit the 32 bits that units have for times",
            path=path,
        ).with_remedies(Remedy("rate", "resample first, e.g. with {}", "30", "Animation.resample"))
    units: list[list[bytes]] = []
    profiles = []
    with naming_file(path):
        shapes = None if animation.face is None else to_blendshapes(animation)
    if shapes is not None:
        profiles.append(FACE_PROFILE)
        units.append(write_units(SHAPES, ticks, shapes.weights))
    numbers, matrices = _joints(animation.body, shapes, len(index))
    if len(numbers):
        profiles.append(BODY_PROFILE)
        units.append(write_units(JOINTS, ticks, matrices, numbers))
    with atomic(path) as file:
        file.write(write_configuration(" ".join(profiles), float(rate.numerator)))
        for frame in zip(*units, strict=True):
            file.write(b"".join(frame))


def _joints(body: BodyTrack | None, shapes: ShapeMotion | None, frames: int) -> tuple[Int64, Float64]:
    """Return the numbers (N,) of joints that move, and their matrices (T, N, 4, 4) to their parents."""
    local = np.tile(np.eye(4), (frames, len(joint_names()), 1, 1))
    moved = np.zeros(len(joint_names()), dtype=bool)
    if body is not None:
        count = len(joint_names()) - len(FACE_JOINTS)
        resting = _to_parents(resting_joints()[None, :count])
        local[:, :count] = _to_parents(_pose(body))
        moved[:count] = np.abs(local[:, :count] - resting).max(axis=(0, 2, 3)) > 0
        moved[0] = True  # the root is where the body is
    if shapes is not None and shapes.head is not None and shapes.eyes is not None:
        turns = [
            ("YZX", shapes.head[:, [1, 2, 0]]),
            ("YX", shapes.eyes[:, ::2]),
            ("YX", shapes.eyes[:, 1::2]),
        ]
        for joint, (axes, angles) in enumerate(turns, len(joint_names()) - len(FACE_JOINTS)):
            local[:, joint, :3, :3] = Rotation.from_euler(axes, angles).as_matrix()
            moved[joint] = angles.any()
    return np.flatnonzero(moved), local[:, moved]


def _pose(body: BodyTrack) -> Float64:
    """Return the matrices (T, J, 4, 4) of the default body's joints to the world."""
    from fba.body import BapSolver

    return BapSolver().pose(hold(body.values, body.mask, np.zeros(BAP_COUNT, np.int32)))


def _to_parents(world: Float64) -> Float64:
    """Return matrices (T, J, 4, 4) of the default body's joints to their parents, of those to the world."""
    above = np.zeros_like(world)
    above[:, 0] = np.eye(4)
    above[:, 1:] = world[:, joint_parents()[1 : world.shape[1]]]
    local: Float64 = np.linalg.solve(above, world).astype(np.float64)
    return local
