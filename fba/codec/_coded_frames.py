"""Decoded planes that share their settings, and decoded frames with columns for sent slots, as arrays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from fba.animation import Frame
from fba.arrays import Array, Bool, Int32, Int64, Integer, UInt8
from fba.codec._plane import slots, syntax
from fba.codec.settings import PlaneInfo, PlaneSettings
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


@dataclass(frozen=True)
class Block:
    """Consecutive planes with the same settings: an I plane, or P planes after it.

    index: int64 (T,); frame t is shown at start + (index[t] - index[0]) / rate seconds. number: of the first
    plane, counted from 0. borders: int64 (T + 1,), the bit of the stream at which each plane begins, and the
    end of the last. skips: int64 (T,). doubtful: see `fba.codec.PlaneInfo`.

    parts: uint8 (T,), fba_object_mask of each plane. settings: of a plane with all parts that planes of the
    block carry. rows: int32 (T, K), values; 0 where a plane lacks the part. columns: (K,), their slots.
    `face` and `body` are made from them on first use; a frame without the part sends nothing.
    """

    index: Int64
    start: Fraction
    rate: Fraction
    number: int
    borders: Int64
    skips: Int64
    settings: PlaneSettings
    parts: UInt8
    rows: Int32
    columns: Int64
    doubtful: bool = False

    @cached_property
    def face(self) -> FaceTrack | None:
        """The FAPs of all frames; None if no plane carries any."""
        settings = self.settings.face
        if settings is None:
            return None
        interpolated = syntax.interpolated(settings)
        return CodedFrames(
            slots.FACE_BIT,
            self.rows,
            _places(self.columns.tobytes()),
            self._masks(slots.FACE_BIT, settings.mask),
            None if interpolated is None else self._masks(slots.FACE_BIT, interpolated),
        ).face()

    @cached_property
    def body(self) -> BodyTrack | None:
        """The BAPs of all frames; None if no plane carries any."""
        settings = self.settings.body
        if settings is None:
            return None
        mask = self._masks(slots.BODY_BIT, settings.mask)
        return CodedFrames(slots.BODY_BIT, self.rows, _places(self.columns.tobytes()), mask).body()

    @cached_property
    def same_parts(self) -> bool:
        """Whether all planes carry the same parts."""
        return len(self.parts) == 1 or bool((self.parts == self.parts[0]).all())

    def _masks(self, part: int, mask: Bool) -> Masks:
        """Return the masks of all frames, empty where a plane lacks the part."""
        if self.same_parts:
            return Masks(mask[None])
        return Masks(np.stack([np.zeros_like(mask), mask]), (self.parts & part != 0).astype(np.uint8))

    def frames(self) -> Iterator[Frame]:
        """Yield the frames one by one."""
        whole = self.settings
        parts, skips, borders = self.parts.tolist(), self.skips.tolist(), self.borders.tolist()
        several = len(parts) > 1
        for position, index in enumerate(self.index.tolist()):
            frame = slice(position, position + 1)
            face = self.face if parts[position] & slots.FACE_BIT else None
            body = self.body if parts[position] & slots.BODY_BIT else None
            if several:
                face = face[frame] if face is not None else None
                body = body[frame] if body is not None else None
            settings = PlaneSettings(
                intra=whole.intra,
                face_frame=None if face is None else index,
                body_frame=None if body is None else index,
                face=None if face is None else whole.face,
                body=None if body is None else whole.body,
                frame_rate=whole.frame_rate,
                time_code=whole.time_code,
                skip=skips[position],
                start_code=whole.start_code and position == 0,
            )
            bit, after = borders[position], borders[position + 1]
            yield Frame(
                index,
                self.rate,
                face,
                body,
                PlaneInfo(self.number + position, bit, after - bit, settings, self.doubtful),
            )


@lru_cache(maxsize=64)
def _places(columns: bytes) -> Int64:
    """Return int64 (slots,): the place of each slot in columns, given as bytes of int64; -1 if absent."""
    numbers = np.frombuffer(columns, dtype=np.int64)
    places = np.full(slots.SLOTS, -1, dtype=np.int64)
    places[numbers] = np.arange(len(numbers))
    return places
