"""Hints and warnings about the table of BAP steps, which streams do not name."""

from __future__ import annotations

import shlex
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from fba.cli.program import as_typed
from fba.errors import FbaWarning
from fba.parameters import BAP_STEP_TABLES, bap_numbers, bap_steps
from fba.tracks import batches

if TYPE_CHECKING:
    from fba.animation import Animation
    from fba.codec.block import Block

DEFAULT = BAP_STEP_TABLES[0]
FRAMES_CHECKED = 2048
"""Frames of a stream that are decoded for the check, if a command does not decode it anyway."""
_CHUNK = 1 << 14


def remind(output: Path, animation: Animation, table: str, quant: int = 1) -> None:
    """Print the option that later commands need to read a stream that was just written, if any.

    Unquantised BAPs (quant 0) are the same under every table.
    """
    if animation.body is not None and table != DEFAULT and quant > 0:
        again = as_typed(f"fba play {shlex.quote(str(output))} --bap-steps {table}")
        click.echo(f"Play it with: {again}", err=True)


def warn_of_coarse_steps(animation: Animation, table: str, quant: int = 1, *, captured: bool = False) -> None:
    """Warn if a body is about to be coded with the standard's steps and its root moves by less than them.

    captured: the body is motion capture, whose angles these steps may cut as well.
    """
    if animation.body is None or table != DEFAULT or quant == 0:
        return
    root = [bap_numbers()[f"HumanoidRoot_tr_{way}"] - 1 for way in ("vertical", "lateral", "frontal")]
    steps = bap_steps(table)[root]
    between = any((batch.values[:, root] % steps).any() for batch in batches(animation.body))
    if captured or between:
        warnings.warn(
            "the standard's BAP steps move the root by 64 mm at a time and code angles up to 1.19 rad; "
            "--bap-steps visage has 2 mm and 3.16 rad (decode, play and render need the same option)",
            FbaWarning,
            stacklevel=2,
        )


def warn_of_doubt(name: str | Path, animation: Animation, table: str) -> str | None:
    """Warn if a decoded body looks wrong under the table and right under the other; return the warning."""
    from fba.body.plausibility import find_doubt

    if animation.body is None:
        return None
    doubt = find_doubt(animation.body, animation.index, animation.rate, table)
    if doubt is None:
        return None
    text = f"{'standard input' if str(name) == '-' else name}: {doubt}"
    warnings.warn(text, FbaWarning, stacklevel=2)
    return text


def warn_of_doubtful_stream(name: str | Path, data: bytes, table: str) -> None:
    """Do the same for a stream, whose first `FRAMES_CHECKED` frames with a body are decoded."""
    from fba.animation import Animation, BodyTrack

    blocks: list[Block] = []
    count = 0
    for block in _blocks(data, table):
        if block.body is None or block.rate != (blocks or [block])[0].rate:
            continue
        blocks.append(block)
        count += len(block.index)
        if count >= FRAMES_CHECKED:
            break
    tracks = [block.body for block in blocks if block.body is not None]
    if not tracks:
        return
    body = BodyTrack(
        np.concatenate([track.values for track in tracks]), np.concatenate([track.mask for track in tracks])
    )
    index = np.concatenate([block.index for block in blocks])
    warn_of_doubt(name, Animation(blocks[0].rate, index, None, body), table)


def _blocks(data: bytes, table: str) -> Iterator[Block]:
    from fba.codec import Decoder

    decoder = Decoder(bap_steps=table, on_error="salvage")
    for start in range(0, len(data), _CHUNK):
        yield from decoder.push_blocks(data[start : start + _CHUNK])
    yield from decoder.finish_blocks()
