"""Values for the planes of test vectors, and scripts of planes: the same integers on every machine.

Random modules may change their sequences, so the noise comes from a generator defined here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from fba.parameters import (
    BAP_COUNT,
    BAP_STANDARD_COUNT,
    EXPRESSION_SELECT_MAX,
    FAP_COUNT,
    INTENSITY_MAX,
    VISEME_SELECT_MAX,
    BapTable,
    baps,
    faps,
)
from tools.vectors.stream_writer import Header, Plane, Values, write_stream

LOW_LEVEL = tuple(range(3, FAP_COUNT + 1))
STANDARD_BAPS = tuple(range(1, BAP_STANDARD_COUNT + 1))
EXTENSION_BAPS = tuple(range(BAP_STANDARD_COUNT + 1, BAP_COUNT + 1))
FEW_FAPS = (3, 4, 8, 19, 20, 33, 39, 48, 51, 60, 61, 68)
FEW_BAPS = (1, 4, 5, 19, 33, 50, 90, 125, 180, 181, 186)
RATE_25 = (25, 0, 0)
USUAL_HEADER = Header()
EXTENSION_LIMIT = 1860
"""Extension BAPs have no limits: as far as the widest range goes."""


def noise(seed: int, size: int) -> Iterator[int]:
    """Yield integers from 0 to size - 1 from a linear congruential generator."""
    state = seed
    while True:
        state = (state * 1664525 + 1013904223) % (1 << 32)
        yield (state >> 8) % size


def walk(count: int, low: int, high: int, seed: int) -> list[int]:
    """Return a random walk of values within limits, which rests half of the time."""
    source = noise(seed, 201)
    value, values = 0, []
    for _ in range(count):
        if next(source) > 100:
            value += (next(source) - 100) * (high - low) // 4000
        value = min(max(value, low), high)
        values.append(value)
    return values


def faces(
    count: int,
    numbers: Sequence[int] = LOW_LEVEL,
    *,
    seed: int = 1,
    viseme: bool = False,
    expression: bool = False,
) -> list[dict[int, int | tuple[int, ...]]]:
    """Return FAPs that walk within the standard's limits, a dictionary for each plane."""
    result: list[dict[int, int | tuple[int, ...]]] = [{} for _ in range(count)]
    for number in numbers:
        fap = faps()[number - 1]
        assert fap.i_limits is not None
        low, high = (limit * fap.step for limit in fap.i_limits)
        for frame, value in enumerate(walk(count, low, high, seed * 1000 + number)):
            result[frame][number] = value
    for frame in range(count):
        if viseme:
            result[frame][1] = viseme_fields(frame)
        if expression:
            result[frame][2] = expression_fields(frame)
    return result


def viseme_fields(frame: int) -> tuple[int, ...]:
    """Return select1, select2, blend and viseme_def, which go through their ranges."""
    selects = VISEME_SELECT_MAX + 1
    return frame % selects, frame * 7 % selects, frame * 11 % (INTENSITY_MAX + 1), int(frame % 5 == 4)


def expression_fields(frame: int) -> tuple[int, ...]:
    """Return select1, intensity1, select2, intensity2, init_face and expression_def: likewise."""
    selects, amounts = EXPRESSION_SELECT_MAX + 1, INTENSITY_MAX + 1
    return (
        frame % selects, frame * 5 % amounts, frame * 3 % selects, INTENSITY_MAX - frame * 9 % amounts,
        int(frame % 7 == 3), int(frame % 6 == 5),
    )  # fmt: skip


def bodies(
    count: int, numbers: Sequence[int] = STANDARD_BAPS, *, table: BapTable = "iso", seed: int = 2
) -> list[dict[int, int | tuple[int, ...]]]:
    """Return BAPs that walk within the standard's limits, a dictionary for each plane."""
    result: list[dict[int, int | tuple[int, ...]]] = [{} for _ in range(count)]
    for number in numbers:
        bap = baps()[number - 1]
        low, high = bap.i_limits or (-EXTENSION_LIMIT, EXTENSION_LIMIT)
        step = bap.step_iso if table == "iso" else bap.step_visage
        for frame, value in enumerate(walk(count, low * step, high * step, seed * 1000 + number)):
            result[frame][number] = value
    return result


def script(
    fap_values: Sequence[Values] | None = None,
    bap_values: Sequence[Values] | None = None,
    *,
    intra: Sequence[int] = (0,),
    fap: Header = USUAL_HEADER,
    bap: Header = USUAL_HEADER,
    rate: tuple[int, int, int] | None = RATE_25,
) -> list[Plane]:
    """Return planes with these values. intra: numbers of the I planes. rate: said by the first plane."""
    count = len(fap_values if fap_values is not None else bap_values or ())
    return [
        Plane(
            fap_values[number] if fap_values is not None else None,
            bap_values[number] if bap_values is not None else None,
            number in intra,
            fap,
            bap,
            rate if number == 0 else None,
        )
        for number in range(count)
    ]


def scripted(*values: Sequence[Values] | None, **options: Any) -> Callable[[], bytes]:
    """Return a maker of the stream that `script` describes."""
    return lambda: write_stream(script(*values, **options))


def edited(planes: Sequence[Plane], edits: Mapping[int, Mapping[str, Any]]) -> list[Plane]:
    """Return planes with other fields: {plane number: {field: value}}."""
    return [replace(plane, **edits.get(number, {})) for number, plane in enumerate(planes)]


def only(values: Sequence[Values], numbers: Sequence[int]) -> list[Values]:
    """Return the values of some parameters."""
    return [{number: one[number] for number in numbers} for one in values]
