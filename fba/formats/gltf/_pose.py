"""Poses of a glTF skeleton: the bind pose of its skin, and its animation sampled over time."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import permutations, product

import numpy as np

from fba import geometry, rotations
from fba.arrays import Float64
from fba.errors import ModelError
from fba.gltf import Channel, Gltf

MAX_DISAGREEMENT = 0.05
"""Largest median angle, in radians, between joints' turns of the bind pose in the scene."""


@dataclass(frozen=True, eq=False)
class BindPose:
    """Joints in the bind pose, in the scene's frame.

    rotations: float64 (J, 3, 3). positions: float64 (J, 3). parents: position of each joint's parent, -1 for
    a root.
    """

    rotations: Float64
    positions: Float64
    parents: Sequence[int]

    def offsets(self) -> Float64:
        """Return float64 (J, 3): positions relative to the parent in the bind pose; absolute for roots."""
        result = self.positions.copy()
        for number, parent in enumerate(self.parents):
            if parent >= 0:
                result[number] -= self.positions[parent]
        return result

    def turned(self, number: int, linear: Float64) -> Float64:
        """Return quaternions (T, 4), w first, from the bind pose to world rotations (T, 3, 3) of a joint."""
        return rotations.quaternions(nearest_rotation(linear) @ self.rotations[number].T)


def find_bind_pose(
    gltf: Gltf, nodes: Sequence[int], parents: Sequence[int], *, skins: bool = True
) -> BindPose:
    """Return the bind pose of joints. A joint without a skin keeps its node's transform under its parent.

    nodes: of the joints, parents first. parents: position of each joint's parent in nodes, -1 for a root.
    skins: False for the pose of the nodes themselves.
    """
    inverse: dict[int, Float64] = {}
    inside = set(nodes)
    for skin in gltf.skins if skins else ():
        for joint, matrix in zip(skin.joints, skin.inverse_bind, strict=True):
            if joint in inside:
                inverse.setdefault(joint, np.asarray(matrix, dtype=np.float64))
    bound = {joint: _invert(gltf, joint, matrix) for joint, matrix in inverse.items()}
    if bound and np.ptp([matrix[:3, 3] for matrix in bound.values()], axis=0).max() <= 0:
        bound = {}  # without inverse bind matrices, the bind pose is unknown
    turn, size = _to_scene(gltf, bound)
    turns, positions = np.zeros((len(nodes), 3, 3)), np.zeros((len(nodes), 3))
    for number, node in enumerate(nodes):
        parent = parents[number]
        if node in bound:
            turns[number] = turn @ nearest_rotation(bound[node][:3, :3])
            positions[number] = size * (turn @ bound[node][:3, 3])
        elif parent < 0:
            world = gltf.nodes[node].world
            turns[number] = nearest_rotation(world[:3, :3])
            positions[number] = world[:3, 3]
        else:
            local, above = gltf.nodes[node].local, gltf.nodes[nodes[parent]].world
            scale = float(np.cbrt(abs(np.linalg.det(above[:3, :3]))))
            turns[number] = turns[parent] @ nearest_rotation(local[:3, :3])
            positions[number] = positions[parent] + scale * (turns[parent] @ local[:3, 3])
    return BindPose(turns, positions, parents)


def bind_matrices(gltf: Gltf, *, skins: bool = True) -> dict[int, Float64]:
    """Return the matrix (4, 4) to the scene of each joint of a skin, as `find_bind_pose` places it.

    skins: False for the pose of the nodes themselves.
    """
    bound: dict[int, Float64] = {}
    for skin in gltf.skins:
        for joint, matrix in zip(skin.joints, skin.inverse_bind, strict=True):
            if joint not in bound:
                bound[joint] = _invert(gltf, joint, np.asarray(matrix, dtype=np.float64))
    if not skins or (bound and np.ptp([matrix[:3, 3] for matrix in bound.values()], axis=0).max() <= 0):
        return {joint: gltf.nodes[joint].world for joint in bound}
    turn, size = _to_scene(gltf, bound)
    scene = np.eye(4)
    scene[:3, :3] = size * turn
    return {joint: scene @ matrix for joint, matrix in bound.items()}


class Sampler:
    """Local transforms of nodes at given times (T,), seconds."""

    def __init__(self, gltf: Gltf, channels: Sequence[Channel], times: Float64) -> None:
        self._gltf, self._times = gltf, times
        self._channels = {(channel.node, channel.path): _cut(channel, times) for channel in channels}

    def __len__(self) -> int:
        return len(self._times)

    def translation(self, node: int) -> Float64:
        """Return a node's translations, float64 (T, 3)."""
        channel = self._channels.get((node, "translation"))
        if channel is not None:
            return sample(channel, self._times)
        return np.broadcast_to(self._gltf.nodes[node].local[:3, 3], (len(self._times), 3))

    def linear(self, node: int) -> Float64:
        """Return a node's rotations times scales, float64 (T, 3, 3)."""
        posed = self._gltf.nodes[node]
        turn, scale = (self._channels.get((node, path)) for path in ("rotation", "scale"))
        if turn is None and scale is None:
            return np.broadcast_to(posed.local[:3, :3], (len(self._times), 3, 3))
        if posed.rotation is None or posed.scale is None:  # a matrix, of which no part can be animated
            lengths = np.linalg.norm(posed.local[:3, :3], axis=0)
            matrix = nearest_rotation(posed.local[:3, :3])
        else:
            lengths, matrix = posed.scale, rotations.matrices(np.roll(posed.rotation, 1))
        if turn is None:
            matrices = np.broadcast_to(matrix, (len(self._times), 3, 3))
        else:
            matrices = rotations.matrices(np.roll(sample(turn, self._times), 1, axis=-1))
        sizes = lengths if scale is None else sample(scale, self._times)[:, None, :]
        result: Float64 = matrices * sizes
        return result


