"""Deforms faces and bodies on the graphics card: see `player.gpu`."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

import numpy as np

from player.gpu.tables import BodyTables, CarriedBody, CarriedFace, FaceTables, MovedFace
from player.gpu.textures import Table, grid
from player.places import Places, Whole
from player.programs import set_uniform

MOST_TABLES = 8
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
        self._tables: dict[int, tuple[FaceTables | BodyTables, dict[str, Table]]] = {}
        self._held: dict[tuple[int, str], Any] = {}
        self._moved: dict[int, tuple[Whole, Any, Any]] = {}

    def prepare(self, wholes: list[Whole]) -> None:
        """Move all vertices of faces and bodies. Changes which framebuffer is bound, and the viewport."""
        wanted = {id(base): base for base in map(_base, wholes)}
        free = [key for key, (whole, _, _) in self._moved.items() if wanted.get(key) is not whole]
        spare = [self._moved.pop(key)[1:] for key in free]
        for key, base in wanted.items():
            if key in self._moved:
                continue
            size = grid(self._gl, base.count)
            room = next((one for one in spare if one[0].size == size), None)
            if room is None:
                texture = self._gl.texture(size, 4, dtype="f4")
                texture.filter = (self._gl.NEAREST, self._gl.NEAREST)
                room = (texture, self._gl.framebuffer([texture]))
            else:
                spare.remove(room)
            self._move(base.motion, base.count, room[1])
            self._moved[key] = (base, *room)
        for texture, framebuffer in spare:
            framebuffer.release()
            texture.release()

    def rows(self, places: Places) -> list[Any]:
        """What `write` needs for a part, or some of its vertices, in every pose of it. To be released by who
        asks, in this order."""
        motion, chosen = places.whole.motion, _rows(places)
        if isinstance(motion, CarriedBody):
            name, parts = (
                "body",
                [
                    (chosen, "1i", "in_row"),
                    *_attributes(motion.tables, chosen, ("around", "numbers", "upright")),
                ],
            )
        else:
            face = motion.face.motion if isinstance(motion, CarriedFace) else motion
            name, tables = "face", face.tables
            parts = [
                (chosen, "1i", "in_row"),
                (tables.part[chosen], "1i", "in_part"),
                (tables.around[chosen], "2i", "in_around"),
                (tables.neutral[chosen], "3f", "in_neutral"),
            ]
        if isinstance(motion, CarriedFace):
            name = "carried"
            parts += _attributes(motion.tables, chosen, ("wring",))
        if name != "face":
            parts += _attributes(motion.tables, chosen, ("joints", "weights"))
        buffers = [
            (
                self._gl.buffer(np.ascontiguousarray(array, dtype=format_[1] + "4").tobytes()),
                format_,
                attribute,
            )
            for array, format_, attribute in parts
        ]
        array = self._gl.vertex_array(self._program(name), buffers)
        return [array, *(buffer for buffer, _, _ in buffers)]

    def write(self, places: Places, rows: list[Any], positions: Any, normals: Any) -> None:
        """Positions and normals, float32 (V, 3), of a part of what was prepared, into buffers; rows: what
        `rows` gave."""
        motion = places.whole.motion
        program = rows[0].program
        base = _base(places.whole)
        self._use(program, moved=self._moved[id(base)][1])
        if not isinstance(motion, CarriedBody):
            face = base.motion
            tables = self._of(face.tables)
            self._hold(face.tables, "parts", face.motion, face.motion.poses.reshape(-1, 4))
            self._use(program, triangles=tables["triangles"].texture, parts=tables["parts"].texture)
        if not isinstance(motion, MovedFace):
            self._use(program, pose=self._pose(program, motion))
            set_uniform(program, "root", tuple(float(v) for v in motion.motion.root))
        if isinstance(motion, CarriedFace):
            set_uniform(program, "size", motion.size)
            set_uniform(program, "offset", tuple(float(v) for v in motion.shift))
        rows[0].transform([positions, normals], self._gl.POINTS, vertices=len(places))

    def close(self) -> None:
        """Free everything allocated on the graphics card."""
        for _, texture, framebuffer in self._moved.values():
            framebuffer.release()
            texture.release()
        for _, tables in self._tables.values():
            for table in tables.values():
                table.release()
        for part in (*self._whole_arrays.values(), self._corners, *self._programs.values()):
            part.release()
        for kept in (self._moved, self._tables, self._held, self._whole_arrays, self._programs):
            kept.clear()

    def _move(self, motion: MovedFace | CarriedBody, count: int, framebuffer: Any) -> None:
        """Draws the places of all vertices into a texture."""
        name = "face_moved" if isinstance(motion, MovedFace) else "body_moved"
        program = self._program(name)
        if name not in self._whole_arrays:
            self._whole_arrays[name] = self._gl.vertex_array(program, [(self._corners, "2f", "in_corner")])
        tables = self._of(motion.tables)
        if isinstance(motion, MovedFace):
            self._hold(motion.tables, "tracks", motion.motion, motion.motion.tracks)
            names: tuple[str, ...] = ("rest", "spans", "entries", "shifts", "tracks")
            self._use(program, **{one: tables[one].texture for one in names})
        else:
            names = ("rest", "joints", "weights", "wring")
            self._use(
                program, pose=self._pose(program, motion), **{one: tables[one].texture for one in names}
            )
        set_uniform(program, "count", count)
        framebuffer.use()
        self._gl.viewport = (0, 0, *framebuffer.size)
        self._gl.enable_only(self._gl.NOTHING)
        self._whole_arrays[name].render()

    def _pose(self, program: Any, motion: CarriedBody | CarriedFace) -> Any:
        """The joints' texture, as they stand now."""
        own, joints = motion.tables.rows, motion.motion
        bones = np.empty((2 * len(joints.angles), 4), dtype=np.float32)
        bones[::2, :3], bones[1::2, :3] = own.axis, own.centre
        bones[::2, 3], bones[1::2, 3] = joints.angles.T
        self._hold(motion.tables, "pose", joints, np.concatenate([joints.duals.reshape(-1, 4), bones]))
        set_uniform(program, "bones", 2 * len(joints.duals))
        return self._of(motion.tables)["pose"].texture

    def _hold(self, tables: FaceTables | BodyTables, name: str, motion: Any, rows: Any) -> None:
        """A table that changes with the pose, with these rows in it."""
        found = self._of(tables)
        if name not in found:
            found[name] = Table(self._gl, rows)
        elif self._held.get((id(tables), name)) is not motion:
            found[name].write(rows)
        self._held[id(tables), name] = motion

    def _of(self, tables: FaceTables | BodyTables) -> dict[str, Table]:
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
        if isinstance(tables, FaceTables):
            arrays = {
                name: getattr(tables, name) for name in ("rest", "spans", "entries", "shifts", "triangles")
            }
        else:
            own = tables.rows
            arrays = {"rest": own.vertices, "joints": own.joints, "weights": own.weights, "wring": own.wring}
        self._tables[key] = (tables, {name: Table(self._gl, array) for name, array in arrays.items()})
        return self._tables[key][1]

    def _use(self, program: Any, **textures: Any) -> None:
        for name, texture in textures.items():
            unit = UNITS.index(name)
            set_uniform(program, name, unit)
            texture.use(unit)

    def _program(self, name: str) -> Any:
        if name not in self._programs:
            shader, words, is_whole = PROGRAMS[name]
            if is_whole:
                self._programs[name] = self._gl.program(
                    vertex_shader=_source("smooth.vert"), fragment_shader=_source(f"{shader}.frag")
                )
            else:
                self._programs[name] = self._gl.program(
                    vertex_shader=_source(f"{shader}.vert", *words),
                    varyings=("position", "normal"),
                    varyings_capture_mode="separate",
                )
        return self._programs[name]


