"""`Summary`: counts of what a live capture received, used and left out."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

MAX_NAMES = 20
"""Largest number of senders, and of reasons, that are counted separately; others are counted together."""
OTHERS = "others"


@dataclass
class Summary:
    """Counts of datagrams, and of what was done with them.

    sender: the sender that was used, or "". received, bytes: of all senders. dropped: by the system, because
    they came too fast; None where it does not say (only Linux does). unread: arrived, but not read when the
    capture ended. used: with a face or a body, in order. unseen: without a face. refused: by fault.
    other_senders: by name. doubled, late, reordered, strayed, jumps: see `SampleOrder`. gaps, longest_gap:
    number, and seconds. seconds: from the first sample to the last, on the sender's clock. frames: of the
    stream. notes: sentences on how the capture was interpreted.
    """

    sender: str = ""
    received: int = 0
    bytes: int = 0
    dropped: int | None = None
    unread: int = 0
    used: int = 0
    unseen: int = 0
    refused: Counter[str] = field(default_factory=Counter)
    other_senders: Counter[str] = field(default_factory=Counter)
    doubled: int = 0
    late: int = 0
    reordered: int = 0
    strayed: int = 0
    jumps: int = 0
    gaps: int = 0
    longest_gap: float = 0.0
    seconds: float = 0.0
    frames: int = 0
    notes: list[str] = field(default_factory=list)

    def refuse(self, reason: str) -> None:
        """Count a datagram that cannot be used."""
        _count(self.refused, reason)

    def leave_out(self, sender: str) -> bool:
        """Count a datagram of another sender; return whether it is this sender's first."""
        return _count(self.other_senders, sender)

    def lines(self) -> list[str]:
        """Return the summary as lines of text."""
        who = f" from {self.sender}" if self.sender else ""
        parts = [f"{self.used} used", f"{self.unseen} without a face" * (self.unseen > 0)]
        lines = [f"{self.received} datagrams{who}: {', '.join(filter(None, parts))}"]
        lost = (self.dropped or 0, "dropped by the system"), (self.unread, "unread at the end")
        if any(count for count, _ in lost):
            counted = ", ".join(f"{count} {what}" for count, what in lost if count)
            lines.append(f"lost because they came faster than they could be used: {counted}")
        if any((self.doubled, self.late, self.reordered, self.strayed)):
            counts = (
                (self.reordered, "out of order, put in order"), (self.doubled, "doubled"),
                (self.late, "too late"), (self.strayed, "with a time that no other confirms"),
            )  # fmt: skip
            lines.append(", ".join(f"{count} {what}" for count, what in counts if count))
        if self.gaps:
            longest = f"{self.longest_gap:.2f} s"
            several = f"{self.gaps} gaps, {longest} at most, are bridged"
            lines.append(several if self.gaps > 1 else f"a gap of {longest} is bridged")
        if self.jumps:
            times = "once" if self.jumps == 1 else f"{self.jumps} times"
            lines.append(f"the sender's clock was set {times}; the stream continues by ours")
        if self.refused:
            lines.append(
                "left out: " + ", ".join(f"{count} {why}" for why, count in self.refused.most_common())
            )
        if self.other_senders:
            names = ", ".join(f"{name} ({count})" for name, count in self.other_senders.most_common())
            lines.append(f"of other senders, left out: {names}")
        return lines + self.notes

    def values(self) -> dict[str, Any]:
        """Return the summary as plain numbers, texts, lists and dictionaries, for JSON."""
        plain = {name: value for name, value in vars(self).items() if not isinstance(value, Counter)}
        plain["seconds"], plain["longest_gap"] = round(self.seconds, 6), round(self.longest_gap, 6)
        return plain | {"refused": dict(self.refused), "other_senders": dict(self.other_senders)}


def _count(counter: Counter[str], name: str) -> bool:
    """Count a name, or `OTHERS` where there are too many; return whether it is new."""
    counted = name if name in counter or len(counter) < MAX_NAMES else OTHERS
    counter[counted] += 1
    return counter[counted] == 1
