"""Bodies of other makers for display: any skinned person in a glTF file becomes a body that BAPs move.

The person's joints are matched with the standard's as those of a motion are (`fba.capture`). Then all joints
of the standard are placed on the person: matched joints where the person has them, others between them as in
the default body. The vertices of a joint of the file follow the joint of the standard that turns like it:
those of a bone of the spine, for example, follow the vertebra in its middle (`fba.capture._spine`).
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fba import rotations
from fba.animation import Animation
from fba.arrays import Float32, Float64, Int32
from fba.body import ROOT, BodyModel, BodyPart, Skeleton
from fba.body.own_head import OwnHead
from fba.body.skin.skin_weights import strongest_weights
from fba.capture import SkeletonMotion, SkeletonOptions, shape_faps
from fba.capture.preparation import Rest, find_rest
from fba.errors import FormatError, ModelError, warn
from fba.formats.gltf._own_heads import PlacedMesh, read_head
from fba.formats.gltf._pose import bind_matrices
from fba.formats.gltf._reader import make_person
from fba.formats.gltf._skeletons import Joints, find_joints
from fba.formats.gltf.clips import ClipInfo, list_clips
from fba.gltf import Gltf, GltfMaterial, Node, Primitive, convert_material, read_gltf
from fba.limits import DEFAULT_LIMITS, Limits
from fba.mesh import Material, UniqueNames
from fba.source import Path, naming_file, stem_of

CHUNK = 20_000
"""Vertices whose weights are reduced at once."""
VERTEX_BYTES = 600
"""Memory that a vertex takes without its morph targets, which are not read."""
NEEDED_JOINTS = {
    "skullbase": "head",
    **{
        f"{side}_{joint}": f"{word} {name}"
        for side, word in (("l", "left"), ("r", "right"))
        for joint, name in (
            ("hip", "thigh"),
            ("knee", "shank"),
            ("ankle", "foot"),
            ("shoulder", "upper arm"),
            ("elbow", "forearm"),
            ("wrist", "hand"),
        )
    },
}
"""Joints of the standard that a body must have, and the bones that begin there."""
KINDS = {"hair": "hair", "skin": "skin", "body": "skin", "head": "skin", "face": "skin", "shoe": "shoe",
         "footwear": "shoe"}  # fmt: skip
"""Kinds of parts by words in the names of meshes and materials; other parts are cloth."""


def import_body(
    path: Path, *, joints: Mapping[str, str] | None = None, limits: Limits = DEFAULT_LIMITS
) -> BodyModel:
    """Return the body in a glTF file that `BodyModel.save` wrote, or any skinned person as a body.

    joints: as for `fba.capture.from_skeleton`. The body is scaled so that its hips are as high as the default
    body's, and the steps of a stream fit it; `notes` has the factor. It has no place for a face: its own head
    is shown, which FAPs move if it has shapes with known names (`shape_faps.csv`), or expressions of VRM.

    Raises FormatError if the file cannot be read, shows no person, or the person lacks a limb; LimitError if
    it takes more memory than the limits allow.
    """
    try:
        gltf = read_gltf(path, limits=limits)
        extensions = gltf.document.get("extensions")
        if extensions is not None and extensions.get("FBA_body") is not None:
            return BodyModel.load(path, limits=limits)
        return _import_person(gltf, path, joints)
    except ModelError as error:
        call = f"{__name__}.import_body"
        remedies = [replace(each, call=call) for each in error.remedies]
        finding = error.finding.removeprefix(f"{os.path.basename(path)}: ")
        raise FormatError(finding, path=path).with_remedies(*remedies) from error


def read_skeleton(path: Path, *, limits: Limits = DEFAULT_LIMITS) -> SkeletonMotion:
    """Return the skeleton of a skinned person at rest, without frames, to be mapped by its joints' names."""
    gltf = read_gltf(path, limits=limits)
    return find_joints(gltf).resting(gltf)


