"""Reading an FBA stream by name: every read leaves an `Element` that says what stood where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bitstring import ConstBitStream

from fba.errors import BitstreamError
from fba_conformance._textbook import FrequencyTable, decode_segment

PREFIX_BITS = 24
START_CODE_BITS = 32
TRAILING_BYTES_SHOWN = 16


@dataclass(frozen=True, slots=True)
class Element:
    """One syntax element.

    bit: its first bit, counted from the start of the data. bits: its length. plane: number of the plane
    (0-based, in stream order) that it belongs to, None outside planes. name: as in the standard, with the
    parameter where it belongs to one. value: an int, a string of bits for masks, or `Levels`. section:
    the part of the syntax it stands in: object, plane, fap, bap, "fap ranges", ...
    """

    bit: int
    bits: int
    plane: int | None
    name: str
    value: object
    section: str


@dataclass(frozen=True, slots=True)
class Levels:
    """Content of an arithmetic segment, parameter by parameter in coding order.

    parameters: their labels. levels: what was coded (in P planes the difference, in quantiser steps).
    values: the parameters after it, in the standard's units. inserted: 1 bits inserted against start codes.
    """

    parameters: tuple[str, ...]
    levels: tuple[int, ...]
    values: tuple[int, ...]
    inserted: int


class Reader:
    """Takes elements from data and keeps them until `drain`."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.stream = ConstBitStream(data)
        self.size = len(data) * 8
        self.plane: int | None = None
        self._elements: list[Element] = []

    @property
    def bit(self) -> int:
        return int(self.stream.pos)

    def drain(self) -> list[Element]:
        """The elements taken since the last call."""
        elements, self._elements = self._elements, []
        return elements

    def error(self, message: str, *, bit: int | None = None) -> BitstreamError:
        return BitstreamError(message, plane=self.plane, bit=self.bit if bit is None else bit)

    def note(self, bit: int, name: str, value: object, section: str) -> None:
        """Keep an element that reaches from `bit` to here."""
        self._elements.append(Element(bit, self.bit - bit, self.plane, name, value, section))

    def _need(self, name: str, bits: int) -> None:
        if self.bit + bits > self.size:
            raise self.error(
                f"{name}: needs {bits} bits, but the data ends after {self.size - self.bit}; "
                "the stream is cut or damaged"
            )

    def number(self, name: str, bits: int, section: str) -> int:
        """An unsigned integer, most significant bit first."""
        self._need(name, bits)
        bit = self.bit
        value = int(self.stream.read(f"uint:{bits}"))
        self.note(bit, name, value, section)
        return value

    def flags(self, name: str, bits: int, section: str) -> str:
        """A row of flags as a string of 0 and 1."""
        self._need(name, bits)
        bit = self.bit
        value = str(self.stream.read(f"bin:{bits}"))
        self.note(bit, name, value, section)
        return value

    def marker(self, section: str) -> None:
        """A marker bit, which must be 1."""
        if not self.number("marker_bit", 1, section):
            raise self.error(
                f"marker_bit in {section} is 0, expected 1; the stream is damaged here or before",
                bit=self.bit - 1,
            )

    def segment(
        self, name: str, tables: Sequence[FrequencyTable], section: str, *, learn: bool
    ) -> tuple[tuple[int, ...], int, int]:
        """An arithmetic segment: its symbols, its first bit and the number of inserted bits.

        The caller knows what the symbols mean, and notes the element.
        """
        start = self.bit
        segment = decode_segment(
            self.data, start, tables, learn=learn, name=f"{name} ({section})", plane=self.plane
        )
        self.stream.pos = start + segment.bits
        return segment.symbols, start, segment.inserted

    def stuffing_before_start_code(self, *, behind_start_code: bool = False) -> int | None:
        """Bits of alignment stuffing between here and a start code; None where none follows.

        Stuffing is a 0 and then 1s to the byte boundary: 1 to 8 bits. Where we are aligned already it may
        be missing; behind another start code it must be, for there the byte 0x7F can begin a plane. (A P
        plane with BAPs may look like stuffing and a start code in other places too: the guard against
        emulation counts zeros in its segment only. A writer must set a plane start code before such a one.)
        """
        unaligned = -self.bit % 8
        for bits in (unaligned,) if unaligned else (0,) if behind_start_code else (0, 8):
            if self.bit + bits + PREFIX_BITS > self.size:
                continue
            ahead = str(self.stream.peek(f"bin:{bits + PREFIX_BITS}"))
            if ahead[:bits] == _stuffing(bits) and ahead[bits:] == "0" * 23 + "1":
                return bits
        return None

    def only_stuffing_left(self) -> bool:
        """Whether nothing but alignment stuffing stands between here and the end of the data."""
        left = self.size - self.bit
        return left == 0 or (left <= 8 and str(self.stream.peek(f"bin:{left}")) == _stuffing(left))

    def start_code(self, stuffing: int) -> int:
        """The start code behind so many bits of stuffing."""
        if stuffing:
            self.flags("alignment stuffing", stuffing, "object")
        bit = self.bit
        self._need("start code", START_CODE_BITS)
        code = int(self.stream.read(f"uint:{START_CODE_BITS}"))
        self.note(bit, START_CODES.get(code, "start_code"), code, "object")
        return code


def _stuffing(bits: int) -> str:
    return "0" + "1" * (bits - 1) if bits else ""


OBJECT_START_CODES = (0x1BA, 0x101)
PLANE_START_CODES = (0x1BB, 0x103)
"""The second of each pair is what one vendor's older tools wrote."""
START_CODES = {
    0x1BA: "fba_object_start_code",
    0x101: "fba_object_start_code (old)",
    0x1BB: "fba_object_plane_start_code",
    0x103: "fba_object_plane_start_code (old)",
    0x1B1: "visual_object_sequence_end_code",
}
