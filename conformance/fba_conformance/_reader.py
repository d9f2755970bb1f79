"""Read an FBA stream by named elements; every read is recorded as an `Element`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from fba.errors import BitstreamError
from fba_conformance._textbook import FrequencyTable, decode_segment

PREFIX_BITS = 24
START_CODE_BITS = 32
TRAILING_BYTES_SHOWN = 16


@dataclass(frozen=True, slots=True)
class Element:
    """One syntax element.

    bit: its first bit, from the start of the data. bits: its length. plane: number of its plane (0-based, in
    stream order), None outside planes. name: as in the standard, with the parameter if it belongs to one.
    value: an int, a string of bits for masks, or `Levels`. section: its part of the syntax: object, plane,
    fap, bap, "fap ranges", ...
    """

    bit: int
    bits: int
    plane: int | None
    name: str
    value: object
    section: str


@dataclass(frozen=True, slots=True)
class Levels:
    """Content of an arithmetic segment, by parameter in coding order.

    parameters: their labels. levels: as coded, in quantiser steps (in P planes, differences). values: of the
    parameters after this plane, in the standard's units. inserted: number of 1 bits inserted against start
    codes.
    """

    parameters: tuple[str, ...]
    levels: tuple[int, ...]
    values: tuple[int, ...]
    inserted: int


class Reader:
    """Reads elements from data and records them until `drain`.

    byte_aligned: look for start codes at byte boundaries without regard to the bits before them.
    """

    def __init__(self, data: bytes, *, byte_aligned: bool = False) -> None:
        self.data = data
        self.byte_aligned = byte_aligned
        self.bit = 0
        """Position of the next bit."""
        self.size = len(data) * 8
        self.disputed: int | None = None
        """First bit at which the two methods of looking for start codes disagree."""
        self.plane: int | None = None
        self._elements: list[Element] = []

    def drain(self) -> list[Element]:
        """Return the elements recorded since the last call."""
        elements, self._elements = self._elements, []
        return elements

    def error(self, message: str, *, bit: int | None = None) -> BitstreamError:
        """Return an error in this plane, at the next bit or the given one."""
        return BitstreamError(message, plane=self.plane, bit=self.bit if bit is None else bit)

    def record(self, bit: int, name: str, value: object, section: str) -> None:
        """Record an element from `bit` to the next bit."""
        self._elements.append(Element(bit, self.bit - bit, self.plane, name, value, section))

    def _need(self, name: str, bits: int) -> None:
        """Raise BitstreamError if the data has fewer bits left."""
        if self.bit + bits > self.size:
            raise self.error(
                f"{name}: needs {bits} bits, but the data ends after {self.size - self.bit}; "
                "the stream is cut or damaged"
            )

    def number(self, name: str, bits: int, section: str) -> int:
        """Read an unsigned integer, most significant bit first."""
        self._need(name, bits)
        bit = self.bit
        value = self._read(bits)
        self.record(bit, name, value, section)
        return value

    def _ahead(self, bits: int) -> int:
        """Return the next bits, which must be there, as an unsigned integer."""
        begin, end = self.bit, self.bit + bits
        whole = int.from_bytes(self.data[begin >> 3 : (end + 7) >> 3], "big")
        return whole >> (-end & 7) & ((1 << bits) - 1)

    def _read(self, bits: int) -> int:
        """Read bits, which must be there, as an unsigned integer."""
        value = self._ahead(bits)
        self.bit += bits
        return value

    def flags(self, name: str, bits: int, section: str) -> str:
        """Read a row of flags; return a string of 0 and 1."""
        self._need(name, bits)
        bit = self.bit
        value = f"{self._read(bits):0{bits}b}"
        self.record(bit, name, value, section)
        return value

    def marker(self, section: str) -> None:
        """Read a marker bit, which must be 1."""
        if not self.number("marker_bit", 1, section):
            raise self.error(
                f"marker_bit in {section} is 0, expected 1; the stream is damaged here or before",
                bit=self.bit - 1,
            )

    def segment(
        self, name: str, tables: Sequence[FrequencyTable], section: str, *, learn: bool
    ) -> tuple[tuple[int, ...], int, int]:
        """Read an arithmetic segment; return its symbols, first bit and number of inserted bits.

        The caller, which knows what the symbols mean, records the element.
        """
        start = self.bit
        segment = decode_segment(
            self.data, start, tables, learn=learn, name=f"{name} ({section})", plane=self.plane
        )
        self.bit = start + segment.bits
        return segment.symbols, start, segment.inserted

    def stuffing_before_start_code(self, *, behind_start_code: bool = False) -> int | None:
        """Return the number of stuffing bits before a start code; None if no start code follows.

        Stuffing is a 0 and then 1s up to the byte boundary: 1 to 8 bits. At a byte boundary it may be
        missing; after another start code it must be missing, because there the byte 0x7F can begin a plane.
        A reader that only looks at byte boundaries (`byte_aligned`) skips other bits, too, and takes 23 zeros
        for a start code; behind one, it does not look for another.
        (A plane may look like stuffing and a start code, because the guard against emulation counts zeros in
        segments only. A writer must put a plane start code before such a plane.)
        """
        checked, aligned = (self._look(one, behind_start_code) for one in (False, True))
        if checked != aligned and self.disputed is None:
            self.disputed = self.bit
        return aligned if self.byte_aligned else checked

    def _look(self, byte_aligned: bool, behind_start_code: bool) -> int | None:
        """Return the stuffing before a start code as one kind of reader sees it."""
        if byte_aligned and behind_start_code:
            return None
        unaligned = -self.bit % 8
        for bits in (unaligned,) if unaligned else (0,) if behind_start_code else (0, 8):
            if self.bit + bits + PREFIX_BITS > self.size:
                continue
            stuffing, prefix = divmod(self._ahead(bits + PREFIX_BITS), 1 << PREFIX_BITS)
            if byte_aligned:
                if prefix <= 1 and (bits < 8 or stuffing == _stuffing(8)):
                    return bits
            elif prefix == 1 and stuffing == _stuffing(bits):
                return bits
        return None

    def only_stuffing_left(self) -> bool:
        """Return whether only alignment stuffing is left before the end of the data."""
        left = self.size - self.bit
        return left == 0 or (left <= 8 and self._ahead(left) == _stuffing(left))

    def start_code(self, stuffing: int) -> int:
        """Read that many bits of stuffing, and a start code; return the code."""
        if stuffing:
            self.flags("alignment stuffing", stuffing, "object")
        bit = self.bit
        self._need("start code", START_CODE_BITS)
        code = self._read(START_CODE_BITS)
        self.record(bit, START_CODES.get(code, "start_code"), code, "object")
        return code


def _stuffing(bits: int) -> int:
    """Return stuffing of that many bits, a 0 and then 1s, as an unsigned integer; 0 for none."""
    return (1 << (bits - 1)) - 1 if bits else 0


OBJECT_START_CODES = (0x1BA, 0x101)
PLANE_START_CODES = (0x1BB, 0x103)
"""The standard's code, and that of one vendor's older tools."""
USER_DATA_START_CODE = 0x1B2
START_CODES = {
    0x1BA: "fba_object_start_code",
    0x101: "fba_object_start_code (old)",
    0x1BB: "fba_object_plane_start_code",
    0x103: "fba_object_plane_start_code (old)",
    0x1B1: "visual_object_sequence_end_code",
    USER_DATA_START_CODE: "user_data_start_code",
}
