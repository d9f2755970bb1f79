"""A face on a body: neck and skull move its vertices, so that face and body share a skin."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from fba.arrays import Array, Bool, Float32, Float64, Int32, Int64
from fba.body._model import BodyModel, BodyPart
from fba.body.skin.skin_weights import INFLUENCES, checked_weights, strongest_weights
from fba.body.skin.skinning import Skinner, build_skinner
from fba.cache import load_or_make, make_key
from fba.choices import SkinMethod
from fba.errors import ModelError
from fba.mesh import checked_rows, connected
from fba.sampling import smoothstep

SKULL = "skullbase"
"""The joint that carries the head, and that FAP 48 to 50 turn it on (ISO/IEC 14496-2, annex C)."""
SAME_SIZE = 0.005
"""Difference from size 1 up to which a face keeps its size."""
WITH_NECK = 0.010
"""Distance from the body's neck up to which a vertex of the face moves with the neck, metres."""
WITH_SKULL = 0.030
"""Distance from the body's neck from which a vertex of the face moves with the skull only, metres."""
NEIGHBOURS = 4
SAME_PLACE = 1e-5
"""Metres within which two vertices are the same."""
PAIR_DISTANCE = 0.01
"""Metres within which vertices are paired at first."""
MAX_ROUNDS = 20
"""Largest number of rounds in which a face is moved by the median offset of its pairs."""
RIM = 0.3
"""Smallest width of a neck's lower rim, as a share of the neck's."""
SEAM = 0.002
"""Distance to the body's neck, metres, up to which a face's own neck meets it."""

CACHED_VERTICES = 4000
"""Number of vertices from which results for a face are cached on disk."""
CACHE_VERSION = 1
"""Version of cached results; increment when results change."""


@dataclass(frozen=True, eq=False)
class AttachedHead:
    """A face on a body, moved with the body's joints; `attach_head` makes it.

    place: float64 (4, 4), from the face's frame into the body's, as modelled; its scale is size, its shift
    float32 (3,) metres. joints: int32 (V, 4), weights: float32 (V, 4), by which the body moves the face's
    vertices. hidden: (V,) mask of vertices beyond the lower edge of the body's neck, which its clothes hide.
    brings_neck: whether the face has a neck that meets the body; the body's own must then not be shown.
    skull: number of the joint that carries the head. below: numbers of that joint and its descendants.
    skull_bind: float64 (4, 4), that joint as modelled. skinner: moves the vertices.
    """

    place: Float64
    size: float
    shift: Float32
    joints: Int32
    weights: Float32
    hidden: Bool
    brings_neck: bool
    skull: int
    below: tuple[int, ...]
    skull_bind: Float64
    skinner: Skinner

    def matrices(self, matrices: npt.ArrayLike, turn: npt.ArrayLike) -> Float64:
        """Return joint matrices (J, 4, 4) of the body with the head turned on its skull base.

        turn: (4, 4), as `fba.face.Deformer.head_matrices` returns it, in the face's frame. FAPs turn the head
        relative to the pose that BAPs give the skull base.
        """
        turned: Float64 = np.array(matrices, dtype=np.float64)
        if np.array_equal(turn, np.eye(4)):
            return turned
        frame, below = self.frame(turned), list(self.below)
        motion = frame @ np.asarray(turn, dtype=np.float64) @ np.linalg.inv(frame)
        turned[below] = motion @ turned[below]
        return turned

    def frame(self, matrices: npt.ArrayLike) -> Float64:
        """Return the matrix (4, 4) from the face's frame to the world, for parts that move with the skull."""
        return np.asarray(np.asarray(matrices, dtype=np.float64)[self.skull] @ self._in_skull)

    @cached_property
    def _in_skull(self) -> Float64:
        """(4, 4): from the face's frame to that of the skull's joint."""
        return np.asarray(np.linalg.inv(self.skull_bind) @ self.place)

    def skin(
        self,
        local: Float32,
        matrices: npt.ArrayLike,
        out: Float32 | None = None,
        *,
        local_normals: Float32 | None = None,
        normals: Float32 | None = None,
        method: SkinMethod = "dual",
    ) -> Float32:
        """Return the face on the body: float32 (V, 3), metres.

        local: float32 (V, 3), the face moved by its FAPs in its own frame without the head's turn
        (`Deformer.local`). matrices: (J, 4, 4), with the head's turn (`matrices`). out: written to and
        returned. local_normals: float32 (V, 3), normals of the face in its own frame; normals: filled with
        those on the body. method: see `BodyModel.skin`. ValueError for arrays of other shapes.
        """
        if local.shape != self.skinner.vertices.shape:
            raise ValueError(f"vertices must have shape {self.skinner.vertices.shape}, not {local.shape}")
        placed = local * np.float32(self.size)
        for axis in range(3):  # a whole column at once is several times faster than rows of three
            placed[:, axis] += self.shift[axis]
        return self.skinner.skin_vertices(placed, local_normals, matrices, out, normals, method)


