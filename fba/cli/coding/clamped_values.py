"""Values that no plane can carry: `fba encode` moves captures for them, and reports what it clamps."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fba.animation import Animation
from fba.errors import warn
from fba.parameters import BapTable, bap_numbers, bap_steps, baps
from fba.tracks import BodyTrack

if TYPE_CHECKING:
    from fba.codec import ClampedParameter

MAX_LINES = 6
"""Most parameters in a report."""
MAX_STEPS = 1860
"""Most quantiser steps of a value in an I plane."""


def bring_near(animation: Animation, table: BapTable, quant: int) -> Animation:
    """Return a capture; if its first plane cannot carry its first place, moved to begin at the default place.

    Warns (FbaWarning) that it was moved. table, quant: of the BAPs.
    """
    if animation.body is None:
        return animation
    numbers = bap_numbers()
    columns = [numbers[f"HumanoidRoot_tr_{axis}"] - 1 for axis in ("lateral", "frontal")]
    begin = animation.body.values[0, columns]
    most = (bap_steps(table)[columns] if quant else np.ones(2, dtype=np.int64)) * MAX_STEPS
    if (np.abs(begin) <= most).all():
        return animation
    values = animation.body.values.copy()
    values[:, columns] -= begin
    warn(
        f"the capture begins {np.linalg.norm(begin) / 1000:.1f} m from its origin; the first plane carries "
        f"{most.min() / 1000:.1f} m; it is moved to begin at the default place, as with --origin start",
        stacklevel=2,
    )
    return replace(animation, body=BodyTrack(values, animation.body.mask))


def clamped_lines(clamped: Mapping[str, ClampedParameter]) -> list[str]:
    """Return a line for each parameter, those with most values first, and a remedy."""
    order = sorted(clamped.items(), key=lambda pair: (-pair[1].count, pair[0]))
    result = []
    for label, cut in order[:MAX_LINES]:
        where = f"in frame {cut.frame}" if cut.count == 1 else f"{cut.count} values from frame {cut.first} on"
        worst = "" if cut.count == 1 else f"worst in frame {cut.frame}: "
        result.append(
            f"  clamped: {label} {where}: {worst}{_amount(label, cut.value)} sent as "
            f"{_amount(label, cut.sent)}, {_amount(label, cut.off)} off"
        )
    if len(order) > MAX_LINES:
        result.append(f"  clamped: {len(order) - MAX_LINES} parameters more (--json lists all)")
    if any(_unit(label) == "mm" for label in clamped):
        result.append(
            "  I planes carry no root this far off: --origin start or middle brings captures nearer"
        )
    return result


def clamped_values(clamped: Mapping[str, ClampedParameter]) -> list[dict[str, Any]]:
    """Return all parameters for programs, in the order in which they were clamped first."""
    return [{"parameter": label, **asdict(cut), "off": cut.off} for label, cut in clamped.items()]


def _unit(label: str) -> str:
    kind, number = label.split()[:2]
    return baps()[int(number) - 1].unit if kind == "BAP" else ""


def _amount(label: str, value: int) -> str:
    """Return a value in degrees or mm; a FAP as it is, in units of the face."""
    unit = _unit(label)
    if unit == "1e-5 rad":
        return f"{math.degrees(value * 1e-5):.1f} degrees"
    return f"{value} {unit}" if unit else str(value)
