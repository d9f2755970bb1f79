"""Payloads of RTP packets: planes by RFC 3640 (with sizes) and by RFC 6416 (with start codes).

A *unit* is a plane that stands alone: its bits behind the start code, and stuffing up to a byte. By RFC 3640,
units follow a table of their sizes; by RFC 6416, each follows its start code. In both, a unit at which
decoding may begin comes behind the configuration and with a start code. At the end of a stream comes its end
code alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from fba.errors import FormatError

PayloadKind = Literal["3640", "6416"]
MOST_UNIT_BYTES = (1 << 13) - 1
"""Most bytes of a unit: more than any plane has, and all that a size of 13 bits can say."""
END_CODE = b"\0\0\1\xb1"
_PREFIX = b"\0\0\1"
_PLANE = b"\0\0\1\xbb"
_PLANE_CODES = (_PLANE, b"\0\0\1\3")
_OBJECT = b"\0\0\1\xba"
_OBJECT_CODES = (_OBJECT, b"\0\0\1\1")
_VISUAL = b"\0\0\1\xb5\x23"
"""visual_object_start_code, visual_object_type 4 (FBA), stuffing."""
FACE_PROFILE, BODY_PROFILE = 0x61, 0x64
"""profile_and_level_indication: Simple Face Animation, level 1; Simple FBA, level 2."""


class Unit(NamedTuple):
    """A plane on its own; without data, the end of the stream.

    configuration: the headers before it, up to the start code of the object; b"" without. joinable: whether
    decoding may begin with it; None where the payload does not say.
    """

    data: bytes
    configuration: bytes = b""
    joinable: bool | None = None


@dataclass(frozen=True)
class SizeTable:
    """The fields of an AU header, in bits (RFC 3640, 3.2.1): those of `fmtp` in a session's description."""

    sizelength: int = 13
    indexlength: int = 3
    indexdeltalength: int = 3
    ctsdeltalength: int = 0
    dtsdeltalength: int = 0
    randomaccessindication: int = 1
    streamstateindication: int = 0
    auxiliarydatasizelength: int = 0
    constantsize: int = 0

    def __post_init__(self) -> None:
        if any(not 0 <= width <= 32 for name, width in vars(self).items() if name != "constantsize"):
            raise ValueError("a field of an AU header has 0 to 32 bits")
        if self.randomaccessindication > 1:
            raise ValueError("randomAccessIndication is 0 or 1")
        if not self.sizelength and not 0 < self.constantsize <= MOST_UNIT_BYTES:
            raise ValueError("sizeLength or constantSize is needed")


SIZE_TABLE = SizeTable()
"""The fields that are written."""


def full_configuration(configuration: bytes) -> bytes:
    """Return the headers of a stream with all their levels: sequence, visual object, object.

    configuration: with all of them, or the start code of an object alone, as before a face.
    """
    if configuration.startswith(_PREFIX + b"\xb0"):
        return configuration
    return _PREFIX + bytes([0xB0, FACE_PROFILE]) + _VISUAL + _OBJECT


