"""MakeHuman's base mesh with its default rig, as a body that BAPs move.

Users provide a copy (the files are CC0): the base mesh "hm08" (`base.obj`), its rig
(`default.mhskel`) and the weights (`default_weights.mhw`) in one folder. `makehuman.csv` gives the positions
and bones of the rig for each joint of the standard; the vertebrae are distributed along its spine.
`makehuman_neck.csv` lists the ring of vertices at which its head models end.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

from fba.arrays import Bool, Float64, Int64
from fba.body._model import BodyModel, BodyPart, Material
from fba.body._skeleton import Skeleton
from fba.body.skin.skin_weights import strongest_weights
from fba.body.solve._bind_pose import (
    bind_matrices,
    chain_weights,
    place_vertebrae,
    skeleton_in_default_posture,
    vertebrae_between,
)
from fba.errors import FormatError, ModelError
from fba.gltf import MAX_ITEMS, Value, parse_json
from fba.mesh import Polygons, connected, read_obj, triangulate, vertex_normals
from fba.sampling import smoothstep
from fba.text_files import packaged_rows, read_bytes

METRES = 0.1
"""Metres per unit of the base mesh."""
VERTICES = 19158
"""Number of vertices of the base mesh hm08."""
SPINE = ("spine05", "spine04", "spine03", "spine02", "spine01", "neck01", "neck02", "neck03", "head")
"""Bones of the spine, upwards."""
NECK = ("neck01", "neck02", "neck03")
TRUNK = (
    "root",
    "pelvis.L",
    "pelvis.R",
    *(f"spine0{number}" for number in range(1, 6)),
    "breast.L",
    "breast.R",
)
BLADE_FROM = 0.3
"""Share of the distance from breastbone to arm at which weights begin to pass to the shoulder blade."""
BLADE_AT = 0.75
"""Share of that distance from which the shoulder blade has all the weight."""
SKULL_ONLY = 0.999
"""Skull weight above which a vertex belongs to the head."""
SKIN = Material("skin", (0.71, 0.47, 0.36), 0.55)
EYE = Material("eye", (0.75, 0.72, 0.70), 0.2)
MAX_WEIGHTS = 1 << 20
RIG_FILE = "default.mhskel"
WEIGHTS_FILE = "default_weights.mhw"


def import_makehuman(path: str | os.PathLike[str], *, name: str = "MakeHuman") -> BodyModel:
    """Return the body of MakeHuman's base mesh on the standard's joints.

    path: the folder with base.obj, default.mhskel and default_weights.mhw, or that base.obj. Its head is a
    part of kind "head", left out where a face is put on the body. Raises FormatError where a file is
    missing; ModelError, with the position in it, where it is damaged or of another mesh or rig.
    """
    base = Path(path) / "base.obj" if Path(path).is_dir() else Path(path)
    folder = base.parent
    mesh = read_obj(_require_file(base))
    body = _triangles(mesh, "body")
    if len(mesh.vertices) != VERTICES or not len(body):
        raise ModelError(
            f"{folder}: this is not MakeHuman's base mesh hm08: {len(mesh.vertices)} vertices instead of "
            f"{VERTICES}"
        )
    low = mesh.vertices[body].reshape(-1, 3)[:, 1].min()
    vertices = (mesh.vertices - (0.0, low, 0.0)) * METRES
    rig = _json(folder / RIG_FILE)
    bones, position_of = _rig(rig, vertices)
    positions = _joint_positions(position_of, rig)
    bind = bind_matrices(positions)
    weights = _weights(_json(folder / WEIGHTS_FILE), bones, vertices, positions)
    pupils = np.array([position_of(rig, f"eye.{side}____head") for side in "LR"])
    pupils[:, 2] += _eye_radius(mesh, vertices)
    return BodyModel(
        parts=_parts(mesh, vertices, weights),
        skeleton=skeleton_in_default_posture(bind),
        bind=bind,
        eyes=pupils,
        name=name,
        notes={
            "source": "MakeHuman base mesh hm08 with its default rig",
            "licence": "CC0, as stated in the files",
        },
    )


class _RigPositions:
    """Returns positions of joints, each the mean of several vertices; called with the rig and a name."""

    def __init__(self, joints: Mapping[str, Value], vertices: Float64) -> None:
        self._joints = joints
        self._vertices = vertices

    def __call__(self, rig: Value, name: str) -> Float64:
        if name not in self._joints:
            raise rig.error(f"there is no joint {name!r}; is it MakeHuman's default rig?")
        entry = self._joints[name]
        rows = [value.index(len(self._vertices), "vertex") for value in entry.elements(1000)]
        if not rows:
            raise entry.error("a joint needs at least one vertex")
        return np.asarray(self._vertices[rows].mean(axis=0))


def _json(path: Path) -> Value:
    return Value(parse_json(memoryview(read_bytes(_require_file(path))), path.name), path.name)


def _require_file(path: Path) -> Path:
    """Return the path, if there is a file; else FormatError."""
    if not path.is_file():
        raise FormatError("cannot be read: there is no such file", path=path)
    return path


def _triangles(mesh: Polygons, *groups: str) -> Int64:
    """Return int64 (F, 3): triangles of the named groups."""
    return triangulate(mesh, mesh.in_groups(*groups)).corners.astype(np.int64)


def _rig(rig: Value, vertices: Float64) -> tuple[dict[str, str | None], _RigPositions]:
    """Return each bone's parent, and the positions of the joints."""
    bones: dict[str, str | None] = {}
    for name, entry in rig.member("bones").members():
        parent = entry.get("parent")
        bones[name] = None if parent is None or parent.data is None else parent.text(200)
        if len(bones) > MAX_ITEMS:
            raise rig.error(f"more than {MAX_ITEMS} bones")
    return bones, _RigPositions(dict(rig.member("joints").members()), vertices)


