"""Parameters sent over time: `FaceTrack` and `BodyTrack`, checked once and immutable afterwards."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, overload

import numpy as np
import numpy.typing as npt

from fba.arrays import Array, Bool, Int16, Int32
from fba.errors import OptionError, did_you_mean
from fba.parameters import (
    BAP_COUNT,
    EXPRESSION_FIELDS,
    EXPRESSION_SELECT_MAX,
    FAP_COUNT,
    FIRST_LOW_LEVEL_FAP,
    VISEME_FIELDS,
    VISEME_SELECT_MAX,
    bap_numbers,
    fap_numbers,
)

_BATCH_FRAMES = 4096
_ZEROS: Any = None
"""Default of fields that are zeros if they are not given."""


class CompactFrames(Protocol):
    """Frames with columns only for sent parameters, as a decoder has them; arrays are made on demand."""

    def __len__(self) -> int: ...

    def array(self, name: str, frames: slice) -> Array | None:
        """Return the field `name` of the track for these frames, as the track describes it."""


@dataclass(frozen=True, eq=False, slots=True)
class FaceTrack:
    """FAPs over time.

    values: int32 (T, 68), FAP i+1 in column i, in its FAPU; columns 0 and 1 are always 0.
    mask: bool (T, 68), True where the parameter was sent; columns 0 and 1 for viseme and expression.
    viseme: int16 (T, 4): viseme_select1, viseme_select2, viseme_blend, viseme_def.
    expression: int16 (T, 6): expression_select1, expression_intensity1, expression_select2,
        expression_intensity2, init_face, expression_def.
    interpolated: bool (T, 68), True where the parameter is not sent and the decoder shall interpolate it
        instead of holding its value (mask type 2); None if there is no such parameter. A frame that sends
        nothing and asks for no interpolation does not change what is interpolated.

    Arrays are copied if they must be changed, and read-only afterwards. Raises ValueError on a wrong
    shape, a non-integer dtype, or a select or flag outside its range. Tracks are equal if they send the
    same; interpolated is not compared, because FAP files do not contain it.

    `track[10:20]` are frames, `track["open_jaw"]` and `track[3]` the values of a FAP by name or number, int32
    (T,). NumPy takes a track as its values.
    """

    values: Int32
    mask: Bool
    viseme: Int16 = _ZEROS
    expression: Int16 = _ZEROS
    interpolated: Bool | None = None
    _compact: tuple[CompactFrames, range] | None = field(default=None, init=False, repr=False)

    if not TYPE_CHECKING:  # or it would accept any attribute

        def __getattr__(self, name: str) -> Array | None:
            """Return a field of a compact track that is not made yet."""
            return _fill_in(self, name)

    def __post_init__(self) -> None:
        values, mask = _check_values(self.values, self.mask, FAP_COUNT, "FaceTrack")
        if values[:, :2].any():
            raise ValueError(
                "FaceTrack: columns 0 and 1 of values (FAP 1 viseme, FAP 2 expression) must be 0; "
                "their content goes into viseme and expression"
            )
        count = len(values)
        viseme = _check_fields(self.viseme, count, VISEME_FIELDS, "viseme", mask[:, 0])
        expression = _check_fields(self.expression, count, EXPRESSION_FIELDS, "expression", mask[:, 1])
        for fields, names in ((viseme, VISEME_FIELDS), (expression, EXPRESSION_FIELDS)):
            for column, name in enumerate(names):
                if "select" in name:
                    limit = VISEME_SELECT_MAX if name.startswith("viseme") else EXPRESSION_SELECT_MAX
                elif name.endswith("_def") or name == "init_face":
                    limit = 1
                else:
                    continue  # blends and intensities may leave 0..63, because the quantiser rounds
                low, high = (int(fields[:, column].min()), int(fields[:, column].max())) if count else (0, 0)
                if low < 0 or high > limit:
                    raise ValueError(
                        f"FaceTrack: {name} must lie in 0..{limit}, found {low if low < 0 else high}"
                    )
        interpolated = _check_interpolated(self.interpolated, mask)
        freeze(
            self, values=values, mask=mask, viseme=viseme, expression=expression, interpolated=interpolated
        )

    @classmethod
    def empty(cls, count: int) -> FaceTrack:
        """Return a track of `count` frames that send nothing."""
        return cls(np.zeros((count, FAP_COUNT), dtype=np.int32), np.zeros((count, FAP_COUNT), dtype=bool))

    @classmethod
    def join(cls, parts: Iterable[tuple[FaceTrack | None, int]]) -> FaceTrack | None:
        """Return tracks joined one after another; None if all are None.

        parts: each a track and its number of frames; None for a track that sends nothing.
        """
        return _join(cls, list(parts))

    def __len__(self) -> int:
        return len(self._compact[1]) if self._compact is not None else len(self.values)

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> Array:
        """Return the values for NumPy: int32 (T, 68), read-only unless copied."""
        return np.array(self.values, dtype=dtype, copy=copy)

    __iter__ = None  # frames are taken by slices, and numbers are those of parameters

    @overload
    def __getitem__(self, frames: slice) -> FaceTrack: ...
    @overload
    def __getitem__(self, frames: str | int) -> Int32: ...
    def __getitem__(self, frames: slice | str | int) -> FaceTrack | Int32:
        if not isinstance(frames, slice):
            number = _number(frames, fap_numbers(), "FAP")
            if number < FIRST_LOW_LEVEL_FAP:
                name = ("viseme", "expression")[number - 1]
                raise OptionError(f"FAP {number} {name} has fields in place of a value: use .{name}")
            return self.values[:, number - 1]
        if self._compact is not None:
            return compact_track(FaceTrack, self._compact[0], self._compact[1][frames])
        names = ("values", "mask", "viseme", "expression", "interpolated")
        fields = {name: getattr(self, name) for name in names}
        return trusted(FaceTrack, **{name: f if f is None else f[frames] for name, f in fields.items()})

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, FaceTrack):
            return NotImplemented
        return _equal(self, other, ("mask", "values", "viseme", "expression"))

    def __repr__(self) -> str:
        """Return one line, without the arrays."""
        return _summary(self, "FAP")


@dataclass(frozen=True, eq=False, slots=True)
class BodyTrack:
    """BAPs over time.

    values: int32 (T, 296), BAP i+1 in column i: 1e-5 rad, millimetres for BAPs 181..183.
    mask: bool (T, 296), True where the parameter was sent.

    The same rules apply as for `FaceTrack`; `track["l_knee_flexion"]` are the values of a BAP.
    """

    values: Int32
    mask: Bool
    _compact: tuple[CompactFrames, range] | None = field(default=None, init=False, repr=False)

    if not TYPE_CHECKING:  # or it would accept any attribute

        def __getattr__(self, name: str) -> Array | None:
            """Return a field of a compact track that is not made yet."""
            return _fill_in(self, name)

    def __post_init__(self) -> None:
        values, mask = _check_values(self.values, self.mask, BAP_COUNT, "BodyTrack")
        freeze(self, values=values, mask=mask)

    @classmethod
    def empty(cls, count: int) -> BodyTrack:
        """Return a track of `count` frames that send nothing."""
        return cls(np.zeros((count, BAP_COUNT), dtype=np.int32), np.zeros((count, BAP_COUNT), dtype=bool))

    @classmethod
    def join(cls, parts: Iterable[tuple[BodyTrack | None, int]]) -> BodyTrack | None:
        """Return tracks joined one after another; None if all are None.

        parts: each a track and its number of frames; None for a track that sends nothing.
        """
        return _join(cls, list(parts))

    def __len__(self) -> int:
        return len(self._compact[1]) if self._compact is not None else len(self.values)

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> Array:
        """Return the values for NumPy: int32 (T, 296), read-only unless copied."""
        return np.array(self.values, dtype=dtype, copy=copy)

    __iter__ = None  # frames are taken by slices, and numbers are those of parameters

    @overload
    def __getitem__(self, frames: slice) -> BodyTrack: ...
    @overload
    def __getitem__(self, frames: str | int) -> Int32: ...
    def __getitem__(self, frames: slice | str | int) -> BodyTrack | Int32:
        if not isinstance(frames, slice):
            return self.values[:, _number(frames, bap_numbers(), "BAP") - 1]
        if self._compact is not None:
            return compact_track(BodyTrack, self._compact[0], self._compact[1][frames])
        return trusted(BodyTrack, values=self.values[frames], mask=self.mask[frames])

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, BodyTrack):
            return NotImplemented
        return _equal(self, other, ("mask", "values"))

    def __repr__(self) -> str:
        """Return one line, without the arrays."""
        return _summary(self, "BAP")


Track = TypeVar("Track", FaceTrack, BodyTrack)


def trusted(kind: type[Track], **arrays: Array | None) -> Track:
    """Return a track of valid arrays, without checking them."""
    track: Track = object.__new__(kind)
    freeze(track, _compact=None, **arrays)
    return track


def compact_track(kind: type[Track], source: CompactFrames, frames: range) -> Track:
    """Return a track of these frames of the source, whose arrays are made on first use."""
    track: Track = object.__new__(kind)
    object.__setattr__(track, "_compact", (source, frames))
    return track


@dataclass(frozen=True, eq=False)
class BodyColumns:
    """BAPs of frames that all send the same parameters, as `CompactFrames`.

    rows: int32 (T, K), the values that are sent. sent: bool (296,), the K BAPs that are sent.
    """

    rows: Int32
    sent: Bool

    def __len__(self) -> int:
        return len(self.rows)

    def array(self, name: str, frames: slice) -> Array | None:
        """Return the values or the mask of these frames."""
        rows = self.rows[frames]
        if name == "mask":
            return np.broadcast_to(self.sent, (len(rows), BAP_COUNT))
        values = np.zeros((len(rows), BAP_COUNT), dtype=np.int32)
        values[:, self.sent] = rows
        return values

    def track(self) -> BodyTrack:
        """Return the track of all frames."""
        return compact_track(BodyTrack, self, range(len(self.rows)))


def _fill_in(track: FaceTrack | BodyTrack, name: str) -> Array | None:
    """Make a field of a compact track, store and return it."""
    if name.startswith("_") or name not in track.__slots__:
        raise AttributeError(f"{type(track).__name__!r} object has no attribute {name!r}")
    assert track._compact is not None
    source, frames = track._compact
    array = source.array(name, slice(frames.start, frames.stop, frames.step))
    freeze(track, **{name: array})
    return array


@overload
def batches(track: FaceTrack) -> Iterator[FaceTrack]: ...
@overload
def batches(track: BodyTrack) -> Iterator[BodyTrack]: ...
def batches(track: FaceTrack | BodyTrack) -> Iterator[FaceTrack] | Iterator[BodyTrack]:
    """Yield a track in pieces, so that a compact track stays compact."""
    for start in range(0, len(track), _BATCH_FRAMES):
        yield track[start : start + _BATCH_FRAMES]


def _equal(a: Track, b: Track, names: tuple[str, ...]) -> bool:
    """Return whether tracks have equal fields of these names; compact tracks stay compact."""
    return len(a) == len(b) and all(
        np.array_equal(getattr(part, name), getattr(other_part, name))
        for part, other_part in zip(batches(a), batches(b), strict=True)
        for name in names
    )


def _number(key: object, numbers: dict[str, int], kind: str) -> int:
    """Return the number of a parameter, given by its name or number. OptionError for another key."""
    if isinstance(key, str):
        if key in numbers:
            return numbers[key]
        raise OptionError(
            f"there is no {kind} {key!r}{did_you_mean(key, numbers)}; their names are in "
            f"fba.parameters.{kind.lower()}_numbers()"
        )
    if isinstance(key, bool) or not isinstance(key, int | np.integer):
        raise OptionError(
            f"a track is indexed by a slice of frames, or by the name or the number of a {kind}, not by "
            f"{type(key).__name__}; index its .values like an array"
        )
    if not 1 <= key <= len(numbers):
        raise OptionError(
            f"{kind}s are numbered from 1 to {len(numbers)}, not {key}; frames are taken by slices"
        )
    return int(key)


def _summary(track: FaceTrack | BodyTrack, kind: str) -> str:
    """Return a line about a track of this kind of parameters."""
    sent = (
        sum(np.bitwise_or.reduce([part.mask.any(axis=0) for part in batches(track)], axis=0))
        if len(track)
        else 0
    )
    frames = f"{len(track)} frame{'s' if len(track) != 1 else ''}"
    return f"<{type(track).__name__} {frames}, {sent} {kind}{'s' if sent != 1 else ''} sent>"


def _check_values(values: object, mask: object, columns: int, what: str) -> tuple[Int32, Bool]:
    """Return values, 0 where not sent, and mask, as fields of a track. ValueError if they are wrong."""
    array = integers(values, np.int32, f"{what}: values")
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


def _check_interpolated(interpolated: object, mask: Bool) -> Bool | None:
    """Return interpolated, False where sent, or None if nothing is. ValueError if it is wrong."""
    if interpolated is None:
        return None
    asked = np.asarray(interpolated)
    if asked.dtype != np.bool_:
        raise ValueError(f"FaceTrack: interpolated must be bool, not {asked.dtype}")
    if asked.shape != mask.shape:
        raise ValueError(f"FaceTrack: interpolated has shape {asked.shape}, mask {mask.shape}")
    if (asked & mask).any():
        asked = asked & ~mask
    elif asked.flags.writeable:
        asked = asked.copy()
    return asked if asked.any() else None


def _check_fields(fields: object, count: int, names: tuple[str, ...], what: str, sent: Bool) -> Int16:
    """Return the fields of viseme or expression, 0 where not sent. ValueError if they are wrong."""
    if fields is None:
        return np.zeros((count, len(names)), dtype=np.int16)
    array = integers(fields, np.int16, f"FaceTrack: {what}")
    if array.shape != (count, len(names)):
        raise ValueError(f"FaceTrack: {what} must have shape ({count}, {len(names)}), not {array.shape}")
    if array[~sent].any():
        array = np.where(sent[:, None], array, np.int16(0))
    return array


def integers(values: object, dtype: type[np.signedinteger], what: str) -> npt.NDArray[np.signedinteger]:
    """Return an array of this dtype that no caller can change. ValueError if that would lose information."""
    array = np.asarray(values)
    if array.dtype == dtype:
        return array.copy() if array.flags.writeable else array
    if array.size == 0 and array.dtype == np.float64:
        array = array.astype(dtype)
    if not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"{what} must be integers, not {array.dtype}")
    info = np.iinfo(dtype)
    if array.size and (int(array.min()) < info.min or int(array.max()) > info.max):
        raise ValueError(f"{what} must fit {info.dtype}: found {array.min()}..{array.max()}")
    return array.astype(dtype)


def freeze(instance: object, **fields: object) -> None:
    """Set the fields of a frozen dataclass; arrays among them become read-only."""
    for name, value in fields.items():
        if isinstance(value, np.ndarray):
            value.flags.writeable = False  # safe: arrays that a caller could change were copied before
        object.__setattr__(instance, name, value)


def _join(kind: type[Track], parts: list[tuple[Track | None, int]]) -> Track | None:
    """Return what `join` does. Arrays are made read-only, so that the track need not copy them."""
    if len(parts) == 1 or all(track is None for track, _ in parts):
        return parts[0][0] if parts else None
    tracks = [track if track is not None else kind.empty(count) for track, count in parts]
    joined = {}
    for name in kind.__slots__:
        arrays = [] if name == "_compact" else [getattr(track, name) for track in tracks]
        if any(array is not None for array in arrays):  # frames without `interpolated` ask for none
            filled = [np.zeros_like(t.mask) if a is None else a for t, a in zip(tracks, arrays, strict=True)]
            joined[name] = np.concatenate(filled)
            joined[name].flags.writeable = False
    return kind(**joined)


def hold(values: Array, mask: Bool, before: Array) -> Array:
    """Return values (T, N) in force at each frame: where the mask is False, the last value before it.

    mask: (T, N), or (T, 1) for all columns together. before: (N,), in force before the first frame.
    """
    last = np.where(mask, np.arange(1, len(mask) + 1, dtype=np.int32)[:, None], np.int32(0))
    np.maximum.accumulate(last, axis=0, out=last)
    extended = np.concatenate([before[None].astype(values.dtype), values])
    result: Array = np.take_along_axis(extended, np.broadcast_to(last, values.shape), axis=0)
    return result
