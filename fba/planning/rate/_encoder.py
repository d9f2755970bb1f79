"""`RateEncoder`: an encoder that holds a mean rate within a bounded buffer, a frame at a time."""

from __future__ import annotations

import copy
import math
import warnings
from dataclasses import dataclass, replace

import numpy as np

from fba.animation import Animation, Frame
from fba.codec import Encoder, EncoderOptions, EncoderStatistics, write_mark
from fba.errors import FbaWarning, OptionError, RangeError, Remedy
from fba.planning._live_encoder import check_order
from fba.planning.rate._bucket import LeakyBucket
from fba.planning.rate._expectations import expected_motion, quantiser_for
from fba.planning.rate._visibility import slot_weights
from fba.tracks import BodyTrack, FaceTrack

COARSEST = 5.0
"""Millimetres by which a parameter may be off before it is worth bits, with a full buffer."""
STEEPNESS = 4.0
"""How much faster that grows as the buffer fills than in a straight line: e-fold."""
CHANGE_BITS = 6.0
"""Bits of a change beyond those of none, about: what makes a price of a tolerance."""
DEARER = 4.0
"""Factor between the prices that are tried until a plane fits."""
MIN_PRICE = 1e-4
"""Lowest price of a bit that is tried."""
MAX_PRICE = 1e9
"""Highest price of a bit that is tried."""
HOLD = math.inf
"""A price at which nothing changes."""
FULL = 0.5
"""Part of the buffer above which frames are left out, where planes without a change take too much."""
STILL_SHARE = 2.0
"""A plane's share of the rate, in planes without a change, that frames are left out for."""
MAX_GAP = 0.2
"""Longest time between two planes, in seconds, unless the buffer is full."""
SPARE = 96
"""Bits that always stay free: for the end of the stream, and for start codes that keep planes apart; a mark
behind the end takes more.
"""
LEARNING = 16
"""Bits by which a plane without a change may cost more after the next plane than it does now."""
SKIP_BITS = 4


@dataclass
class RateStatistics(EncoderStatistics):
    """Counts of an encoder that holds a rate.

    frames: frames that came. left_out: of these, those without a plane. longest_gap: seconds between planes.
    peak: bits in the buffer at most. over: planes that did not fit the buffer, which must be 0. not_sent:
    whether parameters that came later are not sent, since no I plane with them fits the buffer.
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
    the time of its frame. A plane is returned when the frame after it comes. options: as for `Encoder`; their
    quantisers count unless choose_quantisers is set, which takes one that suits the rate and the frame.

    Each frame is approximated (`Encoder.next_plane`) at a price that grows as the buffer fills: what is seen
    least stays behind first, by `finest` millimetres even where there is room. Frames are left out where
    planes without a change would take too much of the rate; players move on smoothly from one plane to the
    next. I planes come at the beginning and when something is sent that was not before; frames are left out
    until the buffer has room for one. The mark has no checksums, for which bits would have to stay free.

    Raises RangeError where the first I plane does not fit the buffer at all, and as `Encoder` does,
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
        self._spare = SPARE
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

        exactly: its changes from frame to frame are those that will come, too; else they are estimated.
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
        own, theirs = self.statistics, self._encoder.statistics
        own.planes, own.intra_planes = theirs.planes, theirs.intra_planes
        own.clamped_parameters = theirs.clamped_parameters
        own.left_out = own.frames - self._planes
        own.peak = self.bucket.peak

    def _push_intra(self, frame: Animation) -> bytes | None:
        """Encode a frame as an I plane; None where the buffer has no room for that yet."""
        index = int(frame.index[0])
        marked = frame.body is not None and self.options.mark
        spare = SPARE + 8 * len(write_mark(self.options.bap_steps)) if marked else self._spare
        trial = copy.deepcopy(self._encoder)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FbaWarning)  # given below
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
        self._plan_gap(frame, after.bits(after.levels(slot_weights(), HOLD)))
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
        price, weights = self._price(), slot_weights()
        while True:
            levels = plane.levels(weights, price)
            bits = plane.bits(levels)
            if bits <= room or price == HOLD:
                break
            price = max(price, MIN_PRICE) * DEARER if price < MAX_PRICE else HOLD
        self.statistics.over += bits > room
        self.bucket.add(bits)
        self._plan_gap(frame, plane.bits(plane.levels(weights, HOLD)))
        self._encoder.push_animation(plane.with_levels(levels))
        return data

    def _price(self) -> float:
        """Return the square millimetres that a bit is worth, by the level of the buffer."""
        full = min(self.bucket.level / self.bucket.size, 1.0)
        tolerance = max(self._finest, COARSEST * math.expm1(STEEPNESS * full) / math.expm1(STEEPNESS))
        return tolerance * tolerance / CHANGE_BITS

    def _plan_gap(self, frame: Animation, still: int) -> None:
        """Set from which frame on a plane may come. still: bits of a plane without a change."""
        bucket, period = self.bucket, float(1 / frame.rate)
        self._needed = still + LEARNING + self._spare + SKIP_BITS
        longest = max(1, math.floor(MAX_GAP / period + 1e-9))
        gap = 1
        while gap < longest and (
            gap * period * bucket.rate < STILL_SHARE * still
            and bucket.level_at(bucket.time + gap * period) > FULL * bucket.size
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
    """Return a frame that sends the parameters that the last one sent; what it lacks keeps its value."""
    face, body = last.face, last.body
    if face is not None and frame.face is not None:
        new = frame.face
        values = np.where(face.mask, np.where(new.mask, new.values, face.values), 0)
        viseme, expression = (
            theirs if new.mask[0, column] else own
            for column, (own, theirs) in enumerate(
                ((face.viseme, new.viseme), (face.expression, new.expression))
            )
        )
        face = FaceTrack(values, face.mask, viseme, expression, face.interpolated)
    if body is not None and frame.body is not None:
        other = frame.body
        values = np.where(body.mask, np.where(other.mask, other.values, body.values), 0)
        body = BodyTrack(values, body.mask)
    return replace(frame, face=face, body=body)


def _sends_other(frame: Animation, last: Animation) -> bool:
    """Whether a frame sends other parameters than the last one."""
    for one, other in ((frame.face, last.face), (frame.body, last.body)):
        if (one is None) != (other is None):
            return True
        if one is not None and other is not None and not np.array_equal(one.mask, other.mask):
            return True
    if frame.face is None or last.face is None:
        return False
    wanted, before = frame.face.interpolated, last.face.interpolated
    if wanted is None or before is None:
        return wanted is not before
    return not np.array_equal(wanted, before)
