"""An actor with 50 markers: a face model moved by known FAPs and a moving head, sampled as cameras would.

The set is that of a study of emotional animation by markers (50 of them: forehead 7, brows 7, lids 2, nose 4,
ears 2, mouth 9, cheeks 5 and 5, chin 9), in names of our own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64
from fba.capture import MarkerMotion
from fba.capture.markers._faces import PATH
from fba.capture.markers._targets import TRAGIONS
from fba.capture.markers.marker_maps import marker_sets
from fba.face import Deformer, FaceModel
from fba.parameters import BAP_COUNT, point_rows
from fba.tracks import BodyTrack, FaceTrack
from tools.captures.performances import HEAD, head_motion, speech

BETWEEN = {
    "FHM": (("11.1", 0.5), ("9.12", 0.5)), "FHM2": (("11.1", 0.7), ("9.12", 0.3)),
    "FHL2": (("11.3", 0.5), ("4.3", 0.5)), "FHR2": (("11.2", 0.5), ("4.4", 0.5)),
    "BRC": (("4.1", 0.5), ("4.2", 0.5)),
    "CKL3": (("5.1", 0.5), ("5.3", 0.5)), "CKL4": (("5.3", 0.6), ("9.1", 0.4)),
    "CKL5": (("5.1", 0.6), ("10.7", 0.4)),
    "CKR3": (("5.2", 0.5), ("5.4", 0.5)), "CKR4": (("5.4", 0.6), ("9.2", 0.4)),
    "CKR5": (("5.2", 0.6), ("10.8", 0.4)),
    "CHL2": (("2.13", 0.6), ("2.11", 0.4)), "CHR2": (("2.14", 0.6), ("2.12", 0.4)),
    "CHC": (("2.10", 0.5), ("8.2", 0.5)),
    "CHL3": (("2.11", 0.5), ("8.7", 0.5)), "CHR3": (("2.12", 0.5), ("8.8", 0.5)),
}  # fmt: skip
"""Markers that nothing is measured from lie between feature points."""
NAMES = (
    "FHC", "FHL", "FHR", "FHM", "FHM2", "FHL2", "FHR2", "BRL1", "BRL2", "BRL3", "BRR1", "BRR2", "BRR3", "BRC",
    "LIDL", "LIDR", "NSB", "NST", "NSL", "NSR", "EAL", "EAR", "LPT", "LPL1", "LPR1", "LPB", "LPL2", "LPR2",
    "LCL", "LCR", "LPP", "CKL1", "CKL2", "CKL3", "CKL4", "CKL5", "CKR1", "CKR2", "CKR3", "CKR4", "CKR5",
    "CHN", "CHB", "CHL1", "CHR1", "CHL2", "CHR2", "CHC", "CHL3", "CHR3",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Take:
    """A capture whose truth is known. faps: float64 (T, 68). path: float64 (T, 3), of the spine's top."""

    motion: MarkerMotion
    faps: Float64
    path: Float64


def perform(model: FaceModel, frames: int = 600, rate: int = 100, seed: int = 1) -> Take:
    """Return a take of an actor with this face who talks, +x left, +y up, +z front, metres."""
    return record(model, speech(frames, rate, seed), rate, seed + 1)


def record(model: FaceModel, faps: Float64, rate: int = 100, seed: int = 2) -> Take:
    """Return the take of an actor with this face who does what FAPs (T, 68) say, while the head moves."""
    angles, path = head_motion(len(faps), rate, seed)
    faps = faps.copy()
    faps[:, HEAD] = angles / model.fapu.AU
    points = Deformer(model).feature_points(faps) + path[:, None]
    rows, places = point_rows(), marker_sets()["regions50"]
    positions = np.zeros((len(faps), len(NAMES), 3))
    for n, name in enumerate(NAMES):
        target = places[name.lower()]
        if target in rows:
            positions[:, n] = points[:, rows[target]]
        elif target:
            positions[:, n] = np.mean([points[:, rows[point]] for point in TRAGIONS[target]], axis=0)
        else:
            positions[:, n] = sum(points[:, rows[point]] * share for point, share in BETWEEN[name])
    times = np.arange(len(faps)) / rate
    return Take(MarkerMotion(NAMES, positions, times, Fraction(rate), "m", "+y", "talk"), faps, path)


def as_animation(take: Take) -> Animation:
    """Return the performance of a take: its FAPs, and the path of the head as BAPs 181 to 183."""
    face = as_face(take.faps, take.motion.rate)
    baps = np.zeros((len(face), BAP_COUNT), dtype=np.int32)
    sent = np.zeros(baps.shape, dtype=bool)
    for bap, axis in zip(PATH, (1, 0, 2), strict=True):
        baps[:, bap - 1], sent[:, bap - 1] = np.rint(1000 * take.path[:, axis]), True
    return replace(face, body=BodyTrack(baps, sent), name=take.motion.name)


def as_face(faps: Float64, rate: Fraction | int) -> Animation:
    """Return FAPs (T, 68) as an animation that sends those that are not always 0."""
    values = np.rint(faps).astype(np.int32)
    face = FaceTrack(values, np.broadcast_to((values != 0).any(axis=0), values.shape))
    return Animation(Fraction(rate), np.arange(len(values)), face)
