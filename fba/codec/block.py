"""Decoded planes that share their settings, as arrays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction

from fba.animation import BodyTrack, FaceTrack, Frame
from fba.arrays import Int64
from fba.codec.settings import PlaneInfo, PlaneSettings


@dataclass(frozen=True)
class Block:
    """Consecutive planes that share their settings.

    index: int64 (T,); frame t is shown at start + (index[t] - index[0]) / rate seconds. number: that of the
    first plane. borders: int64 (T + 1,), absolute bit positions of the planes, and the end of the last.
    skips: int64 (T,).
    """

    index: Int64
    start: Fraction
    rate: Fraction
    face: FaceTrack | None
    body: BodyTrack | None
    number: int
    borders: Int64
    skips: Int64
    settings: PlaneSettings

    def frames(self) -> Iterator[Frame]:
        """Yield the frames one by one."""
        for position, index in enumerate(self.index.tolist()):
            frame = slice(position, position + 1)
            bit, after = int(self.borders[position]), int(self.borders[position + 1])
            settings = replace(
                self.settings,
                face_frame=None if self.settings.face is None else index,
                body_frame=None if self.settings.body is None else index,
                skip=int(self.skips[position]),
                start_code=self.settings.start_code and position == 0,
            )
            yield Frame(
                index,
                self.rate,
                self.face[frame] if self.face is not None else None,
                self.body[frame] if self.body is not None else None,
                PlaneInfo(self.number + position, bit, after - bit, settings),
            )
