"""Keeps a tongue, as it is shown, between the teeth and over the lower lip.

FAPs 43-47 move the tongue whatever jaw and lips do: sent alone, they would push it through closed lips, teeth
or palate. Feature points and FaceDefTables stay as they are; only what is drawn bends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float32, Float64, Int32, Intp
from fba.face import FaceModel
from fba.mesh import vertex_normals
from fba.parameters import point_rows
from fba.sampling import smoothstep
from fba_player._figure._face_parts import part_rows

TONGUE_FAPS = slice(42, 47)
"""Columns of FAPs 43-47."""
FULL_AT = 60.0
"""Value of one of them from which the tongue keeps fully to the room that it has."""
LIPS = ("2.2", "2.3", "2.4", "2.5")
"""Middles of upper and lower lip, corners of the mouth."""
TEETH = ("9.10", "9.11", "9.8", "9.9")
"""Edges of upper and lower teeth, their roots."""
SLICES = 18
"""Cross sections, at most, in which the tongue is moved up and down; each has about as many vertices."""
ADULT = 0.064
"""Distance of an adult's eyes: lengths below are in metres of such a face."""
CLEARANCE = 0.0006
"""Distance kept from teeth and lips."""
SHUT, WIDE = 0.0015, 0.0045
"""Gaps of lips or teeth: up to the first no tongue comes out, from the second on it does."""
SOFT = 0.007
"""Length over which a tongue that is stopped is compressed."""
THICK_TEETH = 0.006
"""Depth of the teeth behind their edge."""
LATERAL = 0.80
"""Share of the mouth's half width that the tongue reaches sideways, behind the lips."""
DROOP = 6.0
"""Curvature (1/m) with which a tongue that is out hangs down."""


@dataclass(frozen=True, eq=False)
class Tongue:
    """A tongue and the vertices around it.

    part: its name. rows: its vertices in the model. triangles: of the part. slice_of: (V,) number of each
    vertex's cross section, from the root. length: (V,), the same with fractions. lips, teeth: vertices of
    `LIPS` and `TEETH`. front: the foremost vertex of the lower lip. size: of the face, 1 for an adult's.
    """

    part: str
    rows: slice
    triangles: Int32
    slice_of: Intp
    length: Float64
    lips: Intp
    teeth: Intp
    front: int
    size: float

    def bend(self, positions: Float32, normals: Float32, faps: Float32) -> None:
        """Move the tongue's vertices, in place, to where there is room. positions, normals: (V, 3)."""
        share = min(float(np.abs(faps[TONGUE_FAPS]).max()) / FULL_AT, 1.0)
        if share == 0.0:
            return
        before = positions[self.rows].astype(np.float64)
        room = self._room(positions)
        moved = room.stop(before)
        moved = self._level(moved, room)
        moved = room.clamp(moved)
        positions[self.rows] = before + share * (moved - before)
        normals[self.rows] = vertex_normals(positions[self.rows], self.triangles)

    def _room(self, positions: Float32) -> Room:
        upper, lower, left, right = positions[self.lips].astype(np.float64)
        return Room(
            (upper, lower, (left + right) / 2),
            max(abs(float(left[0] - right[0])) / 2, 1e-6),
            tuple(positions[self.teeth].astype(np.float64)),
            float(positions[self.front, 2]),
            self.size,
        )

    def _level(self, points: Float64, room: Room) -> Float64:
        """Return vertices moved up or down by cross sections, so that each lies within the room."""
        slices = int(self.slice_of.max()) + 1
        low, high = np.full(slices, np.inf), np.full(slices, -np.inf)
        np.minimum.at(low, self.slice_of, points[:, 1])
        np.maximum.at(high, self.slice_of, points[:, 1])
        count = np.bincount(self.slice_of)
        middle = np.zeros((slices, 3))
        for axis in (0, 2):
            middle[:, axis] = np.bincount(self.slice_of, points[:, axis]) / count
        floor, roof = room.bounds(middle)
        half = np.minimum((high - low) / 2, np.maximum(roof - floor, 0.0) / 2)
        centre = (low + high) / 2
        shift = np.clip(centre, floor + half, np.maximum(roof - half, floor + half)) - centre
        for _ in range(2):
            padded = np.concatenate([shift[:1], shift, shift[-1:]])
            shift = (padded[:-2] + 2 * padded[1:-1] + padded[2:]) / 4
        moved = points.copy()
        moved[:, 1] += np.interp(self.length, np.arange(slices) + 0.5, shift) - room.droop(points)
        return moved


