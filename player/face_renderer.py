"""Draws the parts of faces: their buffers and textures on the graphics card."""

from __future__ import annotations

from typing import Any

import numpy as np

from player.programs import matrix_bytes, set_uniform
from player.relief import relief
from player.shapes import FaceMesh, FaceShape

MOST_SHAPES = 64
"""Parts remembered on the graphics card; the longest unused goes first."""


class FaceRenderer:
    """Draws face meshes with the program "face", whose uniforms of camera and eye are already set.

    Owns what it allocates on the context; `close` gives it back.
    """

    def __init__(self, context: Any, program: Any) -> None:
        self._gl = context
        self._program = program
        self._kept: dict[int, tuple[FaceShape, dict[str, Any]]] = {}
        self._relief: Any = None
        self._white = context.texture((1, 1), 4, bytes([255] * 4))

    def draw(self, meshes: list[FaceMesh]) -> None:
        """Draw parts; those that can be seen through last."""
        gl = self._gl
        solid = [mesh for mesh in meshes if not self._parts(mesh)["see_through"]]
        for mesh in solid:
            self._draw(mesh)
        rest = [mesh for mesh in meshes if self._parts(mesh)["see_through"]]
        if rest:
            gl.enable_only(gl.DEPTH_TEST | gl.BLEND)
            gl.blend_func = gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE
            gl.fbo.depth_mask = False
            for mesh in rest:
                self._draw(mesh)
            gl.fbo.depth_mask = True
            gl.enable_only(gl.DEPTH_TEST)

    def close(self) -> None:
        """Free everything allocated on the graphics card."""
        for _, parts in self._kept.values():
            _release(parts)
        self._kept.clear()
        self._white.release()
        if self._relief is not None:
            self._relief.release()

    def _draw(self, mesh: FaceMesh) -> None:
        parts, shape, program = self._parts(mesh), mesh.shape, self._program
        for name, array in (("positions", mesh.positions), ("normals", mesh.normals), ("light", mesh.light)):
            data = np.ascontiguousarray(array, dtype="f4")
            if name == "light":
                if parts["lit"] is array:
                    continue
                parts["lit"] = array
            parts[name].orphan()
            parts[name].write(data)
        set_uniform(program, "world", matrix_bytes(mesh.matrix))
        set_uniform(program, "turn", tuple(float(v) for v in mesh.turn))
        set_uniform(program, "centre", tuple(float(v) for v in mesh.centre))
        set_uniform(program, "textured", 0.0 if shape.picture is None else 1.0)
        set_uniform(program, "scatter", shape.scatter)
        set_uniform(program, "fine", shape.fine)
        if shape.fine[0] > 0:
            self._relief_texture().use(1)
            set_uniform(program, "relief", 1)
        set_uniform(program, "two_sided", 1.0 if shape.two_sided else 0.0)
        (parts["picture"] or self._white).use(0)
        if shape.closed:
            self._gl.enable(self._gl.CULL_FACE)
        parts["array"].render()
        if shape.closed:
            self._gl.disable(self._gl.CULL_FACE)

    def _parts(self, mesh: FaceMesh) -> dict[str, Any]:
        key = id(mesh.shape)
        if key in self._kept:
            self._kept[key] = self._kept.pop(key)  # now the latest used
            return self._kept[key][1]
        while len(self._kept) >= MOST_SHAPES:
            _release(self._kept.pop(next(iter(self._kept)))[1])
        parts = self._uploaded(mesh.shape, len(mesh.positions))
        self._kept[key] = (mesh.shape, parts)
        return parts

    def _uploaded(self, shape: FaceShape, count: int) -> dict[str, Any]:
        gl = self._gl
        texcoords = shape.texcoords if shape.texcoords is not None else np.zeros((count, 2))
        still = np.concatenate([shape.colours, texcoords, shape.sway[:, None]], axis=1)
        parts: dict[str, Any] = {
            "positions": gl.buffer(reserve=max(count, 1) * 12, dynamic=True),
            "normals": gl.buffer(reserve=max(count, 1) * 12, dynamic=True),
            "light": gl.buffer(reserve=max(count, 1) * 16, dynamic=True),
            "still": gl.buffer(np.ascontiguousarray(still, dtype="f4").tobytes()),
            "triangles": gl.buffer(np.ascontiguousarray(shape.triangles, dtype="i4").tobytes()),
        }
        attributes = [
            (parts["positions"], "3f", "in_position"),
            (parts["normals"], "3f", "in_normal"),
            (parts["light"], "4f", "in_light"),
            (parts["still"], "4f 2f 1f", "in_colour", "in_texture", "in_sway"),
        ]
        parts["across"] = None
        if shape.across is not None:
            parts["across"] = gl.buffer(np.ascontiguousarray(shape.across, dtype="f4").tobytes())
            attributes.append((parts["across"], "4f 4f", "in_across", "in_along"))
        parts["array"] = gl.vertex_array(self._program, attributes, index_buffer=parts["triangles"])
        parts["picture"] = self._texture(shape)
        parts["see_through"] = shape.see_through
        parts["lit"] = None
        return parts

    def _relief_texture(self) -> Any:
        if self._relief is None:
            pixels = relief()
            height, width = pixels.shape[:2]
            self._relief = self._gl.texture((width, height), 3, pixels.tobytes())
            self._relief.build_mipmaps()
            self._relief.filter = (self._gl.LINEAR_MIPMAP_LINEAR, self._gl.LINEAR)
        return self._relief

    def _texture(self, shape: FaceShape) -> Any:
        if shape.picture is None:
            return None
        height, width = shape.picture.shape[:2]
        texture = self._gl.texture((width, height), 4, np.ascontiguousarray(shape.picture).tobytes())
        texture.build_mipmaps()
        texture.filter = (self._gl.LINEAR_MIPMAP_LINEAR, self._gl.LINEAR)
        return texture


def _release(parts: dict[str, Any]) -> None:
    for name in ("array", "positions", "normals", "light", "still", "triangles", "picture", "across"):
        if parts[name] is not None:
            parts[name].release()
