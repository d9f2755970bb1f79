"""The motion of a face in a glTF file as FAPs: weights of morph targets, expressions of VRMA, eyes and jaws.

`fba.capture.blendshapes.shape_table` has the FAPs of shapes.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fba.animation import FaceTrack
from fba.arrays import Bool, Float64
from fba.capture import shape_faps
from fba.capture.blendshapes.combination import JAW_OPEN, RADIAN, combine, to_face_track
from fba.errors import FbaWarning, warn
from fba.formats.gltf._pose import Sampler, nearest_rotation, sample
from fba.formats.gltf.clips import choose_clip
from fba.formats.gltf.humanoid import find_humanoid
from fba.gltf import Clip, Gltf, Value, optional_member
from fba.parameters import FAP_COUNT, fap_numbers

NO_EYE = re.compile("brow|lid|lash|end|target|look|aim")
"""Parts of names of bones near eyes."""
BONES = {
    "l": re.compile("left_?eye|eye(ball)?_?left|(^|_)l_?(face)?_?eye(ball)?$|eye(ball)?[_.]?l$"),
    "r": re.compile("right_?eye|eye(ball)?_?right|(^|_)r_?(face)?_?eye(ball)?$|eye(ball)?[_.]?r$"),
    "jaw": re.compile("(^|_)(lower)?jaw(bone|root|_?master)?$"),
}
"""Names, in lower case, of bones of the left and the right eye and the jaw."""
LIMBS = {"leftUpperArm", "rightUpperArm", "leftUpperLeg", "rightUpperLeg"}
MAX_NAMES = 6
"""Most names in a message."""


def read_face_motion(gltf: Gltf, clip: Clip, times: Float64, *, head: bool = False) -> FaceTrack | None:
    """Return the FAPs of a clip at times (T,), seconds; None if it does not move a face.

    head: let FAPs 48 to 50 turn like the declared bone of a head, or a mesh with morph targets and no skin.

    Warns (FbaWarning) of morph targets with unknown names.
    """
    values = np.zeros((len(times), FAP_COUNT))
    sent = np.zeros(FAP_COUNT, dtype=bool)
    if head and (turns := _mesh_turns(gltf, clip, times)) is not None:
        _turn_head(turns, values, sent)
    turned = np.zeros(FAP_COUNT, dtype=bool)  # where eyes turn, shapes that look aside move their lids
    _turn_eyes(_gaze(gltf, clip, times), "lr", values, turned)
    for node, kind in _face_bones(gltf, clip):
        forward = _turns(gltf, clip, times, node)[:, :, 2]
        if kind == "jaw":
            opened = np.arctan2(-forward[:, 1], forward[:, 2]) / JAW_OPEN
            _add(combine({"jawOpen": opened}, len(times)), values, sent)
        else:
            _turn_eyes(forward, kind, values, turned)
    sent |= turned
    _add(combine(_weights(gltf, clip, times), len(times), but=turned), values, sent)
    return to_face_track(values, sent) if sent.any() else None


def _add(motion: tuple[Float64, Bool], values: Float64, sent: Bool) -> None:
    """Add FAPs (T, 68) and their mask (68,)."""
    values += motion[0]
    sent |= motion[1]


def find_face_clip(gltf: Gltf, clip: str | int | None) -> Clip | None:
    """Return the clip of this name or number, or the first, that moves a face; None without one.

    Blender writes an action for each object that a take moves, "head|Take 1" and "eyes|Take 1": they become
    one clip.
    """
    clips = gltf.animations if clip is None else [choose_clip(gltf, clip, range(len(gltf.nodes)))]
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        chosen = next((each for each in clips if read_face_motion(gltf, each, np.zeros(1)) is not None), None)
    if chosen is None or "|" not in chosen.name:
        return chosen
    channels = list(chosen.channels)
    for other in gltf.animations:
        taken = {(channel.node, channel.path) for channel in channels}
        added = {(channel.node, channel.path) for channel in other.channels}
        if other.name.partition("|")[2] == chosen.name.partition("|")[2] and not added & taken:
            channels += other.channels
    return replace(chosen, channels=tuple(channels))


def nodes_of_faces(gltf: Gltf) -> frozenset[int]:
    """Return the nodes that only a face uses: expressions and gaze of VRMA, and a head without limbs."""
    look = optional_member(optional_member(_animation_extension(gltf), "lookAt"), "node")
    nodes = [node for _, node in _expressions(gltf)]
    humanoid = find_humanoid(gltf)
    if humanoid is not None and not LIMBS & set(humanoid.bones):
        nodes += humanoid.bones.values()
    return frozenset([*nodes, *([] if look is None else [look.index(len(gltf.nodes), "node")])])


def _weights(gltf: Gltf, clip: Clip, times: Float64) -> dict[str, Float64]:
    """Return the weights (T,) of morph targets and of VRMA's expressions by name; warns of unknown targets.

    Meshes with targets of the same name share their weights: the first mesh counts.
    """
    result: dict[str, Float64] = {}
    unknown = []
    for channel in clip.channels:
        mesh = gltf.nodes[channel.node].mesh
        if channel.path != "weights" or mesh is None:
            continue
        weights = sample(channel, times)
        for column, name in enumerate(gltf.meshes[mesh].morph_names):
            if shape_faps(name) is None and np.ptp(channel.values.reshape(len(channel.times), -1)) > 0:
                unknown.append(name)
            result.setdefault(name, weights[:, column])
    for name, node in _expressions(gltf):
        shift = next((c for c in clip.channels if (c.node, c.path) == (node, "translation")), None)
        if shift is not None:
            result.setdefault(name, np.clip(sample(shift, times)[:, 0], 0.0, 1.0))
    strange = sorted(set(unknown))
    if strange:
        warn(
            f"{gltf.file}: {len(strange)} animated morph targets are left out, as their names say no FAP: "
            f"{', '.join(strange[:MAX_NAMES])}{', ...' if len(strange) > MAX_NAMES else ''}",
            stacklevel=6,
        )
    return result


def _animation_extension(gltf: Gltf) -> Value | None:
    return optional_member(gltf.document.get("extensions"), "VRMC_vrm_animation")


def _expressions(gltf: Gltf) -> list[tuple[str, int]]:
    """Return names and nodes of the expressions that a VRMA file animates."""
    listed = optional_member(_animation_extension(gltf), "expressions")
    result = []
    for group in ("preset", "custom"):
        entries = optional_member(listed, group)
        for name, entry in entries.members() if entries is not None else ():
            result.append((name, entry.member("node").index(len(gltf.nodes), "node")))
    return result


def _gaze(gltf: Gltf, clip: Clip, times: Float64) -> Float64 | None:
    """Return the directions (T, 3) of the gaze in a VRMA file, +z ahead; None without a gaze."""
    node = optional_member(optional_member(_animation_extension(gltf), "lookAt"), "node")
    if node is None:
        return None
    number = node.index(len(gltf.nodes), "node")
    if not any((channel.node, channel.path) == (number, "rotation") for channel in clip.channels):
        return None
    return nearest_rotation(Sampler(gltf, clip.channels, times).linear(number))[:, :, 2]


def _turn_eyes(forward: Float64 | None, sides: str, values: Float64, sent: Bool) -> None:
    """Add the turns of eyes that look in directions (T, 3), +x to the subject's left."""
    if forward is None:
        return
    yaw = np.arctan2(forward[:, 0], forward[:, 2]) * RADIAN
    pitch = np.arctan2(-forward[:, 1], np.hypot(forward[:, 0], forward[:, 2])) * RADIAN
    for side in sides:
        for name, angles in ((f"yaw_{side}_eyeball", yaw), (f"pitch_{side}_eyeball", pitch)):
            column = fap_numbers()[name] - 1
            values[:, column] += angles
            sent[column] = True


