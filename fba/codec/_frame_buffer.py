"""Join the blocks of a live stream, at any time."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from fba.animation import Animation, BodyTrack, FaceTrack
from fba.arrays import Array, Bool, Int64
from fba.codec._block import Block
from fba.codec._rows import GrowingMasks, Rows
from fba.codec._time_base import TimeBase
from fba.parameters import BAP_COUNT, EXPRESSION_FIELDS, FAP_COUNT, VISEME_FIELDS
from fba.tracks import trusted


@dataclass(frozen=True)
class DecodedFrames:
    """All frames decoded so far: the fields of `fba.Animation`, and the sizes and types of planes.

    plane_bits: int64 (T,). plane_intra: bool (T,), True for I planes.
    """

    rate: Fraction
    index: Int64
    face: FaceTrack | None
    body: BodyTrack | None
    plane_bits: Int64
    plane_intra: Bool

    def animation(self, name: str = "") -> Animation:
        """Return these frames as an animation. ValueError without frames."""
        if not len(self.index):
            raise ValueError("there is no frame to make an animation of")
        return Animation(self.rate, self.index, self.face, self.body, name)


class FrameBuffer:
    """Collects decoded blocks in stream order; `decoded` returns all their frames without a copy.

    Arrays that it returned do not change when more blocks come. frames: their number.
    left_out: "a face" or "a body" if it came only after `fix_parts`, else "".
    """

    def __init__(self) -> None:
        self.frames = 0
        self.left_out = ""
        self._parts_fixed = False
        self._times = TimeBase()
        self._bits = Rows((), np.int64)
        self._intra = Rows((), np.bool_)
        self._face: dict[str, Any] = {}
        self._body: dict[str, Any] = {}

    def fix_parts(self) -> None:
        """Ignore a face or body from now on if there has been none so far."""
        self._parts_fixed = True

    def add(self, block: Block) -> None:
        """Append the frames of a block."""
        count = len(block.index)
        if not count:
            return
        if block.face is not None and not self._face and self._accepts("a face"):
            self._face = {
                "values": self._rows(FAP_COUNT, np.int32),
                "mask": GrowingMasks(FAP_COUNT, self.frames),
                "viseme": self._rows(len(VISEME_FIELDS), np.int16),
                "expression": self._rows(len(EXPRESSION_FIELDS), np.int16),
                "interpolated": GrowingMasks(FAP_COUNT, self.frames),
            }
        if block.body is not None and not self._body and self._accepts("a body"):
            self._body = {
                "values": self._rows(BAP_COUNT, np.int32),
                "mask": GrowingMasks(BAP_COUNT, self.frames),
            }
        self._times.add(block.index, block.start, block.rate)
        self._bits.append(np.diff(block.borders), count)
        self._intra.append(block.settings.intra, count)
        for fields, track in ((self._face, block.face), (self._body, block.body)):
            for name, field in fields.items():
                rows: Array | None = getattr(track, name) if track is not None else None
                if rows is not None and isinstance(field, GrowingMasks) and block.same_parts:
                    rows = rows[0]
                field.append(rows, count)
        self.frames += count

    def decoded(self) -> DecodedFrames:
        """Return all frames so far."""
        face = {name: field.view() for name, field in self._face.items()}
        if face and not self._face["interpolated"].any:
            face["interpolated"] = None
        body = {name: field.view() for name, field in self._body.items()}
        return DecodedFrames(
            self._times.rate,
            self._times.index(),
            trusted(FaceTrack, **face) if face else None,
            trusted(BodyTrack, **body) if body else None,
            self._bits.view(),
            self._intra.view(),
        )

    def _accepts(self, part: str) -> bool:
        """Whether a new part may be added; otherwise set `left_out`."""
        if self._parts_fixed:
            self.left_out = part
        return not self._parts_fixed

    def _rows(self, columns: int, dtype: type[np.generic]) -> Rows:
        """Return rows of zeros for all frames so far."""
        return Rows((columns,), dtype, self.frames)
