"""Skinning: vertices moved by the joints of a skeleton."""

from __future__ import annotations

import threading

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Float64, Int32
from fba.body.skeleton import Skeleton
from fba.body.skin._girdle import find_girdle
from fba.body.skin._moving_normals import normal_rings
from fba.body.skin._twisting import find_twists
from fba.mesh.meshes import result_array

METHODS = ("dual", "linear")
"""Ways to blend the motion of several joints."""
BLOCK = 64
"""Frames per call of the compiled loop: an interrupt can only get through between calls."""


class Skinner:
    """Moves vertices with joints.

    vertices, normals: float32 (V, 3), as modelled. joints: int32 (V, 4). weights: float32 (V, 4), rows
    sum to 1. bind: float64 (J, 4, 4), the joints as modelled. skeleton: its joints. triangles: int32
    (F, 3), by which normals follow the surface (`fba.body.skin._moving_normals`); without them
    normals only rotate with their vertices.

    Arrays are taken as `BodyModel` checks them. Calls allocate nothing but their result. May be used by
    several threads, one after the other.
    """

    def __init__(
        self,
        vertices: Float32,
        normals: Float32,
        joints: Int32,
        weights: Float32,
        bind: Float64,
        skeleton: Skeleton,
        triangles: Int32 | None = None,
    ) -> None:
        # numba is imported here, with the first body that moves
        from fba.body.skin import loops

        self._loops = loops
        order = np.argsort(-weights, axis=1, kind="stable")
        self._joints = np.ascontiguousarray(np.take_along_axis(joints, order, axis=1), dtype=np.int32)
        self._weights = np.ascontiguousarray(np.take_along_axis(weights, order, axis=1), dtype=np.float32)
        self._counts = (self._weights > 0).sum(axis=1).astype(np.int32)
        # copies: read-only arrays would make numba compile another version
        self._modelled = np.array(vertices, dtype=np.float32, order="C")
        self._upright_modelled = np.array(normals, dtype=np.float32, order="C")
        self._vertices, self._upright = self._modelled.copy(), self._upright_modelled.copy()
        self._inverse: Float64 = np.linalg.inv(bind).astype(np.float64)
        self._parents = np.ascontiguousarray(skeleton.parents, dtype=np.int64)
        self._twists = find_twists(skeleton, bind, self._modelled, self._joints, self._weights)
        self._girdle = find_girdle(skeleton, bind, self._modelled, self._joints, self._weights)
        self._twisted = self._vertices.copy()
        self._twisted_is_modelled = True
        faces = np.zeros((0, 3), dtype=np.int32) if triangles is None else triangles
        self._around, self._numbers = normal_rings(self._modelled, self._upright_modelled, faces)
        self._scratch = np.empty((len(bind), 12), dtype=np.float32)
        self._lock = threading.Lock()

    def skin(
        self,
        matrices: npt.ArrayLike,
        out: Float32 | None = None,
        normals: Float32 | None = None,
        method: str = "dual",
    ) -> Float32:
        """Vertices for joint matrices: see `BodyModel.skin`."""
        return self._run(self._modelled, self._upright_modelled, matrices, out, normals, method)

    def carry(
        self,
        vertices: Float32,
        upright: Float32 | None,
        matrices: npt.ArrayLike,
        out: Float32 | None = None,
        normals: Float32 | None = None,
        method: str = "dual",
    ) -> Float32:
        """The result of `skin` for other rest positions (V, 3) and, optionally, their normals (V, 3)."""
        if normals is not None and upright is None:
            raise ValueError("normals are wanted, but not given as modelled")
        for array in (vertices, upright):
            if array is not None and array.shape != self._modelled.shape:
                raise ValueError(
                    f"vertices and normals must have shape {self._modelled.shape}, not {array.shape}"
                )
        return self._run(vertices, upright, matrices, out, normals, method)

    def _run(
        self,
        vertices: Float32,
        upright: Float32 | None,
        matrices: npt.ArrayLike,
        out: Float32 | None,
        normals: Float32 | None,
        method: str,
    ) -> Float32:
        if method not in METHODS:
            raise ValueError(f"no skinning method {method!r}; there are {', '.join(METHODS)}")
        frames, single = self._frames(matrices)
        shape = (*(() if single else (len(frames),)), len(vertices), 3)
        out = result_array(shape, out, normals)
        placed = out[None] if single else out
        turned = placed[:0] if normals is None else normals[None] if single else normals
        with self._lock, np.errstate(all="ignore"):
            vertices = _as_writable(vertices, self._vertices)
            upright = self._upright if upright is None else _as_writable(upright, self._upright)
            mesh = (vertices, upright, self._joints, self._weights, self._counts, self._around, self._numbers)
            twisted = vertices
            if method == "dual" and len(self._twists.rows):
                twisted = self._twisted
                if not (
                    self._twisted_is_modelled and vertices is self._modelled
                ):  # else every twisted vertex is overwritten
                    np.copyto(twisted, vertices)
                self._twisted_is_modelled = vertices is self._modelled
            for start in range(0, len(frames), BLOCK):
                part = slice(start, start + BLOCK)
                if method == "dual":
                    self._loops.dual_frames(
                        frames[part],
                        self._inverse,
                        self._parents,
                        *mesh,
                        self._scratch,
                        self._twists,
                        self._girdle,
                        twisted,
                        placed[part],
                        turned[part],
                    )
                else:
                    self._loops.linear_frames(
                        frames[part], self._inverse, *mesh, self._scratch, placed[part], turned[part]
                    )
        return out

    def _frames(self, matrices: npt.ArrayLike) -> tuple[Float64, bool]:
        array = np.asarray(matrices)
        count = len(self._inverse)
        if array.ndim not in (3, 4) or array.shape[-3:] != (count, 4, 4):
            raise ValueError(
                f"joint matrices must have shape ({count}, 4, 4) or (T, {count}, 4, 4), not {array.shape}"
            )
        if array.dtype.kind not in "iuf":
            raise ValueError(f"joint matrices must be real numbers, not {array.dtype}")
        frames = np.ascontiguousarray(array, dtype=np.float64).reshape(-1, count, 4, 4)
        if not frames.flags.writeable:
            frames = frames.copy()  # see the copies in __init__
        if not np.isfinite(frames).all():
            frame, joint = (int(place) for place in np.argwhere(~np.isfinite(frames))[0, :2])
            raise ValueError(f"joint matrix {joint} of frame {frame} is not finite")
        return frames, array.ndim == 3


def _as_writable(array: Float32, room: Float32) -> Float32:
    """The array itself if compiled code can take it, else a copy in `room`."""
    if array.dtype == np.float32 and array.flags.c_contiguous and array.flags.writeable:
        return array
    np.copyto(room, array)
    return room