@dataclass(frozen=True)
class PersonInfo:
    """A person in a file without an animation.

    declared: "VRM 0" or "VRM 1" if the file declares its bones, else "". joints: count from the hips down.
    matched: count of those that are joints of the standard. meshes: count in the scene. shapes: count of
    morph targets with known names.
    """

    declared: str
    joints: int
    matched: int
    meshes: int
    shapes: int


@dataclass(frozen=True, eq=False)
class Content:
    """What a glTF file holds: its clips and an animation, or a person without any."""

    clips: tuple[ClipInfo, ...] = ()
    animation: Animation | None = None
    person: PersonInfo | None = None


def describe(path: Path, *, clip: str | int | None = None, limits: Limits = DEFAULT_LIMITS) -> Content:
    """Return the content of a glTF file. clip, errors and warnings: as for reading it."""
    gltf = read_gltf(path, limits=limits)
    if not gltf.animations and (person := _describe_person(gltf)) is not None:
        return Content(person=person)
    with naming_file(path):
        made = make_person(gltf, SkeletonOptions(), clip, None, limits)
    return Content(list_clips(gltf), made.animation)


def _describe_person(gltf: Gltf) -> PersonInfo | None:
    """Return the person in a file, or None."""
    try:
        found = find_joints(gltf)
        rest = find_rest(found.resting(gltf), Skeleton.default())
    except ModelError:
        return None
    meshes = [gltf.nodes[node].mesh for node in gltf.shown() if gltf.nodes[node].mesh is not None]
    names = {name for mesh in gltf.meshes for name in mesh.morph_names if shape_faps(name) is not None}
    declared = "" if found.humanoid is None else found.humanoid.kind
    return PersonInfo(declared, len(found.used), len(rest.mapped), len(meshes), len(names))


@dataclass(frozen=True, eq=False)
class _Fit:
    """The standard's skeleton on a person, in the body's axes, in the file's unit.

    turn: (3, 3), from the scene's axes to the body's. places: (J, 3) and turns: (J, 3, 3), joints as
    modelled; turns are relative to the default posture.
    """

    skeleton: Skeleton
    turn: Float64
    places: Float64
    turns: Float64

    @property
    def centres(self) -> Float64:
        """(J, 3): joints in the default posture, the root where it is modelled."""
        centres = self.places.copy()
        for joint, parent in enumerate(self.skeleton.parents.tolist()):
            if parent >= 0:
                offset = self.places[joint] - self.places[parent]
                centres[joint] = centres[parent] + self.turns[parent].T @ offset
        return centres


def _import_person(gltf: Gltf, path: Path, joints: Mapping[str, str] | None) -> BodyModel:
    if not gltf.skins:
        raise ModelError(
            f"{gltf.file}: has no skin, so nothing tells which joints carry its meshes; expected a person "
            "whose mesh is bound to a skeleton"
        )
    found = find_joints(gltf)
    skeleton = Skeleton.default()
    standing = find_rest(found.resting(gltf), skeleton, joints)
    mapped = standing.mapped
    lacking = [bone for joint, bone in NEEDED_JOINTS.items() if joint not in mapped]
    if lacking:
        raise ModelError(
            f"{gltf.file}: its skeleton has no {', no '.join(lacking[:6])}{', ...' if lacking[6:] else ''}; "
            "expected a person with a head, arms and legs"
        )
    fit = _fit(standing, skeleton)
    meshes = _read_parts(gltf, found, _carriers(gltf, found, mapped, skeleton), fit)
    parts = [mesh.part for mesh in meshes]
    if not parts:
        raise ModelError(f"{gltf.file}: no mesh hangs on its skeleton; there is nothing to show")
    name = stem_of(path)
    head = read_head(gltf, found.humanoid, meshes, fit.turn)
    return _stand(BodyModel(tuple(parts), *_bound(fit, fit.places), name=name, own_head=head), name)