def _mesh_turns(gltf: Gltf, clip: Clip, times: Float64) -> Float64 | None:
    """Return turns (T, 3, 3) of a face from its place at rest, in the axes of the scene.

    The face is the declared bone of a head, else the first mesh without a skin whose morph targets move. None
    if neither the face nor a node above it turns.
    """
    humanoid = find_humanoid(gltf)
    declared = humanoid.bones.get("head") if humanoid is not None else None
    nodes = [channel.node for channel in clip.channels if channel.path == "weights"]
    faces = [node for node in nodes if gltf.nodes[node].mesh is not None and gltf.nodes[node].skin is None]
    face = declared if declared is not None else next(iter(faces), None)
    if face is None:
        return None
    above: list[int] = []
    node: int | None = face
    while node is not None:
        above.append(node)
        node = gltf.nodes[node].parent
    if not any(channel.path == "rotation" and channel.node in above for channel in clip.channels):
        return None
    sampler = Sampler(gltf, clip.channels, times)
    linear = np.broadcast_to(np.eye(3), (len(times), 3, 3))
    for number in reversed(above):
        linear = linear @ sampler.linear(number)
    return nearest_rotation(linear) @ nearest_rotation(gltf.nodes[face].world[:3, :3]).T


def _turn_head(turns: Float64, values: Float64, sent: Bool) -> None:
    """Add turns (T, 3, 3) of a head, which looks along +z at rest: yaw, then roll, then pitch."""
    angles = {
        "head_pitch": np.unwrap(np.arctan2(-turns[:, 1, 2], turns[:, 1, 1])),
        "head_yaw": np.unwrap(np.arctan2(-turns[:, 2, 0], turns[:, 0, 0])),
        "head_roll": np.arcsin(np.clip(turns[:, 1, 0], -1.0, 1.0)),
    }
    for name, turned in angles.items():
        values[:, fap_numbers()[name] - 1] += turned * RADIAN
        sent[fap_numbers()[name] - 1] = True


