"""Read glTF 2.0 skeletons: animated joints, such as those that exporters write from FBX, become BAPs.

A glTF skeleton rests in its bind pose, in which joints may be turned; a `SkeletonMotion` rests without
rotations. So rotations are relative to the bind pose, in the scene's frame.

Files of this project have the joints of BAPs and need no retargeting; their FAPs come from morph targets and
joints (`fba.formats.gltf._fap_tracks`).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import cast

import numpy as np

from fba import rotations
from fba.animation import Animation, BodyTrack
from fba.arrays import Bool, Float64
from fba.body import BapSolver, Skeleton, convention_names
from fba.body.solve.solver import solve_track
from fba.capture import Captured, SkeletonMotion, SkeletonOptions, retarget_motion
from fba.capture.bones import find_bones
from fba.choices import Axes
from fba.errors import FbaWarning, FormatError, ModelError, warn
from fba.formats.gltf._face_motion import find_face_clip, nodes_of_faces, read_face_motion
from fba.formats.gltf._fap_joints import MAX_COORDINATE
from fba.formats.gltf._fap_tracks import read_face
from fba.formats.gltf._pose import BindPose, Sampler, key_times, nearest_rotation
from fba.formats.gltf._skeletons import find_joints
from fba.formats.gltf._writer import MARK, MOST_FRAMES
from fba.formats.gltf.clips import choose_clip
from fba.formats.text.frame_rates import Rate, parse_rate
from fba.gltf import Channel, Clip, Gltf, Value, optional_member, read_gltf
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path, naming_file

VERSION = 1
"""Version of the note."""
MAX_INDEX = 1 << 62
"""Largest frame number."""
SAMPLED_JOINTS = 200_000
"""Joints times frames that are sampled at once: a bound of memory."""
USUAL_RATES = (24, 25, 30, 48, 50, 60, 90, 100, 120, 240)
DEFAULT_RATE = Fraction(30)
MAX_HEAD_JOINTS = 10
"""Most turning joints of a skin that is a head."""
FACE_BYTES = 2500
"""Memory that a frame of a face takes."""
HALF_TURN = (-1, 1, -1)
"""Factors by which half a turn about +y changes vectors, and the last three numbers of quaternions."""
MAX_KEY_INTERVAL = 1.5
"""Frames, at the lowest usual rate, between keys above which they were set by hand, not sampled."""
MAX_STRETCH = 0.01
"""Share of the skeleton's size by which a joint may move relative to its parent without a warning."""


def sniff(head: bytes, suffix: str) -> bool:
    """Whether the first bytes of a file look like glTF, binary or JSON."""
    if head[:4] == b"glTF":
        return True
    return head.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"{" and (b'"asset"' in head or suffix == ".gltf")


