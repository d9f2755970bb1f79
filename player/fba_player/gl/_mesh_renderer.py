"""Draws the parts of faces and bodies: their buffers, textures and programs."""

from __future__ import annotations

from typing import Any

import numpy as np

from fba.arrays import Float32, Float64, Int32, UInt8
from fba_player._mesh.textures import RELIEF, skin_relief, texture_breadth
from fba_player._mesh.wrinkle_map import BOTTOM, TEXELS, TOP, WIDTH, wrinkle_map
from fba_player._mesh.wrinkle_map import SHAPE as WRINKLE_SHAPE
from fba_player.gl._ground_shadow import Shade
from fba_player.gl._lod import distance, share_memory
from fba_player.gl._resources import (
    RecentlyUsed,
    load_program,
    make_buffer,
    make_texture,
    matrix_bytes,
    set_uniform,
    write_buffer,
)
from fba_player.gl._textures import Pictures, count_halvings
from fba_player.view._view import MOST_LIMBS, FaceMesh, FaceShape

CACHED_SHAPES = 512
"""Number of parts whose buffers are cached; the least recently used goes first."""
CORE_OPACITY = 0.9
"""Pixels of blended parts with at least this opacity are drawn first, as opaque, then the others."""
MIN_WRINKLE = 0.01
"""Strength from which wrinkles are drawn."""
MIN_RELIEF = 0.25
"""The skin's relief is not drawn if it is reduced to less than this share of its size."""
CLEAR, CLEAR_OF_FACES = 0.014, 0.07
"""Metres by which what throws a shadow on a surface must be off it; faces come with shadows of their own."""
PARTS_AT_ONCE = 10
"""Parts after which software OpenGL begins to fill pixels."""
FAR = -1e4
"""Place (m) along each axis of limbs that a body lacks: away from the light."""


