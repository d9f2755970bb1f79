"""Read FAP 1 (viseme) and FAP 2 (expression) of a plane, each an arithmetic segment and flags."""

from __future__ import annotations

from dataclasses import dataclass, field

from fba.parameters import EXPRESSION_FIELDS, EXPRESSION_SELECT_MAX, VISEME_FIELDS, VISEME_SELECT_MAX
from fba_conformance._part import INTENSITY_MAX, Slot, read_segment
from fba_conformance._reader import Reader

CODED_FIELDS = {"viseme": 3, "expression": 4}
"""Number of fields in the arithmetic segment; the others are single bits after it."""


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
