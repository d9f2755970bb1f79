"""What goes wrong in a studio: noise, slipping markers, drop-outs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fba.capture import MarkerMotion

LONGEST = 0.15
"""Seconds of the longest gap of a marker."""


def add_noise(motion: MarkerMotion, metres: float, seed: int = 1) -> MarkerMotion:
    """Return a capture whose coordinates are off, by a normal distribution of this standard deviation."""
    noise = np.random.default_rng(seed).normal(0, metres, motion.positions.shape)
    return replace(motion, positions=motion.positions + noise)


def slip(motion: MarkerMotion, names: tuple[str, ...], metres: float, seed: int = 2) -> MarkerMotion:
    """Return a capture in which some markers, such as those of a cap, wander to and fro by about so much."""
    random = np.random.default_rng(seed)
    positions = motion.positions.copy()
    for name in names:
        rate, phase = random.uniform(0.5, 2.0, 3), random.uniform(0, 2 * np.pi, 3)
        sway = np.sin(2 * np.pi * rate * motion.times[:, None] + phase)
        positions[:, motion.names.index(name)] += metres * sway
    return replace(motion, positions=positions)


def drop(motion: MarkerMotion, share: float, seed: int = 3) -> MarkerMotion:
    """Return a capture in which every marker is not seen for a share of the time, in gaps of up to 0.15 s.

    The first tenth of a second, the neutral face, is whole.
    """
    random = np.random.default_rng(seed)
    positions = motion.positions.copy()
    longest = max(2, int(LONGEST * float(motion.rate)))
    first = int(0.1 * float(motion.rate)) + 1
    gaps = max(1, round(share * len(motion) / (longest / 2)))
    for marker in range(len(motion.names)):
        for start in random.integers(first, max(first + 1, len(motion) - longest), gaps).tolist():
            positions[start : start + int(random.integers(1, longest)), marker] = np.nan
    return replace(motion, positions=positions)
