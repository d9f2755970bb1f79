"""A face model as the player shows it: turns FAPs into meshes, eyeballs and feature points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from fba.arrays import Float32, Float64, Intp
from fba.face import Deformer, FaceModel, Part
from fba.face.eyeball import fit_sphere, flat_width
from fba.geometry import fit_similarity
from fba.parameters import point_rows
from fba_player._figure._face_parts import (
    coarse_shapes,
    compute_sway,
    keep_triangles,
    make_shape,
    middle_of_points,
    part_rows,
)
from fba_player._figure._lids import follow_gaze
from fba_player._figure._tongue import Tongue, find_tongues
from fba_player._figure.face_light import FaceLight
from fba_player._figure.model_units import EYES_APART
from fba_player._figure.wrinkles import place_wrinkles, wrinkle_strengths
from fba_player.view._camera import Subject
from fba_player.view._geometry import rotation_vector, transform
from fba_player.view._view import IRIS, Eye, FaceMesh, FaceShape

MAX_ROUNDNESS_ERROR = 0.03
"""A part whose median distance from its sphere exceeds this share of the radius is drawn as a mesh."""
MIN_BALL_VERTICES = 12
"""A part with fewer vertices is not an eyeball; with fewer behind the pupil, all give its rotation."""
SAMPLED_VERTICES = 96
"""Vertices from which an eyeball's rotation is computed."""
PUPIL_FAPS = (29, 30)
"""FAPs that dilate the left and the right pupil."""
LID_POINTS = (("3.1", "3.3", "3.7", "3.11"), ("3.2", "3.4", "3.12", "3.8"))
"""Feature points of the left and right eye: middles of upper and lower lid, outer and inner corner."""
OPEN_LIDS = np.array([[0.0, 0.5, 0.86], [0.0, -0.5, 0.86], [1.0, 0.0, 0.3], [-1.0, 0.0, 0.3]])
"""These points of an open eye, relative to its centre, in radii."""
MIN_SWAY_ON_BODY = 0.45
"""On a body, vertices that turn with the head by less than this share are left out: the body has a neck."""


@dataclass(frozen=True, eq=False)
class Eyeball:
    """One eyeball in the neutral face. side: 0 left, 1 right. centre: (3,), and radius, metres.

    rows: sampled vertices of the part, away from the pupil. neutral: their positions. bent: whether
    FaceDefMeshes move them, not only the part's transforms. lids: the model's vertices at `LID_POINTS`, -1
    for missing ones. iris, pupil: diameters (m). step: change of the pupil's diameter for one unit of FAP 29
    or 30. tint: colour of the iris, linear light.
    """

    side: int
    centre: Float64
    radius: float
    rows: Intp
    neutral: Float64
    bent: bool
    lids: tuple[int, ...]
    iris: float
    pupil: float
    step: float
    tint: tuple[float, float, float]

    def pose(
        self, part: Float32, face: Float32, faps: Float32, matrix: Float64, turn: Float64 | None = None
    ) -> Eye:
        """Return the eye for moved vertices (V, 3) of its part and of the face, put into the world.

        turn: (4, 4), what moves the part; None to find it by the vertices.
        """
        if turn is None:
            fitted = fit_similarity(self.neutral, part.take(self.rows, axis=0).astype(np.float64))
            turn = np.eye(4)
            turn[:3, :3], turn[:3, 3] = fitted.rotation, fitted.target - fitted.rotation @ fitted.centre
        frame = turn.copy()
        frame[:3, :3] *= self.radius
        frame[:3, 3] += turn[:3, :3] @ self.centre
        pupil = self.pupil + self.step * float(faps[PUPIL_FAPS[self.side] - 1])
        iris = self.iris / 2 / self.radius
        return Eye(
            matrix @ frame,
            iris,
            min(max(pupil / 2 / self.radius, 0.03), iris * 0.92),
            self._lid_positions(face, frame[:3, 3]),
            matrix[:3, :3] / math.sqrt(matrix[:3, 0] @ matrix[:3, 0]),
            self.tint,
        )

    def _lid_positions(self, face: Float32, centre: Float64) -> Float64:
        """Return the lid points (4, 3) from the centre, in radii; for missing ones, those of an open eye."""
        lids = np.array(self.lids)
        return np.where(lids[:, None] >= 0, (face.take(lids, axis=0) - centre) / self.radius, OPEN_LIDS)


