"""Read the FAP or BAP half of a plane, and its viseme and expression, element by element.

ISO/IEC 14496-2, FBA object plane, predictive mode: masks, range lists, quantiser, arithmetic segments.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from fba.errors import UnsupportedError
from fba.parameters import (
    EXPRESSION_FIELDS,
    EXPRESSION_SELECT_MAX,
    VISEME_FIELDS,
    VISEME_SELECT_MAX,
    BapTable,
    bap_groups,
    baps,
    fap_groups,
    faps,
)
from fba_conformance._reader import Levels, Reader
from fba_conformance._textbook import FrequencyTable

RANGE_UNIT = 60
LISTS = ("i_new_max", "i_new_min", "p_new_max", "p_new_min")
MARKER_EVERY = 4
"""A marker bit precedes every `MARKER_EVERY`-th parameter of a group in a range list, from the first on."""
INTENSITY_MAX = 63
CODED_FIELDS = {"viseme": 3, "expression": 4}
"""Number of fields in the arithmetic segment; the others are single bits after it."""
PREDICTION_SCALE = (
    0, 1, 2, 3, 5, 7, 9, 11, 14, 17, 20, 23, 27, 31, 35, 39,
    43, 47, 52, 57, 62, 67, 72, 77, 82, 88, 94, 100, 106, 113, 120, 127,
)  # fmt: skip
"""Factor of BAP steps, by bap_quant."""


@dataclass(slots=True)
class Slot:
    """A coded number: label, step, limits (of I planes: True, of P planes: False), model and last value."""

    label: str
    step: int
    limits: dict[bool, tuple[int, int]]
    model: FrequencyTable | None = None
    value: int = 0


@dataclass
class Part:
    """State of one half. `kind` is "fap" or "bap"; `quant` is None before its first I plane."""

    kind: str
    bap_steps: BapTable = "iso"
    quant: int | None = None
    mask_types: list[int] = field(default_factory=list)
    mask: frozenset[int] = frozenset()
    lists_sent: str = "0000"
    slots: dict[int, Slot] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.groups = fap_groups() if self.kind == "fap" else bap_groups()
        self.ranged_groups = self.groups[1:] if self.kind == "fap" else self.groups
        self.labels = {p.number: p.label for p in (faps() if self.kind == "fap" else baps())}
        if self.kind == "fap":
            self.steps = {f.number: f.step for f in faps()}
        else:
            self.steps = {b.number: getattr(b, f"step_{self.bap_steps}") for b in baps()}
        self.limits: dict[str, dict[int, int]] = {name: {} for name in LISTS}
        self._set_default_limits()

    def _set_default_limits(self) -> None:
        """Set the limits in force before any were sent."""
        if self.kind == "bap":
            for bap in baps():
                if bap.i_limits is None or bap.p_limits is None:
                    continue  # extension BAPs have none: their lists must be sent
                for name, limit in zip(LISTS, (*bap.i_limits[::-1], *bap.p_limits[::-1]), strict=True):
                    self.limits[name][bap.number] = limit
            return
        for fap in faps():
            if fap.i_limits is None or fap.p_limits is None:
                continue
            intra, predicted = (1080, 420) if fap.number == 47 else (fap.i_limits[1], fap.p_limits[1])
            for name, limit in zip(LISTS, (intra, -intra, predicted, -predicted), strict=True):
                rounded = -(-abs(limit) // RANGE_UNIT) * RANGE_UNIT
                self.limits[name][fap.number] = rounded if limit > 0 else -rounded

    @property
    def divisor(self) -> int:
        """Divisor of range limits, and factor of steps."""
        quant = self.quant or 0
        return max(1, quant if self.kind == "fap" else PREDICTION_SCALE[quant])

    @property
    def low_level(self) -> list[int]:
        """Parameters of the main segment, in coding order."""
        return [number for group in self.ranged_groups for number in group if number in self.mask]

    def read_header(self, reader: Reader) -> None:
        """Read the header of this half in an I plane, and reset the models."""
        kind = self.kind
        self.quant = reader.number(f"{kind}_quant", 5, kind)
        self._read_masks(reader)
        reader.number("suggested_gender", 1, kind)
        bit = reader.bit
        if reader.number("object_coding_type", 1, kind):
            raise UnsupportedError(
                f"plane {reader.plane}, bit {bit}: object_coding_type of the {kind.upper()} part is 1 (DCT "
                "segments), whose code tables are in no public source; only predictive coding can be read",
                what="DCT segment mode",
                plane=reader.plane,
                bit=bit,
            )
        self.lists_sent = "".join(str(reader.number(f"is_{name}", 1, kind)) for name in LISTS)
        for name, sent in zip(LISTS, self.lists_sent, strict=True):
            if sent == "1":
                self._read_list(reader, name)
        self._check_ranges(reader)
        self.make_slots()

    def _read_masks(self, reader: Reader) -> None:
        """Read mask types and group masks."""
        self.mask_types, mask = [], set[int]()
        for group, numbers in enumerate(self.groups, 1):
            section = f"{self.kind} group {group}"
            reader.marker(section)
            mask_type = reader.number(f"{self.kind}_mask_type", 2, section)
            self.mask_types.append(mask_type)
            if mask_type == 2 and self.kind == "bap":
                raise reader.error(
                    f"bap_mask_type of group {group} is 2, which BAPs do not have (0 none, 1 masked, 3 all)",
                    bit=reader.bit - 2,
                )
            if mask_type == 3:
                mask.update(numbers)
            elif mask_type:
                flags = reader.flags(f"{self.kind}_group_mask", len(numbers), section)
                mask.update(number for number, flag in zip(numbers, flags, strict=True) if flag == "1")
        self.mask = frozenset(mask)

    def _read_list(self, reader: Reader, name: str) -> None:
        """Read a range list."""
        section = f"{self.kind} ranges"
        sign = 1 if name.endswith("max") else -1
        for numbers in self.ranged_groups:
            for position, number in enumerate(numbers):
                if position % MARKER_EVERY == 0:  # whether or not its parameters are masked in
                    reader.marker(section)
                if number in self.mask:
                    code = reader.number(f"{name} {self.labels[number]}", 5, section)
                    self.limits[name][number] = sign * RANGE_UNIT * code

    def _check_ranges(self, reader: Reader) -> None:
        """Raise BitstreamError for a parameter in the mask that has no range."""
        for number in self.low_level:
            if any(number not in self.limits[name] for name in LISTS):
                raise reader.error(
                    f"{self.labels[number]} is masked in, but its range was never sent, and extension BAPs "
                    "have none by default; a writer must send all four range lists"
                )

    def make_slots(self) -> None:
        """Make the slots of the main segment from mask and limits; a limit that was never sent is 0."""
        self.slots = {}
        for number in self.low_level:
            # integer division towards zero, of the limits as sent or as in the table
            i_max, i_min, p_max, p_min = (
                abs(limit) // self.divisor * (1 if limit > 0 else -1)
                for limit in (self.limits[name].get(number, 0) for name in LISTS)
            )
            step = self.steps[number] * self.divisor if self.quant else 1
            self.slots[number] = Slot(
                self.labels[number], step, {True: (i_min, i_max), False: (p_min, p_max)}
            )

    def read_values(self, reader: Reader, *, intra: bool) -> dict[int, int]:
        """Read the main segment; return values by parameter number, in coding order."""
        numbers = self.low_level
        read_segment(reader, f"{self.kind}s", self.kind, [self.slots[n] for n in numbers], intra=intra)
        return {number: self.slots[number].value for number in numbers}


def read_segment(reader: Reader, name: str, section: str, slots: list[Slot], *, intra: bool) -> None:
    """Read an arithmetic segment into its slots; record it as an element even if it codes nothing."""
    tables = []
    for slot in slots:
        low, high = slot.limits[intra]
        if intra:
            low_p, high_p = slot.limits[False]
            slot.model = FrequencyTable(high_p - low_p + 1)  # every I plane resets the models of P planes
            tables.append(FrequencyTable(high - low + 1))
        else:
            assert slot.model is not None  # `Walker` makes sure that an I plane of this half came first
            tables.append(slot.model)
    symbols, start, inserted = reader.segment(f"{name} segment", tables, section, learn=not intra)
    levels = tuple(symbol + slot.limits[intra][0] for symbol, slot in zip(symbols, slots, strict=True))
    for slot, level in zip(slots, levels, strict=True):
        slot.value = level * slot.step + (0 if intra else slot.value)
    content = Levels(tuple(s.label for s in slots), levels, tuple(s.value for s in slots), inserted)
    reader.record(start, f"{name} segment", content, section)


@dataclass
class HighLevel:
    """State of FAP 1 (`name` "viseme") or FAP 2 ("expression")."""

    name: str
    slots: list[Slot] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.fields = VISEME_FIELDS if self.name == "viseme" else EXPRESSION_FIELDS
        self.select_max = VISEME_SELECT_MAX if self.name == "viseme" else EXPRESSION_SELECT_MAX

    def begin(self, fap_quant: int) -> None:
        """Make new slots for an I plane. Selects are never quantised; blends and intensities are."""
        self.slots = []
        for name in self.fields[: CODED_FIELDS[self.name]]:
            if "select" in name:
                step, limit = 1, self.select_max
            elif fap_quant:
                step, limit = fap_quant, (INTENSITY_MAX + fap_quant // 2) // fap_quant
            else:
                step, limit = 1, INTENSITY_MAX
            self.slots.append(Slot(name, step, {True: (0, limit), False: (-limit, limit)}))

    def read(self, reader: Reader, *, intra: bool) -> list[int]:
        """Read the fields; return them in the standard's order."""
        start = reader.bit
        read_segment(reader, self.name, "fap", self.slots, intra=intra)
        for slot in self.slots:
            if "select" in slot.label and not 0 <= slot.value <= self.select_max:
                raise reader.error(
                    f"{slot.label} becomes {slot.value}, expected 0..{self.select_max}; "
                    "the stream is damaged here or before",
                    bit=start,
                )
        flags = [reader.number(name, 1, "fap") for name in self.fields[CODED_FIELDS[self.name] :]]
        return [slot.value for slot in self.slots] + flags
