"""Skinning: vertices moved by the joints of a skeleton, and the twists of arms, distributed along them.

BAPs twist a whole forearm at the elbow, and a hand at the wrist; skin that followed only the joints would be
wrung there. In a real arm the twist grows along the bone. So before skinning, each vertex of an arm is turned
about its bone by the difference.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Float64, Int32, Int64
from fba.body._skeleton import Skeleton
from fba.body.skin import _loops as loops
from fba.body.skin._girdle import Girdle, find_girdle
from fba.body.skin._loops import Twisting
from fba.body.skin._moving_normals import normal_rings
from fba.choices import SkinMethod
from fba.mesh import result_array
from fba.sampling import smoothstep

METHODS: tuple[SkinMethod, ...] = get_args(SkinMethod)
"""Ways to blend the motion of several joints."""
FRAMES_PER_CALL = 64
"""Frames per call of the compiled loop: Ctrl+C takes effect between calls only."""
LIMB = ("shoulder", "elbow", "wrist")
WRIST_FROM = 0.35
"""Share of the forearm, from the elbow, beyond which its skin takes part in the twist of the wrist."""
MIN_ARM_WEIGHT = 0.02
"""Weight of the arm above which a vertex belongs to it."""
MIN_TWIST_SHARE = 1e-3
"""Share of a twist above which a vertex is turned; others are left out."""


@dataclass(eq=False)
class Skinner:
    """Moves vertices with joints; `build_skinner` makes it.

    vertices, normals: float32 (V, 3), as modelled. joints: int32 (V, 4). weights: float32 (V, 4), largest
    first, rows sum to 1. counts: int32 (V,), number of weights above 0. inverse: float64 (J, 4, 4), inverses
    of the joints as modelled. parents: int64 (J,). neighbours: int32 (V, 4), and coefficients: float32
    (V, 3), see `fba.body.skin._moving_normals`. rows: int64 (N,), vertices that it moves; see `restrict`.

    Calls allocate nothing but their result. Threads that share a Skinner wait for each other.
    """

    vertices: Float32
    normals: Float32
    joints: Int32
    weights: Float32
    counts: Int32
    inverse: Float64
    parents: Int64
    twists: Twisting
    girdle: Girdle
    neighbours: Int32
    coefficients: Float32
    rows: Int64

    def __post_init__(self) -> None:
        self._vertices, self._normals = self.vertices.copy(), self.normals.copy()
        self._twisted, self._twisted_is_modelled = self.vertices.copy(), True
        self._scratch = np.empty((len(self.inverse), 12), dtype=np.float32)
        self._lock = threading.Lock()

    def restrict(self, rows: npt.ArrayLike) -> Skinner:
        """Return a skinner that moves only these vertices (N,), and what their normals need: other rows of
        its results have no meaning. IndexError for vertices that do not exist."""
        wanted = np.zeros(len(self.vertices), dtype=bool)
        wanted[np.asarray(rows)] = True
        near = self.neighbours[wanted]
        wanted[near[near >= 0]] = True
        return replace(self, rows=np.flatnonzero(wanted))

    def skin(
        self,
        matrices: npt.ArrayLike,
        out: Float32 | None = None,
        normals: Float32 | None = None,
        method: SkinMethod = "dual",
    ) -> Float32:
        """Return vertices for joint matrices: see `BodyModel.skin`."""
        return self._run(self.vertices, self.normals, matrices, out, normals, method)

    def skin_vertices(
        self,
        vertices: Float32,
        rest_normals: Float32 | None,
        matrices: npt.ArrayLike,
        out: Float32 | None = None,
        normals: Float32 | None = None,
        method: SkinMethod = "dual",
    ) -> Float32:
        """Return what `skin` does for other rest positions (V, 3), and their normals (V, 3) or None."""
        if normals is not None and rest_normals is None:
            raise ValueError("normals need rest_normals, those of the vertices before skinning")
        for array in (vertices, rest_normals):
            if array is not None and array.shape != self.vertices.shape:
                raise ValueError(
                    f"vertices and normals must have shape {self.vertices.shape}, not {array.shape}"
                )
        return self._run(vertices, rest_normals, matrices, out, normals, method)

    def _run(
        self,
        vertices: Float32,
        rest_normals: Float32 | None,
        matrices: npt.ArrayLike,
        out: Float32 | None,
        normals: Float32 | None,
        method: SkinMethod,
    ) -> Float32:
        if method not in METHODS:
            raise ValueError(f"no skinning method {method!r}; there are {', '.join(METHODS)}")
        frames, single = self._frames(matrices)
        shape = (*(() if single else (len(frames),)), len(vertices), 3)
        out = result_array(shape, out, normals)
        out_frames = out[None] if single else out
        normal_frames = out_frames[:0] if normals is None else normals[None] if single else normals
        with self._lock, np.errstate(all="ignore"):
            vertices = _as_writable(vertices, self._vertices)
            rest_normals = (
                self._normals if rest_normals is None else _as_writable(rest_normals, self._normals)
            )
            skin = loops.Skin(
                vertices, rest_normals, self.joints, self.weights, self.counts, self.neighbours,
                self.coefficients, self.inverse, self._scratch, self.rows,
            )  # fmt: skip
            twisted = vertices
            if method == "dual" and len(self.twists.rows):
                twisted = self._twisted
                # if it holds the vertices as modelled, it can stay: all twisted ones are overwritten below
                if not (self._twisted_is_modelled and vertices is self.vertices):
                    np.copyto(twisted, vertices)
                self._twisted_is_modelled = vertices is self.vertices
            limbs = loops.Limbs(self.parents, self.twists, self.girdle, twisted)
            for start in range(0, len(frames), FRAMES_PER_CALL):
                part = slice(start, start + FRAMES_PER_CALL)
                if method == "dual":
                    loops.dual_frames(frames[part], skin, limbs, out_frames[part], normal_frames[part])
                else:
                    loops.linear_frames(frames[part], skin, out_frames[part], normal_frames[part])
        return out

    def _frames(self, matrices: npt.ArrayLike) -> tuple[Float64, bool]:
        array = np.asarray(matrices)
        count = len(self.inverse)
        if array.ndim not in (3, 4) or array.shape[-3:] != (count, 4, 4):
            raise ValueError(
                f"joint matrices must have shape ({count}, 4, 4) or (T, {count}, 4, 4), not {array.shape}"
            )
        if array.dtype.kind not in "iuf":
            raise ValueError(f"joint matrices must be real numbers, not {array.dtype}")
        frames = np.ascontiguousarray(array, dtype=np.float64).reshape(-1, count, 4, 4)
        if not frames.flags.writeable:
            frames = frames.copy()  # read-only arrays would make numba compile another version
        if not np.isfinite(frames).all():
            frame, joint = (int(index) for index in np.argwhere(~np.isfinite(frames))[0, :2])
            raise ValueError(f"joint matrix {joint} of frame {frame} is not finite")
        return frames, array.ndim == 3


def _as_writable(array: Float32, buffer: Float32) -> Float32:
    """Return the array itself if compiled code can take it, else a copy in a buffer."""
    if array.dtype == np.float32 and array.flags.c_contiguous and array.flags.writeable:
        return array
    np.copyto(buffer, array)
    return buffer


def build_skinner(
    vertices: Float32,
    normals: Float32,
    joints: Int32,
    weights: Float32,
    bind: Float64,
    skeleton: Skeleton,
    triangles: Int32 | None = None,
) -> Skinner:
    """Return a skinner for arrays that are checked as those of `BodyModel`.

    vertices, normals: float32 (V, 3), as modelled. joints: int32 (V, 4). weights: float32 (V, 4), rows sum
    to 1. bind: float64 (J, 4, 4), the joints as modelled. skeleton: its joints. triangles: int32 (F, 3), by
    which normals follow the surface (`fba.body.skin._moving_normals`); without them normals only rotate with
    their vertices.
    """
    order = np.argsort(-weights, axis=1, kind="stable")
    joints = np.ascontiguousarray(np.take_along_axis(joints, order, axis=1), dtype=np.int32)
    weights = np.ascontiguousarray(np.take_along_axis(weights, order, axis=1), dtype=np.float32)
    # copies: read-only arrays would make numba compile another version
    vertices = np.array(vertices, dtype=np.float32, order="C")
    normals = np.array(normals, dtype=np.float32, order="C")
    faces = np.zeros((0, 3), dtype=np.int32) if triangles is None else triangles
    neighbours, coefficients = normal_rings(vertices, normals, faces)
    return Skinner(
        vertices, normals, joints, weights,
        counts=(weights > 0).sum(axis=1).astype(np.int32),
        inverse=np.linalg.inv(bind).astype(np.float64),
        parents=np.ascontiguousarray(skeleton.parents, dtype=np.int64),
        twists=find_twists(skeleton, bind, vertices, joints, weights),
        girdle=find_girdle(skeleton, bind, vertices, joints, weights),
        neighbours=neighbours,
        coefficients=coefficients,
        rows=np.arange(len(vertices), dtype=np.int64),
    )  # fmt: skip


def find_twists(
    skeleton: Skeleton, bind: Float64, vertices: Float32, joints: Int32, weights: Float32
) -> Twisting:
    """Return tables of the arms' twists for the compiled loop; empty if the skeleton has no arms.

    rows: vertices; those of bone b are rows[starts[b]:starts[b + 1]]. shares: (N, 2), shares of the twists of
    the bone's joint and of the next joint by which they are turned beforehand. centre, axis: line of the bone
    as modelled. child_axis: axis of the next joint's twist.
    """
    rows, shares, bones, axes = [], [], [], []
    for side in ("l_", "r_"):
        names = [side + name for name in LIMB]
        if not all(name in skeleton for name in names):
            continue
        shoulder, elbow, wrist = (skeleton.number(name) for name in names)
        carried = [_carried_share(skeleton, number, joints, weights) for number in (shoulder, elbow, wrist)]
        along = [_along(bind, pair, vertices) for pair in ((shoulder, elbow), (elbow, wrist))]
        arm = carried[0] > MIN_ARM_WEIGHT
        upper = arm & (along[0] < 1)
        # The shoulder's own twist is not distributed: its skin is wide, and part of it belongs to the trunk.
        own, child = np.zeros(len(vertices)), -carried[1]
        for bone in (upper, arm & ~upper):
            turned = np.flatnonzero(bone & (np.maximum(np.abs(own), np.abs(child)) > MIN_TWIST_SHARE))
            rows.append(turned)
            shares.append(np.stack([own[turned], child[turned]], axis=1))
            share_along = np.clip(along[1], 0.0, 1.0)
            own = share_along - carried[1]
            child = smoothstep((share_along - WRIST_FROM) / (1 - WRIST_FROM)) - carried[2]
        bones += [(shoulder, elbow), (elbow, wrist)]
        axes += [_axis(bind, shoulder, elbow), _axis(bind, elbow, wrist)]
    pairs = np.array(bones, dtype=np.int64).reshape(-1, 2)
    axis = np.array(axes).reshape(-1, 3)
    return Twisting(
        rows=np.concatenate([np.zeros(0, dtype=np.int64), *rows]),
        shares=np.concatenate([np.zeros((0, 2)), *shares]),
        starts=np.cumsum([0, *(len(each) for each in rows)]).astype(np.int64),
        joint=pairs[:, 0].copy(),
        child=pairs[:, 1].copy(),
        centre=bind[pairs[:, 0], :3, 3].copy(),
        axis=axis,
        child_axis=axis[np.arange(len(axis)) // 2 * 2 + 1] if len(axis) else axis,  # the forearm's
    )


def _axis(bind: Float64, joint: int, child: int) -> Float64:
    """Return the unit vector (3,) along a bone as modelled."""
    bone = bind[child, :3, 3] - bind[joint, :3, 3]
    return bone / max(float(np.linalg.norm(bone)), 1e-12)


def _carried_share(skeleton: Skeleton, joint: int, joints: Int32, weights: Float32) -> Float64:
    """Return (V,) total weight of a joint and its descendants for each vertex."""
    below = np.isin(joints, skeleton.descendants(joint))
    return np.asarray((weights * below).sum(axis=1, dtype=np.float64))


def _along(bind: Float64, pair: tuple[int, int], vertices: Float32) -> Float64:
    """Return (V,) positions of vertices along a bone: 0 at its joint, 1 at the next."""
    start, end = bind[pair[0], :3, 3], bind[pair[1], :3, 3]
    bone = end - start
    return (vertices - start) @ bone / max(float(bone @ bone), 1e-12)
