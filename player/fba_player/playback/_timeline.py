"""FAPs and BAPs of an animation at any time, each held until it is sent again; time codes.

The values of a frame depend on everything sent before it, so frames are resolved in blocks, and the state at
the start of each block is stored: times may be asked for in any order, and only a few blocks are in memory.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable
from fractions import Fraction
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from fba.animation import Animation
from fba.arrays import Array, Float32, Float64, Int32, Int64, Intp
from fba.face import FaceSettings, Resolver
from fba.parameters import BAP_COUNT, FAP_COUNT
from fba.tracks import hold

State = TypeVar("State")

TURN = 2 * math.pi / 1e-5
"""A full turn in units of a BAP."""
SHIFTS = slice(180, 183)
"""Columns of the BAPs that are millimetres, not angles."""
BLOCK_FRAMES = 2048
CACHED_BLOCKS = 4
"""Blocks of frames in memory."""
FRAME_ROUNDING = 1e-6
"""Frame periods: a time this close to that of a frame is taken as that frame's."""


class Timeline:
    """FAPs and BAPs of an animation at any time.

    animation: may grow while `growing` is True. model: gives the definitions of visemes and expressions, and
    the interpolation table; by default the built-in ones. A time before the first or after the last frame
    gives that frame; between two frames, values are interpolated, also over skipped frames, unless
    `interpolate` is False: then the earlier frame is shown.
    """

    block = BLOCK_FRAMES
    """Frames resolved at once."""

    def __init__(self, animation: Animation, model: FaceSettings | None = None) -> None:
        self.animation = animation
        self.interpolate = True
        self._faces = _Blocks(self.block, Resolver(model), self._resolve_faces)
        self._bodies = _Blocks(self.block, np.zeros(BAP_COUNT, dtype=np.int32), self._resolve_bodies)

    @property
    def rate(self) -> Fraction:
        """Frames a second."""
        return self.animation.rate

    @property
    def frames(self) -> int:
        """How many frames there are."""
        return len(self.animation)

    @property
    def growing(self) -> bool:
        """Whether more frames may arrive."""
        return bool(getattr(self.animation, "growing", False))

    @property
    def arrived(self) -> int:
        """A counter that changes with every frame that arrives, and at the end."""
        return int(getattr(self.animation, "arrived", 0))

    @property
    def start(self) -> Fraction:
        """Time of the first frame, seconds, exact."""
        return Fraction(int(self.animation.index[0])) / self.rate if self.frames else Fraction(0)

    @property
    def duration(self) -> Fraction:
        """Seconds from the first frame to one frame period after the last, exact."""
        return self.animation.duration

    @property
    def end(self) -> Fraction:
        """Time one frame period after the last frame, seconds, exact."""
        return self.start + self.duration

    def position(self, time: float) -> tuple[int, int, float]:
        """Return (frame, next frame, weight of the next) at a time in seconds, frames as positions.

        Raises ValueError for a time that is not finite, or an animation without frames.
        """
        if not self.frames:
            raise ValueError("the animation has no frames")
        return frame_position(self.animation.index, self.rate, time)

    def time_of(self, frame: int) -> Fraction:
        """Return the time of a frame, by its position in the animation: seconds, exact."""
        return Fraction(int(self.animation.index[frame])) / self.rate

    def faps(self, time: float) -> Float32:
        """Return the FAPs shown at a time in seconds, float32 (68,); zeros without a face."""
        if self.animation.face is None:
            return np.zeros(68, dtype=np.float32)
        before, after, share = self.position(time)
        first = self._faces.row(before)
        if share == 0.0 or not self.interpolate:
            return first
        return np.asarray(first + (self._faces.row(after) - first) * np.float32(share))

    def baps(self, time: float) -> Float64:
        """Return the BAPs shown at a time in seconds, float64 (296,); zeros where the animation has no body.

        Between two frames each angle takes the shorter way round, so an angle that wraps by a full turn does
        not spin. Angles are interpolated linearly, nearly as by slerp: half way between two frames of twenty
        captured performances, at their own rates, 99.9 % of joints differ from it by less than half a degree.
        """
        if self.animation.body is None:
            return np.zeros(BAP_COUNT)
        before, after, share = self.position(time)
        first = self._bodies.row(before).astype(np.float64)
        if share == 0.0 or not self.interpolate:
            return first
        return np.asarray(first + _shorten_turns(self._bodies.row(after) - first) * share)

    def many(self, times: npt.ArrayLike) -> tuple[Float32, Float64]:
        """Return the FAPs, float32 (T, 68), and BAPs, float64 (T, 296), at times (T,) in seconds.

        Much faster than `faps` and `baps` one by one. Raises ValueError for times that are not finite, and
        for an animation without frames.
        """
        at = np.asarray(times, dtype=np.float64) * self.rate.numerator / self.rate.denominator
        if not self.frames or not np.isfinite(at).all():
            raise ValueError("the times must be finite, and the animation must have frames")
        index = self.animation.index
        at = np.where(np.abs(at - np.rint(at)) < FRAME_ROUNDING, np.rint(at), at)
        before = np.clip(np.searchsorted(index, at, side="right") - 1, 0, len(index) - 1)
        after = np.minimum(before + 1, len(index) - 1)
        gap = np.maximum(index[after] - index[before], 1)
        share = np.clip((at - index[before]) / gap, 0.0, 1.0) * self.interpolate
        faces, bodies = np.zeros((len(at), FAP_COUNT), np.float32), np.zeros((len(at), BAP_COUNT))
        if self.animation.face is not None:
            first = self._faces.rows(before)
            change = self._faces.rows(after) - first
            faces = first + change * share.astype(np.float32)[:, None]
        if self.animation.body is not None:
            start = self._bodies.rows(before).astype(np.float64)
            turn = self._bodies.rows(after) - start
            bodies = start + _shorten_turns(turn) * share[:, None]
        return faces, bodies

    def _resolve_faces(self, frames: slice, before: Resolver) -> tuple[Float32, Resolver]:
        assert self.animation.face is not None
        resolver = before.copy()
        return resolver.push(self.animation.face[frames]), resolver

    def _resolve_bodies(self, frames: slice, before: Int32) -> tuple[Int32, Int32]:
        assert self.animation.body is not None
        part = self.animation.body[frames]
        rows: Int32 = part.values if part.mask.all() else hold(part.values, part.mask, before)
        return rows, rows[-1].copy()


