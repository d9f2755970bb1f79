"""Poses a face model by its tables in double precision, to measure it.

Kept apart from the compiled deformer, which rounds to 32 bits and takes long to build for a few poses.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64
from fba.face._tables import HEAD
from fba.face.authoring.regions._eyes import Eye, find_eyes
from fba.face.authoring.surface.landmarks import Landmarks, find_landmarks, weld_skin
from fba.face.checks._findings import Finding
from fba.face.model import FaceModel
from fba.parameters import point_rows

KIND_ORDER = ("scale", "rotation", "translation")
"""Order in which the transforms of a part act, as in a Transform node."""


class Poser:
    """Poses a model and measures it.

    like: a Poser whose neutral face is the same apart from its tables: its landmarks and eyes are reused, and
    its findings about tables that both models have.
    """

    def __init__(self, model: FaceModel, like: Poser | None = None) -> None:
        self.model = model
        self.neutral: Float64 = model.vertices.astype(np.float64)
        self._landmarks: _NeutralLandmarks = (
            like._landmarks
            if like is not None and _same_face(model, like.model)
            else _NeutralLandmarks(model)
        )

    def findings(
        self, rule: str, faps: Iterable[int], check: Callable[[], Iterator[Finding]]
    ) -> tuple[Finding, ...]:
        """Return what a check finds, cached by the neutral face and the tables of these FAPs."""
        key = (rule, *(self.model.table_of.get(fap, fap) for fap in faps))
        if key not in self._landmarks.findings:
            self._landmarks.findings[key] = tuple(check())
        return self._landmarks.findings[key]

    def pose(self, values: Mapping[int, float]) -> Float64:
        """Return (V, 3) float64, metres: all vertices under FAP values by number; the head is not turned."""
        moved = self.neutral.copy()
        tables = [
            (self.model.table_of[fap], value) for fap, value in values.items() if fap in self.model.table_of
        ]
        for table, value in tables:
            unit = self.model.fapu.of_fap(table.fap)
            for mesh in table.meshes:
                start = self.model.starts[mesh.part]
                moved[mesh.vertices + start] += mesh.shift(value).astype(np.float64) * unit
        for part in self.model.parts:
            turns = [
                (transform, value * self.model.fapu.of_fap(table.fap))
                for table, value in tables
                for transform in table.transforms
                if transform.part == part.name and transform.part != HEAD
            ]
            start = self.model.starts[part.name]
            own = slice(start, start + len(part.vertices))
            for transform, amount in sorted(turns, key=lambda turn: KIND_ORDER.index(turn[0].kind)):
                moved[own] = apply_transform(
                    moved[own], transform.kind, amount * np.array(transform.amount), transform.centre
                )
        return moved

    def shift(self, values: Mapping[int, float]) -> Float64:
        """Return (V, 3) float64, metres: displacement of each vertex from the neutral face."""
        return self.pose(values) - self.neutral

    def vertex(self, point: str) -> int:
        """Return the vertex of a feature point, counted through all parts; -1 if it is bound to none."""
        return int(self.model.bound[point_rows()[point]])

    def has(self, *points: str) -> bool:
        """Return whether all these feature points are bound to vertices."""
        return all(self.vertex(point) >= 0 for point in points)

    def point(self, point: str) -> Float64:
        """Return (3,) a neutral feature point."""
        return np.asarray(self.model.points[point_rows()[point]])

    @property
    def marks(self) -> Landmarks:
        """Feature points and contours on the skin."""
        return self._landmarks.marks

    @property
    def eyes(self) -> dict[str, Eye]:
        """The eyes by side, "left" and "right"."""
        return self._landmarks.eyes

    def surface(self, moved: Float64) -> Float64:
        """Return (N, 3): posed vertices (V, 3) of the model as vertices of `marks.surface`."""
        result = self.marks.surface.vertices.copy()
        result[self.marks.surface.number] = moved[self.marks.surface.pool]
        return result

    def contour(self, name: str, moved: Float64) -> Float64:
        """Return (M, 3): a contour of the posed face, corner to corner; empty where the face has none."""
        return self.surface(moved)[self.marks.contour(name)]


class _NeutralLandmarks:
    """Landmarks and eyes of a model's neutral face, located on first use.

    findings: by the name of the rule and the tables (the FAP where it has none) that were checked.
    """

    def __init__(self, model: FaceModel) -> None:
        self._model = model
        self.findings: dict[tuple[object, ...], tuple[Finding, ...]] = {}

    @cached_property
    def marks(self) -> Landmarks:
        surface = weld_skin(self._model.parts, self._model.bound)
        return find_landmarks(surface, self._model.points, self._model.bound)

    @cached_property
    def eyes(self) -> dict[str, Eye]:
        return find_eyes(self.marks, self._model.parts)


def _same_face(one: FaceModel, other: FaceModel) -> bool:
    """Return whether two models differ only in their tables and names."""
    return (
        len(one.parts) == len(other.parts)
        and all(a is b for a, b in zip(one.parts, other.parts, strict=True))
        and np.array_equal(one.points, other.points, equal_nan=True)
        and np.array_equal(one.bound, other.bound)
    )


def apply_transform(points: Float64, kind: str, amount: Float64, centre: npt.ArrayLike) -> Float64:
    """Return points (N, 3) after a "rotation" (radians), "scale" (1 + amount) or "translation" by (3,)."""
    from scipy.spatial.transform import Rotation

    if kind == "translation":
        return points + amount
    arms = points - np.asarray(centre)
    if kind == "scale":
        return np.asarray(np.asarray(centre) + arms * (1 + amount))
    return np.asarray(Rotation.from_rotvec(amount).apply(arms) + np.asarray(centre))
