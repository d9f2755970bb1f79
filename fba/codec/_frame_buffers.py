"""Buffers that join decoded blocks: of a live stream at any time, of a whole stream at its end.

A stream may change its rate and set its clock: `TimeBase` finds a common frame rate, and indices at it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from fba.animation import Animation, BodyTrack, FaceTrack
from fba.arrays import Array, Bool, Int64
from fba.codec._coded_frames import Block, CodedFrames, Masks
from fba.codec._plane import slots, syntax
from fba.codec._rows import GrowingMasks, Rows
from fba.codec._stream.clock import DEFAULT_RATE
from fba.limits import Limits
from fba.parameters import BAP_COUNT, EXPRESSION_FIELDS, FAP_COUNT, VISEME_FIELDS
from fba.tracks import trusted

COMMON_RATE_MAX = 1_000_000
"""Highest rate, in frames per second, that is chosen to make all times exact."""
_INT64_MAX = 2**63 - 1
_FRAME_BYTES = 16
"""Memory of a frame in a `CompactBuffer` besides its values: its index, and the number of its masks."""
_MASKS_BYTES = 1000
"""Memory of a set of masks, with its key."""


@dataclass(frozen=True)
class DecodedFrames:
    """All frames decoded so far: the fields of `fba.Animation`, and the sizes and types of planes.

    plane_bits: int64 (T,). plane_intra: bool (T,), True for I planes.
    """

    rate: Fraction
    index: Int64
    face: FaceTrack | None
    body: BodyTrack | None
    plane_bits: Int64
    plane_intra: Bool

    def animation(self, name: str = "") -> Animation:
        """Return these frames as an animation. ValueError without frames."""
        if not len(self.index):
            raise ValueError("there is no frame to make an animation of")
        return Animation(self.rate, self.index, self.face, self.body, name)


class FrameBuffer:
    """Collects decoded blocks in stream order; `decoded` returns all their frames without a copy.

    Arrays that it returned do not change when more blocks come. frames: their number.
    left_out: "a face" or "a body" if it first came after `fix_parts`, else "".
    """

    def __init__(self) -> None:
        self.frames = 0
        self.left_out = ""
        self._parts_fixed = False
        self._times = TimeBase()
        self._bits = Rows((), np.int64)
        self._intra = Rows((), np.bool_)
        self._face: dict[str, Any] = {}
        self._body: dict[str, Any] = {}

    def fix_parts(self) -> None:
        """Ignore a face or body from now on if there has been none so far."""
        self._parts_fixed = True

    def add(self, block: Block) -> None:
        """Append the frames of a block."""
        count = len(block.index)
        if not count:
            return
        if block.face is not None and not self._face and self._accepts("a face"):
            self._face = {
                "values": self._rows(FAP_COUNT, np.int32),
                "mask": GrowingMasks(FAP_COUNT, self.frames),
                "viseme": self._rows(len(VISEME_FIELDS), np.int16),
                "expression": self._rows(len(EXPRESSION_FIELDS), np.int16),
                "interpolated": GrowingMasks(FAP_COUNT, self.frames),
            }
        if block.body is not None and not self._body and self._accepts("a body"):
            self._body = {
                "values": self._rows(BAP_COUNT, np.int32),
                "mask": GrowingMasks(BAP_COUNT, self.frames),
            }
        self._times.add(block.index, block.start, block.rate)
        self._bits.append(np.diff(block.borders), count)
        self._intra.append(block.settings.intra, count)
        for fields, track in ((self._face, block.face), (self._body, block.body)):
            for name, field in fields.items():
                rows: Array | None = getattr(track, name) if track is not None else None
                if rows is not None and isinstance(field, GrowingMasks) and block.same_parts:
                    rows = rows[0]
                field.append(rows, count)
        self.frames += count

    def decoded(self) -> DecodedFrames:
        """Return all frames so far."""
        face = {name: field.view() for name, field in self._face.items()}
        if face and not self._face["interpolated"].any:
            face["interpolated"] = None
        body = {name: field.view() for name, field in self._body.items()}
        return DecodedFrames(
            self._times.rate,
            self._times.index(),
            trusted(FaceTrack, **face) if face else None,
            trusted(BodyTrack, **body) if body else None,
            self._bits.view(),
            self._intra.view(),
        )

    def _accepts(self, part: str) -> bool:
        """Return whether a new part may be added; otherwise set `left_out`."""
        if self._parts_fixed:
            self.left_out = part
        return not self._parts_fixed

    def _rows(self, columns: int, dtype: type[np.generic]) -> Rows:
        """Return rows of zeros for all frames so far."""
        return Rows((columns,), dtype, self.frames)


class CompactBuffer:
    """Collects decoded blocks in stream order; `animation` returns all their frames, once, at the end.

    It stores columns for slots that were sent, and each set of masks once. LimitError beyond `limits`.
    source: bytes of the stream. frames: their number.
    """

    def __init__(self, limits: Limits, source: int) -> None:
        self.frames = 0
        self._limits = limits
        self._source = source
        self._times = TimeBase(in_place=True)
        self._places = np.full(slots.SLOTS, -1, dtype=np.int64)
        self._rows = Rows((0,), np.int32, in_place=True)
        self._kinds = Rows((), np.int32, in_place=True)  # which of `_masks` a frame has
        self._masks: list[tuple[Bool, Bool | None, Bool]] = []  # FAPs, those to be interpolated, BAPs
        self._kind_of: dict[object, int] = {}
        self._parts = 0
        self._last_columns: tuple[Int64 | None, Int64 | slice] = None, slice(0)  # slots, result of `_columns`

    def add(self, block: Block) -> None:
        """Append the frames of a block."""
        count = len(block.index)
        columns = self._columns(block.columns)
        self._check_limits(count)
        self._times.add(block.index, block.start, block.rate)
        self._rows.append_columns(block.rows, columns)
        if block.same_parts:
            self._kinds.append(self._kind(block, int(block.parts[0])), count)
        else:
            kinds = np.zeros(4, dtype=np.int32)
            for parts in np.unique(block.parts).tolist():
                kinds[parts] = self._kind(block, parts)
            self._kinds.append(kinds[block.parts], count)
        self.frames += count

    def animation(self, wrong: Sequence[range] = ()) -> Animation:
        """Return all frames. ValueError without frames.

        Frames before damage were misread if frames after it repeat their index; they are left out. wrong:
        planes of I periods that do not match their CRC-32; they are left out, unless all planes are wrong.
        """
        if not self.frames:
            raise ValueError("there is no frame to make an animation of")
        rows, kinds, index = self._rows.view(), self._kinds.view(), self._times.index()
        kept = np.ones(len(index), dtype=bool)
        if not (np.diff(index) > 0).all():
            later = np.minimum.accumulate(index[::-1])[::-1]
            kept[:-1] = index[:-1] < later[1:]
        right = kept.copy()
        for planes in wrong:
            right[planes.start : planes.stop] = False
        kept = right if right.any() else kept
        if not kept.all():
            rows, kinds, index = rows[kept], kinds[kept], index[kept]
        face = body = None
        if self._parts & slots.FACE_BIT:
            mask = _masks([face for face, _, _ in self._masks], kinds)
            asked = [wanted for _, wanted, _ in self._masks]
            wanted = [np.zeros(FAP_COUNT, dtype=bool) if row is None else row for row in asked]
            interpolated = _masks(wanted, kinds) if any(row is not None for row in asked) else None
            face = CodedFrames(slots.FACE_BIT, rows, self._places, mask, interpolated).face()
        if self._parts & slots.BODY_BIT:
            mask = _masks([body for _, _, body in self._masks], kinds)
            body = CodedFrames(slots.BODY_BIT, rows, self._places, mask).body()
        return Animation(self._times.rate, index, face, body)

    def _columns(self, wanted: Int64) -> Int64 | slice:
        """Return the columns of rows for these slots, making new columns where needed."""
        if wanted is not self._last_columns[0]:
            new = wanted[self._places[wanted] < 0]
            if len(new):
                used = int(self._places.max()) + 1
                if used + len(new) > self._rows.width:
                    # more than needed, because new columns make a copy of all rows
                    self._rows.widen(min(max(used + len(new), 2 * used), slots.SLOTS))
                self._places[new] = np.arange(used, used + len(new))
            columns = self._places[wanted]
            start, stop = int(columns.min(initial=slots.SLOTS)), int(columns.max(initial=-1)) + 1
            in_order = np.array_equal(columns, np.arange(start, stop))
            self._last_columns = wanted, slice(start, stop) if in_order else columns
        return self._last_columns[1]

    def _kind(self, block: Block, parts: int) -> int:
        """Return the number of the masks of a plane with these parts of a block."""
        self._parts |= parts
        face = block.settings.face if parts & slots.FACE_BIT else None
        body = block.settings.body if parts & slots.BODY_BIT else None
        key = (
            (face.mask.tobytes(), face.mask_types) if face is not None else None,
            body.mask.tobytes() if body is not None else None,
        )
        if key not in self._kind_of:
            self._kind_of[key] = len(self._masks)
            self._masks.append(
                (
                    face.mask if face is not None else np.zeros(FAP_COUNT, dtype=bool),
                    syntax.interpolated(face) if face is not None else None,
                    body.mask if body is not None else np.zeros(BAP_COUNT, dtype=bool),
                )
            )
        return self._kind_of[key]

    def _check_limits(self, count: int) -> None:
        """Raise LimitError if there is no room for `count` more frames."""
        frames = self.frames + count
        self._limits.check_frames(frames, "the stream")
        memory = frames * (4 * self._rows.width + _FRAME_BYTES) + len(self._masks) * _MASKS_BYTES
        self._limits.check_bytes(memory, "the decoded stream", source=self._source)


def _masks(rows: list[Bool], kinds: Array) -> Masks:
    """Return masks, with a row number for each frame only if rows differ."""
    return Masks(np.stack(rows), kinds if len(rows) > 1 else None)


@dataclass(frozen=True)
class _Run:
    """Frames of one rate, from position `first` on.

    A frame with the clock's index i is shown at start + (i - first_index) / rate seconds.
    """

    first: int
    first_index: int
    start: Fraction
    rate: Fraction


class TimeBase:
    """Collects the times of blocks in stream order; `index` / `rate` are the times of their frames.

    If the stream has one frame rate, that is the rate. Otherwise it is the lowest rate at which all frames
    have integer indices; beyond `COMMON_RATE_MAX`, it is the highest of the stream's rates, and times are
    rounded to the nearest frame. The result does not depend on how planes are divided into blocks.

    in_place: see `fba.codec._rows.Rows`; `index` may then be called only once, at the end.
    """

    def __init__(self, *, in_place: bool = False) -> None:
        self._in_place = in_place
        self._runs: list[_Run] = []
        self._rates: set[Fraction] = set()
        self._exact: Fraction | None = Fraction(1)  # lowest rate with exact times; None beyond a limit
        self._clock_index = Rows((), np.int64, in_place=in_place)
        self._index = self._clock_index
        self._index_rate = DEFAULT_RATE  # the rate of `_index`
        self._runs_placed = 0  # runs in `_index`, the last one perhaps not completely

    def add(self, index: Int64, start: Fraction, rate: Fraction) -> None:
        """Append frames shown at start + (index - index[0]) / rate; index int64 (T,), T >= 1."""
        if not self._continues(int(index[0]), start, rate):
            self._runs.append(_Run(self._clock_index.count, int(index[0]), start, rate))
            self._rates.add(rate)
            for part in (rate, 1 / start) if start else (rate,):
                self._extend_exact(part)
        self._clock_index.append(index, len(index))

    @property
    def rate(self) -> Fraction:
        """Frames per second; 25 before the first frame."""
        if len(self._rates) > 1:
            return self._exact or max(self._rates)
        return self._runs[0].rate if self._runs else DEFAULT_RATE

    def index(self) -> Int64:
        """Return int64 (T,), read-only, strictly increasing if the clock's indices are."""
        if len(self._rates) > 1:
            self._update_index(self.rate)
        return self._index.view()

    def _continues(self, index: int, start: Fraction, rate: Fraction) -> bool:
        """Whether a frame continues the last run."""
        if not self._runs:
            return False
        run = self._runs[-1]
        return rate == run.rate and start == run.start + Fraction(index - run.first_index) / rate

    def _extend_exact(self, rate: Fraction) -> None:
        """Make `_exact` a multiple of a rate, or None beyond the limit."""
        if not self._clock_index.count:
            self._exact = self._runs[0].rate
        if self._exact is not None:
            common = Fraction(
                math.lcm(self._exact.numerator, rate.numerator),
                math.gcd(self._exact.denominator, rate.denominator),
            )
            self._exact = common if common <= COMMON_RATE_MAX else None

    def _update_index(self, rate: Fraction) -> None:
        """Append the indices of new frames to `_index`; compute all of it anew if the rate has changed."""
        if self._index is self._clock_index or rate != self._index_rate:
            # a new array, because arrays that were returned must not change
            self._index = Rows((), np.int64, in_place=self._in_place)
            self._index_rate, self._runs_placed = rate, 0
        clock, placed = self._clock_index.view(), self._index
        runs = self._runs[max(self._runs_placed - 1, 0) :]
        for run, stop in zip(runs, [*(after.first for after in runs[1:]), len(clock)], strict=True):
            part = clock[max(run.first, placed.count) : stop]
            if len(part):
                piece = _round_index(run.start * rate, part - run.first_index, rate / run.rate)
                following = int(placed.view()[-1]) + 1 if placed.count else 0
                placed.append(piece + max(following - int(piece[0]), 0), len(piece))
        self._runs_placed = len(self._runs)


def _round_index(offset: Fraction, steps: Int64, factor: Fraction) -> Int64:
    """Return int64 (T,), nearest to offset + steps x factor; halves are rounded up."""
    offset += Fraction(1, 2)
    integral = math.floor(offset)
    rest = offset - integral
    divisor = rest.denominator * factor.denominator
    scale = factor.numerator * rest.denominator
    fits = (abs(int(steps[-1])) + 1) * scale + divisor < _INT64_MAX
    scaled = (steps if fits else steps.astype(object)) * scale + rest.numerator * factor.denominator
    result: Int64 = (scaled // divisor).astype(np.int64) + integral
    return result
