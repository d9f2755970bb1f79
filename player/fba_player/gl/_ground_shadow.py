"""The shadows of bodies on ground and bodies, from a large key light and the sky: maps that shaders draw.

The first passes draw all triangles as the key light and the sky see them. Of the former they keep how high
what it reaches first is: bodies are in the shade below that; of the latter how near the ground the lowest
is. What is around each piece of ground comes from halved copies. The next pass finds the ground's darkness:
the nearer what hides the light, the sharper. The last draws it. Around the feet of few bodies both are done
once more, finely: there shoes stand on the ground.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fba.arrays import Float32, Float64, Int32, Intp, UInt8
from fba.mesh.simplify import TOLERANCES, DetailLevels
from fba.rotations import unit
from fba_player._figure.face_light import KEY_DIRECTION
from fba_player.gl._resources import (
    RecentlyUsed,
    load_program,
    make_buffer,
    matrix_bytes,
    set_uniforms,
    write_buffer,
)
from fba_player.view._view import FaceMesh, FaceShape

TEXELS = 256
"""Texels along each side of the maps that the sky and the key light see."""
HALVINGS = 5
"""How often the maps are halved."""
CELLS, NEAR_CELLS = 64, 56
"""Texels of the darkness along each side, of all the ground and of that near feet."""
FRAMED = 0.25
"""Metres: in steps of these, the map that the key light sees is larger than what throws shadows."""
WIDTH = 4.0
"""Metres of ground, along each side, for one body."""
COARSE = 2.4
"""Shadows are cast coarsely on ground that is wider than this, in multiples of `WIDTH`."""
MAX_COARSE_ERROR = TOLERANCES[-2]
"""Largest error (m) of what casts the shadow of one body among several."""
CONTACT = 1.3
"""Metres, along each side, of the ground that is looked at finely around feet; twice that in long steps."""
BEYOND = 0.5
"""Metres by which it is wider than the feet are apart, at least."""
SKY_REACH, KEY_REACH = 1.1, 0.8
"""Metres beyond what hides the sky, and beyond what hides the key light, up to which ground may be darker."""
Part = tuple[float, ...]
"""Of a square of ground: corner and size, as shares of it."""
ALL: Part = (0.0, 0.0, 1.0, 1.0)
ACROSS = unit(np.array([KEY_DIRECTION[2], 0.0, -KEY_DIRECTION[0]]))
BEFORE = np.stack([ACROSS, np.cross(unit(np.array(KEY_DIRECTION)), ACROSS)], axis=1).astype(np.float32)
"""(3, 2): axes of the map that the key light sees, as in shaders/lighting.glsl."""
INNER_KINDS = ("teeth", "tongue", "mouth", "eye")
"""Kinds of parts that lie inside others and cast no shadow."""
CACHED_SHAPES = 512
"""Number of shapes whose casting vertices are cached."""


class Shade(NamedTuple):
    """A map of heights that the key light reaches first. frame: as in the shaders. finely: for each pixel."""

    tops: Any
    frame: tuple[float, float, float]
    finely: bool = False


class GroundShadow:
    """Draws shadows on the ground y = 0. Owns what it allocates on the moderngl context; `close` frees it."""

    def __init__(self, context: Any) -> None:
        self._gl = context
        # Both of one format: software OpenGL compiles the halving of each format at every start.
        self._heights, self._tops = (context.texture((TEXELS, TEXELS), 4, dtype="f4") for _ in range(2))
        self._darkness, self._contact = (
            context.texture((cells, cells), 1, alignment=1) for cells in (CELLS, NEAR_CELLS)
        )
        for texture in (self._heights, self._tops, self._darkness, self._contact):
            texture.repeat_x = texture.repeat_y = False
            texture.filter = (context.LINEAR, context.LINEAR)
        self._seen = {map_: context.framebuffer([map_]) for map_ in (self._tops, self._heights)}
        self._shaded, self._near = (context.framebuffer([map_]) for map_ in (self._darkness, self._contact))
        self._shapes = RecentlyUsed[tuple[Intp, Int32]](CACHED_SHAPES, lambda _: None)
        self._thrown_parts: list[Any] = []
        self._thrown_shapes: list[tuple[FaceShape, bool]] = []
        self._square = context.buffer(np.array([-1, -1, 1, -1, -1, 1, 1, 1], dtype="f4").tobytes())
        self._programs = {name: load_program(context, name) for name in ("thrown", "shaded", "cast")}
        self._programs["contact"] = load_program(context, "shaded", "CONTACT")
        self._arrays = {
            name: context.vertex_array(self._programs[name], [(self._square, "2f", "in_corner")])
            for name in ("shaded", "contact", "cast")
        }

    def draw(self, meshes: list[FaceMesh], places: Float32, camera: Float64) -> Shade | None:
        """Draw the shadow of meshes around `places` (N, 2), x and z, into the bound framebuffer.

        camera: (4, 4), to clip space. Returns the map of shadows, or None if no mesh casts any.
        """
        casting = [mesh for mesh in meshes if _casts(mesh)]
        if not casting:
            return None
        target, viewport, matrix = self._gl.fbo, self._gl.viewport, matrix_bytes(camera)
        low, width = _ground_around(places)
        frame, part = self._find(casting, low, width, camera)
        corner, size = _ground_near(places)
        near = _in_picture(ALL, corner, size, NEAR_CELLS, camera) if part and size <= 2 * CONTACT else None
        if near:
            self._darkness.use(3)
            square = {"corner": corner, "size": size, "darkness": 3}
            self._shade("contact", self._near, near, frame=frame, low=low, width=width, **square)
        target.use()
        self._gl.viewport = viewport
        if part:
            self._cast(self._darkness, camera=matrix, low=low, width=width, part=part)
        if near:
            self._cast(self._contact, camera=matrix, low=corner, width=size, part=ALL)
        return Shade(self._tops, frame)

    def _cast(self, map_: Any, **values: object) -> None:
        """Darken the ground of the bound framebuffer by a map. values: of uniforms."""
        gl, contact = self._gl, map_ is self._contact
        gl.enable_only(gl.BLEND)
        gl.blend_func = gl.DST_COLOR if contact else gl.ZERO, gl.SRC_COLOR
        map_.use(2)
        set_uniforms(self._programs["cast"], darkness=2, contact=float(contact), **values)
        self._arrays["cast"].render(gl.TRIANGLE_STRIP)

    def _shade(self, name: str, map_: Any, part: Part, **values: object) -> None:
        """Fill a part of a map of darkness by one of the programs. values: of uniforms."""
        map_.scissor = tuple(round(map_.width * share) for share in part)
        map_.use()
        self._gl.enable_only(self._gl.NOTHING)
        self._gl.viewport = (0, 0, *map_.size)
        set_uniforms(self._programs[name], tops=1, **values)
        self._arrays[name].render(self._gl.TRIANGLE_STRIP)
        map_.scissor = None

    def darkness(self, meshes: list[FaceMesh], places: Float32) -> UInt8:
        """Return uint8 (CELLS, CELLS): the darkness of the ground that `draw` draws, rows along z."""
        self._find([mesh for mesh in meshes if _casts(mesh)], *_ground_around(places))
        return np.frombuffer(self._darkness.read(alignment=1), np.uint8).reshape(CELLS, CELLS)

    def _find(
        self, casting: list[FaceMesh], low: tuple[float, float], width: float, camera: Float64 | None = None
    ) -> tuple[tuple[float, float, float], Part | None]:
        """Find the darkness of the ground from `low` on, where the camera sees it; None: everywhere.

        Returns the frame of the key light's map, and the part of the ground outside which there is no
        shadow, or None if none of it is in the picture.
        """
        import moderngl

        gl, thrown = self._gl, self._programs["thrown"]
        frame, part = (0.0, 0.0, 1.0), ALL
        if casting:
            points = self._place(casting, width > COARSE * WIDTH)
            frame, part = _frame_around(points), _dark_part(points, low, width)
        seen = part if camera is None else _in_picture(part, low, width, CELLS, camera)
        set_uniforms(thrown, low=low, width=width, frame=frame)
        gl.enable_only(gl.BLEND)
        gl.blend_func = gl.ONE, gl.ONE
        gl.blend_equation = moderngl.MAX
        for sky, (texture, framebuffer) in enumerate(self._seen.items()):
            if sky and not seen:
                break
            framebuffer.use()
            gl.viewport = (0, 0, TEXELS, TEXELS)
            gl.clear(0.0, 0.0, 0.0, 0.0)
            set_uniforms(thrown, sky=float(sky))
            if casting:
                self._thrown_parts[0].render()
            texture.build_mipmaps(0, HALVINGS)
            texture.filter = (gl.LINEAR_MIPMAP_NEAREST, gl.LINEAR)
            texture.use(1 - sky)
        gl.blend_equation = moderngl.FUNC_ADD
        if not seen:
            return frame, None
        self._shaded.use()
        gl.clear()
        self._shade("shaded", self._shaded, seen, frame=frame, low=low, width=width)
        return frame, part

    def _place(self, casting: list[FaceMesh], coarsely: bool) -> Float32:
        """Write the places of all vertices, and return them: (3, N).

        coarsely: whether few triangles do, as each body covers little of the maps.
        All triangles are drawn at once: software OpenGL takes longer to begin a part than to draw it.
        """
        shapes = [(mesh.shape, coarsely) for mesh in casting]
        parts = [self._shapes.get(shape, lambda shape=shape: _casting(*shape)) for shape in shapes]  # type: ignore[misc]
        if shapes != self._thrown_shapes:
            self._join(shapes, parts)
        places = [
            mesh.positions.take(rows, axis=0) @ mesh.matrix[:3, :3].T.astype(np.float32)
            + mesh.matrix[:3, 3].astype(np.float32)
            for mesh, (rows, _) in zip(casting, parts, strict=True)
        ]
        points = np.concatenate(places)
        write_buffer(self._thrown_parts[1], points)
        return np.ascontiguousarray(points.T)  # NumPy finds extremes of long rows faster

    def _join(self, shapes: list[tuple[FaceShape, bool]], parts: list[tuple[Intp, Int32]]) -> None:
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
            *self._thrown_parts, *self._arrays.values(), *self._programs.values(), self._square,
            *self._seen.values(), self._shaded, self._near, self._heights, self._tops, self._darkness,
            self._contact,
        ):  # fmt: skip
            part.release()


def _casting(shape: FaceShape, coarsely: bool) -> tuple[Intp, Int32]:
    """Return the vertices (N,) of the triangles that cast a shape's shadow, and these triangles of them."""
    triangles = shape.triangles if shape.outer is None else shape.outer
    if coarsely and shape.outer is not None and shape.points is not None:
        triangles = _close_and_simplify(shape.points, shape.outer)
    rows, corners = np.unique(triangles, return_inverse=True)
    return rows.astype(np.intp), corners.reshape(-1, 3).astype(np.int32)


