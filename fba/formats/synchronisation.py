"""Two animations as one: joined by frame number, or recordings of one moment put on one clock."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from fractions import Fraction
from math import ceil
from typing import TypeVar, get_args

import numpy as np
import numpy.typing as npt

from fba.animation import Animation, BodyTrack, FaceTrack
from fba.arrays import Intp
from fba.choices import Sync
from fba.errors import FbaWarning, FormatError, OptionError, Remedy
from fba.formats.time_codes import DAY, seconds_between
from fba.limits import DEFAULT_LIMITS, Limits

SYNCS: tuple[Sync, ...] = get_args(Sync)
CLOCK_TOLERANCE = 0.02
"""Share of a frame by which two clocks may differ and still share their frames."""
MIN_STEPS = 1000
"""Fewest steps per second to which a clock between frames is rounded."""
START_TOGETHER = Remedy("sync", "let both begin together with {}", "'offset'")
Scalar = TypeVar("Scalar", bound=np.generic)


def merge(face_animation: Animation, body_animation: Animation) -> Animation:
    """Return the face of one animation with the body of the other, joined by frame number.

    The result has the frame numbers of both; in a frame that a part lacks, it is not sent. The name is that
    of the face, else that of the body. Raises FormatError if a part is missing or the frame rates differ.
    """
    face, body, rate = face_animation.face, body_animation.body, face_animation.rate
    names = [repr(one.name) if one.name else "the animation" for one in (face_animation, body_animation)]
    if face is None:
        raise FormatError(f"nothing to join: {names[0]} has no face")
    if body is None:
        raise FormatError(f"nothing to join: {names[1]} has no body")
    if rate != body_animation.rate:
        resample = Remedy("rate", "resample one of them first, with {}", f"{rate}", "Animation.resample")
        raise FormatError(f"{names[0]} has {rate} frames/s, {names[1]} {body_animation.rate}").with_remedies(
            resample
        )
    index = np.union1d(face_animation.index, body_animation.index)
    rows = np.searchsorted(index, face_animation.index)
    joined_face = FaceTrack(
        _spread(face.values, rows, len(index)),
        _spread(face.mask, rows, len(index)),
        _spread(face.viseme, rows, len(index)),
        _spread(face.expression, rows, len(index)),
        _spread(face.interpolated, rows, len(index)) if face.interpolated is not None else None,
    )
    rows = np.searchsorted(index, body_animation.index)
    joined_body = BodyTrack(_spread(body.values, rows, len(index)), _spread(body.mask, rows, len(index)))
    name = face_animation.name or body_animation.name
    return Animation(rate, index, joined_face, joined_body, name)


def _spread(values: npt.NDArray[Scalar], rows: Intp, count: int) -> npt.NDArray[Scalar]:
    """Return an array (count, columns) with values (K, columns) in rows (K,), zeros (False) elsewhere."""
    spread = np.zeros((count, values.shape[1]), dtype=values.dtype)
    spread[rows] = values
    return spread


@dataclass(frozen=True, eq=False)
class Recording:
    """A face or a body, and when it was recorded.

    name: of the file, for messages. start: time of day at frame index 0, in seconds; None if unknown.
    """

    name: str
    animation: Animation
    start: float | None = None

    @property
    def span(self) -> tuple[float, float]:
        """Seconds from index 0 to the first frame and to the end of the last one."""
        index, rate = self.animation.index, float(self.animation.rate)
        return float(index[0]) / rate, float(index[-1] + 1) / rate


@dataclass(frozen=True, eq=False)
class Together:
    """Two recordings as one animation.

    body_rows: rows of the animation that have the body. body_lead: count of frames of the body before them.
    spans: begin and end of each recording, in seconds from the animation's index 0. how: "timecode" or
    "offset". resampled: the rates of resampled recordings, by name. start: time of day at index 0; None if
    unknown.
    """

    animation: Animation
    body_rows: slice
    body_lead: int
    spans: tuple[tuple[float, float], tuple[float, float]]
    how: str
    resampled: dict[str, Fraction]
    start: float | None

    @property
    def common(self) -> tuple[float, float]:
        """The span of time that both recordings cover."""
        (first, end), (other, last) = self.spans
        return max(first, other), min(end, last)


def join(
    first: Recording,
    second: Recording,
    *,
    sync: Sync | None = None,
    offset: float = 0.0,
    begins: float | None = None,
    trim: bool = False,
    limits: Limits = DEFAULT_LIMITS,
) -> Together:
    """Return a face and a body as one animation, at the higher of their rates.

    The frames of the body stay as they are; the face is interpolated at their times.

    sync: "timecode" places recordings by the times of day at which they were made, before or after midnight;
    "offset" lets the second begin `offset` seconds after the first; None takes time codes if both have them.
    begins: the time of day that replaces the second recording's. trim: leave out the frames that only one of
    them covers; otherwise these are kept, without the other part.

    Raises FormatError if they do not overlap, OptionError, LimitError. Warns (FbaWarning) of a recording
    without the time code that `sync` asks for: both begin together.
    """
    starts = first.start, second.start if begins is None else begins
    if begins is not None and first.start is None:
        raise OptionError(f"{first.name} has no time code; give the offset in seconds")
    how = _choose_clock((first, second), starts, sync)
    later = offset
    if how == "timecode" and starts[0] is not None and starts[1] is not None:
        later = seconds_between(starts[0], starts[1])
    _check_overlap(first, second, later, how)
    rate = max(first.animation.rate, second.animation.rate)
    moves = (-later, 0.0) if first.animation.face is not None else (0.0, later)
    placed = [
        _place(one.animation, move, rate, limits) for one, move in zip((first, second), moves, strict=True)
    ]
    early = max(-min(int(part.index[0]) for part in placed), 0)
    placed = [_shift(part, early) for part in placed]
    face, body = placed if placed[0].face is not None else placed[::-1]
    animation = merge(face, body)
    if trim:
        animation = _trim(animation, face, body)
    rows = np.searchsorted(animation.index, [body.index[0], body.index[-1] + 1])
    clocks = [start - move for start, move in zip(starts, moves, strict=True) if start is not None]
    return Together(
        animation,
        slice(int(rows[0]), int(rows[1])),
        max(int(animation.index[0] - body.index[0]), 0),
        (Recording("", placed[0]).span, Recording("", placed[1]).span),
        how,
        {one.name: one.animation.rate for one in (first, second) if one.animation.rate != rate},
        (clocks[0] - early / float(rate)) % DAY if clocks else None,
    )


def _choose_clock(
    recordings: tuple[Recording, Recording], starts: tuple[float | None, float | None], sync: Sync | None
) -> str:
    """Return "timecode" or "offset". Warns of recordings without the time code that `sync` asks for."""
    if sync is not None and sync not in SYNCS:
        raise OptionError(f"sync must be one of {', '.join(SYNCS)}, not {sync!r}")
    without = [one.name for one, start in zip(recordings, starts, strict=True) if start is None]
    if sync == "timecode" and without:
        warnings.warn(
            FbaWarning(f"no time code in {' and '.join(without)}: both begin together").with_remedies(
                Remedy("offset", "say when the second one begins with {}", "2.4")
            ),
            stacklevel=3,
        )
    return "offset" if without or sync == "offset" else "timecode"


def _trim(animation: Animation, face: Animation, body: Animation) -> Animation:
    """Return the frames that both parts cover."""
    low, high = max(face.index[0], body.index[0]), min(face.index[-1], body.index[-1])
    rows = np.flatnonzero((animation.index >= low) & (animation.index <= high))
    if not len(rows):
        raise FormatError("the two inputs share less than a frame; nothing is left of them")
    return animation[int(rows[0]) : int(rows[-1]) + 1]


def _shift(animation: Animation, frames: int) -> Animation:
    return replace(animation, index=animation.index + frames)


def _check_overlap(first: Recording, second: Recording, later: float, how: str) -> None:
    """Raise FormatError, which names both spans, for recordings that share no moment."""
    one, other = first.span, (second.span[0] + later, second.span[1] + later)
    if one[0] < other[1] and other[0] < one[1]:
        return
    begun = first.start if how == "timecode" else None
    texts = [
        f"{recording.name} lasts from {_clock(span[0], begun)} to {_clock(span[1], begun)}"
        for recording, span in ((first, one), (second, other))
    ]
    error = FormatError(f"{', '.join(texts)}: they share no moment")
    raise error.with_remedies(START_TOGETHER) if how == "timecode" else error


def _clock(seconds: float, start: float | None) -> str:
    """Return a time of day as text; seconds without `start`."""
    if start is None:
        return f"{seconds:.2f} s"
    minutes, rest = divmod(round(start + seconds, 2) % DAY, 60)
    return f"{int(minutes) // 60:02}:{int(minutes) % 60:02}:{rest:05.2f}"


def _place(animation: Animation, later: float, rate: Fraction, limits: Limits) -> Animation:
    """Return an animation `later` seconds later, at another rate.

    Frames between its own frames are interpolated (`Animation.resample`).
    """
    frames = later * float(animation.rate)
    if abs(frames - round(frames)) <= CLOCK_TOLERANCE and rate == animation.rate:
        return _shift(animation, round(frames))
    fine = ceil(MIN_STEPS / animation.rate)
    index = animation.index * fine + round(frames * fine)
    moved = replace(animation, rate=animation.rate * fine, index=index)
    return moved.resample(rate, limits=limits)
