"""Makes a face model with tables for every FAP from a head mesh and its 84 feature points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64, Int32
from fba.errors import ModelError
from fba.face._expressions import Definitions
from fba.face._tables import HEAD, FaceDefTables, FaceDefTransform
from fba.face.authoring.regions._eye_opening import LIDS, measure_opening
from fba.face.authoring.regions._eyes import Eye, eye_transforms, find_eyes, pupil_motions
from fba.face.authoring.regions._lids import lash_motion, lid_motion, sculpted_share
from fba.face.authoring.regions._lips import HANDLES, lip_motions
from fba.face.authoring.regions._soft_skin import brow_cheek_nose_motions, ear_motions
from fba.face.authoring.regions.jaw import (
    CHIN,
    TONGUE_FAPS,
    Jaw,
    find_jaw,
    hollowing,
    jaw_share_of_part,
    opening_angles,
    opening_shifts,
    tongue_motion,
)
from fba.face.authoring.surface._fold_limits import Limiter
from fba.face.authoring.surface._motion import Motion, build_tables, split_by_part, unfold
from fba.face.authoring.surface._motion_limits import eased_linear_motion, stop_at_folds
from fba.face.authoring.surface.attached_parts import (
    ATTACHED_DISTANCE,
    MAX_ATTACHED_SIZE,
    Anchors,
    attach,
    attach_lashes,
)
from fba.face.authoring.surface.binding import Binding, bind_points, face_size, separate_lips
from fba.face.authoring.surface.landmarks import LIP_CONTOURS, Landmarks, find_landmarks, weld_skin
from fba.face.authoring.surface.surface import Surface
from fba.face.eyeball import PUPIL_FAP
from fba.face.feature_points import names
from fba.face.model import FaceModel, Part
from fba.face.points import OPEN_JAW, SHIFT_JAW, THRUST_JAW
from fba.parameters import FIRST_LOW_LEVEL_FAP, faps

if TYPE_CHECKING:
    from fba.face.interpolation.table import InterpolationTable


MOST_VERTICES = 250_000
"""Denser meshes are refused: they look no better, and would take minutes and gigabytes."""
EYE_FAPS = {"left": (23, 25, 27), "right": (24, 26, 28)}
HEAD_AXES = {48: (1.0, 0.0, 0.0), 49: (0.0, 1.0, 0.0), 50: (0.0, 0.0, 1.0)}
JAW_FAPS = (OPEN_JAW, THRUST_JAW, SHIFT_JAW)
LIP_POINTS = tuple(name for pair in HANDLES.values() for name in pair)
IN_EYE = 1.5
"""Distance from an eyeball's centre, in its radii, within which parts that are no skin belong to it."""
CARRIED_KINDS = ("brow", "lash", "other")


def author(
    parts: Sequence[Part],
    points: npt.ArrayLike,
    *,
    bound: npt.ArrayLike | None = None,
    name: str = "",
    definitions: Definitions | None = None,
    fit: InterpolationTable | None = None,
    notes: Mapping[str, str] | None = None,
) -> FaceModel:
    """Return a face whose tables are made from the shape of the mesh alone.

    parts: the skin, and if present eyeballs (one part each), teeth, tongue, the inside of the mouth,
    brows, lashes, hair; upright, looking along +z, metres. points: (84, 3), rows as
    `feature_point_names()`, NaN where unknown; they are moved onto their vertices. bound: (84,) the
    vertices they stand on, counted through the parts, -1 for the nearest vertex. definitions, fit, notes,
    name: as in `FaceModel`.

    FAPs for which a point or part is missing are in the model's `lost`, with the reason. Raises
    ModelError without skin, if a FAPU is not positive, if most points are far from the mesh, and for more
    than 250,000 vertices.
    """
    parts = tuple(parts)
    given = np.array(points, dtype=np.float64)
    if given.shape != (len(names()), 3):
        raise ModelError(f"feature points must have shape ({len(names())}, 3), not {given.shape}")
    if np.isinf(given).any():
        raise ModelError(f"feature point {names()[int(np.argwhere(np.isinf(given))[0, 0])]} is infinite")
    given[np.isnan(given).any(axis=1)] = np.nan
    _check_size(parts)
    binding = bind_points(parts, given, bound)
    surface = weld_skin(parts, binding.bound)
    if bound is None:
        binding = separate_lips(surface, parts, given, binding, face_size(given))
    work = _start(parts, surface, binding.points, binding.bound)
    marks = work.marks
    work.add_all()
    _explain_far_points(work.lost, binding)
    return FaceModel(
        parts=parts,
        points=binding.points,
        bound=binding.bound,
        tables=tuple(
            build_tables(fap, marks.fapu.of_fap(fap), work.moves.get(fap, {}), work.turns.get(fap, ()))
            for fap in sorted({*work.moves, *work.turns})
        ),
        fit=fit,
        definitions=definitions or Definitions.default(),
        name=name,
        lost=work.lost,
        notes=dict(notes or {}),
    )


