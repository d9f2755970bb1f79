"""Vectors of values: the first to try, every quantiser, both tables of steps, extreme values."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from fba.parameters import BAP_STEP_TABLES, EXPRESSION_SELECT_MAX, INTENSITY_MAX, VISEME_SELECT_MAX, BapTable
from tools.vectors.definitions._targets import (
    EXTENSION_BAPS,
    FEW_BAPS,
    FEW_FAPS,
    LOW_LEVEL,
    STANDARD_BAPS,
    bodies,
    faces,
    script,
    scripted,
)
from tools.vectors.definitions.case import Case
from tools.vectors.stream_writer import WIDEST, Header, Plane, Values, write_stream

_FAR = 2**40
"""A value that no range reaches: the nearest is coded."""
_RAMP_STEP, _RAMP_BAPS = 512, (123, 124)
"""The standard's largest step, and the BAPs that have it."""
_INT32_MAX = 2**31 - 1


def first_cases() -> Iterator[Case]:
    """Yield the streams with which to begin."""
    yield Case("jaw", "FAP 3 alone", scripted(faces(6, (3,))))
    yield Case("face", "all 66 low-level FAPs", scripted(faces(12)))
    yield Case("viseme", "FAP 1: selects, blend, viseme_def", scripted(faces(16, (3,), viseme=True)))
    yield Case(
        "expression",
        "FAP 2: selects, intensities, init_face, expression_def",
        scripted(faces(16, (3,), expression=True)),
    )
    yield Case("pelvis", "BAPs 1 to 3 alone", scripted(None, bodies(6, (1, 2, 3))))
    yield Case("body", "BAPs 1 to 186", scripted(None, bodies(8)))
    yield Case(
        "body_visage",
        "BAPs 1 to 186 with the vendor's steps",
        lambda: write_stream(script(None, bodies(8, table="visage")), bap_steps="visage"),
        "visage",
    )
    yield Case(
        "face_and_body",
        "FAPs 1 to 68 and BAPs 1 to 186 in one plane",
        scripted(faces(6, viseme=True, expression=True), bodies(6)),
    )
    yield Case(
        "extension_baps",
        "the user-defined BAPs 187 to 296, with the ranges that they need",
        scripted(None, bodies(6, EXTENSION_BAPS)),
    )


def quantiser_cases() -> Iterator[Case]:
    """Yield streams in which each quantiser has an I plane and a P plane."""
    for first in range(0, 32, 8):
        yield Case(
            f"fap_quant_{first:02}_{first + 7:02}",
            f"fap_quant {first} to {first + 7}: FAPs, blends and intensities, each in an I and a P plane",
            partial(_fap_quantisers, first),
        )
    for table in BAP_STEP_TABLES:
        for first in range(0, 32, 8):
            name = "" if table == "iso" else "_visage"
            steps = "the standard's steps" if table == "iso" else "the vendor's steps"
            yield Case(
                f"bap_quant{name}_{first:02}_{first + 7:02}",
                f"bap_quant {first} to {first + 7} with {steps}, each in an I and a P plane",
                partial(_bap_quantisers, first, table),
                table,
            )
    yield Case(
        "quantisers_differ",
        "fap_quant 6 and bap_quant 9 in the same planes",
        scripted(faces(10, FEW_FAPS), bodies(10, FEW_BAPS), fap=Header(quant=6), bap=Header(quant=9)),
    )


