"""What does not change in a face or body that a graphics card deforms, a row for each vertex."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from fba.body.skin.skinning import JointMotion, Skinner, SkinTables
from fba.face.deform.deformer import Deformer, FaceMotion
from fba.face.deform.flat_tables import Shifts
from fba.face.deform.normals import Surface
from fba_player.figure.face_light import FaceLight
from fba_player.figure.occlusion import Visibility
from fba_player.mesh.lazy_vertices import Whole

Float32 = npt.NDArray[np.float32]
Int32 = npt.NDArray[np.int32]
Array = npt.NDArray[Any]


class FaceTables:
    """A face's vertices and what FAPs do to them, from its deformer.

    rest (V, 3); spans (V, 2): each vertex's first entry and that after its last one. entries (E, 2): a track,
    and the place of its first interval in `shifts`. shifts (S, 3): for each interval of the track where the
    vertex is at its beginning, then the slope. part (V,). around (V, 2): likewise into triangles (C, 4),
    whose areas make the normal; none where it is neutral (V, 3).
    """

    def __init__(self, deformer: Deformer) -> None:
        tables = deformer.tables
        self.rest = np.ascontiguousarray(deformer.model.vertices, dtype=np.float32)
        count = len(self.rest)
        self.spans, self.entries, self.shifts = _tracks(tables.shifts, count)
        self.part = np.repeat(np.arange(len(tables.part_start) - 1), np.diff(tables.part_start))
        self.around, self.triangles = _fans(tables.surface)
        self.neutral = np.ascontiguousarray(tables.surface.neutral[:, tables.surface.sum_of].T)

    @property
    def arrays(self) -> dict[str, Array]:
        """What goes into textures."""
        return {name: getattr(self, name) for name in ("rest", "spans", "entries", "shifts", "triangles")}


class BodyTables:
    """A body's vertices and the joints that carry them: see `fba.body.skin.skinning.SkinTables`."""

    def __init__(self, skinner: Skinner) -> None:
        self.rows = skinner.tables()

    @property
    def arrays(self) -> dict[str, Array]:
        """What goes into textures."""
        own = self.rows
        return {"rest": own.vertices, "joints": own.joints, "weights": own.weights, "wring": own.wring}


@dataclass(frozen=True, eq=False)
class MovedFace:
    """A face in one pose."""

    tables: FaceTables
    motion: FaceMotion
    light: FaceLightTables


class LightTables:
    """Where the light on a body is worked out, and who takes it from there: see
    `fba_player.figure.body_light`.

    at (A, 1): vertices; around, numbers, upright, joints, weights: theirs, as in `SkinTables`. near, shares
    (V, 3), folds (V, 1): of each vertex.
    """

    def __init__(self, rows: SkinTables, prepared: tuple[Int32, Int32, Float32, Float32]) -> None:
        at, self.near, self.shares, folds = prepared
        self.at, self.folds = at[:, None], folds[:, None]
        self.around, self.numbers, self.upright = rows.around[at], rows.numbers[at], rows.upright[at]
        self.joints, self.weights = rows.joints[at], rows.weights[at]

    @property
    def arrays(self) -> dict[str, Array]:
        """What goes into textures."""
        return {
            name: getattr(self, name) for name in ("at", "around", "numbers", "upright", "joints", "weights")
        }


class FaceLightTables:
    """Light on a face: see `fba_player.figure.face_light`.

    visible (9 V, 4): of each vertex, harmonics of what it sees and of what comes through it, and the open
    sky; wide: the same for those near the mouth, with it open. near (V,): their numbers among these, or -1.
    sway (V,): how far they go with the head.
    """

    def __init__(self, light: FaceLight) -> None:
        baked = light.baked
        self.visible = _nines(baked.shut, np.arange(len(light.sway)))
        near = np.flatnonzero(baked.near)
        self.wide = _nines(baked.wide, near)
        self.near = np.full(len(light.sway), -1, dtype=np.int32)
        self.near[near] = np.arange(len(near))
        self.sway = light.sway

    @property
    def arrays(self) -> dict[str, Array]:
        """What goes into textures."""
        return {"visible": self.visible, "wide": self.wide}