def author_lids(model: FaceModel, sculpted: Mapping[int, Sequence[Float64]]) -> dict[int, FaceDefTables]:
    """Return the tables by FAP (19..22) of lids that move as shapes do, without those that no shape moves.

    sculpted: by FAP, displacements (V, 3) of the model's vertices, metres: of several shapes, the first that
    moves the lid.
    """
    surface = weld_skin(model.parts, model.bound)
    work = _start(model.parts, surface, model.points, model.bound)
    made = {}
    for fap, shapes in sculpted.items():
        side, lid = LIDS[fap]
        opening = measure_opening(work.marks, work.eyes[side])
        for shape in shapes if opening is not None else ():
            assert opening is not None
            shift = surface.of_all(shape)
            if sculpted_share(work.marks, opening, work.eyes[side], lid, shift) is not None:
                work.add_lid(fap, shift)
                break
        if fap in work.moves:
            made[fap] = build_tables(fap, model.fapu.of_fap(fap), work.moves[fap])
    return made


def _start(parts: tuple[Part, ...], surface: Surface, points: Float64, bound: Int32) -> _Authoring:
    """Return the authoring of a face, without any motion yet."""
    marks = find_landmarks(surface, points, bound)
    limiter = Limiter.from_mesh(surface.vertices, surface.triangles)
    eyes = find_eyes(marks, parts)
    return _Authoring(parts, marks, limiter, eyes, _attach_parts(marks, parts, eyes))


def _check_size(parts: tuple[Part, ...]) -> None:
    if not any(part.kind == "skin" and len(part.triangles) for part in parts):
        kinds = (f"{part.name!r} ({part.kind}, {len(part.triangles)} triangles)" for part in parts)
        raise ModelError(
            f"a face needs a part of kind 'skin' with triangles; there are {', '.join(kinds) or 'none'}"
        )
    total = sum(len(part.vertices) for part in parts)
    if total > MOST_VERTICES:
        raise ModelError(
            f"the mesh has {total} vertices, but at most {MOST_VERTICES} are possible: "
            "reduce it to the head, or decimate it"
        )


def _attach_parts(marks: Landmarks, parts: tuple[Part, ...], eyes: Mapping[str, Eye]) -> dict[str, Anchors]:
    """Return the attachment to the skin of each part that moves with it, by name; what is in an eye stays."""
    result: dict[str, Anchors] = {}
    es = marks.fapu.ES * 1024
    margins = np.concatenate([marks.contour(f"{side} {lid} lid") for side, lid in LIDS.values()])
    for part in parts:
        if part.kind not in CARRIED_KINDS or not len(part.triangles):
            continue
        if part.kind == "other" and np.ptp(part.vertices, axis=0).max() > MAX_ATTACHED_SIZE * es:
            continue
        if part.kind == "other" and _is_in_eyes(part, eyes):
            continue
        anchors = attach(marks.surface, part)
        if part.kind == "lash" and len(margins):
            lashes = attach_lashes(marks.surface, part, margins)
            anchors = lashes if np.median(lashes.distance) < ATTACHED_DISTANCE * es else anchors
        if np.median(anchors.distance) < ATTACHED_DISTANCE * es:
            result[part.name] = anchors
    return result


