"""`choose_steps`: the table of BAP steps with which a stream is to be decoded."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fba.animation import Animation, BodyTrack
from fba.codec import Decoder, marked_table
from fba.errors import FbaError, FbaWarning
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BAP_STEPS_DEFAULT, BapTable

if TYPE_CHECKING:
    from fba.codec import Block

FRAMES_CHECKED = 2048
"""Frames with a body that are decoded to see how it moves."""
FRAMES_SEARCHED = 1 << 14
"""Frames that are searched for a body."""
CHUNK_BYTES = 1 << 14
"""Bytes that are decoded at once."""
CERTAIN, LIKELY, UNSURE = "certain", "likely", "unsure"


@dataclass(frozen=True)
class StepChoice:
    """A table of BAP steps.

    reason: why it was chosen; "" if the table makes no difference. confidence: "certain" if the stream names
    the table, "likely" if its motion looks wrong with the other table, "unsure" if nothing tells.
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
        doubt = "" if self.confidence == CERTAIN else f" ({self.confidence})"
        return f"{self.table}{doubt}: {self.reason}"


def choose_steps(data: bytes | bytearray | memoryview, *, limits: Limits = DEFAULT_LIMITS) -> StepChoice:
    """Return the table that a stream's mark names, else the table with which it moves like a person.

    If its motion does not tell, that is the standard's. Damage and errors are left to the decoder: a stream
    that cannot be decoded gets the standard's table, without a reason.
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
    """Return the first frames with a body; None if the table makes no difference to them.

    It makes no difference without BAPs, and if BAPs are sent unquantised.
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
    """Yield the blocks of a stream, up to an error that stops the decoder."""
    decoder = Decoder(bap_steps=table, on_error="salvage", limits=limits)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FbaWarning)  # decoding the whole stream gives them
        try:
            for start in range(0, len(data), CHUNK_BYTES):
                yield from decoder.push_blocks(data[start : start + CHUNK_BYTES])
            yield from decoder.finish_blocks()
        except FbaError:
            return
