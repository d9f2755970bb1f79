"""Decoded frames with columns only for sent slots, from which tracks make their arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from fba.arrays import Array, Bool, Int32, Int64, Integer
from fba.codec._plane import slots
from fba.parameters import BAP_COUNT, EXPRESSION_FIELDS, FAP_COUNT, VISEME_FIELDS
from fba.tracks import BodyTrack, FaceTrack, compact_track

_CHUNK_FRAMES = 1 << 14
"""Number of frames that are expanded at once, to limit the memory."""


class _Field(NamedTuple):
    """A field of a track: the slots of its columns, its number of columns, and its type.

    slots: (K,); columns: (K,), column of each.
    """

    slots: Int64
    columns: Int64
    width: int
    dtype: type[np.signedinteger]


def _field(width: int, dtype: type[np.signedinteger], *spans: slice, first: int = 0) -> _Field:
    numbers = np.concatenate([np.arange(span.start, span.stop) for span in spans])
    return _Field(numbers, np.arange(first, first + len(numbers)), width, dtype)


_FIELDS = {
    slots.FACE_BIT: {
        "values": _field(FAP_COUNT, np.int32, slots.FAPS, first=2),
        "viseme": _field(
            len(VISEME_FIELDS), np.int16, slots.VISEME, slice(slots.VISEME_DEF, slots.INIT_FACE)
        ),
        "expression": _field(
            len(EXPRESSION_FIELDS), np.int16, slots.EXPRESSION, slice(slots.INIT_FACE, slots.FLAGS.stop)
        ),
    },
    slots.BODY_BIT: {"values": _field(BAP_COUNT, np.int32, slots.BAPS)},
}


@dataclass(frozen=True, eq=False)
class Masks:
    """Masks of frames; most frames have equal masks.

    rows: bool (M, columns), the distinct masks. kinds: integers (T,), the row of each frame; None if all
    frames have row 0.
    """

    rows: Bool
    kinds: Integer | None = None

    def expand(self, frames: slice, count: int) -> Bool:
        """Return bool (count, columns): the masks of these frames."""
        if self.kinds is None:
            return np.broadcast_to(self.rows[0], (count, self.rows.shape[1]))
        return self.rows[self.kinds[frames]]


@dataclass(frozen=True, eq=False)
class CodedFrames:
    """The FAPs or the BAPs of frames, as a `fba.tracks.CompactFrames`.

    part: `slots.FACE_BIT` or `slots.BODY_BIT`. rows: int32 (T, K). places: int64 (slots,), the column of each
    slot in rows, or -1 where it is not sent. mask: sent parameters of each frame. interpolated: FAPs that a
    decoder must interpolate; None without any.
    """

    part: int
    rows: Int32
    places: Int64
    mask: Masks
    interpolated: Masks | None = None
    _columns: dict[str, tuple[Int64, Int64]] = field(default_factory=dict, repr=False)

    def __len__(self) -> int:
        return len(self.rows)

    def array(self, name: str, frames: slice) -> Array | None:
        """Return a field of the track for these frames, as `FaceTrack` and `BodyTrack` describe it."""
        rows = self.rows[frames]
        if name == "mask":
            return self.mask.expand(frames, len(rows))
        if name == "interpolated":
            return None if self.interpolated is None else self.interpolated.expand(frames, len(rows))
        wanted = _FIELDS[self.part][name]
        if name not in self._columns:
            places = self.places[wanted.slots]
            sent = places >= 0
            self._columns[name] = wanted.columns[sent], places[sent]
        columns, places = self._columns[name]
        result = np.zeros((len(rows), wanted.width), dtype=wanted.dtype)
        if len(columns):
            for start in range(0, len(rows), _CHUNK_FRAMES):
                chunk = slice(start, start + _CHUNK_FRAMES)
                result[chunk, columns] = rows[chunk, places]
        return result

    def face(self) -> FaceTrack:
        """Return the face track of all frames."""
        return compact_track(FaceTrack, self, range(len(self.rows)))

    def body(self) -> BodyTrack:
        """Return the body track of all frames."""
        return compact_track(BodyTrack, self, range(len(self.rows)))