def find_eyeball(part: Part, model: FaceModel) -> Eyeball | None:
    """Return the sphere that fits a part, or None if it is not round."""
    vertices = part.vertices.astype(np.float64)
    if len(vertices) < MIN_BALL_VERTICES or flat_width(part) is not None:
        return None
    on_sphere = np.ones(len(vertices), dtype=bool)
    for _ in range(4):  # without what stands out, such as a cornea
        centre, radius, _ = fit_sphere(vertices[on_sphere])
        away = np.abs(np.linalg.norm(vertices - centre, axis=1) - radius)
        on_sphere = away <= max(float(np.quantile(away, 0.7)), 1e-9)
    if not np.isfinite(radius) or radius <= 0 or float(np.median(away)) > MAX_ROUNDNESS_ERROR * radius:
        return None
    if float(np.ptp(vertices, axis=0).max()) > 2.4 * radius:
        return None
    side = 0 if centre[0] > 0 else 1
    behind = np.flatnonzero((vertices[:, 2] - centre[2]) < 0.75 * radius)
    if len(behind) < MIN_BALL_VERTICES:
        behind = np.arange(len(vertices))
    rows = behind[np.unique(np.linspace(0, len(behind) - 1, SAMPLED_VERTICES).astype(int))]
    unit = model.fapu.IRISD
    lids = tuple(int(model.bound[point_rows()[name]]) for name in LID_POINTS[side])
    meshes = [mesh for table in model.tables for mesh in table.meshes if mesh.part == part.name]
    bent = any(np.isin(rows, mesh.vertices).any() for mesh in meshes)
    tint = _iris_tint(part, centre, unit * 512) or IRIS
    iris = unit * 1024
    return Eyeball(side, centre, radius, rows, vertices[rows], bent, lids, iris, iris / 3, unit, tint)


def _iris_tint(part: Part, centre: Float64, radius: float) -> tuple[float, float, float] | None:
    """Return the mean colour of the outer part of an iris of a radius (m); None where vertices have none."""
    across = np.hypot(*(part.vertices - centre)[:, :2].T)
    ring = (across > 0.72 * radius) & (across < 0.94 * radius) & (part.vertices[:, 2] > centre[2])
    if part.colours is None or part.material.texture is not None or not ring.any():
        return None
    red, green, blue = part.colours[ring, :3].mean(axis=0, dtype=np.float64)
    return float(red), float(green), float(blue)


@dataclass(frozen=True, eq=False)
class Pose:
    """The face shown for FAPs (68,): positions and normals, float32 (V, 3), without the head's `turn`.

    Lids follow the gaze, and the tongue keeps between teeth and lips, if something is seen between these.
    gap: metres between the lips, infinite where they are not known. shut: whether nothing is seen. deformer:
    that which moved the vertices.
    """

    faps: Float32
    positions: Float32
    normals: Float32
    gap: float
    shut: bool
    deformer: Deformer

    @cached_property
    def turn(self) -> Float64:
        """(4, 4), the head's."""
        return self.deformer.head_matrices(self.faps)


