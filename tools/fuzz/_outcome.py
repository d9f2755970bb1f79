"""What the check of one input comes to."""

from __future__ import annotations

from dataclasses import dataclass


class ContractError(AssertionError):
    """The code under test broke its contract; the text says how."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How an input was taken.

    accepted: it was read whole; otherwise it was refused with an `FbaError`. salvaged: refused, but a part of
    it was read. planes: of streams, the bit behind each plane that was read, and behind each damage.
    """

    accepted: bool
    salvaged: bool = False
    planes: tuple[int, ...] = ()
