"""The data model that everything passes around: `Animation`, `FaceTrack`, `BodyTrack`, `Frame`.

Parameters are numbered as in the standard; column i of an array is parameter i+1. Values are
integers in the standard's units (FAPU fractions, 1e-5 rad, mm). A mask says what was *sent*: values
that were not sent are stored as 0, and what a face shows in their place is `fba.face.resolve`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, TypeVar, overload

import numpy as np
import numpy.typing as npt

from fba.parameters import (
    BAP_COUNT,
    EXPRESSION_FIELDS,
    EXPRESSION_SELECT_MAX,
    FAP_COUNT,
    VISEME_FIELDS,
    VISEME_SELECT_MAX,
)

_INDEX_MAX = 1 << 62
"""Beyond this, indices are no longer counted in 64 bits."""

Int32 = npt.NDArray[np.int32]
Int16 = npt.NDArray[np.int16]
Bool = npt.NDArray[np.bool_]

MAX_FRAMES = 50_000_000
"""Most frames that a resampling makes: a guard against absurd times in damaged input."""


@dataclass(frozen=True, eq=False, slots=True)
class FaceTrack:
    """FAPs over time.

    values: int32 (T, 68), FAP i+1 in column i, in its FAPU; columns 0 and 1 are always 0.
    mask: bool (T, 68), True where the parameter was sent; columns 0 and 1 for viseme and expression.
    viseme: int16 (T, 4): viseme_select1, viseme_select2, viseme_blend, viseme_def.
    expression: int16 (T, 6): expression_select1, expression_intensity1, expression_select2,
        expression_intensity2, init_face, expression_def.

    Arrays are copied if they must be changed, and read-only afterwards. Raises ValueError on a wrong
    shape, a non-integer dtype, or a select or flag outside its range.
    """

    values: Int32
    mask: Bool
    viseme: Int16 = None  # type: ignore[assignment]
    expression: Int16 = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        values, mask = _checked_values(self.values, self.mask, FAP_COUNT, "FaceTrack")
        if values[:, :2].any():
            raise ValueError(
                "FaceTrack: columns 0 and 1 of values (FAP 1 viseme, FAP 2 expression) must be 0; "
                "their content goes into viseme and expression"
            )
        count = len(values)
        viseme = _checked_fields(self.viseme, count, VISEME_FIELDS, "viseme", mask[:, 0])
        expression = _checked_fields(self.expression, count, EXPRESSION_FIELDS, "expression", mask[:, 1])
        for fields, names in ((viseme, VISEME_FIELDS), (expression, EXPRESSION_FIELDS)):
            for column, name in enumerate(names):
                if "select" in name:
                    limit = VISEME_SELECT_MAX if name.startswith("viseme") else EXPRESSION_SELECT_MAX
                elif name.endswith("_def") or name == "init_face":
                    limit = 1
                else:
                    continue  # blends and intensities may leave 0..63 by the quantiser's rounding
                low, high = (int(fields[:, column].min()), int(fields[:, column].max())) if count else (0, 0)
                if low < 0 or high > limit:
                    raise ValueError(
                        f"FaceTrack: {name} must lie in 0..{limit}, found {low if low < 0 else high}"
                    )
        _freeze(self, values=values, mask=mask, viseme=viseme, expression=expression)

    @classmethod
    def empty(cls, count: int) -> FaceTrack:
        """A track of that many frames that send nothing."""
        return cls(np.zeros((count, FAP_COUNT), dtype=np.int32), np.zeros((count, FAP_COUNT), dtype=bool))

    @classmethod
    def join(cls, parts: Iterable[tuple[FaceTrack | None, int]]) -> FaceTrack | None:
        """Tracks one after another; each with its count of frames, None where it sends nothing."""
        parts = list(parts)
        if all(track is None for track, _ in parts):
            return None
        tracks = [track if track is not None else cls.empty(count) for track, count in parts]
        return cls(
            _stacked([t.values for t in tracks]),
            _stacked([t.mask for t in tracks]),
            _stacked([t.viseme for t in tracks]),
            _stacked([t.expression for t in tracks]),
        )

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, frames: slice) -> FaceTrack:
        names = ("values", "mask", "viseme", "expression")
        return trusted(FaceTrack, **{name: getattr(self, name)[frames] for name in names})

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, FaceTrack):
            return NotImplemented
        return (
            np.array_equal(self.mask, other.mask)
            and np.array_equal(self.values, other.values)
            and np.array_equal(self.viseme, other.viseme)
            and np.array_equal(self.expression, other.expression)
        )

    __hash__ = None  # type: ignore[assignment]


@dataclass(frozen=True, eq=False, slots=True)
class BodyTrack:
    """BAPs over time.

    values: int32 (T, 296), BAP i+1 in column i: 1e-5 rad, millimetres for BAPs 181..183.
    mask: bool (T, 296), True where the parameter was sent.

    Same rules as `FaceTrack`.
    """

    values: Int32
    mask: Bool

    def __post_init__(self) -> None:
        values, mask = _checked_values(self.values, self.mask, BAP_COUNT, "BodyTrack")
        _freeze(self, values=values, mask=mask)

    @classmethod
    def empty(cls, count: int) -> BodyTrack:
        """A track of that many frames that send nothing."""
        return cls(np.zeros((count, BAP_COUNT), dtype=np.int32), np.zeros((count, BAP_COUNT), dtype=bool))

    @classmethod
    def join(cls, parts: Iterable[tuple[BodyTrack | None, int]]) -> BodyTrack | None:
        """Tracks one after another; each with its count of frames, None where it sends nothing."""
        parts = list(parts)
        if all(track is None for track, _ in parts):
            return None
        tracks = [track if track is not None else cls.empty(count) for track, count in parts]
        return cls(_stacked([t.values for t in tracks]), _stacked([t.mask for t in tracks]))

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, frames: slice) -> BodyTrack:
        return trusted(BodyTrack, values=self.values[frames], mask=self.mask[frames])

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, BodyTrack):
            return NotImplemented
        return np.array_equal(self.mask, other.mask) and np.array_equal(self.values, other.values)

    __hash__ = None  # type: ignore[assignment]


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame: one plane's worth of an animation.

    index: shown at index / rate seconds. face and body: tracks of length 1, or None where this frame
    carries nothing for them. plane: how it stood in a stream (`fba.codec.PlaneInfo`), where it comes
    from one.
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
        return (self.index, self.rate, self.face, self.body) == (
            other.index,
            other.rate,
            other.face,
            other.body,
        )

    __hash__ = None  # type: ignore[assignment]


@dataclass(frozen=True, eq=False)
class Animation:
    """A performance: frames at exact times, for a face, a body, or both.

    rate: frames a second, an exact fraction. index: int64 (T,), strictly increasing; frame t is shown
    at index[t] / rate seconds. face, body: tracks of T frames, at least one of them. Immutable;
    compares by content (the name does not count).

    `animation[3]` is a `Frame`, `animation[10:20]` an `Animation`. Raises ValueError on construction
    where the parts contradict each other.
    """

    rate: Fraction
    index: npt.NDArray[np.int64]
    face: FaceTrack | None = None
    body: BodyTrack | None = None
    name: str = ""

    def __post_init__(self) -> None:
        rate = Fraction(self.rate)
        if rate <= 0:
            raise ValueError(f"Animation: the frame rate must be positive, not {rate}")
        index = _integers(self.index, np.int64, "Animation: index")
        if index.ndim != 1:
            raise ValueError(f"Animation: index must have shape (T,), not {index.shape}")
        if len(index) > 1 and not (np.diff(index) > 0).all():
            at = int(np.argmax(np.diff(index) <= 0)) + 1
            raise ValueError(
                f"Animation: index must increase, but frame {at} has {index[at]} after {index[at - 1]}"
            )
        if self.face is None and self.body is None:
            raise ValueError("Animation: needs a face track, a body track, or both")
        for kind, track in (("face", self.face), ("body", self.body)):
            if track is not None and len(track) != len(index):
                raise ValueError(f"Animation: {len(index)} frame indices, but {len(track)} {kind} frames")
        _freeze(self, rate=rate, index=index)

    @classmethod
    def from_frames(cls, frames: Iterable[Frame], name: str = "") -> Animation:
        """Join frames of one rate, e.g. those that a `Decoder` gave. ValueError where there is none."""
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
        """Play parts one after another: each begins one frame after the last of the one before.

        ValueError where there is none, or where rates differ (resample first).
        """
        if not parts:
            raise ValueError("Animation.concatenate: no parts")
        rates = {part.rate for part in parts}
        if len(rates) > 1:
            raise ValueError(
                "Animation.concatenate: the parts have different frame rates "
                f"({', '.join(map(str, sorted(rates)))}); resample them to one"
            )
        indices: list[npt.NDArray[np.int64]] = []
        following: int | None = None
        for part in parts:
            if not len(part):
                continue
            offset = 0 if following is None else following - int(part.index[0])
            indices.append(part.index + offset)
            following = int(part.index[-1]) + offset + 1
        face = FaceTrack.join([(part.face, len(part)) for part in parts])
        body = BodyTrack.join([(part.body, len(part)) for part in parts])
        index = (
            np.concatenate(indices) if indices else np.empty(0, dtype=np.int64)
        )  # zero frames, nothing to fill
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
        position = range(len(self))[frames]  # also turns negative positions and refuses those outside
        one = slice(position, position + 1)
        face = self.face[one] if self.face is not None else None
        body = self.body[one] if self.body is not None else None
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

    __hash__ = None  # type: ignore[assignment]

    @property
    def times(self) -> npt.NDArray[np.float64]:
        """(T,) seconds at which the frames are shown."""
        whole, part = _scaled(self.index, 1 / self.rate)
        return whole.astype(np.float64) + part

    @property
    def duration(self) -> Fraction:
        """Seconds from the first frame to one frame period after the last."""
        return (
            Fraction(int(self.index[-1]) - int(self.index[0]) + 1) / self.rate if len(self) else Fraction(0)
        )

    def resample(self, rate: Fraction | int | str) -> Animation:
        """The same performance at another frame rate, evenly spaced frames without gaps.

        Low-level FAPs, BAPs, blends and intensities are interpolated linearly between the frames that
        sent them; selects and masks hold until the next frame; definition flags are set on the first
        frame at or after the one that carried them. Raises ValueError beyond `MAX_FRAMES` frames.
        """
        rate = Fraction(rate)
        if rate <= 0:
            raise ValueError(f"resample: the frame rate must be positive, not {rate}")
        if not len(self):
            return Animation(rate, self.index, self.face, self.body, self.name)
        ratio = rate / self.rate
        first = -(
            -int(self.index[0]) * ratio.numerator // ratio.denominator
        )  # first new frame not before ours
        last = int(self.index[-1]) * ratio.numerator // ratio.denominator
        count = max(last - first + 1, 1)
        if count > MAX_FRAMES or max(abs(first), abs(last)) > _INDEX_MAX:
            raise ValueError(
                f"resample: {self.name or 'the animation'} would become {count} frames at {rate} frames/s "
                f"(at most {MAX_FRAMES}); its times are implausible or the rate is too high"
            )
        index = np.arange(first, first + count, dtype=np.int64)
        whole, part = _scaled(index, 1 / ratio)  # in frames of this animation
        whole = whole.astype(np.int64)
        before = np.clip(np.searchsorted(self.index, whole, side="right") - 1, 0, len(self) - 1)
        after = np.minimum(before + 1, len(self) - 1)
        gap = np.maximum(self.index[after] - self.index[before], 1)
        weight = np.clip((whole - self.index[before] + part) / gap, 0.0, 1.0)
        fresh = np.ones(count, dtype=bool)
        fresh[1:] = before[1:] != before[:-1]
        face = _resampled_face(self.face, before, after, weight, fresh) if self.face is not None else None
        body = None
        if self.body is not None:
            mask = self.body.mask[before]
            both = mask & self.body.mask[after]
            body = BodyTrack(_between(self.body.values, before, after, weight, both), mask)
        return Animation(rate, index, face, body, self.name)


def _scaled(
    index: npt.NDArray[np.int64], factor: Fraction
) -> tuple[npt.NDArray[Any], npt.NDArray[np.float64]]:
    """index x factor: whole part, exact, and the rest in 0..1. In Python's integers where 64 bits end."""
    largest = max(abs(int(index[0])), abs(int(index[-1])), 1) if len(index) else 1
    fits = largest * factor.numerator < _INDEX_MAX > factor.denominator
    product = (index if fits else index.astype(object)) * factor.numerator
    whole = product // factor.denominator
    rest = (product - whole * factor.denominator).astype(np.float64)
    return whole, rest / float(factor.denominator)


