"""A face on a body: its vertices carried by neck and skull, so that both are one skin."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import numpy.typing as npt

from fba.body.influences import strongest
from fba.body.model import INFLUENCES, BodyModel, BodyPart, checked_weights
from fba.body.skinning import Skinner
from fba.errors import ModelError
from fba.mesh import float_rows

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]
Int32 = npt.NDArray[np.int32]
Int64 = npt.NDArray[np.int64]

SKULL = "skullbase"
"""The joint that carries the head, and that FAP 48 to 50 turn it on (ISO/IEC 14496-2, annex C)."""
SAME_SIZE = 0.005
"""Sizes that differ by less than this share are taken as the same."""
NEAR, FAR = 0.010, 0.030
"""Metres from the body's neck: up to the first a vertex moves as the neck there, beyond the second with the
skull alone."""
NEIGHBOURS = 4
SAME, ALMOST, ROUNDS = 1e-5, 0.01, 20
"""Metres: vertices so near are the same; those of one mesh may at first be so far apart. How often a face is
moved by what its vertices are off."""
RIM = 0.3
"""The share of a neck's width that its lower rim has at least."""
SEAM = 0.002
"""A face whose vertices come this close (m) to those of the body's neck brings its own neck."""


class HeadOnBody:
    """Carries a face with a body's joints.

    body: a model with a place for pupils. vertices: (V, 3), the neutral face, in its own frame and unit.
    eyes: (2, 3), its pupils, feature points 3.5 and 3.6. skull: (V,), vertices that go with the skull alone
    wherever they are (eyes, teeth, tongue), none by default.

    The face is set between the pupils of the body, sized by their distance. Its vertices near the body's
    neck (its part of kind "neck", as modelled) take that neck's weights, others move with the skull.

    Raises ModelError for a body without pupils or a face whose eyes are no two places.
    """

    def __init__(
        self,
        body: BodyModel,
        vertices: npt.ArrayLike,
        eyes: npt.ArrayLike,
        skull: npt.NDArray[np.bool_] | None = None,
    ) -> None:
        places = float_rows(vertices, (-1, 3), "a face on a body: vertices")
        self._skull = skull_of(body)
        self.place = placement(body, eyes)
        """float64 (4, 4): the face's frame into the body's, as modelled."""
        self._size = float(self.place[0, 0])
        neck = [part for part in body.parts if part.kind == "neck" and len(part.vertices)]
        if neck:
            anchors = np.concatenate([part.vertices for part in neck])
            self.place[:3, 3] += _offset(anchors, places * self._size + self.place[:3, 3])
        self._shift = self.place[:3, 3].astype(np.float32)
        self._from_place = np.linalg.inv(self.place)
        placed = places.astype(np.float64) * self._size + self.place[:3, 3]
        joints = np.zeros((len(places), INFLUENCES), dtype=np.int32)
        weights = np.zeros((len(places), INFLUENCES), dtype=np.float32)
        joints[:, 0], weights[:, 0] = self._skull, 1.0
        self.hidden: npt.NDArray[np.bool_] = np.zeros(len(places), dtype=bool)
        """(V,): vertices beyond the lower edge of the body's neck, which its clothes hide."""
        self.brings_neck = not neck
        """Whether the face has a neck that meets the body, whose own then is not to be shown."""
        if neck:
            from scipy.spatial import cKDTree

            dense = _dense(neck, len(body.skeleton))
            edge, outward = _lower_edge(anchors, neck)
            if len(edge) and len(placed):
                low = np.setdiff1d(np.flatnonzero(anchors[:, 1] < anchors[:, 1].mean()), edge)
                away = cKDTree(placed).query(anchors[low])[0] if len(low) else np.full(1, np.inf)
                self.brings_neck = bool(np.median(away) < SEAM)
                self.hidden = _beyond(cKDTree(anchors), edge, outward, anchors, placed)
            free = np.ones(len(places), dtype=bool) if skull is None else ~np.asarray(skull)
            joints[free], weights[free] = _nearest(
                cKDTree(anchors), dense, placed[free], self._skull, self.hidden[free]
            )
        self.joints, self.weights = checked_weights("a face on a body", joints, weights, len(places))
        self._below = _descendants(body, self._skull)
        self._bind = body.bind
        self._inverse = np.linalg.inv(body.bind)
        self._skinner = Skinner(
            placed.astype(np.float32),
            np.tile(np.array([0, 0, 1], dtype=np.float32), (len(places), 1)),
            self.joints,
            self.weights,
            body.bind,
            body.skeleton,
        )
        self._placed = np.empty((len(places), 3), dtype=np.float32)

    def matrices(self, matrices: npt.ArrayLike, turn: npt.ArrayLike) -> Float64:
        """Joint matrices (J, 4, 4) of the body with the head turned on its skull base.

        turn: (4, 4), as `fba.face.Deformer.head_matrices` gives it, in the face's frame. FAPs turn the head
        relative to what BAPs do to the skull base.
        """
        turned: Float64 = np.array(matrices, dtype=np.float64)
        within = self.place @ np.asarray(turn, dtype=np.float64) @ self._from_place
        if np.array_equal(within, np.eye(4)):
            return turned
        skull = turned[self._skull]
        motion = skull @ self._inverse[self._skull] @ within @ self._bind[self._skull] @ np.linalg.inv(skull)
        turned[self._below] = motion @ turned[self._below]
        return turned

    def frame(self, matrices: npt.ArrayLike) -> Float64:
        """(4, 4): the face's frame into the world, for what moves with the skull alone."""
        skull = np.asarray(matrices, dtype=np.float64)[self._skull]
        frame: Float64 = skull @ self._inverse[self._skull] @ self.place
        return frame

    def skin(
        self,
        local: Float32,
        matrices: npt.ArrayLike,
        out: Float32 | None = None,
        *,
        upright: Float32 | None = None,
        normals: Float32 | None = None,
        method: str = "dual",
    ) -> Float32:
        """The face on the body: float32 (V, 3), metres.

        local: float32 (V, 3), the face moved by its FAPs in its own frame without the head's turn
        (`Deformer.local`). matrices: (J, 4, 4), with the head's turn (`matrices`). out: written to and
        returned. upright: float32 (V, 3), normals of the face in its own frame; normals: filled with those
        on the body. method: as of `BodyModel.skin`.
        """
        from fba.body.skinning_loops import sized

        if local.shape != self._placed.shape:
            raise ValueError(f"vertices must have shape {self._placed.shape}, not {local.shape}")
        sized(local, self._size, self._shift, self._placed)
        return self._skinner.carry(self._placed, upright, matrices, out, normals, method)

    def chosen(self, rows: npt.NDArray[np.intp]) -> HeadOnBody:
        """The same for some of the face's vertices, rows (N,), each once: `skin` takes and gives these."""
        some = copy.copy(self)
        some._skinner = self._skinner.chosen(rows)
        some._placed = np.empty((len(rows), 3), dtype=np.float32)
        return some


