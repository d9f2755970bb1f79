"""Points of common trackers (iBUG's 68, OpenPose's 70, MediaPipe's 468 and 478) as the 64 of a Persona."""

from __future__ import annotations

import numpy as np

from fba.arrays import Bool, Float64
from fba.capture import PointMotion
from fba.capture.points.picture import face_misfit, upright_points
from fba.capture.points.places import point_places, take_points
from fba.capture.points.poses import fit_poses
from fba.errors import ModelError, warn
from fba.face import neutral_points
from fba.parameters import point_rows
from fba.persona.points._tracked import TrackedFace
from fba.persona.points.layout import TRACKED, point_weights
from fba.rotations import axis_matrices

PUPILS = {"3.5": ("3.7", "3.11"), "3.6": ("3.12", "3.8")}
"""Corners of the eye halfway between which the pupil is assumed; 68 points have no pupils."""
RIGID = ("3.7", "3.8", "3.11", "3.12", "9.12", "9.15", "9.3", "9.1", "9.2")
"""Feature points that no muscle moves: they show the turn of the head."""
MAX_MEDIAN_ERROR = 0.02
"""Largest median distance of the points from those of a face, metres."""
CHECKED_FRAMES = 60
"""Approximate number of frames in which that is checked."""


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
