"""Draws a `View` with OpenGL 3.3 core."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from fba.arrays import Float32, Float64, Int32
from fba_player._mesh.primitives import capsule_mesh, sphere_mesh
from fba_player.gl._annotation_renderer import ExtrasRenderer
from fba_player.gl._antialias_region import Steps, find_steps
from fba_player.gl._ground_shadow import GroundShadow, Shade
from fba_player.gl._lod import Details
from fba_player.gl._mesh_renderer import FaceRenderer
from fba_player.gl._resources import (
    RecentlyUsed,
    load_program,
    make_buffer,
    matrix_bytes,
    set_uniform,
    write_buffer,
)
from fba_player.gl._silhouette import Outliner
from fba_player.view._camera import Camera
from fba_player.view._view import CAPSULE_FLOATS, Eye, Mesh, View

WIPE_LINE = 1 / 720
"""Half the width of the line of a wipe, as a share of the picture's height."""
MAX_BLOBS = 8
"""Largest number of soft shadows on the ground."""
HIDDEN_OPACITY = 0.16
"""Opacity of a mark behind a surface."""
MIN_MARK_RADIUS = 0.9
"""Least radius of a mark, pixels."""
MARK_LIFT = 0.003
"""Marks are drawn over surfaces that hide them by less than this (m)."""
EYE_ROWS, SMALL_EYE = ((20, 32), (8, 14)), 6.0
"""Rows and columns of vertices of an eyeball, and of one whose radius is below this number of pixels."""
CACHED_SHAPES = 32
"""Number of meshes whose buffers are cached; the least recently used goes first."""