Tables = FaceTables | BodyTables | LightTables | FaceLightTables


@dataclass(frozen=True, eq=False)
class CarriedBody:
    """A body in one pose. light: None where nothing is in the light's way."""

    tables: BodyTables
    motion: JointMotion
    light: LightTables | None = None


@dataclass(frozen=True, eq=False)
class CarriedFace:
    """A face on a body. face: its vertices, without the body; size, shift (3,): put there as modelled."""

    face: Whole
    tables: BodyTables
    motion: JointMotion
    size: float
    shift: Float32


def _nines(visibility: Visibility, rows: npt.NDArray[np.intp]) -> Float32:
    found = np.zeros((len(rows), 9, 4), dtype=np.float32)
    found[:, 0:4] = visibility.light[rows].reshape(-1, 4, 4)
    found[:, 4:8] = visibility.through[rows].reshape(-1, 4, 4)
    found[:, 8, 0] = visibility.open[rows]
    return found.reshape(-1, 4)


def _tracks(shifts: Shifts, count: int) -> tuple[Int32, Int32, Float32]:
    """spans, entries and shifts, see `FaceTables`. An entry holds all intervals of its track: of these, one
    counts at a time."""
    vertices, tracks, places, found = [], [], [], [np.zeros((0, 3), dtype=np.float32)]
    filled = 0
    for track in range(len(shifts.column)):
        intervals = range(int(shifts.first[track]), int(shifts.first[track + 1]))
        parts = [slice(int(shifts.start[s]), int(shifts.start[s + 1])) for s in intervals]
        moved = np.zeros(count, dtype=bool)
        for part in parts:
            moved[shifts.rows[part]] = True
        rows = np.flatnonzero(moved)
        number = np.zeros(count, dtype=np.int64)
        number[rows] = np.arange(len(rows))
        table = np.zeros((len(rows), len(parts), 2, 3), dtype=np.float32)
        for k, (s, part) in enumerate(zip(intervals, parts, strict=True)):
            at = number[shifts.rows[part]]
            table[at, k, 1] = shifts.slopes[part]
            base = int(shifts.base[s])
            if base >= 0:
                table[at, k, 0] = shifts.bases[base : base + len(at)]
        size = 2 * len(parts)
        vertices.append(rows)
        tracks.append(np.full(len(rows), track))
        places.append(filled + size * np.arange(len(rows)))
        found.append(table.reshape(-1, 3))
        filled += size * len(rows)
    if not vertices:
        return np.zeros((count, 2), np.int32), np.zeros((0, 2), np.int32), found[0]
    of = np.concatenate(vertices)
    order = np.argsort(of, kind="stable")
    entries = np.stack([np.concatenate(tracks), np.concatenate(places)], axis=1)[order]
    ends = np.cumsum(np.bincount(of, minlength=count))
    spans = np.stack([np.concatenate([[0], ends[:-1]]), ends], axis=1)
    return spans.astype(np.int32), entries.astype(np.int32), np.concatenate(found)


def _fans(surface: Surface) -> tuple[Int32, Int32]:
    """around and triangles, see `FaceTables`."""
    changing = int(surface.changing_start[-1])
    corners = surface.corners.ravel().astype(np.int64)
    order = np.argsort(corners, kind="stable")
    order = order[: int((corners < changing).sum())]
    triangles = np.zeros((len(order), 4), dtype=np.int32)
    triangles[:, :3] = surface.triangles[order // 3]
    starts = np.searchsorted(corners[order], np.arange(changing + 1))
    sums = surface.sum_of.astype(np.int64)
    still = sums >= changing
    sums = np.where(still, 0, sums)
    spans = np.stack([starts[sums], starts[np.minimum(sums + 1, changing)]], axis=1)
    spans[still] = 0
    return spans.astype(np.int32), triangles