Track = TypeVar("Track", FaceTrack, BodyTrack)


def trusted(kind: type[Track], **arrays: npt.NDArray[Any]) -> Track:
    """A track of arrays that are known to be right, such as parts of another's, without any check."""
    track: Track = object.__new__(kind)
    _freeze(track, **arrays)
    return track


def _checked_values(values: object, mask: object, columns: int, what: str) -> tuple[Int32, Bool]:
    array = _integers(values, np.int32, f"{what}: values")
    sent = np.asarray(mask)
    if array.ndim != 2 or array.shape[1] != columns:
        raise ValueError(f"{what}: values must have shape (T, {columns}), not {array.shape}")
    if sent.dtype != np.bool_:
        raise ValueError(f"{what}: mask must be bool, not {sent.dtype}")
    if sent.shape != array.shape:
        raise ValueError(f"{what}: mask has shape {sent.shape}, values {array.shape}")
    if sent.flags.writeable:
        sent = sent.copy()
    if array.any(where=~sent):
        array = np.where(sent, array, np.int32(0))
    return array, sent


def _checked_fields(fields: object, count: int, names: tuple[str, ...], what: str, sent: Bool) -> Int16:
    if fields is None:
        return np.zeros((count, len(names)), dtype=np.int16)
    array = _integers(fields, np.int16, f"FaceTrack: {what}")
    if array.shape != (count, len(names)):
        raise ValueError(f"FaceTrack: {what} must have shape ({count}, {len(names)}), not {array.shape}")
    if array[~sent].any():
        array = np.where(sent[:, None], array, np.int16(0))
    return array


