"""A walk reduced to its characteristic poses, and restored by interpolation.

The source (see `fba.body.gait`): "from all joint angles at each frame to four sets at symmetric times".
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.animation import Animation, BodyTrack
from fba.arrays import Float64, Int32
from fba.body._skeleton import Skeleton
from fba.body.gait._anatomy import body_values
from fba.body.gait._curves import Interpolation
from fba.body.gait._detection import Gait, detect
from fba.body.solve.solver import BapSolver, wrapped
from fba.parameters import baps

_STILL_CHANGE = 1e-6
"""Change of the entries of a joint's rotation matrix up to which it is still."""


@dataclass(frozen=True, eq=False)
class Reduced:
    """A motion reduced to key frames.

    keys: an `Animation` of the poses, at their times, and of the frames outside all steps. frames: number of
    frames from the first key to the last. walking: number of these in steps. poses: number of poses.
    """

    keys: Animation
    frames: int
    walking: int
    poses: int

    @property
    def factor(self) -> float:
        """Number of frames of walking for each pose."""
        return self.walking / self.poses

    def restore(self, interpolation: Interpolation = "smooth") -> Animation:
        """Return every frame from the first key to the last, interpolated between the keys.

        interpolation: "linear", as in the source, or "smooth": cubic curves, monotone where the keys are.
        ValueError for another.
        """
        index, values = self.keys.index, _unwrap(body_values(self.keys))
        frames = np.arange(int(index[0]), int(index[-1]) + 1)
        if interpolation == "linear":
            between = np.stack([np.interp(frames, index, column) for column in values.T], axis=1)
        elif interpolation == "smooth":
            from scipy.interpolate import PchipInterpolator

            between = PchipInterpolator(index - index[0], values)(frames - index[0])
        else:
            raise ValueError(f"interpolation must be linear or smooth, not {interpolation!r}")
        assert self.keys.body is not None
        before = np.searchsorted(index, frames, side="right") - 1
        track = BodyTrack(wrapped(np.rint(between)), self.keys.body.mask[before])
        return Animation(self.keys.rate, frames, None, track, self.keys.name)


@dataclass(frozen=True)
class Errors:
    """Differences between two motions.

    Degrees are of each joint's own rotation; centimetres of its position in the world and (local) relative to
    the root. worst_joint: the joint with the largest difference of rotation.
    """

    mean_degrees: float
    worst_degrees: float
    worst_joint: str
    mean_cm: float
    worst_cm: float
    mean_cm_local: float
    worst_cm_local: float


def reduce(animation: Animation, gait: Gait | None = None, skeleton: Skeleton | None = None) -> Reduced:
    """Return a motion reduced to the poses of its gait, by default `detect`'s; ValueError without steps."""
    gait = detect(animation, skeleton) if gait is None else gait
    keys = gait.keys
    if not keys:
        raise ValueError("gait: this motion cannot be reduced, because no steps were found in it")
    span = np.zeros(len(animation), dtype=bool)
    span[keys[0] : keys[-1] + 1] = True
    keep = span & ~gait.walking
    keep[list(keys)] = True
    rows = np.flatnonzero(keep)
    assert animation.body is not None
    track = BodyTrack(animation.body.values[rows], animation.body.mask[rows])
    keyed = Animation(animation.rate, animation.index[rows], None, track, animation.name)
    return Reduced(keyed, int(span.sum()), int((span & gait.walking).sum()), len(keys))


def compare_walks(animation: Animation, other: Animation, skeleton: Skeleton | None = None) -> Errors:
    """Return the differences of two bodies in their common frames, over the joints that turn in the first.

    ValueError where the rates differ, or they have no frame in common.
    """
    if animation.rate != other.rate:
        raise ValueError(f"compare: frame rates differ: {animation.rate} and {other.rate}")
    skeleton = Skeleton.default() if skeleton is None else skeleton
    _, first, second = np.intersect1d(animation.index, other.index, return_indices=True)
    if not len(first):
        raise ValueError("compare: the animations have no frame in common")
    solver = BapSolver(skeleton)
    a, b = solver.pose(body_values(animation)[first]), solver.pose(body_values(other)[second])
    offsets = a[:, :, :3, 3] - b[:, :, :3, 3]
    local = offsets - offsets[:, :1]
    turns = _local_rotations(a, skeleton)
    moved = np.flatnonzero(np.ptp(turns, axis=0).max(axis=(1, 2)) > _STILL_CHANGE)
    if not len(moved):
        moved = np.arange(len(skeleton))
    angles = np.degrees(_angles_between(turns, _local_rotations(b, skeleton)))[:, moved]
    far, near = (100.0 * np.linalg.norm(p[:, moved], axis=-1) for p in (offsets, local))
    return Errors(
        float(angles.mean()), float(angles.max()), skeleton.names[moved[int(angles.max(axis=0).argmax())]],
        float(far.mean()), float(far.max()), float(near.mean()), float(near.max()),
    )  # fmt: skip


def _unwrap(values: Int32) -> Float64:
    """Return float64 (T, 296): BAPs with whole turns between successive angles removed."""
    result = values.astype(np.float64)
    angles = [bap.number - 1 for bap in baps() if bap.unit == "1e-5 rad"]
    result[:, angles] = np.unwrap(result[:, angles], axis=0, period=2e5 * np.pi)
    return result


def _local_rotations(matrices: Float64, skeleton: Skeleton) -> Float64:
    """Return (T, J, 3, 3) rotation of each joint relative to its parent."""
    turns = matrices[:, :, :3, :3]
    result = turns.copy()
    result[:, 1:] = np.swapaxes(turns[:, skeleton.parents[1:]], -1, -2) @ turns[:, 1:]
    return result


def _angles_between(a: Float64, b: Float64) -> Float64:
    """Return the angles between rotations, radians, from their chords, which stay accurate near 0."""
    chord = np.linalg.norm(a - b, axis=(-2, -1)) / np.sqrt(8.0)
    return np.asarray(2.0 * np.arcsin(np.clip(chord, 0.0, 1.0)))
