"""What readers of tracked points share: what the numbers are, and what becomes of them."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64
from fba.capture.points import PointMotion, from_points
from fba.choices import Gaze
from fba.errors import FbaWarning, FormatError, ModelError
from fba.limits import Limits
from fba.source import Path, naming_file

Neutral = str | int | tuple[float, float]
FLATTEST = 0.08
"""Least ratio of a face's depth to its width, or the other way round, whatever the shape of the picture."""
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

    Points that are all in one place, as the zeros that trackers write where they see no face, are missing.
    Raises FormatError.
    """
    positions = positions.copy()
    spread = np.ptp(np.nan_to_num(positions[..., :2]), axis=1)
    positions[(spread == 0).any(axis=1)] = np.nan
    if positions.shape[2] == 3 and not (np.abs(np.nan_to_num(positions[..., 2])) > 0).any():
        positions = positions[..., :2]  # a depth that is 0 everywhere carries nothing
    findings = list(findings)
    if not metric and positions.shape[2] == 3 and not _is_deep(positions):
        positions = positions[..., :2]
        findings.append("depth is in another unit than x and y, and left out")
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


def _is_deep(positions: Float64) -> bool:
    """Whether z of points (T, N, 3) goes about as far as x and y do, as a face's depth in one unit does."""
    seen = positions[~np.isnan(positions).any(axis=(1, 2))]
    if not len(seen):
        return True
    across, up, deep = np.median(seen.std(axis=1), axis=0).tolist()
    return bool(FLATTEST < deep / max(across, up, 1e-300) < 1 / FLATTEST)


def points_to_animation(
    motion: PointMotion,
    rate: Fraction | int | str | None,
    path: Path,
    limits: Limits,
    *,
    markers: Mapping[str, str] | None,
    neutral: Neutral,
    gaze: Gaze,
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