PROGRAMS: dict[str, tuple[str, tuple[str, ...], bool]] = {
    "face_moved": ("gpu_face", (), True),
    "body_moved": ("gpu_body", (), True),
    "face": ("gpu_face", (), False),
    "carried": ("gpu_face", ("CARRIED",), False),
    "body": ("gpu_body", (), False),
}
"""Shader, words for the preprocessor, and whether it draws all vertices into a texture."""
UNITS = ("moved", "triangles", "parts", "pose", "rest", "spans", "entries", "shifts", "tracks", "joints",
         "weights", "wring")  # fmt: skip
"""Places of textures, by the names that shaders have for them."""


def _base(whole: Whole) -> Whole:
    """What all vertices are moved of first: of a face on a body, the face."""
    motion = whole.motion
    return motion.face if isinstance(motion, CarriedFace) else whole


def _rows(places: Places) -> Any:
    chosen = np.arange(len(places)) if places.chosen is None else places.chosen
    return chosen + places.start


def _attributes(tables: BodyTables, chosen: Any, names: tuple[str, ...]) -> list[tuple[Any, str, str]]:
    formats = {
        "around": "4i",
        "numbers": "3f",
        "upright": "3f",
        "joints": "4i",
        "weights": "4f",
        "wring": "4f",
    }
    return [(getattr(tables.rows, name)[chosen], formats[name], f"in_{name}") for name in names]


def _source(name: str, *words: str) -> str:
    folder = files("player") / "shaders"
    lines = []
    for line in (folder / name).read_text(encoding="utf-8").splitlines():
        included = line.startswith("//include ")
        lines.append((folder / line.split()[1]).read_text(encoding="utf-8") if included else line)
        if line.startswith("#version"):
            lines += [f"#define {word}" for word in words]
    return "\n".join(lines)
