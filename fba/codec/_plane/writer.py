"""Writer of planes with given settings: the part of the encoder that makes no decisions."""

from __future__ import annotations

import numpy as np

from fba.arrays import Int32, Int64, UInt8
from fba.codec._plane import loops, quantiser, slots, syntax
from fba.codec._plane.arithmetic import OUT_OF_DATA
from fba.codec._plane.bits import BitWriter
from fba.codec._plane.coder_state import Models
from fba.codec._plane.loops import Layout
from fba.codec.settings import PartSettings, PlaneSettings
from fba.parameters import BapTable

_MAX_SEGMENT_BITS = 20
"""Most bits that a segment takes besides its symbols."""


class DoesNotFitError(Exception):
    """A level that does not fit its range. Users of the codec never get it.

    slot: the parameter. level: its level. position: number of the row.
    """

    def __init__(self, slot: int, level: int, position: int = 0) -> None:
        super().__init__(slot, level)
        self.slot = slot
        self.level = level
        self.position = position


class PlaneWriter:
    """Writes an FBA object.

    planes: number of planes written. taken: number of bytes that `take_bytes` has returned. intra_bit: where
    the last I plane begins, or the plane start code before it; 0, where the object begins, for the first.
    """

    def __init__(self, bap_table: BapTable) -> None:
        self.models = Models(bap_table)
        self.planes = 0
        self.taken = 0
        self.intra_bit = 0
        self._writer = BitWriter()
        self._settings: dict[int, PartSettings] = {}
        self._layouts: dict[int, Layout] = {}
        self._before = loops.AFTER_CODE  # see `loops.encode_run`

    def take_bytes(self) -> bytes:
        """Return the complete bytes written since the last call, without those that may have to move."""
        writer = self._writer
        if self._before >= 0 and not loops.hides_plane(writer.data, self._before, writer.bit):
            self._before = -1
        taken = writer.take_bytes(writer.bit if self._before < 0 else self._before)
        self.taken += len(taken)
        if self._before >= 0:
            self._before -= 8 * len(taken)
        return taken

    @property
    def data(self) -> UInt8:
        """What was written and not taken yet, and room for more."""
        return self._writer.data

    @property
    def bits(self) -> int:
        """Number of bits written so far."""
        return 8 * self.taken + self._writer.bit

    def begin_object(self) -> None:
        """Write the start code of an object."""
        self._writer.write(_code(syntax.OBJECT_CODES[0]), 32)

    def end_object(self) -> None:
        """Write alignment and end code."""
        self._write_aligned_code(syntax.END_CODE)

    def ending(self) -> bytes:
        """Return the bytes that would end the object after those taken so far; the state does not change."""
        writer, before, count = self._writer, self._before, self.taken
        self._writer = writer.copy()
        self.end_object()
        taken = self.take_bytes()
        self._writer, self._before, self.taken = writer, before, count
        return taken

    def settings_in_force(self, part: int) -> PartSettings | None:
        """Return the settings of the last I plane with this part, or None."""
        return self._settings.get(part)

    def last(self, slot: int) -> int:
        """Return the value of a slot that a decoder has after the last plane."""
        return int(self.models.last[slot])

    def step(self, slot: int) -> int:
        """Return the quantiser step of a slot."""
        return int(self.models.step[slot])

    def nearest(self, slot: int, level: int) -> int:
        """Return the value closest to a difference of this level that a P plane can carry in a slot."""
        models = self.models
        low = int(models.minimum[slot])
        nearest = min(max(level, low), low + int(models.size[slot]) - 1)
        return int(models.last[slot]) + nearest * int(models.step[slot])

    def intra(self, settings: PlaneSettings, row: Int32, *, clamp: bool = False) -> list[int]:
        """Write an I plane with the values of row (columns,); return the slots that were clamped.

        Raises DoesNotFitError before anything is written, unless `clamp`.
        """
        models = self.models
        parts = [
            (part, part_settings)
            for part, part_settings in ((slots.FACE_BIT, settings.face), (slots.BODY_BIT, settings.body))
            if part_settings is not None
        ]
        plan = []
        clamped: list[int] = []
        for part, part_settings in parts:
            models.begin_intra(part, part_settings)
            order, segments = slots.coding_order(
                part_settings.mask if part == slots.FACE_BIT else None,
                part_settings.mask if part == slots.BODY_BIT else None,
            )
            levels = quantiser.levels(row[order], models.step[order])
            low = models.i_minimum[order]
            fitting = np.clip(levels, low, low + models.i_size[order] - 1)
            misfits = np.flatnonzero(fitting != levels)
            if len(misfits) and not clamp:
                raise DoesNotFitError(int(order[misfits[0]]), int(levels[misfits[0]]))
            clamped += order[misfits].tolist()
            plan.append((part, part_settings, order, segments, fitting))
        writer = self._writer
        if settings.start_code:
            self._write_aligned_code(syntax.PLANE_CODES[0])
        start = writer.bit
        writer.write(1, 1)
        writer.write(sum(part for part, _ in parts), 2)
        writer.write(int(settings.frame_rate is not None), 1)
        if settings.frame_rate is not None:
            syntax.write_frame_rate(writer, settings.frame_rate)
        writer.write(int(settings.time_code is not None), 1)
        if settings.time_code is not None:
            syntax.write_time_code(writer, settings.time_code)
        syntax.write_skip(writer, settings.skip)
        flags = row[slots.FLAGS].astype(np.int64)
        for part, part_settings, order, segments, levels in plan:
            syntax.write_part(writer, part, part_settings)
            writer.reserve(17 * len(order) + _MAX_SEGMENT_BITS * len(segments))
            symbols = levels - models.i_minimum[order]
            layout = Layout(order, segments)
            writer.bit = loops.encode_intra(writer.data, writer.bit, layout, models.state, symbols, flags)
            models.last[order] = levels * models.step[order]
            self._settings[part] = part_settings
        length = writer.bit - start
        if self._before == loops.AFTER_CODE:
            self._before = -1
        else:
            writer.reserve(_MAX_SEGMENT_BITS + 80)
            writer.bit, self._before = loops.guard_plane(writer.data, self._before, start, writer.bit)
        if self.planes:
            self.intra_bit = self.bits - length - 32 * (self._before < 0)
        self._layouts.clear()
        self.planes += 1
        return clamped

    def predicted(self, mask: int, rows: Int32, skips: Int64, *, start_code: bool = False) -> None:
        """Write P planes with fba_object_mask `mask` and the values of rows (T, columns).

        start_code: write a plane start code before the first. Raises DoesNotFitError for the first plane that
        does not fit its ranges; those before it have been written, and nothing of that plane.
        """
        layout = self.layout(mask)
        models, writer = self.models, self._writer
        if start_code:
            self._write_aligned_code(syntax.PLANE_CODES[0])
        done = 0
        while done < len(rows):
            count, status, writer.bit, slot, self._before = loops.encode_run(
                writer.data, writer.bit, self._before, mask, layout, models.state, rows[done:], skips[done:]
            )
            done += count
            self.planes += count
            if status == loops.OUT_OF_RANGE:
                last, step = int(models.last[slot]), int(models.step[slot])
                raise DoesNotFitError(slot, loops.quantise_change(int(rows[done, slot]), last, step), done)
            if status == OUT_OF_DATA:
                need = loops.room_for(int(skips[done]), layout)
                writer.reserve(max(need, 8 * len(writer.data)))

    def layout(self, mask: int) -> Layout:
        """Return the slots that P planes with this fba_object_mask code, by the settings in force."""
        if mask not in self._layouts:
            face = self._settings[slots.FACE_BIT].mask if mask & slots.FACE_BIT else None
            body = self._settings[slots.BODY_BIT].mask if mask & slots.BODY_BIT else None
            self._layouts[mask] = Layout(*slots.coding_order(face, body))
        return self._layouts[mask]

    def bits_of(self, mask: int, levels: Int64, flags: Int64) -> int:
        """Return the bits of the next P plane without a skip, and of what must precede it; write nothing.

        levels: of the differences in the order of `layout`, within their ranges. flags: viseme_def,
        init_face, expression_def.
        """
        layout, trial = self.layout(mask), self._writer.copy()
        trial.reserve(loops.room_for(0, layout))
        end = loops.measure_plane(
            trial.data, trial.bit, self._before, mask, layout, self.models.state, levels, flags
        )
        return end - self._writer.bit

    def _write_aligned_code(self, code: int) -> None:
        """Write alignment and the start code with this last byte, so that they do not hide the last plane."""
        writer, before = self._writer, self._before
        writer.reserve(160)
        if before >= 0 and loops.hides_plane(writer.data, before, writer.bit):
            writer.bit = loops.insert_start_code(writer.data, before, writer.bit)
        writer.align()
        writer.write(_code(code), 32)
        self._before = loops.AFTER_CODE


def _code(last_byte: int) -> int:
    """Return the start code with this last byte."""
    return int.from_bytes(syntax.START_CODE_PREFIX, "big") << 8 | last_byte
