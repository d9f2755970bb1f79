"""The sliders of the puppeteer: groups of FAPs and of body segments, with their ranges."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from fba.parameters import bap_numbers, baps, fap_numbers, faps
from fba.text_files import packaged_rows
from fba_player.session._group_activity import reach

RANGE_FACTOR = 1.5
"""Range of a FAP's slider relative to the value that the gallery shows."""
DEGREES = float(np.degrees(1e-5))
SHIFT_RANGE = 1000.0
"""Millimetres that the body moves to either side."""


@dataclass(frozen=True, slots=True)
class Row:
    """A slider.

    title: as shown, with its side at the end ("raise inner eyebrow L"). numbers: the FAP, or the BAPs that
    share the motion. low, high: in the parameter's unit, or degrees. unit: as shown. mirror:
    position of the other side's row in its group, or None; flipped: whether that one then has the opposite
    value. side: "l", "r" or "".
    """

    kind: str
    title: str
    numbers: tuple[int, ...]
    low: float
    high: float
    unit: str
    side: str = ""
    mirror: int | None = None
    flipped: bool = False

    @property
    def scale(self) -> float:
        """Value of the slider for one unit of the parameter."""
        return DEGREES if self.unit == "deg" else 1.0


@dataclass(frozen=True, slots=True)
class Group:
    """Sliders that belong together."""

    name: str
    kind: str
    rows: tuple[Row, ...]

    @property
    def numbers(self) -> tuple[int, ...]:
        """All FAPs or BAPs that the sliders move."""
        return tuple(number for row in self.rows for number in row.numbers)


@cache
def groups() -> tuple[Group, ...]:
    """Return all groups: those of the face, then those of the body."""
    groups = []
    for line in packaged_rows(__package__, "puppet.csv"):
        names = line["parameters"].split()
        rows = _fap_rows(names) if line["kind"] == "fap" else _bap_rows(names)
        groups.append(Group(line["group"], line["kind"], rows))
    return tuple(groups)


def _fap_rows(names: list[str]) -> tuple[Row, ...]:
    numbers = [fap_numbers()[name] for name in names]
    rows = []
    for number in numbers:
        fap = faps()[number - 1]
        unit = "deg" if fap.unit == "AU" else fap.unit
        scale = DEGREES if unit == "deg" else 1.0
        most = float(np.ceil(reach(number) * RANGE_FACTOR * scale / 5) * 5)
        words = fap.name.split("_")
        side = next((word[0] for word in words if word in ("l", "r", "lm", "rm")), "")
        mate = fap.left_right_mate
        rows.append(
            Row(
                "fap", _title(fap.name), (number,), 0.0 if fap.direction == "U" else -most, most, unit, side,
                numbers.index(mate) if mate in numbers else None,
            )
        )  # fmt: skip
    return tuple(rows)


def _bap_rows(names: list[str]) -> tuple[Row, ...]:
    from fba.body import JointLimits
    from fba.body.solve.limits import widest_limits

    limits = {limit.name: limit for limit in JointLimits.human().limits}
    rows: list[Row] = []
    words = [name.replace("~", " ") for name in names]
    for word in words:
        if word in limits:
            limit = limits[word]
            numbers, unit = tuple(column + 1 for column in limit.baps), "deg"
            low, high = limit.low, limit.high
        else:
            number = bap_numbers()[word]
            numbers, unit = (number,), baps()[number - 1].unit
            low, high = -SHIFT_RANGE, SHIFT_RANGE
            if unit != "mm":
                (low, high), unit = widest_limits()[number - 1].tolist(), "deg"
        if unit == "deg":
            low, high = max(low, _codable_degrees(numbers, 0)), min(high, _codable_degrees(numbers, 1))
        side = word[0] if word.startswith(("left ", "right ", "l_", "r_")) else ""
        other = _other_side(word)
        flipped = other in words and _is_flipped(numbers[0])
        rows.append(
            Row("bap", _body_title(word), numbers, low, high, unit, side,
                words.index(other) if other in words else None, flipped)
        )  # fmt: skip
    return tuple(rows)


def _codable_degrees(numbers: tuple[int, ...], end: int) -> float:
    """Return the largest (end 1) or smallest (end 0) angle that a stream can code, in whole degrees."""
    degrees = 0.0
    for number in numbers:
        bap = baps()[number - 1]
        assert bap.i_limits is not None
        degrees += bap.i_limits[end] * max(bap.step_iso, bap.step_visage) * DEGREES
    return float(np.trunc(degrees))


def _is_flipped(number: int) -> bool:
    """Return whether the BAP of the other side needs the opposite sign for the mirrored motion.

    Mirroring left and right keeps rotations about X and reverses those about Y and Z.
    """
    bap = baps()[number - 1]
    mate = baps()[bap_numbers()[_other_side(bap.name)] - 1]
    same = bap.axis[:1] == mate.axis[:1]
    return same != (bap.axis.endswith("X"))


def _other_side(name: str) -> str:
    for side, other in (("left ", "right "), ("right ", "left "), ("l_", "r_"), ("r_", "l_")):
        if name.startswith(side):
            return other + name[len(side) :]
    return ""


def _title(name: str) -> str:
    """Return the title of a FAP: "raise inner eyebrow L" for "raise_l_i_eyebrow".

    It omits the outer contour of the lips, which is in the name of the group.
    """
    full = {"t": "top", "b": "bottom", "i": "inner", "m": "middle", "o": "outer", "lm": "L", "rm": "R",
            "midlip": "mid lip", "cornerlip": "lip corner"}  # fmt: skip
    words = name.split("_")
    if words[-1] == "o":
        words = words[:-1]
    side = [word.upper() for word in words if word in ("l", "r")]
    return " ".join([full.get(word, word) for word in words if word not in ("l", "r")] + side)


def _body_title(name: str) -> str:
    """Return the title of a limit or a BAP, such as "upper arm flexion L"."""
    for word, short in (("HumanoidRoot_tr_", ""), ("HumanoidRoot_rt_", ""), ("spine 3", "upper spine"),
                        ("spine 2", "middle spine"), ("spine 1", "lower spine")):  # fmt: skip
        name = name.replace(word, short)
    words = name.replace("1_", " ").replace("_", " ").split()
    if words[0] in ("left", "right", "l", "r"):
        words = [*words[1:], words[0][0].upper()]
    return " ".join(words)
