"""Joint limits: the ranges of normal human motion, to report or clamp excesses. Off by default.

The standard sets no limits to joints. `JointLimits.human()` is the table of typical limits in K. Karpouzis,
Adaptive parametric models of human faces and bodies, table 4-1: there X is the subject's left, Z the long
axis of the segment and Y = Z x X, so that a hanging limb flexes about -X, abducts about Y, forward, and
twists about Z, down. limits.csv has it in BAPs, for the left side; `JointLimits.iso()` are the ranges of the
standard's BAP table.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64, Int32
from fba.parameters import BAP_COUNT, BAP_STANDARD_COUNT, bap_numbers, baps
from fba.text_files import packaged_rows

DEGREES = np.degrees(1e-5)
"""Degrees in one unit of a rotational BAP."""
FULL_TURN = 360.0


@dataclass(frozen=True)
class JointLimit:
    """The range of one motion of a segment. baps: 0-based columns whose sum lies in low..high, degrees."""

    segment: str
    motion: str
    baps: tuple[int, ...]
    low: float
    high: float

    @property
    def name(self) -> str:
        """Segment and motion, in words."""
        return f"{self.segment} {self.motion}"


@dataclass(frozen=True)
class Excess:
    """A motion beyond a limit: the number of frames, the first of them, and the largest excess in degrees."""

    limit: JointLimit
    frames: int
    first: int
    worst: float

    def __str__(self) -> str:
        low, high = self.limit.low, self.limit.high
        return (
            f"{self.limit.name}: beyond {low:g}..{high:g} degrees in {self.frames} frames, "
            f"by {self.worst:.1f} at worst, first in frame {self.first}"
        )


class JointLimits:
    """A set of limits. limits: its rows; a BAP in none of them is unlimited."""

    def __init__(self, limits: tuple[JointLimit, ...]) -> None:
        self.limits = limits

    @staticmethod
    def human() -> JointLimits:
        """Return limits of normal human motion, by segment; some are limits of the sum over vertebrae."""
        return JointLimits(_human())

    @staticmethod
    def iso() -> JointLimits:
        """Return the ranges of the standard's BAP table at its own quantiser steps, joint by joint."""
        return JointLimits(_iso())

    def check(self, values: npt.ArrayLike) -> tuple[Excess, ...]:
        """Return the limits that BAPs (T, 296) or (296,), 1e-5 rad, exceed; empty if they exceed none.

        Whole turns are ignored. Raises ValueError for other shapes or values that are not finite.
        """
        array = _frames(values)
        excesses = []
        for limit in self.limits:
            _, excess = _excess(limit, array)
            out = np.abs(excess) > DEGREES * len(limit.baps)  # less is rounding
            if out.any():
                worst = float(np.abs(excess).max())
                excesses.append(Excess(limit, int(out.sum()), int(np.argmax(out)), worst))
        return tuple(excesses)

    def clamp(self, values: npt.ArrayLike) -> Int32:
        """Return the BAPs clamped to the limits, int32; those that share a limit are scaled by one factor.

        Values within a limit do not change. Raises ValueError as `check`.
        """
        array = _frames(values)
        result = np.rint(array).astype(np.int32)
        for limit in self.limits:
            total, excess = _excess(limit, array)
            out = np.abs(excess) > DEGREES * len(limit.baps)
            if not out.any():
                continue
            wanted = (total - excess)[out]
            columns = list(limit.baps)
            if len(columns) == 1:
                result[out, columns[0]] = np.rint(wanted / DEGREES)
            else:
                share = wanted / total[out]
                result[np.ix_(out, columns)] = np.rint(array[np.ix_(out, columns)] * share[:, None])
        return result if np.ndim(values) == 2 else result[0]


@cache
def widest_limits() -> Float64:
    """Return float64 (296, 2), degrees: the range that human limits or the standard allow each BAP by itself.

    Body turn, roll and tilt, which are unlimited for a person, get half a turn either way (roll a quarter).
    """
    result = np.zeros((BAP_COUNT, 2))
    for limit in (*_iso(), *_human()):
        for column in limit.baps:
            low, high = result[column]
            result[column] = min(low, limit.low), max(high, limit.high)
    for name, most in (("turn", 180.0), ("roll", 90.0), ("tilt", 180.0)):
        result[bap_numbers()[f"HumanoidRoot_rt_body_{name}"] - 1] = -most, most
    result.flags.writeable = False
    return result


def _frames(values: npt.ArrayLike) -> Float64:
    array = np.atleast_2d(np.asarray(values, dtype=np.float64))
    if array.ndim != 2 or array.shape[1] not in (BAP_STANDARD_COUNT, BAP_COUNT):
        raise ValueError(f"JointLimits: needs BAPs of shape (T, {BAP_COUNT}), not {np.shape(values)}")
    if not np.isfinite(array).all():
        raise ValueError("JointLimits: BAPs must be finite")
    return array


def _excess(limit: JointLimit, array: Float64) -> tuple[Float64, Float64]:
    """Return totals (T,) in degrees, shifted by whole turns to the range if possible, and excess (T,)."""
    total = array[:, list(limit.baps)].sum(axis=1) * DEGREES
    if len(limit.baps) == 1:
        total = total - FULL_TURN * np.rint((total - (limit.low + limit.high) / 2) / FULL_TURN)
    return total, total - np.clip(total, limit.low, limit.high)


@cache
def _human() -> tuple[JointLimit, ...]:
    numbers = bap_numbers()
    result = []
    for row in packaged_rows(__package__, "limits.csv"):
        low, high = float(row["low"]), float(row["high"])
        for side, word in (("l", "left "), ("r", "right ")) if row["right_side"] else (("", ""),):
            names = row["baps"].replace("?", side).split()
            flipped = side == "r" and row["right_side"] == "mirrored"
            result.append(
                JointLimit(
                    word + row["segment"],
                    row["motion"],
                    tuple(numbers[name] - 1 for name in names),
                    -high if flipped else low,
                    -low if flipped else high,
                )
            )
    return tuple(result)


@cache
def _iso() -> tuple[JointLimit, ...]:
    return tuple(
        JointLimit(
            bap.joint,
            bap.freedom,
            (bap.number - 1,),
            bap.i_limits[0] * bap.step_iso * DEGREES,
            bap.i_limits[1] * bap.step_iso * DEGREES,
        )
        for bap in baps()
        if bap.i_limits is not None and bap.unit == "1e-5 rad"
    )
