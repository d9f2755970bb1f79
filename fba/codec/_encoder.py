"""Encode animations: the incremental `Encoder`, and `encode` for a complete animation."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np

from fba.animation import Animation, BodyTrack, FaceTrack, Frame
from fba.arrays import Bool, Int32, Int64
from fba.codec import _headers as headers
from fba.codec import _ranges as range_fitting
from fba.codec._options import EncoderOptions
from fba.codec._plane import quantiser, slots
from fba.codec._plane.loops import SKIP_MAX
from fba.codec._plane.writer import DoesNotFitError, PlaneWriter
from fba.codec._ranges import Ranges
from fba.codec.settings import PartSettings, PlaneSettings, RangeLists
from fba.errors import RangeError
from fba.parameters import INTENSITY_MAX

_CHUNK = 4096
"""Frames that `encode` passes to the encoder at once, which limits its memory."""

_PARTS = (slots.FACE_BIT, slots.BODY_BIT)


@dataclass
class EncoderStatistics:
    """Counts of an encoder: planes and I planes written, and values clamped to their range."""

    planes: int = 0
    intra_planes: int = 0
    clamped: int = 0


class Encoder:
    """Encodes frames as they come; `push` and `finish` return the bytes that are complete.

    A frame is encoded when the next one comes, because its plane states how many frames are skipped after it.
    Ranges start from the standard's tables (or from `ranges`, as `encode` fits them) and grow: a frame that
    does not fit them becomes an I plane with wider ones. Masks may change from frame to frame; a change needs
    an I plane, unless it only leaves a part out.

    Raises RangeError for a value that no range can carry (unless options.clamp) and for a frame rate that
    cannot be coded, ValueError for frames of another rate or with an index that does not increase.
    """

    def __init__(
        self, options: EncoderOptions | None = None, *, ranges: dict[int, Ranges] | None = None
    ) -> None:
        self.options = options or EncoderOptions()
        self.statistics = EncoderStatistics()
        self._writer = PlaneWriter(self.options.bap_steps)
        self._ranges = dict(ranges or {})
        self._stale = dict.fromkeys(_PARTS, True)  # ranges that the reader does not know yet
        self._joined: set[int] = (
            set()
        )  # parts whose settings a decoder knows that started at the last start code
        self._last: Animation | None = None
        self._rate: Fraction | None = None
        self._last_intra = 0  # index of the last I plane
        self._position = 0  # frames pushed before the one being coded
        self._finished = False

    def push(self, frame: Frame) -> bytes:
        """Add a frame; return the bytes that are complete."""
        return self.push_animation(Animation.from_frames([frame]))

    def push_animation(self, animation: Animation) -> bytes:
        """Add consecutive frames, faster than one by one; return the bytes that are complete."""
        if self._finished:
            raise ValueError("this encoder is finished; make a new one for another stream")
        if not len(animation):
            return b""
        if self._rate is not None and animation.rate != self._rate:
            raise ValueError(
                f"the stream has {self._rate} frames/s, this frame {animation.rate}; resample it first"
            )
        frames = animation
        if self._last is not None:
            if animation.index[0] <= self._last.index[0]:
                raise ValueError(
                    f"frame index {animation.index[0]} comes after {self._last.index[0]}; they must increase"
                )
            frames = _join(self._last, animation)
        self._check_skips(frames)
        if self._rate is None:
            headers.frame_rate(
                animation.rate
            )  # raises before anything is written if the rate cannot be coded
            self._rate = animation.rate
        self._last = frames[len(frames) - 1 :]
        self._encode(frames, len(frames) - 1)
        return self._writer.take_bytes()

    def finish(self) -> bytes:
        """End the stream; return the last bytes, with alignment and end code. ValueError without a frame."""
        if self._finished:
            return b""
        if self._last is None:
            raise ValueError("there is no frame to encode")
        self._encode(self._last, 1)
        self._finished = True
        self._writer.end_object()
        return self._writer.take_bytes()

    def _check_skips(self, frames: Animation) -> None:
        """Raise RangeError if more frames are skipped than a plane can skip."""
        gaps = np.diff(frames.index)
        if len(gaps) and int(gaps.max()) - 1 > SKIP_MAX:
            largest = int(np.argmax(gaps))
            raise RangeError(
                f"{int(gaps[largest]) - 1} frames are skipped before the next; a plane can skip {SKIP_MAX}",
                frame=self._position + largest,
            )

    def _encode(self, frames: Animation, count: int) -> None:
        """Encode the first `count` frames; the frame after them, if any, determines the last skip."""
        if not count:
            return
        rows = np.zeros((count, slots.row_width(body=frames.body is not None)), dtype=np.int32)
        if frames.face is not None:
            slots.face_rows(frames.face[:count], rows)
            self._clip_amounts(rows)
        if frames.body is not None:
            slots.body_rows(frames.body[:count], rows)
        skips = np.zeros(count, dtype=np.int64)
        gaps = np.diff(frames.index[: count + 1]) - 1
        skips[: len(gaps)] = gaps
        for start, stop in _runs(frames, count):
            self._encode_run(frames, start, stop, rows, skips)
        self._position += count

    def _clip_amounts(self, rows: Int32) -> None:
        """Limit blends and intensities to 0..63. Raises RangeError for those that no quantiser explains."""
        invalid = range_fitting.clip_amounts(rows)
        if len(invalid) and not self.options.clamp:
            frame, slot, value = invalid[0]
            raise RangeError(
                f"the value {value} cannot be carried: it lies outside 0..{INTENSITY_MAX}; correct it",
                parameter=slots.label(slot),
                value=value,
                limits=(0, INTENSITY_MAX),
                frame=self._position + frame,
            ).with_remedies(range_fitting.CLAMP)
        self.statistics.clamped += len(invalid)

    def _encode_run(self, frames: Animation, start: int, stop: int, rows: Int32, skips: Int64) -> None:
        """Encode frames start..stop, which send the same parameters."""
        masks = _masks(frames, start)
        interpolated = _interpolated(frames, start)
        types = {
            part: headers.mask_types(
                part, mask, interpolated if part == slots.FACE_BIT else None, self.options.unsent
            )
            for part, mask in masks.items()
        }
        present = [part for part in masks if any(types[part])] or [min(masks)]
        same = all(
            part in self._joined
            and (in_force := self._writer.mask_in_force(part)) is not None
            and np.array_equal(in_force, masks[part])
            and self._writer.types_in_force(part) == types[part]
            for part in present
        )
        position = start
        if not same:
            # The first plane carries every track, even one that sends nothing yet.
            carried = present if self.statistics.planes else list(masks)
            self._encode_intra(frames, position, carried, masks, types, rows, int(skips[position]))
            position += 1
        while position < stop:
            due = self._intra_due(frames, position, stop)
            try:
                self._writer.predicted(sum(present), rows[position:due], skips[position:due])
                self.statistics.planes += due - position
                position = due
                if position == stop:
                    break
            except DoesNotFitError as error:
                self.statistics.planes += error.position
                position += error.position
                part = slots.FACE_BIT if error.slot < slots.FAPS.stop else slots.BODY_BIT
                ranges = self._ranges[part]
                if (
                    self.options.clamp
                    and ranges.is_widest(error.slot)
                    and not self._stale[part]
                    and not self._fits_intra(rows[position], masks, present)
                ):
                    rows[position, error.slot] = self._writer.nearest(error.slot, error.level)
                    self.statistics.clamped += 1
                    continue
                wanted = np.array([[0], [0], [error.level], [-error.level]])
                if ranges.widen(np.array([error.slot]), wanted):
                    self._stale[part] = True
            self._encode_intra(frames, position, present, masks, types, rows, int(skips[position]))
            position += 1

    def _intra_due(self, frames: Animation, start: int, stop: int) -> int:
        """Return the first of the frames start..stop at which the intra period is over, else stop."""
        if self.options.intra_period is None:
            return stop
        next_intra = self._last_intra + float(self.options.intra_period * frames.rate)
        return start + int(np.searchsorted(frames.index[start:stop], next_intra - 1e-9))

    def _encode_intra(
        self,
        frames: Animation,
        position: int,
        present: list[int],
        masks: dict[int, Bool],
        types: dict[int, tuple[int, ...]],
        rows: Int32,
        skip: int,
    ) -> None:
        """Encode a frame as an I plane with these parts."""
        first = self.statistics.planes == 0
        if first:
            self._writer.begin_object()
        index = int(frames.index[position])
        row = rows[position]
        settings = {
            part: self._part_settings(part, masks[part], types[part], row, position) for part in present
        }
        plane = PlaneSettings(
            intra=True,
            face=settings.get(slots.FACE_BIT),
            body=settings.get(slots.BODY_BIT),
            frame_rate=headers.frame_rate(frames.rate) if first or self.options.start_codes else None,
            time_code=headers.time_code(index, frames.rate) if first else None,
            skip=skip,
            start_code=self.options.start_codes and not first,
        )
        self.statistics.clamped += self._writer.intra(plane, row, clamp=True)
        self._joined = set(present) | (set() if self.options.start_codes else self._joined)
        self.statistics.planes += 1
        self.statistics.intra_planes += 1
        self._last_intra = index

    def _levels(self, part: int, mask: Bool, row: Int32) -> tuple[Int64, Int64]:
        """Return slots (K,) and levels (K,) of a part in an I plane, without viseme and expression."""
        columns = slots.FAPS if part == slots.FACE_BIT else slots.BAPS
        base = 0 if part == slots.FACE_BIT else columns.start
        coded = np.flatnonzero(mask[2:] if part == slots.FACE_BIT else mask) + columns.start
        step = quantiser.steps(part, self.options.quant(part), self.options.bap_steps)[coded - base]
        return coded, quantiser.levels(row[coded], step)

    def _fits_intra(self, row: Int32, masks: dict[int, Bool], present: list[int]) -> bool:
        """Whether an I plane can carry all values of a row (columns,)."""
        return all(
            bool(self._ranges[part].fits(self._levels(part, masks[part], row)[1]).all()) for part in present
        )

    def _part_settings(
        self, part: int, mask: Bool, types: tuple[int, ...], row: Int32, position: int
    ) -> PartSettings:
        """Return settings for an I plane, with ranges that hold its values; RangeError if none can."""
        options = self.options
        if part not in self._ranges:
            self._ranges[part] = Ranges(part, options.quant(part))
            self._ranges[part].start_from_tables()
        ranges = self._ranges[part]
        in_force = self._writer.mask_in_force(part)
        new_mask = in_force is None or not np.array_equal(in_force, mask)
        coded, levels = self._levels(part, mask, row)
        beyond = ~ranges.fits(levels)
        if beyond.any():
            slot = int(coded[beyond][0])
            if not options.clamp:
                raise range_fitting.does_not_fit(slot, int(row[slot]), self._position + position, options)
            ranges.widen_to_catch_up(coded[beyond], levels[beyond])
            self._stale[part] = True
        zeros = np.zeros_like(levels)
        if ranges.widen(coded, np.stack([levels, -levels, zeros, zeros])):
            self._stale[part] = True
        send = self._stale[part] or new_mask or options.start_codes
        self._stale[part] = False
        return PartSettings(
            types,
            mask,
            options.quant(part),
            options.gender,
            ranges=ranges.lists() if send else RangeLists(),
        )


def encode(animation: Animation, options: EncoderOptions | None = None) -> bytes:
    """Encode an animation as one FBA object, with ranges fitted to all of it.

    Raises RangeError for what the syntax cannot carry (see `EncoderOptions.clamp`), ValueError for an
    animation without frames. What was clamped is told in an FbaWarning.
    """
    return encode_with_statistics(animation, options)[0]


def encode_with_statistics(
    animation: Animation, options: EncoderOptions | None = None
) -> tuple[bytes, EncoderStatistics]:
    """Return the result of `encode`, and what the encoder counted."""
    options = options or EncoderOptions()
    encoder = Encoder(options, ranges=range_fitting.fitting_ranges(animation, options))
    starts = range(0, len(animation), _CHUNK)
    chunks = [encoder.push_animation(animation[start : start + _CHUNK]) for start in starts]
    chunks.append(encoder.finish())
    return b"".join(chunks), encoder.statistics


def _masks(frames: Animation, position: int) -> dict[int, Bool]:
    """Return by part the mask of a frame; parts without a track are missing."""
    tracks = ((slots.FACE_BIT, frames.face), (slots.BODY_BIT, frames.body))
    return {part: track.mask[position] for part, track in tracks if track is not None}


def _interpolated(frames: Animation, position: int) -> Bool | None:
    """Return the FAPs that a frame asks to interpolate, bool (68,), or None."""
    interpolated = frames.face.interpolated if frames.face is not None else None
    return interpolated[position] if interpolated is not None else None


def _runs(frames: Animation, count: int) -> list[tuple[int, int]]:
    """Return (start, stop) of runs of the first `count` frames with the same masks and interpolation."""
    changes = np.zeros(count, dtype=bool)
    masks = [track.mask for track in (frames.face, frames.body) if track is not None]
    if frames.face is not None and frames.face.interpolated is not None:
        masks.append(frames.face.interpolated)
    for mask in masks:
        changes[1:] |= (mask[1:count] != mask[: count - 1]).any(axis=1)
    borders = [0, *np.flatnonzero(changes).tolist(), count]
    return list(pairwise(borders))


def _join(first: Animation, second: Animation) -> Animation:
    """Return two parts of an animation as one; the second has the later indices."""
    return Animation(
        first.rate,
        np.concatenate([first.index, second.index]),
        FaceTrack.join([(first.face, len(first)), (second.face, len(second))]),
        BodyTrack.join([(first.body, len(first)), (second.body, len(second))]),
    )