def _face_bones(gltf: Gltf, clip: Clip) -> list[tuple[int, str]]:
    """Return the declared or named bones of the face that a clip turns: node, and kind, a key of `BONES`."""
    turned = [channel.node for channel in clip.channels if channel.path == "rotation"]
    humanoid = find_humanoid(gltf)
    declared: Mapping[str, int] = {} if humanoid is None else humanoid.bones
    result = []
    for kind, bone in (("l", "leftEye"), ("r", "rightEye"), ("jaw", "jaw")):
        if humanoid is not None:
            nodes = [declared[bone]] if bone in declared else []
        else:
            nodes = [node for node in turned if is_named(gltf.nodes[node].name, kind)]
        result += [(node, kind) for node in nodes[:1] if node in turned]
    return result


def is_named(name: str, kind: str) -> bool:
    """Whether the name of a bone is usual for an eye or the jaw. kind: a key of `BONES`."""
    plain = name.rpartition(":")[2].lower()
    return BONES[kind].search(plain) is not None and (kind == "jaw" or NO_EYE.search(plain) is None)


def _turns(gltf: Gltf, clip: Clip, times: Float64, node: int) -> Float64:
    """Return turns (T, 3, 3) of a bone of the head from its rest pose, in the axes of the scene at rest.

    People of VRM 0 face -z, and are turned to +z.
    """
    parent = gltf.nodes[node].parent
    above = np.eye(3) if parent is None else nearest_rotation(gltf.nodes[parent].world[:3, :3])
    humanoid = find_humanoid(gltf)
    if humanoid is not None and humanoid.kind == "VRM 0":
        above = np.diag([-1.0, 1.0, -1.0]) @ above
    rest = nearest_rotation(gltf.nodes[node].local[:3, :3])
    local = nearest_rotation(Sampler(gltf, clip.channels, times).linear(node))
    result: Float64 = above @ local @ rest.T @ above.T
    return result
