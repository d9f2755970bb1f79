"""Features for reading expressions: means and differences of FAPs, such as the height of the lip corners."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from fba.arrays import Bool, Float64
from fba.parameters import FAP_COUNT, fap_numbers
from fba.text_files import packaged_rows

UPPER_LID_PER_GAZE = 0.0089
"""Motion of an upper lid that follows the gaze, IRISD per 1e-5 rad of pitch."""
LOWER_LID_PER_GAZE = -0.0054


@dataclass(frozen=True, eq=False)
class Features:
    """The table of features.

    weights: float64 (F, 68), of the FAPs. folded: bool (F,), whether the absolute value is used, as for
    differences between left and right. noise, spread, speech: float64 (F,), standard deviation of a face that
    expresses nothing and is silent, of all faces, and of speech beyond the visemes.
    """

    names: tuple[str, ...]
    weights: Float64
    folded: Bool
    noise: Float64
    spread: Float64
    speech: Float64


@cache
def features() -> Features:
    """Return the table `features.csv`."""
    rows = packaged_rows(__package__, "features.csv")
    weights = np.zeros((len(rows), FAP_COUNT))
    for number, row in enumerate(rows):
        pairs = [pair.partition("=") for pair in row["faps"].split()]
        for name, _, weight in pairs:
            weights[number, fap_numbers()[name] - 1] = float(weight)
    folded = np.array([row["kind"] == "difference" for row in rows])
    weights[~folded] /= np.abs(weights[~folded]).sum(axis=1, keepdims=True)
    return Features(
        tuple(row["feature"] for row in rows), weights, folded,
        *(np.array([float(row[name]) for row in rows]) for name in ("noise", "spread", "speech")),
    )  # fmt: skip


def measure(faps: Float64, known: Bool) -> Float64:
    """Return the features of FAPs (..., 68): float64 (..., F), less the motion of lids that follow the gaze.

    Lids follow the gaze in captures of blendshapes, but not in action units and many streams.

    known: bool (68,), the FAPs that are sent. A mean is taken over these; without any it is 0.
    """
    table = features()
    values = np.where(known, faps, 0.0).astype(np.float64)
    for side in range(2):
        pitch = values[..., _PITCH + side]
        for lid, per_gaze in ((_UPPER, UPPER_LID_PER_GAZE), (_LOWER, LOWER_LID_PER_GAZE)):
            if known[lid + side]:
                gaze = per_gaze * pitch
                lids = values[..., lid + side]
                values[..., lid + side] = lids - np.clip(lids, np.minimum(gaze, 0), np.maximum(gaze, 0))
    size = np.abs(table.weights)
    share = (size @ known) / size.sum(axis=1)
    weights = table.weights / np.where(table.folded | (share == 0), 1.0, share)[:, None]
    means = values @ weights.T
    result: Float64 = np.where(table.folded, np.abs(means), means)
    return result


def known_features(known: Bool) -> Bool:
    """Return which features follow from known FAPs, bool (68,): bool (F,). A difference needs both FAPs."""
    table = features()
    used = table.weights != 0
    count = used.astype(np.int64) @ known.astype(np.int64)
    result: Bool = np.where(table.folded, count == used.sum(axis=1), count > 0)
    return result


# Columns of the left lids and of the left eyeball's pitch; the right column follows each.
_UPPER = 18
_LOWER = 20
_PITCH = 24
