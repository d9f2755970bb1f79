"""From bits to an animation: the incremental `Decoder`, and `decode`, which is one pushed to its end."""

from __future__ import annotations

import warnings
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal

from fba.animation import Animation, Frame
from fba.codec._buffer import Buffer
from fba.codec._clock import StreamClock
from fba.codec._plane import loops, slots, syntax
from fba.codec._plane.bits import OutOfDataError
from fba.codec._plane.reader import PlaneReader, Planes
from fba.codec.block import Block
from fba.codec.frame_buffer import FrameBuffer
from fba.errors import BitstreamError, FbaError, FbaWarning, UnsupportedError
from fba.parameters import BAP_STEP_TABLES
from fba.recognition import HEAD_BYTES, but_recognised

_CHUNK = 1 << 16
"""Bytes that `decode` hands over at a time, so that blocks do not pile up."""
_DOUBTFUL = 8
"""Planes before damage that may have been misread: a start code that stands in them is believed."""
_LARGE_PLANE = 4096
"""Bytes beyond which a plane that is still incomplete is not tried again for every byte that comes."""


@dataclass(frozen=True)
class Damage:
    """Something that a salvaging decoder stepped over.

    error: what was wrong. start, stop: bytes of the stream that were lost, from the first byte of the
    damaged plane to where decoding went on (or the end). Where a plane before that one, which was given
    out, turned out to hold a start code, decoding goes on there, and start is stop.
    """

    error: FbaError
    start: int
    stop: int