def attach_head(
    body: BodyModel, vertices: npt.ArrayLike, eyes: npt.ArrayLike, skull: Bool | None = None
) -> AttachedHead:
    """Return a face set between the pupils of a body, sized by their distance.

    body: a model with positions of pupils. vertices: (V, 3), the neutral face, in its own frame and unit.
    eyes: (2, 3), its pupils, feature points 3.5 and 3.6. skull: (V,) mask of vertices that always move with
    the skull alone (eyes, teeth, tongue), none by default. Vertices near the body's neck (its part of kind
    "neck", as modelled) take that neck's weights, others move with the skull.

    ModelError for a body without pupils or a face whose eyes coincide.
    """
    points = checked_rows(vertices, (-1, 3), "a face on a body: vertices")
    place, number = placement(body, eyes), skull_of(body)
    size = float(place[0, 0])
    placed = points.astype(np.float64) * size + place[:3, 3]
    joints = np.zeros((len(points), INFLUENCES), dtype=np.int32)
    weights = np.zeros((len(points), INFLUENCES), dtype=np.float32)
    joints[:, 0], weights[:, 0] = number, 1.0
    hidden, brings_neck = np.zeros(len(points), dtype=bool), True
    neck = [part for part in body.parts if part.kind == "neck" and len(part.vertices)]
    if neck:
        free = np.ones(len(points), dtype=bool) if skull is None else ~np.asarray(skull)
        blend = blend_with_neck(neck, len(body.skeleton), number, placed, free)
        place[:3, 3] += blend.offset
        placed += blend.offset
        joints[free], weights[free] = blend.joints, blend.weights
        hidden, brings_neck = blend.hidden, blend.brings_neck
    joints, weights = checked_weights("a face on a body", joints, weights, len(points))
    forward = np.tile(np.array([0, 0, 1], dtype=np.float32), (len(points), 1))
    skinner = build_skinner(placed.astype(np.float32), forward, joints, weights, body.bind, body.skeleton)
    below = tuple(body.skeleton.descendants(number))
    return AttachedHead(
        place, size, place[:3, 3].astype(np.float32), joints, weights, hidden, brings_neck, number, below,
        body.bind[number], skinner,
    )  # fmt: skip


def skull_of(body: BodyModel) -> int:
    """Return the number of the joint that carries the head: the skull base, else the highest joint."""
    if SKULL in body.skeleton:
        return body.skeleton.number(SKULL)
    return int(body.bind[:, 1, 3].argmax())


