"""Where hair begins: a line round the head, from `hairline.csv`."""

from __future__ import annotations

import csv
from collections.abc import Callable
from functools import cache
from importlib.resources import files

import numpy as np
import numpy.typing as npt

Float64 = npt.NDArray[np.float64]

HAIR_AXIS = -0.085
"""z of the vertical axis about which the hairline is given."""
HEAD_RADIUS = 0.08
"""About how far the hairline is from that axis, metres."""


@cache
def _hairline() -> Float64:
    with (files(__package__) / "hairline.csv").open(encoding="utf-8") as file:
        return np.array([[float(row["degrees"]), float(row["y"])] for row in csv.DictReader(file)])


def hairline(around: Float64) -> tuple[Float64, Float64]:
    """Height of the hairline (m) at degrees from the front about `HAIR_AXIS`, and how steep it is.

    Heights above the line divided by the steepness are distances from it.
    """
    from scipy.interpolate import PchipInterpolator

    line = PchipInterpolator(_hairline()[:, 0], _hairline()[:, 1] / 1000)
    slope = line.derivative()(around) / np.radians(HEAD_RADIUS)
    return line(around), np.sqrt(1 + slope**2)


def hairline_places(onto_skin: Callable[[Float64], Float64], above: float) -> Float64:
    """(N, 3) places on the left half of the skin, this far (m) above the hairline.

    onto_skin: moves places (N, 3) onto the skin.
    """
    around = np.concatenate([np.arange(0, 84, 1.7), np.arange(84, 166, 3.0)])
    height, steepness = hairline(around)
    height = height + above * steepness
    turn = np.radians(around)
    away = np.full(len(around), HEAD_RADIUS)
    for _ in range(30):  # to where the skin has this height in this direction
        flat = np.stack([np.sin(turn) * away, height, np.cos(turn) * away + HAIR_AXIS], axis=1)
        places = onto_skin(flat)
        away = away * 0.3 + 0.7 * np.hypot(places[:, 0], places[:, 2] - HAIR_AXIS)
    return places