class Renderer:
    """Draws views into whatever framebuffer is bound.

    context: a moderngl context (OpenGL 3.3 or later). The renderer owns what it allocates there; `close`
    frees it. Not thread-safe, as OpenGL is not.
    """

    def __init__(self, context: Any) -> None:
        self._gl = context
        self._programs = {
            name: load_program(context, name) for name in ("mesh", "capsule", "eye", "studio", "shadow")
        }
        self._faces = FaceRenderer(context)
        self._studio_buffer = make_buffer(context, [-1, -1, 3, -1, -1, 3])
        self._square = make_buffer(context, [-1, -1, 1, -1, -1, 1, 1, 1])
        self._blobs = context.buffer(reserve=MAX_BLOBS * 16, dynamic=True)
        self._shadow = context.vertex_array(
            self._programs["shadow"], [(self._square, "2f", "in_corner"), (self._blobs, "4f/i", "in_blob")]
        )
        self._ground_shadow = GroundShadow(context)
        self._backdrop: tuple[tuple[object, ...], Any, Any] | None = None
        self._studio_key: tuple[object, ...] = ()
        studio = self._programs["studio"]
        self._studio = context.vertex_array(studio, [(self._studio_buffer, "2f", "in_corner")])
        self._instances = context.buffer(reserve=CAPSULE_FLOATS * 4 * 128, dynamic=True)
        self._capsule_parts = _make_buffers(context, *capsule_mesh())
        self._capsules = self._capsule_array()
        self._eyeballs = [self._make_eyeball(*rows) for rows in EYE_ROWS]
        self._outliner = Outliner()
        self._details = Details()
        self._extras = ExtrasRenderer(context)
        self._shapes = RecentlyUsed[list[Any]](CACHED_SHAPES, _release)
        self._seen: tuple[object, ...] = ()
        set_uniform(self._programs["capsule"], "opacity", 1.0)

    @property
    def morphing(self) -> bool:
        """Whether a face of the last picture was changing from one level of detail to another."""
        return self._details.morphing

    def draw(
        self,
        view: View,
        camera: Camera,
        size: tuple[int, int],
        now: float | None = None,
        *,
        smoothed: bool = True,
    ) -> Steps:
        """Clear the bound framebuffer, draw the view, and return where its edges need smoothing.

        size: width and height of the framebuffer in pixels. now: seconds, by which levels of detail change
        gradually; None for a picture that does not depend on the one before. smoothed: False where no edges
        are smoothed afterwards; none are looked for then.
        """
        steps = self._draw_whole(view, camera, size, now, smoothed=smoothed)
        if view.wipe is None:
            return steps
        gl, morphing = self._gl, self.morphing
        line = round(view.wipe.at * size[0])
        gl.fbo.scissor = (line, 0, size[0] - line, size[1])
        others = self._draw_whole(view.wipe.view, camera, size, now, smoothed=smoothed)
        half = max(round(WIPE_LINE * size[1]), 1)
        gl.fbo.scissor = (line - half, 0, 2 * half, size[1])
        gl.fbo.clear(1.0, 1.0, 1.0, 1.0)
        gl.fbo.scissor = None
        self._details.morphing |= morphing
        tiles = np.concatenate([steps.tiles, others.tiles])
        return Steps([*steps.rectangles, *others.rectangles], tiles)

    def _draw_whole(
        self, view: View, camera: Camera, size: tuple[int, int], now: float | None, *, smoothed: bool
    ) -> Steps:
        gl = self._gl
        aspect = size[0] / max(size[1], 1)
        seen = camera.view_matrix()
        matrix, eye = camera.projection_matrix(aspect) @ seen, -seen[:3, :3].T @ seen[:3, 3]
        pixel = camera.seen(size[1]).pixel

        gl.viewport = (0, 0, *size)
        self._set_camera(tuple(eye.tolist()), matrix_bytes(matrix), pixel)
        drawn = replace(view, faces=self._details.choose(view.faces, eye, pixel, view.lod, now))
        shade = self._draw_studio(drawn, matrix, size, (float(camera.target[0]), float(camera.target[2])))
        # As late as this, software OpenGL clears the depth with the pixels that it draws, tile by tile.
        gl.fbo.color_mask = (False,) * 4
        gl.fbo.clear(depth=1.0)
        gl.fbo.color_mask = (True,) * 4
        gl.fbo.use()  # else the mask would not change
        gl.enable_only(gl.DEPTH_TEST)
        for mesh in view.meshes:
            self._draw_mesh(mesh)
        self._draw_capsules(view.capsules)
        self._draw_marks(view.marks)
        self._faces.begin(eye, matrix, pixel, shade and shade._replace(finely=not smoothed))
        self._faces.draw_opaque(drawn.faces)
        gl.enable(gl.CULL_FACE)
        for ball in view.eyes:  # after the skin, which hides most of them, and before lashes
            self._draw_eye(ball, eye, pixel)
        gl.disable(gl.CULL_FACE)
        self._faces.draw_transparent(drawn.faces)
        steps = Steps([], np.zeros((0, 2), dtype=np.float32))
        if smoothed:  # before annotations, which wait for the depths of what is drawn
            shells = [] if view.extras is None else view.extras.shells
            outlined = replace(drawn, faces=[*drawn.faces, *shells])
            steps = find_steps(outlined, matrix, size, self._outliner)
        if view.extras is not None:
            self._extras.draw(view.extras, camera, size)
        return steps

    def _set_camera(self, *seen: object) -> None:
        """Set the camera in all programs: its position, the matrix to clip space, a pixel's size."""
        if seen == self._seen:
            return
        self._seen = seen
        for program in self._programs.values():
            for name, value in zip(("eye", "camera", "pixel"), seen, strict=True):
                set_uniform(program, name, value)

    def close(self) -> None:
        """Free all OpenGL objects."""
        self._shapes.clear()
        self._faces.close()
        self._ground_shadow.close()
        self._extras.close()
        for part in (
            *(self._backdrop[:0:-1] if self._backdrop else ()), self._shadow, self._square, self._blobs,
            self._studio, self._studio_buffer, self._capsules, self._instances, *self._capsule_parts,
            *(part for parts in self._eyeballs for part in parts), *self._programs.values(),
        ):  # fmt: skip
            part.release()

    def _capsule_array(self) -> Any:
        return self._gl.vertex_array(
            self._programs["capsule"],
            [
                (self._capsule_parts[0], "3f 1f", "in_sphere", "in_end"),
                (self._instances, "4f 4f 4f 4f/i", "in_start", "in_finish", "in_front", "in_colour"),
            ],
            index_buffer=self._capsule_parts[1],
        )

    def _draw_studio(
        self, view: View, matrix: Float64, size: tuple[int, int], centre: tuple[float, float]
    ) -> Shade | None:
        """Draw backdrop and ground, cached while the camera stays, and shadows; see `_draw_shadows`.

        centre: x and z of the ground's brightest point.
        """
        gl = self._gl
        if view.background is not None:
            gl.clear(*view.background, 1.0)
            return self._draw_shadows(view, matrix)
        target = gl.fbo
        key = (size, view.ground, matrix.tobytes(), centre)
        before, self._studio_key = self._studio_key, key
        if self._backdrop is None or self._backdrop[0] != key:
            if before == key:  # kept from the second picture on: to copy it takes time, too
                self._backdrop = (key, *self._backdrop_buffer(size))
                self._backdrop[2].use()
            program = self._programs["studio"]
            set_uniform(program, "unproject", matrix_bytes(np.linalg.inv(matrix)))
            set_uniform(program, "ground", 1.0 if view.ground else 0.0)
            set_uniform(program, "centre", centre)
            set_uniform(program, "size", size)
            gl.viewport = (0, 0, *size)
            gl.enable_only(gl.NOTHING)
            self._studio.render()
        target.use()  # first, as only then its scissor bounds what is copied
        if self._backdrop is not None and self._backdrop[0] == key:
            gl.copy_framebuffer(target, self._backdrop[2])
        gl.viewport = (0, 0, *size)
        return self._draw_shadows(view, matrix)

    def _draw_shadows(self, view: View, matrix: Float64) -> Shade | None:
        """Draw soft shadows on the ground, and return the map of those on bodies."""
        gl = self._gl
        blobs = np.ascontiguousarray(view.blobs[:MAX_BLOBS], dtype="f4")
        if not view.ground or not len(blobs):
            return None
        shade = self._ground_shadow.draw(view.faces, view.blobs[:, :2], matrix)
        if shade is not None:
            return shade
        gl.enable_only(gl.BLEND)
        gl.blend_func = gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE
        self._blobs.write(blobs)
        self._shadow.render(gl.TRIANGLE_STRIP, instances=len(blobs))
        return None

    def _backdrop_buffer(self, size: tuple[int, int]) -> tuple[Any, Any]:
        if self._backdrop is not None:
            if self._backdrop[0][0] == size:
                return self._backdrop[1], self._backdrop[2]
            self._backdrop[2].release()
            self._backdrop[1].release()
        buffer = self._gl.renderbuffer(size, 4)
        return buffer, self._gl.framebuffer([buffer])

    def _draw_mesh(self, mesh: Mesh) -> None:
        positions, normals, array, *_ = self._shapes.get(mesh.shape, lambda: self._upload_mesh(mesh))
        write_buffer(positions, mesh.positions)
        write_buffer(normals, mesh.normals)
        set_uniform(self._programs["mesh"], "world", matrix_bytes(mesh.matrix))
        set_uniform(self._programs["mesh"], "two_sided", 1.0 if mesh.shape.two_sided else 0.0)
        set_uniform(self._programs["mesh"], "raised", mesh.shape.raised)
        array.render()

    def _upload_mesh(self, mesh: Mesh) -> list[Any]:
        """Return the buffers of positions and normals, the vertex array, and what belongs to it."""
        gl, shape = self._gl, mesh.shape
        positions = gl.buffer(reserve=mesh.positions.size * 4, dynamic=True)
        normals = gl.buffer(reserve=mesh.positions.size * 4, dynamic=True)
        colours, triangles = make_buffer(gl, shape.colours), make_buffer(gl, shape.triangles, "i4")
        array = gl.vertex_array(
            self._programs["mesh"],
            [(positions, "3f", "in_position"), (normals, "3f", "in_normal"), (colours, "4f", "in_colour")],
            index_buffer=triangles,
        )
        return [positions, normals, array, colours, triangles]

    def _draw_capsules(self, capsules: Float32) -> None:
        if not len(capsules):
            return
        data = np.ascontiguousarray(capsules, dtype="f4")
        if data.nbytes > self._instances.size:
            self._capsules.release()
            self._instances.release()
            self._instances = self._gl.buffer(reserve=data.nbytes, dynamic=True)
            self._capsules = self._capsule_array()
        self._instances.orphan(max(self._instances.size, data.nbytes))
        self._instances.write(data)
        self._capsules.render(instances=len(data))

    def _draw_marks(self, marks: Float32) -> None:
        """Draw marks as capsules, faintly through surfaces that hide them."""
        if not len(marks):
            return
        gl = self._gl
        set_uniform(self._programs["capsule"], "thinnest", MIN_MARK_RADIUS)
        set_uniform(self._programs["capsule"], "raised", MARK_LIFT)
        self._draw_capsules(marks)
        gl.enable_only(gl.DEPTH_TEST | gl.BLEND | gl.CULL_FACE)
        gl.blend_func = gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE
        gl.depth_func = ">"
        gl.fbo.depth_mask = False
        set_uniform(self._programs["capsule"], "opacity", HIDDEN_OPACITY)
        self._capsules.render(instances=len(marks))
        set_uniform(self._programs["capsule"], "opacity", 1.0)
        set_uniform(self._programs["capsule"], "thinnest", 0.0)
        set_uniform(self._programs["capsule"], "raised", 0.0)
        gl.fbo.depth_mask = True
        gl.depth_func = "<"
        gl.enable_only(gl.DEPTH_TEST)

    def _make_eyeball(self, rows: int, around: int) -> tuple[Any, Any, Any]:
        """Return the vertex array of a sphere, and its buffers. rows, around: numbers of vertices."""
        vertices, inward = sphere_mesh(rows, around)
        points, triangles = _make_buffers(self._gl, vertices, inward[:, ::-1])
        attributes = [(points, "3f", "in_position")]
        program = self._programs["eye"]
        return self._gl.vertex_array(program, attributes, index_buffer=triangles), points, triangles

    def _draw_eye(self, ball: Eye, eye: Float64, pixel: float) -> None:
        """Draw an eyeball for a camera at `eye` (3,). pixel: its size at distance 1."""
        program = self._programs["eye"]
        set_uniform(program, "world", matrix_bytes(ball.matrix))
        set_uniform(program, "iris", ball.iris)
        set_uniform(program, "pupil", ball.pupil)
        set_uniform(program, "lids", np.ascontiguousarray(ball.lids, dtype="f4").tobytes())
        set_uniform(program, "head", matrix_bytes(ball.axes))
        radius = max(float(np.linalg.norm(ball.matrix[:3, 0])), 1e-9)
        axes = ball.matrix[:3, :3] / radius
        set_uniform(program, "ball", matrix_bytes(axes))
        set_uniform(program, "tint", ball.tint)
        small = radius < SMALL_EYE * pixel * float(np.linalg.norm(ball.matrix[:3, 3] - eye))
        self._eyeballs[small][0].render()


def _make_buffers(context: Any, vertices: Float32, triangles: Int32) -> tuple[Any, Any]:
    return make_buffer(context, vertices), make_buffer(context, triangles, "i4")


def _release(parts: list[Any]) -> None:
    for part in parts:
        part.release()