def _fit(rest: Rest, skeleton: Skeleton) -> _Fit:
    """Place all joints of the standard on a person."""
    mapped, positions = rest.mapped, rest.positions
    numbers = {joint: skeleton.number(joint) for joint in skeleton.names}
    size = _size(positions, mapped, skeleton)
    places, turns = np.zeros((len(skeleton), 3)), np.zeros((len(skeleton), 3, 3))
    parents = skeleton.parents.tolist()
    for joint, number in numbers.items():
        above = turns[parents[number]] if parents[number] >= 0 else np.eye(3)
        turned = rest.corrections.get(joint) if joint in mapped or joint == "sacroiliac" else None
        turns[number] = above if turned is None else turned
        if joint in mapped:
            places[number] = positions[mapped[joint]]
            continue
        start = number
        while skeleton.names[start] not in mapped:
            start = parents[start]
        if joint == "sacroiliac":
            places[number] = places[start]
            continue
        below = skeleton.descendants(number)[1:]
        end = next((n for n in below if skeleton.names[n] in mapped), None)
        step = turns[start] @ (skeleton.centres[number] - skeleton.centres[start])
        if end is None:
            places[number] = places[start] + size * step
            continue
        ours = turns[start] @ (skeleton.centres[end] - skeleton.centres[start])
        theirs = positions[mapped[skeleton.names[end]]] - places[start]
        long, wanted = float(np.linalg.norm(ours)), float(np.linalg.norm(theirs))
        if min(long, wanted) > 1e-9:
            step = wanted / long * (rotations.between(ours, theirs) @ step)
        places[number] = places[start] + step
    return _Fit(skeleton, rest.turn, places, turns)


def _size(positions: Float64, mapped: Mapping[str, int], skeleton: Skeleton) -> float:
    """Return the ratio of the person's legs to the default body's."""
    ours = theirs = 0.0
    for side in "lr":
        for joint, below in pairwise((f"{side}_hip", f"{side}_knee", f"{side}_ankle")):
            bone = skeleton.centres[skeleton.number(below)] - skeleton.centres[skeleton.number(joint)]
            ours += float(np.linalg.norm(bone))
            theirs += float(np.linalg.norm(positions[mapped[below]] - positions[mapped[joint]]))
    return theirs / ours


def _bound(fit: _Fit, places: Float64) -> tuple[Skeleton, Float64]:
    """Return the skeleton in the default posture, and its joints (J, 4, 4) as modelled, at places (J, 3)."""
    bind = np.zeros((len(places), 4, 4))
    bind[:, :3, :3], bind[:, :3, 3], bind[:, 3, 3] = fit.turns, places, 1.0
    return replace(fit.skeleton, centres=fit.centres), bind


def _stand(body: BodyModel, name: str) -> BodyModel:
    """Return a body scaled to the default body's legs, with its soles at height 0."""
    default, skeleton = Skeleton.default(), body.skeleton
    matrices = np.tile(np.eye(4), (len(skeleton), 1, 1))
    matrices[:, :3, 3] = skeleton.centres
    standing = body.skin(matrices)
    feet = [skeleton.number(f"{side}_{joint}") for side in "lr" for joint in ("midtarsal", "metatarsal")]
    on_feet = np.isin(body.joints[:, 0], feet)
    sole = float(standing[on_feet, 1].min() if on_feet.any() else standing[:, 1].min())
    hips = [skeleton.number("l_hip"), skeleton.number("r_hip")]
    height = float(skeleton.centres[hips, 1].mean()) - sole
    if not height > 0:
        raise ModelError(f"the hips of {name!r} are not above its feet; it cannot stand")
    size = float(default.centres[hips, 1].mean()) / height
    shift = default.centres[hips].mean(axis=0) - size * skeleton.centres[hips].mean(axis=0)
    shift[1] = -size * sole
    bind = np.array(body.bind)
    bind[:, :3, 3] = bind[:, :3, 3] * size + shift
    head = body.own_head
    return BodyModel(
        tuple(
            replace(part, vertices=(part.vertices * size + shift).astype(np.float32)) for part in body.parts
        ),
        replace(skeleton, centres=skeleton.centres * size + shift),
        bind,
        name=name,
        notes={"size": f"{size:.3f} times the file's, so that its hips are as high as the default body's"},
        own_head=None if head is None else _resize_head(head, size, shift),
    )


