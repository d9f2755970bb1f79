"""Fits eyeballs: they stay spheres, get an iris of the right size, and lids stay in contact."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fba.arrays import Bool, Float64, Floating
from fba.errors import warn
from fba.face.calibration._field import linear_field
from fba.face.eyeball import Eyeball
from fba.sampling import smoothstep

LID_RADII = 1.10
"""Skin within this many radii of the eyeball's centre is on it: the lids and their lining."""
REACH = 1.6
"""Beyond this many radii the eyeball has no influence on the skin."""
SIZE_LIMITS = (0.75, 1.35)
"""Limits of an eyeball's size relative to the face around it."""
WIDEST_IRIS = np.radians(42.0)
"""Largest angle at the eyeball's centre between gaze and edge of the iris."""
JUST_OUTSIDE_RADII = 1.003
"""Radii from the centre at which a lid is just outside the eyeball."""
MAX_SILENT_SETBACK = 0.0005
"""Metres by which an eyeball may be set back without a warning."""
MIN_WEIGHT = 0.02
"""Weight (`eyeball_weight`) up to which points are ignored for the eyeball."""


@dataclass(frozen=True, eq=False)
class FittedEye:
    """An eyeball after fitting; calling it with vertices (N, 3) of the old one gives the new ones.

    centre: (3,) and radius: metres, after. was: the eyeball before. iris, iris_was: angle between the gaze
    and the edge of the iris, after and before, radians.
    """

    was: Eyeball
    centre: Float64
    radius: float
    iris: float
    iris_was: float

    def __call__(self, vertices: Floating) -> Float64:
        """Return the vertices (N, 3) of the old eyeball moved and scaled, the iris widened on the sphere."""
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
        return np.asarray(self.centre + moved * (distance * self.radius / self.was.radius)[:, None])

    @property
    def size(self) -> float:
        return self.radius / self.was.radius


def fit_eye(
    eye: Eyeball,
    skin: tuple[Float64, Float64],
    pupil: tuple[Float64, Float64],
    *,
    size: float,
    pupil_given: bool,
    iris: tuple[float, float],
    given: tuple[Float64, Float64],
) -> FittedEye:
    """Return the eyeball that fits under the fitted lids as the old one does under the old lids.

    skin: (V, 3) vertices before and after. pupil: its point before and after. size: of the fitted
    face around the eye relative to the old one. pupil_given: keep the pupil exactly in place, with the
    centre straight behind it. iris: its diameter before and after, metres. given: (K, 3) points of the lids
    before, and their targets; if these are inside the eyeball it is set back, and an FbaWarning says how
    far.
    """
    from scipy.optimize import least_squares

    distance = np.linalg.norm(skin[0] - eye.centre, axis=1)
    lids = distance < LID_RADII * eye.radius
    clearance, lid_vertices = distance[lids] / eye.radius, skin[1][lids]
    depth = float(np.linalg.norm(pupil[0] - eye.centre)) / eye.radius
    front = pupil[1]

    def centre(values: Float64) -> Float64:
        return np.array([front[0], front[1], values[1]])

    def misfit(values: Float64) -> Float64:
        radius = values[0]
        away = np.linalg.norm(lid_vertices - centre(values), axis=1) - clearance * radius
        usual = np.array([0.5 * (radius - size * eye.radius), 0.3 * (values[1] + depth * radius - front[2])])
        return np.concatenate([away / np.sqrt(max(len(away), 1)), usual])

    low, high = (bound * size * eye.radius for bound in SIZE_LIMITS)
    start = np.array([size * eye.radius, front[2] - depth * size * eye.radius])
    if pupil_given:
        best = least_squares(
            lambda one: misfit(np.array([one[0], front[2] - depth * one[0]])),
            start[:1],
            bounds=([low], [high]),
        )
        values = np.array([best.x[0], front[2] - depth * best.x[0]])
    else:
        far = 3 * high
        best = least_squares(misfit, start, bounds=([low, start[1] - far], [high, start[1] + far]))
        values = best.x
    radius = float(values[0])
    angles = [
        float(np.arcsin(min(across / 2 / ball, np.sin(WIDEST_IRIS))))
        for across, ball in ((iris[0], eye.radius), (iris[1], radius))
    ]
    clear = np.minimum(np.linalg.norm(given[0] - eye.centre, axis=1) / eye.radius, JUST_OUTSIDE_RADII)
    values[1] -= _setback(given[1], clear * radius, centre(values), eye.side)
    fitted_eye = FittedEye(eye, centre(values), radius, angles[1], angles[0])
    # The pupil's own vertex may be a little off the axis.
    off = (front - fitted_eye(pupil[0][None])[0]) * (1.0, 1.0, 0.0)
    return replace(fitted_eye, centre=fitted_eye.centre + off)


