"""Join decoded blocks: for `decode`, at the end of a stream, and for live streams, at any time."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from fba.animation import Animation, BodyTrack, FaceTrack
from fba.arrays import Array, Bool, Int64
from fba.codec._rows import Masks, Rows
from fba.codec._time_base import TimeBase
from fba.codec.block import Block
from fba.limits import Limits
from fba.parameters import BAP_COUNT, EXPRESSION_FIELDS, FAP_COUNT, VISEME_FIELDS
from fba.tracks import trusted

_PARAMETER_BYTES = 5
"""Memory of a parameter in a frame: an int32 and a bool."""


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

    in_place: arrays grow in place, which needs less memory; `decoded` may then be called only once, at the
    end. Otherwise arrays that it returned do not change when more blocks come. frames: their number.
    limits: LimitError for more frames or memory. source: bytes of the stream.
    left_out: "a face" or "a body" if one came only after `fix_parts`, else "".
    """

    def __init__(self, *, in_place: bool = False, limits: Limits | None = None, source: int = 0) -> None:
        self.frames = 0
        self.left_out = ""
        self._in_place = in_place
        self._limits = limits
        self._source = source
        self._parts_fixed = False
        self._times = TimeBase(in_place=in_place)
        self._bits = Rows((), np.int64, in_place=in_place)
        self._intra = Rows((), np.bool_, in_place=in_place)
        self._face: dict[str, Any] = {}
        self._body: dict[str, Any] = {}

    def fix_parts(self) -> None:
        """From now on, ignore a face or body if there has been none so far."""
        self._parts_fixed = True

    def add(self, block: Block) -> None:
        """Append the frames of a block."""
        count = len(block.index)
        if not count:
            return
        if self._limits is not None:
            self._check_limits(self._limits, count)
        if block.face is not None and not self._face and self._accepts("a face"):
            self._face = {
                "values": self._rows(FAP_COUNT, np.int32),
                "mask": Masks(FAP_COUNT, self.frames, in_place=self._in_place),
                "viseme": self._rows(len(VISEME_FIELDS), np.int16),
                "expression": self._rows(len(EXPRESSION_FIELDS), np.int16),
                "interpolated": Masks(FAP_COUNT, self.frames, in_place=self._in_place),
            }
        if block.body is not None and not self._body and self._accepts("a body"):
            self._body = {
                "values": self._rows(BAP_COUNT, np.int32),
                "mask": Masks(BAP_COUNT, self.frames, in_place=self._in_place),
            }
        self._times.add(block.index, block.start, block.rate)
        self._bits.append(np.diff(block.borders), count)
        self._intra.append(block.settings.intra, count)
        for fields, track in ((self._face, block.face), (self._body, block.body)):
            for name, field in fields.items():
                rows: Array | None = getattr(track, name) if track is not None else None
                if rows is not None and isinstance(field, Masks):
                    rows = rows[0]  # a block has one mask for all of its frames
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

    def _check_limits(self, limits: Limits, count: int) -> None:
        """Raise LimitError if there is no room for `count` frames more."""
        frames = self.frames + count
        limits.check_frames(frames, "the stream")
        columns = FAP_COUNT * bool(self._face) + BAP_COUNT * bool(self._body)
        limits.check_bytes(frames * columns * _PARAMETER_BYTES, "the decoded stream", source=self._source)

    def _accepts(self, part: str) -> bool:
        """Whether a new part may be added; otherwise set `left_out`."""
        if self._parts_fixed:
            self.left_out = part
        return not self._parts_fixed

    def _rows(self, columns: int, dtype: type[np.generic]) -> Rows:
        """Return rows of zeros for all frames so far."""
        return Rows((columns,), dtype, self.frames, in_place=self._in_place)
