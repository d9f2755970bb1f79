"""`RateEncoder`: encodes frame by frame at a mean rate, within a bounded buffer, a `LeakyBucket`."""

from __future__ import annotations

import copy
import math
import warnings
from dataclasses import dataclass, replace

import numpy as np

from fba.animation import Animation, Frame, check_order
from fba.codec import Encoder, EncoderOptions, EncoderStatistics, write_mark
from fba.errors import FbaWarning, OptionError, RangeError, Remedy
from fba.planning.rate._errors import error_weights
from fba.planning.rate._expectations import expected_motion, quantiser_for
from fba.tracks import BodyTrack, FaceTrack


@dataclass(frozen=True)
class Tuning:
    """Constants of the control of the rate. Prices are square millimetres for a bit."""

    max_error: float = 5.0  # mm, below which no error is worth bits when the buffer is full
    steepness: float = 4.0  # e-folds by which that error grows while the buffer fills
    change_bits: float = 6.0  # typical bits of a change beyond those of no change, to turn errors into prices
    price_factor: float = 4.0  # between the prices that are tried until a plane fits
    min_price: float = 1e-4
    max_price: float = 1e9
    full_share: float = 0.5  # of the buffer, above which frames are left out if still planes take too much
    still_share: float = 2.0  # still planes for which the rate has bits before a plane comes, if so full
    max_gap: float = 0.2  # s between two planes, unless the buffer is full
    spare_bits: int = 96  # always free: for the end of the stream, and for start codes between planes
    growth_bits: int = 16  # by which a still plane may cost more after the next plane than now


TUNING = Tuning()
HOLD = math.inf
"""A price at which nothing changes."""
SKIP_BITS = 4
"""Bits of a skip of up to 14 frames."""


@dataclass
class RateStatistics(EncoderStatistics):
    """Counts of an encoder that holds a rate.

    frames: number of frames pushed. left_out: number of these without a plane. longest_gap: seconds between
    planes. peak: most bits in the buffer. over: number of planes that did not fit the buffer, which must be
    0. not_sent: whether parameters that came later are not sent, since no I plane with them fits the buffer.
    """

    frames: int = 0
    left_out: int = 0
    longest_gap: float = 0.0
    peak: float = 0.0
    over: int = 0
    not_sent: bool = False