def _setback(given: Float64, least: Float64, centre: Float64, side: str) -> float:
    """Return the metres to set an eyeball back so that points (K, 3) are at least (K,) from its centre."""
    across = np.hypot(*(given - centre)[:, :2].T)
    room = np.sqrt(np.maximum(least**2 - across**2, 0.0))
    back = float(np.where(room > 0, centre[2] + room - given[:, 2], 0.0).max(initial=0.0))
    if back > MAX_SILENT_SETBACK:
        warn(
            f"the lids of the {side} eye lie {back * 1000:.1f} mm inside its eyeball: "
            "the eyeball and its pupil were set back",
            stacklevel=6,
        )
    return back


def lay_lids_on(
    eye: FittedEye, skin: Float64, fitted: Float64, sources: Float64, targets: Float64
) -> Float64:
    """Return (V, 3) the fitted skin, laid on an eyeball as the old skin was on the old one.

    Near the sphere it keeps its distance from it, in proportion; further out it stays as fitted. The given
    points (sources before, targets after) reach their targets, and no other vertex that was outside the
    eyeball ends up inside it.
    """
    moved = fitted.copy()
    near = np.linalg.norm(skin - eye.was.centre, axis=1) < REACH * eye.was.radius
    moved[near] = _lay_on(eye, skin[near], fitted[near])
    weight = eyeball_weight(eye, sources)
    local = weight > MIN_WEIGHT
    if local.any():
        # Errors that are left at the given points are interpolated over the skin between them.
        left = (targets[local] - _lay_on(eye, sources[local], targets[local])) / weight[local, None]
        moved[near] += eyeball_weight(eye, skin[near])[:, None] * linear_field(sources[local], left)(
            skin[near]
        )
    return _push_outside(eye, skin, moved, near, sources)


def _lay_on(eye: FittedEye, skin: Float64, fitted: Float64) -> Float64:
    distance = np.linalg.norm(skin - eye.was.centre, axis=1)
    arms = fitted - eye.centre
    length = np.maximum(np.linalg.norm(arms, axis=1), 1e-12)
    return np.asarray(
        fitted + arms * (eyeball_weight(eye, skin) * (distance * eye.size / length - 1))[:, None]
    )


def eyeball_weight(eye: FittedEye, points: Float64) -> Float64:
    """Return (N,) influence of the eyeball on points (N, 3): 1 on it, 0 beyond `REACH`."""
    distance = np.linalg.norm(points - eye.was.centre, axis=1)
    return 1 - smoothstep((distance / eye.was.radius - LID_RADII) / (REACH - LID_RADII))


def _push_outside(eye: FittedEye, skin: Float64, moved: Float64, near: Bool, sources: Float64) -> Float64:
    """Return `moved` (V, 3), with vertices inside the eyeball pushed out onto it, in place; sources stay."""
    from scipy.spatial import cKDTree

    before = np.linalg.norm(skin - eye.was.centre, axis=1) / eye.was.radius
    arms = moved - eye.centre
    length = np.linalg.norm(arms, axis=1)
    least = np.where(before >= 1, np.minimum(before, 1.01), 0.0) * eye.radius
    given = np.isfinite(cKDTree(sources).query(skin, distance_upper_bound=1e-6)[0])
    sunk = near & (length < least) & ~given
    moved[sunk] = eye.centre + arms[sunk] * (least[sunk] / np.maximum(length[sunk], 1e-12))[:, None]
    return moved