def _close_and_simplify(points: Float32, triangles: Int32) -> Int32:
    """Return int32 (F, 3): fewer triangles, in which seams are closed; else all their vertices would stay."""
    rows, corners = np.unique(triangles, return_inverse=True)
    places, first, same = np.unique(points[rows], axis=0, return_index=True, return_inverse=True)
    closed = same.ravel()[corners].reshape(-1, 3).astype(np.int32)
    fewer = DetailLevels(places, 1, closed).triangles_within(MAX_COARSE_ERROR)
    return np.asarray(rows[first][closed if fewer is None else fewer], dtype=np.int32)


def _casts(mesh: FaceMesh) -> bool:
    shape = mesh.shape
    drawn = shape.casts and shape.kind not in INNER_KINDS and len(shape.triangles) > 0
    return drawn and not mesh.turn.any()


def _frame_around(points: Float32) -> tuple[float, float, float]:
    """Return the corner of the square that the key light sees about points (3, N), a metre's share of it."""
    seen = BEFORE.T @ points
    least, most = seen.min(axis=1), seen.max(axis=1)
    width = FRAMED * float(np.ceil((most - least).max() / FRAMED + 0.4))
    u, v = (least + most) / 2 - width / 2  # not in whole texels: shadows would jump as a head turns
    return float(u), float(v), 1 / width


