"""Values that no plane can carry: what `fba encode` does about them, and what it says."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fba.animation import Animation
from fba.errors import FbaWarning
from fba.parameters import BapTable, bap_numbers, bap_steps, baps
from fba.tracks import BodyTrack

if TYPE_CHECKING:
    from fba.codec import ClampedParameter

MOST_LINES = 6
MOST_STEPS = 1860
"""Quantiser steps that an I plane carries."""


def bring_near(animation: Animation, table: BapTable, quant: int) -> Animation:
    """Return a capture, moved to begin at the default place if no first plane carries where it begins.

    Warns (FbaWarning) that it was moved. table, quant: of the BAPs.
    """
    if animation.body is None:
        return animation
    numbers = bap_numbers()
    columns = [numbers[f"HumanoidRoot_tr_{way}"] - 1 for way in ("lateral", "frontal")]
    begin = animation.body.values[0, columns]
    most = (bap_steps(table)[columns] if quant else np.ones(2, dtype=np.int64)) * MOST_STEPS
    if (np.abs(begin) <= most).all():
        return animation
    values = animation.body.values.copy()
    values[:, columns] -= begin
    warnings.warn(
        f"the capture begins {np.linalg.norm(begin) / 1000:.1f} m from its origin; the first plane carries "
        f"{most.min() / 1000:.1f} m; it is moved to begin at the default place, as with --origin start",
        FbaWarning,
        stacklevel=2,
    )
    return replace(animation, body=BodyTrack(values, animation.body.mask))


def clamped_lines(clamped: Mapping[str, ClampedParameter]) -> list[str]:
    """Return a line for each parameter, those with the most values first, and what helps."""
    order = sorted(clamped.items(), key=lambda pair: (-pair[1].count, pair[0]))
    result = []
    for label, one in order[:MOST_LINES]:
        where = f"in frame {one.frame}" if one.count == 1 else f"{one.count} values from frame {one.first} on"
        worst = "" if one.count == 1 else f"worst in frame {one.frame}: "
        result.append(
            f"  clamped: {label} {where}: {worst}{_amount(label, one.value)} sent as "
            f"{_amount(label, one.sent)}, {_amount(label, one.off)} off"
        )
    if len(order) > MOST_LINES:
        result.append(f"  clamped: {len(order) - MOST_LINES} parameters more (--json lists all)")
    if any(_unit(label) == "mm" for label in clamped):
        result.append(
            "  I planes carry no root this far off: --origin start or middle brings captures nearer"
        )
    return result


def clamped_values(clamped: Mapping[str, ClampedParameter]) -> list[dict[str, Any]]:
    """Return the same for programs, in the order in which they were met."""
    return [{"parameter": label, **asdict(one), "off": one.off} for label, one in clamped.items()]


def _unit(label: str) -> str:
    kind, number = label.split()[:2]
    return baps()[int(number) - 1].unit if kind == "BAP" else ""


def _amount(label: str, value: int) -> str:
    """Return a value in a unit that people know: degrees or mm; of FAPs as it is, in units of the face."""
    unit = _unit(label)
    if unit == "1e-5 rad":
        return f"{math.degrees(value * 1e-5):.1f} degrees"
    return f"{value} {unit}" if unit else str(value)
