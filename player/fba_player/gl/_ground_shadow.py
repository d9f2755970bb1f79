"""The shadow of bodies on the ground, from a large key light and the sky: a map that shaders draw.

The first pass throws all triangles onto the ground, along the key light and straight down, and keeps how near
the ground the lowest of them is; what is around each piece of ground comes from halved copies of that. The
second finds the darkness: the nearer what hides the light, the sharper. The third draws it on the ground.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fba.arrays import Float32, Int32, Intp, UInt8
from fba_player._figure.face_light import KEY_DIRECTION
from fba_player.gl._resources import RecentlyUsed, load_program, make_buffer, set_uniform, write_buffer
from fba_player.view._view import FaceMesh, FaceShape

HEIGHTS = 256
"""Texels of the map of heights along each side."""
CELLS = 64
"""Texels of the darkness along each side."""
WIDTH = 4.8
"""Metres of ground, along each side, for one body."""
INNER_KINDS = ("teeth", "tongue", "mouth", "eye")
"""Kinds of parts that lie inside others and cast no shadow."""
INSTANCES = 2
"""Lights along which triangles are thrown: the key light and the sky."""
CACHED_SHAPES = 512
"""Number of shapes whose casting vertices are cached."""


class GroundShadow:
    """Draws shadows on the ground y = 0. Owns what it allocates on the moderngl context; `close` frees it."""

    def __init__(self, context: Any) -> None:
        self._gl = context
        self._heights = context.texture((HEIGHTS, HEIGHTS), 4, dtype="f2")
        self._darkness = context.texture((CELLS, CELLS), 1, alignment=1)
        self._darkness.filter = (context.LINEAR, context.LINEAR)
        for texture in (self._heights, self._darkness):
            texture.repeat_x = texture.repeat_y = False
        self._thrown = context.framebuffer([self._heights])
        self._shaded = context.framebuffer([self._darkness])
        self._shapes = RecentlyUsed[tuple[Intp, Int32]](CACHED_SHAPES, lambda _: None)
        self._thrown_parts: list[Any] = []
        self._thrown_shapes: list[FaceShape] = []
        self._square = context.buffer(np.array([-1, -1, 1, -1, -1, 1, 1, 1], dtype="f4").tobytes())
        self._programs = {name: load_program(context, name) for name in ("thrown", "shaded", "cast")}
        self._arrays = {
            name: context.vertex_array(self._programs[name], [(self._square, "2f", "in_corner")])
            for name in ("shaded", "cast")
        }

    def draw(self, meshes: list[FaceMesh], places: Float32, camera: bytes) -> bool:
        """Draw the shadow of meshes around `places` (N, 2), x and z, into the bound framebuffer.

        camera: the matrix to clip space. Returns whether there are any that cast one.
        """
        casting = [mesh for mesh in meshes if _casts(mesh)]
        if not casting:
            return False
        gl, target, viewport = self._gl, self._gl.fbo, self._gl.viewport
        low, width = _ground_around(places)
        self._find(casting, low, width)
        target.use()
        gl.viewport = viewport
        gl.enable_only(gl.BLEND)
        gl.blend_func = gl.ZERO, gl.SRC_COLOR
        self._darkness.use(0)
        for name, value in (("camera", camera), ("low", low), ("width", width)):
            set_uniform(self._programs["cast"], name, value)
        self._arrays["cast"].render(gl.TRIANGLE_STRIP)
        return True

    def darkness(self, meshes: list[FaceMesh], places: Float32) -> UInt8:
        """Return uint8 (CELLS, CELLS): the darkness of the ground that `draw` draws, rows along z."""
        self._find([mesh for mesh in meshes if _casts(mesh)], *_ground_around(places))
        return np.frombuffer(self._darkness.read(alignment=1), np.uint8).reshape(CELLS, CELLS)

    def _find(self, casting: list[FaceMesh], low: tuple[float, float], width: float) -> None:
        """Find the darkness of the ground from `low` on."""
        import moderngl

        gl = self._gl
        self._thrown.use()
        gl.viewport = (0, 0, HEIGHTS, HEIGHTS)
        gl.clear(0.0, 0.0, 0.0, 0.0)
        gl.enable_only(gl.BLEND)
        gl.blend_func = gl.ONE, gl.ONE
        gl.blend_equation = moderngl.MAX
        set_uniform(self._programs["thrown"], "low", low)
        set_uniform(self._programs["thrown"], "width", width)
        if casting:
            self._throw(casting)
        gl.blend_equation = moderngl.FUNC_ADD
        gl.enable_only(gl.NOTHING)
        self._heights.build_mipmaps()
        self._heights.filter = (gl.LINEAR_MIPMAP_NEAREST, gl.LINEAR)
        self._shaded.use()
        gl.viewport = (0, 0, CELLS, CELLS)
        self._heights.use(0)
        set_uniform(self._programs["shaded"], "width", width)
        self._arrays["shaded"].render(gl.TRIANGLE_STRIP)

    def _throw(self, casting: list[FaceMesh]) -> None:
        """Draw all triangles at once: software OpenGL takes longer to begin a part than to draw it."""
        shapes = [mesh.shape for mesh in casting]
        parts = [self._shapes.get(shape, lambda shape=shape: _casting(shape)) for shape in shapes]  # type: ignore[misc]
        if [*map(id, shapes)] != [*map(id, self._thrown_shapes)]:
            self._join(shapes, parts)
        places = [
            mesh.positions.take(rows, axis=0) @ mesh.matrix[:3, :3].T.astype(np.float32)
            + mesh.matrix[:3, 3].astype(np.float32)
            for mesh, (rows, _) in zip(casting, parts, strict=True)
        ]
        array, positions, _ = self._thrown_parts
        write_buffer(positions, np.concatenate(places))
        array.render(instances=INSTANCES)

    def _join(self, shapes: list[FaceShape], parts: list[tuple[Intp, Int32]]) -> None:
        """Make the buffers for the casting vertices of all shapes, one after the other."""
        for part in self._thrown_parts:
            part.release()
        starts = np.cumsum([0, *(len(rows) for rows, _ in parts)])
        joined = [triangles + start for (_, triangles), start in zip(parts, starts[:-1], strict=True)]
        positions = self._gl.buffer(reserve=12 * max(int(starts[-1]), 1), dynamic=True)
        triangles = make_buffer(self._gl, np.concatenate(joined), "i4")
        attributes = [(positions, "3f", "in_position")]
        array = self._gl.vertex_array(self._programs["thrown"], attributes, index_buffer=triangles)
        self._thrown_parts, self._thrown_shapes = [array, positions, triangles], shapes

    def close(self) -> None:
        for part in (
            *self._thrown_parts, *self._arrays.values(), *self._programs.values(), self._square, self._thrown,
            self._shaded, self._heights, self._darkness,
        ):  # fmt: skip
            part.release()


def _casting(shape: FaceShape) -> tuple[Intp, Int32]:
    """Return the vertices (N,) of the triangles that cast a shape's shadow, and these triangles of them."""
    rows, corners = np.unique(shape.triangles if shape.outer is None else shape.outer, return_inverse=True)
    return rows.astype(np.intp), corners.reshape(-1, 3).astype(np.int32)


def _casts(mesh: FaceMesh) -> bool:
    shape = mesh.shape
    drawn = shape.casts and shape.kind not in INNER_KINDS and len(shape.triangles) > 0
    return drawn and not mesh.turn.any()


def _ground_around(places: Float32) -> tuple[tuple[float, float], float]:
    """Return the corner (x, z) and the width (m) of the square of ground on which shadows fall."""
    least, most = places.min(axis=0), places.max(axis=0)
    width = WIDTH + float(np.ceil((most - least).max()))
    ahead = 0.9 / KEY_DIRECTION[1]  # shadows fall away from the key light
    corner = (least + most) / 2 - ahead * np.array(KEY_DIRECTION[::2]) - width / 2
    x, z = np.floor(corner * CELLS / width) * width / CELLS  # whole texels: the shadow does not shimmer
    return (float(x), float(z)), width
