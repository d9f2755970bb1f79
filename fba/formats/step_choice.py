"""Choose the table of BAP steps with which a stream is to be decoded: `choose_steps`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fba.animation import Animation, BodyTrack
from fba.codec import Decoder, marked_table
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BAP_STEPS_DEFAULT, BapTable

if TYPE_CHECKING:
    from fba.codec import Block

FRAMES_CHECKED = 2048
"""Frames with a body that are decoded to see how they move."""
FRAMES_SEARCHED = 1 << 14
"""Frames among which a body is looked for."""
_CHUNK = 1 << 14
CERTAIN, LIKELY, UNSURE = "certain", "likely", "unsure"
"""How sure a choice is."""


@dataclass(frozen=True)
class StepChoice:
    """A table of BAP steps.

    reason: in words, why it was chosen; "" where the table makes no difference. confidence: "certain" where
    the stream names the table, "likely" where its motion looks wrong with the other one, and "unsure" where
    nothing tells.
    """

    table: BapTable
    reason: str
    confidence: str = CERTAIN

    def __str__(self) -> str:
        return f"BAP steps {self.explanation}"

    @property
    def explanation(self) -> str:
        """The table, how sure that is, and why: "visage (likely): ..."; "" if it makes no difference."""
        if not self.reason:
            return ""
        unproved = "" if self.confidence == CERTAIN else f" ({self.confidence})"
        return f"{self.table}{unproved}: {self.reason}"


def choose_steps(data: bytes | bytearray | memoryview, *, limits: Limits = DEFAULT_LIMITS) -> StepChoice:
    """Return the table that a stream's mark names; without one, that under which it moves like a person.

    Where its motion does not tell, that is the standard's. Damage and errors are left to the decoder; a
    stream that none can read gets the standard's table without a reason.
    """
    marked = marked_table(data)
    if marked is not None:
        return StepChoice(marked, "the stream says so")
    moving = first_frames(data, BAP_STEPS_DEFAULT, limits)
    if moving is None or moving.body is None:
        return StepChoice(BAP_STEPS_DEFAULT, "")
    from fba.body.plausibility import find_doubt

    doubt = find_doubt(moving.body, moving.index, moving.rate, BAP_STEPS_DEFAULT)
    if doubt is not None:
        reason = f"the stream does not say, and with {BAP_STEPS_DEFAULT} {doubt.findings[0]}"
        return StepChoice(doubt.likely, reason, LIKELY)
    return StepChoice(
        BAP_STEPS_DEFAULT, "the stream does not say, and with these nothing looks wrong", UNSURE
    )


def first_frames(
    data: bytes | bytearray | memoryview, table: BapTable, limits: Limits = DEFAULT_LIMITS
) -> Animation | None:
    """Return the body in the first frames that have one; None if the table makes no difference to them.

    It makes none without BAPs, and where they are sent unquantised.
    """
    blocks: list[Block] = []
    count, searched, quantised = 0, 0, False
    for block in _blocks(memoryview(data), table, limits):
        searched += len(block.index)
        if searched > FRAMES_SEARCHED:
            break
        if block.body is None or block.rate != (blocks or [block])[0].rate:
            continue
        blocks.append(block)
        quantised = quantised or (block.settings.body is not None and block.settings.body.quant > 0)
        count += len(block.index)
        if count >= FRAMES_CHECKED:
            break
    tracks = [block.body for block in blocks if block.body is not None]
    if not tracks or not quantised:
        return None
    index = np.concatenate([block.index for block in blocks])
    body = BodyTrack(
        np.concatenate([track.values for track in tracks]), np.concatenate([track.mask for track in tracks])
    )
    return Animation(blocks[0].rate, index, None, body)


def _blocks(data: memoryview, table: BapTable, limits: Limits) -> Iterator[Block]:
    """Yield what can be decoded of a stream, up to an error that stops the decoder."""
    import warnings

    from fba.errors import FbaError, FbaWarning

    decoder = Decoder(bap_steps=table, on_error="salvage", limits=limits)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FbaWarning)  # who decodes all of it gives them
        try:
            for start in range(0, len(data), _CHUNK):
                yield from decoder.push_blocks(data[start : start + _CHUNK])
            yield from decoder.finish_blocks()
        except FbaError:
            return
