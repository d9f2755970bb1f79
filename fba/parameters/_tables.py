"""Typed access to the standard's tables: FAPs, BAPs, their groups, feature points, joints.

The numbers live in the CSV files beside this module (ISO/IEC 14496-2, FAP and BAP tables; joint
centres of the H-Anim default body). Everything here is read once, on first use.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool, Int64, Intp

FAP_COUNT = 68
BAP_COUNT = 296
BAP_STANDARD_COUNT = 186
"""BAPs 1..186 are named by the standard; 187..296 are user-defined extensions."""
FIRST_LOW_LEVEL_FAP = 3
FAP_GROUP_COUNT = 10
BAP_GROUP_COUNT = 24

BapTable = Literal["iso", "visage"]
"""The name of a table of BAP steps."""
BAP_STEP_TABLES: tuple[BapTable, ...] = ("iso", "visage")
"""`iso`: the standard's quantiser steps; `visage`: those of a vendor's tools. Streams do not say which."""
BAP_STEPS_DEFAULT = BAP_STEP_TABLES[0]
BAP_STEPS_AUTO: Final = "auto"
"""In place of a table's name: the table that the stream's mark names, or else that its motion shows."""

VISEME_FIELDS = ("viseme_select1", "viseme_select2", "viseme_blend", "viseme_def")
EXPRESSION_FIELDS = (
    "expression_select1", "expression_intensity1", "expression_select2", "expression_intensity2",
    "init_face", "expression_def",
)  # fmt: skip
VISEME_SELECT_MAX = 14
EXPRESSION_SELECT_MAX = 6
FULL_TURN = 628319
"""2 pi in 1e-5 rad, rounded: a full turn of a BAP changes the pose by less than 1e-5 rad."""
INTENSITY_MAX = 63
"""Largest viseme blend and expression intensity (6 bits)."""

EXPRESSIONS = ("none", "joy", "sadness", "anger", "fear", "disgust", "surprise")
VISEMES = (
    "none", "p b m", "f v", "T D", "t d", "k g", "tS dZ S", "s z", "n l", "r", "A:", "e", "I", "Q", "U",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Fap:
    """One facial animation parameter; limits and step in table units, before any quantiser."""

    number: int
    name: str
    bifs_field: str
    motion: str
    unit: str
    """FAPU: MNS, MW, IRISD, ES, ENS, AU; empty for FAP 1 and 2."""
    direction: str
    """U unidirectional, B bidirectional."""
    positive: str
    group: int
    group_name: str
    feature_points: tuple[str, ...]
    step: int
    i_limits: tuple[int, int] | None
    p_limits: tuple[int, int] | None
    left_right_mate: int | None
    lip_mate: int | None

    @property
    def label(self) -> str:
        return f"FAP {self.number} {self.name}"


@dataclass(frozen=True, slots=True)
class Bap:
    """One body animation parameter; limits and steps in table units, before any quantiser."""

    number: int
    name: str
    bifs_field: str
    joint: str
    """Joint that it moves; empty for extension BAPs."""
    freedom: str
    axis: str
    """Signed axis of the positive motion: "-X", "translate +Y", ..."""
    group: int
    group_name: str
    coding_order: int
    unit: str
    step_iso: int
    step_visage: int
    i_limits: tuple[int, int] | None
    p_limits: tuple[int, int] | None

    @property
    def label(self) -> str:
        return f"BAP {self.number} {self.name}"


@dataclass(frozen=True, slots=True)
class FeaturePoint:
    """One of the 84 feature points; `name` is "group.index"."""

    name: str
    group: int
    index: int
    description: str
    faps: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Joint:
    """One joint of the body: its parent (None for the root) and default centre in metres."""

    name: str
    parent: str | None
    centre: tuple[float, float, float]


def _rows(name: str) -> list[dict[str, str]]:
    text = (files(__package__) / name).read_text(encoding="utf-8")
    return list(csv.DictReader(io.StringIO(text, newline="")))


def _number(text: str) -> int | None:
    return int(text) if text else None


def _limits(low: str, high: str) -> tuple[int, int] | None:
    return (int(low), int(high)) if low else None


@cache
def faps() -> tuple[Fap, ...]:
    """The 68 FAPs; element i is FAP i+1."""
    return tuple(
        Fap(
            number=int(row["number"]),
            name=row["name"],
            bifs_field=row["bifs_field"],
            motion=row["motion"],
            unit=row["unit"],
            direction=row["direction"],
            positive=row["positive"],
            group=int(row["group"]),
            group_name=row["group_name"],
            feature_points=tuple(p for p in row["feature_point"].split(";") if p),
            step=int(row["step"]),
            i_limits=_limits(row["i_min"], row["i_max"]),
            p_limits=_limits(row["p_min"], row["p_max"]),
            left_right_mate=_number(row["left_right_mate"]),
            lip_mate=_number(row["lip_mate"]),
        )
        for row in _rows("fap.csv")
    )


@cache
def baps() -> tuple[Bap, ...]:
    """The 296 BAPs; element i is BAP i+1."""
    return tuple(
        Bap(
            number=int(row["number"]),
            name=row["name"],
            bifs_field=row["bifs_field"],
            joint=row["joint"],
            freedom=row["freedom"],
            axis=row["axis"],
            group=int(row["group"]),
            group_name=row["group_name"],
            coding_order=int(row["coding_order"]),
            unit=row["unit"],
            step_iso=int(row["step_iso"]),
            step_visage=int(row["step_visage"]),
            i_limits=_limits(row["i_min"], row["i_max"]),
            p_limits=_limits(row["p_min"], row["p_max"]),
        )
        for row in _rows("bap.csv")
    )


@cache
def feature_points() -> tuple[FeaturePoint, ...]:
    """The 84 feature points, in the order of the standard's groups 2..11."""
    return tuple(
        FeaturePoint(
            name=row["point"],
            group=int(row["group"]),
            index=int(row["index"]),
            description=row["description"],
            faps=tuple(int(n) for n in row["faps"].split()),
        )
        for row in _rows("feature_points.csv")
    )


