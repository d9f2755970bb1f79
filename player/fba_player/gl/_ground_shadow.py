"""The shadow of bodies on the ground, from a large key light and the sky: a map that shaders draw.

The first pass throws all triangles onto the ground, along the key light and straight down, and keeps how near
the ground the lowest of them is; what is around each piece of ground comes from halved copies of that. The
second finds the darkness: the nearer what hides the light, the sharper. The third draws it on the ground.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fba.arrays import Float32, UInt8
from fba_player._figure.face_light import KEY_DIRECTION
from fba_player.gl._mesh_renderer import FaceRenderer
from fba_player.gl._resources import load_program, set_uniform
from fba_player.view._view import FaceMesh

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
        self._square = context.buffer(np.array([-1, -1, 1, -1, -1, 1, 1, 1], dtype="f4").tobytes())
        self._programs = {name: load_program(context, name) for name in ("thrown", "shaded", "cast")}
        self._arrays = {
            name: context.vertex_array(self._programs[name], [(self._square, "2f", "in_corner")])
            for name in ("shaded", "cast")
        }

    def draw(self, faces: FaceRenderer, meshes: list[FaceMesh], places: Float32, camera: bytes) -> bool:
        """Draw the shadow of meshes around `places` (N, 2), x and z, into the bound framebuffer.

        camera: the matrix to clip space. Returns whether there are any that cast one.
        """
        casting = [mesh for mesh in meshes if _casts(mesh)]
        if not casting:
            return False
        gl, target, viewport = self._gl, self._gl.fbo, self._gl.viewport
        low, width = _ground_around(places)
        self._find(faces, casting, low, width)
        target.use()
        gl.viewport = viewport
        gl.enable_only(gl.BLEND)
        gl.blend_func = gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE
        self._darkness.use(0)
        for name, value in (("camera", camera), ("low", low), ("width", width)):
            set_uniform(self._programs["cast"], name, value)
        self._arrays["cast"].render(gl.TRIANGLE_STRIP)
        return True

    def darkness(self, faces: FaceRenderer, meshes: list[FaceMesh], places: Float32) -> UInt8:
        """Return uint8 (CELLS, CELLS): the darkness of the ground that `draw` draws, rows along z."""
        self._find(faces, [mesh for mesh in meshes if _casts(mesh)], *_ground_around(places))
        return np.frombuffer(self._darkness.read(alignment=1), np.uint8).reshape(CELLS, CELLS)

    def _find(
        self, faces: FaceRenderer, casting: list[FaceMesh], low: tuple[float, float], width: float
    ) -> None:
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
        faces.draw_positions(casting, self._programs["thrown"], INSTANCES)
        gl.blend_equation = moderngl.FUNC_ADD
        gl.enable_only(gl.NOTHING)
        self._heights.build_mipmaps()
        self._heights.filter = (gl.LINEAR_MIPMAP_NEAREST, gl.LINEAR)
        self._shaded.use()
        gl.viewport = (0, 0, CELLS, CELLS)
        self._heights.use(0)
        set_uniform(self._programs["shaded"], "width", width)
        self._arrays["shaded"].render(gl.TRIANGLE_STRIP)

    def close(self) -> None:
        for part in (
            *self._arrays.values(), *self._programs.values(), self._square, self._thrown, self._shaded,
            self._heights, self._darkness,
        ):  # fmt: skip
            part.release()


def _casts(mesh: FaceMesh) -> bool:
    return mesh.shape.casts and mesh.shape.kind not in INNER_KINDS and not mesh.turn.any()


def _ground_around(places: Float32) -> tuple[tuple[float, float], float]:
    """Return the corner (x, z) and the width (m) of the square of ground on which shadows fall."""
    least, most = places.min(axis=0), places.max(axis=0)
    width = WIDTH + float(np.ceil((most - least).max()))
    ahead = 0.9 / KEY_DIRECTION[1]  # shadows fall away from the key light
    corner = (least + most) / 2 - ahead * np.array(KEY_DIRECTION[::2]) - width / 2
    x, z = np.floor(corner * CELLS / width) * width / CELLS  # whole texels: the shadow does not shimmer
    return (float(x), float(z)), width
