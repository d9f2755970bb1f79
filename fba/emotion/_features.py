"""What expressions are read from: means and differences of FAPs, such as how high the mouth's corners are."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from fba.arrays import Bool, Float64
from fba.parameters import FAP_COUNT, fap_numbers

LID_PER_GAZE = (0.0089, -0.0054)
"""By how much an upper and a lower lid follow the gaze, IRISD steps per 1e-5 rad of pitch."""


@dataclass(frozen=True, eq=False)
class Features:
    """The table of features.

    names: of each. weights: float64 (F, 68), of the FAPs. folded: bool (F,), whether the sign of a feature is
    dropped, as for differences between left and right. noise: float64 (F,), how much a face moves without
    expressing anything, speech apart. spread: float64 (F,), how much it moves altogether. speech: float64
    (F,), how much it moves in speech, beyond what visemes explain.
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
    with (files(__package__) / "features.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    weights = np.zeros((len(rows), FAP_COUNT))
    for number, row in enumerate(rows):
        pairs = [pair.partition("=") for pair in row["faps"].split()]
        for name, _, weight in pairs:
            weights[number, fap_numbers()[name] - 1] = float(weight)
    folded = np.array([row["kind"] == "difference" for row in rows])
    weights[~folded] /= np.abs(weights[~folded]).sum(axis=1, keepdims=True)
    return Features(
        tuple(row["feature"] for row in rows),
        weights,
        folded,
        np.array([float(row["noise"]) for row in rows]),
        np.array([float(row["spread"]) for row in rows]),
        np.array([float(row["speech"]) for row in rows]),
    )


def measure(faps: Float64, known: Bool) -> Float64:
    """Return the features of FAPs (..., 68): float64 (..., F). What lids do to follow the gaze is left out.

    Lids follow it in captures of blendshapes; from action units and in many streams they do not.

    known: bool (68,), the FAPs that say something; a mean is that of these. Where none is known it is 0.
    """
    table = features()
    values = np.where(known, faps, 0.0).astype(np.float64)
    for side in range(2):
        pitch = values[..., _PITCH + side]
        for lid, follows in zip((_UPPER, _LOWER), LID_PER_GAZE, strict=True):
            if known[lid + side]:
                gaze = follows * pitch
                lids = values[..., lid + side]
                values[..., lid + side] = lids - np.clip(lids, np.minimum(gaze, 0), np.maximum(gaze, 0))
    size = np.abs(table.weights)
    share = (size @ known) / size.sum(axis=1)
    weights = table.weights / np.where(table.folded | (share == 0), 1.0, share)[:, None]
    means = values @ weights.T
    result: Float64 = np.where(table.folded, np.abs(means), means)
    return result


def known_features(known: Bool) -> Bool:
    """Return which features follow from FAPs that are known, bool (68,): bool (F,).

    A mean needs one of its FAPs, a difference both.
    """
    table = features()
    used = table.weights != 0
    count = used.astype(np.int64) @ known.astype(np.int64)
    result: Bool = np.where(table.folded, count == used.sum(axis=1), count > 0)
    return result


_UPPER, _LOWER = 18, 20
_PITCH = 24
"""Columns of the left lids and of the left eyeball's pitch; the right ones follow."""
