"""Blocks of decoded planes, put together to one animation without holding them twice."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np

from fba.animation import Animation, BodyTrack, FaceTrack
from fba.arrays import Array, Bool, Int64
from fba.codec.block import Block
from fba.parameters import BAP_COUNT, EXPRESSION_FIELDS, FAP_COUNT, VISEME_FIELDS
from fba.tracks import trusted

_COMMON_RATE_MAX = 1_000_000


class _Rows:
    """An array (T, columns) that grows at its end, by an eighth at a time and in place where that goes."""

    def __init__(self, columns: int, dtype: type[np.generic], count: int) -> None:
        self._array: Array = np.zeros((count, columns), dtype=dtype)
        self._count = count

    def append(self, rows: Array | None, count: int) -> None:
        """Append rows, or zeros."""
        need = self._count + count
        if need > len(self._array):
            size = (max(need, self._count + self._count // 8), self._array.shape[1])
            self._array.resize(size, refcheck=False)  # nobody else holds it
        if rows is not None:
            self._array[self._count : need] = rows
        self._count = need

    def finished(self) -> Array:
        self._array.resize((self._count, self._array.shape[1]), refcheck=False)
        self._array.flags.writeable = False
        return self._array


class _Masks:
    """Masks of frames, as runs of the same: most streams have one."""

    def __init__(self, columns: int, count: int) -> None:
        self._columns = columns
        self._rows = [np.zeros(columns, dtype=bool)] if count else []
        self._counts = [count] if count else []

    def append(self, mask: Bool | None, count: int) -> None:
        row = mask if mask is not None else np.zeros(self._columns, dtype=bool)
        if self._rows and np.array_equal(row, self._rows[-1]):
            self._counts[-1] += count
        else:
            self._rows.append(row)
            self._counts.append(count)

    def finished(self) -> Bool:
        if len(self._rows) == 1:
            return np.broadcast_to(self._rows[0], (self._counts[0], len(self._rows[0])))
        masks: Bool = np.repeat(self._rows, self._counts, axis=0)
        masks.flags.writeable = False
        return masks


class Assembly:
    """Takes blocks in stream order; `animation` is what they make."""

    def __init__(self) -> None:
        self.frames = 0
        self._times: list[tuple[Int64, Fraction, Fraction]] = []
        self._face: dict[str, Any] = {}
        self._body: dict[str, Any] = {}

    def add(self, block: Block) -> None:
        count = len(block.index)
        self._times.append((block.index, block.start, block.rate))
        if block.face is not None and not self._face:
            self._face = {
                "values": _Rows(FAP_COUNT, np.int32, self.frames),
                "mask": _Masks(FAP_COUNT, self.frames),
                "viseme": _Rows(len(VISEME_FIELDS), np.int16, self.frames),
                "expression": _Rows(len(EXPRESSION_FIELDS), np.int16, self.frames),
                "interpolated": _Masks(FAP_COUNT, self.frames),
            }
        if block.body is not None and not self._body:
            self._body = {
                "values": _Rows(BAP_COUNT, np.int32, self.frames),
                "mask": _Masks(BAP_COUNT, self.frames),
            }
        for fields, track in ((self._face, block.face), (self._body, block.body)):
            for name, field in fields.items():
                rows = getattr(track, name) if track is not None else None
                if rows is not None and name in ("mask", "interpolated"):
                    rows = rows[0]  # a block has one for all of its frames
                field.append(rows, count)
        self.frames += count

    def animation(self) -> Animation:
        """What was added; nothing can be added afterwards. ValueError where that is nothing."""
        if not self.frames:
            raise ValueError("there is no plane to make an animation of")
        rate, index = _joined_times(self._times)
        face = {name: field.finished() for name, field in self._face.items()}
        if face and not face["interpolated"].any():
            face["interpolated"] = None
        body = {name: field.finished() for name, field in self._body.items()}
        return Animation(
            rate,
            index,
            trusted(FaceTrack, **face) if face else None,
            trusted(BodyTrack, **body) if body else None,
        )


def _joined_times(
    times: list[tuple[Int64, Fraction, Fraction]],
) -> tuple[Fraction, Int64]:
    """Rate and index of blocks (index, start, rate); the smallest rate that holds all times, where the
    stream changes its own."""
    rates = {rate for _, _, rate in times}
    common = times[0][2]
    if len(rates) == 1:
        return common, np.concatenate([index for index, _, _ in times])
    parts = rates | {1 / start for _, start, _ in times if start}
    common = Fraction(
        math.lcm(*(part.numerator for part in parts)), math.gcd(*(part.denominator for part in parts))
    )
    if common > _COMMON_RATE_MAX:
        common = max(rates)
    pieces = []
    following = 0
    for index, start, rate in times:
        step = common / rate
        first = max(math.floor(start * common + Fraction(1, 2)), following)
        piece = first + (index - index[0]) * step.numerator // step.denominator
        following = int(piece[-1]) + 1
        pieces.append(piece)
    return common, np.concatenate(pieces)
