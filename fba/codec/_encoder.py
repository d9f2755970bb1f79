"""Encode animations: the incremental `Encoder`, and `encode_animation` for a complete animation."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np

from fba.animation import Animation, Frame, check_order
from fba.arrays import Int32, Int64
from fba.codec._plane import full_turns, quantiser, slots
from fba.codec._plane.loops import SKIP_MAX
from fba.codec._plane.pricing import NextPlane
from fba.codec._plane.writer import DoesNotFitError, PlaneWriter
from fba.codec._ranges import CLAMP, Ranges, fitting_ranges
from fba.codec._runs import Run, find_runs
from fba.codec._stream import clock
from fba.codec._stream.checksums import PeriodChecks
from fba.codec._stream.mark import write_mark
from fba.codec.settings import FrameRate, PartSettings, PlaneSettings, RangeLists, TimeCode
from fba.encoder_options import REFERENCE, EncoderOptions
from fba.errors import OptionError, RangeError
from fba.parameters import INTENSITY_MAX

_CODE_BYTES = 4
_CHUNK_FRAMES = 4096
"""Number of frames that `encode_animation` passes to the encoder at once, to limit its memory."""


@dataclass
class ClampedParameter:
    """Values of a parameter that no plane can carry, and that were clamped to the nearest that a plane can.

    count: of such values. first: frame of the first. frame, value, sent: of the worst, its frame, its value
    and the value sent instead. Frames are counted from 0 in the order in which they were encoded.
    """

    count: int
    first: int
    frame: int
    value: int
    sent: int

    @property
    def off(self) -> int:
        """Largest error, in the parameter's unit."""
        return abs(self.value - self.sent)


@dataclass
class EncoderStatistics:
    """Counts of an encoder: planes and I planes written, and clamped values by the parameter's label."""

    planes: int = 0
    intra_planes: int = 0
    clamped_parameters: dict[str, ClampedParameter] = field(default_factory=dict)

    @property
    def clamped(self) -> int:
        """Number of values clamped."""
        return sum(clamped.count for clamped in self.clamped_parameters.values())

    def count_clamped(self, label: str, frame: int, value: int, sent: int) -> None:
        """Count a value of a parameter in whose place another was sent."""
        clamped = self.clamped_parameters.setdefault(label, ClampedParameter(0, frame, frame, value, sent))
        clamped.count += 1
        if abs(value - sent) > clamped.off:
            clamped.frame, clamped.value, clamped.sent = frame, value, sent


