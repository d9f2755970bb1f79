"""What readers of action units share: the rows of one face, their times and intensities, 0 to 1."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fba.arrays import Float64, Int64
from fba.errors import FormatError
from fba.formats.face_tables._faces import choose_rows, row_times, tracked_rows
from fba.formats.face_tables._tables import Table


@dataclass(frozen=True)
class UnitLayout:
    """How a program lays out a table of action units.

    face, seconds: columns that say whose face a row is of, and when. strongest: intensity of an action unit
    that is as strong as can be. largest: the greatest valid number.
    """

    face: str
    seconds: str
    strongest: float
    largest: float


@dataclass(frozen=True, eq=False)
class UnitRows:
    """The rows of one face.

    numbers: int64 (T,), of the table's rows. times: float64 (T,), seconds from the first on; rate: nominal.
    units: N action units. intensities: float64 (T, N), 0 to 1, NaN in rows without a face. findings: what was
    odd about the times.
    """

    numbers: Int64
    times: Float64
    rate: Fraction
    units: tuple[int, ...]
    intensities: Float64
    findings: list[str]


def number_columns(table: Table) -> dict[str, int]:
    """Return the numbers of columns by name, of two of one name the first."""
    return {name: number for number, name in reversed(list(enumerate(table.names)))}


def read_unit_rows(
    table: Table,
    columns: Mapping[int, int],
    layout: UnitLayout,
    face: str | None,
    source_rate: Fraction | int | str | None,
    ids: Sequence[str] | None = None,
) -> UnitRows:
    """Return action units of one face. columns: action unit -> number of its column.

    face: which one, where there are several. source_rate: frames in a second, for tables without times. ids:
    whose face each row is of; None for what the column of faces says. Raises FormatError.
    """
    column = number_columns(table)
    if ids is None:
        ids = table.column(column[layout.face]) if layout.face in column else [""] * len(table.rows)
    rows = choose_rows(table, ids, face)
    times, rate, findings = row_times(
        table, rows, column.get(layout.seconds), column.get("frame"), source_rate
    )
    units = sorted(columns)
    strengths = table.numbers([columns[unit] for unit in units])[rows]
    if np.nanmax(np.abs(strengths), initial=0.0) > layout.largest:
        row = int(np.argwhere(np.abs(strengths) > layout.largest)[0][0])
        raise FormatError(
            f"an action unit is stronger than {layout.largest:g}; here they go from 0 to "
            f"{layout.strongest:g}",
            path=table.path, line=table.lines[rows[row]],
        )  # fmt: skip
    seen = tracked_rows(table, column)[rows]
    shares = np.where(seen[:, None], np.clip(strengths / layout.strongest, 0.0, 1.0), np.nan)
    return UnitRows(rows, times, rate, tuple(units), shares, findings)
