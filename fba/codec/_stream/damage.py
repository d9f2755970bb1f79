"""Damage that a salvaging decoder skipped: how many frames are lost, and which planes are in doubt."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import Any

from fba.arrays import Int64
from fba.errors import FbaError

MAX_DOUBTFUL_PLANES = 8
"""Planes before damage that may have been misread; damage nearly always shows within four planes."""


@dataclass(frozen=True)
class Damage:
    """Damage that a salvaging decoder skipped.

    error: what is wrong. start, stop: lost bytes of the stream, from the first byte of the damaged plane to
    where decoding continued (or the end). start equals stop if decoding continued at a start code in an
    earlier plane, which had been returned already, and if only a time code or a missing end code shows that
    something is missing.

    frames_lost: frame periods between the planes before and behind the damage that no plane fills; if several
    damages have no plane between them, the last damage counts all. uncertainty: by how much that number may
    be wrong: 0 if the plane behind the damage has a time code; else the number is estimated from the lost
    bytes. Both are None if nothing says how much is missing: at the cut beginning or end of a stream.

    doubtful: numbers of the planes that were returned before the damage was noticed and may be wrong: those
    shortly before it, or those of an I period that does not match its CRC-32.
    """

    error: FbaError
    start: int
    stop: int
    frames_lost: int | None = None
    uncertainty: int | None = None
    doubtful: range = range(0)

    def to_dict(self) -> dict[str, Any]:
        """Return numbers and text, for JSON. doubtful: first and last plane, or None."""
        return {
            "start": self.start,
            "stop": self.stop,
            "error": str(self.error),
            "text": str(self),
            "frames_lost": self.frames_lost,
            "uncertainty": self.uncertainty,
            "doubtful": [self.doubtful[0], self.doubtful[-1]] if self.doubtful else None,
        }

    def __str__(self) -> str:
        """Return a line of text: lost bytes, error, number of lost frames, and doubtful planes."""
        text = [f"bytes {self.start}..{self.stop} were lost: {self.error}"]
        if self.start == self.stop:
            text = [str(self.error)]
        if self.frames_lost or self.uncertainty:
            frames = f"{self.frames_lost} frame{'s' if self.frames_lost != 1 else ''}"
            about = f"about {frames} (give or take {self.uncertainty})" if self.uncertainty else frames
            text.append(f"{about} lost")
        if self.doubtful and self.doubtful[0] != getattr(self.error, "plane", None):
            text.append(f"planes {self.doubtful[0]}..{self.doubtful[-1]} before it may be wrong")
        return "; ".join(text)


class DamageLog:
    """Lists damage, and counts the planes before it, from which losses are estimated.

    damage: the list. resuming: no plane was decoded yet behind the last damage.
    """

    def __init__(self) -> None:
        self.damage: list[Damage] = []
        self.resuming = False
        # of the last planes: first bits, behind start codes, and skips
        self._recent: deque[int] = deque(maxlen=MAX_DOUBTFUL_PLANES)
        self._recent_skips: deque[int] = deque(maxlen=MAX_DOUBTFUL_PLANES)
        self._bits = self._frames = 0  # of all planes
        self._lost_from = 0  # first byte of all damage since the last plane

    @property
    def first_doubtful_bit(self) -> int | None:
        """First bit of the first plane that damage here would make doubtful."""
        return self._recent[0] if self._recent else None

    def add_planes(self, borders: Int64, skips: Int64) -> None:
        """Count planes. borders: int64 (T + 1,), bits of the stream, without start codes. skips: (T,)."""
        self._recent.extend(borders[-1 - MAX_DOUBTFUL_PLANES : -1].tolist())
        self._recent_skips.extend(skips[-MAX_DOUBTFUL_PLANES:].tolist())
        self._bits += int(borders[-1] - borders[0])
        self._frames += len(skips) + int(skips.sum())

    def confirm_planes(self) -> None:
        """Take all planes so far to be right: the last ended where a start code begins."""
        self._recent.clear()
        self._recent_skips.clear()

    def add(
        self,
        error: FbaError,
        start: int,
        stop: int | None = None,
        *,
        frames_lost: int | None = None,
        doubtful: range = range(0),
    ) -> None:
        """Add damage that does not affect the planes before and behind it. stop: `start` by default.

        frames_lost: exactly how many are missing; None if nothing says so. doubtful: planes that are wrong.
        """
        uncertainty = None if frames_lost is None else 0
        stop = start if stop is None else stop
        self.damage.append(Damage(error, start, stop, frames_lost, uncertainty, doubtful))

    def begin(self, error: FbaError, byte: int, planes: int) -> None:
        """Add damage in the plane at a byte. planes: their number before it."""
        if self.resuming:
            self.damage[-1] = replace(self.damage[-1], frames_lost=0, uncertainty=0)
        else:
            self._lost_from = byte
        doubtful = range(planes - len(self._recent), planes)
        self.damage.append(Damage(error, byte, byte, doubtful=doubtful))
        self.resuming = True
        self._recent.clear()

    def end(self, byte: int) -> None:
        """Set the end of the last damage."""
        last = self.damage[-1]
        self.damage[-1] = replace(last, start=min(last.start, byte), stop=byte)

    def resume(self, frames_lost: int | None, uncertainty: int | None) -> None:
        """Set the number of frames lost: a plane was decoded behind the damage, or nothing follows."""
        self.damage[-1] = replace(self.damage[-1], frames_lost=frames_lost, uncertainty=uncertainty)
        self.resuming = False
        self._recent_skips.clear()

    def estimate(self) -> tuple[int, int] | None:
        """Return about how many frames were lost since the last plane, and the uncertainty; None if unknown.

        It takes lost planes to be as large as those before.
        """
        if not self._frames:
            return None
        frames = round(8 * max(self.damage[-1].stop - self._lost_from, 0) * self._frames / self._bits)
        return frames, 1 + math.ceil(frames / 2) + sum(self._recent_skips)
