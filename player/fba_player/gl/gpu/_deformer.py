"""Deforms faces and bodies on the graphics card: see `fba_player.gl.gpu`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from fba_player.figure.body_light import KEY, REACH
from fba_player.figure.face_light import LitFacePart
from fba_player.gl.gpu._programs import deforming_program, use
from fba_player.gl.gpu._textures import Table, grid
from fba_player.gl.gpu.tables import CarriedBody, CarriedFace, MovedFace, Tables
from fba_player.gl.programs import set_uniform
from fba_player.mesh.lazy_vertices import Places, Whole

Float32 = npt.NDArray[np.float32]

MOST_TABLES = 64
"""Models remembered on the graphics card; the longest unused goes first."""


class GpuDeformer:
    """Writes the vertices of faces and bodies into buffers on the graphics card.

    `prepare` with all that a picture shows, then `write` each of its parts. Owns what it allocates on the
    moderngl context; `close` gives it back. Raises UnsupportedError, or moderngl's own error, where the card
    cannot do it.
    """

    def __init__(self, context: Any) -> None:
        self._gl = context
        self._programs: dict[str, Any] = {}
        corners = np.array([-1, -1, 3, -1, -1, 3], dtype="f4")
        self._corners = context.buffer(corners.tobytes())
        self._whole_arrays: dict[str, Any] = {}
        self._tables: dict[int, tuple[Tables, dict[str, Table]]] = {}
        self._held: dict[tuple[int, str], Any] = {}
        self._ready: tuple[Any, ...] | None = None
        self._drawn: dict[tuple[str, int], tuple[Whole, Any, Any]] = {}

    def prepare(self, wholes: list[Whole], capsules: Mapping[int, Float32] | None = None) -> None:
        """Move all vertices of faces and bodies. Changes which framebuffer is bound, and the viewport.

        capsules: float32 (K, 11), what hides light from bodies, by the id of their wholes: see
        `fba_player.figure.body_light`. Their parts can then be written with their light.
        """
        self._ready = None
        bases = {id(base): base for base in map(_base, wholes)}
        limbs = {key: rows for key, rows in (capsules or {}).items() if key in bases}
        wanted = {("moved", key): base for key, base in bases.items()}
        wanted |= {("past", key): bases[key] for key in limbs if bases[key].motion.light is not None}
        free = [key for key, (whole, _, _) in self._drawn.items() if wanted.get(key) is not whole]
        spare = [self._drawn.pop(key)[1:] for key in free]
        for key, base in wanted.items():
            if key in self._drawn:
                continue
            count = base.count if key[0] == "moved" else len(base.motion.light.at)
            room = self._room(grid(self._gl, count), spare)
            if key[0] == "moved":
                self._move(base.motion, count, room[1])
            else:
                self._pass(base, limbs[key[1]], count, room[1])
            self._drawn[key] = (base, *room)
        for texture, framebuffer in spare:
            framebuffer.release()
            texture.release()

    def is_lit(self, whole: Whole) -> bool:
        """Whether its parts are written with their light."""
        return ("past", id(whole)) in self._drawn

    def rows(self, places: Places, *, lit: bool = False) -> list[Any]:
        """What `write` needs for a part, or some of its vertices, in every pose of it. To be released by who
        asks, in this order. lit: with its light."""
        motion, chosen = places.whole.motion, _rows(places)
        parts = [(chosen, "1i", "in_row")]
        if isinstance(motion, CarriedBody):
            name = "body"
            parts += _attributes(motion.tables.rows, chosen, "around", "numbers", "upright")
            if lit:
                parts += _attributes(motion.light, chosen, "near", "shares", "folds")
        else:
            face = motion.face.motion if isinstance(motion, CarriedFace) else motion
            name = "face"
            if lit:
                parts += _attributes(face.light, chosen, "near", "sway")
            parts += _attributes(face.tables, chosen, "part", "around", "neutral")
        if isinstance(motion, CarriedFace):
            name = "carried"
            parts += _attributes(motion.tables.rows, chosen, "wring")
        if name != "face":
            parts += _attributes(motion.tables.rows, chosen, "joints", "weights")
        buffers = [
            (self._gl.buffer(np.ascontiguousarray(array, dtype=kind[1] + "4").tobytes()), kind, attribute)
            for array, kind, attribute in parts
        ]
        array = self._gl.vertex_array(self._program(f"{name}_lit" if lit else name), buffers)
        return [array, *(buffer for buffer, _, _ in buffers)]

    def write(
        self, places: Places, rows: list[Any], buffers: list[Any], light: LitFacePart | None = None
    ) -> None:
        """Of a part of what was prepared: positions and normals, float32 (V, 3), and where it is lit, light
        (V, 4), into as many buffers; rows: what `rows` gave. light: of a face that is lit."""
        lit = None if light is None else (id(light.lights), light.share, light.more)
        key = (id(places.whole), rows[0].program, lit)
        if self._ready != key:
            self._make_ready(places.whole, rows[0].program, light, lit=len(buffers) > 2)
            self._ready = key
        rows[0].transform(buffers, self._gl.POINTS, vertices=len(places))

    def close(self) -> None:
        """Free everything allocated on the graphics card."""
        for _, texture, framebuffer in self._drawn.values():
            framebuffer.release()
            texture.release()
        for _, tables in self._tables.values():
            for table in tables.values():
                table.release()
        for part in (*self._whole_arrays.values(), self._corners, *self._programs.values()):
            part.release()
        for kept in (self._drawn, self._tables, self._held, self._whole_arrays, self._programs):
            kept.clear()

    def _make_ready(self, whole: Whole, program: Any, light: LitFacePart | None, *, lit: bool) -> None:
        """All that a program takes to write parts of a whole."""
        motion, base = whole.motion, _base(whole)
        use(moved=self._drawn["moved", id(base)][1])
        if not isinstance(motion, CarriedBody):
            face = base.motion
            tables = self._of(face.tables)
            self._hold(face.tables, "parts", face.motion, face.motion.poses.reshape(-1, 4))
            use(triangles=tables["triangles"].texture, parts=tables["parts"].texture)
        if not isinstance(motion, MovedFace):
            self._carry(program, motion)
        if isinstance(motion, CarriedFace):
            set_uniform(program, "size", motion.size)
            set_uniform(program, "offset", tuple(float(v) for v in motion.shift))
        if light is not None:
            shining = self._of(base.motion.light)
            use(visible=shining["visible"].texture, wide=shining["wide"].texture)
            set_uniform(program, "share", light.share)
            set_uniform(program, "more", light.more)
            for place, name in enumerate(("key", "rim", "still_key", "still_rim")):
                set_uniform(program, name, light.lights[place % len(light.lights)].tobytes())
        elif lit:
            use(past=self._drawn["past", id(whole)][1])
            set_uniform(program, "reach", REACH)

    def _room(self, size: tuple[int, int], spare: list[Any]) -> tuple[Any, Any]:
        """A texture and its framebuffer: one of those to spare, or a new one."""
        for one in spare:
            if one[0].size == size:
                spare.remove(one)
                return one[0], one[1]
        texture = self._gl.texture(size, 4, dtype="f4")
        texture.filter = (self._gl.NEAREST, self._gl.NEAREST)
        return texture, self._gl.framebuffer([texture])

    def _move(self, motion: MovedFace | CarriedBody, count: int, framebuffer: Any) -> None:
        """Draws the places of all vertices into a texture."""
        name = "face_moved" if isinstance(motion, MovedFace) else "body_moved"
        program = self._program(name)
        tables = self._of(motion.tables)
        if isinstance(motion, MovedFace):
            self._hold(motion.tables, "tracks", motion.motion, motion.motion.tracks)
            names: tuple[str, ...] = ("rest", "spans", "entries", "shifts", "tracks")
        else:
            self._carry(program, motion)
            names = ("rest", "joints", "weights", "wring")
        use(**{one: tables[one].texture for one in names})
        self._draw(name, count, framebuffer)

    def _pass(self, whole: Whole, capsules: Float32, count: int, framebuffer: Any) -> None:
        """Draws what light comes past a body's limbs into a texture."""
        motion, program = whole.motion, self._program("past_limbs")
        self._carry(program, motion)
        limbs = np.zeros((len(capsules), 3, 4), dtype=np.float32)
        limbs[:, 0, :3], limbs[:, 0, 3] = capsules[:, :3], capsules[:, 9]
        limbs[:, 1] = capsules[:, 3:7]
        limbs[:, 2, :2], limbs[:, 2, 2] = capsules[:, 7:9], capsules[:, 10]
        self._hold(motion.light, "capsules", capsules, limbs.reshape(-1, 4))
        set_uniform(program, "limbs", len(capsules))
        set_uniform(program, "key", KEY)
        tables = self._of(motion.light)
        use(moved=self._drawn["moved", id(whole)][1], modelled=tables["upright"].texture)
        names = ("at", "around", "numbers", "joints", "weights", "capsules")
        use(**{one: tables[one].texture for one in names})
        self._draw("past_limbs", count, framebuffer)

    def _draw(self, name: str, count: int, framebuffer: Any) -> None:
        """One pixel a row."""
        if name not in self._whole_arrays:
            self._whole_arrays[name] = self._gl.vertex_array(
                self._program(name), [(self._corners, "2f", "in_corner")]
            )
        set_uniform(self._program(name), "count", count)
        framebuffer.use()
        self._gl.viewport = (0, 0, *framebuffer.size)
        self._gl.enable_only(self._gl.NOTHING)
        self._whole_arrays[name].render()

    def _carry(self, program: Any, motion: CarriedBody | CarriedFace) -> None:
        """The joints as they stand now."""
        own, joints = motion.tables.rows, motion.motion
        if self._held.get((id(motion.tables), "pose")) is not joints:
            bones = np.empty((2 * len(joints.angles), 4), dtype=np.float32)
            bones[::2, :3], bones[1::2, :3] = own.axis, own.centre
            bones[::2, 3], bones[1::2, 3] = joints.angles.T
            self._hold(motion.tables, "pose", joints, np.concatenate([joints.duals.reshape(-1, 4), bones]))
        use(pose=self._of(motion.tables)["pose"].texture)
        set_uniform(program, "bones", 2 * len(joints.duals))
        set_uniform(program, "root", tuple(joints.root.tolist()))

    def _hold(self, tables: Tables, name: str, motion: Any, rows: Any) -> None:
        """A table that changes with the pose, with these rows in it."""
        found = self._of(tables)
        if name not in found:
            found[name] = Table(self._gl, rows)
        elif self._held.get((id(tables), name)) is not motion:
            found[name].write(rows)
        self._held[id(tables), name] = motion

    def _of(self, tables: Tables) -> dict[str, Table]:
        """What stays the same of a model, on the graphics card."""
        key = id(tables)
        if key in self._tables:
            self._tables[key] = self._tables.pop(key)  # now the latest used
            return self._tables[key][1]
        while len(self._tables) >= MOST_TABLES:
            oldest = next(iter(self._tables))
            for table in self._tables.pop(oldest)[1].values():
                table.release()
            self._held = {place: motion for place, motion in self._held.items() if place[0] != oldest}
        self._tables[key] = (tables, {name: Table(self._gl, array) for name, array in tables.arrays.items()})
        return self._tables[key][1]

    def _program(self, name: str) -> Any:
        if name not in self._programs:
            self._programs[name] = deforming_program(self._gl, name)
        return self._programs[name]


def _base(whole: Whole) -> Whole:
    """What all vertices are moved of first: of a face on a body, the face."""
    motion = whole.motion
    return motion.face if isinstance(motion, CarriedFace) else whole


def _rows(places: Places) -> Any:
    chosen = np.arange(len(places)) if places.chosen is None else places.chosen
    return chosen + places.start


def _attributes(tables: Any, chosen: Any, *names: str) -> list[tuple[Any, str, str]]:
    """What vertex arrays are made of: rows of tables, their formats, and the shaders' names for them."""
    found = []
    for name in names:
        rows = getattr(tables, name)[chosen]
        kind = "i" if rows.dtype.kind in "iu" else "f"
        found.append((rows, f"{rows[0].size if len(rows) else 1}{kind}", f"in_{name}"))
    return found