def skull_of(body: BodyModel) -> int:
    """Number of the joint that carries the head: the skull base, or the highest joint where there is none."""
    if SKULL in body.skeleton:
        return body.skeleton.number(SKULL)
    return int(body.bind[:, 1, 3].argmax())


def placement(body: BodyModel, eyes: npt.ArrayLike) -> Float64:
    """float64 (4, 4): from a face's frame to the body's as modelled. eyes: (2, 3), the face's pupils."""
    if body.eyes is None:
        raise ModelError(f"the body {body.name!r} has no pupils, so there is no place for a face on it")
    given = np.array(eyes, dtype=np.float64)
    if given.shape != (2, 3) or not np.isfinite(given).all():
        raise ModelError(f"a face on a body needs its two pupils (points 3.5 and 3.6), not {given.tolist()}")
    apart = float(np.linalg.norm(given[1] - given[0]))
    if not apart > 1e-9:
        raise ModelError("both pupils of the face are in the same place")
    size = float(np.linalg.norm(body.eyes[1] - body.eyes[0])) / apart
    if abs(size - 1) < SAME_SIZE:
        size = 1.0
    place = np.diag([size, size, size, 1.0])
    place[:3, 3] = body.eyes.mean(axis=0) - size * given.mean(axis=0)
    return place


