"""Eyeballs of a fitted face: still spheres, with an iris of the right size, under lids that still fit."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np

from fba.arrays import Bool, Float64, Floating
from fba.easing import smoothstep
from fba.errors import FbaWarning
from fba.face.calibration._field import between
from fba.face.eyeball import Eyeball

LID = 1.10
"""Vertices within so many radii of the eyeball's centre lie on it: lids, and the skin that lines them."""
REACH = 1.6
"""Beyond so many radii the skin knows nothing of the eyeball."""
SIZES = (0.75, 1.35)
"""How far an eyeball may grow or shrink against the face around it."""
WIDEST_IRIS = np.radians(42.0)
"""Half the angle that the widest iris takes of its eyeball."""
BARELY = 1.003
"""Radii from the centre at which a lid is just outside the eyeball."""
DEEP = 0.0005
"""Metres by which an eyeball may go back without a word."""
LEAST = 0.02
"""Points that belong to the eyeball by less do not count for it."""


@dataclass(frozen=True, eq=False)
class FittedEye:
    """Where an eyeball went. centre: (3,), radius: new; was: the eyeball before; iris, iris_was: angle
    between the gaze and the edge of the iris, radians."""

    was: Eyeball
    centre: Float64
    radius: float
    iris: float
    iris_was: float

    def __call__(self, vertices: Floating) -> Float64:
        """Vertices of the eyeball moved: turned nowhere, scaled, the iris widened along the sphere."""
        arms = np.asarray(vertices, dtype=np.float64) - self.was.centre
        distance = np.linalg.norm(arms, axis=1)
        unit = arms / np.maximum(distance, 1e-12)[:, None]
        angle = np.arccos(np.clip(unit[:, 2], -1.0, 1.0))
        inside = np.arcsin(np.clip(np.sin(angle) * np.sin(self.iris) / np.sin(self.iris_was), -1.0, 1.0))
        beyond = self.iris + (angle - self.iris_was) * (np.pi - self.iris) / (np.pi - self.iris_was)
        polar = np.where(angle <= self.iris_was, inside, beyond)
        across = np.hypot(unit[:, 0], unit[:, 1])
        around = unit[:, :2] / np.maximum(across, 1e-12)[:, None]
        moved = np.column_stack([around * np.sin(polar)[:, None], np.cos(polar)])
        scaled: Float64 = self.centre + moved * (distance * self.radius / self.was.radius)[:, None]
        return scaled

    @property
    def size(self) -> float:
        return self.radius / self.was.radius


def fit_eye(
    eye: Eyeball,
    skin: Float64,
    fitted: Float64,
    pupil: tuple[Float64, Float64],
    *,
    size: float,
    pupil_given: bool,
    iris: tuple[float, float],
    given: tuple[Float64, Float64],
) -> FittedEye:
    """The sphere that fits under the fitted lids as the old one under the old.

    skin, fitted: (V, 3) vertices before and after. pupil: its point before and after. size: of the
    fitted face around the eye by the old one. pupil_given: keep the pupil exactly where it is; the centre
    lies straight behind it. iris: its diameter before and after, metres. given: (K, 3) points of the
    lids before, and where they must be; if they get inside the eyeball it goes back, and an FbaWarning
    tells how far.
    """
    from scipy.optimize import least_squares

    distance = np.linalg.norm(skin - eye.centre, axis=1)
    lids = distance < LID * eye.radius
    clearance, places = distance[lids] / eye.radius, fitted[lids]
    depth = float(np.linalg.norm(pupil[0] - eye.centre)) / eye.radius
    front = pupil[1]

    def centre(values: Float64) -> Float64:
        return np.array([front[0], front[1], values[1]])

    def misfit(values: Float64) -> Float64:
        radius = values[0]
        away = np.linalg.norm(places - centre(values), axis=1) - clearance * radius
        usual = np.array([0.5 * (radius - size * eye.radius), 0.3 * (values[1] + depth * radius - front[2])])
        return np.concatenate([away / np.sqrt(max(len(away), 1)), usual])

    low, high = (bound * size * eye.radius for bound in SIZES)
    start = np.array([size * eye.radius, front[2] - depth * size * eye.radius])
    if pupil_given:
        found = least_squares(
            lambda one: misfit(np.array([one[0], front[2] - depth * one[0]])),
            start[:1],
            bounds=([low], [high]),
        )
        values = np.array([found.x[0], front[2] - depth * found.x[0]])
    else:
        far = 3 * high
        found = least_squares(misfit, start, bounds=([low, start[1] - far], [high, start[1] + far]))
        values = found.x
    radius = float(values[0])
    angles = [
        float(np.arcsin(min(across / 2 / ball, np.sin(WIDEST_IRIS))))
        for across, ball in ((iris[0], eye.radius), (iris[1], radius))
    ]
    clear = np.minimum(np.linalg.norm(given[0] - eye.centre, axis=1) / eye.radius, BARELY)
    values[1] -= _sunk(given[1], clear * radius, centre(values), eye.side)
    fitted_eye = FittedEye(eye, centre(values), radius, angles[1], angles[0])
    # The pupil's own vertex may stand a little off the axis.
    off = (front - fitted_eye(pupil[0][None])[0]) * (1.0, 1.0, 0.0)
    return replace(fitted_eye, centre=fitted_eye.centre + off)


