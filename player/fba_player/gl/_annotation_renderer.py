"""Draws a view's annotations over its figure: shells, grid, lines, dots, labels."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from typing import Any

import numpy as np

from fba.arrays import Array, Float32, Float64, UInt8
from fba_player.gl._labels import (
    MOST_NAMES,
    SMALLEST,
    SMALLEST_WITH_LEGEND,
    legend_picture,
    names_picture,
    placed_names,
)
from fba_player.gl.programs import load_program, matrix_bytes, set_uniform
from fba_player.view.camera import Camera
from fba_player.view.geometry import world_normals, world_positions
from fba_player.view.view import Dots, Extras, FaceMesh, FaceShape, Grid, Legend, Lines

REFERENCE_HEIGHT, LEAST_SCALE = 720, 0.35
CROWDED = 7.0
"""Lines shorter than this (pixels) are drawn fainter, so that a fine mesh is a tint and no black spot."""
HIDDEN = 0.2
"""Opacity of a dot behind a surface."""
LEAST_RADIUS = 0.8
NAME_SIZE, SMALLEST_NAME = 13, 10
LEAST_LEGEND = 0.65
MARGIN = 14
MOST_WORDS = 16
"""Number of label textures that are cached."""
MOST_SHELLS = 48
"""Number of shells whose triangles are cached; the least recently used goes first."""
PROGRAMS = ("line", "dot", "shell", "grid", "label")


def projected(places: Float64, matrix: Float64, size: tuple[int, int]) -> tuple[Float64, Float64]:
    """Pixels (N, 2) from the upper left and depths (N,), 0..1, of points (N, 3); NaN behind the camera.

    matrix: (4, 4), world to clip space.
    """
    clip = np.column_stack([places, np.ones(len(places))]) @ matrix.T
    clip[clip[:, 3] < 1e-6] = np.nan
    flat = clip[:, :3] / clip[:, 3:]
    return (flat[:, :2] * (0.5, -0.5) + 0.5) * size, flat[:, 2] * 0.5 + 0.5


def _pixels_a_metre(dots: Dots, camera: Camera, size: tuple[int, int]) -> float:
    """Pixels per metre at the middle of the dots."""
    if not len(dots.places):
        return 0.0
    away = float(np.linalg.norm(dots.places.mean(axis=0) - camera.eye))
    return size[1] / (2 * max(away, 1e-6) * math.tan(math.radians(camera.field_of_view) / 2))


def _towards(eye: Float64, places: Float64, lift: float) -> Float64:
    way = eye - places
    shift: Float64 = way * (lift / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-6))
    return shift


class ExtrasRenderer:
    """Draws annotations. OpenGL objects are created on first use; `close` frees them."""

    def __init__(self, context: Any) -> None:
        self._gl = context
        self._programs: dict[str, Any] = {}
        self._square: Any = None
        self._buffers: dict[str, Any] = {}
        self._textures: dict[Hashable, tuple[Any, Any]] = {}
        self._depths: Float32 | None = None
        self._indices: dict[int, tuple[FaceShape, Any]] = {}

    def draw(self, extras: Extras, camera: Camera, size: tuple[int, int]) -> None:
        """Draw into the bound framebuffer, over a picture from that camera and with its depths."""
        if not self._programs:
            self._programs = {name: load_program(self._gl, f"extra_{name}") for name in PROGRAMS}
            self._square = self._gl.buffer(np.array([-1, -1, 1, -1, -1, 1, 1, 1], dtype="f4").tobytes())
        gl = self._gl
        matrix = camera.projection_matrix(size[0] / max(size[1], 1)) @ camera.view_matrix()
        for program in self._programs.values():
            set_uniform(program, "camera", matrix_bytes(matrix))
            set_uniform(program, "eye", tuple(float(v) for v in camera.eye))
            set_uniform(program, "size", (float(size[0]), float(size[1])))
        scale = max(size[1] / REFERENCE_HEIGHT, LEAST_SCALE)
        gl.enable_only(gl.DEPTH_TEST | gl.BLEND)
        self._draw_shells(extras.shells)
        gl.fbo.depth_mask = False
        # Annotations are antialiased already: they clear alpha, which tells the target not to smooth them.
        gl.blend_func = gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE_MINUS_SRC_ALPHA
        if extras.grid is not None:
            self._draw_grid(extras.grid)
        for lines in extras.lines:
            self._draw_lines(lines, scale)
        for dots in extras.dots:
            if dots.radius > 0:
                self._draw_dots(dots, scale, _pixels_a_metre(dots, camera, size))
        gl.enable_only(gl.BLEND)
        self._depths = None
        if size[1] >= SMALLEST:
            for dots in extras.dots:
                self._draw_names(dots, matrix, camera.eye, size, scale)
        if extras.legend is not None and size[1] >= SMALLEST_WITH_LEGEND:
            self._draw_legend(extras.legend, size, max(scale, LEAST_LEGEND))
        gl.fbo.depth_mask = True
        gl.enable_only(gl.DEPTH_TEST)

    def close(self) -> None:
        """Free all OpenGL objects."""
        for texture, _ in self._textures.values():
            texture.release()
        for _, triangles in self._indices.values():
            triangles.release()
        for part in (*self._buffers.values(), *self._programs.values()):
            part.release()
        if self._square is not None:
            self._square.release()
        self._square = None
        self._textures.clear()
        self._indices.clear()
        self._buffers.clear()
        self._programs.clear()

    def _filled(self, name: str, data: Array) -> Any:
        """The buffer of this name, filled with data; it grows as needed."""
        held = self._buffers.get(name)
        if held is None or held.size < data.nbytes:
            if held is not None:
                held.release()
            held = self._buffers[name] = self._gl.buffer(reserve=max(data.nbytes, 64) * 5 // 4, dynamic=True)
        held.orphan()
        held.write(np.ascontiguousarray(data))
        return held

    def _render(self, program: str, content: list[tuple[Any, ...]], instances: int) -> None:
        array = self._gl.vertex_array(self._programs[program], content)
        array.render(self._gl.TRIANGLE_STRIP, vertices=4, instances=instances)
        array.release()

    def _draw_shells(self, shells: tuple[FaceMesh, ...]) -> None:
        gl, arrays = self._gl, []
        for number, mesh in enumerate(shells):
            at = np.concatenate([world_positions(mesh), world_normals(mesh)], axis=1).astype("f4")
            vertices = self._filled(f"shell {number}", at)
            content = [(vertices, "3f 3f", "in_position", "in_normal")]
            triangles = self._triangles(mesh.shape)
            arrays.append(gl.vertex_array(self._programs["shell"], content, index_buffer=triangles))
        # Depths first, so that only the nearest surface shows.
        gl.blend_func = gl.ZERO, gl.ONE
        for array in arrays:
            array.render()
        gl.blend_func = gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE
        gl.depth_func = "<="
        for array in arrays:
            array.render()
        gl.depth_func = "<"
        for array in arrays:
            array.release()

    def _triangles(self, shape: FaceShape) -> Any:
        """The index buffer of a shell, cached."""
        held = self._indices.pop(id(shape), None)
        if held is None:
            data = np.ascontiguousarray(shape.triangles, dtype="i4").tobytes()
            held = (shape, self._gl.buffer(data))
        self._indices[id(shape)] = held  # most recently used
        while len(self._indices) > MOST_SHELLS:
            self._indices.pop(next(iter(self._indices)))[1].release()
        return held[1]

    def _draw_grid(self, grid: Grid) -> None:
        program = self._programs["grid"]
        set_uniform(program, "centre", grid.centre)
        set_uniform(program, "height", grid.height)
        set_uniform(program, "reach", grid.reach)
        set_uniform(program, "step_", grid.step)
        self._render("grid", [(self._square, "2f", "in_corner")], 1)

    def _draw_lines(self, lines: Lines, scale: float) -> None:
        if not len(lines.ends):
            return
        program = self._programs["line"]
        set_uniform(program, "width", max(lines.width * scale, 0.8))
        set_uniform(program, "lift", lines.lift)
        set_uniform(program, "crowded", CROWDED * scale)
        corners = self._filled("corners", np.array([0, -1, 1, -1, 0, 1, 1, 1], dtype="f4"))
        ends = self._filled("ends", lines.ends.astype("f4"))
        names = ("in_from_colour", "in_to_colour")
        if isinstance(lines.colours, tuple):
            colours = self._filled("colour", np.array([lines.colours] * 2, dtype="f4"))
            tint = (colours, "4f 4f/r", *names)
        else:
            colours = self._filled("colours", lines.colours.astype("f4"))
            tint = (colours, "4f 4f/i", *names)
        content = [(corners, "2f", "in_corner"), (ends, "3f 3f/i", "in_from", "in_to"), tint]
        self._render("line", content, len(lines.ends))

    def _draw_dots(self, dots: Dots, scale: float, near: float) -> None:
        """Draw dots. near: pixels per metre where they are."""
        if not len(dots.places):
            return
        gl, program = self._gl, self._programs["dot"]
        set_uniform(program, "radius", max(min(dots.radius * scale, dots.most * near), LEAST_RADIUS))
        set_uniform(program, "lift", dots.lift)
        set_uniform(program, "colour", dots.colour)
        content = [
            (self._square, "2f", "in_corner"),
            (self._filled("places", dots.places.astype("f4")), "3f/i", "in_place"),
        ]
        for opacity, depth in ((HIDDEN, ">"), (1.0, "<")):
            set_uniform(program, "opacity", opacity)
            gl.depth_func = depth
            self._render("dot", content, len(dots.places))

    def _draw_names(
        self, dots: Dots, matrix: Float64, eye: Float64, size: tuple[int, int], scale: float
    ) -> None:
        pixels = max(round(NAME_SIZE * scale), SMALLEST_NAME)
        words, boxes = self._words((dots.names, pixels), lambda: names_picture(dots.names, pixels))
        at = dots.places.astype(np.float64)
        facing = np.einsum("ij,ij->i", dots.facing, eye - at) >= 0
        pixel, depth = projected(at, matrix, size)
        nearer = projected(at + _towards(eye, at, dots.lift), matrix, size)[1]
        inside = facing & np.isfinite(depth) & ((pixel >= 0) & (pixel < size)).all(axis=1)
        if not 0 < inside.sum() <= MOST_NAMES:
            return
        column, row = pixel[inside].astype(int).T
        inside[inside] = nearer[inside] <= self._depths_of(size)[size[1] - 1 - row, column]
        pixel[~inside] = np.nan
        chosen, corners = placed_names(pixel, boxes[:, 2:], dots.radius * scale, size)
        if len(chosen):
            own = boxes[chosen].astype(np.float64)
            whole = np.array(words.size * 2, dtype=np.float64)
            self._draw_labels(words, np.concatenate([corners, own[:, 2:], own / whole], axis=1))

    def _draw_legend(self, legend: Legend, size: tuple[int, int], scale: float) -> None:
        words, _ = self._words((legend, scale), lambda: (legend_picture(legend, scale), None))
        wide, high = words.size
        edge = round(MARGIN * scale)
        if wide + 2 * edge <= size[0]:
            self._draw_labels(words, np.array([[edge, edge, wide, high, 0.0, 0.0, 1.0, 1.0]]))

    def _depths_of(self, size: tuple[int, int]) -> Float32:
        """float32 (H, W): depths of the picture, 0..1, bottom row first; read once for each picture."""
        if self._depths is not None:
            return self._depths
        gl, source, parts = self._gl, self._gl.fbo, []
        if source.samples:
            parts = [gl.renderbuffer(size, 4), gl.depth_renderbuffer(size)]
            parts.append(gl.framebuffer(parts[:1], parts[1]))
            gl.copy_framebuffer(parts[2], source)
        data = (parts[2] if parts else source).read(components=1, attachment=-1, dtype="f4")
        source.use()
        for part in reversed(parts):
            part.release()
        self._depths = np.frombuffer(data, dtype=np.float32).reshape(size[1], size[0])
        return self._depths

    def _words(self, key: Hashable, make: Callable[[], tuple[UInt8, Any]]) -> tuple[Any, Any]:
        """A texture of labels and what `make` returned with it; the last few are cached."""
        held = self._textures.pop(key, None)
        if held is None:
            picture, more = make()
            texture = self._gl.texture((picture.shape[1], picture.shape[0]), 4, picture.tobytes())
            texture.filter = (self._gl.NEAREST, self._gl.NEAREST)
            held = (texture, more)
        self._textures[key] = held  # most recently used
        while len(self._textures) > MOST_WORDS:
            self._textures.pop(next(iter(self._textures)))[0].release()
        return held

    def _draw_labels(self, words: Any, boxes: Float64) -> None:
        words.use(0)
        corners = self._filled("label corners", np.array([0, 0, 1, 0, 0, 1, 1, 1], dtype="f4"))
        content = [
            (corners, "2f", "in_corner"),
            (self._filled("boxes", boxes.astype("f4")), "4f 4f/i", "in_box", "in_part"),
        ]
        self._render("label", content, len(boxes))