def _fap_quantisers(first: int) -> bytes:
    values = faces(16, FEW_FAPS, seed=first + 3, viseme=True, expression=True)
    return write_stream(
        [
            Plane(
                one,
                None,
                number % 2 == 0,
                Header(quant=first + number // 2),
                rate=(25, 0, 0) if number == 0 else None,
            )
            for number, one in enumerate(values)
        ]
    )


def _bap_quantisers(first: int, table: BapTable) -> bytes:
    values = bodies(16, FEW_BAPS, table=table, seed=first + 3)
    return write_stream(
        [
            Plane(
                None,
                one,
                number % 2 == 0,
                bap_header=Header(quant=first + number // 2),
                rate=(25, 0, 0) if number == 0 else None,
            )
            for number, one in enumerate(values)
        ],
        bap_steps=table,
    )


def extreme_cases() -> Iterator[Case]:
    """Yield streams of the largest values and differences that planes can carry."""
    yield Case(
        "fap_limits",
        "FAPs at the ends of the standard's ranges in I planes, and differences at theirs",
        scripted(_alternating(LOW_LEVEL, 8), intra=(0, 1, 4)),
    )
    yield Case(
        "fap_widest",
        "FAPs at 1860 steps and beyond: the widest ranges, and differences added up",
        scripted(_alternating(FEW_FAPS, 12, each=3), intra=(0, 1), fap=Header(code=WIDEST)),
    )
    yield Case(
        "bap_limits",
        "BAPs at the ends of the standard's ranges in I planes, and differences at theirs",
        scripted(None, _alternating(STANDARD_BAPS, 8), intra=(0, 1, 4)),
    )
    yield Case(
        "bap_widest",
        "BAPs at 1860 steps and beyond, extension BAPs, too",
        scripted(
            None,
            _alternating((*FEW_BAPS, *EXTENSION_BAPS[::9]), 12, each=3),
            intra=(0, 1),
            bap=Header(code=WIDEST),
        ),
    )
    yield Case(
        "unquantised",
        "quantisers 0: values as they are, odd ones, too",
        scripted(_odd(FEW_FAPS), _odd(FEW_BAPS), intra=(0, 5), fap=Header(quant=0), bap=Header(quant=0)),
    )
    yield Case(
        "visemes",
        "every viseme as select1 and select2; blends 0, 63 and between; differences -14 to 14",
        scripted(_visemes(), intra=(0, 8)),
    )
    yield Case(
        "expressions",
        "every expression as select1 and select2; intensities 0, 63 and between",
        scripted(_expressions(), intra=(0, 7)),
    )
    yield Case(
        "amounts_rounded",
        "fap_quant 25: blends and intensities of 63 become 75, more than a frame says",
        scripted(_amounts(), intra=(0, 4), fap=Header(quant=25)),
    )
    yield Case(
        "bap_int32",
        "BAPs 123 and 124 raised and lowered to the ends of 32 bits, in as few planes as that takes",
        scripted(None, _ramps(), bap=Header(code=WIDEST)),
    )


def _alternating(numbers: tuple[int, ...], count: int, *, each: int = 1) -> list[Values]:
    """Return planes whose parameters go from one end to the other, neighbours in opposite directions."""
    return [
        {number: _FAR if (frame // each + number) % 2 else -_FAR for number in numbers}
        for frame in range(count)
    ]


def _odd(numbers: tuple[int, ...]) -> list[Values]:
    """Return planes of values that no step divides, within what unquantised ranges carry."""
    limits = {number: 60 + number * 7 % 300 for number in numbers}
    return [
        {number: (frame * 37 + number * 11) % (2 * limit) - limit for number, limit in limits.items()}
        for frame in range(10)
    ]


def _visemes() -> list[Values]:
    last = VISEME_SELECT_MAX
    blends = (0, INTENSITY_MAX, 31, 1, 62)
    return [
        {
            1: (
                frame % (last + 1) if frame < last + 1 else last * (frame % 2),
                last - frame % (last + 1),
                blends[frame % 5],
                frame % 2,
            )
        }
        for frame in range(20)
    ]


def _expressions() -> list[Values]:
    last = EXPRESSION_SELECT_MAX
    amounts = (0, INTENSITY_MAX, 31, 1, 62)
    return [
        {
            2: (
                frame % (last + 1),
                amounts[frame % 5],
                last - frame % (last + 1),
                amounts[(frame + 1) % 5],
                frame // 2 % 2,
                frame % 2,
            )
        }
        for frame in range(16)
    ]


def _amounts() -> list[Values]:
    ends = (0, INTENSITY_MAX + 12)
    return [
        {1: (3, 4, ends[frame // 2 % 2], 0), 2: (1, ends[frame % 2], 2, ends[frame // 2 % 2], 0, 0)}
        for frame in range(8)
    ]


def _ramps() -> list[Values]:
    """Return planes that go up and down as fast as the widest ranges let them."""
    most = WIDEST * 60 * _RAMP_STEP
    largest = _INT32_MAX // _RAMP_STEP * _RAMP_STEP
    frames = -(-(_INT32_MAX + 1) // most) + 1
    up, down = _RAMP_BAPS
    return [
        {up: min(most * (frame + 1), largest), down: max(-most * (frame + 1), -_INT32_MAX - 1)}
        for frame in range(frames)
    ]
