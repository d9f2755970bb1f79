"""Decode complete streams: `decode`."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Literal

from fba.animation import Animation
from fba.codec._block import Block
from fba.codec._compact_buffer import CompactBuffer
from fba.codec._stream.mark import find_marks
from fba.codec._stream_reader import NO_END, StreamReader
from fba.errors import BitstreamError, FbaWarning
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BapTable

_CHUNK = 1 << 16
"""Bytes that are read at once, so that few blocks are in memory."""


def decode(
    data: bytes | bytearray | memoryview,
    *,
    bap_steps: BapTable | None = None,
    on_error: Literal["raise", "salvage"] = "raise",
    limits: Limits = DEFAULT_LIMITS,
) -> Animation:
    """Return the animation of a complete FBA stream.

    bap_steps: "iso" or "visage", the stream's table of BAP steps; None: the table that its mark
    names (see `fba.codec.write_mark`), "iso" without a mark. on_error: see `Decoder`; with "salvage",
    FbaWarnings say what was lost. Times come from frame rate, skips and time codes. A stream that changes
    its rate is returned at the lowest rate at which all its times are exact. An FbaWarning says if the end
    code is missing. Raises BitstreamError, UnsupportedError, LimitError.
    """
    view = memoryview(data)
    reader = reader_for(view, bap_steps=bap_steps, on_error=on_error, limits=limits)
    reader.times.may_step_back = True
    frames = CompactBuffer(limits, len(view))
    for block in read_blocks(reader, view):
        frames.add(block)
    if on_error == "raise" and reader.planes and reader.objects.end_code is None:
        warnings.warn(f"plane {reader.planes - 1}: {NO_END}", FbaWarning, stacklevel=2)
    for damage in reader.damage:
        warnings.warn(str(damage), FbaWarning, stacklevel=2)
    if not frames.frames:
        error = reader.damage[0].error if reader.damage else None
        raise BitstreamError("the stream holds no plane that can be decoded", plane=0) from error
    return frames.animation(reader.wrong)


def reader_for(
    data: memoryview,
    *,
    bap_steps: BapTable | None,
    on_error: Literal["raise", "salvage"] = "raise",
    limits: Limits = DEFAULT_LIMITS,
) -> StreamReader:
    """Return a reader for a complete stream, which knows the marks behind its objects beforehand."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FbaWarning)  # the reader gives them when it comes there
        marks = find_marks(data) if bap_steps is None else ()
    return StreamReader(bap_steps=bap_steps, on_error=on_error, limits=limits, marks=marks)


def read_blocks(reader: StreamReader, data: memoryview) -> Iterator[Block]:
    """Yield all blocks of a complete stream. Raises the reader's error behind the blocks before it."""
    for start in range(0, len(data), _CHUNK):
        yield from reader.push(data[start : start + _CHUNK])
        if reader.error is not None:
            raise reader.error
    yield from reader.finish()
    if reader.error is not None:
        raise reader.error
