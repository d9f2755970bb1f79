"""Points of trackers that are known, iBUG's 68, OpenPose's 70, MediaPipe's 468 and 478, as the 64 of a
Persona."""

from __future__ import annotations

import warnings

import numpy as np

from fba.arrays import Bool, Float64
from fba.capture import PointMotion
from fba.capture.points.picture import face_misfit, upright_points
from fba.capture.points.places import point_places, take_points
from fba.capture.points.poses import fit_poses
from fba.errors import FbaWarning, ModelError
from fba.face import neutral_points
from fba.face.feature_points import row_of
from fba.persona.points._tracked import TrackedFace
from fba.persona.points.layout import TRACKED, point_weights
from fba.rotations import axis_matrices

PUPILS = {"3.5": ("3.7", "3.11"), "3.6": ("3.12", "3.8")}
"""Pupils, which 68 points do not have, are taken to be between these corners of the eye."""
RIGID = ("3.7", "3.8", "3.11", "3.12", "9.12", "9.15", "9.3", "9.1", "9.2")
"""Places that tell how a head is turned."""
MISFIT = 0.02
"""Metres by which half of the points are off a known face at most."""
SAMPLES = 60
"""Frames, about, that tell whether points are those of a face."""


def from_point_motion(motion: PointMotion, *, aspect: float | None = None) -> TrackedFace:
    """Return what a tracker of 68, 70, 468 or 478 points saw, as 64 points, head angles and a flag a frame.

    aspect: of the picture, width / height, for points that are shares of it; None for the motion's own, or
    what makes the points a face. Depth is not used. Angles are found from points that no muscle moves, and
    count from a head that looks into the camera. Raises ModelError where no frame shows a face, or points
    are not those of one. Warns of points that are mirrored or upside down, and of an aspect that is
    guessed.
    """
    places = point_places(motion.count)
    names = tuple(name for name, place in places.items() if place in row_of())
    whole: Bool = np.asarray(np.isfinite(take_points(motion.positions, names)).all(axis=(1, 2)))
    if not whole.any():
        raise ModelError(f"no face is seen whole in any of the {len(motion)} frames")
    known = {places[name]: n for n, name in enumerate(names)}
    template = neutral_points()[[row_of()[place] for place in known]]
    taken = take_points(motion.positions, names)[whole, :, :2]
    upright = upright_points(taken, names, places, template, motion.share, aspect or motion.aspect)
    few = upright[:: max(1, len(upright) // SAMPLES)]
    off = face_misfit(few, template)
    if off > MISFIT:
        raise ModelError(
            f"the points do not lie as those of a face: they are {1000 * off:.0f} mm off; are they another "
            "tracker's, or in another order?"
        )
    features = np.zeros((len(upright), len(row_of()), 2))
    for place, column in known.items():
        features[:, row_of()[place]] = upright[:, column]
    for pupil, corners in PUPILS.items():
        if pupil not in known:
            features[:, row_of()[pupil]] = upright[:, [known[one] for one in corners]].mean(axis=1)
    _check_needed(set(known) | set(PUPILS))
    points = np.full((len(motion), TRACKED, 2), np.nan)
    points[whole] = (point_weights()[:TRACKED] @ features) * (1.0, -1.0)
    angles = np.full((len(motion), 3), np.nan)
    rigid = [known[place] for place in RIGID if place in known]
    angles[whole] = head_angles(template[rigid], upright[:, rigid])
    if not whole.all():
        warnings.warn(
            f"{len(motion) - len(upright)} of {len(motion)} frames have no whole face",
            FbaWarning,
            stacklevel=2,
        )
    return TrackedFace(points, angles, whole, motion.times, motion.rate, motion.name)


def _check_needed(known: set[str]) -> None:
    """Raise ModelError where the points of a mask are made of places that a tracker does not have."""
    used = np.abs(point_weights()[:TRACKED]).sum(axis=0) > 0
    missing = [name for name, row in row_of().items() if used[row] and name not in known]
    if missing:
        raise ModelError(f"the tracker's points lack places of the mask: {', '.join(missing)}")


def head_angles(shape: Float64, points: Float64) -> Float64:
    """Return pitch, yaw and roll, radians (T, 3), of a head whose rigid points (K, 3) are seen at (T, K, 2).

    points: x to the right, y up. FAPs 48 to 50 count angles so: down, to the head's left, to its right.
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