def _is_in_eyes(part: Part, eyes: Mapping[str, Eye]) -> bool:
    """Return whether all of a part is within the reach of an eyeball, as the whites of drawn eyes are."""
    away = [np.linalg.norm(part.vertices - eye.centre, axis=1) / eye.radius for eye in eyes.values()]
    return bool(len(part.vertices)) and bool((np.min(away, axis=0) < IN_EYE).all())


def _explain_far_points(lost: dict[int, str], binding: Binding) -> None:
    """Add to the reasons for lost FAPs, in place, which feature points are too far from the mesh."""
    for fap, reason in lost.items():
        point = next((name for name in faps()[fap - 1].feature_points if name in binding.far), None)
        if point:
            away = binding.far[point] * 1000
            lost[fap] = f"feature point {point} is {away:.0f} mm away from the mesh ({reason})"


@dataclass(eq=False)
class _Authoring:
    """The motions of one face, while they are made.

    anchors: of the parts that move with the skin, by name. moves: motions by FAP and part. turns: transforms
    by FAP. lost: reasons by FAP.
    """

    parts: tuple[Part, ...]
    marks: Landmarks
    limiter: Limiter
    eyes: dict[str, Eye]
    anchors: dict[str, Anchors]
    moves: dict[int, dict[str, Motion]] = field(default_factory=dict)
    turns: dict[int, list[FaceDefTransform]] = field(default_factory=dict)
    lost: dict[int, str] = field(default_factory=dict)

    def add_all(self) -> None:
        """Make the motions of every FAP that this face can have."""
        self._add_jaw()
        for make in (lip_motions, brow_cheek_nose_motions, ear_motions):
            motions, lost = make(self.marks, self.limiter)
            for fap, motion in motions.items():
                self._add_to_surface(fap, motion)
            self.lost |= lost
        for fap in LIDS:
            self.add_lid(fap)
        self._add_eyeballs()
        self._add_tongue()
        self._add_head()
        for fap in range(FIRST_LOW_LEVEL_FAP, len(faps()) + 1):
            if fap not in self.moves and fap not in self.turns and fap not in self.lost:
                self.lost[fap] = "no part of this mesh moves with this FAP"

    def _add_to_surface(self, fap: int, motion: Motion) -> None:
        """Add a motion of the surface, and of the parts attached to it, to a FAP."""
        moves = split_by_part(self.marks.surface, motion)
        for name, anchors in self.anchors.items():
            moves[name] = anchors.carry(motion)
        self.moves[fap] = {**self.moves.get(fap, {}), **moves}

    def _add_jaw(self) -> None:
        jaw = find_jaw(self.marks)
        if isinstance(jaw, str):
            self.lost |= dict.fromkeys(JAW_FAPS, jaw)
            return
        values, angles = opening_angles(jaw, self.marks.fapu.MNS)
        inner = [
            (part, jaw_share_of_part(self.marks, part, jaw.hinge)[:, None])
            for part in self.parts
            if part.kind in ("teeth", "tongue")
        ]
        points = self.marks.surface.vertices
        hollow = hollowing(self.marks)
        moving = np.flatnonzero((jaw.share > 0) | hollow.any(axis=1))
        shifts = opening_shifts(points[moving], jaw, angles) * jaw.share[moving][:, None]
        sunk = -opening_shifts(jaw.chin[None], jaw, angles)[:, :, 1:2]
        shifts += sunk * hollow[moving]
        pinned = self.marks.on_contours(*LIP_CONTOURS)
        pinned[self.marks.vertices_of(CHIN)] = True
        motion = unfold(self.marks.surface, self.limiter, Motion(values, moving, shifts), pinned, True)
        motion = stop_at_folds(self.limiter, motion, turning=True)
        self._add_to_surface(OPEN_JAW, motion)
        # teeth and tongue stop where the skin stops
        reached = jaw_angles_at_values(motion, values, angles)
        for part, share in inner:
            shifts = opening_shifts(part.vertices.astype(np.float64), jaw, reached) * share
            self._add_inner(OPEN_JAW, part, motion.values, shifts)
        for fap in (THRUST_JAW, SHIFT_JAW):
            self._add_sliding(fap, jaw, inner)

    def _add_sliding(self, fap: int, jaw: Jaw, inner: list[tuple[Part, Float64]]) -> None:
        """Add FAP 14 or 15, which slides the jaw. inner: parts in the mouth with shares (V, 1)."""
        moving = np.flatnonzero(jaw.sliding)
        pinned = self.marks.surface.mask(self.marks.vertices_of((*CHIN, *LIP_POINTS)))
        sliding = jaw.sliding[moving][:, None] * self.marks.step(fap)
        motion = eased_linear_motion(self.marks.surface, self.limiter, moving, sliding, fap, pinned)
        self._add_to_surface(fap, motion)
        chin = int(np.flatnonzero(motion.vertices == self.marks.vertex["2.1"])[0])
        for part, share in inner:
            self._add_inner(fap, part, motion.values, motion.shifts[:, chin, None] * share)

    def _add_inner(self, fap: int, part: Part, values: Float64, shifts: Float64) -> None:
        """Add the shifts (K, V, 3) of a part in the mouth to a FAP."""
        self.moves[fap][part.name] = Motion(values, np.arange(len(part.vertices)), shifts)

    def add_lid(self, fap: int, sculpted: Float64 | None = None) -> None:
        """Make the motion of a lid. sculpted: (N, 3) displacements of the surface that show how it moves."""
        eye = self.eyes[LIDS[fap][0]]
        motion = lid_motion(self.marks, self.limiter, eye, fap, self.parts, sculpted)
        if isinstance(motion, str):
            self.lost[fap] = motion
            return
        self._add_to_surface(fap, motion)
        for part in self.parts:
            if part.kind == "brow" and sculpted is not None:  # it can lie on skin that a drawn lid stretches
                self.moves[fap].pop(part.name, None)
            elif part.kind == "lash" and part.name in self.anchors:
                self.moves[fap][part.name] = lash_motion(self.marks, eye, fap, part, motion)

    def _add_eyeballs(self) -> None:
        for side, eye in self.eyes.items():
            if not eye.measured:
                reason = f"there is no {side} eyeball"
                self.lost |= dict.fromkeys((*EYE_FAPS[side], PUPIL_FAP[side]), reason)
                continue
            for fap in EYE_FAPS[side]:
                self.turns[fap] = eye_transforms(fap, eye)
            pupils = pupil_motions(self.marks, eye, PUPIL_FAP[side], self.parts)
            if pupils:
                self.moves[PUPIL_FAP[side]] = pupils
            else:
                self.lost[PUPIL_FAP[side]] = f"the {side} eyeball has no vertices within its pupil"

    def _add_tongue(self) -> None:
        tongues = [part for part in self.parts if part.kind == "tongue" and len(part.vertices)]
        for fap in TONGUE_FAPS:
            if not tongues:
                self.lost[fap] = "there is no tongue"
                continue
            for part in tongues:
                motion = tongue_motion(self.marks, part, fap)
                if isinstance(motion, str):
                    self.lost[fap] = motion
                else:
                    self.moves.setdefault(fap, {})[part.name] = motion

    def _add_head(self) -> None:
        centre = tuple(self.marks.point_or_average("7.1").tolist())
        for fap, axis in HEAD_AXES.items():
            self.turns[fap] = [FaceDefTransform(HEAD, "rotation", axis, centre)]


def jaw_angles_at_values(motion: Motion, values: Float64, angles: Float64) -> Float64:
    """Return (K,) angles of the jaw at the values of a motion that may have been stopped, radians."""
    result = np.interp(motion.values, values, angles)
    for k in range(1, len(result)):
        if np.array_equal(motion.shifts[k], motion.shifts[k - 1]):
            result[k] = result[k - 1]
    return result