class RateEncoder:
    """Encodes frames as they come, at a mean rate: `push` and `finish` return the bytes that are complete.

    bit_rate: bits a second. buffer: seconds of that rate; every plane fits a `LeakyBucket` of this size at
    the time of its frame. A plane is returned when the frame after it comes. options: as for `Encoder`; with
    choose_quantisers, their quantisers are replaced by those that suit the rate and the frame.

    Each frame is approximated (`Encoder.next_plane`) at a price that grows as the buffer fills: the least
    visible parameters lag behind first, by `finest` millimetres even if there is room. Frames are left out if
    planes without a change would take too much of the rate; players interpolate between planes. I planes come
    at the beginning, and when parameters are sent that were not sent before; frames are left out until the
    buffer has room for an I plane. The mark has no checksums, for which bits would have to stay free.

    Raises RangeError if the first I plane does not fit the buffer at all, and as `Encoder` does,
    OptionError for an intra_period, ValueError for a rate or a buffer that is not positive.
    """

    def __init__(
        self,
        bit_rate: float,
        buffer: float = 1.0,
        options: EncoderOptions | None = None,
        *,
        choose_quantisers: bool = True,
        finest: float = 0.05,
    ) -> None:
        if options is not None and options.intra_period is not None:
            raise OptionError("intra_period and a bit rate contradict each other: leave intra_period out")
        self.bucket = LeakyBucket(bit_rate, bit_rate * buffer)
        self.statistics = RateStatistics()
        self._encoder = Encoder(replace(options or EncoderOptions(), checksums=False))
        self._choose = choose_quantisers
        self._finest = finest
        self._spare = TUNING.spare_bits
        self._expected: Animation | None = None
        self._exactly = False
        self._last: Animation | None = None  # the last frame with a plane, as it was pushed
        self._late: Animation | None = None  # a frame after it that was left out
        self._refused: Animation | None = None  # a frame whose I plane no buffer would hold
        self._planes = 0  # with the last frame, which is not encoded yet
        self._due = 0  # first index at which a frame may have a plane
        self._needed = 0  # bits that must be free for the next plane, without a change
        self._origin: int | None = None

    @property
    def options(self) -> EncoderOptions:
        """The options in force."""
        return self._encoder.options

    def expect(self, animation: Animation, *, exactly: bool = False) -> None:
        """Begin with ranges for the least and the largest values of an animation.

        exactly: its changes from frame to frame will come, too; else changes are estimated.
        ValueError after the first frame.
        """
        if self._last is not None:
            raise ValueError("this encoder has begun; say what to expect before the first frame")
        self._expected, self._exactly = animation, exactly

    def push(self, frame: Frame) -> bytes:
        """Add a frame; return the bytes that are complete."""
        return self.push_animation(Animation.from_frames([frame]))

    def push_animation(self, animation: Animation) -> bytes:
        """Add frames, one after another; return the bytes that are complete."""
        return b"".join(self._push(animation[t : t + 1]) for t in range(len(animation)))

    def finish(self) -> bytes:
        """End the stream, with the last frame if the buffer has room for it; return the last bytes."""
        if self._last is None:
            raise ValueError("there is no frame to encode")
        data = b""
        late, self._late = self._late, None
        if late is not None:
            assert self._origin is not None
            time = float((int(late.index[0]) - self._origin) / late.rate)
            if self.bucket.level_at(time) + self._needed <= self.bucket.size:
                data = self._push_due(late)
        data += self._encoder.finish()
        self._count()
        return data

    def ending(self) -> bytes:
        """Return what would end the stream behind the bytes returned so far; see `Encoder.ending`."""
        return self._encoder.ending()

    def _push(self, frame: Animation) -> bytes:
        before = self._late if self._late is not None else self._last
        if before is not None:
            check_order(before, frame)
        self.statistics.frames += 1
        if self._last is not None and int(frame.index[0]) < self._due:
            self._late = frame
            return b""
        return self._push_due(frame)

    def _push_due(self, frame: Animation) -> bytes:
        """Encode a frame if the buffer has room for it."""
        index = int(frame.index[0])
        if self._origin is None:
            self._origin = index
        self.bucket.drain(float((index - self._origin) / frame.rate))
        if self._last is not None and self._refused is not None and not _sends_other(frame, self._refused):
            frame = _sending_as(frame, self._last)
        if self._last is None or _sends_other(frame, self._last):
            data = self._push_intra(frame)
            if data is None:
                self._late = frame
                return b""
        else:
            data = self._push_predicted(frame)
        if self._last is not None:
            gap = float((index - int(self._last.index[0])) / frame.rate)
            self.statistics.longest_gap = max(self.statistics.longest_gap, gap)
        if self._last is not None and self._refused is frame:
            frame = _sending_as(frame, self._last)
        self._last, self._late = frame, None
        self._planes += 1
        self._count()
        return data

    def _count(self) -> None:
        """Bring the statistics up to date."""
        statistics, encoder = self.statistics, self._encoder.statistics
        statistics.planes, statistics.intra_planes = encoder.planes, encoder.intra_planes
        statistics.clamped_parameters = encoder.clamped_parameters
        statistics.left_out = statistics.frames - self._planes
        statistics.peak = self.bucket.peak

    def _push_intra(self, frame: Animation) -> bytes | None:
        """Encode a frame as an I plane; None if the buffer has no room for that yet."""
        index = int(frame.index[0])
        marked = frame.body is not None and self.options.mark
        spare = TUNING.spare_bits + 8 * len(write_mark(self.options.bap_steps)) if marked else self._spare
        trial = copy.deepcopy(self._encoder)
        with warnings.catch_warnings(action="ignore", category=FbaWarning):  # given below
            trial.settle(index)
            before = trial.bits
            self._begin_segment(trial, frame)
            trial.push_animation(frame)
            trial.settle(index + 1)
        bits = trial.bits - before
        if bits + spare > self.bucket.size:
            if self._last is None:
                raise self._too_small(bits + spare)
            self._refused = frame
            self.statistics.not_sent = True
            return self._push_predicted(_sending_as(frame, self._last))
        if bits + spare > self.bucket.room:
            return None
        self._spare = spare
        data = self._encoder.settle(index)
        self._begin_segment(self._encoder, frame)
        self._encoder.push_animation(frame)
        self.bucket.add(bits)
        after = trial.next_plane(frame)
        assert after is not None
        self._plan_gap(frame, after.bits(after.levels(error_weights(), HOLD)))
        return data

    def _begin_segment(self, encoder: Encoder, frame: Animation) -> None:
        """Set ranges and quantisers for the frames that follow."""
        options = encoder.options
        if self._choose:
            quant = quantiser_for(frame, self.bucket.rate)
            options = replace(options, fap_quant=quant, bap_quant=quant)
        motion = self._expected
        if motion is None or not self._exactly:
            motion = expected_motion(frame, motion)
        encoder.begin_segment(motion, options)

    def _push_predicted(self, frame: Animation) -> bytes:
        """Encode a frame as a P plane, at a price at which it fits the buffer."""
        data = self._encoder.settle(int(frame.index[0]))
        room = self.bucket.room - self._spare - SKIP_BITS
        plane = self._encoder.next_plane(frame)
        assert plane is not None
        price, weights = self._price(), error_weights()
        while True:
            levels = plane.levels(weights, price)
            bits = plane.bits(levels)
            if bits <= room or price == HOLD:
                break
            price = max(price, TUNING.min_price) * TUNING.price_factor if price < TUNING.max_price else HOLD
        self.statistics.over += bits > room
        self.bucket.add(bits)
        self._plan_gap(frame, plane.bits(plane.levels(weights, HOLD)))
        self._encoder.push_animation(plane.with_levels(levels))
        return data

    def _price(self) -> float:
        """Return the price of a bit at this level of the buffer."""
        full = min(self.bucket.level / self.bucket.size, 1.0)
        tolerance = max(
            self._finest,
            TUNING.max_error * math.expm1(TUNING.steepness * full) / math.expm1(TUNING.steepness),
        )
        return tolerance * tolerance / TUNING.change_bits

    def _plan_gap(self, frame: Animation, still: int) -> None:
        """Set the first frame that may have a plane again. still: bits of a plane without a change."""
        bucket, period = self.bucket, float(1 / frame.rate)
        self._needed = still + TUNING.growth_bits + self._spare + SKIP_BITS
        longest = max(1, math.floor(TUNING.max_gap / period + 1e-9))
        gap = 1
        while gap < longest and (
            gap * period * bucket.rate < TUNING.still_share * still
            and bucket.level_at(bucket.time + gap * period) > TUNING.full_share * bucket.size
        ):
            gap += 1
        over = bucket.level + SKIP_BITS + self._needed - bucket.size  # must have drained
        if over > 0:
            gap = max(gap, math.ceil(over / (bucket.rate * period)))
        if gap > 1:
            bucket.add(SKIP_BITS)
        self._due = int(frame.index[0]) + gap

    def _too_small(self, bits: int) -> RangeError:
        """Return the error for a buffer that no I plane fits."""
        rate, size = self.bucket.rate, self.bucket.size
        seconds = size / rate
        return RangeError(
            f"an I plane takes {bits} bits, more than the buffer of {size:.0f} bits holds "
            f"({rate:g} bit/s for {seconds:g} s)"
        ).with_remedies(
            Remedy("bit_rate", "give a rate of at least {}", str(math.ceil(bits / seconds))),
            Remedy("buffer", "or a buffer of at least {}", f"{math.ceil(100 * bits / rate) / 100:g}"),
        )


