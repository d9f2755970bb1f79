"""The layout of open panels: a column at the left and one at the right, which leave the middle free.

All lengths are in points.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

EDGE = 14.0
"""Points around a column."""
GAP = 10.0
"""Points between two panels."""
FOLDED_GAP = 4.0
"""Points below a folded panel."""
TITLE = 32.0
"""Height of a folded panel, which shows only its title."""
MIN_MIDDLE_SHARE = 0.3
"""Least width between the columns, as a share of the display's."""
MIN_MIDDLE = 240.0
"""Least width between the columns, in points."""
MIN_COLUMN = 280.0
"""Least width of a column; if two do not fit beside the middle, there is only the right one."""


@dataclass(frozen=True, slots=True)
class DockRequest:
    """The size that a panel asks for. side: "left" or "right". least: the least useful height."""

    name: str
    side: str
    width: float
    height: float
    least: float


@dataclass(frozen=True, slots=True)
class Dock:
    """Position and size of a panel. folded: whether only its title is shown."""

    left: float
    top: float
    width: float
    height: float
    folded: bool = False


class Docks:
    """Arranges panels: each stays at the side where it opened; without room, the least recently used fold."""

    def __init__(self) -> None:
        self._sides: dict[str, str] = {}
        self._used: list[str] = []
        self._arranged: tuple[object, dict[str, Dock]] = ((), {})

    def use(self, name: str) -> None:
        """Note that the user works with a panel: others are folded before it."""
        if name in self._sides and self._used[-1:] != [name]:
            self._used = [*(used for used in self._used if used != name), name]
            self._arranged = ((), {})

    def arrange(self, requests: list[DockRequest], wide: float, top: float, high: float) -> dict[str, Dock]:
        """Return the positions of panels by name; panels whose title has no room are left out.

        wide: of the display. high: height that is free from `top` on.
        """
        key = (tuple(requests), wide, top, high)
        if self._arranged[0] == key:
            return self._arranged[1]
        names = {request.name for request in requests}
        self._sides = {name: side for name, side in self._sides.items() if name in names}
        self._used = [name for name in self._used if name in names]
        room = wide - 2 * EDGE
        middle = max(MIN_MIDDLE_SHARE * wide, MIN_MIDDLE)
        both = room - middle >= 2 * MIN_COLUMN
        columns: dict[str, list[DockRequest]] = {"left": [], "right": []}
        opened = list(self._sides)  # in this order; new ones come last
        for request in sorted(requests, key=lambda request: [*opened, request.name].index(request.name)):
            if request.name not in self._sides:
                self._sides[request.name] = _side(request, columns, high)
                self._used.append(request.name)
            columns[self._sides[request.name] if both else "right"].append(request)
        widths = {
            side: max((panel.width for panel in column), default=0.0) for side, column in columns.items()
        }
        most = max(room - middle, min(room, MIN_COLUMN))
        if sum(widths.values()) > most:
            half = max(most / 2, most - min(widths.values()))
            widths = {side: min(width, half) for side, width in widths.items()}
        docks: dict[str, Dock] = {}
        for side, column in columns.items():
            left = EDGE if side == "left" else wide - EDGE - widths[side]
            docks |= self._column(column, left, widths[side], top, high)
        self._arranged = (key, docks)
        return docks

    def _column(
        self, column: list[DockRequest], left: float, wide: float, top: float, high: float
    ) -> dict[str, Dock]:
        folded: set[str] = set()
        for name in self._used:
            if _least_height(column, folded) <= high or len(folded) >= len(column) - 1:
                break
            if any(request.name == name for request in column):
                folded.add(name)
        least = [TITLE if request.name in folded else request.least for request in column]
        liked = [TITLE if request.name in folded else request.height for request in column]
        heights = _share_height(least, liked, high - _gaps(column, folded))
        docks, y = {}, top
        for request, height in zip(column, heights, strict=True):
            left_over = top + high - y
            if left_over < TITLE:
                break
            docks[request.name] = Dock(left, y, wide, min(height, left_over), request.name in folded)
            y += height + (FOLDED_GAP if request.name in folded else GAP)
        return docks


def free_middle(docks: Iterable[Dock], wide: float) -> tuple[float, float]:
    """Return the shares of the width that the columns cover at the left and at the right."""
    left = right = 0.0
    for dock in docks:
        if dock.left <= EDGE:
            left = max(left, (dock.left + dock.width) / wide)
        else:
            right = max(right, 1 - dock.left / wide)
    return left, right


def _side(request: DockRequest, columns: dict[str, list[DockRequest]], high: float) -> str:
    """Return the side for a new panel: its own if all fit there, else the other if they do, else the emptier.

    All fit with the heights that they ask for if possible, else with their least heights.
    """
    first, other = request.side, "right" if request.side == "left" else "left"
    for size in (_liked_height, _least_height):
        for side in (first, other):
            if size([*columns[side], request], set()) <= high:
                return side
    return min((first, other), key=lambda side: _least_height(columns[side], set()))


def _liked_height(column: list[DockRequest], folded: set[str]) -> float:
    return sum(request.height for request in column) + _gaps(column, folded)


def _least_height(column: list[DockRequest], folded: set[str]) -> float:
    heights = [TITLE if request.name in folded else min(request.least, request.height) for request in column]
    return sum(heights) + _gaps(column, folded)


def _gaps(column: list[DockRequest], folded: set[str]) -> float:
    return sum(FOLDED_GAP if request.name in folded else GAP for request in column[:-1])


def _share_height(least: list[float], most: list[float], room: float) -> list[float]:
    """Return heights from `least` to `most`; room beyond the least is shared in proportion to the rest."""
    least = [min(low, high) for low, high in zip(least, most, strict=True)]
    missing = sum(most) - sum(least)
    spare = min(max(room - sum(least), 0.0), missing)
    share = spare / missing if missing > 0 else 0.0
    return [low + (high - low) * share for low, high in zip(least, most, strict=True)]
