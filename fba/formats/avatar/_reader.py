"""Read avatar animation units, alone or in a container: weights become FAPs, joints become BAPs."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from fba import geometry, rotations
from fba.arrays import Float64, Int64
from fba.capture import (
    Captured,
    ShapeMotion,
    SkeletonMotion,
    SkeletonOptions,
    make_animation,
    retarget_motion,
)
from fba.capture.blendshapes.conversion import convert_rows
from fba.carriage.avatar_units import AvatarUnits, UnitTrack, begins_stream, read_units
from fba.errors import FormatError, warn
from fba.face import arkit_names
from fba.formats.avatar._container import (
    BODY_PROFILE,
    DOCUMENT,
    FACE_JOINTS,
    FACE_PROFILE,
    Avatar,
    joint_names,
    joint_parents,
    parents_first,
    read_container,
    resting_joints,
)
from fba.formats.face_tables.shape_weights import check_weights, find_lacks, shape_of
from fba.formats.text.frame_rates import Rate
from fba.formats.zip_files import ZIP
from fba.limits import DEFAULT_LIMITS, Limits
from fba.sampling import find_rate, frame_numbers, interpolate
from fba.source import Path, naming_file, read_whole, stem_of
from fba.tracks import FaceTrack

ON_FRAME = 1e-4
"""Share of a frame by which a time may miss it: ticks are rounded."""
MAX_STRETCH = 0.01
"""Share of the skeleton's size by which a joint may move relative to its parent without a warning."""
MIN_SCALE = 1e-6
MATRIX_BYTES = 400
"""Memory, in bytes, that a joint in a unit takes: its matrix to the world, and turns made of it."""


def sniff(head: bytes, suffix: str) -> bool:
    """Whether a file begins like units, or like a container of them."""
    return begins_stream(head) or (head.startswith(ZIP) and (suffix == ".arfz" or DOCUMENT.encode() in head))


def read_person(
    path: Path, options: SkeletonOptions, *, rate: Rate | None = None, limits: Limits = DEFAULT_LIMITS
) -> Captured:
    """Return the person of a stream or a container: joints as BAPs, weights as FAPs.

    rate: frames per second of the animation, by default those of the units.

    Units name shapes and joints by number. A container says what they are; else the profile must be this
    project's, or the shapes ARKit's 52 in ARKit's order. Raises FormatError, LimitError, and ModelError as
    `fba.capture.retarget_motion`; warns (FbaWarning) of what is left out.
    """
    with naming_file(path):
        person = _read(path, limits)
        if (motion := person.motion()) is not None:
            return retarget_motion(motion, rate, options, limits=limits)
        face = person.face
    if face is None:
        raise FormatError("has neither weights of shapes nor joints that are known", path=path)
    return make_animation(face, rate, path=path, limits=limits)


def read_motion(path: Path, *, limits: Limits = DEFAULT_LIMITS) -> SkeletonMotion:
    """Return the joints of a stream or a container, with the face if there is one.

    Raises FormatError, LimitError; warns (FbaWarning) of what is left out.
    """
    with naming_file(path):
        motion = _read(path, limits).motion()
    if motion is None:
        raise FormatError("has no joints of a body", path=path)
    return motion


def _read(path: Path, limits: Limits) -> _Person:
    data = read_whole(path)
    if not data.startswith(ZIP):
        units = read_units(data, limits)
        _warn_of_rest(units, path)
        return _Person(path, limits, units, _explain(units, path))
    avatar, streams = read_container(data, path, limits)
    units = _join([read_units(stream, limits) for stream in streams])
    _warn_of_rest(units, path)
    return _Person(path, limits, units, avatar)