@cache
def joints() -> tuple[Joint, ...]:
    """The 87 joints, parents before children."""
    return tuple(
        Joint(row["joint"], row["parent"] or None, (float(row["x"]), float(row["y"]), float(row["z"])))
        for row in _rows("joints.csv")
    )


@cache
def fap_groups() -> tuple[tuple[int, ...], ...]:
    """FAP numbers of the 10 groups, in coding order."""
    return tuple(tuple(f.number for f in faps() if f.group == g) for g in range(1, FAP_GROUP_COUNT + 1))


@cache
def bap_groups() -> tuple[tuple[int, ...], ...]:
    """BAP numbers of the 24 groups, in coding order (the groups' listed order, not by number)."""
    ordered = sorted(baps(), key=lambda b: b.coding_order)
    return tuple(tuple(b.number for b in ordered if b.group == g) for g in range(1, BAP_GROUP_COUNT + 1))


@cache
def fap_steps() -> Int64:
    """(68,) quantiser steps before fap_quant; read-only."""
    return _frozen([f.step for f in faps()])


@cache
def bap_steps(table: BapTable = "iso") -> Int64:
    """(296,) quantiser steps before the predictive scale; table: "iso" or "visage"; read-only."""
    if table not in BAP_STEP_TABLES:
        raise ValueError(f"bap_steps must be one of {', '.join(BAP_STEP_TABLES)}, not {table!r}")
    return _frozen([b.step_iso if table == "iso" else b.step_visage for b in baps()])


@cache
def bap_angles() -> Bool:
    """Return bool (296,): whether each BAP is an angle; read-only."""
    angles = np.array([bap.unit == "1e-5 rad" for bap in baps()])
    angles.flags.writeable = False
    return angles


def _frozen(values: list[int]) -> Int64:
    array = np.array(values, dtype=np.int64)
    array.flags.writeable = False
    return array


@cache
def fap_numbers() -> dict[str, int]:
    """FAP number by name."""
    return {f.name: f.number for f in faps()}


@cache
def bap_numbers() -> dict[str, int]:
    """BAP number by name."""
    return {b.name: b.number for b in baps()}


@cache
def point_rows() -> dict[str, int]:
    """Return the row of each feature point, by name, in arrays of all 84."""
    return {point.name: row for row, point in enumerate(feature_points())}


@cache
def mate_columns() -> tuple[Intp, ...]:
    """Return columns (68,) that unsent FAPs copy: mate, lip mate, its mate; their own without one."""
    mate = np.array([(f.left_right_mate or f.number) - 1 for f in faps()])
    lip = np.array([(f.lip_mate or f.number) - 1 for f in faps()])
    return (mate, lip, mate[lip])


def fill_from_mates(values: npt.NDArray[np.generic], sent: Bool) -> tuple[npt.NDArray[np.generic], Bool]:
    """Return values (..., 68) with unsent FAPs copied from their mates, and a mask of those now known.

    ISO/IEC 14496-2 leaves it to the decoder to estimate unsent FAPs: the other side of the face copies a side
    that is sent, and the outer contour of the lips copies the inner one and the other way round.
    """
    filled, known = values.copy(), sent.copy()
    for column in mate_columns():
        copied = ~known & sent[..., column]
        np.copyto(filled, values[..., column], where=copied)
        known |= copied
    return filled, known