class _Blocks(Generic[State]):
    """The values of a track in blocks of frames, resolved when they are needed; some are cached.

    size: frames of a block. before: the state before the first. resolve: returns the rows of frames, which
    follow a state, and the state after them.
    """

    def __init__(
        self, size: int, before: State, resolve: Callable[[slice, State], tuple[Array, State]]
    ) -> None:
        self._size, self._resolve = size, resolve
        self._states = [before]
        self._cached: OrderedDict[int, Array] = OrderedDict()

    def row(self, frame: int) -> Array:
        """Return the values of a frame."""
        block, row = divmod(frame, self._size)
        cached = self._cached.get(block)
        if cached is None or row >= len(cached):
            while len(self._states) <= block:
                self._states.append(self._resolve_block(len(self._states) - 1)[1])
            cached = self._cached[block] = self._resolve_block(block)[0]
            while len(self._cached) > CACHED_BLOCKS:
                self._cached.popitem(last=False)
        return np.asarray(cached[row])

    def rows(self, frames: Intp) -> Array:
        """Return the values of many frames."""
        blocks = frames // self._size
        parts = []
        for block in np.unique(blocks).tolist():
            chosen = blocks == block
            self.row(int(frames[chosen].max()))
            parts.append((chosen, self._cached[block][frames[chosen] - block * self._size]))
        first = parts[0][1]
        gathered = np.zeros((len(frames), first.shape[1]), dtype=first.dtype)
        for chosen, rows in parts:
            gathered[chosen] = rows
        return gathered

    def _resolve_block(self, block: int) -> tuple[Array, State]:
        return self._resolve(slice(block * self._size, (block + 1) * self._size), self._states[block])