def _sunk(given: Float64, least: Float64, centre: Float64, side: str) -> float:
    """How far an eyeball must go back for points (K, 3) to be at least so far from its centre: metres."""
    across = np.hypot(*(given - centre)[:, :2].T)
    room = np.sqrt(np.maximum(least**2 - across**2, 0.0))
    back = float(np.where(room > 0, centre[2] + room - given[:, 2], 0.0).max(initial=0.0))
    if back > DEEP:
        warnings.warn(
            f"the lids of the {side} eye lie {back * 1000:.1f} mm inside its eyeball: "
            "the eyeball and its pupil were put back",
            FbaWarning,
            stacklevel=6,
        )
    return back


def lids_on(eye: FittedEye, skin: Float64, fitted: Float64, sources: Float64, targets: Float64) -> Float64:
    """The skin around an eyeball laid on it as it lay before: (V, 3).

    As far above the sphere as it was, in proportion, near it; as fitted, further out. The given points
    (sources before, targets after) stay where they must be, and nothing but them is inside the eyeball
    that was outside.
    """
    moved = fitted.copy()
    near = np.linalg.norm(skin - eye.was.centre, axis=1) < REACH * eye.was.radius
    moved[near] = _laid(eye, skin[near], fitted[near])
    weight = weight_of(eye, sources)
    local = weight > LEAST
    if local.any():
        # What the given points still want after that, they get, with all that lies between them.
        left = (targets[local] - _laid(eye, sources[local], targets[local])) / weight[local, None]
        moved[near] += weight_of(eye, skin[near])[:, None] * between(sources[local], left)(skin[near])
    return _outside(eye, skin, moved, near, sources)


def _laid(eye: FittedEye, skin: Float64, fitted: Float64) -> Float64:
    distance = np.linalg.norm(skin - eye.was.centre, axis=1)
    arms = fitted - eye.centre
    length = np.maximum(np.linalg.norm(arms, axis=1), 1e-12)
    laid: Float64 = fitted + arms * (weight_of(eye, skin) * (distance * eye.size / length - 1))[:, None]
    return laid


def weight_of(eye: FittedEye, places: Float64) -> Float64:
    """How much a place belongs to the eyeball: 1 on it, 0 out of its reach."""
    distance = np.linalg.norm(places - eye.was.centre, axis=1)
    weight: Float64 = 1 - smoothstep((distance / eye.was.radius - LID) / (REACH - LID))
    return weight


def _outside(
    eye: FittedEye,
    skin: Float64,
    moved: Float64,
    near: Bool,
    sources: Float64,
) -> Float64:
    """What was outside the eyeball and has come inside, put back onto it; given points stay."""
    from scipy.spatial import cKDTree

    before = np.linalg.norm(skin - eye.was.centre, axis=1) / eye.was.radius
    arms = moved - eye.centre
    length = np.linalg.norm(arms, axis=1)
    least = np.where(before >= 1, np.minimum(before, 1.01), 0.0) * eye.radius
    given = np.isfinite(cKDTree(sources).query(skin, distance_upper_bound=1e-6)[0])
    sunk = near & (length < least) & ~given
    moved[sunk] = eye.centre + arms[sunk] * (least[sunk] / np.maximum(length[sunk], 1e-12))[:, None]
    return moved
