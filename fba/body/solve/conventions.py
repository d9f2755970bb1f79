"""Conventions: the joint, axis, sign and order of each BAP's rotation, from conventions.json.

The standard leaves the order of rotations at a joint open, and old files use other signs; so both are data,
and everything that poses or solves takes the name of a convention. docs/body.md explains the default.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from fba.arrays import Float64, Int64
from fba.choices import Axes
from fba.parameters import baps

NO_BAP = -1


@dataclass(frozen=True, eq=False)
class Convention:
    """The rotations that BAPs make. Rows of the arrays correspond to `joints`.

    joints: names of the joints that BAPs turn.
    bap: int64 (N, 3), 0-based BAP column of each rotation, outermost (applied last to a point) first;
        -1 where the joint lacks that freedom: real freedoms come first.
    axis: int64 (N, 3), 0, 1, 2 for x, y, z of the body's frame in the default posture; a permutation.
    sign: float64 (N, 3), +1 or -1.
    translation: int64 (3,), columns of the root's translation along x, y, z, and translation_sign.
    """

    name: Axes
    about: str
    joints: tuple[str, ...]
    bap: Int64
    axis: Int64
    sign: Float64
    translation: Int64
    translation_sign: Float64

    def freedoms(self, joint: str) -> tuple[int, ...]:
        """Return the 0-based BAP columns of a joint's rotations, outermost first; empty without any."""
        if joint not in self.joints:
            return ()
        return tuple(int(b) for b in self.bap[self.joints.index(joint)] if b != NO_BAP)


def convention_names() -> tuple[str, ...]:
    """Return names of all conventions; the first is the default."""
    return tuple(_table())


@cache
def convention(name: Axes = "iso") -> Convention:
    """Return the convention of a name; raises ValueError for an unknown one."""
    if name not in _table():
        raise ValueError(f"axes must be one of {', '.join(_table())}, not {name!r}")
    row = _table()[name]
    if "base" in row:
        row = {**_table()[row["base"]], **row}

    turns: dict[str, list[tuple[int, int, int, float]]] = {}
    translation = np.full(3, NO_BAP, dtype=np.int64)
    translation_sign = np.ones(3)
    for bap in baps():
        if not bap.joint:
            continue
        text = next((axis for key, axis in row["axes"].items() if re.fullmatch(key, bap.name)), bap.axis)
        sign, letter = (1.0 if text[-2] == "+" else -1.0), "XYZ".index(text[-1])
        if text.startswith("translate"):
            translation[letter], translation_sign[letter] = bap.number - 1, sign
            continue
        rank = _order(row, bap.joint).index("XYZ"[letter])
        axis, sign = _axis_in_body_frame(row, bap.joint, letter, sign)
        turns.setdefault(bap.joint, []).append((rank, bap.number - 1, axis, sign))

    names = tuple(turns)
    column = np.full((len(names), 3), NO_BAP, dtype=np.int64)
    axes = np.zeros((len(names), 3), dtype=np.int64)
    signs = np.ones((len(names), 3))
    for number, joint in enumerate(names):
        free = sorted(turns[joint])
        taken = [axis for _, _, axis, _ in free]
        axes[number] = taken + [axis for axis in range(3) if axis not in taken]
        column[number, : len(free)] = [bap for _, bap, _, _ in free]
        signs[number, : len(free)] = [sign for *_, sign in free]
    for array in (column, axes, signs, translation, translation_sign):
        array.flags.writeable = False
    return Convention(name, row["about"], names, column, axes, signs, translation, translation_sign)


def _order(row: dict[str, Any], joint: str) -> str:
    orders: dict[str, str] = row["joint_orders"]
    return next((order for key, order in orders.items() if re.fullmatch(key, joint)), row["order"])


def _axis_in_body_frame(row: dict[str, Any], joint: str, axis: int, sign: float) -> tuple[int, float]:
    """Return axis and sign in the body's frame for a joint's own axis: hands are a quarter turn about y."""
    for rule in row["turned"]:
        if re.fullmatch(rule["joints"], joint) and axis != 1:
            quarter = rule["quarter_turns_about_y"]
            # +90 degrees about y takes x to -z and z to +x
            return (2, -sign * quarter) if axis == 0 else (0, sign * quarter)
    return axis, sign


@cache
def _table() -> dict[str, Any]:
    text = (files(__package__) / "conventions.json").read_text(encoding="utf-8")
    result: dict[str, Any] = json.loads(text)
    return result
