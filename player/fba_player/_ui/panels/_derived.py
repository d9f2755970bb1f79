"""Curves that follow from parameters: visemes, expressions, openings of mouth and eyes, joints, speed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from fba.arrays import Bool, Float64
from fba.body.solve.conventions import NO_BAP, convention
from fba.face import Fapu
from fba.parameters import EXPRESSIONS, VISEMES

if TYPE_CHECKING:
    from fba.tracks import FaceTrack

KINDS = ("viseme", "expression", "measure", "joint")
"""Kinds of derived curves, besides the kinds "fap" and "bap" of parameters."""
LIDS_CLOSED = 1024
"""IRISD by which upper and lower lid together close an eye."""
AXES = "XYZ"
RADIANS = 1e-5
"""An angle's unit of a BAP."""


@dataclass(frozen=True)
class Measure:
    """A distance, a share or a speed. columns: 0-based, of the FAPs or BAPs (`kind`) it follows from."""

    name: str
    unit: str
    kind: str
    columns: tuple[int, ...]
    compute: Callable[[Float64, Float64, Fapu], Float64]
    """From values (T, n) of the columns, times (T,) in seconds and the units of the face, returns (T,)."""


@cache
def measures() -> tuple[Measure, ...]:
    """Return all measures, in the order of their numbers, which begin at 1."""
    vertical = [int(column) for column in convention().translation]
    return (
        Measure("mouth opening", "mm", "fap", (3, 4), lambda v, _, fapu: -1000 * fapu.MNS * v.sum(axis=1)),
        Measure("mouth widening", "mm", "fap", (5, 6), lambda v, _, fapu: 1000 * fapu.MW * v.sum(axis=1)),
        Measure("left eye opening", "%", "fap", (18, 20), _open_share),
        Measure("right eye opening", "%", "fap", (19, 21), _open_share),
        Measure("speed over the ground", "m/s", "bap", (vertical[0], vertical[2]), _speed),
    )


def derived_name(kind: str, number: int) -> str:
    """Return the name of a derived curve. number: from 1 on, of the viseme, expression, measure or joint."""
    if kind == "viseme":
        return f"viseme {VISEMES[number]}"
    if kind == "expression":
        return f"expression {EXPRESSIONS[number]}"
    if kind == "measure":
        return measures()[number - 1].name
    return f"angle of {convention().joints[number - 1]}"


def derived_unit(kind: str, number: int) -> str:
    """Return the unit: of visemes a share of the blend, of expressions the standard's intensity."""
    if kind == "measure":
        return measures()[number - 1].unit
    return {"viseme": "%", "expression": "of 63", "joint": "deg"}[kind]


def derived_numbers(*, face: bool, body: bool) -> list[tuple[str, int]]:
    """Return (kind, number) of all derived curves of a face, of a body, or of both."""
    rows: list[tuple[str, int]] = []
    if face:
        rows += [("viseme", number) for number in range(1, len(VISEMES))]
        rows += [("expression", number) for number in range(1, len(EXPRESSIONS))]
    parts = {"fap": face, "bap": body}
    rows += [("measure", number) for number, one in enumerate(measures(), 1) if parts[one.kind]]
    if body:
        rows += [("joint", number) for number in range(1, len(convention().joints) + 1)]
    return rows


def selected_course(face: FaceTrack, frames: int, kind: str, number: int) -> tuple[Float64, Bool]:
    """Return the values (T,) of a viseme, in percent, or an expression, 0 to 63, and what frames send it."""
    if kind == "viseme":
        names, sent = face.viseme[:frames, :2], face.mask[:frames, 0]
        blend = np.clip(face.viseme[:frames, 2] / 63, 0, 1)
        amounts = 100 * np.stack([blend, 1 - blend], axis=1)
    else:
        names, sent = face.expression[:frames, [0, 2]], face.mask[:frames, 1]
        amounts = face.expression[:frames, [1, 3]].astype(np.float64)
    values = np.where((names == number) & sent[:, None], amounts, 0.0).sum(axis=1)
    last = np.maximum.accumulate(np.where(sent, np.arange(len(sent)), -1))  # in force until sent again
    return np.where(last >= 0, values[np.maximum(last, 0)], 0.0), np.asarray(sent)


def joint_columns(number: int) -> list[int]:
    """Return the 0-based columns of the BAPs that turn a joint, outermost first."""
    return [int(column) for column in convention().bap[number - 1] if column != NO_BAP]


def joint_angle(number: int, values: Float64) -> Float64:
    """Return the angle (T,) in degrees by which BAPs (T, n) of `joint_columns` turn a joint from its rest."""
    from scipy.spatial.transform import Rotation

    table = convention()
    turns = np.zeros((len(values), 3))
    turns[:, : values.shape[1]] = RADIANS * values * table.sign[number - 1, : values.shape[1]]
    axes = "".join(AXES[int(axis)] for axis in table.axis[number - 1])
    if not len(values):
        return np.zeros(0)
    return np.asarray(np.degrees(Rotation.from_euler(axes, turns).magnitude()))


def _open_share(values: Float64, times: Float64, fapu: Fapu) -> Float64:
    return np.asarray(100 * (1 - values.sum(axis=1) / LIDS_CLOSED))


def _speed(values: Float64, times: Float64, fapu: Fapu) -> Float64:
    if len(values) < 2:
        return np.zeros(len(values))
    return np.asarray(np.hypot(*(np.gradient(values[:, axis] / 1000, times) for axis in (0, 1))))
