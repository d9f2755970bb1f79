"""`TrackedFace`: the points that a tracker followed in a film of a face.

They come from points of common trackers (iBUG's 68, OpenPose's 70, MediaPipe's 468 and 478), and are
registered on the standard mask: same size, upright, facing ahead.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fba import geometry
from fba.arrays import Bool, Float64
from fba.capture import PointMotion
from fba.capture.points.picture import face_misfit, fit_poses, upright_points
from fba.capture.points.places import point_places, take_points
from fba.errors import ModelError, warn
from fba.face import neutral_points
from fba.parameters import point_rows
from fba.persona.points.layout import REGISTERED, TRACKED, point_weights, standard_points
from fba.rotations import axis_matrices

PUPILS = {"3.5": ("3.7", "3.11"), "3.6": ("3.12", "3.8")}
"""Corners of the eye halfway between which the pupil is assumed; 68 points have no pupils."""
RIGID = ("3.7", "3.8", "3.11", "3.12", "9.12", "9.15", "9.3", "9.1", "9.2")
"""Feature points that no muscle moves: they show the turn of the head."""
MAX_MEDIAN_ERROR = 0.02
"""Largest median distance of the points from those of a face, metres."""
CHECKED_FRAMES = 60
"""Approximate number of frames in which that is checked."""
MAX_TURN = float(np.radians(30.0))
"""Largest angle between head and camera, about x or y, radians."""
MAX_MISFIT = 0.25
"""Misfit of the six points above which they are not those of a face."""
MAX_COORDINATE = 1e7
"""Largest coordinate, in pixels or any other unit."""


@dataclass(frozen=True, eq=False)
class TrackedFace:
    """64 points of a face in each picture of a film, and the turn of its head.

    points: float64 (T, 64, 2), in any unit, x to the right in the picture, y down; in the order of
    `fba.persona.points.layout`. angles: float64 (T, 3), radians, of the head about x (alpha, down), y (beta,
    to its left) and z (gamma, to its right), as FAPs 48 to 50 count them. tracked: bool (T,), whether the
    tracker saw the face; False for frames with numbers that are not finite. times: float64 (T,), seconds,
    increasing. rate: nominal frames per second. name: of the performance.

    Arrays are read-only copies. Raises ModelError if the parts contradict each other.
    """

    points: Float64
    angles: Float64
    tracked: Bool
    times: Float64
    rate: Fraction
    name: str = ""

    def __post_init__(self) -> None:
        points = np.array(self.points, dtype=np.float64)
        angles, times = np.array(self.angles, dtype=np.float64), np.array(self.times, dtype=np.float64)
        tracked = np.array(self.tracked, dtype=bool)
        count = len(points)
        if points.ndim != 3 or points.shape[1:] != (TRACKED, 2):
            raise ModelError(f"TrackedFace: points must have shape (T, {TRACKED}, 2), not {points.shape}")
        if angles.shape != (count, 3) or tracked.shape != (count,) or times.shape != (count,):
            raise ModelError(
                f"TrackedFace: {count} frames of points, but angles {angles.shape}, tracked {tracked.shape} "
                f"and times {times.shape}"
            )
        if count and not (np.isfinite(times).all() and (np.diff(times) > 0).all()):
            raise ModelError("TrackedFace: times must be finite, and each later than the one before")
        object.__setattr__(self, "rate", Fraction(self.rate))
        if self.rate <= 0:
            raise ModelError(f"TrackedFace: the rate must be positive, not {self.rate}")
        if (np.abs(points) > MAX_COORDINATE).any():
            frame, point, axis = np.argwhere(np.abs(points) > MAX_COORDINATE)[0].tolist()
            raise ModelError(f"frame {frame}: point {point + 1} is at {points[frame, point, axis]:g}")
        tracked &= np.isfinite(points).all(axis=(1, 2)) & np.isfinite(angles).all(axis=1)
        points[~tracked], angles[~tracked] = np.nan, np.nan
        for name, array in (("points", points), ("angles", angles), ("tracked", tracked), ("times", times)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.times)


@dataclass(frozen=True, eq=False)
class Registered:
    """Points of a film on the standard mask.

    points: float64 (T, 64, 2), millimetres, the face's left and up; NaN where a frame is left out. kept:
    bool (T,). turned: bool (T,), frames left out because the head is turned too far. alien: bool (T,), frames
    left out because the points are not arranged as in a face.
    """

    points: Float64
    kept: Bool
    turned: Bool
    alien: Bool


def fit_face_points(points: Float64, targets: Float64, *, mirror: bool = True) -> geometry.FittedSimilarity:
    """Return the similarity that brings points (..., N, Q) closest to targets (..., N, P), P >= Q.

    mirror: whether the rotation may be a reflection. Raises ModelError where all points coincide.

    The source (equations 3.12 to 3.14) misprints factor and misfit; with X'Y = U S V', the rotation of rows
    is U V', the scale tr(S) / tr(X'X), and the misfit 1 - tr(S)^2 / (tr(X'X) tr(Y'Y)).
    """
    fit = geometry.fit_similarity(points, targets, reflected=None if mirror else False)
    if not np.isfinite(fit.misfit).all():
        raise ModelError("points that all coincide cannot be laid on a face")
    return fit


def register(face: TrackedFace) -> Registered:
    """Return the points of a film on the standard mask (equation 4.9 of the source).

    The mask is turned about y as the head is. The six points of `REGISTERED` are fitted to it; then all
    points are turned back, with the depth of the turned mask. Frames are left out where the head is turned by
    more than `MAX_TURN` about x or y, or where the points are not those of a face.
    """
    tracked = face.tracked
    turned = tracked & (np.abs(np.nan_to_num(face.angles[:, :2])) > MAX_TURN).any(axis=1)
    kept = tracked & ~turned
    points = np.full(face.points.shape, np.nan)
    alien = np.zeros(len(face), dtype=bool)
    if kept.any():
        points[kept], misfit = register_points(face.points[kept], face.angles[kept, 1])
        alien[kept] = misfit > MAX_MISFIT
        points[alien] = np.nan
    return Registered(points, kept & ~alien, turned, alien)


def register_points(points: Float64, yaw: Float64) -> tuple[Float64, Float64]:
    """Return points (T, 64, 2) of pictures on the standard mask, and the misfit (T,) of the six.

    yaw: (T,), turn of the head to its left, radians.
    """
    turn = axis_matrices(1, yaw)
    standard = standard_points()[:TRACKED] @ np.swapaxes(turn, 1, 2)  # (T, 64, 3)
    rows = [number - 1 for number in REGISTERED]
    upright = points * (1.0, -1.0)  # from a picture's axes, y down, to the mask's, y up
    similarity = fit_face_points(upright[:, rows], standard[:, rows, :2], mirror=False)
    laid = similarity.apply(upright)
    deep = standard[:, :, 2]
    # the first row of the inverse turn: x of the face seen from the front
    cosine, sine = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    ahead = np.stack([cosine * laid[..., 0] - sine * deep, laid[..., 1]], axis=2)
    return ahead, similarity.misfit


def from_point_motion(motion: PointMotion, *, aspect: float | None = None) -> TrackedFace:
    """Return the 64 points and head angles for a tracker's 68, 70, 468 or 478 points.

    aspect: width / height of the picture, for points in shares of it; by default the motion's, or the aspect
    with which the points are most like a face. Depth is not used. Angles are computed from points that no
    muscle moves; they are 0 for a head that looks into the camera. Raises ModelError where no frame shows a
    face, or the points are not those of a face. Warns where points are mirrored or upside down, and where the
    aspect is guessed.
    """
    places = point_places(motion.count)
    names = tuple(name for name, place in places.items() if place in point_rows())
    whole: Bool = np.asarray(np.isfinite(take_points(motion.positions, names)).all(axis=(1, 2)))
    if not whole.any():
        raise ModelError(f"none of the {len(motion)} frames shows a whole face")
    column_of = {places[name]: n for n, name in enumerate(names)}
    template = neutral_points()[[point_rows()[place] for place in column_of]]
    taken = take_points(motion.positions, names)[whole, :, :2]
    upright = upright_points(taken, names, places, template, motion.share, aspect or motion.aspect)
    error = face_misfit(upright[:: max(1, len(upright) // CHECKED_FRAMES)], template)
    if error > MAX_MEDIAN_ERROR:
        raise ModelError(
            f"the points are not arranged as in a face: half of them are {1000 * error:.0f} mm off or more; "
            "are they another tracker's, or in another order?"
        )
    features = np.zeros((len(upright), len(point_rows()), 2))
    for place, column in column_of.items():
        features[:, point_rows()[place]] = upright[:, column]
    for pupil, corners in PUPILS.items():
        if pupil not in column_of:
            features[:, point_rows()[pupil]] = upright[:, [column_of[name] for name in corners]].mean(axis=1)
    _check_needed(set(column_of) | set(PUPILS))
    points = np.full((len(motion), TRACKED, 2), np.nan)
    points[whole] = (point_weights()[:TRACKED] @ features) * (1.0, -1.0)
    angles = np.full((len(motion), 3), np.nan)
    rigid = [column_of[place] for place in RIGID if place in column_of]
    angles[whole] = head_angles(template[rigid], upright[:, rigid])
    if not whole.all():
        warn(f"{len(motion) - len(upright)} of {len(motion)} frames have no whole face", stacklevel=2)
    return TrackedFace(points, angles, whole, motion.times, motion.rate, motion.name)


def _check_needed(tracked: set[str]) -> None:
    """Raise ModelError where the mask needs feature points that a tracker lacks."""
    used = np.abs(point_weights()[:TRACKED]).sum(axis=0) > 0
    missing = [name for name, row in point_rows().items() if used[row] and name not in tracked]
    if missing:
        raise ModelError(f"the tracker's points lack feature points of the mask: {', '.join(missing)}")


def head_angles(shape: Float64, points: Float64) -> Float64:
    """Return pitch (down), yaw (left) and roll (right) of a head, (T, 3), radians, as FAPs 48 to 50.

    shape: its rigid points (K, 3). points: their positions (T, K, 2) in the picture, x to the right, y up.
    """
    rotation = fit_poses(shape, points).rotation
    # rotation = yaw . roll . pitch, the order of `fba.face.points`
    roll = np.arcsin(np.clip(rotation[:, 1, 0], -1.0, 1.0))
    pitch = np.arctan2(-rotation[:, 1, 2], rotation[:, 1, 1])
    yaw = np.arctan2(-rotation[:, 2, 0], rotation[:, 0, 0])
    return np.stack([pitch, yaw, roll], axis=1)


def head_matrices(angles: Float64) -> Float64:
    """Return rotations (T, 3, 3) of heads for pitch, yaw and roll (T, 3), radians."""
    pitch, yaw, roll = angles.T
    return np.asarray(axis_matrices(1, yaw) @ axis_matrices(2, roll) @ axis_matrices(0, pitch))
