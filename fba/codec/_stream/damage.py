"""Damage that a salvaging decoder skipped, how many frames went with it, and which planes are in doubt."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import Any

from fba.arrays import Int64
from fba.errors import FbaError

DOUBTFUL = 8
"""Planes before damage that may have been misread; nearly always damage shows within four planes."""


@dataclass(frozen=True)
class Damage:
    """Damage that a salvaging decoder skipped.

    error: its text. start, stop: lost bytes of the stream, from the first byte of the damaged
    plane to where decoding continued (or the end). If decoding continues at a start code in an earlier plane,
    which had been returned already, start equals stop; as it does where a time code or a missing end code
    alone shows that something is missing.

    frames_lost: frame periods between the planes before and behind it that no plane fills; of damages without
    a plane between them, the last one counts all. uncertainty: by how many that may be wrong: 0 if the plane
    behind it has a time code, else the number is an estimate from the bytes lost. Both are None if nothing
    says how much is missing: at the beginning or end of a stream that was cut there.

    doubtful: numbers of the planes that were returned before the damage was found and may be wrong: those
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
    """Lists damage, and counts what a decoder needs to know of the planes before it.

    damage: the list. resuming: the last damage is over, but no plane behind it was decoded yet.
    """

    def __init__(self) -> None:
        self.damage: list[Damage] = []
        self.resuming = False
        self._recent: deque[int] = deque(maxlen=DOUBTFUL)  # first bits of the last planes, behind start codes
        self._recent_skips: deque[int] = deque(maxlen=DOUBTFUL)
        self._bits = self._frames = 0  # of all planes
        self._lost_from = 0  # first byte of all damage since the last plane

    @property
    def first_doubtful_bit(self) -> int | None:
        """Start of the first plane that would be doubtful if there were damage here."""
        return self._recent[0] if self._recent else None

    def add_planes(self, borders: Int64, skips: Int64) -> None:
        """Count planes. borders: int64 (T + 1,), bits of the stream, without start codes. skips: (T,)."""
        self._recent.extend(borders[-1 - DOUBTFUL : -1].tolist())
        self._recent_skips.extend(skips[-DOUBTFUL:].tolist())
        self._bits += int(borders[-1] - borders[0])
        self._frames += len(skips) + int(skips.sum())

    def confirm_planes(self) -> None:
        """Count no plane so far as doubtful: it ended where a start code begins."""
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
        """Add damage that planes before and behind it are not lost with. stop: `start` by default.

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