def _join(streams: list[AvatarUnits]) -> AvatarUnits:
    """Return the streams of a container as one: the first with shapes, and the first with joints."""
    shapes = next((units.shapes for units in streams if units.shapes), None)
    joints = next((units.joints for units in streams if units.joints), None)
    left_out: dict[int, int] = {}
    for units in streams:
        for kind, count in units.left_out.items():
            left_out[kind] = left_out.get(kind, 0) + count
    return AvatarUnits(shapes, joints, left_out)


def _warn_of_rest(units: AvatarUnits, path: Path) -> None:
    if units.left_out:
        listed = ", ".join(f"{count} of type {kind}" for kind, count in sorted(units.left_out.items()))
        text = f"{os.fspath(path)}: units are left out, of types or further sets that are not read: {listed}"
        warn(text, stacklevel=4)


def _explain(units: AvatarUnits, path: Path) -> Avatar:
    """Return what the numbers mean in a stream without a container."""
    nothing = Avatar((), (), np.zeros(0, np.int64), np.zeros((0, 4, 4)))
    if units.joints is not None:
        if BODY_PROFILE not in units.joints.profile:
            raise FormatError(
                f"its joints have numbers only, and the profile {units.joints.profile!r} does not say which "
                f"they are; give the container (.arfz), whose {DOCUMENT} names them",
                path=path,
            )
        nothing = Avatar((), joint_names(), joint_parents(), resting_joints())
    if units.shapes is None:
        return nothing
    count = units.shapes.values.shape[1]
    if count > len(arkit_names()):
        raise FormatError(
            f"has {count} shapes without names; ARKit has {len(arkit_names())}; give the container (.arfz), "
            f"whose {DOCUMENT} names them",
            path=path,
        )
    if FACE_PROFILE not in units.shapes.profile:
        text = f"{os.fspath(path)}: its shapes have no names; they are taken as ARKit's, in ARKit's order"
        warn(text, stacklevel=5)
    return replace(nothing, shapes=arkit_names())