@cache
def _rows() -> tuple[tuple[str, str, str, float, tuple[str, ...]], ...]:
    """Return rows (joint, from, to, share, bones) of makehuman.csv, for both sides."""
    rows = []
    for row in packaged_rows(__package__, "makehuman.csv"):
        for side, rig_side in (("l", "L"), ("r", "R")) if "?" in row["joint"] else (("", ""),):
            words = [row[key].replace("?", rig_side) for key in ("from", "to", "bones")]
            joint = row["joint"].replace("?", side)
            rows.append((joint, words[0], words[1], float(row["share"]), tuple(words[2].split())))
    return tuple(rows)


def _joint_positions(position_of: _RigPositions, rig: Value) -> Float64:
    """Return (J, 3) positions of the standard's joints, metres."""
    default = Skeleton.default()
    positions = np.full((len(default), 3), np.nan)
    for joint, start, end, share, _ in _rows():
        first = position_of(rig, start)
        positions[default.number(joint)] = first + ((position_of(rig, end) - first) * share if end else 0.0)
    for side in "lr":  # the foot's joints lie lower than the line between ankle and toes
        ankle = positions[default.number(f"{side}_ankle")]
        positions[default.number(f"{side}_subtalar"), 1] = ankle[1] * 0.55
    knots = np.array([position_of(rig, f"{bone}____head") for bone in SPINE])
    knots = np.concatenate([positions[default.number("HumanoidRoot")][None], knots])
    knots = knots[np.concatenate([[True], np.diff(np.maximum.accumulate(knots[:, 1])) > 0])]
    positions[default.number("skullbase")] = knots[-1]
    neck = int(np.abs(knots[:, 1] - position_of(rig, "neck01____head")[1]).argmin())
    place_vertebrae(positions, knots, neck)
    return positions


