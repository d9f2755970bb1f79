"""What `fba encode` says of values that no plane could carry."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from fba.parameters import baps

if TYPE_CHECKING:
    from fba.codec import ClampedParameter

MOST_LINES = 6


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
