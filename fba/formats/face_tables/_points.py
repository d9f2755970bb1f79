"""What readers of tracked points share: what the numbers are."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from fba.arrays import Float64
from fba.capture import PointMotion
from fba.errors import FormatError, ModelError
from fba.source import Path

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
