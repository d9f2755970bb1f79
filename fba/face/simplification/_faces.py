"""Simplifies faces, and builds the face of any level of the simplified mesh.

The mesh is simplified by `fba.mesh.simplify` in several poses of the face, so that the lips, the lids and all
else that moves keep more vertices. Feature points stay where they are. The tables of FAPs are then fitted
anew, by least squares, so that the simplified face moves as nearly as it can like the full one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fba.arrays import Bool, Float32, Float64, Int32
from fba.errors import ModelError
from fba.face.authoring import author
from fba.face.checks._fap_checks import count_errors
from fba.face.checks._posing import Poser
from fba.face.deform._deformer import Deformer
from fba.face.eyeball import PUPIL_FAP
from fba.face.importers.assembly._repair import repair_tables, take_sounder
from fba.face.model import DetailLevel, FaceModel, shape_key
from fba.face.simplification._tables import close_lids, find_balls, find_lines, fit_tables
from fba.mesh import vertex_normals
from fba.mesh.simplify import (
    Level,
    Simplification,
    carry_parts,
    part_looks,
    place_on_level,
    simplify,
)
from fba.parameters import FAP_COUNT

POSES: tuple[dict[int, int], ...] = (
    {},
    {3: 1000, 19: 768, 20: 768, 21: 256, 22: 256},
    {19: 1024, 20: 1024, 31: 300, 32: 300, 35: 200, 36: 200, 12: 300, 13: 300, 59: 300, 60: 300, 6: 200,
     7: 200, 53: 200, 54: 200},
    {4: 300, 8: 300, 9: 300, 5: -300, 10: -300, 11: -300, 6: -200, 7: -200, 53: -200, 54: -200, 19: -300,
     20: -300, 33: 300, 34: 300},
    {16: 500, 17: 500, 6: -150, 7: -150, 4: 200, 5: 200, 41: 200, 42: 200, 3: 300, 19: 424, 20: 424, 21: 600,
     22: 600},
)  # fmt: skip
"""FAP values of the poses in which the face is simplified: at rest, the jaw open with lids that meet low, the
lids closed with a broad grin, the lips apart with wide eyes, and the lips pushed forward with raised cheeks
and lids that meet half way."""
BROAD_FAPS = (3, 14, 15, 16, 17)
"""FAPs that move half the face: what they move is not important for that alone."""
IMPORTANCE = 180.0
"""Importance of what a FAP moves most, lips and lids, compared to what none moves."""
LID_FAPS = (19, 20, 21, 22)
LID_SHARE = 7.0
"""Factor of the motion of lids, which must pass close to the eyeball."""
EYE_SHARE = 0.5
"""Share of that motion for which eyeballs count."""
LASH_SHARE = 0.5
"""The same for lashes: a hair has little area, yet its lack is seen."""
TEETH_SHARE, LEAST_TEETH = 0.9, 0.2
"""The same for the front of teeth, which stand out against the dark behind them, and the factor of this for
their backs."""
TONGUE_SHARE = 0.2
"""The same for the tongue, which bends."""
HAIRS = ("lash", "brow")
"""Kinds of parts that do not count in a level's error."""
RIM_VERTICES = 16
"""Vertices of a pupil's rim that stay."""
LEVEL_RATIO = 0.32
"""Triangles of a level of detail by those of the next finer one: the source's 680 of 2141."""
LEAST_PER_PART = 50
"""Triangles of a level of detail by its parts, below which parts lose their shape."""
PERCENT = 99
"""Percentage of the vertices to which an error refers."""


