"""How far FAPs that come back from a capture are from those that were performed."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

import fba
from fba.animation import Animation
from fba.arrays import Float64
from fba.capture import MarkerMotion, from_action_units, from_blendshapes, to_blendshapes
from fba.capture.markers import find_face
from fba.capture.points import find_point_face
from fba.errors import FbaWarning
from fba.face import FaceModel
from fba.parameters import faps
from fba.tracks import FaceTrack
from tools.captures import damage, marker_files
from tools.captures.marked_actor import Take, record
from tools.captures.performances import HEAD, head_motion
from tools.captures.shaped_face import action_units_at
from tools.captures.tracked_actor import FAR, FOCAL, film

PER_CENT = 1024 / 100
"""Units of a FAP in a hundredth of its FAPU."""
DEGREE = np.radians(1.0) / 1e-5
"""Units of a FAP in a degree."""
NOISE = 0.3e-3
"""Metres by which good cameras are off."""
PICTURE = FOCAL / FAR
"""Widths of a picture in which a face is a metre wide."""
Errors = Mapping[int, float]
"""Root mean square error of each FAP that a capture shows: percent of its FAPU, or degrees."""


def root_mean_squares(found: Float64, truth: Float64, shown: tuple[int, ...]) -> Errors:
    """Return the error of each FAP in `shown`; found, truth: FAPs (T, 68)."""
    errors = np.sqrt(((found - truth) ** 2).mean(axis=0))
    unit = {fap.number: DEGREE if fap.unit == "AU" else PER_CENT for fap in faps()}
    return {fap: float(errors[fap - 1]) / unit[fap] for fap in shown}


def ways_to_spoil(motion: MarkerMotion) -> dict[str, MarkerMotion]:
    """Return a capture as it is, with noise, and as of a bad day: noise, a wandering cap, drop-outs."""
    noisy = damage.add_noise(motion, NOISE)
    bad = damage.drop(damage.slip(noisy, ("FHL", "FHM"), 2e-3), 0.05)
    return {"exact": motion, "0.3 mm": noisy, "bad day": bad}


def measure_markers(
    head: FaceModel, performed: Float64, model: FaceModel | None = None, rate: int = 100
) -> dict[str, Errors]:
    """Return the errors of 50 markers on a head that performs FAPs (T, 68), by way of spoiling the capture.

    model: the face whose tables tell FAPs apart; None for the built-in one.
    """
    take = record(head, performed, rate)
    return {way: measure_take(take, motion, model) for way, motion in ways_to_spoil(take.motion).items()}


def measure_take(take: Take, motion: MarkerMotion, model: FaceModel | None = None) -> Errors:
    """Return the errors of a capture of a take whose FAPs are known."""
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        face = find_face(motion, neutral="first", model=model)
    shown = [fap for fap in face.sent if fap not in _lip_mates(face.sent)]
    return root_mean_squares(face.faps, take.faps, tuple(shown))


WATCHED: Mapping[str, Mapping[str, Any]] = {
    "478 points": {"count": 478, "share": True},
    "68 points, flat": {"count": 68, "flat": True},
}
"""Trackers: MediaPipe's points with depth, in shares of a picture; iBUG's in pixels. Options of `film`."""
FILM = 4
"""Frames of the markers' cameras for one of a film."""


def measure_points(head: FaceModel, performed: Float64, rate: int) -> dict[str, Errors]:
    """Return the errors of points that trackers see on a head, by tracker: as they are, and 0.3 mm off."""
    result = {}
    for name, options in WATCHED.items():
        take = film(head, performed=performed[::FILM], rate=rate // FILM, **options)
        size = PICTURE if take.motion.share else PICTURE * 1280
        noise = np.random.default_rng(1).normal(0, NOISE * size, take.motion.positions.shape)
        for way, positions in (("exact", take.motion.positions), ("0.3 mm", take.motion.positions + noise)):
            motion = replace(take.motion, positions=positions, aspect=16 / 9)
            with warnings.catch_warnings(action="ignore", category=FbaWarning):
                face = find_point_face(motion, neutral="first")
            result[f"{name}, {way}"] = root_mean_squares(face.faps, take.faps, face.sent)
    return result


def measure_animation(found: Animation, truth: Animation) -> Errors:
    """Return the errors of an animation against another of the same rate, over the frames of both."""
    assert found.face is not None
    assert truth.face is not None
    count = min(len(found), len(truth))
    shown = tuple((np.flatnonzero(found.face.mask.any(axis=0)) + 1).tolist())
    return root_mean_squares(
        found.face.values[:count].astype(float), truth.face.values[:count].astype(float), shown
    )


def measure_marker_file(folder: Path, name: str, take: Take) -> tuple[Errors, float]:
    """Return the errors of a take that is written as one of `marker_files.MAKERS` and read, and their head's.

    The second is the root mean square error of the head's path, millimetres.
    """
    path = marker_files.write(folder, name, take.motion)
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        animation = fba.read(path, neutral="first")
    assert animation.face is not None
    assert animation.body is not None
    shown = tuple((np.flatnonzero(animation.face.mask[0]) + 1).tolist())
    shown = tuple(fap for fap in shown if fap not in _lip_mates(shown))
    moved = animation.body.values[:, [181, 180, 182]]  # left, up, front, from their BAPs
    off = float(np.sqrt(((moved - 1000 * take.path) ** 2).sum(axis=1).mean()))
    return root_mean_squares(animation.face.values.astype(float), take.faps, shown), off


def measure_shapes(performed: Float64, rate: int) -> dict[int, float | None]:
    """Return the errors of FAPs (T, 68) that become weights of ARKit's shapes and FAPs again, with turns of
    the head; None for those that come back, but are not performed."""
    performed = performed.copy()
    performed[:, HEAD] = head_motion(len(performed), rate)[0] / 1e-5
    track = FaceTrack(np.rint(performed).astype(np.int32), np.ones(performed.shape, dtype=bool))
    animation = Animation(Fraction(rate), np.arange(len(performed)), track)
    errors = measure_animation(from_blendshapes(to_blendshapes(animation)), animation)
    return {fap: error if performed[:, fap - 1].any() else None for fap, error in errors.items()}


def told_by_units() -> tuple[int, ...]:
    """Return the FAPs that OpenFace's action units, pose and gaze tell."""
    found = from_action_units(action_units_at(np.ones(1)))
    assert found.face is not None
    return tuple((np.flatnonzero(found.face.mask[0]) + 1).tolist())


def worst(errors: Errors, *, turns: bool) -> float:
    """Return the largest error of the FAPs that turn head and eyes, degrees, or of the others, % of FAPU."""
    angles = {fap.number for fap in faps() if fap.unit == "AU"}
    return max((error for fap, error in errors.items() if (fap in angles) == turns), default=0.0)


def _lip_mates(shown: tuple[int, ...]) -> set[int]:
    """Return FAPs of the inner lips that copy the outer lips."""
    return {fap.number for fap in faps() if fap.lip_mate in shown and fap.number < 20}