class FaceRenderer:
    """Draws face meshes. Owns what it allocates on the moderngl context; `close` frees it."""

    def __init__(self, context: Any) -> None:
        self._gl = context
        self._programs: dict[tuple[str, ...], Any] = {}
        self._shapes = RecentlyUsed[dict[str, Any]](CACHED_SHAPES, _release)
        self._reliefs: dict[int, Any] = {}
        self._wrinkles: dict[int, Any] = {}
        self._pixels: UInt8 | None = None
        self._camera: tuple[Float64, bytes, float] = (np.zeros(3), b"", 1.0)
        self._shade: Shade | None = None
        self._aside_colour = context.renderbuffer((1, 1), 4)
        self._aside = context.framebuffer([self._aside_colour])

    def begin(self, eye: Float64, matrix: Float64, pixel: float, shade: Shade | None = None) -> None:
        """Set the camera: its position (3,), the matrix (4, 4) to clip space, a pixel's size; and shadows."""
        self._shade = shade
        self._camera = (np.asarray(eye, dtype=np.float64), matrix_bytes(matrix), pixel)
        for program in self._programs.values():
            self._set_camera(program)
        if shade is not None:
            shade.tops.use(3)

    def draw_opaque(self, meshes: list[FaceMesh]) -> None:
        """Draw the parts that are not transparent."""
        opaque = [mesh for mesh in meshes if not mesh.shape.see_through]
        for number, mesh in enumerate(opaque, 1):
            self._draw(mesh)
            if number % PARTS_AT_ONCE == 0:
                # Software OpenGL collects triangles until another framebuffer is used, then fills pixels in
                # threads of its own, while this one draws on. It slows down with what it has collected.
                self._aside.clear()
                self._gl.fbo.depth_mask = True  # moderngl leaves it as the other framebuffer has it

    def draw_transparent(self, meshes: list[FaceMesh]) -> None:
        """Draw the other parts, over what they may let through."""
        gl = self._gl
        transparent = [mesh for mesh in meshes if mesh.shape.see_through]
        for mesh in transparent:  # pixels that are nearly opaque hide what is behind them, in any order
            if mesh.shape.alpha == "blend":
                self._draw(mesh, core=True)
        if transparent:
            gl.enable_only(gl.DEPTH_TEST | gl.BLEND)
            gl.blend_func = gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE
            gl.fbo.depth_mask = False
            for mesh in transparent:
                self._draw(mesh)
            gl.fbo.depth_mask = True
            gl.enable_only(gl.DEPTH_TEST)

    def close(self) -> None:
        self._shapes.clear()
        for part in (
            *self._reliefs.values(),
            *self._wrinkles.values(),
            *self._programs.values(),
            self._aside,
            self._aside_colour,
        ):
            part.release()
        self._reliefs.clear()
        self._wrinkles.clear()
        self._programs.clear()

    def _program(self, options: tuple[str, ...]) -> Any:
        if options not in self._programs:
            program = self._programs[options] = load_program(self._gl, "face", *options)
            for unit, name in enumerate(("picture", "relief", "wrinkle_map", "tops")):
                set_uniform(program, name, unit)
            set_uniform(program, "clearance", CLEAR if "LIMBS" in options else CLEAR_OF_FACES)
            self._set_camera(program)
        return self._programs[options]

    def _array(self, parts: dict[str, Any], options: tuple[str, ...]) -> Any:
        """Return the vertex array of a part for a program."""
        if options not in parts["arrays"]:
            attributes: list[tuple[Any, ...]] = [
                (parts["positions"], "3f", "in_position"),
                (parts["normals"], "3f", "in_normal"),
                (parts["light"], "4f", "in_light"),
            ]
            if "TEXTURED" in options:
                attributes.append((parts["still"], "4f 2f 1f", "in_colour", "in_texture", "in_sway"))
            else:
                attributes.append((parts["still"], "4f 8x 1f", "in_colour", "in_sway"))
            if "WRINKLED" in options:
                attributes.append((parts["wrinkles"], "2f", "in_wrinkle"))
            if parts["across"] is not None:
                attributes.append((parts["across"], "4f 4f", "in_across", "in_along"))
            program, triangles = self._program(options), parts["triangles"]
            parts["arrays"][options] = self._gl.vertex_array(program, attributes, index_buffer=triangles)
        return parts["arrays"][options]

    def _set_camera(self, program: Any) -> None:
        eye, matrix, pixel = self._camera
        set_uniform(program, "eye", tuple(float(v) for v in eye))
        if matrix:
            set_uniform(program, "camera", matrix)
        set_uniform(program, "pixel", pixel)
        if self._shade is not None:
            set_uniform(program, "frame", self._shade.frame)

    def _draw(self, mesh: FaceMesh, *, core: bool = False) -> None:
        """Draw a part. core: of a blended one, pixels that hide at least `CORE_OPACITY` of what is behind."""
        shape = mesh.shape
        if not len(shape.triangles):  # a part so small that no level of detail is left of it from afar
            return
        parts = self._shapes.get(shape, lambda: self._upload(mesh))
        write_buffer(parts["positions"], mesh.positions)
        write_buffer(parts["normals"], mesh.normals)
        if parts["lit"] is None or not share_memory(parts["lit"], mesh.light):
            parts["lit"] = mesh.light
            write_buffer(parts["light"], mesh.light)
        if mesh.looks is not None or parts["looks"] is not None:  # while it morphs, and once after that
            parts["looks"] = mesh.looks
            write_buffer(parts["still"], shape.looks if mesh.looks is None else mesh.looks)
        away = distance(mesh, self._camera[0]) if mesh.away is None else mesh.away
        wide = self._camera[2] * away
        picture = parts["pictures"].choose(wide)
        repeats = self._relief_texture(wide) if shape.fine[0] > 0 else None
        wrinkles = self._wrinkle_map(mesh, parts, wide)
        options = tuple(
            option
            for option, used in (
                ("SMOOTH", shape.smooth),
                ("HAIRS", shape.across is not None),
                ("LIMBS", mesh.limbs is not None),
                ("FOLDS", mesh.limbs is not None and picture is not None and shape.folds),
                ("SHADED", self._shade is not None),
                ("FINELY", self._shade is not None and self._shade.finely),
                ("TEXTURED", picture is not None),
                ("WRINKLED", wrinkles is not None),
                ("FINE", repeats is not None),
                ("SOLID", shape.alpha == "opaque"),
                ("CUT", shape.alpha == "mask" or core),
                ("VEIL", shape.alpha == "blend"),
            )
            if used
        )
        program, array = self._program(options), self._array(parts, options)
        _set_shape(program, shape)
        _set_pose(program, mesh)
        if "CUT" in options:
            set_uniform(program, "cut", CORE_OPACITY if core else shape.cutoff)
        if picture is not None:
            picture.use(0)
        if repeats is not None:
            repeats.use(1)
        if wrinkles is not None:
            wrinkles.use(2)
            _set_wrinkles(program, mesh)
        if shape.closed:
            self._gl.enable(self._gl.CULL_FACE)
        array.render()
        if shape.closed:
            self._gl.disable(self._gl.CULL_FACE)

    def _upload(self, mesh: FaceMesh) -> dict[str, Any]:
        gl, shape, count = self._gl, mesh.shape, len(mesh.positions)
        texel = 0.0
        if shape.wrinkle_places is not None:
            texel = texture_breadth(*_in_map(shape, mesh.positions)) / TEXELS
        return {
            "positions": gl.buffer(reserve=max(count, 1) * 12, dynamic=True),
            "normals": gl.buffer(reserve=max(count, 1) * 12, dynamic=True),
            "light": gl.buffer(reserve=max(count, 1) * 16, dynamic=True),
            "still": make_buffer(gl, shape.looks),
            "triangles": make_buffer(gl, shape.triangles, "i4"),
            "across": None if shape.across is None else make_buffer(gl, shape.across),
            "wrinkles": None if shape.wrinkle_places is None else make_buffer(gl, shape.wrinkle_places),
            "wrinkle_texel": texel,
            "arrays": {},
            "pictures": Pictures(gl, shape, mesh.positions),
            "lit": None,
            "looks": None,
        }

    def _wrinkle_map(self, mesh: FaceMesh, parts: dict[str, Any], wide: float) -> Any:
        """Return the map of wrinkles for pixels of this width (m), or None where there is nothing to see."""
        if mesh.wrinkles is None or parts["wrinkles"] is None or mesh.wrinkles.max() < MIN_WRINKLE:
            return None
        halvings = count_halvings(parts["wrinkle_texel"], wide, max(WRINKLE_SHAPE))
        if halvings not in self._wrinkles:
            from PIL import Image

            channels = map(Image.fromarray, np.moveaxis(wrinkle_map(), 2, 0))
            smaller = [np.asarray(channel.reduce(2**halvings)) for channel in channels]
            texture = make_texture(self._gl, np.stack(smaller, axis=2))
            texture.repeat_x = texture.repeat_y = False
            self._wrinkles[halvings] = texture
        return self._wrinkles[halvings]

    def _relief_texture(self, wide: float) -> Any:
        """Return the skin's relief for pixels of this width (m), or None if it would be too fine to see."""
        if self._pixels is None:
            self._pixels = skin_relief()
        size = self._pixels.shape[0]
        halvings = count_halvings(RELIEF / size, wide, size)
        if size / 2**halvings < MIN_RELIEF * size:
            return None
        if halvings not in self._reliefs:
            from PIL import Image

            smaller = np.asarray(Image.fromarray(self._pixels).reduce(2**halvings))
            self._reliefs[halvings] = make_texture(self._gl, smaller)
        return self._reliefs[halvings]