def _resize_head(head: OwnHead, size: float, shift: Float64) -> OwnHead:
    """Return a head scaled and moved with its body."""
    shapes = [replace(shape, shifts=shape.shifts * np.float32(size)) for shape in head.shapes]
    eyes = [replace(eye, centre=eye.centre * size + shift) for eye in head.eyes]
    return replace(head, shapes=shapes, eyes=eyes)


def _carriers(gltf: Gltf, found: Joints, mapped: Mapping[str, int], skeleton: Skeleton) -> dict[int, int]:
    """Return the joint of the skeleton that carries the vertices of each node, for the hips and all below."""
    followers = _followers(mapped, skeleton)
    joint_of = {found.nodes[found.used[row]]: joint for joint, row in mapped.items()}
    result: dict[int, int] = {}
    for node in gltf.order:
        parent = gltf.nodes[node].parent
        if node in joint_of:
            result[node] = skeleton.number(followers.get(joint_of[node], joint_of[node]))
        elif parent in result:
            result[node] = result[parent]
    return result


def _followers(mapped: Mapping[str, int], skeleton: Skeleton) -> dict[str, str]:
    """Return the joint that vertices of a joint of the person follow, where it is another joint.

    The parts of a foot, a clavicle and a bone of the spine share the turns of one joint of the person. The
    last part has all of these turns, and in the spine the part in the middle.
    """
    result = {}
    for side in "lr":
        result[f"{side}_ankle"] = f"{side}_midtarsal"
        result[f"{side}_sternoclavicular"] = f"{side}_acromioclavicular"
    chain = [skeleton.number("skullbase")]
    while skeleton.parents[chain[-1]] >= 0:
        chain.append(int(skeleton.parents[chain[-1]]))
    spine = [skeleton.names[number] for number in reversed(chain)]
    anchors = [joint for joint in spine if joint in mapped]
    for joint, above in pairwise(anchors):
        between = spine[spine.index(joint) : spine.index(above)]
        ends = [skeleton.centres[skeleton.number(end)][1] for end in (joint, above)]
        middle = sum(ends) / 2
        result[joint] = min(
            between, key=lambda each: abs(float(skeleton.centres[skeleton.number(each)][1]) - middle)
        )
    result[ROOT] = "sacroiliac"
    return result


def _read_parts(gltf: Gltf, found: Joints, carriers: dict[int, int], fit: _Fit) -> list[PlacedMesh]:
    """Return the meshes that hang on the person's joints, in the body's axes; warns of other meshes."""
    bound = bind_matrices(gltf, skins=found.humanoid is None)
    budget = gltf.budget.copy()
    names, left_out = UniqueNames(), []
    parts = []
    for number in gltf.shown():
        node = gltf.nodes[number]
        if node.mesh is None:
            continue
        for primitive in gltf.meshes[node.mesh].primitives:
            if not len(primitive.triangles):
                continue
            budget.charge(len(primitive.positions) * VERTEX_BYTES, gltf.document)
            carried = _carried(gltf, number, node, primitive, bound, carriers)
            if carried is None:
                left_out.append(node.name)
                continue
            matrices, joints, weights = carried
            linear = fit.turn @ matrices[..., :3, :3]
            places = np.einsum("vij,vj->vi", linear, primitive.positions) + matrices[:, :3, 3] @ fit.turn.T
            normals = None if primitive.normals is None else _unit(linear, primitive.normals)
            mirrored = float(np.linalg.det(linear[0])) < 0
            material = None if primitive.material is None else gltf.materials[primitive.material]
            look, texcoords, colours = _look(primitive, material)
            name = names(node.name if not node.name.startswith("node ") else gltf.meshes[node.mesh].name)
            part = BodyPart(
                name, _kind(name, material), places.astype(np.float32),
                primitive.triangles[:, ::-1].copy() if mirrored else primitive.triangles,
                joints, weights, normals, texcoords, colours, look,
            )  # fmt: skip
            parts.append(PlacedMesh(part, number, primitive, linear, bound))
    if left_out:
        warn(
            f"{gltf.file}: meshes that hang on no joint of the person are left out: "
            f"{', '.join(left_out[:5])}{', ...' if len(left_out) > 5 else ''}",
            stacklevel=5,
        )
    return parts


