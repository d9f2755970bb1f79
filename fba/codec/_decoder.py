"""Decode streams: the incremental `Decoder`, and `decode` for a complete stream."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Literal

from fba.animation import Animation, Frame
from fba.codec._coded_frames import Block
from fba.codec._frame_buffers import CompactBuffer
from fba.codec._stream.damage import Damage
from fba.codec._stream.mark import find_marks
from fba.codec._stream_reader import NO_END, StreamReader
from fba.errors import BitstreamError, FbaWarning, warn
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BapTable

_CHUNK_BYTES = 1 << 16
"""Bytes that are read at once, so that few blocks are in memory."""


class Decoder:
    """Decodes an FBA stream that arrives in chunks of any size, down to a byte.

    bap_steps: "iso" or "visage", the stream's table of BAP quantiser steps; by default "iso", because a mark
    with another table comes after the frames (`mark` then has it, with an FbaWarning; `decode` reads the mark
    first). on_error: "raise", or "salvage" to continue after damage at the next start code before an I plane;
    `damage` then lists the losses. Frame numbers always increase: where a time code shows that misread planes
    took too many frames, the frames after it follow without a gap.

    limits: see `fba.Limits`; `bytes` applies to the result of each call, and to the list of damage.

    `push` and `finish` return frames as soon as their planes are complete. At damage, `push` returns the
    frames before it, and the next call raises the error. `finish` raises immediately; the last frames are in
    the `blocks` of its error.

    Raises BitstreamError on damage, LimitError (pass less at once, or raise the limit), UnsupportedError for
    DCT segments (object_coding_type 1, whose tables are in no public source); ValueError on wrong arguments.
    ISO/IEC 14496-2, FBA object.
    """

    def __init__(
        self,
        *,
        bap_steps: BapTable | None = None,
        on_error: Literal["raise", "salvage"] = "raise",
        limits: Limits = DEFAULT_LIMITS,
    ) -> None:
        self._reader = StreamReader(bap_steps=bap_steps, on_error=on_error, limits=limits)
        self._finished = False

    @property
    def damage(self) -> list[Damage]:
        """The damage so far, when salvaging."""
        return self._reader.damage

    @property
    def planes(self) -> int:
        """Number of planes decoded so far."""
        return self._reader.planes

    @property
    def ended(self) -> bool:
        """Whether an end code closed the last object. A stream without an end code may have been cut off."""
        return self._reader.objects.ended

    @property
    def mark(self) -> str | None:
        """The table of BAP steps in the mark after the last object, or None."""
        return self._reader.objects.mark

    def push(self, chunk: bytes | bytearray | memoryview) -> list[Frame]:
        """Add bytes; return the frames that they complete."""
        return [frame for block in self.push_blocks(chunk) for frame in block.frames()]

    def finish(self) -> list[Frame]:
        """End the stream; return the last frames. Raises if the stream ends inside a plane."""
        return [frame for block in self.finish_blocks() for frame in block.frames()]

    def push_blocks(self, chunk: bytes | bytearray | memoryview) -> list[Block]:
        """Add bytes as `push` does; return blocks of planes, which is faster."""
        if self._finished:
            raise ValueError("this decoder is finished; make a new one for another stream")
        self._raise_pending()
        blocks = self._reader.push(chunk)
        if not blocks:
            self._raise_pending()
        return blocks

    def finish_blocks(self) -> list[Block]:
        """End the stream as `finish` does; return blocks of planes."""
        self._raise_pending()
        if self._finished:
            return []
        self._finished = True
        blocks = self._reader.finish()
        if self._reader.error is not None:
            self._reader.error.blocks = blocks  # no later call could raise it
            raise self._reader.error
        return blocks

    def _raise_pending(self) -> None:
        """Raise the error that an earlier call left."""
        if self._reader.error is not None:
            self._finished = True
            raise self._reader.error


def decode(
    data: bytes | bytearray | memoryview,
    *,
    bap_steps: BapTable | None = None,
    on_error: Literal["raise", "salvage"] = "raise",
    limits: Limits = DEFAULT_LIMITS,
) -> Animation:
    """Return the animation of a complete FBA stream.

    bap_steps: "iso" or "visage", the stream's table of BAP steps; None: the table that its mark names (see
    `fba.codec.write_mark`), "iso" without a mark. on_error: see `Decoder`; with "salvage", FbaWarnings say
    what was lost. Times come from frame rate, skips and time codes. A stream that changes its rate is
    returned at the lowest rate at which all its times are exact. An FbaWarning says if the end code is
    missing. Raises BitstreamError, UnsupportedError, LimitError.
    """
    view = memoryview(data)
    reader = reader_for(view, bap_steps=bap_steps, on_error=on_error, limits=limits)
    reader.times.may_step_back = True
    frames = CompactBuffer(limits, len(view))
    for block in read_blocks(reader, view):
        frames.add(block)
    if on_error == "raise" and reader.planes and reader.objects.end_code is None:
        warn(f"plane {reader.planes - 1}: {NO_END}", stacklevel=2)
    for damage in reader.damage:
        warn(str(damage), stacklevel=2)
    if not frames.frames:
        error = reader.damage[0].error if reader.damage else None
        raise BitstreamError("the stream holds no plane that can be decoded", plane=0) from error
    return frames.animation(reader.wrong)


def reader_for(
    data: memoryview, *, bap_steps: BapTable | None, on_error: Literal["raise", "salvage"], limits: Limits
) -> StreamReader:
    """Return a reader for a complete stream, which knows the marks behind its objects beforehand."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FbaWarning)  # the reader gives them when it comes there
        marks = find_marks(data) if bap_steps is None else ()
    return StreamReader(bap_steps=bap_steps, on_error=on_error, limits=limits, marks=marks)


def read_blocks(reader: StreamReader, data: memoryview) -> Iterator[Block]:
    """Yield all blocks of a complete stream. Raises the reader's error behind the blocks before it."""
    for start in range(0, len(data), _CHUNK_BYTES):
        yield from reader.push(data[start : start + _CHUNK_BYTES])
        if reader.error is not None:
            raise reader.error
    yield from reader.finish()
    if reader.error is not None:
        raise reader.error