def _dark_part(points: Float32, low: tuple[float, float], width: float) -> Part:
    """Return where points (3, N) may darken the ground: corner and size, 0..1, in whole cells."""
    below = points[::2]
    thrown = below - np.array(KEY_DIRECTION[::2], dtype=np.float32)[:, None] / KEY_DIRECTION[1] * points[1]
    least = np.minimum(below.min(axis=1) - SKY_REACH, thrown.min(axis=1) - KEY_REACH)
    most = np.maximum(below.max(axis=1) + SKY_REACH, thrown.max(axis=1) + KEY_REACH)
    first, last = (np.clip((end - low) * CELLS / width, 0, CELLS) for end in (least, most))
    first, last = np.floor(first) / CELLS, np.ceil(last) / CELLS
    return (*first.tolist(), *(last - first).tolist())


def _in_picture(
    part: Part, low: tuple[float, float], width: float, cells: int, camera: Float64
) -> Part | None:
    """Return what is in the picture of a part of a square of ground, in whole cells, one more on each side.

    low, width: of the square. cells: along each of its sides. None if nothing is in the picture.
    """
    shares = np.array(part[:2]) + np.array(part[2:]) * [[0, 0], [1, 0], [1, 1], [0, 1]]
    ground = np.insert(low + width * shares, 1, 0.0, axis=1)
    corners = np.column_stack([shares, ground @ camera[:, :3].T + camera[:, 3]]).tolist()
    for axis, sign in ((2, 1.0), (2, -1.0), (3, 1.0), (3, -1.0)):  # each side of the picture cuts the polygon
        before, corners = corners, []
        for one, other in zip(before, before[1:] + before[:1], strict=True):
            inside, follows = one[5] + sign * one[axis], other[5] + sign * other[axis]
            if inside >= 0:
                corners.append(one)
            if (inside >= 0) != (follows >= 0):
                share = inside / (inside - follows)
                corners.append([a + (b - a) * share for a, b in zip(one, other, strict=True)])
    if not corners:
        return None
    places = np.array(corners)[:, :2] * cells
    first = np.maximum((np.floor(places.min(axis=0)) - 1) / cells, part[:2])
    last = np.minimum((np.ceil(places.max(axis=0)) + 1) / cells, np.add(part[:2], part[2:]))
    return (*first.tolist(), *(last - first).tolist())


def _ground_around(places: Float32) -> tuple[tuple[float, float], float]:
    """Return the corner (x, z) and the width (m) of the square of ground on which shadows fall."""
    least, most = places.min(axis=0), places.max(axis=0)
    width = WIDTH + float(np.ceil((most - least).max()))
    ahead = 0.9 / KEY_DIRECTION[1]  # shadows fall away from the key light
    corner = (least + most) / 2 - ahead * np.array(KEY_DIRECTION[::2]) - width / 2
    x, z = np.floor(corner * CELLS / width) * width / CELLS  # whole texels: the shadow does not shimmer
    return (float(x), float(z)), width


def _ground_near(places: Float32) -> tuple[tuple[float, float], float]:
    """Return corner and width, as of `_ground_around`, of the square in which feet touch the ground."""
    least, most = places.min(axis=0), places.max(axis=0)
    size = CONTACT * max(float(np.ceil(((most - least).max() + BEYOND) / CONTACT)), 1.0)
    x, z = np.floor(((least + most) / 2 - size / 2) * NEAR_CELLS / size) * size / NEAR_CELLS
    return (float(x), float(z)), size