def _carried(
    gltf: Gltf,
    number: int,
    node: Node,
    primitive: Primitive,
    bound: Mapping[int, Float64],
    carriers: Mapping[int, int],
) -> tuple[Float64, Int32, Float32] | None:
    """Return matrices (V, 4, 4) to the scene with all joints as bound, and joints and weights (V, 4).

    None for a mesh that hangs on no joint of the person.
    """
    count = len(primitive.positions)
    if node.skin is None or primitive.joints is None or primitive.weights is None:
        above: int | None = number
        while above is not None and above not in carriers:
            above = gltf.nodes[above].parent
        if above is None:
            return None
        world = gltf.nodes[above].world
        matrix = bound.get(above, world) @ np.linalg.pinv(world) @ node.world
        joints, weights = np.zeros((count, 4), dtype=np.int32), np.zeros((count, 4), dtype=np.float32)
        joints[:, 0], weights[:, 0] = carriers[above], 1.0
        return np.broadcast_to(matrix, (count, 4, 4)), joints, weights
    skin = gltf.skins[node.skin]
    if not any(joint in carriers for joint in skin.joints):
        return None
    moves = np.stack(
        [bound[joint] @ inverse for joint, inverse in zip(skin.joints, skin.inverse_bind, strict=True)]
    )
    pelvis = Skeleton.default().number("sacroiliac")  # carries the vertices of joints above the hips
    standard = np.array([carriers.get(joint, pelvis) for joint in skin.joints])
    total = primitive.weights.sum(axis=1, dtype=np.float64)
    matrices = np.zeros((count, 4, 4))
    joints, weights = np.zeros((count, 4), dtype=np.int32), np.zeros((count, 4), dtype=np.float32)
    for start in range(0, count, CHUNK):
        rows = slice(start, start + CHUNK)
        dense = np.zeros((len(total[rows]), int(standard.max()) + 1))
        share = primitive.weights[rows] / np.where(total[rows] > 0, total[rows], 1.0)[:, None]
        share[total[rows] <= 0, 0] = 1.0
        for slot in range(primitive.joints.shape[1]):
            which = primitive.joints[rows, slot]
            matrices[rows] += share[:, slot, None, None] * moves[which]
            np.add.at(dense, (np.arange(len(which)), standard[which]), share[:, slot])
        joints[rows], weights[rows] = strongest_weights(dense)
    return matrices, joints, weights


def _unit(linear: Float64, normals: Float32) -> Float32:
    """Return normals turned by (V, 3, 3), of length 1."""
    turned = np.einsum("vij,vj->vi", linear, normals)
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    unit = np.where(length > 0, turned / np.where(length > 0, length, 1.0), (0.0, 0.0, 1.0))
    return np.asarray(unit, dtype=np.float32)


def _look(
    primitive: Primitive, material: GltfMaterial | None
) -> tuple[Material, Float32 | None, Float32 | None]:
    """Return material, texture coordinates and colours of a part."""
    if material is None:
        return Material(), None, None
    texcoords = (
        primitive.texcoords[material.texcoord] if material.texcoord < len(primitive.texcoords) else None
    )
    texture = None if texcoords is None else material.texture
    look = convert_material(material, texture)
    colours = None
    if primitive.colours is not None and texture is None:
        colours = primitive.colours.copy()
        colours[:, :3] *= np.array(material.colour[:3], dtype=np.float32)
        colours[:, 3] = 1.0 - material.roughness
    return look, texcoords if texture is not None else None, colours


def _kind(name: str, material: GltfMaterial | None) -> str:
    words = f"{name} {'' if material is None else material.name}".lower()
    return next((kind for word, kind in KINDS.items() if word in words), "cloth")
