"""Read an FBA stream independently of `fba.codec`: its syntax elements with bit positions, and its values.

Implements ISO/IEC 14496-2, FBA object, without code of `fba.codec`, and is hundreds of times slower. Use
`trace` to find what is wrong with a stream, `decode_values` to check a decoder.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from fractions import Fraction
from typing import Any, cast

from fba.errors import FbaError, warn
from fba.parameters import BAP_STEP_TABLES, BapTable
from fba.recognition import HEAD_BYTES, recognition_hint
from fba_conformance._part import HighLevel, Part
from fba_conformance._reader import (
    OBJECT_START_CODES,
    PLANE_START_CODES,
    TRAILING_BYTES_SHOWN,
    USER_DATA_START_CODE,
    Element,
    Levels,
    Reader,
)
from fba_conformance.listing import element_dict, format_trace

__all__ = ["Element", "Levels", "Walker", "decode_values", "element_dict", "format_trace", "planes", "trace"]

FAP_BIT = 1
BAP_BIT = 2
"""Bits of fba_object_mask."""
_NAMED_STEPS = re.compile(rb"\x00\x00\x01\xb2fba bap_steps=(iso|visage);")
"""The mark before an object."""
_CHECKED = re.compile(rb"fba (?:bap_steps=[a-z]+;)?crc32=[0-9]+;")
"""The words of a mark behind an object that a list of checks follows."""
SKIP_MORE = 15
"""Value of a word of number_of_frames_to_skip after which another word follows."""


def trace(data: bytes, *, bap_steps: BapTable | None = None) -> Iterator[Element]:
    """Yield every syntax element of a stream, in order.

    bap_steps: "iso" or "visage", the table of BAP steps that the writer used; it only changes values. None:
    the one that a mark before the object names, else "iso".

    Yields the elements before damage, then raises BitstreamError(plane, bit), which names the damaged
    element; UnsupportedError for DCT segments; ValueError for another bap_steps.
    """
    walker = Walker(data, bap_steps=bap_steps or named_steps(data))
    more = True
    while more:
        try:
            more = walker.step()
        except FbaError:
            yield from walker.reader.drain()
            raise
        yield from walker.reader.drain()


def planes(data: bytes, *, bap_steps: BapTable | None = None) -> Iterator[dict[str, Any]]:
    """Yield the content of each plane, in order; raises like `trace`, after the last undamaged plane.

    Keys: number; bit and bits (where it starts and its length, start code and stuffing before it
    included); intra; parts (bit 0 FAPs, bit 1 BAPs); start_code (or None); rate (exact fraction or None
    where no plane has said it); frame_rate (three numbers, or None); time_code (hours, minutes, marker,
    seconds, or None); skip; time (seconds, exact, or None where a rate is missing); fap_quant and
    bap_quant, fap_mask_types, fap_lists and bap_lists (which range lists the last I plane sent);
    fap (value by number, 3..68), viseme (4 numbers or None), expression (6 or None), bap (value by
    number), as far as the plane carries them.
    """
    walker = Walker(data, bap_steps=bap_steps or named_steps(data))
    more = True
    while more:
        before = walker.count
        more = walker.step()
        walker.reader.drain()
        if walker.count > before:
            yield walker.record


def decode_values(data: bytes, *, bap_steps: BapTable | None = None) -> list[dict[str, Any]]:
    """Return `planes` as a list. For untrusted streams use `planes`: a plane may have only six bits."""
    return list(planes(data, bap_steps=bap_steps))


def _find_code(data: bytes, code: int, start: int) -> int:
    """Return the byte at which a start code begins, from byte `start` on; the length of data without one."""
    position = data.find(code.to_bytes(4, "big"), start)
    return position if position >= 0 else len(data)


def named_steps(data: bytes) -> BapTable:
    """Return the table of BAP steps that a mark before the object names, else "iso"."""
    before = data[: min(_find_code(data, code, 0) for code in OBJECT_START_CODES)]
    named = _NAMED_STEPS.search(before)
    return cast("BapTable", named[1].decode()) if named is not None else BAP_STEP_TABLES[0]


class Walker:
    """Reads one object, one plane at each step. `record` describes the last plane (see `planes`).

    byte_aligned: take 23 zero bits at the next byte boundary for a start code, whatever stands before them,
    as the standard's look-ahead can be read. Streams are to be written so that this makes no difference.
    """

    def __init__(
        self, data: bytes, *, bap_steps: BapTable = BAP_STEP_TABLES[0], byte_aligned: bool = False
    ) -> None:
        if bap_steps not in BAP_STEP_TABLES:
            raise ValueError(f"bap_steps must be one of {', '.join(BAP_STEP_TABLES)}, not {bap_steps!r}")
        self.reader = Reader(bytes(data), byte_aligned=byte_aligned)
        self.fap = Part("fap")
        self.bap = Part("bap", bap_steps)
        self.viseme = HighLevel("viseme")
        self.expression = HighLevel("expression")
        self.count = 0
        self.record: dict[str, Any] = {}
        self.rate: Fraction | None = None
        self.clock: Fraction | None = Fraction(0)
        self._started = False

    def step(self) -> bool:
        """Read the next plane, with stuffing and start codes before it; False at the end of the object."""
        if not self._started:
            self._read_object_start()
            self._started = True
        reader = self.reader
        begin, start_code = reader.bit, None
        reader.plane = None
        while (
            stuffing := reader.stuffing_before_start_code(behind_start_code=start_code is not None)
        ) is not None:
            code = reader.start_code(stuffing)
            if code not in PLANE_START_CODES:
                self._read_rest(in_object=code in OBJECT_START_CODES)
                return False
            start_code = code
        if start_code is None and reader.only_stuffing_left():
            if reader.bit < reader.size:
                reader.flags("alignment stuffing", reader.size - reader.bit, "object")
            return False
        reader.plane = self.count
        self.record = {"number": self.count, "bit": begin, "start_code": start_code}
        self._read_plane()
        self.record["bits"] = reader.bit - begin
        self.count += 1
        return True

    def _read_object_start(self) -> None:
        """Read the object's start code; visual object sequence and visual object headers may precede."""
        reader = self.reader
        start = min(_find_code(reader.data, code, 0) for code in OBJECT_START_CODES)
        if start == len(reader.data) or not reader.data.startswith(b"\0\0\1"):
            raise reader.error(
                f"an FBA object starts with {' or '.join(f'{c:08x}' for c in OBJECT_START_CODES)}, "
                f"found {reader.data[:4].hex() or 'nothing'}"
                f"{recognition_hint(reader.data[:HEAD_BYTES]) or '; is this an FBA stream?'}",
                bit=0,
            )
        if start:
            reader.bit = 8 * start
            shown = reader.data[: min(start, TRAILING_BYTES_SHOWN)].hex()
            reader.record(0, "headers before the object", shown, "object")
        reader.start_code(0)

    def _read_rest(self, *, in_object: bool) -> None:
        """Record user data after the object, and all other data there as one element.

        A plane that belongs to no object is an error. in_object: the next object has begun.
        """
        reader = self.reader
        objects = [_find_code(reader.data, code, reader.bit // 8) for code in OBJECT_START_CODES]
        stray = [_find_code(reader.data, code, reader.bit // 8) for code in PLANE_START_CODES]
        if min(stray) < min(objects) and not in_object:
            reader.plane = self.count
            raise reader.error("a plane start code behind the end of the object", bit=8 * min(stray))
        user_data = USER_DATA_START_CODE.to_bytes(4, "big")
        while reader.data[reader.bit // 8 :].startswith(user_data):
            reader.start_code(0)
            bit, after = reader.bit, reader.data.find(b"\0\0\1", reader.bit // 8)
            reader.bit = 8 * after if after >= 0 else reader.size
            content = reader.data[bit // 8 : reader.bit // 8]
            checks = _CHECKED.match(content)
            if checks is not None:
                reader.bit = bit + 8 * checks.end()
                reader.record(bit, "user_data", checks[0].decode(), "object")
                bit, reader.bit = reader.bit, bit + 8 * len(content)
                reader.record(bit, "checks", content[checks.end() :].hex(), "object")
                continue
            text = content.decode() if content.isascii() else content[:TRAILING_BYTES_SHOWN].hex()
            reader.record(bit, "user_data", text, "object")
        left = reader.size - reader.bit
        if left:
            bit = reader.bit
            reader.bit = reader.size
            reader.record(
                bit, "trailing data", reader.data[bit // 8 :][:TRAILING_BYTES_SHOWN].hex(), "object"
            )

    def _read_plane(self) -> None:
        """Read a plane into `record`."""
        reader = self.reader
        intra = bool(reader.number("is_intra", 1, "plane"))
        parts = reader.number("fba_object_mask", 2, "plane")
        if not parts:
            raise reader.error("fba_object_mask is 0, expected 1 FAPs, 2 BAPs or 3 both", bit=reader.bit - 2)
        for bit, part in ((FAP_BIT, self.fap), (BAP_BIT, self.bap)):
            if parts & bit and not intra and part.quant is None:
                raise reader.error(
                    f"fba_object_mask says {part.kind.upper()}s in a predicted plane, "
                    "but no I plane carried them before",
                    bit=reader.bit - 2,
                )
        self.record.update(intra=intra, parts=parts)
        self._read_time(intra)
        self.record.update(fap={}, viseme=None, expression=None, bap={})
        if parts & FAP_BIT:
            self._read_faps(intra)
        if parts & BAP_BIT:
            if intra:
                self.bap.read_header(reader)
            self.record["bap"] = self.bap.read_values(reader, intra=intra)
        for part in (self.fap, self.bap):
            self.record[f"{part.kind}_quant"] = part.quant
            self.record[f"{part.kind}_mask_types"] = tuple(part.mask_types)
            self.record[f"{part.kind}_lists"] = part.lists_sent

    def _read_time(self, intra: bool) -> None:
        """Read frame rate, time code and skip of a plane into `record`."""
        reader, record = self.reader, self.record
        record.update(frame_rate=None, time_code=None)
        if intra and reader.number("is_frame_rate", 1, "plane"):
            integral = reader.number("frame_rate", 8, "plane")
            sixteenths = reader.number("seconds", 4, "plane")
            offset = reader.number("frequency_offset", 1, "plane")
            record["frame_rate"] = (integral, sixteenths, offset)
            self.rate = (integral + Fraction(sixteenths, 16)) * (Fraction(1000, 1001) if offset else 1)
        if intra and reader.number("is_time_code", 1, "plane"):
            hours = reader.number("time_code_hours", 5, "plane")
            minutes = reader.number("time_code_minutes", 6, "plane")
            marker = reader.number("marker_bit", 1, "plane")
            seconds = reader.number("time_code_seconds", 6, "plane")
            record["time_code"] = (hours, minutes, marker, seconds)
            self.clock = Fraction((hours * 60 + minutes) * 60 + seconds)
            if not marker:
                warn(
                    f"plane {reader.plane}, bit {reader.bit - 7}: the marker bit of the time code is 0, "
                    "expected 1; the time code was read all the same",
                    stacklevel=2,
                )
        skip = 0
        if reader.number("skip_frames", 1, "plane"):
            word = SKIP_MORE
            while word == SKIP_MORE:
                word = reader.number("number_of_frames_to_skip", 4, "plane")
                skip += word
        record.update(rate=self.rate, skip=skip, time=self.clock)
        if self.clock is not None:
            self.clock = self.clock + (1 + skip) / self.rate if self.rate else None

    def _read_faps(self, intra: bool) -> None:
        """Read the FAP half of a plane into `record`."""
        reader, fap = self.reader, self.fap
        if intra:
            fap.read_header(reader)
            for high in (self.viseme, self.expression):
                high.begin(fap.quant or 0)
        for number, high in ((1, self.viseme), (2, self.expression)):
            if number in fap.mask:
                self.record[high.name] = high.read(reader, intra=intra)
        self.record["fap"] = fap.read_values(reader, intra=intra)
