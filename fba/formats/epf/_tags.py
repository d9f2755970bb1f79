"""Tags of EPF files: those of the face and their counterparts for the body."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fba.parameters import BAP_COUNT, FAP_COUNT, FIRST_LOW_LEVEL_FAP, bap_groups, fap_groups

FACE, BODY = 1, 2


@dataclass(frozen=True)
class Part:
    """Tags of the face or the body.

    bit: in fba_object_mask. word: for messages. lists: tags of the range lists in coding order (I max, I min,
    P max, P min). groups: returns the numbers of parameters by group. count: of parameters. first: number of
    the first parameter with limits.
    """

    bit: int
    word: str
    frame: str
    rate: str
    time: str
    skip: str
    mask: str
    quant: str
    lists: tuple[str, str, str, str]
    groups: Callable[[], tuple[tuple[int, ...], ...]]
    count: int
    first: int

    @property
    def tags(self) -> tuple[str, ...]:
        """All tags of this part."""
        return (self.frame, self.rate, self.time, self.skip, self.mask, self.quant, *self.lists)


PARTS = (
    Part(
        FACE, "face", "FFR", "FRR", "TC", "SKN", "FMT", "FQU", ("FIX", "FIN", "FPX", "FPN"),
        fap_groups, FAP_COUNT, FIRST_LOW_LEVEL_FAP,
    ),
    Part(
        BODY, "body", "BFR", "BRR", "BTC", "BSK", "BMT", "BQU", ("BIX", "BIN", "BPX", "BPN"),
        bap_groups, BAP_COUNT, 1,
    ),
)  # fmt: skip
SHARED_TAGS = ("FBM", "ISI", "GDR", "CDM")
TAGS = frozenset(SHARED_TAGS).union(*(part.tags for part in PARTS))