def _offset(anchors: Float32, placed: Float64) -> Float64:
    """(3,) how far a face is off a body whose neck it has, vertex by vertex; 0 where it has another.

    Where pupils are found differs a little from one reader to another.
    """
    from scipy.spatial import cKDTree

    none = np.zeros(3)
    if not len(placed):
        return none
    tree, moved = cKDTree(placed), anchors.astype(np.float64)
    for _ in range(ROUNDS):
        away, rows = tree.query(moved)
        near = away < ALMOST
        if not near.any() or float((away < SAME).mean()) > 0.5:
            break
        moved = moved + np.median(placed[rows[near]] - moved[near], axis=0)
    offset: Float64 = anchors[0].astype(np.float64) - moved[0]
    found = float((tree.query(moved)[0] < SAME).mean()) > 0.5
    return offset if found and float(np.linalg.norm(offset)) > SAME else none


def _dense(neck: list[BodyPart], joints: int) -> Float64:
    """(A, J) weights of the necks' vertices."""
    rows = sum(len(part.vertices) for part in neck)
    dense = np.zeros((rows, joints))
    which = np.concatenate([part.joints for part in neck])
    share = np.concatenate([part.weights for part in neck])
    for slot in range(INFLUENCES):
        np.add.at(dense, (np.arange(rows), which[:, slot]), share[:, slot])
    return dense


def _nearest(
    tree: Any, dense: Float64, places: Float64, skull: int, below: npt.NDArray[np.bool_]
) -> tuple[Int32, Float32]:
    """Weights of the nearest anchors, handed over to the skull with distance, but for what lies below."""
    away, rows = tree.query(places, k=min(NEIGHBOURS, len(dense)))
    away, rows = away.reshape(len(places), -1), rows.reshape(len(places), -1)
    share = 1 / np.maximum(away, 1e-6) ** 2
    share /= share.sum(axis=1, keepdims=True)
    found = np.einsum("vk,vkj->vj", share, dense[rows])
    t = np.clip((away[:, :1] - NEAR) / (FAR - NEAR), 0.0, 1.0)
    alone = np.where(below[:, None], 0.0, t * t * (3 - 2 * t))
    found *= 1 - alone
    found[:, skull] += alone[:, 0]
    return strongest(found)


def _lower_edge(anchors: Float32, neck: list[BodyPart]) -> tuple[Int64, Float64]:
    """Vertices of the open rims in the lower half of necks, and the ways out over them (N, 3)."""
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
    """Vertices of the rims that a neck ends in below: not its chin, nor holes within."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links = (np.ones(len(open_sides)), (open_sides[:, 0], open_sides[:, 1]))
    _, label = connected_components(coo_array(links, shape=(len(anchors),) * 2), directed=False)
    middle = (anchors[:, 1].min() + anchors[:, 1].max()) / 2
    wide = RIM * np.ptp(anchors[:, 0])
    rims = np.unique(open_sides)
    found = [np.zeros(0, dtype=np.int64)]
    for number in np.unique(label[rims]):
        rim = rims[label[rims] == number]
        if anchors[rim, 1].mean() < middle and np.ptp(anchors[rim, 0]) > wide:
            found.append(rim)
    return np.concatenate(found)


def _beyond(
    tree: Any, edge: Int64, outward: Float64, anchors: Float32, places: Float64
) -> npt.NDArray[np.bool_]:
    """(V,) places nearest to the edge and past it."""
    away, rows = tree.query(places)
    number = np.full(len(anchors), -1)
    number[edge] = np.arange(len(edge))
    at = number[rows]
    past: npt.NDArray[np.bool_] = (at >= 0) & (away > SEAM)
    past &= ((places - anchors[rows]) * outward[at]).sum(axis=1) > 0
    return past


def _descendants(body: BodyModel, joint: int) -> list[int]:
    below = [joint]
    for number, parent in enumerate(body.skeleton.parents.tolist()):
        if parent in below:
            below.append(number)
    return below
