"""Decoded values as text: what `fba conformance` compares, and what tested programs write and read.

::

    fba-values 1
    plane
    time 13/25
    viseme 1 0 63 0
    expression 3 40 0 0 0 0
    fap 3 120
    bap 19 -1792
    end

A line `plane` begins each plane; the lines after it say what the plane sends, in the standard's units.
`error` and any text says that the stream is damaged here. `end` is the last line. docs/test-a-codec.md has
the rest.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from hashlib import sha256
from typing import Any

import numpy as np

from fba.animation import Frame
from fba.arrays import Bool, Int32
from fba.codec import Block
from fba.errors import FormatError
from fba.parameters import BAP_COUNT, EXPRESSION_FIELDS, FAP_COUNT, VISEME_FIELDS

HEADER = "fba-values 1"
TIME_TOLERANCE = Fraction(1, 1000)
"""Seconds by which a time may differ: some decoders count in milliseconds."""
LONGEST_DENOMINATOR = 10**6
"""Times with a larger denominator are written as decimal numbers."""

_FIELDS = {"viseme": len(VISEME_FIELDS), "expression": len(EXPRESSION_FIELDS)}
_COUNTS = {"fap": FAP_COUNT, "bap": BAP_COUNT}
_INTEGER = re.compile(r"[+-]?[0-9]{1,18}", re.ASCII)
_TIME = re.compile(r"[0-9]{1,18}(\.[0-9]{1,18}|/[0-9]{1,18})?", re.ASCII)
_SHOWN = 40
"""Most characters of a wrong line that an error shows."""


@dataclass(frozen=True)
class PlaneValues:
    """What a plane sends.

    time: seconds, None where nothing says it. viseme: 4 numbers, expression: 6, None where they are not sent.
    fap, bap: value by number.
    """

    time: Fraction | None = None
    viseme: tuple[int, ...] | None = None
    expression: tuple[int, ...] | None = None
    fap: Mapping[int, int] = field(default_factory=dict)
    bap: Mapping[int, int] = field(default_factory=dict)

    def without_time(self) -> PlaneValues:
        """Return the same values without a time."""
        return replace(self, time=None)

    def lines(self) -> Iterator[str]:
        """Yield the lines of the plane, always in the same order."""
        yield "plane"
        if self.time is not None:
            yield f"time {_time_text(self.time)}"
        for name, fields in (("viseme", self.viseme), ("expression", self.expression)):
            if fields is not None:
                yield f"{name} {' '.join(map(str, fields))}"
        for name, values in (("fap", self.fap), ("bap", self.bap)):
            for number in sorted(values):
                yield f"{name} {number} {values[number]}"


@dataclass(frozen=True)
class Listing:
    """Decoded planes, in order.

    error_after: number of planes before the first damage, None if none was found. ended: the text has its
    last line, `end`.
    """

    planes: Sequence[PlaneValues]
    error_after: int | None = None
    ended: bool = True

    def text(self) -> str:
        """Return the listing as text."""
        lines = [HEADER]
        for number, plane in enumerate(self.planes):
            if number == self.error_after:
                lines.append("error")
            lines += plane.lines()
        if self.error_after == len(self.planes):
            lines.append("error")
        return "\n".join([*lines, "end", ""])

    def digest(self) -> str:
        """Return the SHA-256 digest of the text, hexadecimal."""
        return sha256(self.text().encode()).hexdigest()

    def difference(self, other: Listing) -> str:
        """Return the first difference of another listing, "" without one. The other may lack all times."""
        timed = any(plane.time is not None for plane in other.planes)
        for number, (ours, theirs) in enumerate(zip(self.planes, other.planes, strict=False)):
            text = _plane_difference(ours, theirs, timed=timed)
            if text:
                return f"plane {number}: {text}"
        if len(self.planes) != len(other.planes):
            return f"{len(other.planes)} planes, expected {len(self.planes)}"
        return ""


def _time_text(time: Fraction) -> str:
    """Return a time as a fraction, or with nine decimals where rates that changed make the fraction long."""
    if time.denominator <= LONGEST_DENOMINATOR:
        return str(time)
    seconds, billionths = divmod(round(time * 10**9), 10**9)
    return f"{seconds}.{billionths:09}"


def _plane_difference(expected: PlaneValues, found: PlaneValues, *, timed: bool) -> str:
    """Return how a plane differs from what was expected, or "". timed: some planes have times."""
    for name in ("viseme", "expression"):
        ours, theirs = getattr(expected, name), getattr(found, name)
        if ours != theirs:
            return f"{name} is {_shown(theirs)}, expected {_shown(ours)}"
    for name in ("fap", "bap"):
        numbers, others = getattr(expected, name), getattr(found, name)
        for number in sorted({*numbers, *others}):
            if numbers.get(number) != others.get(number):
                found_text, expected_text = (_shown(one.get(number)) for one in (others, numbers))
                return f"{name.upper()} {number} is {found_text}, expected {expected_text}"
    if expected.time is None or not timed:
        return ""
    if found.time is None:
        return f"it has no time, expected {float(expected.time):g} s"
    if abs(expected.time - found.time) <= TIME_TOLERANCE:
        return ""
    return f"its time is {float(found.time):.6g} s, expected {float(expected.time):.6g} s"


def _shown(value: int | tuple[int, ...] | None) -> str:
    """Return values as an error shows them."""
    if value is None:
        return "not sent"
    return str(value) if isinstance(value, int) else " ".join(map(str, value))


def read_values(text: str, path: str = "") -> Listing:
    """Return the listing that a text holds. Raises FormatError(path, line) for what the format does not have.

    A text that breaks off is read as far as it goes; `Listing.ended` says so.
    """
    planes: list[PlaneValues] = []
    error_after: int | None = None
    started = ended = False
    for number, line in enumerate(text.splitlines(), 1):
        words = line.partition("#")[0].split()
        try:
            if not words:
                continue
            if not started:
                started = words == HEADER.split()
                if not started:
                    raise ValueError(f"expected the first line {HEADER!r}")
            elif ended:
                raise ValueError("a line after `end`")
            elif words == ["end"]:
                ended = True
            elif words[0] == "error":
                error_after = len(planes) if error_after is None else error_after
            elif words == ["plane"]:
                planes.append(PlaneValues(fap={}, bap={}))
            else:
                if not planes:
                    raise ValueError("values before the first line `plane`")
                planes[-1] = _with_line(planes[-1], words)
        except ValueError as error:
            shown = line if len(line) <= _SHOWN else f"{line[:_SHOWN]}..."
            raise FormatError(f"{error}; the line is {shown!r}", path=path or None, line=number) from None
    return Listing(planes, error_after, ended)


def _with_line(plane: PlaneValues, words: Sequence[str]) -> PlaneValues:
    """Return a plane with what a line says about it; ValueError for a line that the format does not have."""
    name, *numbers = words
    if name == "time":
        if plane.time is not None or len(numbers) != 1 or not _TIME.fullmatch(numbers[0]):
            raise ValueError("expected one `time` in a plane, with one number of seconds: 0.52 or 13/25")
        try:
            return replace(plane, time=Fraction(numbers[0]))
        except ZeroDivisionError:
            raise ValueError("a time divided by 0") from None
    if name not in _FIELDS and name not in _COUNTS:
        raise ValueError("expected plane, time, viseme, expression, fap, bap, error or end")
    if not all(_INTEGER.fullmatch(one) for one in numbers):
        raise ValueError(f"expected integers after `{name}`")
    values = [int(one) for one in numbers]
    if name in _FIELDS:
        if getattr(plane, name) is not None or len(values) != _FIELDS[name]:
            raise ValueError(f"expected one `{name}` in a plane, with {_FIELDS[name]} numbers")
        fields = tuple(values)
        return replace(plane, viseme=fields) if name == "viseme" else replace(plane, expression=fields)
    held: dict[int, int] = getattr(plane, name)
    if len(values) != 2 or not 1 <= values[0] <= _COUNTS[name] or values[0] in held:
        raise ValueError(
            f"expected `{name}`, a number in 1..{_COUNTS[name]} that the plane has not yet, and a value"
        )
    held[values[0]] = values[1]  # a plane's own dictionary: copying it for each line would take its square
    return plane


def trace_values(planes: Iterable[Mapping[str, Any]], *, times: bool = True) -> list[PlaneValues]:
    """Return what `trace.planes` yields as values. times: with the times."""
    return [
        PlaneValues(
            plane["time"] if times else None,
            tuple(plane["viseme"]) if plane["viseme"] is not None else None,
            tuple(plane["expression"]) if plane["expression"] is not None else None,
            plane["fap"],
            plane["bap"],
        )
        for plane in planes
    ]


def block_values(blocks: Iterable[Block], *, times: bool = True) -> list[PlaneValues]:
    """Return what a `Decoder` returns as values. times: with the times."""
    result = []
    for block in blocks:
        count, first = len(block.index), int(block.index[0])
        visemes: list[tuple[int, ...] | None] = [None] * count
        expressions: list[tuple[int, ...] | None] = [None] * count
        faps: list[dict[int, int]] = [{} for _ in range(count)]
        baps: list[dict[int, int]] = [{} for _ in range(count)]
        if block.face is not None:
            masks = block.face.mask
            rows = zip(
                masks[:, :2].tolist(), block.face.viseme.tolist(), block.face.expression.tolist(), strict=True
            )
            for row, (sent, viseme, expression) in enumerate(rows):
                visemes[row] = tuple(viseme) if sent[0] else None
                expressions[row] = tuple(expression) if sent[1] else None
            faps = _by_number(block.face.values, masks, first=2)
        if block.body is not None:
            baps = _by_number(block.body.values, block.body.mask, first=0)
        for row, index in enumerate(block.index.tolist()):
            time = block.start + Fraction(index - first) / block.rate if times else None
            result.append(PlaneValues(time, visemes[row], expressions[row], faps[row], baps[row]))
    return result


def _by_number(values: Int32, masks: Bool, *, first: int) -> list[dict[int, int]]:
    """Return the values of rows by number. values, masks: (T, columns), from column `first` on.

    Planes of a block send the same, or, where they lack the part, nothing.
    """
    columns = np.flatnonzero(masks[:, first:].any(axis=0)) + first
    numbers = (columns + 1).tolist()
    sent = np.any(masks[:, columns], axis=1).tolist()
    rows = zip(sent, values[:, columns].tolist(), strict=True)
    return [dict(zip(numbers, row, strict=True)) if here else {} for here, row in rows]


def plane_records(frames: Iterable[Frame]) -> list[dict[str, Any]]:
    """Return the content of the planes of decoded frames, in the form of the independent reader."""
    records = []
    for frame in frames:
        record: dict[str, Any] = {
            "intra": frame.plane.settings.intra,
            "skip": frame.plane.settings.skip,
            "rate": str(frame.rate),
            "bits": frame.plane.bits,
            "fap": {},
            "viseme": None,
            "expression": None,
            "bap": {},
        }
        if frame.face is not None:
            mask, values = frame.face.mask[0], frame.face.values[0]
            record["fap"] = {str(i + 1): int(values[i]) for i in mask[2:].nonzero()[0] + 2}
            record["viseme"] = frame.face.viseme[0].tolist() if mask[0] else None
            record["expression"] = frame.face.expression[0].tolist() if mask[1] else None
        if frame.body is not None:
            mask, values = frame.body.mask[0], frame.body.values[0]
            record["bap"] = {str(i + 1): int(values[i]) for i in mask.nonzero()[0]}
        records.append(record)
    return records