@dataclass(frozen=True, eq=False)
class Room:
    """The room that a tongue has.

    lips: (3,) each, middles of upper and lower lip, and the middle between the corners. half: half the
    mouth's width. teeth: (3,) each, edges and roots as in `TEETH`. front: z of the lower lip's foremost
    point. size: as in `Tongue`.
    """

    lips: tuple[Float64, Float64, Float64]
    half: float
    teeth: tuple[Float64, ...]
    front: float
    size: float

    def stop(self, points: Float64) -> Float64:
        """Return points that closed teeth or lips stop, and that cheeks hold."""
        size, (upper, lower, _) = self.size, self.lips
        teeth = _share_open(self.teeth[0][1] - self.teeth[1][1], size)
        lips = _share_open(upper[1] - lower[1], size)
        behind_teeth = min(self.teeth[0][2], self.teeth[1][2]) - 0.0022 * size
        behind_lips = min(upper[2], lower[2]) - 0.003 * size
        limit = behind_teeth + teeth * max(behind_lips - behind_teeth, 0.0) + teeth * lips * 0.2 * size
        stopped = points.copy()
        knee = limit - SOFT * size
        beyond = points[:, 2] - knee
        soft = SOFT * size * (1 - np.exp(-np.maximum(beyond, 0.0) / (SOFT * size)))
        stopped[:, 2] = np.where(beyond > 0, knee + soft, points[:, 2])
        wide = LATERAL * self.half + 1.2 * np.maximum(stopped[:, 2] - self.front, 0.0)
        stopped[:, 0] = np.clip(points[:, 0], -wide, wide)
        return stopped

    def bounds(self, points: Float64) -> tuple[Float64, Float64]:
        """Return (lowest, highest) y of a tongue at points (N, 3), of which x and z count."""
        size, (upper, lower, corner) = self.size, self.lips
        top_edge, low_edge, top_root, low_root = self.teeth
        across = np.minimum(np.abs(points[:, 0]) / self.half, 1.0) ** 2
        keep = CLEARANCE * size
        # the arches of teeth and lips curve back: beside the midline a place is as if further ahead
        z = points[:, 2] + (1 - np.sqrt(np.maximum(1 - 0.8 * across, 0.0))) * 1.6 * self.half
        inner = min(top_edge[2], low_edge[2]) - THICK_TEETH * size
        gate = max(top_edge[2], low_edge[2])
        depth = np.array([inner - 0.045 * size, inner - 0.006 * size, inner, gate])
        floor = np.interp(z, depth, [low_root[1] - 0.05 * size, low_root[1], low_edge[1], low_edge[1]])
        roof = np.interp(z, depth, [top_root[1], top_root[1], top_edge[1], top_edge[1]])
        at_lips = smoothstep(
            (points[:, 2] + across * (lower[2] - corner[2]) - gate) / max(lower[2] - gate, 1e-4)
        )
        floor += at_lips * (lower[1] + across * (corner[1] - lower[1]) - floor)
        roof += at_lips * (upper[1] + across * (corner[1] - upper[1]) - roof)
        out = points[:, 2] > self.front + 0.001 * size
        floor, roof = floor + keep, roof - keep
        middle = (floor + roof) / 2
        floor, roof = np.minimum(floor, middle), np.maximum(roof, middle)
        return np.where(out, -np.inf, floor), np.where(out, np.inf, roof)

    def droop(self, points: Float64) -> Float64:
        """Return (N,) metres by which points before the lips hang down."""
        return DROOP / self.size * np.maximum(points[:, 2] - self.front, 0.0) ** 2

    def clamp(self, points: Float64) -> Float64:
        """Return points (N, 3) brought within the room, up or down."""
        floor, roof = self.bounds(points)
        clamped = points.copy()
        clamped[:, 1] = np.clip(points[:, 1], floor, roof)
        return clamped


def _share_open(gap: float, size: float) -> float:
    return float(smoothstep(np.array((gap / size - SHUT) / (WIDE - SHUT))))


def find_tongues(model: FaceModel) -> list[Tongue]:
    """Return the tongues of a face whose lips and teeth are known; none of others."""
    vertices = [np.array([int(model.bound[point_rows()[name]]) for name in names]) for names in (LIPS, TEETH)]
    lips, teeth = vertices
    if min(lips.min(), teeth.min()) < 0:
        return []
    front = _front_of_lip(model, int(lips[1]))
    tongues = []
    for part in model.of_kind("tongue"):
        z = part.vertices[:, 2].astype(np.float64)
        if not len(part.triangles) or np.ptp(z) <= 0:
            continue
        borders = np.unique(np.quantile(z, np.linspace(0, 1, SLICES + 1)))
        length = np.interp(z, borders, np.arange(len(borders)))
        _, number = np.unique(np.minimum(length.astype(np.intp), len(borders) - 2), return_inverse=True)
        size = model.fapu.ES * 1024 / ADULT
        rows = part_rows(model, part.name)
        slice_of = number.astype(np.intp)
        tongues.append(Tongue(part.name, rows, part.triangles, slice_of, length, lips, teeth, front, size))
    return tongues


def _front_of_lip(model: FaceModel, lip: int) -> int:
    """Return the foremost vertex of the lower lip near the midline. lip: the vertex of its middle."""
    vertices = model.vertices
    unit = model.fapu.MNS * 1024
    below = vertices[lip, 1] - vertices[:, 1]
    near: Bool = (
        (np.abs(vertices[:, 0] - vertices[lip, 0]) < 0.1 * unit) & (below >= 0) & (below < 0.3 * unit)
    )
    for part in model.parts:
        if part.kind != "skin":
            near[part_rows(model, part.name)] = False
    return int(np.where(near, vertices[:, 2], -np.inf).argmax()) if near.any() else lip
