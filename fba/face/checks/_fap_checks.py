"""Checks each FAP of a model against the standard."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator
from functools import cache, partial
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

from fba.errors import OptionError
from fba.face.checks._findings import Finding
from fba.face.feature_points import row_of
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP
from fba.parameters import faps as fap_table

if TYPE_CHECKING:
    from fba.face.checks._posing import Poser
    from fba.face.model import FaceModel


TESTED_VALUE = 300.0
"""Value at which regions are checked; for FAPs in units of angle, 100 times it."""
EYE_FAPS = range(23, 31)
"""FAPs that move eyeballs."""
STILL_SHARE = 0.03
"""Vertices that move less than this share of the largest motion count as still."""


def check_faps(model: FaceModel, faps: Iterable[int] | None = None) -> list[Finding]:
    """Return the deviations of a face's motions from the standard; an empty list without deviations.

    faps: numbers of the FAPs to check (3..68), all by default; those in `model.lost` are left out. For
    each: its feature point moves by value x FAPU in the standard's direction (within 5 % at small values;
    on arcs, along the direction), its mate stays, nothing outside its region moves, and no triangle turns
    over or tears at the limits of its range. For combinations: lids meet where their values add up to 1024
    and do not cut the eyeball; lips stay in touch where theirs add up to 0; the jaw moves lower teeth and
    tongue but not lips and upper teeth.

    Raises OptionError for a number outside 3..68.
    """
    from fba.face.checks._posing import Poser

    wanted = list(range(FIRST_LOW_LEVEL_FAP, FAP_COUNT + 1)) if faps is None else list(faps)
    for fap in wanted:
        if not FIRST_LOW_LEVEL_FAP <= fap <= FAP_COUNT:
            raise OptionError(f"FAP {fap} cannot be checked: there are {FIRST_LOW_LEVEL_FAP}..{FAP_COUNT}")
    return check_posed(Poser(model), wanted)


def check_posed(poser: Poser, wanted: Iterable[int], *, combined: bool = True) -> list[Finding]:
    """Return what `check_faps` does for a model that already has a `Poser`: repeated checks are faster.

    combined: also what several FAPs do together.
    """
    wanted = list(wanted)
    findings = [finding for fap in wanted for finding in _findings_of_one(poser, fap)]
    if not combined:
        return findings
    return [*findings, *_check_combinations(poser, set(wanted))]


def _findings_of_one(poser: Poser, fap: int) -> tuple[Finding, ...]:
    if fap in poser.model.lost:
        return ()
    return poser.findings("one FAP", [fap], partial(_check_one, poser, fap))


def _check_one(poser: Poser, fap: int) -> Iterator[Finding]:
    from fba.face.checks._fap_extremes import check_extremes
    from fba.face.checks._fap_points import check_point

    if fap not in poser.model.table_of:
        yield Finding(fap_table()[fap - 1].label, "it has tables or a reason", "neither", "FaceDefTables")
        return
    yield from check_point(poser, fap)
    yield from _check_region(poser, fap)
    yield from check_extremes(poser, fap)


def _check_combinations(poser: Poser, wanted: set[int]) -> Iterator[Finding]:
    from fba.face.checks._lid_rules import SIDES, check_lids
    from fba.face.checks._mouth_rules import OUTER_PAIRS, PAIRS, check_mouth
    from fba.face.points import OPEN_JAW

    present = set(poser.model.table_of)
    for side, pair in SIDES.items():
        if set(pair) <= present and wanted & set(pair):
            yield from poser.findings(f"{side} lids", pair, partial(check_lids, poser, side))
    mouth = (OPEN_JAW, *(fap for pair in (*PAIRS, *OUTER_PAIRS) for fap in pair))
    if wanted & set(mouth):
        yield from poser.findings("mouth", mouth, partial(check_mouth, poser))


@cache
def region_table() -> dict[int, tuple[tuple[str, ...], float]]:
    """Return the points of each FAP's region, and how far from them its motion may reach, in ES0."""
    regions = {}
    with (files(__package__) / "fap_regions.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            for fap in row["faps"].split():
                regions[int(fap)] = (tuple(row["points"].split()), float(row["reach"]))
    return regions


def _check_region(poser: Poser, fap: int) -> Iterator[Finding]:
    """Yield a finding where vertices move that are too far from the points of the FAP's region."""
    if fap not in region_table():
        return
    names, reach = region_table()[fap]
    points = poser.model.points[[row_of()[name] for name in names]]
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return
    entry = fap_table()[fap - 1]
    value = TESTED_VALUE if entry.unit != "AU" else TESTED_VALUE * 100
    moved = np.linalg.norm(poser.shift({fap: value}), axis=1)
    if not moved.max() > 0:
        return
    moving = np.flatnonzero(moved > STILL_SHARE * moved.max())
    eyes = np.zeros(len(moved), dtype=np.bool_)
    for part in poser.model.of_kind("eye"):  # an eyeball belongs to its eye, however big it is
        start = poser.model.starts[part.name]
        eyes[start : start + len(part.vertices)] = fap in EYE_FAPS
    moving = moving[~eyes[moving]]
    if not len(moving):
        return
    away = np.min(np.linalg.norm(poser.neutral[moving][:, None] - points, axis=2), axis=1)
    es = poser.model.fapu.ES * 1024
    if away.max() > reach * es:
        worst = int(moving[away.argmax()])
        yield Finding(
            entry.label,
            "nothing moves outside its region",
            f"vertex {worst}, {away.max() * 1000:.0f} mm from it, moves {moved[worst] * 1000:.2f} mm",
            f"within {reach * es * 1000:.0f} mm of {', '.join(names)}",
        )