def _sending_as(frame: Animation, last: Animation) -> Animation:
    """Return a frame that sends the parameters of the last frame; those that it lacks keep their values."""
    face, body = last.face, last.body
    if face is not None and frame.face is not None:
        new = frame.face
        values = np.where(face.mask, np.where(new.mask, new.values, face.values), 0)
        viseme, expression = (
            after if new.mask[0, column] else before
            for column, (before, after) in enumerate(
                ((face.viseme, new.viseme), (face.expression, new.expression))
            )
        )
        face = FaceTrack(values, face.mask, viseme, expression, face.interpolated)
    if body is not None and frame.body is not None:
        moved = frame.body
        values = np.where(body.mask, np.where(moved.mask, moved.values, body.values), 0)
        body = BodyTrack(values, body.mask)
    return replace(frame, face=face, body=body)


def _sends_other(frame: Animation, last: Animation) -> bool:
    """Return whether a frame sends other parameters than the last frame."""
    for now, before in ((frame.face, last.face), (frame.body, last.body)):
        if (now is None) != (before is None):
            return True
        if now is not None and before is not None and not np.array_equal(now.mask, before.mask):
            return True
    if frame.face is None or last.face is None:
        return False
    asked, asked_before = frame.face.interpolated, last.face.interpolated
    if asked is None or asked_before is None:
        return asked is not asked_before
    return not np.array_equal(asked, asked_before)


@dataclass
class LeakyBucket:
    """A buffer that planes fill, and that a channel empties at a constant rate.

    rate: bits a second. size: bits that fit. level: bits in it at `time`, in seconds. peak: the highest level
    so far.

    While the level stays within the size, no stretch of the stream takes more than rate x its length + size
    bits. A receiver that waits for size / rate seconds before it begins never has to wait again.

    Raises ValueError for a rate or a size that is not positive.
    """

    rate: float
    size: float
    time: float = 0.0
    level: float = 0.0
    peak: float = 0.0

    def __post_init__(self) -> None:
        for name in ("rate", "size"):
            value = getattr(self, name)
            if not (value > 0 and math.isfinite(value)):
                raise ValueError(f"{name} must be a positive number, not {value!r}")

    def drain(self, time: float) -> None:
        """Advance to a later time."""
        self.level = self.level_at(time)
        self.time = time

    def level_at(self, time: float) -> float:
        """Return the level at a later time, if nothing is added until then."""
        return max(0.0, self.level - self.rate * (time - self.time))

    def add(self, bits: float) -> None:
        """Add the bits of a plane."""
        self.level += bits
        self.peak = max(self.peak, self.level)

    @property
    def room(self) -> float:
        """Bits that still fit."""
        return self.size - self.level
