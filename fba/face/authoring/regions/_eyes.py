"""Eyeballs: FAPs 23-30. Whole eyeballs turn and slide; pupils are moved on their surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.face._tables import FaceDefTransform
from fba.face.authoring.surface._fold_limits import Limiter
from fba.face.authoring.surface._motion import Motion, fap_limits
from fba.face.authoring.surface._motion_limits import stop_at_folds
from fba.face.authoring.surface.landmarks import Landmarks
from fba.face.eyeball import fit_eyeball, flat_width
from fba.face.model import Part
from fba.face.points import EYEBALL_PER_IRIS

PUPIL_OF_IRIS = 1 / 3
"""Diameter of the pupil relative to the iris on a neutral face."""
PUPIL_RIM = (0.4, 1.5)
"""An eyeball without vertices this far from its axis, in radii of the pupil, has no pupil to move."""
MIN_PUPIL = 0.3
"""Radius below which the pupil does not shrink, as a share of its neutral radius."""
MAX_PUPIL = 0.9
"""Radius above which the pupil does not grow, as a share of that of the iris."""

YAW = ("rotation", (0.0, 1.0, 0.0))
PITCH = ("rotation", (1.0, 0.0, 0.0))
THRUST = ("translation", (0.0, 0.0, 1.0))
TRANSFORMS = {23: YAW, 24: YAW, 25: PITCH, 26: PITCH, 27: THRUST, 28: THRUST}
"""Kind and amount per unit of the transforms of an eyeball, by FAP."""


@dataclass(frozen=True, eq=False)
class Eye:
    """One eye of a face.

    side: "left" or "right". parts: names of all parts that turn with it. centre: (3,). radius: metres.
    pupil: (3,) position. measured: whether there is an eyeball, else the sphere is a guess from the points.
    flat: whether it is a drawn iris without a ball.
    """

    side: str
    parts: tuple[str, ...]
    centre: Float64
    radius: float
    pupil: Float64
    measured: bool
    flat: bool = False

    @property
    def gaze(self) -> Float64:
        """Unit vector (3,) from the eye's centre to its pupil."""
        arm = self.pupil - self.centre
        return arm / np.linalg.norm(arm)


def find_eyes(marks: Landmarks, parts: Sequence[Part]) -> dict[str, Eye]:
    """Return both eyes; without an eyeball, the sphere that lids need is estimated from the points."""
    iris = marks.fapu.IRISD * 1024
    pupils = {side: marks.point_or_average(name) for side, name in (("left", "3.5"), ("right", "3.6"))}
    middle = float((pupils["left"][0] + pupils["right"][0]) / 2)
    eyes = {}
    for side, pupil in pupils.items():
        own = [
            part
            for part in parts
            if part.kind == "eye" and len(part.vertices) and (_middle(part)[0] > middle) == (side == "left")
        ]
        spheres = [fit for part in own if (fit := fit_eyeball(part, pupil)) is not None]
        flat = any(flat_width(part) is not None for part in own)
        radius = EYEBALL_PER_IRIS * iris
        if spheres:
            centre, radius = max(spheres, key=lambda fit: fit[1])[:2]
        else:
            centre = pupil - (0.0, 0.0, radius)
        eyes[side] = Eye(side, tuple(part.name for part in own), centre, radius, pupil, bool(spheres), flat)
    return eyes


def _middle(part: Part) -> Float64:
    return np.asarray((part.vertices.min(axis=0) + part.vertices.max(axis=0)).astype(np.float64) / 2)


def eye_transforms(fap: int, eye: Eye) -> list[FaceDefTransform]:
    """Return the rotations (FAPs 23-26) or translations (27, 28) of an eye's parts for one FAP."""
    centre = tuple(eye.centre.tolist())
    kind, amount = TRANSFORMS[fap]
    return [FaceDefTransform(name, kind, amount, centre) for name in eye.parts]


def pupil_motions(marks: Landmarks, eye: Eye, fap: int, parts: Sequence[Part]) -> dict[str, Motion]:
    """Return the motions by part that move the pupil's rim along the eyeball and compress the iris."""
    unit = marks.fapu.IRISD
    iris = unit * 1024 / 2
    pupil = iris * PUPIL_OF_IRIS
    low, high = fap_limits(fap)
    smallest, largest = MIN_PUPIL * pupil, MAX_PUPIL * iris
    # the diameter grows by value x IRISD
    bends = np.array([(smallest - pupil) * 2 / unit, (largest - pupil) * 2 / unit])
    values = np.unique(np.round(np.clip([low, bends[0], 0, bends[1], high], low, high)))
    radii = np.clip(pupil + values * unit / 2, smallest, largest)
    motions = {}
    for part in parts:
        if part.name not in eye.parts:
            continue
        points = part.vertices.astype(np.float64)
        along = (points - eye.centre) @ eye.gaze
        across = points - eye.centre - along[:, None] * eye.gaze
        distance = np.linalg.norm(across, axis=1)
        moving = np.flatnonzero((distance < iris) & (along > 0) & (distance > 1e-9))
        rim = distance[moving] / pupil
        if not ((rim > PUPIL_RIM[0]) & (rim < PUPIL_RIM[1])).any():
            continue
        outward = across[moving] / distance[moving, None]
        before = distance[moving]
        after = np.array([np.interp(before, [0, pupil, iris], [0, radius, iris]) for radius in radii])
        sunk = _depth(distance, along, after) - _depth(distance, along, before[None])
        shifts = (after - before)[:, :, None] * outward + sunk[:, :, None] * eye.gaze
        shifts[values == 0] = 0.0
        limiter = Limiter.from_mesh(points, part.triangles.astype(np.intp))
        motions[part.name] = stop_at_folds(limiter, Motion(values, moving, shifts))
    return motions


def _depth(distance: Float64, along: Float64, wanted: Float64) -> Float64:
    """Return the depth along the gaze of an eye's surface at wanted distances from its axis, metres."""
    front = along > 0
    order = np.argsort(distance[front], kind="stable")
    near, deep = distance[front][order], along[front][order]
    bins = np.linspace(0, max(float(wanted.max(initial=0.0)) * 1.2, 1e-9), 13)
    which = np.digitize(near, bins)
    used = [k for k in range(1, len(bins)) if (which == k).any()]
    if len(used) < 2:
        return np.zeros_like(wanted)
    distances = [float(near[which == k].mean()) for k in used]
    depths = [float(deep[which == k].max()) for k in used]
    return np.interp(wanted, distances, depths)
