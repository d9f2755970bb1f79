"""The data model: `Animation`, `FaceTrack`, `BodyTrack`, `Frame`.

Parameters are numbered as in the standard; column i of an array is parameter i+1. Values are
integers in the standard's units (FAPU fractions, 1e-5 rad, mm). A mask says which were *sent*: values
that were not sent are stored as 0; `fba.face.resolve` computes what a face shows in their place.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from importlib import import_module
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from fba.arrays import Array, Bool, Float64, Int64, Intp
from fba.errors import OptionError
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import EXPRESSION_FIELDS, VISEME_FIELDS, bap_angles, bap_numbers, fap_numbers
from fba.tracks import BodyTrack, FaceTrack, freeze, integers

__all__ = ["Animation", "BodyTrack", "FaceTrack", "Frame"]

_INDEX_MAX = 1 << 62
"""Bound of frame indices, so that sums of two fit 64 bits."""

_RESAMPLED_BYTES = 10
"""Memory of a resampled parameter in a frame: an int32, masks, and its share of temporary arrays."""
_HALF_TURN = 1e5 * math.pi
"""In the unit of angles, 1e-5 rad."""
_CHUNK_FRAMES = 1 << 14
"""Frames that are interpolated at once, to limit the memory for numbers of 64 bits."""


@dataclass(frozen=True, eq=False, slots=True)
class Frame:
    """One frame of an animation.

    index: shown at index / rate seconds. face, body: tracks of length 1; None if the frame lacks the part.
    plane: of a decoded frame, its plane in the stream (`fba.codec.PlaneInfo`).
    """

    index: int
    rate: Fraction
    face: FaceTrack | None = None
    body: BodyTrack | None = None
    plane: Any = field(default=None, repr=False)

    @property
    def time(self) -> Fraction:
        """Exact time of the frame, in seconds."""
        return self.index / self.rate

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Frame):
            return NotImplemented
        same_time = self.index == other.index and self.rate == other.rate
        return same_time and self.face == other.face and self.body == other.body


@dataclass(frozen=True, eq=False)
class Animation:
    """A performance: frames at exact times, for a face, a body, or both.

    rate: frames per second, an exact fraction. index: int64 (T,), strictly increasing; frame t is shown
    at index[t] / rate seconds. face, body: tracks of T frames, at least one of them. Immutable;
    compared by content, without the name.

    `animation[3]` is a `Frame`, `animation[10:20]` an `Animation`, and so is `animation.between(1.5, 3)`,
    which takes seconds. Raises ValueError if the parts contradict each other.
    """

    rate: Fraction
    index: Int64
    face: FaceTrack | None = None
    body: BodyTrack | None = None
    name: str = ""

    def __post_init__(self) -> None:
        rate = self.rate if isinstance(self.rate, Fraction) else Fraction(self.rate)
        if rate <= 0:
            raise ValueError(f"Animation: the frame rate must be positive, not {rate}")
        index = integers(self.index, np.int64, "Animation: index")
        if index.ndim != 1:
            raise ValueError(f"Animation: index must have shape (T,), not {index.shape}")
        if len(index) > 1 and not (np.diff(index) > 0).all():
            back = int(np.argmax(np.diff(index) <= 0)) + 1
            raise ValueError(
                f"Animation: index must increase, but frame {back} has {index[back]} after {index[back - 1]}"
            )
        if self.face is None and self.body is None:
            raise ValueError("Animation: needs a face track, a body track, or both")
        for kind, track in (("face", self.face), ("body", self.body)):
            if track is not None and len(track) != len(index):
                raise ValueError(f"Animation: {len(index)} frame indices, but {len(track)} {kind} frames")
        freeze(self, rate=rate, index=index)

    @classmethod
    def from_frames(cls, frames: Iterable[Frame], name: str = "") -> Animation:
        """Return the animation of frames with equal rates. ValueError without frames."""
        frames = list(frames)
        if not frames:
            raise ValueError("Animation.from_frames: no frames")
        rates = {frame.rate for frame in frames}
        if len(rates) > 1:
            raise ValueError(
                f"Animation.from_frames: frames of several rates: {', '.join(map(str, sorted(rates)))}"
            )
        face = FaceTrack.join([(f.face, 1) for f in frames])
        body = BodyTrack.join([(f.body, 1) for f in frames])
        return cls(rates.pop(), np.array([f.index for f in frames], dtype=np.int64), face, body, name)

    @staticmethod
    def concatenate(parts: Sequence[Animation]) -> Animation:
        """Return animations joined; each begins a frame after the end of the previous one.

        ValueError without parts, or if rates differ (resample first).
        """
        if not parts:
            raise ValueError("Animation.concatenate: no parts")
        rates = {part.rate for part in parts}
        if len(rates) > 1:
            raise ValueError(
                "Animation.concatenate: the parts have different frame rates "
                f"({', '.join(map(str, sorted(rates)))}); resample them to one"
            )
        indices: list[Int64] = []
        following: int | None = None
        for part in parts:
            if not len(part):
                continue
            offset = 0 if following is None else following - int(part.index[0])
            indices.append(part.index + offset)
            following = int(part.index[-1]) + offset + 1
        face = FaceTrack.join([(part.face, len(part)) for part in parts])
        body = BodyTrack.join([(part.body, len(part)) for part in parts])
        index = np.concatenate(indices) if indices else np.empty(0, dtype=np.int64)
        return Animation(parts[0].rate, index, face, body, parts[0].name)

    def __len__(self) -> int:
        return len(self.index)

    def __iter__(self) -> Iterator[Frame]:
        for position in range(len(self)):
            yield self[position]

    @overload
    def __getitem__(self, frames: int) -> Frame: ...
    @overload
    def __getitem__(self, frames: slice) -> Animation: ...
    def __getitem__(self, frames: int | slice) -> Frame | Animation:
        if isinstance(frames, slice):
            if frames.step is not None and frames.step < 1:
                raise ValueError("Animation: frames cannot be taken backwards; use a positive step")
            return Animation(
                self.rate,
                self.index[frames],
                self.face[frames] if self.face is not None else None,
                self.body[frames] if self.body is not None else None,
                self.name,
            )
        position = range(len(self))[frames]  # turns negative positions, raises IndexError outside
        frame = slice(position, position + 1)
        face = self.face[frame] if self.face is not None else None
        body = self.body[frame] if self.body is not None else None
        return Frame(int(self.index[position]), self.rate, face, body)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Animation):
            return NotImplemented
        return (
            self.rate == other.rate
            and np.array_equal(self.index, other.index)
            and self.face == other.face
            and self.body == other.body
        )

    def __repr__(self) -> str:
        """Return one line, without the arrays."""
        parts = [part for part in ("face", "body") if getattr(self, part) is not None]
        summary = f"{len(self)} frames at {float(self.rate):g} frames/s, {float(self.duration):g} s"
        name = f"{self.name}: " if self.name else ""
        return f"<Animation {name}{', '.join([summary, *parts])}>"

    @property
    def times(self) -> Float64:
        """float64 (T,): seconds at which the frames are shown."""
        integral, fraction = _scale(self.index, 1 / self.rate)
        return integral.astype(np.float64) + fraction

    @property
    def duration(self) -> Fraction:
        """Seconds from the first frame to one frame period after the last."""
        return (
            Fraction(int(self.index[-1]) - int(self.index[0]) + 1) / self.rate if len(self) else Fraction(0)
        )

    def between(self, start: Fraction | float, end: Fraction | float = math.inf) -> Animation:
        """Return the frames that are shown from `start` on and before `end`, in seconds as in `times`.

        Their times stay as they are. ValueError if the end is before the start.
        """
        if not start <= end:
            raise ValueError(f"between: the end, {end} s, must not be before the start, {start} s")
        first, last = np.searchsorted(self.times, [float(start), float(end)]).tolist()
        return self[first:last]

    def to_dataframe(self) -> Any:
        """Return a `pandas.DataFrame` of sent parameters: a row for each frame, indexed by time in seconds.

        Columns are the parameters that any frame sends, by name: integers in the standard's units, missing
        (`pandas.NA`) in frames that do not send them. The fields of visemes and expressions stand in place of
        FAPs 1 and 2. OptionError where pandas is not installed.
        """
        try:
            pandas = import_module("pandas")
        except ImportError as error:
            raise OptionError(
                "to_dataframe needs the package pandas, which is not installed; without it, "
                "np.asarray(animation.face) is an array of values"
            ) from error
        columns = {
            name: pandas.arrays.IntegerArray(values.astype(np.int32), ~sent)
            for name, values, sent in self._columns()
        }
        return pandas.DataFrame(columns, index=pandas.Index(self.times, name="seconds"))

    def _columns(self) -> Iterator[tuple[str, Array, Bool]]:
        """Yield the name, the values (T,), and the mask (T,) of each parameter that any frame sends."""
        if self.face is not None:
            high_level = ((VISEME_FIELDS, self.face.viseme), (EXPRESSION_FIELDS, self.face.expression))
            for column, (names, values) in enumerate(high_level):
                sent = self.face.mask[:, column]
                if sent.any():
                    yield from ((name, values[:, each], sent) for each, name in enumerate(names))
        for track, numbers in ((self.face, fap_numbers()), (self.body, bap_numbers())):
            if track is None:
                continue
            for name, number in numbers.items():
                sent = track.mask[:, number - 1]
                if name not in ("viseme", "expression") and sent.any():
                    yield name, track.values[:, number - 1], sent

    def resample(self, rate: Fraction | int | str, *, limits: Limits = DEFAULT_LIMITS) -> Animation:
        """Return the same animation at another frame rate, in evenly spaced frames without gaps.

        Low-level FAPs, BAPs, blends and intensities are interpolated linearly between the frames that
        sent them, angles of the body the shorter way round; selects and masks hold until the next frame;
        definition flags are set on the first frame at or after the one that carried them.

        Raises LimitError if the result would have more frames or need more memory than `limits` allow,
        ValueError for a rate that is not positive.
        """
        rate = Fraction(rate)
        if rate <= 0:
            raise ValueError(f"resample: the frame rate must be positive, not {rate}")
        if not len(self):
            return Animation(rate, self.index, self.face, self.body, self.name)
        ratio = rate / self.rate
        # rounded up: the first new frame is not before the first old one
        first = -(-int(self.index[0]) * ratio.numerator // ratio.denominator)
        last = int(self.index[-1]) * ratio.numerator // ratio.denominator
        count = max(last - first + 1, 1)
        what = f"{self.name or 'the animation'}, resampled to {rate} frames/s,"
        limits.check_seconds(float(self.duration), self.name or "the animation")
        limits.check_frames(count, what)
        parts = [part for part in (self.face, self.body) if part is not None]
        row_bytes = sum(part.values.shape[1] * _RESAMPLED_BYTES for part in parts)
        limits.check_bytes(count * row_bytes, what, source=len(self) * row_bytes)
        if max(abs(first), abs(last)) > _INDEX_MAX:
            raise ValueError(f"resample: frame indices at {rate} frames/s do not fit 64 bits")
        index = np.arange(first, first + count, dtype=np.int64)
        integral, fraction = _scale(index, 1 / ratio)  # in frames of this animation
        integral = integral.astype(np.int64)
        before = np.clip(np.searchsorted(self.index, integral, side="right") - 1, 0, len(self) - 1)
        after = np.minimum(before + 1, len(self) - 1)
        gap = np.maximum(self.index[after] - self.index[before], 1)
        weight = np.clip((integral - self.index[before] + fraction) / gap, 0.0, 1.0)
        is_first = np.ones(count, dtype=bool)
        is_first[1:] = before[1:] != before[:-1]
        face = _resample_face(self.face, before, after, weight, is_first) if self.face is not None else None
        body = None
        if self.body is not None:
            mask = self.body.mask[before]
            both = mask & self.body.mask[after]
            between = _between(self.body.values, before, after, weight, both, angles=bap_angles())
            body = BodyTrack(between, mask)
        return Animation(rate, index, face, body, self.name)


def check_order(before: Animation, after: Animation) -> None:
    """Raise ValueError if `after` cannot follow in a stream: it has another rate, or does not come later."""
    if after.rate != before.rate:
        raise ValueError(f"the stream has {before.rate} frames/s, this frame {after.rate}; resample it first")
    if after.index[0] <= before.index[0]:
        raise ValueError(f"frame index {after.index[0]} comes after {before.index[0]}; they must increase")


def _scale(index: Int64, factor: Fraction) -> tuple[Array, Float64]:
    """Return index x factor as an exact integral part and a fraction in 0..1.

    Computed in Python's integers where 64 bits are not enough.
    """
    largest = max(abs(int(index[0])), abs(int(index[-1])), 1) if len(index) else 1
    fits = largest * factor.numerator < _INDEX_MAX > factor.denominator
    product = (index if fits else index.astype(object)) * factor.numerator
    integral = product // factor.denominator
    rest = (product - integral * factor.denominator).astype(np.float64)
    return integral, rest / float(factor.denominator)


def _between(
    values: npt.NDArray[np.signedinteger],
    before: Intp,
    after: Intp,
    weight: Float64,
    both: Bool,
    angles: Bool | None = None,
) -> npt.NDArray[np.signedinteger]:
    """Return values (S, columns) between frames before (S,) and after (S,), by weight (S,) in 0..1.

    both: bool (S, columns), True where both frames sent the value; elsewhere the value before remains.
    angles: bool (columns,), True for angles, which turn the shorter way and stay within +-pi if both are.
    """
    result = np.empty((len(before), values.shape[1]), dtype=values.dtype)
    for first in range(0, len(before), _CHUNK_FRAMES):
        chunk = slice(first, first + _CHUNK_FRAMES)
        start = values[before[chunk]]
        change = np.where(both[chunk], values[after[chunk]].astype(np.float64) - start, 0.0)
        between = start + change * weight[chunk, None]
        if angles is not None:
            far = np.nonzero((np.abs(change) > _HALF_TURN) & angles)
            begin, end = start[far].astype(np.float64), values[after[chunk]][far].astype(np.float64)
            shorter = _within_half_turn(end - begin)
            moved = begin + shorter * weight[chunk][far[0]]
            within = np.maximum(np.abs(begin), np.abs(end)) < _HALF_TURN + 1
            between[far] = np.where(within, _within_half_turn(moved), moved)
        result[chunk] = np.rint(between)
    return result


def _within_half_turn(angles: Float64) -> Float64:
    """Return angles, in 1e-5 rad, within +-pi."""
    result: Float64 = angles - 2 * _HALF_TURN * np.rint(angles / (2 * _HALF_TURN))
    return result


def _resample_face(face: FaceTrack, before: Intp, after: Intp, weight: Float64, is_first: Bool) -> FaceTrack:
    """Return a face track resampled by `_between`. is_first: (S,), whether an old frame begins."""
    mask = face.mask[before]
    both = mask & face.mask[after]
    fields = []
    for source, selects, amounts, flags in (
        (face.viseme, (0, 1), (2,), (3,)),
        (face.expression, (0, 2), (1, 3), (4, 5)),
    ):
        held = source[before].copy()
        sent = both[:, 0 if source is face.viseme else 1]
        same = sent & (held[:, selects] == source[after][:, selects]).all(axis=1)
        blended = _between(source, before, after, weight, np.broadcast_to(same[:, None], held.shape))
        held[:, amounts] = blended[:, amounts]
        held[:, flags] = np.where(is_first[:, None], held[:, flags], 0)
        fields.append(held)
    interpolated = face.interpolated[before] if face.interpolated is not None else None
    values = _between(face.values, before, after, weight, both)
    return FaceTrack(values, mask, fields[0], fields[1], interpolated)