def placement(body: BodyModel, eyes: npt.ArrayLike) -> Float64:
    """Return float64 (4, 4), from a face's frame to the body's as modelled. eyes: (2, 3), its pupils."""
    if body.eyes is None:
        raise ModelError(f"the body {body.name!r} has no pupils, so no face can be attached to it")
    given = np.array(eyes, dtype=np.float64)
    if given.shape != (2, 3) or not np.isfinite(given).all():
        raise ModelError(
            f"a face on a body needs the positions of both pupils (points 3.5 and 3.6), not {given.tolist()}"
        )
    apart = float(np.linalg.norm(given[1] - given[0]))
    if not apart > 1e-9:
        raise ModelError("both pupils of the face have the same position")
    size = float(np.linalg.norm(body.eyes[1] - body.eyes[0])) / apart
    if abs(size - 1) < SAME_SIZE:
        size = 1.0
    place = np.diag([size, size, size, 1.0])
    place[:3, 3] = body.eyes.mean(axis=0) - size * given.mean(axis=0)
    return place


class NeckBlend(NamedTuple):
    """Weights, offset and hidden vertices of a face on a body's neck."""

    offset: Float64
    """(3,) metres by which the face must be moved for both necks to coincide."""
    joints: Int32
    """(F, 4) joints of the free vertices."""
    weights: Float32
    """(F, 4) weights of those joints."""
    hidden: Bool
    """(V,) mask of vertices beyond the lower edge of the body's neck."""
    brings_neck: bool
    """Whether the face has a neck of its own that meets the body."""


def blend_with_neck(neck: list[BodyPart], joints: int, skull: int, placed: Float64, free: Bool) -> NeckBlend:
    """Return the joints and weights by which a body's neck moves a face's vertices (V, 3), metres.

    neck: the body's parts of that kind, with vertices. joints: number of the body's joints. skull: the joint
    that carries the head. free: (V,) vertices that the neck may bend.
    """

    def make() -> list[Array]:
        result = _compute_blend(neck, joints, skull, placed, free)
        return [*result[:4], np.array([result.brings_neck])]

    if len(placed) < CACHED_VERTICES:
        arrays = make()
    else:
        of_neck = [array for p in neck for array in (p.vertices, p.triangles, p.joints, p.weights)]
        key = make_key("neck", CACHE_VERSION, joints, skull, placed, free, *of_neck)
        count = int(free.sum())
        shapes = ((3,), (count, INFLUENCES), (count, INFLUENCES), (len(placed),), (1,))
        arrays = load_or_make(key, shapes, make, [np.float64, np.int32, np.float32, np.bool_, np.bool_])
    offset, which, weights, hidden, brings = arrays
    return NeckBlend(offset, which, weights, hidden, bool(brings[0]))


def _compute_blend(neck: list[BodyPart], joints: int, skull: int, placed: Float64, free: Bool) -> NeckBlend:
    from scipy.spatial import cKDTree

    anchors = np.concatenate([part.vertices for part in neck])
    offset = _measure_offset(anchors, placed)
    placed = placed + offset
    tree = cKDTree(anchors)
    hidden, brings_neck = np.zeros(len(placed), dtype=bool), False
    edge, outward = _lower_edge(anchors, neck)
    if len(edge) and len(placed):
        low = np.setdiff1d(np.flatnonzero(anchors[:, 1] < anchors[:, 1].mean()), edge)
        away = cKDTree(placed).query(anchors[low])[0] if len(low) else np.full(1, np.inf)
        brings_neck = bool(np.median(away) < SEAM)
        hidden = _beyond_edge(tree, edge, outward, anchors, placed)
    which, weights = _blend_weights(tree, _dense_weights(neck, joints), placed[free], skull, hidden[free])
    return NeckBlend(offset, which, weights, hidden, brings_neck)


def _measure_offset(anchors: Float32, placed: Float64) -> Float64:
    """Return (3,) metres between the necks of a face and a body that share its vertices; else 0."""
    from scipy.spatial import cKDTree

    none = np.zeros(3)
    if not len(placed):
        return none
    tree, moved = cKDTree(placed), anchors.astype(np.float64)
    for _ in range(MAX_ROUNDS):
        away, rows = tree.query(moved)
        near = away < PAIR_DISTANCE
        if not near.any() or float((away < SAME_PLACE).mean()) > 0.5:
            break
        moved = moved + np.median(placed[rows[near]] - moved[near], axis=0)
    offset: Float64 = anchors[0].astype(np.float64) - moved[0]
    result = float((tree.query(moved)[0] < SAME_PLACE).mean()) > 0.5
    return offset if result and float(np.linalg.norm(offset)) > SAME_PLACE else none


