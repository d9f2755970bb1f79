"""Layout of a frame in FAP and BAP files: the values of each mask column."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.parameters import (
    BAP_COUNT,
    BAP_STANDARD_COUNT,
    EXPRESSION_FIELDS,
    EXPRESSION_SELECT_MAX,
    FAP_COUNT,
    VISEME_FIELDS,
    VISEME_SELECT_MAX,
    baps,
    faps,
)


@dataclass(frozen=True, eq=False)
class Layout:
    """Layout of one kind of file.

    kind: "FAP" or "BAP". version: that is written. versions: that are read. columns: count of parameters.
    widths: mask widths that occur in files; the last is written. names, low, high, parameter, angle: for each
    slot (a number of a frame line) its name, its limits, its mask column (0-based), and whether it is an
    angle in 1e-5 rad.
    """

    kind: str
    version: str
    versions: tuple[str, ...]
    columns: int
    widths: tuple[int, ...]
    names: tuple[str, ...]
    low: Float64
    high: Float64
    parameter: Intp
    angle: Bool

    @property
    def slots(self) -> int:
        """Number of slots."""
        return len(self.names)


INT16 = np.iinfo(np.int16)
INT32 = np.iinfo(np.int32)


def _limits(name: str) -> tuple[int, int]:
    """Return the limits of a field of FAP 1 or 2."""
    if "select" in name:
        return 0, VISEME_SELECT_MAX if name.startswith("viseme") else EXPRESSION_SELECT_MAX
    if name.endswith("_def") or name == "init_face":
        return 0, 1
    return INT16.min, INT16.max  # blends and intensities may leave 0..63, because the quantiser rounds


@cache
def fap_layout() -> Layout:
    """Return the layout of FAP files: four values for FAP 1, six for FAP 2, one for each other FAP."""
    fields = (*VISEME_FIELDS, *EXPRESSION_FIELDS)
    limits = [*map(_limits, fields), *[(int(INT32.min), int(INT32.max))] * (FAP_COUNT - 2)]
    parameter = [0] * len(VISEME_FIELDS) + [1] * len(EXPRESSION_FIELDS) + list(range(2, FAP_COUNT))
    return Layout(
        kind="FAP",
        version="2.2",
        versions=("2.0", "2.1", "2.2"),
        columns=FAP_COUNT,
        widths=(FAP_COUNT,),
        names=(*fields, *(fap.label for fap in faps()[2:])),
        low=np.array([low for low, _ in limits], dtype=np.float64),
        high=np.array([high for _, high in limits], dtype=np.float64),
        parameter=np.array(parameter, dtype=np.intp),
        angle=np.array([False] * len(fields) + [fap.unit == "AU" for fap in faps()[2:]]),
    )


@cache
def bap_layout() -> Layout:
    """Return the layout of BAP files: one value for each BAP.

    Version 3.1 has 186 columns, 3.2 has 296, or 186 in files of one program.
    """
    return Layout(
        kind="BAP",
        version="3.2",
        versions=("3.1", "3.2"),
        columns=BAP_COUNT,
        widths=(BAP_STANDARD_COUNT, BAP_COUNT),
        names=tuple(bap.label for bap in baps()),
        low=np.full(BAP_COUNT, INT32.min, dtype=np.float64),
        high=np.full(BAP_COUNT, INT32.max, dtype=np.float64),
        parameter=np.arange(BAP_COUNT, dtype=np.intp),
        angle=np.array([bap.unit == "1e-5 rad" for bap in baps()]),
    )
