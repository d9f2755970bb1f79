"""Density of hair on the head: scalp and brows."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import numpy.typing as npt
from sculpt import smooth

Float64 = npt.NDArray[np.float64]

AXIS = -0.085
"""z of the vertical axis about which the hairline is given."""
CROWN = np.array([0.004, 0.104, -0.118])
THICKNESS = 0.0035
BROW = np.array([
    # along the left brow: x, y, how far it reaches down and up (mm)
    (12.5, 14.5, 3.4, 3.2), (18, 17.6, 4.0, 3.6), (26, 20.8, 3.9, 3.4), (35, 23.0, 3.2, 3.0),
    (44, 22.6, 2.4, 2.4), (52, 19.0, 1.6, 1.7), (59, 13.6, 0.7, 0.8),
]) / 1000  # fmt: skip


def scalp(places: Float64, soft: float = 0.004) -> Float64:
    """(N,) density of hair at points (N, 3): 0 on the face, 1 on the scalp.

    soft: width of the edge, metres.
    """
    from scipy.interpolate import PchipInterpolator

    with (Path(__file__).parent / "hairline.csv").open(encoding="utf-8") as file:
        line = np.array([[float(row["degrees"]), float(row["y"]) / 1000] for row in csv.DictReader(file)])
    around = np.degrees(np.arctan2(np.abs(places[:, 0]), places[:, 2] - AXIS))
    height = PchipInterpolator(line[:, 0], line[:, 1])
    slope = height.derivative()(around) * 180 / np.pi / 0.08
    above = (places[:, 1] - height(around)) / np.sqrt(1 + slope**2)
    ear = (np.abs(places[:, 0]) > 0.0765) & (places[:, 1] < 0.006)
    ear &= (places[:, 2] > -0.122) & (places[:, 2] < -0.100)
    return np.where(ear, 0.0, smooth(above / soft + 0.5))


def brow(places: Float64) -> tuple[Float64, Float64]:
    """(position along the brow (N,): 0 inner, 1 outer end; density of its hair (N,), 0..1)."""
    x = np.abs(places[:, 0])
    middle, low, high = (np.interp(x, BROW[:, 0], BROW[:, column]) for column in (1, 2, 3))
    offset = places[:, 1] - middle
    reach = np.where(offset < 0, low, high)
    across = 1 - smooth((np.abs(offset) / reach - 0.35) / 0.75)
    along = (x - BROW[0, 0]) / (BROW[-1, 0] - BROW[0, 0])
    ends = smooth((along + 0.03) / 0.14) * (1 - smooth((along - 0.90) / 0.12))
    front = places[:, 2] > -0.03
    return along, np.where(front, across * ends, 0.0)