def _dense_weights(neck: list[BodyPart], joints: int) -> Float64:
    """Return (A, J) weights of the necks' vertices."""
    rows = sum(len(part.vertices) for part in neck)
    dense = np.zeros((rows, joints))
    which = np.concatenate([part.joints for part in neck])
    share = np.concatenate([part.weights for part in neck])
    for slot in range(INFLUENCES):
        np.add.at(dense, (np.arange(rows), which[:, slot]), share[:, slot])
    return dense


def _blend_weights(
    tree: Any, dense: Float64, positions: Float64, skull: int, below: Bool
) -> tuple[Int32, Float32]:
    """Return joints and weights of the nearest anchors, which fade into the skull's unless `below`."""
    away, rows = tree.query(positions, k=min(NEIGHBOURS, len(dense)))
    away, rows = away.reshape(len(positions), -1), rows.reshape(len(positions), -1)
    share = 1 / np.maximum(away, 1e-6) ** 2
    share /= share.sum(axis=1, keepdims=True)
    result = np.einsum("vk,vkj->vj", share, dense[rows])
    alone = np.where(below[:, None], 0.0, smoothstep((away[:, :1] - WITH_NECK) / (WITH_SKULL - WITH_NECK)))
    result *= 1 - alone
    result[:, skull] += alone[:, 0]
    return strongest_weights(result)


def _lower_edge(anchors: Float32, neck: list[BodyPart]) -> tuple[Int64, Float64]:
    """Return (vertices (N,) of the open rims in the lower half of necks, (N, 3) outward directions there)."""
    starts = np.cumsum([0, *(len(part.vertices) for part in neck)])
    triangles = np.concatenate([part.triangles + start for part, start in zip(neck, starts, strict=False)])
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    _, inverse, counts = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    open_sides = sides[counts[inverse.ravel()] == 1]
    edge = _low_rims(anchors, open_sides)
    within = np.zeros((len(anchors), 3))
    count = np.zeros((len(anchors), 1))
    inner = np.ones(len(anchors), dtype=bool)
    inner[edge] = False
    for a, b in (sides.T, sides[:, ::-1].T):
        use = inner[b]
        np.add.at(within, a[use], anchors[b[use]].astype(np.float64))
        np.add.at(count, a[use], 1)
    outward = np.where(count[edge] > 0, anchors[edge] - within[edge] / np.maximum(count[edge], 1), 0.0)
    return edge, outward


def _low_rims(anchors: Float32, open_sides: Int64) -> Int64:
    """Return the vertices of the rims at the lower end of a neck, not at its chin nor in holes."""
    label = connected(open_sides, len(anchors))
    middle = (anchors[:, 1].min() + anchors[:, 1].max()) / 2
    wide = RIM * np.ptp(anchors[:, 0])
    rims = np.unique(open_sides)
    result = [np.zeros(0, dtype=np.int64)]
    for number in np.unique(label[rims]):
        rim = rims[label[rims] == number]
        if anchors[rim, 1].mean() < middle and np.ptp(anchors[rim, 0]) > wide:
            result.append(rim)
    return np.concatenate(result)


def _beyond_edge(tree: Any, edge: Int64, outward: Float64, anchors: Float32, positions: Float64) -> Bool:
    """Return (V,) mask of the positions beyond the edge."""
    away, rows = tree.query(positions)
    number = np.full(len(anchors), -1)
    number[edge] = np.arange(len(edge))
    edge_number = number[rows]
    past: Bool = (edge_number >= 0) & (away > SEAM)
    past &= ((positions - anchors[rows]) * outward[edge_number]).sum(axis=1) > 0
    return past
