"""`SkeletonMotion`: captured motion of a skeleton from a file of any format."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from typing import ClassVar

import numpy as np

from fba import rotations
from fba.arrays import Float64, Int64, Intp
from fba.choices import FileUpAxis
from fba.errors import ModelError
from fba.limits import DEFAULT_LIMITS, Limits
from fba.tracks import FaceTrack, freeze

SAMPLE_FRAMES = 400
"""Number of frames, spread evenly, that are examined in place of a whole motion."""
FRAME_BYTES = 2400
"""Memory, in bytes, that retargeting takes for each frame."""
JOINT_BYTES = 130
"""Memory, in bytes, that retargeting takes for each joint of the source in a frame."""


@dataclass(frozen=True, eq=False)
class SkeletonMotion:
    """Motion of joints, in the units and the coordinate frame of the source.

    names: J joint names. parents: int64 (J,), -1 for the root, which comes first; parents come before
    children. offsets: float64 (J, 3), from the parent, in the rest pose (all rotations identity). rotations:
    float64 (T, J, 4), unit quaternions (w, x, y, z) relative to the parent. positions: float64 (T, 3), of the
    root. rate: frames per second. end_parents: int64 (E,), end_offsets: float64 (E, 3): ends of the last
    bones, where known. name: of the performance.

    declared: joint name -> joint of the standard, where the file itself says which bone is which; empty where
    names must tell. axes: float64 (J, 4), quaternions of the joints' own axes in the rest pose, in the frame
    of the source; empty for the axes of the frame. posed: whether the rest pose may be any pose, since the
    source does not say which it is. up: the axis that the format says is up, such as "+y"; empty where it
    says nothing. face: returns the FAPs of the same person at times (F,), seconds from the first frame, or
    None if the face does not move; None where the source has no face.

    Raises ModelError if the parts contradict each other or are not finite.
    """

    MAX_FRAMES: ClassVar = 500_000
    """Frames of the longest motion: more than an hour at 120 frames/s."""

    names: tuple[str, ...]
    parents: Int64
    offsets: Float64
    rotations: Float64
    positions: Float64
    rate: Fraction
    end_parents: Int64 = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    end_offsets: Float64 = field(default_factory=lambda: np.zeros((0, 3)))
    name: str = ""
    declared: Mapping[str, str] = field(default_factory=dict)
    axes: Float64 = field(default_factory=lambda: np.zeros((0, 4)))
    posed: bool = False
    up: FileUpAxis = ""
    face: Callable[[Float64], FaceTrack | None] | None = None

    def __post_init__(self) -> None:
        count = len(self.names)
        freeze(self, declared=dict(self.declared), rate=Fraction(self.rate))
        if not np.size(self.axes):
            freeze(self, axes=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)))
        frames, ends = len(self.positions), len(self.end_parents)
        for what, kind, shape in (
            ("parents", np.int64, (count,)),
            ("offsets", np.float64, (count, 3)),
            ("rotations", np.float64, (frames, count, 4)),
            ("positions", np.float64, (frames, 3)),
            ("end_parents", np.int64, (ends,)),
            ("end_offsets", np.float64, (ends, 3)),
            ("axes", np.float64, (count, 4)),
        ):
            array = np.array(getattr(self, what), dtype=kind)
            if not np.isfinite(array).all():
                raise ModelError(f"SkeletonMotion: {what} must be finite")
            if array.shape != shape:
                raise ModelError(f"SkeletonMotion: {what} has shape {array.shape}, not {shape}")
            freeze(self, **{what: array})
        if count == 0 or self.rate <= 0:
            raise ModelError("SkeletonMotion: needs a joint at least, and a positive rate")
        numbers = np.arange(count)
        if self.parents[0] != -1 or ((self.parents[1:] < 0) | (self.parents[1:] >= numbers[1:])).any():
            raise ModelError("SkeletonMotion: needs one root, first, and every parent before its children")
        if ends and not ((self.end_parents >= 0) & (self.end_parents < count)).all():
            raise ModelError("SkeletonMotion: an end hangs on a joint that is not there")
        if frames and np.abs(np.linalg.norm(self.rotations, axis=-1) - 1).max(initial=0.0) > 1e-6:
            raise ModelError("SkeletonMotion: rotations must be unit quaternions")

    @staticmethod
    def check_memory(limits: Limits, frames: int, joints: int, what: str, source: int) -> None:
        """Raise LimitError if the retargeting of a motion would take more than the limits allow.

        what: "the motion". source: bytes of the file, or the part of it, that the motion comes from.
        """
        limits.check_frames(frames, what)
        limits.check_bytes(frames * (FRAME_BYTES + JOINT_BYTES * joints), what, source=source)

    def __len__(self) -> int:
        return len(self.positions)

    def resample(self, rate: Fraction | int | str, *, limits: Limits = DEFAULT_LIMITS) -> SkeletonMotion:
        """Return the same motion at another frame rate, from the first frame on, without extrapolation.

        Rotations are interpolated spherically. ValueError for a rate that is not positive,
        LimitError for more frames or memory than `limits` allow.
        """
        rate = Fraction(rate)
        if rate <= 0:
            raise ValueError(f"resample: the frame rate must be positive, not {rate}")
        if rate == self.rate:
            return self
        if not len(self):
            return replace(self, rate=rate)
        ratio = self.rate / rate
        count = (len(self) - 1) * ratio.denominator // ratio.numerator + 1
        limits.check_frames(count, f"the motion, resampled to {rate} frames/s,")
        row_bytes = 8 * (4 * len(self.names) + 3)
        limits.check_bytes(
            count * row_bytes, f"the motion, resampled to {rate} frames/s,", source=len(self) * row_bytes
        )
        times = np.arange(count) * float(ratio)
        before = np.minimum(times.astype(np.intp), len(self) - 1)
        after = np.minimum(before + 1, len(self) - 1)
        weight = (times - before).astype(np.float64)
        positions = self.positions[before] * (1 - weight[:, None]) + self.positions[after] * weight[:, None]
        turned = rotations.interpolate(self.rotations, before, after, weight)
        return replace(self, rate=rate, rotations=turned, positions=positions)

    def spread(self, most: int = SAMPLE_FRAMES) -> Intp:
        """Return the numbers of at most `most` frames, spread evenly over the motion."""
        return np.unique(np.linspace(0, len(self) - 1, min(len(self), most)).astype(np.intp))

    def select(self, rows: slice | Intp) -> SkeletonMotion:
        """Return some frames of the motion, without the face: its times would be wrong."""
        if isinstance(rows, slice) and rows.indices(len(self)) == (0, len(self), 1):
            return self
        return replace(self, rotations=self.rotations[rows], positions=self.positions[rows], face=None)

    def world(self) -> tuple[Float64, Float64]:
        """Return world rotations (T, J, 4), quaternions, and joint positions (T, J, 3), read-only."""
        return self._world

    @cached_property
    def _world(self) -> tuple[Float64, Float64]:
        turned = np.array(self.rotations)
        positions = np.empty((len(self), len(self.names), 3))  # every joint is written below
        for joint, parent in enumerate(self.parents):
            if parent < 0:
                positions[:, joint] = self.positions
                continue
            turned[:, joint] = rotations.multiply(turned[:, parent], self.rotations[:, joint])
            offset = rotations.matrices(turned[:, parent]) @ self.offsets[joint]
            positions[:, joint] = positions[:, parent] + offset
        turned.flags.writeable = positions.flags.writeable = False
        return turned, positions

    def joint_rotations(self, joint: int, rows: slice | Intp = slice(None)) -> Float64:
        """Return the rotations (T, 3, 3) of a joint in the world, against the rest pose, in some frames."""
        return rotations.matrices(self.world()[0][rows, joint])

    def turn_axes(self, turn: Float64) -> SkeletonMotion:
        """Return the same motion in other axes of the world. turn: (3, 3), from the old axes to the new."""
        quaternion = rotations.quaternions(turn[None])[0]
        inverse = quaternion * [1, -1, -1, -1]
        local = rotations.multiply(
            rotations.multiply(np.broadcast_to(quaternion, self.rotations.shape), self.rotations),
            np.broadcast_to(inverse, self.rotations.shape),
        )
        return replace(
            self,
            offsets=self.offsets @ turn.T,
            rotations=local / np.linalg.norm(local, axis=-1, keepdims=True),
            positions=self.positions @ turn.T,
            end_offsets=self.end_offsets @ turn.T,
            axes=rotations.quaternions(turn @ rotations.matrices(self.axes)),
        )

    def with_rest(self, rest: Float64) -> SkeletonMotion:
        """Return the same motion with another rest pose: world rotations (J, 3, 3) of the joints."""
        turned, _ = self.world()
        inverse = rotations.quaternions(np.swapaxes(rest, 1, 2))
        world = rotations.multiply(turned, np.broadcast_to(inverse, turned.shape))
        local = np.array(world)
        offsets = np.array(self.offsets)
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                local[:, joint] = rotations.multiply(world[:, parent] * [1, -1, -1, -1], world[:, joint])
                offsets[joint] = rest[parent] @ self.offsets[joint]
        local /= np.linalg.norm(local, axis=-1, keepdims=True)
        ends = [rest[p] @ offset for p, offset in zip(self.end_parents, self.end_offsets, strict=True)]
        return replace(
            self,
            offsets=offsets,
            rotations=local,
            end_offsets=np.array(ends).reshape(-1, 3),
            axes=rotations.quaternions(rest @ rotations.matrices(self.axes)),
        )

    def with_rest_of(self, other: SkeletonMotion, frame: int) -> SkeletonMotion:
        """Return the same motion that rests as another motion of its skeleton, or itself, is in a frame."""
        pose, _ = other.select(slice(frame, frame + 1)).world()
        return self.with_rest(rotations.matrices(pose[0]))

    def descendants(self, joint: int) -> list[int]:
        """Return a joint and all joints below it, parents first."""
        found = [joint]
        for number in range(joint + 1, len(self.names)):
            if int(self.parents[number]) in found:
                found.append(number)
        return found

    def rest(self) -> Float64:
        """Return joint positions (J, 3) in the rest pose, the root at its offset."""
        positions = np.array(self.offsets)
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                positions[joint] += positions[parent]
        return positions


@dataclass(frozen=True, eq=False)
class MappedMotion:
    """A motion whose joints are matched with those of the body.

    mapped: joint of the body -> number of the motion's joint.
    """

    motion: SkeletonMotion
    mapped: Mapping[str, int]

    def __contains__(self, joint: str) -> bool:
        return joint in self.mapped

    @cached_property
    def positions(self) -> dict[str, Float64]:
        """Positions (T, 3) in the world, by joint of the body."""
        positions = self.motion.world()[1]
        return {joint: positions[:, number] for joint, number in self.mapped.items()}

    @cached_property
    def rest(self) -> dict[str, Float64]:
        """Positions (3,) in the rest pose, by joint of the body."""
        rest = self.motion.rest()
        return {joint: rest[number] for joint, number in self.mapped.items()}

    def rotations(self, joint: str, rows: slice | Intp = slice(None)) -> Float64:
        """Return `SkeletonMotion.joint_rotations` of a joint of the body."""
        return self.motion.joint_rotations(self.mapped[joint], rows)

    def select(self, rows: slice | Intp) -> MappedMotion:
        """Return some frames, see `SkeletonMotion.select`."""
        return MappedMotion(self.motion.select(rows), self.mapped)


def read_axis(name: str) -> Float64:
    """Return the unit vector (3,) of an axis such as "-z"."""
    axis = np.zeros(3)
    axis["xyz".index(name[1])] = 1.0 if name[0] == "+" else -1.0
    return axis