class CaptureTimes:
    """The frames of a capture at the times at which they were taken, for a window or a film; see `Times`.

    times: float64 (T,), seconds, ascending, T at least 1. rate: nominal frames a second.
    """

    growing = False
    arrived = 0

    def __init__(self, times: Float64, rate: Fraction) -> None:
        self._times = times
        self.interpolate = True
        self.frames, self.rate = len(times), rate
        self.start, self.end = self.time_of(0), self.time_of(len(times) - 1) + 1 / rate
        self.duration = self.end - self.start

    def time_of(self, frame: int) -> Fraction:
        """Return the time of a frame, seconds, to a microsecond."""
        return Fraction(float(self._times[frame])).limit_denominator(1_000_000)

    def position(self, time: float) -> tuple[int, int, float]:
        """Return (frame, next frame, weight of the next) at a time; ValueError if it is not finite."""
        _check_finite(time)
        last = len(self._times) - 1
        # a frame's own time shows that frame, whatever the rounding
        before = min(max(int(np.searchsorted(self._times, time + 1e-6, side="right")) - 1, 0), last)
        after = min(before + 1, last)
        gap = float(self._times[after] - self._times[before])
        share = (time - float(self._times[before])) / gap if gap > 0 else 0.0
        return before, after, min(max(share, 0.0), 1.0) if self.interpolate else 0.0


def frame_position(
    index: Int64, rate: Fraction, time: float, rounding: float = FRAME_ROUNDING
) -> tuple[int, int, float]:
    """Return (frame, next frame, weight of the next) at a time; ValueError if it is not finite.

    index: (T,), ascending numbers of frames at this rate. rounding: frame periods within which a time
    counts as that of a frame.
    """
    _check_finite(time)
    at = time * rate.numerator / rate.denominator
    if abs(at - round(at)) < rounding:
        at = float(round(at))  # a frame's own time shows that frame, whatever the rounding
    last = len(index) - 1
    before = min(max(int(np.searchsorted(index, at, side="right")) - 1, 0), last)
    after = min(before + 1, last)
    gap = int(index[after]) - int(index[before])
    return before, after, min(max((at - int(index[before])) / gap, 0.0), 1.0) if gap else 0.0


def _check_finite(time: float) -> None:
    if not math.isfinite(time):
        raise ValueError(f"the time must be a finite number of seconds, not {time}")


def _shorten_turns(changes: Float64) -> Float64:
    """Return the changes of BAPs (..., 296), each angle the shorter way round."""
    if not changes.size or max(changes.max(), -changes.min()) <= TURN / 2:
        return changes
    shorter: Float64 = changes - TURN * np.rint(changes / TURN)
    shorter[..., SHIFTS] = changes[..., SHIFTS]
    return shorter


def timecode(time: float, rate: Fraction) -> str:
    """Return the time code "h:mm:ss:ff" of a time in seconds at a frame rate; see `Transport.timecode`."""
    at = time * rate.numerator / rate.denominator
    nearest = round(at)
    index = nearest if abs(at - nearest) < FRAME_ROUNDING else math.floor(at)
    sign, index = ("-", -index) if index < 0 else ("", index)
    seconds = index * rate.denominator // rate.numerator
    first = -(-seconds * rate.numerator // rate.denominator)
    minutes, seconds = divmod(seconds, 60)
    hours, minutes = divmod(minutes, 60)
    return f"{sign}{hours}:{minutes:02d}:{seconds:02d}:{index - first:02d}"


def clock_text(seconds: float | Fraction) -> str:
    """Return the seconds as minutes, or hours where there are any: "0:07.040", "1:02:03.500"."""
    thousandths = round(float(seconds) * 1000)
    minutes, rest = divmod(thousandths, 60_000)
    hours, minutes = divmod(minutes, 60)
    text = f"{rest // 1000:02d}.{rest % 1000:03d}"
    return f"{hours}:{minutes:02d}:{text}" if hours else f"{minutes}:{text}"
