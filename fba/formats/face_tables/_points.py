"""What readers of tracked points share: the meaning of the numbers."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from fba.arrays import Float64
from fba.capture import PointMotion
from fba.source import Path, naming_file, stem_of

MIN_DEPTH = 0.08
"""Smallest ratio of a face's depth to its width, and of its width to its depth."""
MAX_SHARE = 2.0
"""Largest median coordinate of shares of a picture; pixels of a face are more."""


def build_points(
    positions: Float64,
    times: Float64,
    rate: Fraction,
    *,
    path: Path,
    metric: bool = False,
    aspect: float | None = None,
    findings: Sequence[str] = (),
) -> PointMotion:
    """Return points (T, N, 2 or 3) as a motion. Their size tells whether they are shares of the picture.

    A frame whose points are all in one place has no face: trackers write zeros there. Raises FormatError.
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
    share = not metric and bool(np.isfinite(plane).any()) and float(np.nanmedian(plane)) <= MAX_SHARE
    if share and float(np.nanmin(positions[..., :2])) < 0 and float(np.nanmedian(plane)) < 0.1:
        share = False  # a face centred at 0
    with naming_file(path):
        return PointMotion(
            positions, times, rate, metric=metric, share=share, aspect=aspect, name=stem_of(path),
            findings=tuple(findings),
        )  # fmt: skip


def _is_deep(positions: Float64) -> bool:
    """Whether z of points (T, N, 3) varies about as much as x and y, as the depth of a face does."""
    seen = positions[~np.isnan(positions).any(axis=(1, 2))]
    if not len(seen):
        return True
    across, up, deep = np.median(seen.std(axis=1), axis=0).tolist()
    return bool(MIN_DEPTH < deep / max(across, up, 1e-300) < 1 / MIN_DEPTH)
