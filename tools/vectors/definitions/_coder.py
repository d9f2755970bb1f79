"""Vectors of the arithmetic coder: inserted bits, closing bits, learning counts, halved counts.

In an I plane all counts are 1, so ranges and levels alone make the bits: the highest levels make zeros, the
middle ones leave the first bit open. The levels here were searched for; `coverage` proves what they reach.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from tools.vectors.definitions._targets import (
    FEW_BAPS,
    FEW_FAPS,
    LOW_LEVEL,
    RATE_25,
    edited,
    faces,
    noise,
    script,
)
from tools.vectors.definitions.case import Case
from tools.vectors.stream_writer import PLANE, WIDEST, Header, Plane, Values, write_stream

_FAR = 2**40
_STEPS = {3: 4, 4: 2, 5: 2}
_BAP_STEP = 64
"""Of BAPs 1 to 3."""
_HALVED_PLANES = 12_800
"""Counts of 3721 symbols, the most that there are, add up to 16383 behind 12,662 P planes."""
_OPEN = {20: (9, 2, -9), 21: (1, 3, -14), 22: (17, 2, -31)}
"""Zeros at the end of a segment: code of all ranges, number of FAPs, level of the last (of the others 0)."""


def coder_cases() -> Iterator[Case]:
    """Yield streams of the arithmetic coder's rules."""
    yield Case("rest", "a face and a body at rest: symbols of less than a bit", _rest)
    yield Case(
        "highest",
        "the highest levels in I and P planes: zeros, of which every 23rd is preceded by a 1",
        lambda: _ends(1),
    )
    yield Case("lowest", "the lowest levels in I and P planes: ones", lambda: _ends(-1))
    yield Case(
        "high_level_zeros",
        "inserted bits in the segments of viseme and expression, behind 150 planes at rest",
        _high_level_zeros,
    )
    yield Case(
        "inserted_before_closing",
        "22 zeros before the two closing bits: a 1 between",
        lambda: _full_ranges(17),
    )
    yield Case(
        "inserted_within_closing",
        "22 zeros, the last of them a closing bit: a 1 before the other",
        lambda: _full_ranges(12),
    )
    for zeros, text in (
        (20, "a segment that ends in 20 zeros; with the header behind it 22, behind which no 1 is inserted"),
        (21, "the same with 21 zeros and the header of a BAP plane"),
        (22, "a segment that ends in 22 zeros: no 1 is inserted behind it"),
    ):
        yield Case(f"zeros_at_end_{zeros}", text, partial(_open_end, zeros))
    yield Case(
        "counts_learnt", "differences that repeat, so that they cost less and less, then a rare one", _learnt
    )
    yield Case(
        "counts_reset", "an I plane sets the counts of P planes back, and those of its own half only", _reset
    )
    yield Case("alphabets_largest", "3721 symbols for each of 66 FAPs", _largest)
    yield Case(
        "counts_halved",
        f"counts that reach 16383 and are halved, odd ones rounded up: {_HALVED_PLANES} planes, fewer cannot",
        _halved,
    )  # fmt: skip


def _rest() -> bytes:
    fap, bap = dict.fromkeys(LOW_LEVEL, 0), dict.fromkeys(FEW_BAPS, 0)
    return write_stream(script([fap] * 20, [bap] * 20))


def _ends(sign: int) -> bytes:
    """Return a stream of I planes, each followed by P planes, at one end of all ranges.

    P planes have start codes before them: 4 bits and 22 zeros look like one themselves.
    """
    fap, bap = dict.fromkeys(FEW_FAPS, sign * _FAR), dict.fromkeys(FEW_BAPS, sign * _FAR)
    planes = script([fap] * 8, [bap] * 8, intra=(0, 2, 4))
    return write_stream(edited(planes, {n: {"start_code": PLANE} for n in (1, 3, 5, 6, 7)}))


def _high_level_zeros() -> bytes:
    """Return planes at rest until any change is rare, and then one to the highest values.

    The viseme's three alphabets are so small that this takes more than a hundred planes.
    """
    low, high = (0, 0, 0, 0), (14, 14, 63, 0)
    values: list[Values] = [{1: low, 2: (0, 0, 0, 0, 0, 0)}] * 150
    return write_stream(script([*values, {1: high, 2: (6, 63, 6, 63, 0, 0)}, values[0]]))


def _full_ranges(code: int) -> bytes:
    header = Header(code=code)
    return write_stream(script([{3: _FAR, 4: _FAR}, {3: 0, 4: 0}] * 3, intra=(0, 2, 4), fap=header))


def _open_end(zeros: int) -> bytes:
    """Return I planes whose FAP segment ends in that many zeros, before planes of each kind."""
    code, count, level = _OPEN[zeros]
    header = Header(code=code)
    numbers = (3, 4, 5)[:count]
    values = {number: level * _STEPS[number] if number == numbers[-1] else 0 for number in numbers}
    body = {number: level * _BAP_STEP if number == count else 0 for number in range(1, count + 1)}
    intra, moved = Plane(values, None, True, header, rate=RATE_25), Plane(dict.fromkeys(numbers, 40))
    body_intra = Plane(None, body, True, bap_header=header, rate=RATE_25)
    body_moved = Plane(None, dict.fromkeys(body, 640))
    return write_stream(
        [body_intra, intra, moved, intra, body_moved, intra, intra, body_intra, body_moved, moved]
    )


def _learnt() -> bytes:
    values: list[Values] = [{3: 40 * frame, 4: -20 * (frame % 2), 48: 0} for frame in range(17)]
    return write_stream(
        script([*values, {3: 0, 4: 100, 48: 5000}, {3: 40, 4: -20, 48: 5000}, {3: 80, 4: 0, 48: 0}])
    )


def _reset() -> bytes:
    planes = script(
        [{3: 40 * frame, 4: 20} for frame in range(18)], [{1: 640 * frame} for frame in range(18)], intra=(0,)
    )
    for place in (6, 12):
        one = planes[place]
        half = Plane(one.fap, None, True) if place == 6 else Plane(None, one.bap, True)
        planes[place] = half
    return write_stream(planes)


def _largest() -> bytes:
    return write_stream(script(faces(6, seed=12), intra=(0, 3), fap=Header(code=WIDEST)))


def _halved() -> bytes:
    """FAP 3 drifts, rests and jumps, so that there are odd and even counts of every size."""
    jumps = noise(7, 97)
    values: list[Values] = [{3: 0}]
    for frame in range(1, _HALVED_PLANES):
        jaw = values[-1][3]
        if frame % 16 == 0:
            jaw = (next(jumps) - 48) * _STEPS[3] * (1 + frame // 16 % 7)
        values.append({3: jaw})
    return write_stream(script(values, fap=Header(code=WIDEST), rate=(100, 0, 0)))
