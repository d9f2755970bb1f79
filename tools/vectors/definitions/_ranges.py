"""Vectors of range lists: lists that are sent, that stay in force, the standard's own, narrow and wide."""

from __future__ import annotations

from collections.abc import Iterator

from tools.vectors.definitions._targets import (
    FEW_BAPS,
    FEW_FAPS,
    LOW_LEVEL,
    RATE_25,
    STANDARD_BAPS,
    bodies,
    edited,
    faces,
    script,
    scripted,
)
from tools.vectors.definitions.case import Case
from tools.vectors.stream_writer import WIDEST, Header, Plane, write_stream

_NONE = Header(lists="0000")


def range_cases() -> Iterator[Case]:
    """Yield streams of range lists."""
    yield from _default_range_cases()
    yield from _list_cases()
    yield from _alphabet_cases()


def _default_range_cases() -> Iterator[Case]:
    """Yield streams without lists."""
    yield Case(
        "fap_default_ranges",
        "no lists: the standard's limits of FAPs, both signs; FAP 47 1080 and 420, FAP 63 720",
        scripted(faces(8, LOW_LEVEL, seed=9), intra=(0, 4), fap=_NONE),
    )
    yield Case(
        "fap_default_ranges_quantised",
        "the same divided by fap_quant 7, towards 0",
        scripted(faces(8, LOW_LEVEL, seed=10), intra=(0, 4), fap=Header(quant=7, lists="0000")),
    )
    yield Case(
        "bap_default_ranges",
        "no lists: the standard's limits of BAPs 1 to 186",
        scripted(None, bodies(6, STANDARD_BAPS, seed=9), intra=(0, 3), bap=_NONE),
    )
    yield Case(
        "bap_default_ranges_quantised",
        "the same divided by bap_pred_scale 11, towards 0",
        scripted(None, bodies(6, STANDARD_BAPS, seed=10), intra=(0, 3), bap=Header(quant=7, lists="0000")),
    )


def _list_cases() -> Iterator[Case]:
    """Yield streams of all lists and codes."""
    yield Case(
        "fap_lists",
        "the four lists of FAPs in all 16 combinations; those not sent stay in force",
        lambda: _lists("fap"),
    )
    yield Case(
        "bap_lists",
        "the four lists of BAPs in all 16 combinations; those not sent stay in force",
        lambda: _lists("bap"),
    )
    yield Case("codes", "every code of a range, 0 to 31, as maximum and as minimum", _codes)


def _alphabet_cases() -> Iterator[Case]:
    """Yield streams of narrow and wide ranges."""
    yield Case(
        "alphabet_of_one",
        "ranges 0 to 0: symbols that take no bits",
        scripted(
            [dict.fromkeys(FEW_FAPS, 0)] * 6,
            [dict.fromkeys(FEW_BAPS, 0)] * 6,
            intra=(0, 3),
            fap=Header(code=0),
            bap=Header(code=0),
        ),
    )
    yield Case(
        "alphabets_after_division",
        "ranges that fap_quant 31 leaves 1, 3 and 5 symbols of",
        scripted(
            faces(8, (3, 4, 5, 6)),
            fap=Header(quant=31, codes={3: (0, 0, 0, 0), 4: (1, 1, 1, 1), 5: (2, 0, 1, 1), 6: (2, 2, 2, 2)}),
        ),
    )
    yield Case(
        "one_sided",
        "ranges from 0 up, and from 0 down",
        scripted(
            faces(8, (3, 4, 5)),
            bodies(8, (1, 19)),
            fap=Header(codes={3: (18, 0, 10, 0), 4: (0, 10, 0, 10)}),
            bap=Header(codes={1: (31, 0, 31, 0), 19: (0, 31, 0, 31)}),
        ),
    )
    yield Case("ranges_persist", "ranges stay in force while masks and quantisers change", _persist)
    yield Case(
        "differences_too_large",
        "differences that no range holds: an I plane for each",
        scripted(
            [{3: 3720 * (-1) ** frame, 4: 10 * frame} for frame in range(8)],
            intra=range(8),
            fap=Header(code=WIDEST),
        ),
    )


def _lists(kind: str) -> bytes:
    """Return a stream of 16 I planes, with the lists that the bits of their number say."""
    values = faces(17, FEW_FAPS, seed=6) if kind == "fap" else bodies(17, FEW_BAPS, seed=6)
    planes = []
    for number, one in enumerate(values):
        header = Header(lists=f"{(number - 1) % 16:04b}", code=31 - number)
        if kind == "fap":
            planes.append(Plane(one, None, True, header, rate=RATE_25))
        else:
            planes.append(Plane(None, one, True, bap_header=header, rate=RATE_25))
    return write_stream(planes)


def _codes() -> bytes:
    """Return a stream in which parameter k of I plane t has codes around k + 8 t, each list others."""
    planes = []
    for turn in range(4):
        sent = (3, 4, 5, 6, 19, 20, 21, 22)
        codes = {}
        for place, number in enumerate(sent):
            code = place + 8 * turn
            codes[number] = (code, 31 - code, (code + 8) % 32, (code + 16) % 32)
        values = faces(3, sent, seed=turn)
        planes += script(values, fap=Header(codes=codes))
    return write_stream(planes)


def _persist() -> bytes:
    planes = script(faces(12, FEW_FAPS, seed=8), bodies(12, FEW_BAPS, seed=8), intra=(0, 3, 6, 9))
    first, later = Header(code=20), Header(quant=5, lists="0000")
    fewer = {number: value for number, value in (planes[6].fap or {}).items() if number % 2}
    return write_stream(
        edited(
            planes,
            {
                0: {"fap_header": first, "bap_header": first},
                3: {"fap_header": later, "bap_header": later},
                6: {"fap": fewer, "fap_header": Header(lists="1000", code=5), "bap_header": later},
                9: {"fap_header": Header(lists="0000"), "bap_header": Header(quant=2, lists="0001", code=9)},
            },
        )
    )