class Encoder:
    """Encodes frames as they come; `push` and `finish` return the bytes that are complete.

    A frame is encoded when the next one comes, because its plane states how many frames are skipped after it.
    Ranges start from the standard's tables (or from `ranges`, as `encode_animation` fits them) and grow: a
    frame outside them becomes an I plane with wider ranges. Masks may change from frame to frame; a change
    needs an I plane, unless it only leaves a part out.

    Raises RangeError for a value that no range can carry (unless options.clamp) and for a frame rate that
    cannot be coded, ValueError for frames of another rate or with an index that does not increase.
    """

    def __init__(
        self, options: EncoderOptions | None = None, *, ranges: dict[int, Ranges] | None = None
    ) -> None:
        self.options = options or EncoderOptions()
        if self.options.preset != REFERENCE:
            raise OptionError(
                f"the preset {self.options.preset!r} needs all frames in advance, and here they come one by "
                "one: use fba.encode, or fba.planning.LiveEncoder"
            )
        self.statistics = EncoderStatistics()
        self._writer = PlaneWriter(self.options.bap_steps)
        self._ranges = dict(ranges or {})
        self._resumable: set[int] = set()  # parts that a decoder can show from the last start code on
        self._pending: Animation | None = None  # the last frame pushed
        self._frame_rate: FrameRate | None = None
        self._time_code: TimeCode | None = None  # of the first plane
        self._origin = 0  # index of the frame that is at 0 seconds in the stream
        self._last_intra = 0  # index of the last I plane
        self._checks = PeriodChecks()
        self._finished = False
        self._planned = False  # range lists without a parameter, markers alone, are left out

    def expect(self, animation: Animation) -> None:
        """Begin with ranges that include the values and changes of an animation, in place of the standard's.

        For live streams whose extremes are known: ranges that include them need no further I planes. Ranges
        still grow if needed. ValueError after the first frame.
        """
        if self._pending is not None:
            raise ValueError("this encoder has begun; say what to expect before the first frame")
        self._ranges |= fitting_ranges(animation, self.options)

    def push(self, frame: Frame) -> bytes:
        """Add a frame; return the bytes that are complete."""
        return self.push_animation(Animation.from_frames([frame]))

    def push_animation(self, animation: Animation) -> bytes:
        """Add consecutive frames, faster than one by one; return the bytes that are complete."""
        if self._finished:
            raise ValueError("this encoder is finished; make a new one for another stream")
        if not len(animation):
            return b""
        pending = self._pending
        if pending is None:
            self._frame_rate = clock.frame_rate_fields(animation.rate)
        else:
            check_order(pending, animation)
        self._pending = animation if len(animation) == 1 else animation[-1:]
        if pending is not None:
            self._encode(pending, int(animation.index[0]))
        if len(animation) > 1:
            self._encode(animation[:-1], int(animation.index[-1]))
        return self._take_bytes()

    def push_segment(self, animation: Animation) -> bytes:
        """Add consecutive frames, from an I plane on, with ranges fitted to them; return complete bytes."""
        first = self.push_animation(animation[:1])
        self._ranges = fitting_ranges(animation, self.options)
        if self.options.intra_period is None:  # only the first frame is an I plane
            for part, ranges in fitting_ranges(animation[:1], self.options).items():
                self._ranges[part].codes[:2] = ranges.codes[:2]
        self._resumable = set()  # as after a start code: the next plane is an I plane
        self._planned = True
        return first + self._push_all(animation[1:])

    def begin_segment(self, expected: Animation, options: EncoderOptions | None = None) -> None:
        """Make the next frame an I plane with ranges for the expected frames, and with options if given.

        options: they may differ from those before in fap_quant and bap_quant only. Call it after `settle`, or
        before the first frame.
        """
        self.options = options or self.options
        self._ranges = fitting_ranges(expected, self.options)
        self._resumable = set()

    def begin_learning(self, limits: dict[str, Int64]) -> None:
        """Make the next frame an I plane with ranges for its own values, and for changes up to these limits.

        limits: int64 (68,) or (296,) by "face" and "body": by how many quantiser steps P planes may raise or
        lower each parameter. Like `begin_segment`, if later frames are unknown.
        """
        parts = {"face": (slots.FACE_BIT, slots.FAPS.start, 2), "body": (slots.BODY_BIT, slots.BAPS.start, 0)}
        self._ranges, self._resumable = {}, set()
        for name, changes in limits.items():
            part, first, skipped = parts[name]  # visemes and expressions have fixed ranges
            both = np.stack([changes[skipped:]] * 2)
            self._ranges[part] = Ranges(part, self.options)
            self._ranges[part].widen(
                np.arange(both.shape[1]) + first, np.concatenate([np.zeros_like(both), both])
            )

    def settle(self, following: int) -> bytes:
        """Encode the last frame pushed, now that the index of the next is known; return complete bytes."""
        if self._pending is not None:
            pending, self._pending = self._pending, None
            self._encode(pending, following)
        return self._take_bytes()

    @property
    def bits(self) -> int:
        """Number of bits of all planes encoded so far."""
        return self._writer.bits

    def next_plane(self, frame: Animation) -> NextPlane | None:
        """Return the prices of the next P plane for a frame, after `settle`; None for an I plane."""
        run = next(find_runs(frame, int(frame.index[0]) + 1, self.options.unsent))
        if not all(self._in_force(run, part) for part in run.parts):
            return None
        row = run.rows[0]
        if self.options.clamp and slots.BODY_BIT in run.parts:
            row = full_turns.nearest_turn(row, self._writer.models.last)
        return NextPlane(self._writer, frame, sum(run.parts), row)

    def _push_all(self, animation: Animation) -> bytes:
        """Add consecutive frames in pieces, to limit the memory; return the complete bytes."""
        starts = range(0, len(animation), _CHUNK_FRAMES)
        return b"".join(self.push_animation(animation[start : start + _CHUNK_FRAMES]) for start in starts)

    def finish(self) -> bytes:
        """End the stream; return the last bytes: alignment, end code, mark. ValueError without a frame."""
        if self._finished:
            return b""
        if self._pending is not None:
            self._encode(self._pending, int(self._pending.index[0]) + 1)
        elif not self._writer.planes:
            raise ValueError("there is no frame to encode")
        self._finished = True
        writer = self._writer
        writer.end_object()
        self._checks.end(writer.data, writer.taken, writer.bits // 8 - _CODE_BYTES, writer.planes)
        checks = bytes(self._checks.checks) if self.options.checksums and not self._checks.full else None
        return self._take_bytes() + self._mark(checks)

    def ending(self) -> bytes:
        """Return the bytes that would end the stream after those returned so far; b"" before the first.

        Together they are a complete stream of all frames but the last one pushed, without checks of its I
        periods. The state of the encoder does not change.
        """
        if self._finished or not self._writer.planes:
            return b""
        return self._writer.ending() + self._mark()

    def _mark(self, checks: bytes | None = None) -> bytes:
        """Return the mark after the end of a stream, with these checks; b"" without a mark."""
        if not self.options.mark:
            return b""
        body = self.options.bap_quant and self._writer.settings_in_force(slots.BODY_BIT)
        return write_mark(self.options.bap_steps if body else None, checks)

    def _take_bytes(self) -> bytes:
        """Return the complete bytes written since the last call."""
        taken = self._writer.taken
        data = self._writer.take_bytes()
        self._checks.add(np.frombuffer(data, dtype=np.uint8), taken, taken + len(data))
        return data

    def _encode(self, frames: Animation, following: int) -> None:
        """Encode frames. following: index of the frame after them, which determines the last skip."""
        if not self._writer.planes:
            first = int(frames.index[0])
            self._time_code = clock.first_time_code(first, frames.rate)
            self._origin = 0 if self._time_code is not None else first
        for run in find_runs(frames, following, self.options.unsent):
            self._check_skips(run.skips)
            if slots.FACE_BIT in run.masks and run.masks[slots.FACE_BIT][:2].any():
                self._clip_amounts(run.rows)
            self._encode_run(run, frames.rate)
        self.statistics.planes = self._writer.planes

    def _check_skips(self, skips: Int64) -> None:
        """Raise RangeError if more frames are skipped than a plane can skip. skips: (T,)."""
        longest = int(np.argmax(skips))
        if skips[longest] > SKIP_MAX:
            raise RangeError(
                f"{skips[longest]} frames are skipped before the next; a plane can skip {SKIP_MAX}",
                frame=self._writer.planes + longest,
            )

    def _clip_amounts(self, rows: Int32) -> None:
        """Limit blends and intensities of rows (T, columns) to 0..63, in place.

        A coarse quantiser makes a decoder round beyond that. RangeError for values that no quantiser
        explains, unless options.clamp.
        """
        amounts = rows[:, slots.AMOUNTS]
        if amounts.min() >= 0 and amounts.max() <= INTENSITY_MAX:
            return
        wrong = np.argwhere((amounts < 0) | (amounts > quantiser.ROUNDED_AMOUNT_MAX)).tolist()
        if wrong and not self.options.clamp:
            frame, column = wrong[0]
            value = int(amounts[frame, column])
            raise RangeError(
                f"the value {value} cannot be carried: it lies outside 0..{INTENSITY_MAX}; correct it",
                parameter=slots.label(slots.AMOUNTS[column]),
                value=value,
                limits=(0, INTENSITY_MAX),
                frame=self._writer.planes + frame,
            ).with_remedies(CLAMP)
        for frame, column in wrong:
            value = int(amounts[frame, column])
            sent = min(max(value, 0), INTENSITY_MAX)
            label = slots.label(slots.AMOUNTS[column])
            self.statistics.count_clamped(label, self._writer.planes + frame, value, sent)
        rows[:, slots.AMOUNTS] = np.clip(amounts, 0, INTENSITY_MAX)

    def _encode_run(self, run: Run, rate: Fraction) -> None:
        """Encode frames that send the same parameters."""
        position = 0
        if not all(self._in_force(run, part) for part in run.parts):
            # The first plane carries every track, even one that sends nothing yet.
            self._encode_intra(run, 0, run.parts if self._writer.planes else list(run.masks), rate)
            position = 1
        due = self._next_intra(run, position, rate)
        while position < len(run.rows):
            try:
                self._writer.predicted(sum(run.parts), run.rows[position:due], run.skips[position:due])
                position = due
            except DoesNotFitError as error:
                position += error.position
                if self._fit_difference(run, position, error):
                    continue
            if position < len(run.rows):
                self._encode_intra(run, position, run.parts, rate)
                position += 1
                due = self._next_intra(run, position, rate)

    def _in_force(self, run: Run, part: int) -> bool:
        """Return whether a decoder has the run's masks of a part from an earlier I plane."""
        settings = self._writer.settings_in_force(part)
        return (
            settings is not None
            and part in self._resumable
            and np.array_equal(settings.mask, run.masks[part])
            and settings.mask_types == run.mask_types[part]
        )

    def _next_intra(self, run: Run, position: int, rate: Fraction) -> int:
        """Return the position of the next frame, from this position on, that is due as an I plane."""
        due = position + self._frames_before_intra(run.index[position:], rate)
        while due < len(run.rows) and not self._can_be_intra(run, run.rows[due]):
            due += 1  # put off: P planes reach values that I planes do not
            due += self._frames_before_intra(run.index[due:], rate)
        return due

    def _frames_before_intra(self, index: Int64, rate: Fraction) -> int:
        """Return how many of the next frames, with index (T,), come before the next I plane is due.

        It is due when the intra period is over, or at the last frame before that which a time code names.
        """
        if self.options.intra_period is None:
            return len(index)
        due = self._last_intra + float(self.options.intra_period * rate)
        before = int(np.searchsorted(index, due - 1e-9))
        if self._times_restarts:
            named = clock.last_named_frame(due + 1e-9 - self._origin, rate) + self._origin
            position = int(np.searchsorted(index, named))
            if named > self._last_intra and position < before and index[position] == named:
                return position
        return before

    @property
    def _times_restarts(self) -> bool:
        """Whether I planes after the first carry time codes."""
        return self.options.start_codes and self.options.time_codes

    def _can_be_intra(self, run: Run, row: Int32) -> bool:
        """Return whether an I plane can carry the values of row (columns,), with the widest ranges."""
        return not self._lacking(run, self._intra_row(run, row))

    def _lacking(self, run: Run, row: Int32) -> int:
        """Return the sum of the levels by which an I plane misses the values of row (columns,)."""
        return sum(int(self._ranges_of(part).lacking(run.masks[part], row).sum()) for part in run.parts)

    def _intra_row(self, run: Run, row: Int32) -> Int32:
        """Return the values of row (columns,) for an I plane: with options.clamp, angles may turn fully."""
        if not self.options.clamp:
            return row
        misfits = np.zeros(len(row), dtype=np.bool_)
        for part in run.parts:
            misfits |= self._ranges_of(part).lacking(run.masks[part], row) > 0
        return full_turns.within_half_turn(row, misfits)

    def _fit_difference(self, run: Run, position: int, error: DoesNotFitError) -> bool:
        """With options.clamp, change the value that does not fit; return whether a P plane now carries it.

        An angle turns the shorter way round, in the later frames, too. If that does not help, and no I plane
        carries the frame either, the plane that misses by less is taken: a P plane then sends the nearest
        value that it can. False: an I plane must come, with a wider range of differences.
        """
        slot, row, ranges = error.slot, run.rows[position], self._ranges[slots.part_of(error.slot)]
        if self.options.clamp:
            last = self._writer.last(slot)
            if full_turns.angle_slots()[slot] and full_turns.follow(run.rows[position:, slot], last):
                return True
        ranges.widen(np.array([slot]), np.array([[0], [0], [error.level], [-error.level]]))
        if self.options.clamp:
            lacking = self._lacking(run, self._intra_row(run, row))
            nearest = self._writer.nearest(slot, error.level)
            if lacking and abs(int(row[slot]) - nearest) <= lacking * self._writer.step(slot):
                label = slots.label(slot)
                self.statistics.count_clamped(label, self._writer.planes, int(row[slot]), nearest)
                row[slot] = nearest
                return True
        return False

    def _encode_intra(self, run: Run, position: int, parts: list[int], rate: Fraction) -> None:
        """Encode the frame at a position of a run as an I plane with these parts."""
        row = self._intra_row(run, run.rows[position])
        first = self._writer.planes == 0
        if first:
            self._writer.begin_object()
        settings = {part: self._part_settings(run, part, row) for part in parts}
        time_code = self._time_code if first else None
        if not first and self._times_restarts:
            time_code = clock.time_code(int(run.index[position]) - self._origin, rate)
        plane = PlaneSettings(
            intra=True,
            face=settings.get(slots.FACE_BIT),
            body=settings.get(slots.BODY_BIT),
            frame_rate=self._frame_rate if first or self.options.start_codes else None,
            time_code=time_code,
            skip=int(run.skips[position]),
            start_code=self.options.start_codes and not first,
        )
        frame = self._writer.planes
        for slot in self._writer.intra(plane, row, clamp=True):
            label, sent = slots.label(slot), self._writer.last(slot)
            self.statistics.count_clamped(label, frame, int(row[slot]), sent)
        self._checks.begin_period(self._writer.data, self._writer.taken, self._writer.intra_bit, frame)
        self.statistics.intra_planes += 1
        self._resumable = set(parts) | (set() if self.options.start_codes else self._resumable)
        self._last_intra = int(run.index[position])

    def _ranges_of(self, part: int) -> Ranges:
        """Return the ranges of a part; they start from the standard's tables."""
        if part not in self._ranges:
            self._ranges[part] = Ranges(part, self.options)
            self._ranges[part].start_from_tables()
        return self._ranges[part]

    def _part_settings(self, run: Run, part: int, row: Int32) -> PartSettings:
        """Return settings for an I plane, with ranges that include its values; RangeError if none can."""
        options, mask, ranges = self.options, run.masks[part], self._ranges_of(part)
        ranges.widen_for_intra(mask, row, self._writer.planes)
        in_force = self._writer.settings_in_force(part)
        new_mask = in_force is None or not np.array_equal(in_force.mask, mask)
        send = ranges.changed or new_mask or options.start_codes
        if self._planned and not mask[2 * (part == slots.FACE_BIT) :].any():  # FAP 1 and 2 have no ranges
            send = False
        ranges.changed = False
        return PartSettings(
            run.mask_types[part],
            mask,
            slots.quantiser_of(options, part),
            options.gender,
            ranges=ranges.lists() if send else RangeLists(),
        )


def encode_animation(
    animation: Animation, options: EncoderOptions | None = None
) -> tuple[bytes, EncoderStatistics]:
    """Return an animation encoded as one FBA object, with ranges fitted to all of it; and the statistics.

    Raises RangeError for values that the syntax cannot carry (see `EncoderOptions.clamp`), ValueError for an
    animation without frames.
    """
    options = options or EncoderOptions()
    encoder = Encoder(options, ranges=fitting_ranges(animation, options))
    return encoder._push_all(animation) + encoder.finish(), encoder.statistics
