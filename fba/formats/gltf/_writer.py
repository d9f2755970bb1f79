"""Write glTF 2.0 (.glb): a skinned, animated person that Blender, three.js and game engines open.

Nodes are the joints of the standard, by name, posed as in the first frame. Joints that move have LINEAR keys
at the animation's own times, from the first frame on. FAPs are weights of morph targets. docs/formats.md
describes what is approximate.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from fba.animation import Animation
from fba.arrays import Float32, Float64, Int32
from fba.choices import Axes
from fba.errors import FormatError, warn
from fba.formats.gltf._joints import Clip, move, nest, start_clip
from fba.gltf import Builder
from fba.source import Path
from fba.tracks import hold

if TYPE_CHECKING:
    from fba.body import BapSolver, BodyModel, Skeleton
    from fba.face import FaceModel
    from fba.formats.gltf._head import HeadParts


MOST_FRAMES = 100_000
"""Nearly an hour at 30 frames/s; a frame of a body takes up to 1.4 kB."""
CHUNK = 2048
"""Frames that are posed at once."""
MIN_LIFT = 1e-4
"""Metres below which a person is not raised to the ground."""
MARK = "fba"
"""Key of this project's note in the extras of the animation."""


def write(
    path: Path,
    animation: Animation,
    *,
    mesh: bool = True,
    model: FaceModel | None = None,
    body: BodyModel | None = None,
    axes: Axes = "iso",
) -> None:
    """Write an animation as .glb.

    mesh: with the person's surface; False for the skeleton alone, which needs a body track. model: the face,
    by default the built-in head. body: the body that BAPs move, by default the built-in person. axes: the
    convention of BAP axes (`fba.body.convention_names()`).

    An animation with a body is written as a whole person, one with only a face as a head. Reading the file
    returns the same BAPs and FAPs at the same times (docs/formats.md says what is lost). Raises FormatError
    for no frame, more than 100,000, or a skeleton without a body track; ModelError if glTF cannot hold a
    model. Warns (FbaWarning) if a body has no position for a face.
    """
    if os.fspath(path).lower().endswith(".gltf"):
        raise FormatError("glTF is written in one file; name it .glb", path=path)
    if not 1 <= len(animation) <= MOST_FRAMES:
        raise FormatError(
            f"{len(animation)} frames; 1 to {MOST_FRAMES} can be written as glTF; write shorter "
            "pieces, or resample",
            path=path,
        )
    if animation.body is None and not mesh:
        raise FormatError("a skeleton alone needs a body, and this animation has only a face", path=path)
    builder = Builder()
    builder.root["scene"] = 0
    first = int(animation.index[0])
    times = (animation.index - first).astype(np.float64) / float(animation.rate)
    clip = start_clip(builder, times, path)
    note: dict[str, Any] = {"version": 1, "rate": str(animation.rate), "first": first}
    if animation.body is not None:
        from fba.body import BodyModel

        person = (body or BodyModel.default()) if mesh else body
        roots = _add_person(builder, clip, animation, note, model, person, axes)
    else:
        roots = _add_head(builder, clip, animation, note, model)
    builder.add("scenes", {"nodes": roots})
    clip.add_to_file(animation.name or "animation", extras={MARK: note})
    builder.save(path)


def _add_person(
    builder: Builder,
    clip: Clip,
    animation: Animation,
    note: dict[str, Any],
    model: FaceModel | None,
    person: BodyModel | None,
    axes: Axes,
) -> list[int]:
    """Add a person or a skeleton with its animation, and complete the note; return the root nodes.

    person: None for a skeleton alone.
    """
    from fba.body import BapSolver, Skeleton
    from fba.gltf import PartWriter

    skeleton = Skeleton.default() if person is None else person.skeleton
    solver = BapSolver(skeleton, axes)
    nodes = nest(builder, skeleton.names, skeleton.parents)
    track = animation.body
    assert track is not None
    baps: Int32 = hold(track.values, track.mask, np.zeros(track.values.shape[1], dtype=np.int32))
    turns, positions = _local_motion(solver, baps)
    for joint, node in enumerate(nodes):
        shifts = positions if joint == 0 else np.broadcast_to(skeleton.offsets[joint], positions.shape)
        move(builder, clip, node, turns[joint], shifts, always=joint == 0)
    note |= {"axes": axes, "root": nodes[0], "centre": skeleton.centres[0].tolist()}
    top = nodes[0] if person is None else _stand_on_ground(builder, clip, skeleton, axes, baps, nodes[0])
    if person is None:
        bind = np.tile(np.eye(4), (len(skeleton), 1, 1))
        bind[:, :3, 3] = skeleton.centres
        _add_skin(builder, nodes, bind, nodes[0])
        _note_face(builder, animation, note, model, None)
        return [nodes[0]]

    slots: dict[str, int] = {}
    bound = list(person.bind)
    joints = list(nodes)
    head = _make_head(builder, clip, animation, person, model)
    if head is not None:
        from fba.body.head_attachment import skull_of

        skull = skull_of(person)
        node = nodes[skull]
        if head.is_turned:
            node = head.add_head_node(nodes[skull], person.bind[skull])
            joints[skull] = node  # moves all that the skull moves, including part of the neck
            joints.append(nodes[skull])
            bound.append(person.bind[skull])
        for name, eye in head.add_joints(node, person.bind[skull]).items():
            slots[name] = len(joints)
            joints.append(eye)
        bound += [matrix for _, matrix in head.bound]
    _add_skin(builder, joints, np.array(bound), nodes[0])
    materials = PartWriter(builder)
    roots = [top]
    for part in person.parts:
        if part.kind == "neck" and head is not None and head.on is not None and head.on.brings_neck:
            continue
        primitive = materials.primitive(part)
        used = np.where(part.weights > 0, part.joints, 0)
        primitive["attributes"]["JOINTS_0"] = builder.attribute(used.astype(np.uint16))
        primitive["attributes"]["WEIGHTS_0"] = builder.attribute(part.weights)
        shown = builder.add("meshes", {"name": part.name, "primitives": [primitive]})
        roots.append(builder.add("nodes", {"name": part.name, "mesh": shown, "skin": 0}))
    if head is not None:
        roots += head.add_meshes(slots, materials, True, {})
    _note_face(builder, animation, note, model, head)
    return roots