@dataclass(frozen=True, eq=False)
class _Person:
    """The units of a person, and what their numbers mean."""

    path: Path
    limits: Limits
    units: AvatarUnits
    avatar: Avatar

    @property
    def name(self) -> str:
        return stem_of(self.path)

    @cached_property
    def face(self) -> ShapeMotion | None:
        """Return the weights of known shapes, and the turn of the head if that is apart; None without any."""
        track = self.units.shapes
        turns = self._turns()
        if track is None:
            return turns
        names = [shape_of(name) for name in self.avatar.shapes[: track.values.shape[1]]]
        columns = [column for column, name in enumerate(names) if name is not None]
        if not columns:
            text = f"{os.fspath(self.path)}: no shape has one of ARKit's names; the face is left out"
            warn(text, stacklevel=4)
            return turns
        weights = np.nan_to_num(track.values[:, columns])
        known = [name for name in names if name is not None]
        if len(set(known)) != len(known):
            raise FormatError("several of its shapes have the name of one of ARKit's", path=self.path)
        check_weights(weights, known, self.path)
        times = track.times - track.times[0]
        rate = find_rate(times)
        head = eyes = None
        if turns is not None:
            begin = track.times[0] - self.units.joints.times[0] if self.units.joints else 0.0
            recorded = [turns.eyes, turns.head]
            sampled = iter(
                interpolate(
                    turns.times, [one for one in recorded if one is not None], times + begin, self.limits
                )
            )
            eyes, head = (None if one is None else next(sampled) for one in recorded)
        return ShapeMotion(
            tuple(known), weights, times, rate, head=head, eyes=eyes, name=self.name,
            findings=tuple(find_lacks(known, weights, times, rate)),
        )  # fmt: skip

    def _turns(self) -> ShapeMotion | None:
        """Return the turns of the head and the eyes in a stream of this project."""
        track = self.units.joints
        if track is None or self.avatar.joints != joint_names():
            return None
        head, left, right = (self._angles(track, joint) for joint in FACE_JOINTS)
        if head is None and left is None and right is None:
            return None
        times = track.times - track.times[0]
        none = np.zeros((len(times), 3))
        left, right = (none if left is None else left), (none if right is None else right)
        eyes = np.stack([left[:, 0], right[:, 0], left[:, 2], right[:, 2]], axis=1)
        return ShapeMotion(
            (), np.zeros((len(times), 0)), times, find_rate(times), eyes=eyes, name=self.name,
            head=None if head is None else head[:, [2, 0, 1]],
        )  # fmt: skip

    def _angles(self, track: UnitTrack, joint: str) -> Float64 | None:
        """Return yaw, roll and pitch (T, 3) of a joint, radians; None where no unit mentions it."""
        matrices = track.values[:, joint_names().index(joint) :][:, :1, :3, :3]
        given = np.isfinite(matrices).all(axis=(1, 2, 3))
        if not matrices.size or not given.any():
            return None
        if not given.all():
            frame = int(np.flatnonzero(~given)[0])
            raise FormatError(
                f"the joint {joint!r} is missing in unit {frame} of those with joints", path=self.path
            )
        angles = Rotation.from_matrix(_rotation(matrices[:, 0], self.path)).as_euler("YZX")
        unwrapped: Float64 = np.unwrap(angles, axis=0)
        return unwrapped

    def faps(self, at: Float64) -> FaceTrack | None:
        """Return the FAPs at times (F,), seconds from the first unit of joints on."""
        face, joints = self.face, self.units.joints
        assert face is not None
        assert joints is not None
        begin = joints.times[0] if self.units.shapes is None else self.units.shapes.times[0]
        given = [one for one in (face.weights, face.head, face.eyes) if one is not None]
        weights, *turns = interpolate(face.times + begin - joints.times[0], given, at, self.limits)
        head = turns.pop(0) if face.head is not None else None
        eyes = turns.pop(0) if face.eyes is not None else None
        return convert_rows(face.names, weights, head, eyes)

    def motion(self) -> SkeletonMotion | None:
        """Return the joints at a steady rate; None without any, or with the head alone."""
        track = self.units.joints
        if track is None:
            return None
        names, parents, count = self.avatar.joints, self.avatar.parents, track.values.shape[1]
        if count > len(names):
            raise FormatError(
                f"moves joint {count - 1}; the skeleton has {len(names)}, from 0", path=self.path
            )
        if names == joint_names():
            names, parents = names[: -len(FACE_JOINTS)], parents[: -len(FACE_JOINTS)]
            if not np.isfinite(track.values[:, : len(names)]).any():
                return None
        order = _with_root_first(parents_first(parents), parents, self.path)
        places = {joint: place for place, joint in enumerate(order)}
        above = np.array([places.get(int(parents[joint]), -1) for joint in order])
        rate, rows = self._frames(track)
        world = _world(track, self.avatar.rest, order, above, parents)
        rest = self.avatar.rest[order]
        turned = rotations.quaternions(
            _rotation(world[..., :3, :3], self.path)
            @ np.swapaxes(_rotation(rest[:, :3, :3], self.path), 1, 2)
        )
        local = turned.copy()
        offsets = rest[:, :3, 3].copy()
        for joint in range(1, len(order)):
            local[:, joint] = rotations.multiply(turned[:, above[joint]] * [1, -1, -1, -1], turned[:, joint])
            offsets[joint] -= rest[above[joint], :3, 3]
        local /= np.linalg.norm(local, axis=-1, keepdims=True)
        positions = world[:, 0, :3, 3]
        motion = SkeletonMotion(
            tuple(names[joint] for joint in order), above, offsets, rotations.interpolate(local, *rows),
            positions[rows[0]] * (1 - rows[2][:, None]) + positions[rows[1]] * rows[2][:, None], rate,
            name=self.name,
        )  # fmt: skip
        self._warn_of_stretching(replace(motion, rotations=local, positions=positions), world)
        return motion if self.face is None else replace(motion, face=self.faps)

    def _frames(self, track: UnitTrack) -> tuple[Fraction, tuple[Int64, Int64, Float64]]:
        """Return the rate, and for each frame the units before and after it, and the weight of the latter.

        Raises LimitError where the frames, or the matrices of all joints in all units, are too many.
        """
        times, joints, source = track.times - track.times[0], len(self.avatar.joints), track.values.nbytes
        self.limits.check_bytes(MATRIX_BYTES * len(times) * joints, "the motion", source=source)
        rate = find_rate(times)
        at = frame_numbers(times, rate, self.limits) / float(rate)
        SkeletonMotion.check_memory(self.limits, len(at), joints, "the motion", source)
        before = np.clip(
            np.searchsorted(times, at + ON_FRAME / float(rate), side="right") - 1, 0, len(times) - 1
        )
        after = np.minimum(before + 1, len(times) - 1)
        length = np.where(after > before, times[after] - times[before], 1.0)
        weight = np.clip((at - times[before]) / length, 0.0, 1.0)
        weight[weight * length * float(rate) < ON_FRAME] = 0.0
        return rate, (before, after, weight)

    def _warn_of_stretching(self, motion: SkeletonMotion, world: Float64) -> None:
        """Warn of joints that move relative to their parents, but keep their place of the rest pose."""
        size = float(np.ptp(motion.rest(), axis=0).max()) or 1.0
        moved = np.abs(motion.world()[1] - world[..., :3, 3]).max(axis=(0, 2)) > MAX_STRETCH * size
        if moved.any():
            names = [motion.names[joint] for joint in np.flatnonzero(moved)[:5]]
            listed = ", ".join(names) + (", ..." if moved.sum() > 5 else "")
            text = f"{os.fspath(self.path)}: joints keep the offsets from their parents at rest: {listed}"
            warn(text, stacklevel=5)


