"""Reader of planes, an I plane or a run of P planes at a time: the counterpart of `writer`."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fba.arrays import Bool, Int32, Int64, UInt8
from fba.codec._plane import header_loops, loops, slots, syntax
from fba.codec._plane.arithmetic import OK, OUT_OF_DATA
from fba.codec._plane.bits import BitReader, OutOfDataError
from fba.codec._plane.coder_state import Models
from fba.codec._plane.loops import Layout, Layouts
from fba.codec.settings import FrameRate, PartSettings, PlaneSettings, TimeCode
from fba.errors import BitstreamError, UnsupportedError
from fba.parameters import BapTable

_MAX_RUN = 512
"""Most planes that a call of the compiled loop decodes."""
_PARTS = ((slots.FACE_BIT, "FAPs"), (slots.BODY_BIT, "BAPs"))


@dataclass(frozen=True)
class Planes:
    """An I plane, or P planes after it; see `fba.codec.Block` for rows, columns, parts and settings.

    borders: int64 (T + 1,), first bit of each plane, and the bit after the last. skips: int64 (T,). doubtful:
    they depend on ranges that a lost plane may have replaced. complete: False if the plane behind them needs
    more data, as far as that was read.
    """

    rows: Int32
    columns: Int64
    parts: UInt8
    borders: Int64
    skips: Int64
    settings: PlaneSettings
    doubtful: bool = False
    complete: bool = True


@dataclass(frozen=True)
class _Run:
    """Layouts of P planes with some settings, the columns (K,) of their rows, and room for rows."""

    layouts: Layouts
    columns: Int64
    rows: Int32

    @classmethod
    def prepare(cls, settings: dict[int, PartSettings]) -> _Run:
        """Return layouts and room for planes with these settings of each part."""
        masks = [settings[part].mask if part in settings else None for part, _ in _PARTS]
        face = slots.coding_order(masks[0], None)
        layouts = Layouts(sum(settings), *slots.coding_order(*masks), *map(len, face))
        columns = _columns(layouts.order, masks[0])
        return cls(layouts, columns, np.zeros((_MAX_RUN, len(columns)), dtype=np.int32))


def _columns(order: Int64, face_mask: Bool | None) -> Int64:
    """Return the columns of rows for slots in this order: the slots, and the flags if the face has any."""
    flags = face_mask is not None and face_mask[:2].any()
    return np.append(order, np.arange(slots.FLAGS.start, slots.FLAGS.stop)) if flags else order


@dataclass
class _BegunIntra:
    """An I plane that may not be complete yet.

    bits: number of its bits that were read. mask: fba_object_mask. settings, values: of the parts that were
    read; values are slots (K,) and values (K,).
    """

    bits: int
    mask: int
    frame_rate: FrameRate | None
    time_code: TimeCode | None
    skip: int
    settings: dict[int, PartSettings] = field(default_factory=dict)
    values: dict[int, tuple[Int64, Int64]] = field(default_factory=dict)
    flags: Int64 = field(default_factory=lambda: np.zeros(3, dtype=np.int64))

    @classmethod
    def read(cls, reader: BitReader, start: int) -> _BegunIntra:
        """Read the header before the parts; the plane begins at `start`."""
        mask = _read_object_mask(reader)
        frame_rate = _read_frame_rate(reader)
        time_code = syntax.read_time_code(reader) if reader.read(1) else None
        skip = syntax.read_skip(reader)
        return cls(reader.bit - start, mask, frame_rate, time_code, skip)


class PlaneReader:
    """Reads the planes of an FBA object, and keeps the state between them.

    Bits in errors count from the start of the data that was passed in.
    """

    def __init__(self, bap_table: BapTable) -> None:
        self._models = Models(bap_table)
        self._settings: dict[int, PartSettings] = {}
        self._doubtful_ranges = 0  # parts, added up, whose ranges may have been replaced in a lost plane
        self._begun: _BegunIntra | None = None  # the plane at which data ran out
        self._run: _Run | None = None  # for P planes with these settings, once there are any
        self._parts = np.zeros(_MAX_RUN, dtype=np.uint8)
        self._skips = np.zeros(_MAX_RUN, dtype=np.int64)
        self._borders = np.zeros(_MAX_RUN + 1, dtype=np.int64)

    def begin_object(self, bap_table: BapTable) -> None:
        """Reset all state, including ranges. bap_table: of the BAP steps in this object."""
        self._models.bap_table = bap_table
        self._models.begin_object()
        self.forget_values()
        self._doubtful_ranges = 0

    def forget_values(self) -> None:
        """Reset settings after damage: P planes are errors until the next I plane.

        Ranges stay, as the best guess for I planes that do not send them.
        """
        self._settings.clear()
        self._begun = None
        self._run = None
        self._doubtful_ranges = slots.FACE_BIT | slots.BODY_BIT

    def read(self, data: UInt8, bit: int, end: int, *, after_code: bool) -> Planes | None:
        """Return the plane at `bit` and the P planes that follow it; None if none is complete.

        after_code: a start code ends at `bit`. Raises OutOfDataError if the first plane extends beyond `end`;
        the next call must be for that plane with more data, unless `forget_values` comes before. Raises
        BitstreamError and UnsupportedError for the first plane. An error changes only state that the next I
        plane sets.
        """
        if bit >= end:
            raise OutOfDataError
        if data[bit >> 3] & (128 >> (bit & 7)):
            return self._read_intra(BitReader(data, bit + 1, end), after_code)
        return self._read_predicted(data, bit, end, after_code)

    def _read_intra(self, reader: BitReader, after_code: bool) -> Planes:
        """Read an I plane, whose first bit has been read; continue one that was incomplete."""
        start = reader.bit - 1
        if self._begun is None:
            self._begun = _BegunIntra.read(reader, start)
        begun = self._begun
        reader.bit = start + begun.bits
        for part, name in _PARTS:
            if not begun.mask & part or part in begun.values:
                continue
            if part not in begun.settings:
                begun.settings[part] = self._read_part(reader, part, name)
                begun.bits = reader.bit - start
            begun.values[part] = self._read_intra_values(reader, part, begun.settings[part], begun.flags)
            begun.bits = reader.bit - start
        self._begun = None
        for order, values in begun.values.values():
            self._models.last[order] = values
        face = begun.settings.get(slots.FACE_BIT)
        order = np.concatenate([order for order, _ in begun.values.values()])
        columns = _columns(order, face.mask if face is not None else None)
        row = np.concatenate([*(values for _, values in begun.values.values()), begun.flags])
        self._settings.update(begun.settings)
        self._run = None
        return Planes(
            row[None, : len(columns)].astype(np.int32),
            columns,
            np.array([begun.mask], dtype=np.uint8),
            np.array([start, reader.bit], dtype=np.int64),
            np.array([begun.skip], dtype=np.int64),
            PlaneSettings(
                intra=True,
                face=face,
                body=begun.settings.get(slots.BODY_BIT),
                frame_rate=begun.frame_rate,
                time_code=begun.time_code,
                skip=begun.skip,
                start_code=after_code,
            ),
            bool(begun.mask & self._doubtful_ranges),
        )

    def _read_part(self, reader: BitReader, part: int, name: str) -> PartSettings:
        """Read the header of a part in an I plane, and apply it."""
        settings = syntax.read_part(reader, part)
        if settings.coding_type == header_loops.DCT:
            raise UnsupportedError(
                f"{name} are coded as DCT segments (object_coding_type 1), whose code tables are in no "
                "public source",
                what="DCT segments (object_coding_type 1)",
                bit=reader.bit - 1,
            )
        if all(codes is not None for codes in settings.ranges):
            self._doubtful_ranges &= ~part
        self._models.begin_intra(part, settings)
        undefined = self._models.undefined(settings, part)
        if undefined is not None:
            raise BitstreamError(
                f"{slots.label(undefined)} is sent, but no range for it: extension BAPs have no default",
                bit=reader.bit,
            )
        return settings

    def _read_intra_values(
        self, reader: BitReader, part: int, settings: PartSettings, flags: Int64
    ) -> tuple[Int64, Int64]:
        """Return slots (K,) and values (K,) of a part in an I plane; also write flags (3,)."""
        face = part == slots.FACE_BIT
        layout = Layout(*slots.coding_order(settings.mask if face else None, None if face else settings.mask))
        values, face_flags = np.zeros_like(layout.order), np.zeros(3, dtype=np.int64)
        status, place = loops.decode_intra(
            reader.data, reader.bit, reader.end, layout, self._models.state, values, face_flags
        )
        self._check(status, place, reader.bit)
        reader.bit = place
        if face:
            flags[:] = face_flags
        return layout.order, values

    def _read_predicted(self, data: UInt8, bit: int, end: int, after_code: bool) -> Planes | None:
        """Read a run of P planes; None if the first is incomplete."""
        if self._run is None:
            self._run = _Run.prepare(self._settings)
        run = self._run
        planes = loops.PlaneRows(run.rows, self._parts, self._skips, self._borders)
        count, status, carried, place = loops.decode_run(
            data, bit, end, after_code, run.layouts, self._models.state, planes
        )
        if count == 0:
            if status == loops.MISSING_PART:
                mask = BitReader(data, bit + 1, end).read(2)
                name = next(name for part, name in _PARTS if mask & part and part not in self._settings)
                raise BitstreamError(
                    f"a P plane carries {name}, but no I plane with {name} came before it in this object",
                    bit=bit,
                )
            self._check(status, place, bit)
            return None
        settings = PlaneSettings(
            intra=False,
            face=self._settings[slots.FACE_BIT] if carried & slots.FACE_BIT else None,
            body=self._settings[slots.BODY_BIT] if carried & slots.BODY_BIT else None,
            start_code=after_code,
        )
        return Planes(
            run.rows[:count].copy(),
            run.columns,
            self._parts[:count].copy(),
            self._borders[: count + 1].copy(),
            self._skips[:count].copy(),
            settings,
            bool(carried & self._doubtful_ranges),
            status != OUT_OF_DATA,
        )

    def _check(self, status: int, place: int, start: int) -> None:
        """Raise the error for the status of a compiled loop. place: a bit, or a slot for OUT_OF_RANGE."""
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
    """Read fba_object_mask; BitstreamError if it is 0."""
    mask = reader.read(2)
    if mask == 0:
        raise BitstreamError(loops.STATUS_TEXT[loops.BAD_MASK], bit=reader.bit - 2)
    return mask


def _read_frame_rate(reader: BitReader) -> FrameRate | None:
    """Read is_frame_rate and the rate after it; BitstreamError if that is 0."""
    if not reader.read(1):
        return None
    rate = syntax.read_frame_rate(reader)
    if rate.fraction == 0:
        raise BitstreamError("the frame rate is 0", bit=reader.bit - 13)
    return rate
