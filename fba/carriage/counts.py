"""`Counts`: what came over a network, and what was done with it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

MOST_REASONS = 20
"""Reasons that are counted separately; others are counted together."""


@dataclass
class Counts:
    """Counts of packets and planes.

    packets, bytes: that came. refused: packets that do not belong to this stream, by reason. other_senders:
    packets of other senders than the first. lost, late, doubled, reordered: packets, by their numbers.
    senders: that followed each other. planes: passed on. held: planes that came behind a loss and were left
    out. damaged: planes that could not be decoded, left out. gaps: times that the pose was held because
    planes were missing. longest_gap: seconds. slipped: seconds that the stream is shorter by, since no time
    code could say how long the pose was held. seconds: of the stream.
    """

    packets: int = 0
    bytes: int = 0
    refused: Counter[str] = field(default_factory=Counter)
    other_senders: int = 0
    lost: int = 0
    late: int = 0
    doubled: int = 0
    reordered: int = 0
    senders: int = 0
    planes: int = 0
    held: int = 0
    damaged: int = 0
    gaps: int = 0
    longest_gap: float = 0.0
    slipped: float = 0.0
    seconds: float = 0.0

    def refuse(self, reason: str) -> None:
        """Count a packet that is left out."""
        named = reason in self.refused or len(self.refused) < MOST_REASONS
        self.refused[reason if named else "for other reasons"] += 1

    def lines(self) -> list[str]:
        """Return the counts as lines of text."""
        lines = [f"{self.packets} packets, {self.planes} planes"]
        named = (
            (self.lost, "lost"), (self.late, "too late"), (self.doubled, "doubled"),
            (self.reordered, "out of order, put in order"),
        )  # fmt: skip
        if any(count for count, _ in named):
            lines.append("packets: " + ", ".join(f"{count} {what}" for count, what in named if count))
        if self.gaps:
            times = "once" if self.gaps == 1 else f"{self.gaps} times"
            longest = f", for {self.longest_gap:.2f} s at most" if self.longest_gap else ""
            lines.append(f"the pose was held {times}, until the next I plane{longest}")
        if self.held or self.damaged:
            left = (self.held, "that depend on others that were lost"), (self.damaged, "that were damaged")
            lines.append("planes left out: " + ", ".join(f"{count} {what}" for count, what in left if count))
        if self.slipped:
            lines.append(f"the stream is {self.slipped:.2f} s shorter than what was sent")
        if self.senders > 1:
            lines.append(f"{self.senders} senders followed each other")
        if self.other_senders:
            lines.append(f"of other senders, left out: {self.other_senders} packets")
        if self.refused:
            reasons = ", ".join(f"{count} {why}" for why, count in self.refused.most_common())
            lines.append(f"left out: {reasons}")
        return lines

    def values(self) -> dict[str, Any]:
        """Return the counts as plain numbers and dictionaries, for JSON."""
        return vars(self) | {"refused": dict(self.refused)}
