"""Write planes with given settings: the part of the encoder that makes no decisions."""

from __future__ import annotations

import numpy as np

from fba.arrays import Int32, Int64
from fba.codec._plane import loops, quantiser, slots, syntax
from fba.codec._plane.arithmetic import OUT_OF_DATA
from fba.codec._plane.bits import BitWriter
from fba.codec._plane.coder_state import Models
from fba.codec._plane.loops import Layout
from fba.codec.settings import PartSettings, PlaneSettings

_SEGMENT_BITS = 20
"""Most bits that a segment takes besides its symbols."""


class DoesNotFitError(Exception):
    """A level does not fit its range. Never leaves the codec.

    slot: the parameter. level: its level. position: number of the row.
    """

    def __init__(self, slot: int, level: int, position: int = 0) -> None:
        super().__init__(slot, level)
        self.slot = slot
        self.level = level
        self.position = position


class PlaneWriter:
    """Writes an FBA object. planes: number of planes written."""

    def __init__(self, bap_table: str = "iso") -> None:
        self.models = Models(bap_table)
        self.planes = 0
        self._writer = BitWriter()
        self._taken = 0
        self._settings: dict[int, PartSettings] = {}
        self._layouts: dict[int, Layout] = {}

    @property
    def bits(self) -> int:
        """Number of bits written."""
        return 8 * self._taken + self._writer.bit

    def take_bytes(self) -> bytes:
        """Return the complete bytes written since the last call."""
        taken = self._writer.take_bytes()
        self._taken += len(taken)
        return taken

    def begin_object(self) -> None:
        """Write the start code of an object."""
        self._write_start_code(syntax.OBJECT_CODES[0])

    def end_object(self) -> None:
        """Write alignment and end code."""
        self._writer.align()
        self._write_start_code(syntax.END_CODE)

    def settings_in_force(self, part: int) -> PartSettings | None:
        """Return the settings of the last I plane with this part, or None."""
        return self._settings.get(part)

    def nearest(self, slot: int, level: int) -> int:
        """Return the value closest to a difference of this level that a P plane can carry in a slot."""
        models = self.models
        low = int(models.minimum[slot])
        nearest = min(max(level, low), low + int(models.size[slot]) - 1)
        return int(models.last[slot]) + nearest * int(models.step[slot])

    def intra(self, settings: PlaneSettings, row: Int32, *, clamp: bool = False) -> int:
        """Write an I plane with the values of row (columns,); return how many were clamped to their range.

        Raises DoesNotFitError before anything is written, unless `clamp`.
        """
        models = self.models
        parts = [
            (part, part_settings)
            for part, part_settings in ((slots.FACE_BIT, settings.face), (slots.BODY_BIT, settings.body))
            if part_settings is not None
        ]
        plan = []
        clamped = 0
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
            clamped += len(misfits)
            plan.append((part, part_settings, order, segments, fitting))
        writer = self._writer
        if settings.start_code:
            writer.align()
            self._write_start_code(syntax.PLANE_CODES[0])
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
            writer.reserve(17 * len(order) + _SEGMENT_BITS * len(segments))
            symbols = levels - models.i_minimum[order]
            writer.bit = loops.encode_values(
                writer.data, writer.bit, Layout(order, segments), models.intra, False, symbols, flags
            )
            models.last[order] = levels * models.step[order]
            self._settings[part] = part_settings
        self._layouts.clear()
        self.planes += 1
        return clamped

    def predicted(self, mask: int, rows: Int32, skips: Int64, *, start_code: bool = False) -> None:
        """Write P planes with fba_object_mask `mask` and the values of rows (T, columns).

        start_code: write a plane start code before the first. Raises DoesNotFitError for the first plane that
        does not fit its ranges; those before it have been written, and nothing of that plane.
        """
        if mask not in self._layouts:
            face = self._settings[slots.FACE_BIT].mask if mask & slots.FACE_BIT else None
            body = self._settings[slots.BODY_BIT].mask if mask & slots.BODY_BIT else None
            self._layouts[mask] = Layout(*slots.coding_order(face, body))
        layout = self._layouts[mask]
        models, writer = self.models, self._writer
        borders = np.zeros(len(rows) + 1, dtype=np.int64)
        if start_code:
            writer.align()
            self._write_start_code(syntax.PLANE_CODES[0])
        done = 0
        while done < len(rows):
            count, status, bit, slot = loops.encode_run(
                writer.data,
                writer.bit,
                start_code and done == 0,
                mask,
                layout,
                models.predicted,
                rows[done:],
                skips[done:],
                borders[done:],
            )
            writer.bit = bit
            done += count
            self.planes += count
            if status == loops.OUT_OF_RANGE:
                difference = int(rows[done, slot]) - int(models.last[slot])
                raise DoesNotFitError(slot, loops.quantise(difference, int(models.step[slot])), done)
            if status == OUT_OF_DATA:
                need = loops.room_for(int(skips[done]), layout)
                writer.reserve(max(need, 8 * len(writer.data)))

    def _write_start_code(self, code: int) -> None:
        """Write a start code with this last byte."""
        self._writer.write(int.from_bytes(syntax.START_CODE_PREFIX, "big") << 8 | code, 32)
