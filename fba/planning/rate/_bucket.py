"""`LeakyBucket`: the buffer of a sender that drains at a constant rate."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass
class LeakyBucket:
    """A buffer that planes fill, and that a channel empties at a constant rate.

    rate: bits a second. size: bits that fit. level: bits in it at `time`, in seconds. peak: the highest level
    so far.

    While the level stays within the size, no stretch of the stream takes more than rate x its length + size
    bits. A receiver that waits for size / rate seconds before it begins never has to wait again.

    Raises ValueError for a rate or a size that is not positive.
    """

    rate: float
    size: float
    time: float = 0.0
    level: float = 0.0
    peak: float = 0.0

    def __post_init__(self) -> None:
        for name in ("rate", "size"):
            value = getattr(self, name)
            if not (value > 0 and math.isfinite(value)):
                raise ValueError(f"{name} must be a positive number, not {value!r}")

    def drain(self, time: float) -> None:
        """Advance to a later time."""
        self.level = self.level_at(time)
        self.time = time

    def level_at(self, time: float) -> float:
        """Return the level at a later time, if nothing is added until then."""
        return max(0.0, self.level - self.rate * (time - self.time))

    def add(self, bits: float) -> None:
        """Add the bits of a plane."""
        self.level += bits
        self.peak = max(self.peak, self.level)

    @property
    def room(self) -> float:
        """Bits that still fit."""
        return self.size - self.level