def _with_root_first(order: list[int], parents: Int64, path: Path) -> list[int]:
    """Return the order without joints of further trees. Raises FormatError without a joint."""
    if not order:
        raise FormatError("its skeleton has no joints", path=path)
    root_of = parents.copy()
    for joint in order:
        root_of[joint] = joint if parents[joint] < 0 else root_of[parents[joint]]
    largest = np.bincount(root_of).argmax()
    return [joint for joint in order if root_of[joint] == largest]


def _world(track: UnitTrack, rest: Float64, order: list[int], above: Int64, parents: Int64) -> Float64:
    """Return the matrices (T, J, 4, 4) of joints to the world, in an order with parents first.

    Joints that a unit does not mention stay as they were, at first as at rest.
    """
    world = np.zeros((len(track.times), len(order), 4, 4))
    for place, joint in enumerate(order):
        resting = rest[joint] if above[place] < 0 else np.linalg.solve(rest[parents[joint]], rest[joint])
        local = np.broadcast_to(resting, (len(world), 4, 4))
        if joint < track.values.shape[1]:
            given = np.isfinite(track.values[:, joint, 0, 0])
            last = np.maximum.accumulate(np.where(given, np.arange(len(world)), -1))
            local = np.where((last >= 0)[:, None, None], track.values[last, joint], resting)
        world[:, place] = local if above[place] < 0 else world[:, above[place]] @ local
    return world


def _rotation(matrices: Float64, path: Path) -> Float64:
    """Return the rotations nearest to scaled ones (..., 3, 3). FormatError for what is flat or mirrored."""
    size = np.abs(matrices).max(axis=(-1, -2))
    if not (np.isfinite(size).all() and (size < 1e9).all()):
        raise FormatError("a matrix of a joint has numbers that are too large", path=path)
    scaled = matrices / np.maximum(size, MIN_SCALE)[..., None, None]
    if not (np.linalg.det(scaled) > MIN_SCALE).all():
        raise FormatError("a matrix of a joint is flat or mirrored, so it is no turn", path=path)
    return geometry.nearest_rotation(scaled)
