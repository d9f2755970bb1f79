"""Draws a view's annotations over its figure: shells, grid, lines, dots, labels."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from functools import partial
from typing import Any

import numpy as np

from fba.arrays import Array, Float32, Float64, Int64, UInt8
from fba_player.gl._labels import (
    MAX_NAMES,
    MIN_LEGEND_HEIGHT,
    MIN_NAMES_HEIGHT,
    legend_picture,
    names_picture,
    place_names,
)
from fba_player.gl._resources import (
    RecentlyUsed,
    load_program,
    make_buffer,
    make_texture,
    matrix_bytes,
    set_uniform,
    write_buffer,
)
from fba_player.view._camera import Camera
from fba_player.view._geometry import project, world_normals, world_positions
from fba_player.view._view import Dots, Extras, FaceMesh, Grid, Legend, Lines

REFERENCE_HEIGHT = 720
"""Pixels: annotations have their nominal size in a picture this high."""
MIN_SCALE = 0.35
CROWDED_LENGTH = 7.0
"""Lines shorter than this (pixels) are drawn fainter, so that a fine mesh is a tint, not a black spot."""
NEAREST = 0.9
"""Share of the way to the camera to which a name is lifted at most."""
HIDDEN_OPACITY = 0.2
"""Opacity of a dot behind a surface."""
MIN_DOT_RADIUS = 0.8
NAME_SIZE = 13
MIN_NAME_SIZE = 10
"""Pixels."""
MIN_LEGEND_SCALE = 0.65
LEGEND_MARGIN = 14
"""Pixels from the legend to the edges of a picture 720 high."""
CACHED_LABELS = 16
"""Number of label textures that are cached."""
CACHED_SHELLS = 48
"""Number of shells whose triangles are cached; the least recently used goes first."""
PROGRAMS = ("line", "dot", "shell", "grid", "label")


def _pixels_per_metre(dots: Dots, camera: Camera, size: tuple[int, int]) -> float:
    """Return the pixels per metre at the middle of the dots."""
    if not len(dots.positions):
        return 0.0
    away = float(np.linalg.norm(dots.positions.mean(axis=0) - camera.eye))
    return size[1] / (2 * max(away, 1e-6) * math.tan(math.radians(camera.field_of_view) / 2))


class ExtrasRenderer:
    """Draws annotations. OpenGL objects are created on first use; `close` frees them."""

    def __init__(self, context: Any) -> None:
        self._gl = context
        self._programs: dict[str, Any] = {}
        self._square: Any = None
        self._buffers: dict[str, Any] = {}
        self._labels = RecentlyUsed[tuple[Any, Any]](CACHED_LABELS, lambda label: label[0].release())
        self._triangles = RecentlyUsed[Any](CACHED_SHELLS, lambda triangles: triangles.release())

    def draw(self, extras: Extras, camera: Camera, size: tuple[int, int]) -> None:
        """Draw into the bound framebuffer, over a picture from that camera and with its depths."""
        if not self._programs:
            self._programs = {name: load_program(self._gl, f"extra_{name}") for name in PROGRAMS}
            self._square = make_buffer(self._gl, [-1, -1, 1, -1, -1, 1, 1, 1])
        gl = self._gl
        matrix = camera.clip_matrix(size)
        for program in self._programs.values():
            set_uniform(program, "camera", matrix_bytes(matrix))
            set_uniform(program, "eye", tuple(float(v) for v in camera.eye))
            set_uniform(program, "size", (float(size[0]), float(size[1])))
        scale = max(size[1] / REFERENCE_HEIGHT, MIN_SCALE)
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
                self._draw_dots(dots, scale, _pixels_per_metre(dots, camera, size))
        gl.enable_only(gl.BLEND)
        if size[1] >= MIN_NAMES_HEIGHT:
            for dots in extras.dots:
                if any(dots.names):
                    self._draw_names(dots, matrix, camera.eye, size, scale)
        if extras.legend is not None and size[1] >= MIN_LEGEND_HEIGHT:
            self._draw_legend(extras.legend, size, max(scale, MIN_LEGEND_SCALE))
        gl.fbo.depth_mask = True
        gl.enable_only(gl.DEPTH_TEST)

    def close(self) -> None:
        self._labels.clear()
        self._triangles.clear()
        for part in (*self._buffers.values(), *self._programs.values()):
            part.release()
        if self._square is not None:
            self._square.release()
        self._square = None
        self._buffers.clear()
        self._programs.clear()

    def _fill_buffer(self, name: str, data: Array) -> Any:
        """Return the buffer of this name, filled with data; it grows as needed."""
        buffer = self._buffers.get(name)
        if buffer is None or buffer.size < data.nbytes:
            if buffer is not None:
                buffer.release()
            size = max(data.nbytes, 64) * 5 // 4
            buffer = self._buffers[name] = self._gl.buffer(reserve=size, dynamic=True)
        write_buffer(buffer, data)
        return buffer

    def _render(self, program: str, content: list[tuple[Any, ...]], instances: int) -> None:
        array = self._gl.vertex_array(self._programs[program], content)
        array.render(self._gl.TRIANGLE_STRIP, vertices=4, instances=instances)
        array.release()

    def _draw_shells(self, shells: tuple[FaceMesh, ...]) -> None:
        gl, arrays = self._gl, []
        for number, mesh in enumerate(shells):
            at = np.concatenate([world_positions(mesh), world_normals(mesh)], axis=1).astype("f4")
            vertices = self._fill_buffer(f"shell {number}", at)
            content = [(vertices, "3f 3f", "in_position", "in_normal")]
            triangles = self._triangles.get(mesh.shape, partial(make_buffer, gl, mesh.shape.triangles, "i4"))
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
        set_uniform(program, "crowded", CROWDED_LENGTH * scale)
        corners = self._fill_buffer("corners", np.array([0, -1, 1, -1, 0, 1, 1, 1], dtype="f4"))
        ends = self._fill_buffer("ends", lines.ends.astype("f4"))
        names = ("in_from_colour", "in_to_colour")
        if isinstance(lines.colours, tuple):
            colours = self._fill_buffer("colour", np.array([lines.colours] * 2, dtype="f4"))
            tint = (colours, "4f 4f/r", *names)
        else:
            colours = self._fill_buffer("colours", lines.colours.astype("f4"))
            tint = (colours, "4f 4f/i", *names)
        content = [(corners, "2f", "in_corner"), (ends, "3f 3f/i", "in_from", "in_to"), tint]
        self._render("line", content, len(lines.ends))

    def _draw_dots(self, dots: Dots, scale: float, near: float) -> None:
        """Draw dots. near: pixels per metre where they are."""
        if not len(dots.positions):
            return
        gl, program = self._gl, self._programs["dot"]
        set_uniform(program, "radius", max(min(dots.radius * scale, dots.most * near), MIN_DOT_RADIUS))
        set_uniform(program, "lift", dots.lift)
        set_uniform(program, "colour", dots.colour)
        content = [
            (self._square, "2f", "in_corner"),
            (self._fill_buffer("places", dots.positions.astype("f4")), "3f/i", "in_place"),
        ]
        for opacity, depth in ((HIDDEN_OPACITY, ">"), (1.0, "<")):
            set_uniform(program, "opacity", opacity)
            gl.depth_func = depth
            self._render("dot", content, len(dots.positions))

    def _draw_names(
        self, dots: Dots, matrix: Float64, eye: Float64, size: tuple[int, int], scale: float
    ) -> None:
        pixels = max(round(NAME_SIZE * scale), MIN_NAME_SIZE)
        texture, boxes = self._label((dots.names, pixels), lambda: names_picture(dots.names, pixels))
        at = dots.positions.astype(np.float64)
        pixel, depth = project(at, matrix, size)
        towards = eye - at
        facing = np.einsum("ij,ij->i", dots.facing, towards) >= 0
        away = np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-6)
        nearer = project(at + towards * np.minimum(dots.lift / away, NEAREST), matrix, size)[1]
        inside = facing & np.isfinite(depth) & ((pixel >= 0) & (pixel < size)).all(axis=1)
        if not 0 < inside.sum() <= MAX_NAMES:
            return
        inside[inside] = nearer[inside] <= self._depths_at(pixel[inside].astype(int), size)
        pixel[~inside] = np.nan
        shown, corners = place_names(pixel, boxes[:, 2:], dots.radius * scale, size)
        if len(shown):
            parts = boxes[shown].astype(np.float64)
            texture_size = np.array(texture.size * 2, dtype=np.float64)
            self._draw_labels(texture, np.concatenate([corners, parts[:, 2:], parts / texture_size], axis=1))

    def _draw_legend(self, legend: Legend, size: tuple[int, int], scale: float) -> None:
        texture, _ = self._label((legend, scale), lambda: (legend_picture(legend, scale), None))
        wide, high = texture.size
        edge = round(LEGEND_MARGIN * scale)
        if wide + 2 * edge <= size[0]:
            self._draw_labels(texture, np.array([[edge, edge, wide, high, 0.0, 0.0, 1.0, 1.0]]))

    def _depths_at(self, pixels: Int64, size: tuple[int, int]) -> Float32:
        """Return float32 (N,): depths of the picture, 0..1, at pixels (N, 2) from the upper left."""
        gl, source, parts = self._gl, self._gl.fbo, []
        if source.samples:
            parts = [gl.renderbuffer(size, 4), gl.depth_renderbuffer(size)]
            parts.append(gl.framebuffer(parts[:1], parts[1]))
            gl.copy_framebuffer(parts[2], source)
        at = np.stack([pixels[:, 0], size[1] - 1 - pixels[:, 1]], axis=1)
        low = at.min(axis=0)  # only the rectangle with all of them is read
        width, height = (at.max(axis=0) - low + 1).tolist()
        within = (*low.tolist(), width, height)
        data = (parts[2] if parts else source).read(within, components=1, attachment=-1, dtype="f4")
        source.use()
        for part in reversed(parts):
            part.release()
        column, row = (at - low).T
        return np.asarray(np.frombuffer(data, dtype=np.float32).reshape(height, width)[row, column])

    def _label(self, key: Hashable, make: Callable[[], tuple[UInt8, Any]]) -> tuple[Any, Any]:
        """Return a texture of labels, cached, and what `make` returned with its picture."""

        def upload() -> tuple[Any, Any]:
            picture, more = make()
            return make_texture(self._gl, picture, smooth=False), more

        return self._labels.get(key, upload)

    def _draw_labels(self, texture: Any, boxes: Float64) -> None:
        """Draw parts of a texture. boxes: (N, 8), as in extra_label.vert."""
        texture.use(0)
        corners = self._fill_buffer("label corners", np.array([0, 0, 1, 0, 0, 1, 1, 1], dtype="f4"))
        content = [
            (corners, "2f", "in_corner"),
            (self._fill_buffer("boxes", boxes.astype("f4")), "4f 4f/i", "in_box", "in_part"),
        ]
        self._render("label", content, len(boxes))
