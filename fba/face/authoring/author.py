"""Makes a face model with tables for every FAP from a head mesh and its 84 feature points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool, Float64
from fba.errors import ModelError
from fba.face.authoring.regions.brows_cheeks_nose import brow_cheek_nose_motions
from fba.face.authoring.regions.ears import ear_motions
from fba.face.authoring.regions.eye_opening import LIDS
from fba.face.authoring.regions.eyes import Eye, eye_transforms, find_eyes, pupil_motions
from fba.face.authoring.regions.jaw import (
    CHIN,
    Jaw,
    find_jaw,
    jaw_share_of_part,
    opening_angles,
    opening_shifts,
)
from fba.face.authoring.regions.lashes import lash_motion
from fba.face.authoring.regions.lids import lid_motion
from fba.face.authoring.regions.lips import HANDLES, lip_motions
from fba.face.authoring.regions.tongue import FAPS as TONGUE_FAPS
from fba.face.authoring.regions.tongue import tongue_motion
from fba.face.authoring.surface.attached_parts import LARGEST, NEAR, Anchors
from fba.face.authoring.surface.binding import Binding, bind_points, face_size, separate_lips
from fba.face.authoring.surface.fold_limits import Limiter
from fba.face.authoring.surface.landmarks import Landmarks, landmarks, surface_of
from fba.face.authoring.surface.motion import Motion, build_tables, split_by_part
from fba.face.authoring.surface.motion_limits import eased_linear_motion, stop_at_folds
from fba.face.authoring.surface.unfold import unfold
from fba.face.expressions import Definitions
from fba.face.feature_points import names
from fba.face.model import FaceModel, Part
from fba.face.points import DIRECTIONS, OPEN_JAW, SHIFT_JAW, THRUST_JAW
from fba.face.tables import HEAD, FaceDefTransform
from fba.parameters import FIRST_LOW_LEVEL_FAP, faps

if TYPE_CHECKING:
    from fba.face.interpolation.table import InterpolationTable


MOST_VERTICES = 250_000
"""Denser meshes are refused: they show no more, and would take minutes and gigabytes."""
EYE_FAPS = {"left": (23, 25, 27), "right": (24, 26, 28)}
PUPIL_FAPS = {"left": 29, "right": 30}
HEAD_AXES = {48: (1.0, 0.0, 0.0), 49: (0.0, 1.0, 0.0), 50: (0.0, 0.0, 1.0)}
JAW_FAPS = (OPEN_JAW, THRUST_JAW, SHIFT_JAW)
LIP_CONTOURS = ("upper inner lip", "lower inner lip", "upper outer lip", "lower outer lip")
LIP_POINTS = tuple(name for pair in HANDLES.values() for name in pair)
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
    """A face whose tables are made from the shape of the mesh alone.

    parts: the skin, and where there are such: eyeballs (one part each), teeth, tongue, the inside of
    the mouth, brows, lashes, hair; upright, looking along +z, metres. points: (84, 3), rows as
    `feature_point_names()`, NaN where unknown; they are moved onto their vertices. bound: (84,) the
    vertices they stand on, counted through the parts, -1 for the nearest. definitions, fit, notes, name:
    as in `FaceModel`.

    FAPs for which a point or part is missing are in the model's `lost`, with the reason. Raises
    ModelError where there is no skin, a FAPU is not positive, most points are far from the mesh, or it
    has more than a quarter of a million vertices.
    """
    parts = tuple(parts)
    places = np.array(points, dtype=np.float64)
    if places.shape != (len(names()), 3):
        raise ModelError(f"feature points must have shape ({len(names())}, 3), not {places.shape}")
    if np.isinf(places).any():
        raise ModelError(f"feature point {names()[int(np.argwhere(np.isinf(places))[0, 0])]} is infinite")
    places[np.isnan(places).any(axis=1)] = np.nan
    _check_size(parts)
    binding = bind_points(parts, places, bound)
    surface, pool = surface_of(parts, binding.points, binding.bound)
    if bound is None:
        binding = separate_lips(surface, parts, places, binding, face_size(places))
    marks = landmarks(surface, binding.points, binding.bound, pool)
    work = _Authoring(parts, marks, binding)
    work.run()
    return FaceModel(
        parts=parts,
        points=binding.points,
        bound=binding.bound,
        tables=tuple(
            build_tables(
                fap, marks.fapu[faps()[fap - 1].unit], work.moves.get(fap, {}), work.turns.get(fap, ())
            )
            for fap in sorted({*work.moves, *work.turns})
        ),
        fit=fit,
        definitions=definitions or Definitions.default(),
        name=name,
        lost=work.lost,
        notes=dict(notes or {}),
    )


def _check_size(parts: tuple[Part, ...]) -> None:
    if not any(part.kind == "skin" and len(part.triangles) for part in parts):
        raise ModelError("a face needs a part of kind 'skin' with triangles; there are " + _kinds(parts))
    total = sum(len(part.vertices) for part in parts)
    if total > MOST_VERTICES:
        raise ModelError(
            f"the mesh has {total} vertices, but at most {MOST_VERTICES} can be authored: "
            "cut it down to the head, or decimate it"
        )


def _kinds(parts: tuple[Part, ...]) -> str:
    return (
        ", ".join(f"{part.name!r} ({part.kind}, {len(part.triangles)} triangles)" for part in parts) or "none"
    )


class _Authoring:
    """State while the tables of one face are made."""

    def __init__(self, parts: tuple[Part, ...], marks: Landmarks, binding: Binding) -> None:
        self.parts = parts
        self.marks = marks
        self.binding = binding
        self.limiter = Limiter(marks.surface.vertices, marks.surface.triangles)
        self.moves: dict[int, dict[str, Motion]] = {}
        self.turns: dict[int, list[FaceDefTransform]] = {}
        self.lost: dict[int, str] = {}
        self.eyes: dict[str, Eye] = find_eyes(marks, parts)
        self.anchors = self._anchors()

    def run(self) -> None:
        self._jaw()
        for make in (lip_motions, brow_cheek_nose_motions, ear_motions):
            motions, lost = make(self.marks, self.limiter)
            for fap, motion in motions.items():
                self._surface(fap, motion)
            self.lost |= lost
        self._lids()
        self._eyeballs()
        self._tongue()
        self._head()
        for fap in range(FIRST_LOW_LEVEL_FAP, len(faps()) + 1):
            if fap not in self.moves and fap not in self.turns and fap not in self.lost:
                self.lost[fap] = "nothing of this mesh moves with it"
        for fap, reason in self.lost.items():
            point = next((p for p in faps()[fap - 1].feature_points if p in self.binding.far), None)
            if point:
                self.lost[fap] = (
                    f"feature point {point} is {self.binding.far[point] * 1000:.0f} mm away from the mesh"
                    f" ({reason})"
                )

    def _surface(self, fap: int, motion: Motion) -> None:
        """Add a motion of the surface, and of the parts attached to it, to a FAP."""
        moves = split_by_part(self.marks.surface, motion)
        for name, anchors in self.anchors.items():
            moves[name] = anchors.carry(motion)
        self.moves[fap] = {**self.moves.get(fap, {}), **moves}

    def _anchors(self) -> dict[str, Anchors]:
        found = {}
        es = self.marks.fapu.ES * 1024
        for part in self.parts:
            if part.kind not in CARRIED_KINDS or not len(part.triangles):
                continue
            if part.kind == "other" and np.ptp(part.vertices, axis=0).max() > LARGEST * es:
                continue
            anchors = Anchors(self.marks.surface, part)
            if np.median(anchors.distance) < NEAR * es:
                found[part.name] = anchors
        return found

    def _jaw(self) -> None:
        found = find_jaw(self.marks)
        if isinstance(found, str):
            self.lost |= dict.fromkeys(JAW_FAPS, found)
            return
        values, angles = opening_angles(found, self.marks.fapu.MNS)
        shares = {
            part.name: jaw_share_of_part(self.marks, part, found.hinge)
            for part in self.parts
            if part.kind in ("teeth", "tongue")
        }
        points = self.marks.surface.vertices
        moving = np.flatnonzero(found.share)
        shifts = opening_shifts(points[moving], found, angles) * found.share[moving][:, None]
        unlimited = Motion(values, moving, shifts)
        motion = unfold(self.marks.surface, self.limiter, unlimited, self._pinned(), True)
        motion = stop_at_folds(self.limiter, motion, turning=True)
        self._surface(OPEN_JAW, motion)
        # teeth and tongue stop where the skin stops
        reached = jaw_angles_at_values(motion, values, angles)
        for part in self.parts:
            if part.name in shares:
                inner = opening_shifts(part.vertices.astype(np.float64), found, reached)
                inner *= shares[part.name][:, None]
                self.moves[OPEN_JAW][part.name] = Motion(motion.values, np.arange(len(part.vertices)), inner)
        for fap in (THRUST_JAW, SHIFT_JAW):
            self._slide(fap, found, shares)

    def _pinned(self) -> Bool:
        """(N,) mask of vertices that follow the jaw exactly."""
        pinned = self.marks.on_contours(*LIP_CONTOURS)
        pinned[[self.marks.vertex[name] for name in CHIN if self.marks.has(name)]] = True
        return pinned

    def _slide(self, fap: int, found: Jaw, shares: dict[str, Float64]) -> None:
        entry = faps()[fap - 1]
        step = np.array(DIRECTIONS[entry.positive]) * self.marks.fapu[entry.unit]
        moving = np.flatnonzero(found.sliding)
        pinned = np.zeros(len(self.marks.surface), dtype=bool)
        pinned[[self.marks.vertex[name] for name in (*CHIN, *LIP_POINTS) if self.marks.has(name)]] = True
        field = found.sliding[moving][:, None] * step
        motion = eased_linear_motion(self.marks.surface, self.limiter, moving, field, fap, pinned)
        self._surface(fap, motion)
        chin = int(np.flatnonzero(motion.vertices == self.marks.vertex["2.1"])[0])
        ways = motion.shifts[:, chin]
        for part in self.parts:
            if part.name in shares:
                inner = ways[:, None] * shares[part.name][:, None]
                self.moves[fap][part.name] = Motion(motion.values, np.arange(len(part.vertices)), inner)

    def _lids(self) -> None:
        for fap, (side, _) in LIDS.items():
            motion = lid_motion(self.marks, self.limiter, self.eyes[side], fap, self.parts)
            if isinstance(motion, str):
                self.lost[fap] = motion
                continue
            self._surface(fap, motion)
            for part in self.parts:
                if part.kind == "lash" and part.name in self.anchors:
                    self.moves[fap][part.name] = lash_motion(self.marks, self.eyes[side], fap, part, motion)

    def _eyeballs(self) -> None:
        for side, eye in self.eyes.items():
            if not eye.measured:
                reason = f"there is no {side} eyeball"
                self.lost |= dict.fromkeys((*EYE_FAPS[side], PUPIL_FAPS[side]), reason)
                continue
            for fap in EYE_FAPS[side]:
                self.turns[fap] = eye_transforms(fap, eye)
            pupils = pupil_motions(self.marks, eye, PUPIL_FAPS[side], self.parts)
            if pupils:
                self.moves[PUPIL_FAPS[side]] = pupils
            else:
                self.lost[PUPIL_FAPS[side]] = f"the {side} eyeball has no vertices about its pupil"

    def _tongue(self) -> None:
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

    def _head(self) -> None:
        centre = tuple(self.marks.point_or_average("7.1").tolist())
        for fap, axis in HEAD_AXES.items():
            self.turns[fap] = [FaceDefTransform(HEAD, "rotation", axis, centre)]


def jaw_angles_at_values(motion: Motion, values: Float64, angles: Float64) -> Float64:
    """(K,) angles of the jaw at the values of a motion that may have been stopped, radians."""
    result = np.interp(motion.values, values, angles)
    for k in range(1, len(result)):
        if np.array_equal(motion.shifts[k], motion.shifts[k - 1]):
            result[k] = result[k - 1]
    return result