class Decoder:
    """Decodes an FBA stream that arrives in chunks of any size, down to a byte.

    bap_steps: "iso" or "visage", the table of BAP quantiser steps that the stream was made with; no bit
    of it tells. on_error: "raise", or "salvage" to go on after damage at the next start code that an
    I plane follows; what was lost is then listed in `damage`.

    `push` and `finish` return the frames whose planes are complete, as soon as they are. What `push`
    decoded before damage it returns first: the error is raised by the call after that. `finish` raises
    at once, and what it still decoded is in the `blocks` of its error.

    Raises BitstreamError on damage, UnsupportedError for DCT segments (object_coding_type 1, whose
    tables are in no public source); ValueError on wrong arguments. ISO/IEC 14496-2, FBA object.
    """

    def __init__(self, *, bap_steps: str = "iso", on_error: Literal["raise", "salvage"] = "raise") -> None:
        if bap_steps not in BAP_STEP_TABLES:
            raise ValueError(f"bap_steps must be one of {', '.join(BAP_STEP_TABLES)}, not {bap_steps!r}")
        if on_error not in ("raise", "salvage"):
            raise ValueError(f'on_error must be "raise" or "salvage", not {on_error!r}')
        self.damage: list[Damage] = []
        self.planes = 0
        """Planes decoded so far."""
        self._salvage = on_error == "salvage"
        self._buffer = Buffer()
        self._bit = 0  # next bit to decode, in the buffer
        self._scanned = 0  # byte up to which no start code was found, while looking for one
        self._retry_at = 0  # bytes that must be there before an incomplete plane is tried again
        self._step: Callable[[bool], Iterator[Block] | None] = self._find_object
        self._error: BitstreamError | UnsupportedError | None = None
        self._finished = False
        self._objects = 0
        self._object_end = 0  # byte of the stream at which the last object was over
        self._seems = ""  # what a stream that begins with no head seems to be
        self._no_head: BitstreamError | None = None  # why what the stream begins with is none
        self._clock = StreamClock()
        self._lost_from = 0
        self._doubtful: deque[int] = deque(maxlen=_DOUBTFUL)  # where the last planes begin in the stream
        self._reader = PlaneReader(bap_steps)
        self._code_bit: int | None = None  # where the start code before the next plane begins

    # ---- what users call

    def push(self, chunk: bytes | bytearray | memoryview) -> list[Frame]:
        """Take in bytes; the frames that they complete."""
        return [frame for block in self.push_blocks(chunk) for frame in block.frames()]

    def finish(self) -> list[Frame]:
        """Say that no more bytes come; the last frames. Raises where the stream ends inside a plane."""
        return [frame for block in self.finish_blocks() for frame in block.frames()]

    def push_blocks(self, chunk: bytes | bytearray | memoryview) -> list[Block]:
        """Like `push`, in blocks of planes: what to use for speed."""
        if self._finished:
            raise ValueError("this decoder is finished; make a new one for another stream")
        self._raise_pending()
        self._buffer.append(chunk)
        blocks = self._advance(final=False)
        if not blocks:
            self._raise_pending()
        needed = (self._doubtful[0] >> 3) - self._buffer.offset if self._doubtful else self._bit >> 3
        dropped = self._buffer.drop(min(needed, self._bit >> 3, self._scanned or self._bit >> 3))
        self._bit -= 8 * dropped
        self._scanned = max(self._scanned - dropped, 0)
        self._retry_at = max(self._retry_at - dropped, 0)
        return blocks

    def finish_blocks(self) -> list[Block]:
        """Like `finish`, in blocks."""
        self._raise_pending()
        if self._finished:
            return []
        blocks = self._advance(final=True)
        self._finished = True
        if self._error is not None:
            self._error.blocks = blocks  # there is no later call that could raise it
            raise self._error
        return blocks

    # ---- the states: each decodes what it can, or returns None where it needs more bytes

    def _advance(self, *, final: bool) -> list[Block]:
        blocks: list[Block] = []
        while self._error is None:
            self._lost_from = self._bit
            try:
                step = self._step(final)
                if step is None:
                    break
                blocks.extend(step)
            except (BitstreamError, UnsupportedError) as error:
                if not self._salvage:
                    self._error = error
                else:
                    self._lose(error)
        return blocks

    def _find_object(self, final: bool) -> Iterator[Block] | None:
        """Look for the object start code; headers of the systems around it may stand before it."""
        buffer = self._buffer
        if self._objects == 0 and self._scanned == 0 and self._no_head is None:
            head = buffer.data[: min(buffer.length, 3)].tobytes()
            if head != syntax.START_CODE_PREFIX[: len(head)] or (final and buffer.length < 4):
                self._seems = but_recognised(buffer.data[: min(buffer.length, HEAD_BYTES)].tobytes())
                found = (
                    f"it begins with {buffer.data[: min(buffer.length, 4)].tobytes().hex(' ')}{self._seems}"
                    if head
                    else "it is empty"
                )
                self._no_head = BitstreamError(
                    f"no FBA stream: expected the object start code 00 00 01 ba, but {found}", plane=0, bit=0
                )
                if not self._salvage:
                    raise self._no_head
        while (found_code := buffer.find_start_code(self._scanned)) is not None:
            position, code = found_code
            if self._salvage and self._objects == 0 and code in syntax.PLANE_CODES:
                if position + 4 >= buffer.length and not final:
                    break  # the first bit of the plane is not here yet
                if position + 4 < buffer.length and buffer.data[position + 4] & 0x80:
                    return self._join(position)
            self._scanned = position + 4
            if code in syntax.OBJECT_CODES:
                if self._no_head is not None and self._objects == 0:
                    self.damage.append(Damage(self._no_head, 0, buffer.offset + position))
                self._bit = 8 * self._scanned
                self._scanned = 0
                self._begin_object()
                self._step = self._decode_planes
                return iter(())
        else:
            self._scanned = max(self._scanned, buffer.length - 3)
        if final:
            if self._objects == 0:
                raise BitstreamError(
                    f"no FBA object start code (00 00 01 ba) in the stream{self._seems}", plane=0, bit=0
                )
            rest = buffer.offset + buffer.length - self._object_end
            if rest > 0:
                self._warn(f"{rest} bytes follow the end of the FBA object; they were not read")
        else:
            self._bit = max(self._bit, 8 * self._scanned)
        return None

    def _join(self, position: int) -> Iterator[Block]:
        """Start at an I plane in the middle of an object whose start is missing or damaged."""
        error = self._no_head or BitstreamError(
            "the object start code 00 00 01 ba is missing", plane=0, bit=0
        )
        self._begin_object()
        self.damage.append(Damage(error, 0, self._buffer.offset + position))
        self._bit = 8 * position
        self._scanned = 0
        self._step = self._decode_planes
        return iter(())

    def _decode_planes(self, final: bool) -> Iterator[Block] | None:
        buffer = self._buffer
        end = 8 * buffer.length
        if buffer.length < self._retry_at and not final:
            return None
        code, after = loops.find_start_code(buffer.data, self._bit, end, self._code_bit is not None)
        if code == loops.UNDECIDED:
            if final and end - self._bit >= 32:
                self._warn("the stream ends inside a start code; no plane is lost")
            if final:
                self._bit = end
                self._object_end = buffer.offset + buffer.length
                self._step = self._find_object
            return None
        if code != loops.NO_START_CODE:
            start, self._bit = self._bit, after
            self._doubtful.clear()
            if code not in syntax.PLANE_CODES:
                self._code_bit = None
            elif self._code_bit is None:
                self._code_bit = self._absolute(start)
            if code in syntax.OBJECT_CODES:
                self._begin_object()
            elif code not in syntax.PLANE_CODES:
                self._end_object(code)
            return iter(())
        try:
            planes = self._reader.read(buffer.data, self._bit, end, after_code=self._code_bit is not None)
        except (BitstreamError, UnsupportedError) as error:
            raise self._located(error) from None
        except OutOfDataError:
            if final:
                raise BitstreamError(
                    "the stream ends inside this plane: it is cut off, or its last bytes are missing",
                    plane=self.planes,
                    bit=8 * buffer.offset + end,
                ) from None
            waiting = buffer.length - (self._bit >> 3)
            self._retry_at = buffer.length + (waiting // 4 if waiting > _LARGE_PLANE else 0)
            return None
        return iter([self._block(planes)] if planes is not None else [])

    def _resynchronise(self, final: bool) -> Iterator[Block] | None:
        """After damage: go to the next start code of a plane or object that an I plane follows."""
        buffer = self._buffer
        while (found := buffer.find_start_code(self._scanned)) is not None:
            position, code = found
            wanted = code in syntax.PLANE_CODES or code in syntax.OBJECT_CODES
            if wanted and position + 4 >= buffer.length and not final:
                return None  # the first bit of the plane is not here yet
            self._scanned = position + 4
            if not wanted or position + 4 >= buffer.length:
                continue
            if code in syntax.PLANE_CODES and not buffer.data[position + 4] & 0x80:
                continue  # a P plane: what it builds upon is lost
            self._close_damage(position)
            self._bit = 8 * position
            self._scanned = 0
            self._step = self._decode_planes
            return iter(())
        self._scanned = max(self._scanned, buffer.length - 3)
        self._bit = 8 * self._scanned
        if final:
            self._close_damage(buffer.length)
        return None

    def _block(self, planes: Planes) -> Block:
        """Planes with their times; the stream goes on behind them."""
        settings, clock = planes.settings, self._clock
        if settings.intra:
            for odd in clock.begin_intra(settings.frame_rate, settings.time_code):
                self._warn(f"plane {self.planes}, bit {self._absolute(int(planes.borders[0]))}: {odd}")
        assert clock.rate is not None
        borders = planes.borders + 8 * self._buffer.offset
        if self._salvage:
            self._doubtful.extend(borders[-1 - _DOUBTFUL : -1].tolist())  # behind any start code
        if self._code_bit is not None:
            borders[0] = self._code_bit
        face, body = settings.face, settings.body
        start = clock.time
        block = Block(
            index=clock.advance(planes.skips),
            start=start,
            rate=clock.rate,
            face=slots.face_track(planes.rows, face.mask, syntax.interpolated(face))
            if face is not None
            else None,
            body=slots.body_track(planes.rows, body.mask) if body is not None else None,
            number=self.planes,
            borders=borders,
            skips=planes.skips.copy(),
            settings=settings,
        )
        self.planes += len(planes.skips)
        self._bit = int(planes.borders[-1])
        self._code_bit = None
        return block

    def _begin_object(self) -> None:
        self._reader.begin_object()
        self._objects += 1
        self._code_bit = None

    def _end_object(self, code: int) -> None:
        if self._salvage and code != syntax.END_CODE:
            raise BitstreamError(
                f"start code 00 00 01 {code:02x} where a plane, the end code 00 00 01 b1 or a new object "
                "was expected",
                plane=self.planes,
                bit=self._absolute(self._bit - 32),
            )
        self._scanned = self._bit >> 3
        self._object_end = self._buffer.offset + self._scanned
        self._step = self._find_object

    # ---- damage

    def _absolute(self, bit: int) -> int:
        return bit + 8 * self._buffer.offset

    def _located(self, error: BitstreamError | UnsupportedError) -> BitstreamError | UnsupportedError:
        """An error of the plane at hand whose bit counts from the start of the buffer, as what users get."""
        assert error.bit is not None
        bit = self._absolute(error.bit)
        if isinstance(error, UnsupportedError):
            text = f"plane {self.planes}, bit {bit}: {error}"
            return UnsupportedError(text, what=error.what, plane=self.planes, bit=bit)
        return BitstreamError(error.message, plane=self.planes, bit=bit)

    def _lose(self, error: FbaError) -> None:
        """Note damage in the plane at `_bit`, and go looking for the next place to start from."""
        start = self._lost_from >> 3 if self._objects else -self._buffer.offset
        for kept in (error, error.__cause__):  # millions may be listed: without the frames they rose from
            if kept is not None:
                kept.__traceback__ = kept.__context__ = None
        self.damage.append(Damage(error, self._buffer.offset + start, self._buffer.offset + start))
        self._reader.forget_values()
        self._code_bit = None
        if self._doubtful:
            self._scanned = (self._doubtful[0] >> 3) - self._buffer.offset
            self._doubtful.clear()
        else:
            self._scanned = (self._lost_from >> 3) + 1 if self._objects else self._bit >> 3
        self._step = self._resynchronise

    def _close_damage(self, position: int) -> None:
        last, stop = self.damage[-1], self._buffer.offset + position
        self.damage[-1] = Damage(last.error, min(last.start, stop), stop)

    def _raise_pending(self) -> None:
        if self._error is not None:
            error, self._finished = self._error, True
            raise error

    @staticmethod
    def _warn(text: str) -> None:
        warnings.warn(text, FbaWarning, stacklevel=2)


def decode(
    data: bytes | bytearray | memoryview,
    *,
    bap_steps: str = "iso",
    on_error: Literal["raise", "salvage"] = "raise",
) -> Animation:
    """Decode a whole FBA stream.

    bap_steps, on_error: see `Decoder`; with "salvage", what was lost is told in an FbaWarning.
    Returns the values that were sent and the masks that say which; times from frame rate, skips and
    time codes. A stream that changes its rate comes back at the smallest rate that holds all its times.
    Raises BitstreamError, UnsupportedError.
    """
    decoder = Decoder(bap_steps=bap_steps, on_error=on_error)
    frames = FrameBuffer(in_place=True)
    view = memoryview(data)
    for start in range(0, len(view), _CHUNK):
        for block in decoder.push_blocks(view[start : start + _CHUNK]):
            frames.add(block)
    for block in decoder.finish_blocks():
        frames.add(block)
    for damage in decoder.damage:
        warnings.warn(
            f"bytes {damage.start}..{damage.stop} were lost: {damage.error}", FbaWarning, stacklevel=2
        )
    if not frames.frames:
        error = decoder.damage[0].error if decoder.damage else None
        raise BitstreamError("the stream holds no plane that can be decoded", plane=0) from error
    return frames.decoded().animation()
