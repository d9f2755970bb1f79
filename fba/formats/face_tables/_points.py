"""What readers of tracked points share: what the numbers are, and what becomes of them."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64
from fba.capture.points import PointMotion, from_points
from fba.errors import FbaWarning, FormatError, ModelError
from fba.limits import Limits
from fba.source import Path, naming_file

Neutral = str | int | tuple[float, float]
SHARES = 2.0
"""Coordinates up to this are shares of a picture: pixels of a face are more."""


def build_points(
    positions: Float64,
    times: Float64,
    rate: Fraction,
    *,
    path: Path,
    name: str,
    metric: bool = False,
    aspect: float | None = None,
    eyes: Float64 | None = None,
    findings: Sequence[str] = (),
) -> PointMotion:
    """Return points (T, N, 2 or 3) as a motion; whether they are shares of the picture is seen by their size.

    Points that are all 0, as trackers write where they see no face, are missing. Raises FormatError.
    """
    positions = positions.copy()
    positions[~(np.abs(np.nan_to_num(positions)) > 0).any(axis=(1, 2))] = np.nan
    if positions.shape[2] == 3 and not (np.abs(np.nan_to_num(positions[..., 2])) > 0).any():
        positions = positions[..., :2]  # a depth that is 0 everywhere is none
    plane = np.abs(positions[..., :2])
    share = not metric and bool(np.isfinite(plane).any()) and float(np.nanmedian(plane)) <= SHARES
    if share and float(np.nanmin(positions[..., :2])) < 0 and float(np.nanmedian(plane)) < 0.1:
        share = False  # a face of its own, around 0
    try:
        return PointMotion(
            positions, times, rate, metric=metric, share=share, aspect=aspect, eyes=eyes, name=name,
            findings=tuple(findings),
        )  # fmt: skip
    except ModelError as error:
        raise FormatError(error.finding, path=path) from error


def points_to_animation(
    motion: PointMotion,
    rate: Fraction | int | str | None,
    path: Path,
    limits: Limits,
    *,
    markers: Mapping[str, str] | None,
    neutral: Neutral,
    gaze: str,
    head_path: bool,
    aspect: float | None,
) -> Animation:
    """Return the FAPs of tracked points. Warns (FbaWarning) of what the reader found. Raises FormatError."""
    for finding in motion.findings:
        warnings.warn(f"{path}: {finding}", FbaWarning, stacklevel=4)
    with naming_file(path):
        return from_points(
            motion, rate, markers=markers, neutral=neutral, gaze=gaze, head_path=head_path, aspect=aspect,
            limits=limits,
        )  # fmt: skip
