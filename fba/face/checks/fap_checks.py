"""Each FAP of a model, measured against the standard."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from fba.errors import OptionError
from fba.face.checks._findings import Finding
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP
from fba.parameters import faps as fap_table

if TYPE_CHECKING:
    from fba.face.checks.posing import Poser
    from fba.face.model import FaceModel


def check_faps(model: FaceModel, faps: Iterable[int] | None = None) -> list[Finding]:
    """What is wrong with the motions of a face; an empty list where nothing is.

    faps: numbers of the FAPs to look at (3..68), all by default; those in `model.lost` are left out. For
    each: its feature point moves by value x FAPU in the standard's direction (within 5 % at small values;
    on arcs, along the direction), its mate stays, nothing outside its region moves, and no triangle turns
    over or tears at the limits of its range. For all together: lids meet where their values add up to
    1024 and do not cut the eyeball; lips stay in touch where theirs add up to 0; the jaw takes lower teeth
    and tongue along and leaves lips and upper teeth.

    Raises OptionError for another number.
    """
    from fba.face.checks.posing import Poser

    wanted = list(range(FIRST_LOW_LEVEL_FAP, FAP_COUNT + 1)) if faps is None else list(faps)
    for fap in wanted:
        if not FIRST_LOW_LEVEL_FAP <= fap <= FAP_COUNT:
            raise OptionError(f"FAP {fap} cannot be checked: there are {FIRST_LOW_LEVEL_FAP}..{FAP_COUNT}")
    return check_posed(Poser(model), wanted)


def check_posed(poser: Poser, wanted: Iterable[int]) -> list[Finding]:
    """The same for FAPs of 3..68, of a model under measurement: for who asks more than once."""
    wanted = list(wanted)
    found: list[Finding] = []
    for fap in wanted:
        found += _one(poser, fap)
    found += _together(poser, set(wanted))
    return found


def _one(poser: Poser, fap: int) -> Iterator[Finding]:
    from fba.face.checks._fap_extremes import check_extremes
    from fba.face.checks._fap_points import check_point
    from fba.face.checks._fap_regions import check_region

    if fap in poser.model.lost:
        return
    if fap not in poser.model.table_of:
        yield Finding(fap_table()[fap - 1].label, "it has tables or a reason", "neither", "FaceDefTables")
        return
    yield from check_point(poser, fap)
    yield from check_region(poser, fap)
    yield from check_extremes(poser, fap)


def _together(poser: Poser, wanted: set[int]) -> Iterator[Finding]:
    from fba.face.checks._lid_rules import SIDES, check_lids
    from fba.face.checks._mouth_rules import OUTER_PAIRS, PAIRS, check_mouth
    from fba.face.points import OPEN_JAW

    present = set(poser.model.table_of)
    for side, pair in SIDES.items():
        if set(pair) <= present and wanted & set(pair):
            yield from check_lids(poser, side)
    mouth = {OPEN_JAW, *(fap for pair in (*PAIRS, *OUTER_PAIRS) for fap in pair)}
    if wanted & mouth:
        yield from check_mouth(poser)