def _integers(values: object, dtype: type[np.signedinteger], what: str) -> npt.NDArray[np.signedinteger]:
    """An array of this dtype that no caller can change; refuses what would lose information."""
    array = np.asarray(values)
    if array.size == 0 and array.dtype == np.float64:
        array = array.astype(dtype)
    if not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"{what} must be integers, not {array.dtype}")
    if array.dtype != dtype:
        info = np.iinfo(dtype)
        if array.size and (int(array.min()) < info.min or int(array.max()) > info.max):
            raise ValueError(f"{what} must fit {info.dtype}: found {array.min()}..{array.max()}")
    if array.dtype != dtype or array.flags.writeable:
        array = array.astype(dtype, copy=True)
    return array


def _freeze(instance: object, **fields: object) -> None:
    for name, value in fields.items():
        if isinstance(value, np.ndarray):
            value.flags.writeable = False  # ours by now: whatever a caller could still change was copied
        object.__setattr__(instance, name, value)


def _stacked(arrays: list[npt.NDArray[Any]]) -> npt.NDArray[Any]:
    """One array of all, read-only, so that a track takes it over without a copy."""
    stacked = np.concatenate(arrays)
    stacked.flags.writeable = False
    return stacked


def _between(
    values: npt.NDArray[np.signedinteger],
    before: npt.NDArray[np.intp],
    after: npt.NDArray[np.intp],
    weight: npt.NDArray[np.float64],
    both: Bool,
) -> npt.NDArray[np.signedinteger]:
    start = values[before]
    change = np.where(both, values[after].astype(np.float64) - start, 0.0)
    return np.rint(start + change * weight[:, None]).astype(values.dtype)


def _resampled_face(
    face: FaceTrack,
    before: npt.NDArray[np.intp],
    after: npt.NDArray[np.intp],
    weight: npt.NDArray[np.float64],
    fresh: Bool,
) -> FaceTrack:
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
        held[:, flags] = np.where(fresh[:, None], held[:, flags], 0)
        fields.append(held)
    return FaceTrack(_between(face.values, before, after, weight, both), mask, *fields)