def _set_shape(program: Any, shape: FaceShape) -> None:
    """Set the uniforms for a shape, unless the program has them already."""
    if program.extra.get("shape") is shape:
        return
    program.extra["shape"] = shape
    set_uniform(program, "scatter", shape.scatter)
    set_uniform(program, "fine", shape.fine)
    set_uniform(program, "two_sided", 1.0 if shape.two_sided else 0.0)
    set_uniform(program, "opacity", shape.opacity)


def _set_pose(program: Any, mesh: FaceMesh) -> None:
    """Set the uniforms for a mesh's position, turn and limbs, unless the program has them already."""
    pose = (mesh.matrix, mesh.turn, mesh.centre, mesh.limbs)
    before = program.extra.get("pose")
    if before is not None and all(now is then for now, then in zip(pose, before, strict=True)):
        return
    program.extra["pose"] = pose
    set_uniform(program, "world", matrix_bytes(mesh.matrix))
    set_uniform(program, "turn", tuple(mesh.turn.tolist()))
    set_uniform(program, "centre", tuple(mesh.centre.tolist()))
    if mesh.limbs is not None:
        set_uniform(program, "limbs", _padded(mesh.limbs))


def _padded(limbs: Float32) -> bytes:
    """Return limbs (2 K, 4) as the shader has them: thin ones far away in place of those missing."""
    padded = np.full((2 * MOST_LIMBS, 4), FAR, dtype=np.float32)
    padded[:, 3] = 1e-3
    padded[: len(limbs)] = limbs[: len(padded)]
    return padded.tobytes()


def _set_wrinkles(program: Any, mesh: FaceMesh) -> None:
    assert mesh.wrinkles is not None
    left, right = (tuple(float(strength) for strength in side) for side in mesh.wrinkles)
    set_uniform(program, "wrinkles_left", left)
    set_uniform(program, "wrinkles_right", right)
    height = TOP - BOTTOM
    set_uniform(program, "wrinkle_window", (1 / WIDTH, -1 / height, 0.0, TOP / height))


def _in_map(shape: FaceShape, positions: Float32) -> tuple[Float32, Float32, Int32]:
    """Return a shape's positions, places in the map of wrinkles, and triangles inside of the map."""
    assert shape.wrinkle_places is not None
    inside = (np.abs(shape.wrinkle_places[shape.triangles]) < max(WIDTH, TOP)).all(axis=(1, 2))
    return positions, shape.wrinkle_places, shape.triangles[inside]


def _release(parts: dict[str, Any]) -> None:
    for array in parts["arrays"].values():
        array.release()
    for name in ("positions", "normals", "light", "still", "triangles", "across", "wrinkles"):
        if parts[name] is not None:
            parts[name].release()
    parts["pictures"].close()
