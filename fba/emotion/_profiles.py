"""The FAPs of each of the six families, and their measured values.

Tables 8-3 (`vocabulary.csv`) and 8-4 (`measured.csv`) of the thesis that docs/emotion.md names. The measured
values are changes of distances on a face, in FAPU; `sign` converts them to FAPs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from fba.arrays import Float32
from fba.emotion._expression import FAMILIES
from fba.errors import OptionError, did_you_mean
from fba.parameters import FAP_COUNT, fap_numbers
from fba.text_files import packaged_rows

UPPER_LID_SHARE = 0.7
"""Share of the upper lid in a change of the eye's opening; the source measured only the opening."""


@dataclass(frozen=True)
class Movement:
    """A FAP that takes part in a family, by Table 8-3.

    fap: its number. sign: +1 or -1. alternative: FAPs of alternative 1 exclude those of 2; FAPs of 0 always
    take part. note: the text of the printed table where it is wrong.
    """

    fap: int
    sign: int
    alternative: int
    note: str


@dataclass(frozen=True)
class Measurement:
    """A measured change, by Table 8-4.

    feature: number of the row, 1..15; not a FAP's. faps: numbers of the FAPs of the change: one, or two that
    share it. mean, deviation: as printed, in FAPU. sign: factor from the mean to FAPs.
    """

    feature: int
    faps: tuple[int, ...]
    mean: float
    deviation: float
    sign: int


@cache
def vocabulary(family: str) -> tuple[Movement, ...]:
    """Return the FAPs that take part in a family, with their signs. OptionError for an unknown family."""
    _check(family)
    return tuple(
        Movement(fap_numbers()[row["fap"]], int(row["sign"]), int(row["alternative"]), row["note"])
        for row in _rows("vocabulary.csv")
        if row["family"] == family
    )


@cache
def measurements(family: str) -> tuple[Measurement, ...]:
    """Return the measurements of a family; OptionError for an unknown family."""
    _check(family)
    return tuple(
        Measurement(
            int(row["feature"]),
            tuple(fap_numbers()[name] for name in row["faps"].split()),
            float(row["mean"]),
            float(row["deviation"]),
            int(row["sign"]),
        )
        for row in _rows("measured.csv")
        if row["family"] == family
    )


def measured_faps(family: str, deviations: dict[int, float] | None = None) -> Float32:
    """Return the measured profile of a family as FAPs: float32 (68,).

    deviations: standard deviations above the mean by number of the feature, 0 for others. The upper lid takes
    `UPPER_LID_SHARE` of an eye's opening; the widening of the mouth and the distance of the brows are shared
    equally. Where both brows and their distance were measured, the brows' values count.
    """
    values = np.zeros(FAP_COUNT, dtype=np.float32)
    listed = measurements(family)
    single = {m.faps[0] for m in listed if len(m.faps) == 1}
    for m in listed:
        amount = m.sign * (m.mean + (deviations or {}).get(m.feature, 0.0) * m.deviation)
        if len(m.faps) == 2 and single.issuperset(m.faps):
            continue
        for fap, share in zip(m.faps, _shares(m.faps), strict=True):
            values[fap - 1] += amount * share
    return values


def _shares(numbers: tuple[int, ...]) -> tuple[float, ...]:
    if len(numbers) == 1:
        return (1.0,)
    lids = numbers[0] in (fap_numbers()["close_t_l_eyelid"], fap_numbers()["close_t_r_eyelid"])
    return (UPPER_LID_SHARE, 1 - UPPER_LID_SHARE) if lids else (0.5, 0.5)


def _check(family: str) -> None:
    if family not in FAMILIES:
        raise OptionError(
            f"there is no family {family!r}{did_you_mean(family, FAMILIES)}; they are {', '.join(FAMILIES)}"
        )


@cache
def _rows(name: str) -> tuple[dict[str, str], ...]:
    return tuple(packaged_rows(__package__, name))