def _stand_on_ground(
    builder: Builder, clip: Clip, skeleton: Skeleton, axes: Axes, baps: Int32, root: int
) -> int:
    """Return the top node: a node that raises the root so that feet stand on the ground, or the root itself.

    The root's own translation stays that of the BAPs, so that they are read back unchanged.
    """
    from fba.body import GroundedPoser

    poser = GroundedPoser(skeleton, axes)
    lifts = np.concatenate([poser.lifts(baps[n : n + CHUNK]) for n in range(0, len(baps), CHUNK)])
    if float(np.abs(lifts).max()) < MIN_LIFT:
        return root
    node = builder.add("nodes", {"name": "Ground", "children": [root]})
    turns = np.broadcast_to(np.eye(3), (len(lifts), 3, 3))
    move(builder, clip, node, turns, np.column_stack([0.0 * lifts, lifts, 0.0 * lifts]))
    return node


def _make_head(
    builder: Builder, clip: Clip, animation: Animation, person: BodyModel, model: FaceModel | None
) -> HeadParts | None:
    """Return a person's head, still without meshes; None, with a warning, if the body has no place for it."""
    from fba.face import FaceModel
    from fba.formats.gltf._head import start_head

    if person.eyes is None:
        if animation.face is not None or model is not None:
            warn(f"the body {person.name!r} has no position for a face; none is shown", stacklevel=5)
        return None
    face = model or FaceModel.default()
    return start_head(builder, clip, face, _shown(animation, face), person)


def _add_head(
    builder: Builder, clip: Clip, animation: Animation, note: dict[str, Any], model: FaceModel | None
) -> list[int]:
    """Add a face alone, in its own frame, and complete the note; return the scene's root nodes."""
    from fba.face import FaceModel
    from fba.formats.gltf._head import start_head
    from fba.gltf import PartWriter

    face = model or FaceModel.default()
    head = start_head(builder, clip, face, _shown(animation, face), None)
    node = head.add_head_node(None, np.eye(4), always=True)
    parents = {"": node, **head.add_joints(node, np.eye(4))}
    head.add_meshes({}, PartWriter(builder), False, parents)
    _note_face(builder, animation, note, face, head)
    return [node]


def _note_face(
    builder: Builder,
    animation: Animation,
    note: dict[str, Any],
    model: FaceModel | None,
    head: HeadParts | None,
) -> None:
    """Add the FAPs that the head shows to the note; without a head, their values."""
    from fba.face import FaceModel
    from fba.formats.gltf._fap_tracks import face_note

    if animation.face is None:
        return
    face = head.model if head is not None else model or FaceModel.default()
    targets, joints = ((), ()) if head is None else (head.targets, head.fap_joints)
    note["face"] = face_note(builder, animation.face, _shown(animation, face), face, targets, joints)


def _shown(animation: Animation, model: FaceModel) -> Float32:
    """Return the FAPs that a model shows, float32 (T, 68)."""
    from fba.face import resolve
    from fba.parameters import FAP_COUNT

    if animation.face is None:
        return np.zeros((len(animation), FAP_COUNT), dtype=np.float32)
    return resolve(animation.face, model)


def _local_motion(solver: BapSolver, baps: Int32) -> tuple[Float64, Float64]:
    """Return rotations (J, T, 3, 3) of joints relative to their parents, and positions (T, 3) of the root."""
    count, parents = len(solver.skeleton), solver.skeleton.parents
    turns = np.empty((count, len(baps), 3, 3))
    positions = np.empty((len(baps), 3))
    for start in range(0, len(baps), CHUNK):
        rows = slice(start, start + CHUNK)
        world = solver.pose(baps[rows])[..., :3, :]
        positions[rows] = world[:, 0, :, 3]
        turns[0, rows] = world[:, 0, :, :3]
        for joint in range(1, count):
            above = world[:, parents[joint], :, :3]
            turns[joint, rows] = np.swapaxes(above, 1, 2) @ world[:, joint, :, :3]
    return turns, positions


def _add_skin(builder: Builder, joints: list[int], bind: Float64, root: int) -> None:
    """Add skin 0. bind: (J, 4, 4), the joints in the bind pose."""
    inverse = np.linalg.inv(bind)
    inverse[:, 3] = (0, 0, 0, 1)
    builder.add(
        "skins", {"joints": joints, "skeleton": root, "inverseBindMatrices": builder.matrices(inverse)}
    )
