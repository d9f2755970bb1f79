"""Reads planes, one I plane or a run of P planes at a time: the mirror of `plane_writer`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Int32, Int64, UInt8
from fba.codec._plane import loops, slots, syntax
from fba.codec._plane.arithmetic import OK, OUT_OF_DATA
from fba.codec._plane.bits import BitReader, OutOfDataError
from fba.codec._plane.coder_state import Models
from fba.codec._plane.loops import Layout
from fba.codec.settings import FrameRate, PartSettings, PlaneSettings
from fba.errors import BitstreamError, UnsupportedError

_RUN = 512
"""Planes that one call of the compiled loop decodes at most."""
_PARTS = ((slots.FACE_BIT, "FAPs"), (slots.BODY_BIT, "BAPs"))


@dataclass(frozen=True)
class Planes:
    """What was read: rows of values int32 (T, columns), see `slots`; bit positions int64 (T + 1,); skips
    int64 (T,). Arrays belong to the reader and change with the next call."""

    rows: Int32
    borders: Int64
    skips: Int64
    settings: PlaneSettings


class PlaneReader:
    """The planes of an FBA object, and all that must be known from one plane to the next.

    Bits in errors count from the start of the data that was handed in.
    """

    def __init__(self, bap_table: str = "iso") -> None:
        self._bap_table = bap_table
        self._models = Models(bap_table)
        self._models_used = False
        self._settings: dict[int, PartSettings] = {}
        self._layouts: dict[int, Layout] = {}
        self._rows = np.zeros((0, 0), dtype=np.int32)
        self._rows_layout: Layout | None = None
        self._skips = np.zeros(_RUN, dtype=np.int64)
        self._borders = np.zeros(_RUN + 1, dtype=np.int64)

    def begin_object(self) -> None:
        """Forget everything, ranges too."""
        if self._models_used:
            self._models = Models(self._bap_table)
            self._models_used = False
        self.forget_values()

    def forget_values(self) -> None:
        """After damage: nothing can be predicted until the next I plane."""
        self._settings.clear()
        self._layouts.clear()

    def read(self, data: UInt8, bit: int, end: int, *, after_code: bool) -> Planes | None:
        """The plane at `bit`, and P planes that follow it; None where none is complete.

        after_code: a start code ends at `bit`. Raises OutOfDataError where even the first plane goes
        beyond `end`, BitstreamError and UnsupportedError for it; nothing was changed then but what the
        next I plane sets anew.
        """
        reader = BitReader(data, bit, end)
        if reader.read(1):
            return self._intra(reader, after_code)
        return self._predicted(reader, after_code)

    def _intra(self, reader: BitReader, after_code: bool) -> Planes:
        start = reader.bit - 1
        mask = _read_object_mask(reader)
        frame_rate = _read_frame_rate(reader)
        time_code = syntax.read_time_code(reader) if reader.read(1) else None
        skip = syntax.read_skip(reader)
        row = np.zeros((1, slots.row_width(body=bool(mask & slots.BODY_BIT))), dtype=np.int32)
        settings: dict[int, PartSettings] = {}
        decoded: list[tuple[Int64, Int64]] = []
        for part, name in _PARTS:
            if mask & part:
                settings[part] = self._read_part(reader, part, name)
                decoded.append(self._intra_values(reader, part, settings[part], row))
        for order, values in decoded:
            self._models.last[order] = values
        self._settings.update(settings)
        self._layouts.clear()
        return Planes(
            row,
            np.array([start, reader.bit], dtype=np.int64),
            np.array([skip], dtype=np.int64),
            PlaneSettings(
                intra=True,
                face=settings.get(slots.FACE_BIT),
                body=settings.get(slots.BODY_BIT),
                frame_rate=frame_rate,
                time_code=time_code,
                skip=skip,
                start_code=after_code,
            ),
        )

    def _read_part(self, reader: BitReader, part: int, name: str) -> PartSettings:
        """The header of a part, put in force."""
        settings = syntax.read_part(reader, part)
        if settings.coding_type == syntax.DCT:
            raise UnsupportedError(
                f"{name} are coded as DCT segments (object_coding_type 1), whose code tables are in no "
                "public source",
                what="DCT segments (object_coding_type 1)",
                bit=reader.bit - 1,
            )
        self._models_used = True
        self._models.begin_intra(part, settings)
        undefined = self._models.undefined(settings, part)
        if undefined is not None:
            raise BitstreamError(
                f"{slots.label(undefined)} is sent, but no range for it: extension BAPs have no default",
                bit=reader.bit,
            )
        return settings

    def _intra_values(
        self, reader: BitReader, part: int, settings: PartSettings, row: Int32
    ) -> tuple[Int64, Int64]:
        """Slots and values of a part; also written into row (1, columns)."""
        face = part == slots.FACE_BIT
        layout = Layout(*slots.coding_order(settings.mask if face else None, None if face else settings.mask))
        symbols, values = np.zeros_like(layout.order), np.zeros_like(layout.order)
        flags = np.zeros(3, dtype=np.int64)
        coding = self._models.intra
        status, place = loops.decode_values(
            reader.data, reader.bit, reader.end, layout, coding, False, symbols, values, flags
        )
        self._check(status, place, reader.bit)
        reader.bit = place
        row[0, layout.order] = values
        if face:
            row[0, slots.FLAGS] = flags
        return layout.order, values

    def _predicted(self, reader: BitReader, after_code: bool) -> Planes | None:
        """A run of P planes with one fba_object_mask."""
        start = reader.bit - 1
        mask = _read_object_mask(reader)
        for part, name in _PARTS:
            if mask & part and part not in self._settings:
                raise BitstreamError(
                    f"a P plane carries {name}, but no I plane with {name} came before it in this object",
                    bit=start,
                )
        face = self._settings[slots.FACE_BIT] if mask & slots.FACE_BIT else None
        body = self._settings[slots.BODY_BIT] if mask & slots.BODY_BIT else None
        if mask not in self._layouts:
            self._layouts[mask] = Layout(
                *slots.coding_order(
                    face.mask if face is not None else None, body.mask if body is not None else None
                )
            )
        layout = self._layouts[mask]
        if self._rows_layout is not layout:
            self._rows_layout = layout
            width = slots.row_width(body=body is not None)
            self._rows = np.zeros((_RUN, width), dtype=np.int32)  # what this layout does not code stays 0
        count, status, _, place = loops.decode_run(
            reader.data, start, reader.end, after_code, mask, layout, self._models.predicted,
            self._rows, self._skips, self._borders,
        )  # fmt: skip
        if count == 0:
            self._check(status, place, start)
            return None
        settings = PlaneSettings(intra=False, face=face, body=body, start_code=after_code)
        return Planes(self._rows[:count], self._borders[: count + 1], self._skips[:count], settings)

    def _check(self, status: int, place: int, start: int) -> None:
        """Raise what a compiled loop returned as its status; place: a bit, or a slot if out of range."""
        if status == OUT_OF_DATA:
            raise OutOfDataError
        if status == loops.OUT_OF_RANGE:
            low, high = self._models.lowest[place], self._models.highest[place]
            raise BitstreamError(
                f"{slots.label(place)} gets a value outside {low}..{high}; the stream is damaged here or "
                "before",
                bit=start,
            )
        if status != OK and status in loops.STATUS_TEXT:
            raise BitstreamError(loops.STATUS_TEXT[status], bit=place)


def _read_object_mask(reader: BitReader) -> int:
    mask = reader.read(2)
    if mask == 0:
        raise BitstreamError(loops.STATUS_TEXT[loops.BAD_MASK], bit=reader.bit - 2)
    return mask


def _read_frame_rate(reader: BitReader) -> FrameRate | None:
    if not reader.read(1):
        return None
    rate = syntax.read_frame_rate(reader)
    if rate.fraction == 0:
        raise BitstreamError("the frame rate is 0", bit=reader.bit - 13)
    return rate