@dataclass(eq=False)
class FaceFigure:
    """A face model ready to be shown; see `build_figure`.

    sway: float32 (V,), how far each vertex turns with the head, whose rotation is about `centre` (3,).
    shapes: all parts but the eyeballs, by name.
    """

    model: FaceModel
    deformer: Deformer
    sway: Float32
    centre: Float64
    shapes: dict[str, FaceShape]
    eyeballs: list[tuple[Part, Eyeball]]
    light: FaceLight
    tongues: list[Tongue]
    _pose: Pose | None = field(default=None, init=False)

    @property
    def scale(self) -> float:
        """Size of the face: 1 if the eyes are as far apart as an adult's."""
        return self.model.fapu.ES * 1024 / EYES_APART

    @cached_property
    def between_eyes(self) -> Float64:
        """(3,) the point between the pupils, metres, in the frame of the model."""
        return np.asarray(self.model.points[[point_rows()["3.5"], point_rows()["3.6"]]].mean(axis=0))

    @cached_property
    def subject(self) -> Subject:
        """What a camera should have in view: the head from its top to the upper chest."""
        model = self.model
        head = np.concatenate([part.vertices for part in model.of_kind("skin") or model.parts])
        chin = middle_of_points(model, ("2.10", "2.1"))
        tall = model.fapu.ENS * 1024 * 5.2
        top = float(head[:, 1].max())
        low = float(chin[1]) if chin is not None else top - tall
        if not 0.5 * tall < top - low < 2 * tall:  # high hair, a hat, or a body below
            top = low + tall
        x, _, z = self.between_eyes
        centre = (float(x), (top + low) / 2 - 0.07 * (top - low), float(z) - 0.3 * (top - low))
        return Subject(centre, 0.71 * (top - low), 0.60 * (top - low))

    def pose(self, faps: Float32, deformer: Deformer | None = None, least_gap: float = 0.0) -> Pose:
        """Return the face for FAPs (68,); the last one is cached.

        deformer: that of `restrict`, None for all vertices. least_gap: nothing is seen between lips that are
        less than this apart, metres; the tongue then is anywhere.
        """
        deformer, last = deformer or self.deformer, self._pose
        if (
            last is None
            or last.deformer is not deformer
            or last.shut != (last.gap < least_gap)
            or not np.array_equal(last.faps, faps)
        ):
            last = self._pose = self._posed(faps.copy(), deformer, least_gap)
        return last

    def restrict(self, rows: Intp) -> Deformer:
        """Return what moves only these vertices (N,), and those that place eyes, mouth and tongues."""
        whole = [self.rows(part.name) for part, ball in self.eyeballs if ball.bent]
        placing = [np.r_[rows, *(tongue.rows for tongue in self.tongues), *whole], self.light.lips]
        placing += [np.r_[tongue.lips, tongue.teeth, tongue.front] for tongue in self.tongues]
        placing += [[lid for lid in ball.lids if lid >= 0] for _, ball in self.eyeballs]
        return self.deformer.restrict(np.concatenate(placing).astype(np.intp))

    def _posed(self, faps: Float32, deformer: Deformer, least_gap: float) -> Pose:
        normals = np.empty((len(self.model.vertices), 3), dtype=np.float32)
        eyes = [(ball.side, ball.radius) for _, ball in self.eyeballs]
        shown = follow_gaze(faps, eyes, self.model.fapu.IRISD)
        positions = deformer.local(shown, out=np.zeros_like(normals), normals=normals)
        lips = self.light.lips
        gap = float(np.linalg.norm(positions[lips[0]] - positions[lips[1]])) if lips else math.inf
        for tongue in self.tongues if gap >= least_gap else ():
            tongue.bend(positions, normals, faps)
        return Pose(faps, positions, normals, gap, gap < least_gap, deformer)

    def meshes(
        self, faps: Float32, matrix: Float64, *, on_body: bool = False, without: Sequence[str] = ()
    ) -> list[FaceMesh]:
        """Return all parts but the eyeballs for FAPs (68,); matrix: (4, 4), into the world.

        on_body: whether to leave out the lower neck and shoulders. without: kinds of parts to leave out.
        """
        pose = self.pose(faps)
        light = self.light.shade(pose.positions, pose.turn[:3, :3], matrix[:3, :3])
        axis = rotation_vector(pose.turn[:3, :3])
        wrinkles = wrinkle_strengths(faps)
        meshes = []
        for name, shape in (self._shapes_on_body if on_body else self.shapes).items():
            if self.model.part(name).kind in without or not len(shape.triangles):
                continue
            rows = self.rows(name)
            part = pose.positions[rows], pose.normals[rows], light[rows]
            meshes.append(FaceMesh(shape, *part, matrix, axis, self.centre, wrinkles=wrinkles))
        return meshes

    def rows(self, name: str) -> slice:
        """Return the slice of a part's vertices in the arrays of the model; KeyError for an unknown name."""
        return part_rows(self.model, name)

    def eyes(self, faps: Float32, matrix: Float64, *, turned: bool = False) -> list[Eye]:
        """Return the eyeballs for FAPs (68,); matrix: (4, 4), into the world.

        turned: whether the matrix contains the head's turn already.
        """
        last = self._pose  # any will do, as all of them have the vertices that place eyes
        pose = last if last is not None and np.array_equal(last.faps, faps) else self.pose(faps)
        placed = matrix if turned else matrix @ pose.turn
        turns = dict(zip(self.model.starts, self.deformer.part_matrices(faps), strict=True))
        eyes = []
        for part, ball in self.eyeballs:
            moved, turn = pose.positions[self.rows(part.name)], None if ball.bent else turns[part.name]
            eyes.append(ball.pose(moved, pose.positions, faps, placed, turn))
        return eyes

    def points(self, faps: Float32, matrix: Float64) -> Float64:
        """Return float64 (84, 3): feature points in the world for FAPs (68,); NaN for missing ones."""
        return transform(self.deformer.feature_points(faps), matrix)

    @cached_property
    def _shapes_on_body(self) -> dict[str, FaceShape]:
        """The parts without the lower neck and shoulders."""
        shapes = {}
        for name, shape in self.shapes.items():
            above = keep_triangles(shape, shape.sway > MIN_SWAY_ON_BODY, whole=True)
            if len(above.triangles):
                shapes[name] = above
        return shapes


def build_figure(model: FaceModel) -> FaceFigure:
    """Return a figure of any face. Its occlusion is computed on first use, in about a second."""
    deformer, sway = Deformer(model), compute_sway(model)
    shapes, eyeballs = {}, []
    for part in model.parts:
        eyeball = find_eyeball(part, model) if part.kind == "eye" else None
        if eyeball is not None:
            eyeballs.append((part, eyeball))
            continue
        rows = part_rows(model, part.name)
        shape = replace(make_shape(part, sway[rows]), wrinkle_places=place_wrinkles(model, part))
        if shape.across is None:  # single hairs are not simplified
            shape = replace(shape, casts=True)
            shape = replace(shape, levels=coarse_shapes(model, part, shape))
        shapes[part.name] = shape
    light = FaceLight(model, deformer, sway)
    tongues = find_tongues(model)
    return FaceFigure(model, deformer, sway, _head_centre(model), shapes, eyeballs, light, tongues)


def _head_centre(model: FaceModel) -> Float64:
    """Return (3,): the centre of the head's rotation in its tables; the origin if they do not turn it."""
    tables = [model.table_of[number] for number in (48, 49, 50) if number in model.table_of]
    for turn in (turn for table in tables for turn in table.transforms):
        if turn.kind == "rotation":
            return np.array(turn.centre)
    return np.zeros(3)