@dataclass(frozen=True, eq=False)
class FaceSimplification:
    """A face and the collapses that simplify it; see `simplify_face`."""

    model: FaceModel
    mesh: Simplification
    poses: Float64
    """(K, V, 3), the face in `POSES`, without the head's turn."""
    _kept: Bool

    def within(self, error: float) -> Level:
        """Return the coarsest mesh of which 99 % of the vertices are off by at most this error (m), at rest
        and in all poses; the full one where none is."""
        low, high = 0, len(self.mesh.faces)  # of collapses
        while low < high:
            middle = (low + high + 1) // 2
            if self.error(self.mesh.after(middle)) <= error:
                low = middle
            else:
                high = middle - 1
        return self.mesh.after(low)

    def error(self, level: Level) -> float:
        """Return the distance (m) within which 99 % of the full face's vertices are of a level, in the worst
        pose."""
        return max(self._errors(level, lambda away: float(np.percentile(away, PERCENT)), ~level.gone))

    def _errors(self, level: Level, sum_up: Callable[[Float64], float], counted: Bool) -> list[float]:
        """Return, for each pose, a number for the distances (N,) of the full face's vertices from a level.

        counted: (V,), the vertices whose distances these are.
        """
        rows, weights = place_on_level(self.mesh.positions, level)
        errors = []
        for pose in self.poses:
            moved = level.positions + level.carry(pose - self.poses[0])
            off = np.einsum("nk,nkd->nd", weights, moved[rows]) - pose
            errors.append(sum_up(np.linalg.norm(off[counted], axis=1)))
        return errors

    def build(self, level: Level, *, tables: bool = True) -> DetailLevel:
        """Return the face of a level of the mesh, with all that it carries. tables: whether with those."""
        model = self.model
        on_full = level.carry(self.mesh.positions).astype(np.float32)
        parts = tuple(
            # corners of eyeballs are on their spheres, as lids pass close to these
            replace(part, **(arrays | ({"vertices": on_full[rows]} if part.kind == "eye" else {})))
            for part, rows, arrays in carry_parts(model, level)
        )
        bound = np.where((model.bound >= 0) & self._used[model.bound], level.parents[model.bound], -1)
        face = replace(model, parts=parts, bound=bound.astype(np.int32), tables=(), levels=())
        if tables:
            fitted = fit_tables(model, face, level, self._unmoved(level), self.mesh.positions)
            face = self._mend(replace(face, tables=fitted), level)
        # Single hairs, hardly a pixel wide, do not decide when a level is good enough.
        hairs = np.concatenate([np.full(len(part.vertices), part.kind in HAIRS) for part in model.parts])
        off = max(self._errors(level, _root_mean_square, ~(level.gone | hairs)))
        return DetailLevel(face, level.parents, off, shape_key(model.parts))

    def _mend(self, face: FaceModel, level: Level) -> FaceModel:
        """Return the face with other tables for FAPs whose own break rules: stopped earlier where that is
        enough, else with lids that meet, carried, or from the mesh."""
        poser, faps = Poser(face), [table.fap for table in face.tables]
        if not count_errors(poser, faps):
            return face
        bare = replace(face, tables=())
        stopped = repair_tables(face, bare)
        if stopped.table_of.keys() == face.table_of.keys() and not count_errors(Poser(stopped), faps):
            return stopped
        lids = tuple(table for table in self.model.tables if table.fap in LID_FAPS)
        model, still = self.model.with_tables(lids, {}), self._unmoved(level)
        carried = fit_tables(model, bare, level, still, self.mesh.positions, carried=True)
        plain = author(face.parts, face.points, bound=face.bound)
        mended = repair_tables(bare.with_tables(carried, {}), plain)
        for other in (bare.with_tables(close_lids(face), {}), mended, plain):
            face = take_sounder(face, other)
        return repair_tables(face, plain)

    @cached_property
    def _used(self) -> Bool:
        used = np.zeros(len(self.model.vertices), dtype=bool)
        used[self.model.triangles] = True
        return used

    def _unmoved(self, level: Level) -> Int32:
        """Return vertices that are still where they were because they had to; they move exactly as before."""
        still = (level.positions[level.parents] == self.mesh.positions).all(axis=1)
        return np.flatnonzero(self._kept & still & self._used).astype(np.int32)