def write_size_table(units: Sequence[Unit]) -> bytes:
    """Return the payload of units by RFC 3640. Raises ValueError for a unit that is too long."""
    contents = [_with_codes(unit) if unit.configuration or not unit.data else unit.data for unit in units]
    width = SIZE_TABLE.sizelength + SIZE_TABLE.indexlength + SIZE_TABLE.randomaccessindication
    headers = 0
    for unit, content in zip(units, contents, strict=True):
        if len(content) > MOST_UNIT_BYTES:
            raise ValueError(f"a unit of {len(content)} bytes is longer than {MOST_UNIT_BYTES}")
        headers = headers << width | len(content) << width - 13 | bool(unit.joinable)
    bits = width * len(units)
    table = (headers << -bits % 8).to_bytes((bits + 7) // 8, "big")
    return bits.to_bytes(2, "big") + table + b"".join(contents)


def write_start_codes(units: Sequence[Unit]) -> bytes:
    """Return the payload of units by RFC 6416."""
    return b"".join(map(_with_codes, units))


def _with_codes(unit: Unit) -> bytes:
    return unit.configuration + _PLANE + unit.data if unit.data else END_CODE


class PayloadReader:
    """Reads payloads in order, and joins planes that are spread over several.

    kind: by default that of the first payload, which begins with a start code only by RFC 6416. table: the
    fields of AU headers by RFC 3640.
    """

    def __init__(self, kind: PayloadKind | None = None, table: SizeTable = SIZE_TABLE) -> None:
        self.kind = kind
        self._table = table
        self._part = b""  # of a plane whose end has not come
        self._size = 0  # of this plane, by RFC 3640

    def lose(self) -> None:
        """Forget the beginning of a plane, since its end is lost."""
        self._part, self._size = b"", 0

    def push(self, payload: bytes, *, marker: bool) -> list[Unit]:
        """Return the units that a payload completes. marker: of the packet. Raises FormatError."""
        kind = self.kind or ("6416" if payload.startswith(_PREFIX) else "3640")
        try:
            units = self._read_codes(payload, marker) if kind == "6416" else self._read_table(payload)
        except FormatError:
            self.lose()
            raise
        self.kind = kind
        return units

    def _read_codes(self, payload: bytes, marker: bool) -> list[Unit]:
        if not self._part and not payload.startswith(_PREFIX):
            raise FormatError("without a start code")
        self._part += payload
        if len(self._part) > MOST_UNIT_BYTES:
            raise FormatError(f"of a plane of more than {MOST_UNIT_BYTES} bytes")
        if not marker:
            return []
        data, self._part = self._part, b""
        return split_start_codes(data)

    def _read_table(self, payload: bytes) -> list[Unit]:
        table = self._table
        bits = int.from_bytes(payload[:2], "big")
        begin = 2 + (bits + 7) // 8
        if len(payload) < 3 or begin > len(payload) or not bits:
            raise FormatError("with AU headers beyond their end, or without any")
        fields = _Bits(payload, 16, 16 + bits)
        sizes: list[tuple[int, bool | None]] = []
        while fields.left:
            size = fields.read(table.sizelength) if table.sizelength else table.constantsize
            index = fields.read(table.indexdeltalength if sizes else table.indexlength)
            for width in (table.ctsdeltalength, table.dtsdeltalength):
                if width and fields.read(1):
                    fields.read(width)
            joinable = bool(fields.read(1)) if table.randomaccessindication else None
            fields.read(table.streamstateindication)
            if sizes and index:
                raise FormatError("with interleaved planes, which are not supported")
            if not 0 < size <= MOST_UNIT_BYTES:
                raise FormatError(f"of a plane of 0, or more than {MOST_UNIT_BYTES}, bytes")
            sizes.append((size, joinable))
        if table.auxiliarydatasizelength:
            beyond = _Bits(payload, 8 * begin, 8 * len(payload))
            begin += (table.auxiliarydatasizelength + beyond.read(table.auxiliarydatasizelength) + 7) // 8
        rest = payload[begin:]
        if len(sizes) == 1 and sizes[0][0] > len(rest):
            return self._join(rest, *sizes[0])
        if self._part or sum(size for size, _ in sizes) != len(rest):
            raise FormatError("with other sizes than their content has")
        units = []
        for size, joinable in sizes:
            units += _read_unit(rest[:size], joinable)
            rest = rest[size:]
        return units

    def _join(self, part: bytes, size: int, joinable: bool | None) -> list[Unit]:
        """Return the unit of which this is the last part; none while more are to come."""
        if (self._part and self._size != size) or not part:
            raise FormatError("of parts of a plane that do not fit together")
        self._part, self._size = self._part + part, size
        if len(self._part) < size:
            return []
        data = self._part
        self.lose()
        if len(data) > size:
            raise FormatError("of parts of a plane that do not fit together")
        return _read_unit(data, joinable)


def split_start_codes(data: bytes) -> list[Unit]:
    """Return the planes in a part of an elementary stream that begins with a start code.

    Raises FormatError without a start code.
    """
    places = _code_places(data)
    units: list[Unit] = []
    configured = 0  # begin of the headers before the next plane
    for place, stop in zip(places, [*places[1:], len(data)][: len(places)], strict=True):
        code = data[place : place + 4]
        if code in _PLANE_CODES or (code in _OBJECT_CODES and place + 4 < stop):
            behind = data[configured : place + (4 if code in _OBJECT_CODES else 0)]
            configured = stop
            unit = data[place + 4 : stop]
            if unit:
                joinable = True if behind else None
                units.append(Unit(unit, behind, joinable))
        elif code == END_CODE:
            units.append(Unit(b""))
            configured = stop
    if not units:
        raise FormatError("without a plane behind a start code")
    return units


def _read_unit(data: bytes, joinable: bool | None) -> list[Unit]:
    """Return the unit of an access unit, which may have start codes."""
    if not data.startswith(_PREFIX):
        return [Unit(data, b"", joinable)]
    return [
        unit._replace(joinable=unit.joinable if joinable is None else joinable)
        for unit in split_start_codes(data)
    ]


def _code_places(data: bytes) -> list[int]:
    places = []
    place = data.find(_PREFIX)
    while 0 <= place < len(data) - 3:
        places.append(place)
        place = data.find(_PREFIX, place + 4)
    return places


class _Bits:
    """Reads bits of bytes, from one to another."""

    def __init__(self, data: bytes, bit: int, end: int) -> None:
        self._data = data
        self._bit = bit
        self._end = end

    @property
    def left(self) -> int:
        return self._end - self._bit

    def read(self, count: int) -> int:
        """Return the next bits as a number. Raises FormatError."""
        begin, self._bit = self._bit, self._bit + count
        if self._bit > self._end:
            raise FormatError("with AU headers that are cut off")
        stop = (self._bit + 7) // 8
        number = int.from_bytes(self._data[begin // 8 : stop], "big")
        return (number >> 8 * stop - self._bit) & ((1 << count) - 1)
