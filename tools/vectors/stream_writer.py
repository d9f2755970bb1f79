"""Write FBA streams element by element, for test vectors: also what our encoder never writes, and faults.

The arithmetic coder is the textbook's; nothing comes from `fba.codec`. A writer does what it is told: it
checks nothing, chooses no ranges and no I planes, and guards against no start codes between planes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from bitstring import BitArray

from fba.parameters import Bap, BapTable, Fap, baps, faps
from fba_conformance._part import LISTS, MARKER_EVERY, RANGE_UNIT, HighLevel, Part, Slot
from fba_conformance._textbook import FrequencyTable, encode_segment

OBJECT = 0x1BA
OLD_OBJECT = 0x101
PLANE = 0x1BB
OLD_PLANE = 0x103
END = 0x1B1

WIDEST = 31
"""The largest code of a range list: a limit of 1860."""

Values = Mapping[int, int | tuple[int, ...]]
"""Value by number; of FAP 1 the 4 fields of the viseme, of FAP 2 the 6 of the expression."""


@dataclass(frozen=True)
class Header:
    """The FAP or the BAP half of an I plane's header.

    mask_types: by group, 1 to 10 or 24; of groups that are not named, 3 if all of the group is sent, 1 if a
    part, else 0. lists: which of the four range lists are sent. codes: the four codes of a parameter, I max,
    I min, P max, P min, or `code` for all; without either, the standard's limits. coding_type: 1 for DCT
    segments, of which nothing is written.
    """

    quant: int = 1
    mask_types: Mapping[int, int] = field(default_factory=dict)
    gender: int = 0
    coding_type: int = 0
    lists: str = "1111"
    codes: Mapping[int, tuple[int, int, int, int]] = field(default_factory=dict)
    code: int | None = None


@dataclass(frozen=True)
class Plane:
    """A plane to be written.

    fap, bap: the values to be reached, None if the plane lacks the half; in I planes, they also are what is
    sent. A value that the ranges do not reach is coded as the nearest that they do. intra: with the headers.
    rate: frame_rate, seconds, frequency_offset. time_code: hours, minutes, marker bit, seconds. start_code:
    written before the plane, with stuffing; stuffing: where the code begins a byte anyway, a whole byte.
    """

    fap: Values | None = None
    bap: Values | None = None
    intra: bool = False
    fap_header: Header = Header()
    bap_header: Header = Header()
    rate: tuple[int, int, int] | None = None
    time_code: tuple[int, int, int, int] | None = None
    skip: int = 0
    start_code: int | None = None
    stuffing: bool = True


class StreamWriter:
    """Writes start codes and planes."""

    def __init__(self, bap_steps: BapTable = "iso") -> None:
        self._bits = BitArray()
        self._fap, self._bap = Part("fap"), Part("bap", bap_steps)
        self._viseme, self._expression = HighLevel("viseme"), HighLevel("expression")

    @property
    def length(self) -> int:
        """Number of bits written so far."""
        return len(self._bits)

    def write(self, bits: str) -> None:
        """Write bits, a string of 0 and 1."""
        self._bits.append(BitArray(bin=bits))

    def write_start_code(self, code: int, *, stuffing: bool = True) -> None:
        """Write stuffing and a start code. stuffing: a whole byte of it at a byte boundary."""
        if stuffing or self.length % 8:
            self.write_stuffing()
        self.write(f"{code:032b}")

    def write_stuffing(self) -> None:
        """Write a 0, and 1s up to the byte boundary: 1 to 8 bits."""
        self.write("0" + "1" * (7 - self.length % 8))

    def write_plane(self, plane: Plane) -> None:
        """Write a plane, with the start code before it."""
        if plane.start_code is not None:
            self.write_start_code(plane.start_code, stuffing=plane.stuffing)
        parts = [one for one in (plane.fap, plane.bap) if one is not None]
        mask = (plane.fap is not None) + 2 * (plane.bap is not None)
        assert parts, "a plane has FAPs or BAPs"
        bits = f"{int(plane.intra)}{mask:02b}"
        if plane.intra:
            bits += _optional(plane.rate, (8, 4, 1)) + _optional(plane.time_code, (5, 6, 1, 6))
        bits += f"{int(plane.skip > 0)}"
        if plane.skip:
            bits += "1111" * (plane.skip // 15) + f"{plane.skip % 15:04b}"
        self.write(bits)
        if plane.fap is not None:
            self._write_faps(plane, plane.fap)
        if plane.bap is not None:
            if plane.intra:
                self._write_header(self._bap, plane.bap_header, plane.bap)
            if not (plane.intra and plane.bap_header.coding_type):
                self._write_values(self._bap, plane.bap, intra=plane.intra)

    def data(self) -> bytes:
        """Return the bytes written. ValueError within a byte."""
        if self.length % 8:
            raise ValueError("the stream does not end at a byte boundary; write stuffing")
        return self._bits.tobytes()

    def _write_faps(self, plane: Plane, values: Values) -> None:
        """Write the FAP half of a plane."""
        if plane.intra:
            self._write_header(self._fap, plane.fap_header, values)
            if plane.fap_header.coding_type:
                return
            for high in (self._viseme, self._expression):
                high.begin(plane.fap_header.quant)
        for number, high in ((1, self._viseme), (2, self._expression)):
            if number in self._fap.mask:
                fields = values.get(number, ())
                assert isinstance(fields, tuple)
                coded = len(high.slots)
                wanted = [*fields[:coded], *(slot.value for slot in high.slots[len(fields) :])]
                self._write_segment(high.slots, wanted, intra=plane.intra)
                flags = fields[coded:] or (0,) * (len(high.fields) - coded)
                self.write("".join(map(str, flags)))
        self._write_values(self._fap, values, intra=plane.intra)

    def _write_header(self, part: Part, header: Header, values: Values) -> None:
        """Write the header of a half, and set the state of its coder."""
        part.quant, part.mask_types = header.quant, []
        bits, mask = f"{header.quant:05b}", set[int]()
        for group, numbers in enumerate(part.groups, 1):
            sent = [number in values for number in numbers]
            mask_type = header.mask_types.get(group, 3 if all(sent) else int(any(sent)))
            part.mask_types.append(mask_type)
            bits += f"1{mask_type:02b}"
            if mask_type in {1, 2}:
                bits += "".join(str(int(one)) for one in sent)
                mask.update(number for number, one in zip(numbers, sent, strict=True) if one)
            elif mask_type:
                mask.update(numbers)
        part.mask = frozenset(mask)
        self.write(f"{bits}{header.gender}{header.coding_type}")
        if header.coding_type:
            return
        self.write(header.lists)
        for place, name in enumerate(LISTS):
            if header.lists[place] == "1":
                self._write_list(part, header, name, place)
        part.make_slots()

    def _write_list(self, part: Part, header: Header, name: str, place: int) -> None:
        """Write a range list. place: 0 to 3."""
        table: tuple[Fap | Bap, ...] = faps() if part.kind == "fap" else baps()
        for numbers in part.ranged_groups:
            for position, number in enumerate(numbers):
                if position % MARKER_EVERY == 0:
                    self.write("1")
                if number in part.mask:
                    code = header.codes.get(number, _table_codes(table[number - 1]))[place]
                    if header.code is not None and number not in header.codes:
                        code = header.code
                    self.write(f"{code:05b}")
                    part.limits[name][number] = RANGE_UNIT * code * (-1 if place % 2 else 1)

    def _write_values(self, part: Part, values: Values, *, intra: bool) -> None:
        """Write the main segment of a half."""
        wanted = []
        for number in part.low_level:
            value = values.get(number, part.slots[number].value)
            assert isinstance(value, int)
            wanted.append(value)
        self._write_segment([part.slots[number] for number in part.low_level], wanted, intra=intra)

    def _write_segment(self, slots: Sequence[Slot], wanted: Sequence[int], *, intra: bool) -> None:
        """Write a segment, whose values come as near to those wanted as the ranges let them."""
        symbols, tables = [], []
        for slot, value in zip(slots, wanted, strict=True):
            low, high = slot.limits[intra]
            before = 0 if intra else slot.value
            level = min(max(_nearest(value - before, slot.step), low), high)
            slot.value = before + level * slot.step
            if intra:
                least, most = slot.limits[False]
                slot.model = FrequencyTable(most - least + 1)
                tables.append(FrequencyTable(high - low + 1))
            else:
                assert slot.model is not None, "an I plane with this half comes first"
                tables.append(slot.model)
            symbols.append(level - low)
        self.write(encode_segment(symbols, tables, learn=not intra))


def write_stream(
    planes: Sequence[Plane],
    *,
    bap_steps: BapTable = "iso",
    object_code: int = OBJECT,
    end_code: int | None = END,
) -> bytes:
    """Return an object with these planes. end_code: None for an object that ends with the data."""
    writer = StreamWriter(bap_steps)
    writer.write_start_code(object_code, stuffing=False)
    for plane in planes:
        writer.write_plane(plane)
    if end_code is not None:
        writer.write_start_code(end_code)
    elif writer.length % 8:
        writer.write_stuffing()
    return writer.data()


def _optional(fields: Sequence[int] | None, sizes: Sequence[int]) -> str:
    """Return a flag that fields follow, and the fields."""
    if fields is None:
        return "0"
    return "1" + "".join(f"{value:0{bits}b}" for value, bits in zip(fields, sizes, strict=True))


def _nearest(value: int, step: int) -> int:
    """Return the nearest number of steps, halves away from 0."""
    level = (2 * abs(value) + step) // (2 * step)
    return level if value > 0 else -level


def _table_codes(parameter: Fap | Bap) -> tuple[int, int, int, int]:
    """Return the codes of the standard's limits, rounded outwards; the widest where it has none."""
    if parameter.i_limits is None or parameter.p_limits is None:
        return (WIDEST,) * 4
    (i_min, i_max), (p_min, p_max) = parameter.i_limits, parameter.p_limits
    first, second, third, fourth = (-(-abs(limit) // RANGE_UNIT) for limit in (i_max, i_min, p_max, p_min))
    return first, second, third, fourth
