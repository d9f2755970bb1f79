"""Recordings of one moment on one clock: by their time codes, or by an offset that is given."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from fractions import Fraction
from math import ceil
from typing import get_args

import numpy as np

from fba.animation import Animation
from fba.choices import Sync
from fba.errors import FbaWarning, FormatError, OptionError, Remedy
from fba.formats.merge import merge
from fba.formats.time_codes import DAY, seconds_between
from fba.limits import DEFAULT_LIMITS, Limits

SYNCS: tuple[Sync, ...] = get_args(Sync)
STRAIGHT = 0.02
"""Share of a frame by which two clocks may differ and still share their frames."""
FINEST = 1000
"""Steps a second, at least, to which a clock that lies between frames is moved."""
START_TOGETHER = Remedy("sync", "let both begin together with {}", "'offset'")


@dataclass(frozen=True, eq=False)
class Recording:
    """A face or a body, and when it was recorded.

    name: of the file, for messages. start: time of day at frame index 0, in seconds; None where unknown.
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

    spans: seconds from the animation's index 0 on, where each recording begins and ends. how: "timecode" or
    "offset". resampled: the rates of recordings that were brought to another one, by their names. start: time
    of day at index 0; None where unknown. body_rows: rows of the animation with the body, whose own first
    `body_lead` frames are left out.
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

    The frames of the body stay as they are, those of the face are interpolated at their times.

    sync: "timecode" places them by the times of day at which they were recorded, which may lie on both sides
    of midnight; "offset" lets the second begin `offset` seconds after the first; None takes time codes where
    both have them. begins: the second recording's time of day, which replaces its own. trim: what only one of
    them covers is left out; otherwise it is kept, and the other part is not sent there.

    Raises FormatError if they do not overlap, OptionError, LimitError. Warns (FbaWarning) of a recording
    without the time code that is asked for: it begins with the other one.
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
    """Return "timecode" or "offset". Warns of recordings without the time code that is asked for."""
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
    return Animation(animation.rate, animation.index + frames, animation.face, animation.body, animation.name)


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
    """Return a time of day, or seconds where none is known."""
    if start is None:
        return f"{seconds:.2f} s"
    minutes, rest = divmod(round(start + seconds, 2) % DAY, 60)
    return f"{int(minutes) // 60:02}:{int(minutes) % 60:02}:{rest:05.2f}"


def _place(animation: Animation, later: float, rate: Fraction, limits: Limits) -> Animation:
    """Return an animation `later` seconds later, at a rate whose frames need not be its own.

    Where these lie between its own frames, values are interpolated (`Animation.resample`).
    """
    frames = later * float(animation.rate)
    if abs(frames - round(frames)) <= STRAIGHT and rate == animation.rate:
        return _shift(animation, round(frames))
    fine = ceil(FINEST / animation.rate)
    moved = Animation(
        animation.rate * fine,
        animation.index * fine + round(frames * fine),
        animation.face,
        animation.body,
        animation.name,
    )
    return moved.resample(rate, limits=limits)
