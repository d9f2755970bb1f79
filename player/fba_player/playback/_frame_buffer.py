"""Frames that arrive in blocks, as arrays that grow: one thread appends, others look at any time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from fba.animation import BodyTrack, FaceTrack
from fba.arrays import Array, Bool, Int64
from fba.codec.block import Block
from fba.parameters import BAP_COUNT, EXPRESSION_FIELDS, FAP_COUNT, VISEME_FIELDS
from fba.tracks import trusted

Rows = dict[str, Array]

FACE: dict[str, tuple[int, type]] = {
    "values": (FAP_COUNT, np.int32),
    "mask": (FAP_COUNT, np.bool_),
    "viseme": (len(VISEME_FIELDS), np.int16),
    "expression": (len(EXPRESSION_FIELDS), np.int16),
    "interpolated": (FAP_COUNT, np.bool_),
}
BODY: dict[str, tuple[int, type]] = {"values": (BAP_COUNT, np.int32), "mask": (BAP_COUNT, np.bool_)}
FIRST_ROOM = 1024
GROWTH = 1.25
FINEST = 1_000_000
"""Frames a second beyond which rates that differ are no longer brought to a common one."""


@dataclass(frozen=True)
class Arrived:
    """All frames that were there at one moment: the fields of `fba.Animation`, and what their planes take.

    plane_bits: int64 (T,). plane_intra: bool (T,).
    """

    rate: Fraction
    index: Int64
    face: FaceTrack | None
    body: BodyTrack | None
    plane_bits: Int64
    plane_intra: Bool


class GrowingFrames:
    """Takes blocks in stream order; `now` is all of them so far, without a copy.

    left_out: "a face" or "a body" that came only after `settle`, "" where none did.
    """

    def __init__(self) -> None:
        none = np.zeros(0, dtype=np.int64)
        self.now = Arrived(Fraction(25), none, None, None, none, np.zeros(0, dtype=np.bool_))
        self.left_out = ""
        self._count = 0
        self._room = FIRST_ROOM
        self._rate: Fraction | None = None
        self._index: Int64 = np.zeros(self._room, dtype=np.int64)
        self._bits: Int64 = np.zeros(self._room, dtype=np.int64)
        self._intra: Bool = np.zeros(self._room, dtype=np.bool_)
        self._face: Rows | None = None
        self._body: Rows | None = None
        self._settled = False

    def settle(self) -> None:
        """From now on there is a face, and a body, where there is one now."""
        self._settled = True

    def append(self, block: Block) -> None:
        """Take in the next block."""
        count = len(block.index)
        if not count:
            return
        if block.face is not None and self._face is None and self._wanted("a face"):
            self._face = _rows(FACE, self._room)
        if block.body is not None and self._body is None and self._wanted("a body"):
            self._body = _rows(BODY, self._room)
        self._make_room(self._count + count)
        new = slice(self._count, self._count + count)
        self._index[new] = self._indices(block)
        self._bits[new] = np.diff(block.borders)
        self._intra[new] = block.settings.intra
        for rows, track in ((self._face, block.face), (self._body, block.body)):
            if rows is not None and track is not None:
                for name, row in rows.items():
                    given = getattr(track, name)
                    if given is not None:
                        row[new] = given
        self._count += count
        assert self._rate is not None
        self.now = Arrived(
            self._rate, _seen(self._index, self._count), self._face_track(), self._body_track(),
            _seen(self._bits, self._count), _seen(self._intra, self._count),
        )  # fmt: skip

    def _wanted(self, what: str) -> bool:
        if self._settled:
            self.left_out = what
        return not self._settled

    def _face_track(self) -> FaceTrack | None:
        if self._face is None:
            return None
        fields: dict[str, Any] = {name: _seen(rows, self._count) for name, rows in self._face.items()}
        return trusted(FaceTrack, **fields)

    def _body_track(self) -> BodyTrack | None:
        if self._body is None:
            return None
        return trusted(BodyTrack, **{name: _seen(rows, self._count) for name, rows in self._body.items()})

    def _make_room(self, need: int) -> None:
        if need <= self._room:
            return
        self._room = max(need, int(self._room * GROWTH))
        self._index, self._bits, self._intra = (
            _larger(one, self._room) for one in (self._index, self._bits, self._intra)
        )
        for part in (self._face, self._body):
            if part is not None:
                for name, rows in part.items():
                    part[name] = _larger(rows, self._room)

    def _indices(self, block: Block) -> Int64:
        """A block's indices at the rate of all, which becomes finer where the stream changes its own."""
        if self._rate is None:
            self._rate = block.rate
        if block.rate == self._rate and not self._count:
            return block.index
        following = int(self._index[self._count - 1]) + 1
        common = Fraction(
            math.lcm(self._rate.numerator, block.rate.numerator),
            math.gcd(self._rate.denominator, block.rate.denominator),
        )
        if common != self._rate and common <= FINEST:
            finer = common / self._rate
            self._index = self._index * finer.numerator  # those who look keep the array they have
            self._rate = common
            following = int(self._index[self._count - 1]) + 1
        step = self._rate / block.rate
        first = max(math.floor(block.start * self._rate + Fraction(1, 2)), following)
        found: Int64 = first + (block.index - block.index[0]) * step.numerator // step.denominator
        if step < 1:  # too fine to be told apart: one after the other
            found = np.maximum(found, first + np.arange(len(found)))
        return found


def _rows(fields: dict[str, tuple[int, type]], room: int) -> Rows:
    return {name: np.zeros((room, columns), dtype=kind) for name, (columns, kind) in fields.items()}


def _larger(rows: Array, room: int) -> Array:
    grown = np.zeros((room, *rows.shape[1:]), dtype=rows.dtype)
    grown[: len(rows)] = rows
    return grown


def _seen(rows: Array, count: int) -> Array:
    view = rows[:count]
    view.flags.writeable = False
    return view