def _weights(content: Value, bones: dict[str, str | None], vertices: Float64, positions: Float64) -> Float64:
    """Return (V, J) weight of each of the standard's joints for each vertex."""
    default = Skeleton.default()
    given = {name: np.zeros(len(vertices)) for name in bones}
    for bone, listed in content.member("weights").members():
        if bone not in given:
            raise listed.error(f"the rig has no bone {bone!r}")
        for entry in listed.elements(MAX_WEIGHTS):
            pair = entry.elements(2)
            if len(pair) != 2:
                raise entry.error("expected a vertex and its weight")
            given[bone][pair[0].index(len(vertices), "vertex")] += pair[1].number(0.0, 1e6)
    weights = np.zeros((len(vertices), len(default)))
    taken = set(TRUNK) | set(NECK)
    for joint, _, _, _, names in _rows():
        for bone in names:
            if bone not in given:
                raise content.error(f"the rig has no bone {bone!r}; is it MakeHuman's default rig?")
            weights[:, default.number(joint)] += given[bone]
            taken.add(bone)
    for names, row in (
        (TRUNK, ("sacroiliac", *vertebrae_between("vl5", "vc7"))),
        (NECK, (*vertebrae_between("vt1", "vc1"), "skullbase")),
    ):
        numbers = [default.number(name) for name in row]
        share = np.sum([given[name] for name in names if name in given], axis=0)
        weights[:, numbers] += share[:, None] * chain_weights(
            vertices[:, 1], positions[numbers, 1], 1 if names is TRUNK else 0
        )
    for side in "lr":  # the shoulder girdle: weight near the arm goes to the blade
        inner, outer, arm = (
            default.number(f"{side}_{name}") for name in ("sternoclavicular", "acromioclavicular", "shoulder")
        )
        line = positions[arm] - positions[inner]
        along = (vertices - positions[inner]) @ line / max(float(line @ line), 1e-12)
        far = smoothstep((along - BLADE_FROM) / (BLADE_AT - BLADE_FROM))
        weights[:, outer] += weights[:, inner] * far
        weights[:, inner] -= weights[:, outer]
    skull = default.number("skullbase")
    for bone in bones:
        if bone not in taken:  # bones of the head
            weights[:, skull] += given[bone]
    total = weights.sum(axis=1, keepdims=True)
    weights[total[:, 0] <= 0, skull] = 1.0
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _eye_radius(mesh: Polygons, vertices: Float64) -> float:
    eye = vertices[np.unique(_triangles(mesh, "helper-l-eye"))]
    return float(np.ptp(eye[:, 2])) / 2 if len(eye) else 0.0


@cache
def _neckline() -> tuple[int, ...]:
    return tuple(int(row["vertex"]) for row in packaged_rows(__package__, "makehuman_neck.csv"))


def _above_neckline(triangles: Int64, vertices: Float64) -> Bool:
    """Return (F,) mask of the triangles above the neckline, where head models made of this mesh end too."""
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    sides = sides[~np.isin(sides, _neckline()).any(axis=1)]
    label = connected(sides, len(vertices))
    used = np.unique(triangles)
    crown = used[vertices[used, 1].argmax()]
    return np.asarray((label[triangles] == label[crown]).any(axis=1))


def _parts(mesh: Polygons, vertices: Float64, weights: Float64) -> tuple[BodyPart, ...]:
    """Return the parts: body, neck, head, and the head's eyes."""
    default = Skeleton.default()
    skull = weights[:, default.number("skullbase")]
    body = _triangles(mesh, "body")
    above = _above_neckline(body, vertices)
    head = above & (skull[body] > SKULL_ONLY).all(axis=1)
    throat = above & ~head
    spine = [name[0] == "v" or name == "sacroiliac" for name in default.names]
    joints, strong = strongest_weights(weights, spine)
    normals = vertex_normals(vertices, body)
    eyes = _triangles(mesh, "helper-l-eye", "helper-r-eye")
    rows = (
        ("skin", "skin", body[~head & ~throat], normals, SKIN),
        ("neck", "neck", body[throat], normals, SKIN),
        ("head", "head", body[head], normals, SKIN),
        ("eyes", "head", eyes, vertex_normals(vertices, eyes) if len(eyes) else normals, EYE),
    )
    parts = []
    for name, kind, triangles, upright, material in rows:
        if not len(triangles):
            continue
        used, corners = np.unique(triangles, return_inverse=True)
        part = BodyPart(
            name, kind, vertices[used].astype(np.float32), corners.reshape(-1, 3).astype(np.int32),
            joints[used], strong[used], normals=upright[used], material=material,
        )  # fmt: skip
        parts.append(part)
    return tuple(parts)