def _cut(channel: Channel, times: Float64) -> Channel:
    """Return a channel with the keys that matter at times (T,), and two more on each side."""
    if not len(times):
        return channel
    # as float32, so that NumPy does not convert all keys
    low, high = np.searchsorted(channel.times, np.array([times[0], times[-1]], dtype=np.float32)).tolist()
    rows = slice(max(low - 2, 0), high + 3)
    return replace(channel, times=channel.times[rows], values=channel.values[rows])


def key_times(channels: Sequence[Channel]) -> Float64:
    """Return the times of all keys, increasing. ModelError without keys."""
    times = [np.asarray(channel.times, dtype=np.float64) for channel in channels if len(channel.times)]
    if not times:
        raise ModelError("the animation has no keys")
    return np.unique(np.concatenate(times))


def sample(channel: Channel, times: Float64) -> Float64:
    """Return values (T, width) of a channel at times (T,); constant before and after its keys."""
    keys = np.asarray(channel.times, dtype=np.float64)
    values = np.asarray(channel.values, dtype=np.float64)
    turns = channel.path == "rotation"
    after = np.clip(np.searchsorted(keys, times, side="right"), 1, max(1, len(keys) - 1))
    before = after - 1
    after = np.minimum(after, len(keys) - 1)
    gap = np.maximum(keys[after] - keys[before], 1e-12)
    share = np.clip((times - keys[before]) / gap, 0.0, 1.0)
    if channel.interpolation == "CUBICSPLINE":
        s, d = share[:, None], gap[:, None]
        result = (
            (2 * s**3 - 3 * s**2 + 1) * values[before, 1]
            + (s**3 - 2 * s**2 + s) * d * values[before, 2]
            + (3 * s**2 - 2 * s**3) * values[after, 1]
            + (s**3 - s**2) * d * values[after, 0]
        )
    elif channel.interpolation == "STEP":
        result = np.where((share >= 1.0)[:, None], values[after], values[before])
    elif turns:
        unit = _normalize(values)
        return rotations.interpolate(unit[:, None, :], before, after, share)[:, 0]
    else:
        result = values[before] * (1 - share[:, None]) + values[after] * share[:, None]
    return _normalize(result) if turns else result


def nearest_rotation(matrices: Float64) -> Float64:
    """Return the rotations (..., 3, 3) closest to matrices; ModelError for a singular matrix."""
    if (np.linalg.cond(matrices) >= 1e9).any():
        raise ModelError("a joint has a scale of 0, so its rotation is unknown")
    return geometry.nearest_rotation(matrices)


def _normalize(values: Float64) -> Float64:
    """Return unit quaternions; ModelError for one of length 0."""
    length = np.linalg.norm(values, axis=-1, keepdims=True)
    if (length < 1e-6).any():
        raise ModelError("an animation has a rotation quaternion of length 0; expected length 1")
    result: Float64 = values / length
    return result


def _invert(gltf: Gltf, joint: int, matrix: Float64) -> Float64:
    """Return the inverse (4, 4) of an inverse bind matrix; ModelError if it has none."""
    result = np.full((4, 4), np.nan)
    with np.errstate(all="ignore"), suppress(np.linalg.LinAlgError):
        result[:] = np.linalg.inv(matrix)
    if not np.isfinite(result).all():
        raise ModelError(f"{gltf.file}: the inverse bind matrix of {gltf.nodes[joint].name!r} has no inverse")
    return result


def _to_scene(gltf: Gltf, bound: dict[int, Float64]) -> tuple[Float64, float]:
    """Return rotation (3, 3) and scale from the frame in which the skin was bound to that of the scene.

    bound: joint -> its matrix (4, 4) in the bind pose. If the nodes are in the bind pose, the rotation is
    exact. Otherwise it is taken to be the turn between axes, of which there are 24, that is closest to the
    first joint's.
    """
    if not bound:
        return np.eye(3), 1.0
    turns, sizes = [], []
    for joint, matrix in bound.items():
        both = gltf.nodes[joint].world[:3, :3] @ np.linalg.inv(matrix[:3, :3])
        turns.append(nearest_rotation(both))
        sizes.append(float(np.cbrt(abs(np.linalg.det(both)))))
    size = float(np.median(sizes))
    first = turns[0]
    differences = [np.arccos(np.clip((np.trace(first.T @ turn) - 1) / 2, -1, 1)) for turn in turns]
    if np.median(differences) < MAX_DISAGREEMENT:
        return first, size
    return max(_axis_turns(), key=lambda turn: float(np.trace(turn.T @ first))), size


def _axis_turns() -> list[Float64]:
    """Return the 24 rotations (3, 3) that map axes to axes."""
    result = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if np.linalg.det(matrix) > 0:
                result.append(matrix)
    return result
