"""An actor with 50 markers: a face model moved by known FAPs and a moving head, sampled as cameras would.

The set is that of a study of emotional animation by markers (50 of them: forehead 7, brows 7, lids 2, nose 4,
ears 2, mouth 9, cheeks 5 and 5, chin 9), in names of our own.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fba.capture.markers.marker_maps import marker_sets
from fba.capture.markers.motion import MarkerMotion
from fba.capture.markers.targets import target_points
from fba.face import Deformer, FaceModel
from fba.face.feature_points import row_of

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
AMPLITUDES = {
    3: 500, 14: 120, 15: 60, 16: 150, 17: 150, 18: 120, 19: 900, 20: 900, 31: 200, 32: 200, 33: 200, 34: 200,
    35: 200, 36: 200, 37: 80, 38: 80, 39: 60, 40: 60, 41: 120, 42: 120, 51: 200, 52: 300, 53: 120, 54: 120,
    55: 200, 56: 200, 57: 300, 58: 300, 59: 200, 60: 200, 61: 40, 62: 40, 63: 60, 64: 40,
}  # fmt: skip
"""FAPs that the actor performs, and how far."""
ONE_WAY = (3, 14, 19, 20, 41, 42)
INNER = {51: 4, 52: 5, 53: 6, 54: 7, 55: 8, 56: 9, 57: 10, 58: 11, 59: 12, 60: 13}
"""FAPs of the inner lips, which do as the outer ones."""


@dataclass(frozen=True, eq=False)
class Take:
    """A capture whose truth is known. faps: float64 (T, 68). path: float64 (T, 3), of the spine's top."""

    motion: MarkerMotion
    faps: np.ndarray
    path: np.ndarray


def speech(frames: int, rate: float, seed: int = 1) -> np.ndarray:
    """FAPs of a face that talks, frowns, smiles and blinks, from rest: float64 (T, 68)."""
    random = np.random.default_rng(seed)
    times = np.arange(frames) / rate
    start = np.clip((times - 0.3) / 0.3, 0, 1)
    start = start * start * (3 - 2 * start)
    values = np.zeros((frames, 68))
    for fap, amplitude in AMPLITUDES.items():
        curve = sum(
            np.sin(2 * np.pi * (random.uniform(0.2, 2.5) * times + random.uniform())) for _ in range(3)
        ) / 2.0  # fmt: skip
        if fap in (19, 20):
            curve = np.maximum(0.0, np.sin(2 * np.pi * (0.4 * times + 0.3))) ** 24
        elif fap in ONE_WAY:
            curve = np.maximum(curve, 0.0)
        values[:, fap - 1] = amplitude * curve * start
    for outer, inner in INNER.items():
        values[:, inner - 1] = values[:, outer - 1]
    return values


def head_motion(frames: int, rate: float, seed: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Pitch, yaw, roll, radians (T, 3), and the path of the spine's top, metres (T, 3), from rest."""
    random = np.random.default_rng(seed)
    times = np.arange(frames) / rate
    start = np.clip((times - 0.3) / 0.5, 0, 1)[:, None]
    waves = np.stack([
        sum(np.sin(2 * np.pi * (random.uniform(0.1, 0.9) * times + random.uniform())) for _ in range(2)) / 2
        for _ in range(6)
    ], axis=1) * start  # fmt: skip
    return waves[:, :3] * (0.25, 0.45, 0.15), waves[:, 3:] * (0.05, 0.02, 0.04)


def perform(model: FaceModel, frames: int = 600, rate: int = 100, seed: int = 1) -> Take:
    """The take of an actor with this face, +x left, +y up, +z front, metres."""
    faps = speech(frames, rate, seed)
    angles, path = head_motion(frames, rate, seed + 1)
    faps[:, 47:50] = angles / 1e-5
    deformer = Deformer(model)
    points = deformer.feature_points(faps) + path[:, None]
    rows, places = row_of(), marker_sets()["regions50"]
    positions = np.zeros((frames, len(NAMES), 3))
    for n, name in enumerate(NAMES):
        target = places[name.lower()]
        if target:
            positions[:, n] = np.stack([target_points(p)[target] for p in points])
        else:
            positions[:, n] = sum(points[:, rows[point]] * share for point, share in BETWEEN[name])
    motion = MarkerMotion(NAMES, positions, np.arange(frames) / rate, Fraction(rate), "m", "+y", "talk")
    return Take(motion, faps, path)