def simplify_face(model: FaceModel, faces: int | Sequence[int]) -> FaceSimplification:
    """Return the simplification of a face down to a number of triangles, or through several, falling.

    `build(mesh.level(faces))` returns the face of any level between, with its parts, seams, textures,
    colours, normals, feature points and tables. ModelError for a part without triangles, and for fewer
    triangles than parts.
    """
    for part in model.parts:
        if not len(part.triangles):
            raise ModelError(f"part {part.name!r} has no triangles; leave it out before simplifying")
    fewest = min([faces] if isinstance(faces, int) else faces)
    if fewest < len(model.parts):
        raise ModelError(
            f"{fewest} triangles are too few for a face of {len(model.parts)} parts: each keeps one at least"
        )
    deformer = Deformer(model)
    poses = np.stack([deformer.local(_values(pose)) for pose in POSES]).astype(np.float64)
    kept, lines = _find_pinned(model), find_lines(model)
    mesh = simplify(
        poses,
        model.triangles,
        faces,
        looks=part_looks(model),
        importance=np.where(kept, np.inf, _importance(model)),
        lines=lines,
        balls=find_balls(model),
    )
    return FaceSimplification(model, mesh, poses, kept | (lines > 0))


def level_sizes(model: FaceModel, count: int) -> list[int]:
    """Return the triangles of up to `count` levels, each with `LEVEL_RATIO` of those of the one before.

    After the first, levels with fewer than `LEAST_PER_PART` triangles a part are left out.
    """
    total, least = len(model.triangles), LEAST_PER_PART * len(model.parts)
    first, *others = (round(total * LEVEL_RATIO**number) for number in range(1, count + 1))
    return [max(first, len(model.parts)), *(faces for faces in others if faces >= least)]


def _root_mean_square(away: Float64) -> float:
    return float(np.sqrt((away**2).mean()))


def _values(pose: dict[int, int]) -> Float32:
    values = np.zeros(FAP_COUNT, dtype=np.float32)
    for number, value in pose.items():
        values[number - 1] = value
    return values


def _find_pinned(model: FaceModel) -> Bool:
    """Return (V,): vertices of feature points, and some around each pupil, which give its size."""
    pinned = np.zeros(len(model.vertices), dtype=bool)
    pinned[model.bound[model.bound >= 0]] = True
    eyes = {part.name for part in model.of_kind("eye")}
    for fap in PUPIL_FAP.values():
        for mesh in model.table_of[fap].meshes if fap in model.table_of else ():
            size = np.linalg.norm(mesh.displacements, axis=2).max(axis=1, initial=0.0)
            rim = mesh.vertices[size > 0.95 * size.max(initial=0.0)] + model.starts[mesh.part]
            if mesh.part in eyes and len(rim):
                off = model.vertices[rim].astype(np.float64) - model.vertices[rim].mean(axis=0)
                around = np.argsort(np.arctan2(off[:, 1], off[:, 0]))
                pinned[rim[around[:: -(-len(rim) // RIM_VERTICES)]]] = True
    return pinned


def _importance(model: FaceModel) -> Float64:
    """Return (V,): factors of the cost, by how much of a FAP's motion reaches each vertex of the skin."""
    share = np.zeros(len(model.vertices))
    skins = {part.name for part in model.of_kind("skin")}
    for table in model.tables:
        for mesh in table.meshes:
            if table.fap in BROAD_FAPS or mesh.part not in skins or not len(mesh.vertices):
                continue
            moved = np.linalg.norm(mesh.displacements.astype(np.float64), axis=2).max(axis=1)
            rows = mesh.vertices + model.starts[mesh.part]
            most = max(float(moved.max()), 1e-30) / (LID_SHARE if table.fap in LID_FAPS else 1.0)
            share[rows] = np.maximum(share[rows], moved / most)
    for kind, counts in (
        ("eye", EYE_SHARE),
        ("lash", LASH_SHARE),
        ("tongue", TONGUE_SHARE),
    ):
        for part in model.of_kind(kind):
            start = model.starts[part.name]
            share[start : start + len(part.vertices)] = counts
    for part in model.of_kind("teeth"):
        ahead = vertex_normals(part.vertices, part.triangles)[:, 2]
        start = model.starts[part.name]
        share[start : start + len(part.vertices)] = TEETH_SHARE * np.clip(ahead, LEAST_TEETH, 1.0)
    return 1.0 + IMPORTANCE * share**2