def read_person(
    path: Path,
    options: SkeletonOptions,
    *,
    clip: str | int | None = None,
    rate: Rate | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Captured:
    """Return the person in a glTF file: a skeleton as BAPs, and a face as FAPs, see `read_face_motion`.

    clip, rate: see `read_motion`. BAPs and FAPs in files of this project are read as they are, with their
    frames, unless the options ask for retargeting.

    Raises FormatError for anything that is not glTF, or whose skeleton is not a body, LimitError for more
    than the limits allow; warns (FbaWarning) of what is left out.
    """
    with naming_file(path):
        return make_person(read_gltf(path, limits=limits), options, clip, rate, limits)


def make_person(
    gltf: Gltf, options: SkeletonOptions, clip: str | int | None, rate: Rate | None, limits: Limits
) -> Captured:
    """Return what `read_person` does, of a file that was read."""
    if options == SkeletonOptions() and (stored := _read_stored(gltf, clip)) is not None:
        return Captured(stored if rate is None else stored.resample(Fraction(rate), limits=limits))
    if (face_clip := _clip_of_face_alone(gltf, clip)) is not None:
        return Captured(_read_face_alone(gltf, face_clip, rate, limits))
    motion = None
    try:
        with warnings.catch_warnings(record=True, action="always", category=FbaWarning) as said:
            motion = _sample(gltf, clip, rate, limits)
            made = retarget_motion(motion, None, options, limits=limits)
    except ModelError as error:
        person = motion is not None and _has_limbs(motion)  # whose pose is not clear
        if person or options.joints is not None or (face_clip := find_face_clip(gltf, clip)) is None:
            raise
        if _count_turning(face_clip, gltf) >= MAX_HEAD_JOINTS:
            text = f"{gltf.file}: no body is read, the face alone: {error.finding}"
            warnings.warn(FbaWarning(text).with_remedies(*error.remedies), stacklevel=3)
        return Captured(_read_face_alone(gltf, face_clip, rate, limits))
    for each in said:  # about a skeleton, only if it is that of a person
        warnings.warn(each.message, each.category, stacklevel=3)
    return made


def _read_stored(gltf: Gltf, clip: str | int | None) -> Animation | None:
    """Return the BAPs and FAPs in a file of this project; None for other files."""
    if not gltf.animations:
        return None
    chosen = gltf.animations[0] if clip is None else choose_clip(gltf, clip, range(len(gltf.nodes)))
    note = find_note(gltf, chosen)
    return None if note is None else read_note(gltf, chosen, note)


def read_motion(
    path: Path, *, clip: str | int | None = None, rate: Rate | None = None, limits: Limits = DEFAULT_LIMITS
) -> SkeletonMotion:
    """Return the joints of a glTF file and one of its animations, sampled.

    clip: name or number (from 0) of the animation; None for the first that moves the skeleton. rate: frames
    per second; None for that of the keys if they are regular, else 30. Raises FormatError, ModelError, and
    LimitError for more than the limits allow; warns (FbaWarning) if there are several animations or skeletons
    to choose from.
    """
    gltf = read_gltf(path, limits=limits)
    try:
        return _sample(gltf, clip, rate, limits)
    except ModelError as error:
        finding = error.finding.removeprefix(f"{gltf.file}: ")
        raise ModelError(f"{gltf.file}: {finding}").with_remedies(*error.remedies) from error


def _has_limbs(motion: SkeletonMotion) -> bool:
    """Whether the limbs of a person are found among the joints of a motion."""
    try:
        find_bones(motion, None, Skeleton.default())
    except ModelError:
        return False
    return True


def _count_turning(clip: Clip, gltf: Gltf) -> int:
    """Return the count of joints of skins that a clip turns."""
    joints = {joint for skin in gltf.skins for joint in skin.joints}
    return sum(
        channel.path == "rotation" and channel.node in joints and np.ptp(channel.values, axis=0).max() > 0
        for channel in clip.channels
    )


def _clip_of_face_alone(gltf: Gltf, clip: str | int | None) -> Clip | None:
    """Return the clip to read if it moves a face and turns nothing else, else None."""
    clips = gltf.animations if clip is None else [choose_clip(gltf, clip, range(len(gltf.nodes)))]
    faces = nodes_of_faces(gltf)
    if any(c.path != "weights" and c.node not in faces for each in clips for c in each.channels):
        return None
    return find_face_clip(gltf, clip)


def _read_face_alone(gltf: Gltf, clip: Clip, rate: Rate | None, limits: Limits) -> Animation:
    """Return a clip that moves a face alone."""
    times = key_times(clip.channels)
    frames, count = _count_frames(gltf, clip, times, rate, limits)
    limits.check_frames(count, f"{gltf.file}: animation {clip.name!r}")
    keys = sum(channel.times.nbytes + channel.values.nbytes for channel in clip.channels)
    limits.check_bytes(count * FACE_BYTES, f"{gltf.file}: animation {clip.name!r}", source=keys)
    moments = float(times[0]) + np.arange(count) / float(frames)
    face = read_face_motion(gltf, clip, moments, head=True)
    return Animation(frames, np.arange(count), face, None, clip.name)


def _count_frames(
    gltf: Gltf, clip: Clip, times: Float64, rate: Rate | None, limits: Limits
) -> tuple[Fraction, int]:
    """Return the frame rate and the number of frames of a clip with keys at times (T,)."""
    frames = Fraction(rate) if rate is not None else _rate(times)
    if frames <= 0:
        raise ValueError(f"rate must be positive, not {rate}")
    seconds = float(times[-1] - times[0])
    count = int(seconds * float(frames) + 1e-6) + 1
    what = f"{gltf.file}: animation {clip.name!r}, {seconds:.0f} s at {float(frames):g} frames/s,"
    limits.check_seconds(seconds, what)
    if count > SkeletonMotion.MAX_FRAMES:
        raise ModelError(
            f"{what} has {count} frames, more than {SkeletonMotion.MAX_FRAMES}; give a lower rate, or cut it "
            "into pieces"
        )
    return frames, count


def _sample(gltf: Gltf, clip: str | int | None, rate: Rate | None, limits: Limits) -> SkeletonMotion:
    joints = find_joints(gltf)
    nodes, parents, bind, used = joints.nodes, joints.parents, joints.bind, joints.used
    place = {node: number for number, node in enumerate(nodes)}
    chosen = choose_clip(gltf, clip, place)
    channels = [channel for channel in chosen.channels if channel.node in place]
    times = key_times(channels)
    frames, count = _count_frames(gltf, chosen, times, rate, limits)
    first = float(times[0])
    seconds = float(times[-1]) - first
    what = f"{gltf.file}: animation {chosen.name!r}, {seconds:.0f} s at {float(frames):g} frames/s,"
    keys = sum(channel.times.nbytes + channel.values.nbytes for channel in channels)
    SkeletonMotion.check_memory(limits, count, len(nodes), what, keys)
    motion = replace(joints.resting(gltf), rate=frames, name=chosen.name)
    turns, root = np.empty((count, len(used), 4)), np.empty((count, 3))
    stretched = np.zeros(len(used), dtype=np.bool_)
    at_once = min(max(SAMPLED_JOINTS // len(nodes), 1), count)
    for start in range(0, count, at_once):
        rows = np.arange(start, min(start + at_once, count))
        sampler = Sampler(gltf, channels, first + rows / float(frames))
        turned, positions = _world(gltf, sampler, nodes, parents, bind)
        local = turned[:, used]
        for row, number in enumerate(used[1:], 1):
            inverse = turned[:, parents[number]] * [1, -1, -1, -1]
            local[:, row] = rotations.multiply(inverse, turned[:, number])
        turns[rows] = local / np.linalg.norm(local, axis=-1, keepdims=True)
        root[rows] = positions[:, used[0]]
        stretched |= _stretched(
            replace(motion, rotations=turns[rows], positions=root[rows]), positions[:, used]
        )
    if stretched.any():
        _warn_of_stretching(chosen.name, [motion.names[row] for row in np.flatnonzero(stretched)])
    motion = replace(motion, rotations=turns, positions=root)
    if joints.humanoid is not None and joints.humanoid.kind == "VRM 0":
        motion = _turn_round(motion)
    return replace(motion, face=lambda moments: read_face_motion(gltf, chosen, first + moments))


def _turn_round(motion: SkeletonMotion) -> SkeletonMotion:
    """Return a motion turned by half a turn about +y: people of VRM 0 face -z."""
    return replace(
        motion,
        offsets=motion.offsets * HALF_TURN,
        rotations=motion.rotations * [1, *HALF_TURN],
        positions=motion.positions * HALF_TURN,
    )


def _world(
    gltf: Gltf, sampler: Sampler, nodes: list[int], parents: list[int], bind: BindPose
) -> tuple[Float64, Float64]:
    """Return rotations (T, J, 4) of nodes from the bind pose, and positions (T, J, 3), in the scene's frame.

    nodes: parents first. parents: position of each node's parent in nodes, -1 for the root.
    """
    turned = np.zeros((len(sampler), len(nodes), 4))
    positions = np.zeros((len(sampler), len(nodes), 3))
    linear: list[Float64] = []
    for number, node in enumerate(nodes):
        local = sampler.linear(node)
        parent = parents[number]
        shift = sampler.translation(node)
        if parent < 0:
            above = gltf.nodes[node].parent
            base = np.eye(4) if above is None else gltf.nodes[above].world
            linear.append(base[:3, :3] @ local)
            positions[:, number] = shift @ base[:3, :3].T + base[:3, 3]
        else:
            linear.append(linear[parent] @ local)
            positions[:, number] = positions[:, parent] + (linear[parent] @ shift[:, :, None])[:, :, 0]
        turned[:, number] = bind.turned(number, linear[number])
    return turned, positions


def _rate(times: Float64) -> Fraction:
    """Return the frame rate of keys: the usual rate that fits nearly all intervals between them, else 30.

    Keys that were set by hand, far apart, fit several rates: for them, 30 is tried first.
    """
    steps = np.diff(times)
    steps = steps[steps > 1e-4]
    if not len(steps):
        return DEFAULT_RATE
    shortest = float(np.percentile(steps, 25))
    by_hand = shortest > MAX_KEY_INTERVAL / USUAL_RATES[0]
    for rate in (int(DEFAULT_RATE), *USUAL_RATES) if by_hand else USUAL_RATES:
        frames = steps * rate
        if rate * shortest > 0.9 and (np.abs(frames - np.rint(frames)) < 0.02).mean() > 0.95:
            return Fraction(rate)
    return DEFAULT_RATE


def _stretched(motion: SkeletonMotion, positions: Float64) -> Bool:
    """Return bool (J,): whether joints move relative to their parents. positions: (T, J, 3), of the file."""
    size = float(np.ptp(motion.rest(), axis=0).max()) or 1.0
    moved: Bool = np.abs(motion.world()[1] - positions).max(axis=(0, 2)) > MAX_STRETCH * size
    return moved


def _warn_of_stretching(name: str, joints: list[str]) -> None:
    """Warn of joints that move relative to their parents, but keep their place of the bind pose."""
    warn(
        f"{name}: joints whose offset from the parent varies, or differs from the bind pose, "
        f"keep that of the bind pose: {', '.join(joints[:5])}{', ...' if len(joints) > 5 else ''}",
        stacklevel=5,
    )


def find_note(gltf: Gltf, clip: Clip) -> Value | None:
    """Return the note that fba adds to an animation (rate, first frame, body, face); None in other files."""
    entries = gltf.document.elements(1 << 18, "animations")
    entry = entries[gltf.animations.index(clip)]
    extras = entry.get("extras")
    note = optional_member(extras, MARK) if extras is not None and isinstance(extras.data, dict) else None
    ours = note is not None and isinstance(note.data, dict) and ("root" in note.data or "face" in note.data)
    return note if ours else None


def read_note(gltf: Gltf, clip: Clip, note: Value) -> Animation:
    """Return the tracks of an animation with such a note.

    Raises ModelError if the note is wrong; warns (FbaWarning) of morph targets that are missing.
    """
    if note.member("version").integer(0, 1 << 30) != VERSION:
        raise note.error(
            f"has version {note.member('version').data}, but this fba reads version {VERSION} only"
        )
    text = note.member("rate")
    try:
        rate: Fraction = parse_rate(text.text(100))
    except FormatError as error:
        raise text.error(str(error)) from None
    first = note.member("first").integer(-MAX_INDEX, MAX_INDEX)
    nodes: dict[str, int] = {}
    channels: Sequence[Channel] = clip.channels
    if note.get("root") is not None:
        nodes = _find_joints(gltf, note.member("root").index(len(gltf.nodes), "node"), Skeleton.default())
        inside = set(nodes.values())
        channels = [channel for channel in clip.channels if channel.node in inside]
    times = key_times(channels)
    if len(times) > MOST_FRAMES:
        raise note.error(f"its animation has {len(times)} keys, more than the {MOST_FRAMES} that can be read")
    steps = np.rint(times * float(rate))
    if not (steps[-1] < MAX_INDEX and (len(steps) < 2 or (np.diff(steps) > 0).all())):
        raise text.error("some keys of the animation are less than a frame apart at this rate")
    body = _body(gltf, channels, note, nodes, times) if nodes else None
    face = read_face(gltf, clip, face_note, times) if (face_note := note.get("face")) is not None else None
    return Animation(rate, first + steps.astype(np.int64), face, body, clip.name)


def _body(
    gltf: Gltf, channels: Sequence[Channel], note: Value, nodes: dict[str, int], times: Float64
) -> BodyTrack:
    """Return the body track at times (T,). nodes: joint of the standard -> node."""
    axes = cast("Axes", note.member("axes").choice(*convention_names()))
    centre = np.array(note.member("centre").numbers(3, -MAX_COORDINATE, MAX_COORDINATE))
    standard = Skeleton.default()

    def matrices(rows: slice) -> Float64:
        return _matrices(Sampler(gltf, channels, times[rows]), nodes, standard, centre)

    return solve_track(BapSolver(standard, axes), nodes, len(times), matrices)


def _find_joints(gltf: Gltf, root: int, standard: Skeleton) -> dict[str, int]:
    """Return the nodes at and below the root that are joints of the standard, by name."""
    nodes = {standard.names[0]: root}
    below = {root}
    for number in gltf.order:
        parent = gltf.nodes[number].parent
        if parent in below:
            below.add(number)
            if gltf.nodes[number].name in standard:
                nodes.setdefault(gltf.nodes[number].name, number)
    return nodes


def _matrices(sampler: Sampler, nodes: dict[str, int], standard: Skeleton, centre: Float64) -> Float64:
    """Return (T, J, 4, 4) of the standard's joints: world rotations, and the root's position.

    centre: (3,), position of the root at rest in the file.
    """
    shift = sampler.translation(nodes[standard.names[0]])
    result = np.zeros((len(shift), len(standard), 4, 4))
    result[:, :, 3, 3] = 1.0
    for joint, name in enumerate(standard.names):
        parent = int(standard.parents[joint])
        above = np.eye(3) if parent < 0 else result[:, parent, :3, :3]
        turned = nearest_rotation(sampler.linear(nodes[name])) if name in nodes else np.eye(3)
        result[:, joint, :3, :3] = above @ turned
    result[:, 0, :3, 3] = shift - centre + standard.centres[0]
    return result
