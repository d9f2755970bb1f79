"""Decode FBA streams: the incremental `Decoder`, and `decode` for a complete stream."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from typing import Literal

from fba.animation import Animation, Frame
from fba.codec._compact_buffer import CompactBuffer
from fba.codec._plane import loops, syntax
from fba.codec._plane.bits import OutOfDataError
from fba.codec._plane.mark import LONGEST, USER_DATA, Mark, find_marks, read_mark
from fba.codec._plane.reader import PlaneReader, Planes
from fba.codec._stream.buffer import Buffer
from fba.codec._stream.damage import Damage, DamageLog
from fba.codec._stream.plane_times import PlaneTimes
from fba.codec.block import Block
from fba.errors import BitstreamError, FbaError, FbaWarning, LimitError, UnsupportedError
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BAP_STEP_TABLES
from fba.recognition import HEAD_BYTES, recognition_hint

_CHUNK = 1 << 16
"""Bytes that `decode` passes to the decoder at once, so that few blocks are in memory."""
_DEFAULT_TABLE = BAP_STEP_TABLES[0]
_END = bytes([*syntax.START_CODE_PREFIX, syntax.END_CODE])
_NO_END = "the stream ends without the end code 00 00 01 b1: it may have been cut off behind this plane"
_FRAME_BYTES = 500
"""Memory of a `fba.Frame` without its arrays."""
_DAMAGE_BYTES = 1000
"""Memory of a `Damage` with its error."""
_LARGE_PLANE = 4096
"""Bytes beyond which an incomplete plane is not tried again with every byte that comes."""


class Decoder:
    """Decodes an FBA stream that arrives in chunks of any size, down to a byte.

    bap_steps: "iso" or "visage", the table of BAP quantiser steps that the stream was made with; None: "iso",
    because a mark that says otherwise comes behind the frames (`mark` has it then, and an FbaWarning says so;
    `decode` looks for it first). on_error: "raise", or "salvage" to continue after damage at the next start
    code before an I plane; `damage` then lists what was lost. Frame numbers increase in any case: where a
    time code shows that misread planes took too many frames, those behind it follow them at once.

    limits: see `fba.Limits`; `bytes` bounds what one call returns, and the list of damage.

    `push` and `finish` return frames as soon as their planes are complete. `push` first returns the frames
    before damage; the next call raises the error. `finish` raises at once; frames that it still decoded are
    in the `blocks` of its error.

    Raises BitstreamError on damage, LimitError (pass less at once, or raise the limit), UnsupportedError for
    DCT segments (object_coding_type 1, whose tables are in no public source); ValueError on wrong arguments.
    ISO/IEC 14496-2, FBA object.
    """

    def __init__(
        self,
        *,
        bap_steps: str | None = None,
        on_error: Literal["raise", "salvage"] = "raise",
        limits: Limits = DEFAULT_LIMITS,
    ) -> None:
        if bap_steps not in (None, *BAP_STEP_TABLES):
            raise ValueError(f"bap_steps must be one of {', '.join(BAP_STEP_TABLES)}, not {bap_steps!r}")
        if on_error not in ("raise", "salvage"):
            raise ValueError(f'on_error must be "raise" or "salvage", not {on_error!r}')
        self._log = DamageLog()
        self.damage: list[Damage] = self._log.damage
        self.planes = 0
        """Planes decoded so far."""
        self.ended = False
        """Whether an end code closed the last object. A stream without may have been cut off."""
        self.mark: str | None = None
        """The table of BAP steps that the mark behind the last object names; None without one."""
        self._salvage = on_error == "salvage"
        self._limits = limits
        self._buffer = Buffer()
        self._bit = 0  # next bit to decode, in the buffer
        self._scanned = 0  # byte up to which no start code was found, while looking for one
        self._retry_at = 0  # length of the buffer from which on an incomplete plane is tried again
        # Plain functions: a bound method would hold the decoder, which then waits for the garbage collector.
        self._step: Callable[[Decoder, bool], Iterator[Block] | None] = Decoder._find_object
        self._error: BitstreamError | LimitError | UnsupportedError | None = None
        self._finished = False
        self._objects = 0
        self._object_end = 0  # byte of the stream at which the last object ended
        self._closing_code: int | None = None  # last byte of the start code that ended it
        self._kind = ""  # what data without an object start code seems to be
        self._start_error: BitstreamError | None = None  # why the stream does not begin with an object
        self._times = PlaneTimes(self._log if self._salvage else None)
        self._lost_from = 0
        self._bap_steps = bap_steps
        self._marks: tuple[Mark, ...] = ()  # those of the whole stream, if they are known beforehand
        self._bodies = 0  # planes of this object that carry BAPs
        self._reader = PlaneReader(bap_steps or _DEFAULT_TABLE)
        self._behind_user_data = False  # whether user data follow the last object, up to what comes next
        self._code_bit: int | None = None  # where the start code before the next plane begins

    # ---- what users call

    def push(self, chunk: bytes | bytearray | memoryview) -> list[Frame]:
        """Add bytes; return the frames that they complete."""
        return [frame for block in self.push_blocks(chunk) for frame in block.frames()]

    def finish(self) -> list[Frame]:
        """End the stream; return the last frames. Raises if the stream ends inside a plane."""
        return [frame for block in self.finish_blocks() for frame in block.frames()]

    def push_blocks(self, chunk: bytes | bytearray | memoryview) -> list[Block]:
        """Do the same as `push`, with blocks of planes, which is faster."""
        if self._finished:
            raise ValueError("this decoder is finished; make a new one for another stream")
        self._raise_pending()
        self._buffer.append(chunk)
        blocks = self._advance(final=False)
        if not blocks:
            self._raise_pending()
        doubtful = self._log.first_doubtful_bit
        needed = (doubtful >> 3) - self._buffer.offset if doubtful is not None else self._bit >> 3
        dropped = self._buffer.drop(min(needed, self._bit >> 3, self._scanned or self._bit >> 3))
        self._bit -= 8 * dropped
        self._scanned = max(self._scanned - dropped, 0)
        self._retry_at = max(self._retry_at - dropped, 0)
        return blocks

    def finish_blocks(self) -> list[Block]:
        """Do the same as `finish`, with blocks of planes."""
        self._raise_pending()
        if self._finished:
            return []
        blocks = self._advance(final=True)
        self._finished = True
        if self._error is not None:
            self._error.blocks = blocks  # no later call could raise it
            raise self._error
        return blocks

    # ---- states: each decodes what it can, or returns None if it needs more bytes

    def _advance(self, *, final: bool) -> list[Block]:
        """Return all blocks that can be decoded. final: no more bytes come."""
        blocks: list[Block] = []
        source, memory = self._buffer.length, 0
        while self._error is None:
            self._lost_from = self._bit
            try:
                step = self._step(self, final)
                if step is None:
                    break
                for block in step:
                    blocks.append(block)
                    memory += block.rows.nbytes + len(block.index) * _FRAME_BYTES
                self._limits.check_bytes(memory, "what one call returns", source=source)
            except LimitError as error:
                self._error = error
            except (BitstreamError, UnsupportedError) as error:
                if not self._salvage:
                    self._error = error
                else:
                    self._skip_damage(error)
                    self._check_damage()
        return blocks

    def _find_object(self, final: bool) -> Iterator[Block] | None:
        """Look for the object start code; headers of other layers may come before it."""
        buffer = self._buffer
        if self._objects == 0 and buffer.offset + self._scanned == 0 and self._start_error is None:
            head = buffer.data[: min(buffer.length, 3)].tobytes()
            if head != syntax.START_CODE_PREFIX[: len(head)] or (final and buffer.length < 4):
                self._kind = recognition_hint(buffer.data[: min(buffer.length, HEAD_BYTES)].tobytes())
                beginning = (
                    f"it begins with {buffer.data[: min(buffer.length, 4)].tobytes().hex(' ')}{self._kind}"
                    if head
                    else "it is empty"
                )
                self._start_error = BitstreamError(
                    f"no FBA stream: expected the object start code 00 00 01 ba, but {beginning}",
                    plane=0,
                    bit=0,
                )
                if not self._salvage:
                    raise self._start_error
        while (start_code := buffer.find_start_code(self._scanned)) is not None:
            position, code = start_code
            if code in syntax.PLANE_CODES:
                if self._objects or not self._salvage:
                    raise self._outside(position, code)
                if position + 4 >= buffer.length and not final:
                    break  # the first bit of the plane is not here yet
                if position + 4 < buffer.length and buffer.data[position + 4] & 0x80:
                    return self._join(position)
                self._start_error = self._start_error or self._outside(position, code)
            if code == USER_DATA and position + LONGEST > buffer.length and not final:
                break  # a mark may not be complete
            directly = self._objects > 0 and buffer.offset + position == self._object_end
            if self._behind_user_data:
                self._object_end = buffer.offset + position
            self._behind_user_data = code == USER_DATA and buffer.offset + position == self._object_end
            if code == USER_DATA and directly and self.ended:
                stop = min(position + LONGEST, buffer.length)
                self._compare_mark(buffer.data[position + 4 : stop].tobytes())
            self._scanned = position + 4
            if code in syntax.OBJECT_CODES:
                if self._start_error is not None and self._objects == 0:
                    self._log.add(self._start_error, 0, buffer.offset + position)
                self._bit = 8 * self._scanned
                self._scanned = 0
                self._begin_object(buffer.offset + position)
                self._step = Decoder._decode_planes
                return iter(())
        else:
            self._scanned = max(self._scanned, buffer.length - 3)
        if final:
            if self._objects == 0:
                raise BitstreamError(
                    f"no FBA object start code (00 00 01 ba) in the stream{self._kind}", plane=0, bit=0
                )
            rest = buffer.offset + buffer.length - self._object_end
            if rest > 0 and not self._behind_user_data:
                self._warn(f"{rest} bytes follow the end of the FBA object; they were not read")
        else:
            self._bit = max(self._bit, 8 * self._scanned)
        return None

    def _join(self, position: int) -> Iterator[Block]:
        """Start decoding at an I plane of an object whose start is missing or damaged."""
        error = self._start_error or BitstreamError(
            "the object start code 00 00 01 ba is missing", plane=0, bit=0
        )
        self._begin_object(self._buffer.offset + position)
        self._reader.forget_values()
        self._log.add(error, 0, self._buffer.offset + position)
        self._bit = 8 * position
        self._scanned = 0
        self._step = Decoder._decode_planes
        return iter(())

    def _decode_planes(self, final: bool) -> Iterator[Block] | None:
        """Decode the next planes, or the next start code."""
        buffer = self._buffer
        end = 8 * buffer.length
        if buffer.length < self._retry_at and not final:
            return None
        code, after = loops.find_start_code(buffer.data, self._bit, end, self._code_bit is not None)
        if code == loops.UNDECIDED:
            if final:
                if self.planes and self._salvage:
                    self._report_missing_end()
                self._bit = end
                self._object_end = buffer.offset + buffer.length
                self._step = Decoder._find_object
            return None
        if code != loops.NO_START_CODE:
            start, self._bit = self._bit, after
            self._log.confirm_planes()
            if code not in syntax.PLANE_CODES:
                self._code_bit = None
            elif self._code_bit is None:
                self._code_bit = self._absolute(start)
            if code in syntax.OBJECT_CODES:
                self._begin_object(self._absolute(after) // 8 - 4)
            elif code not in syntax.PLANE_CODES:
                self._end_object(code)
            return iter(())
        try:
            planes = self._reader.read(buffer.data, self._bit, end, after_code=self._code_bit is not None)
        except (BitstreamError, UnsupportedError) as error:
            raise self._in_stream(error) from None
        except OutOfDataError:
            if final:
                self._log.confirm_planes()  # a cut leaves the planes before it alone
                raise BitstreamError(
                    "the stream ends inside this plane: it is cut off, or its last bytes are missing",
                    plane=self.planes,
                    bit=8 * buffer.offset + end,
                ) from None
            self._await_bytes()
            return None
        if planes is None:
            return iter(())
        block = self._block(planes)
        if not planes.complete:
            self._await_bytes()
        return iter((block,))

    def _await_bytes(self) -> None:
        """Do not try the next plane again before more bytes of it come."""
        length = self._buffer.length
        waiting = length - (self._bit >> 3)
        self._retry_at = length + (waiting // 4 if waiting > _LARGE_PLANE else 1)

    def _resynchronise(self, final: bool) -> Iterator[Block] | None:
        """Look, after damage, for the next start code of an object, or of a plane that is an I plane."""
        buffer = self._buffer
        while (start_code := buffer.find_start_code(self._scanned)) is not None:
            position, code = start_code
            wanted = code in syntax.PLANE_CODES or code in syntax.OBJECT_CODES
            if wanted and position + 4 >= buffer.length and not final:
                return None  # the first bit of the plane is not here yet
            self._scanned = position + 4
            if not wanted or position + 4 >= buffer.length:
                continue
            if code in syntax.PLANE_CODES and not buffer.data[position + 4] & 0x80:
                continue  # a P plane: the planes that it depends on are lost
            self._log.end(self._buffer.offset + position)
            self._bit = 8 * position
            self._scanned = 0
            self._step = Decoder._decode_planes
            return iter(())
        self._scanned = max(self._scanned, buffer.length - 3)
        self._bit = 8 * self._scanned
        if final:
            self._log.end(buffer.offset + buffer.length)
            ended = buffer.data[max(buffer.length - 4, 0) : buffer.length].tobytes() == _END
            self._log.resume(*(self._log.estimate() or (None, None)) if ended else (None, None))
        return None

    def _block(self, planes: Planes) -> Block:
        """Return planes with their times, and move on past them."""
        settings, times = planes.settings, self._times
        borders = planes.borders + 8 * self._buffer.offset
        if settings.intra:
            bit = int(borders[0])
            for problem in times.begin_intra(settings, self.planes, bit):
                self._warn(f"plane {self.planes}, bit {bit}: {problem}")
        if self._salvage:
            self._log.add_planes(borders, planes.skips)
        if self._code_bit is not None:
            borders[0] = self._code_bit
        start, index = times.advance(planes.skips)
        block = Block(
            index=index,
            start=start,
            rate=times.rate,
            number=self.planes,
            borders=borders,
            skips=planes.skips,
            settings=settings,
            parts=planes.parts,
            rows=planes.rows,
            columns=planes.columns,
            doubtful=planes.doubtful,
        )
        self.planes += len(planes.skips)
        self._bodies += settings.body is not None
        self._bit = int(planes.borders[-1])
        self._code_bit = None
        return block

    def _begin_object(self, byte: int) -> None:
        """Reset the reader for a new object, which begins at this byte of the stream."""
        marked = (mark.table for mark in self._marks if mark.begin <= byte < mark.end)
        self._reader.begin_object(self._bap_steps or next(marked, _DEFAULT_TABLE))
        self._bodies = 0
        self._objects += 1
        self._times.begin_object()
        self.ended = False
        self._closing_code = None
        self._code_bit = None

    def _end_object(self, code: int) -> None:
        """End the object at a start code of no plane. An unknown one is a warning, or damage."""
        if code != syntax.END_CODE and code not in syntax.LAYER_CODES:
            error = BitstreamError(
                f"start code 00 00 01 {code:02x} where a plane, the end code 00 00 01 b1 or a new object "
                "was expected",
                plane=self.planes,
                bit=self._absolute(self._bit - 32),
            )
            if self._salvage:
                raise error
            self._warn(f"{error}; the object ends there")
        self.ended = code == syntax.END_CODE
        self._closing_code = code
        self._scanned = self._bit >> 3
        self._object_end = self._buffer.offset + self._scanned
        self._step = Decoder._find_object

    def _compare_mark(self, content: bytes) -> None:
        """Take user data behind an object; an FbaWarning if they say that it was decoded with wrong steps."""
        self.mark = read_mark(content) or self.mark
        used = self._reader.bap_table
        if self.mark not in (None, used) and self._bodies:
            self._warn(
                f"the stream says behind its end that it was made with the BAP steps {self.mark!r}; it was "
                f"decoded with {used!r}"
            )

    # ---- damage

    def _absolute(self, bit: int) -> int:
        """Return the position in the stream of a bit in the buffer."""
        return bit + 8 * self._buffer.offset

    def _in_stream(self, error: BitstreamError | UnsupportedError) -> BitstreamError | UnsupportedError:
        """Return an error of the current plane with its bit counted from the start of the stream."""
        assert error.bit is not None
        bit = self._absolute(error.bit)
        if isinstance(error, UnsupportedError):
            text = f"plane {self.planes}, bit {bit}: {error}"
            return UnsupportedError(text, what=error.what, plane=self.planes, bit=bit)
        return BitstreamError(error.message, plane=self.planes, bit=bit)

    def _skip_damage(self, error: FbaError) -> None:
        """List damage in the plane at `_lost_from`, and look for the next place to continue."""
        start = self._lost_from >> 3 if self._objects else -self._buffer.offset
        for listed in (error, error.__cause__):  # there may be millions: tracebacks would fill the memory
            if listed is not None:
                listed.__traceback__ = listed.__context__ = None
        doubtful = self._log.first_doubtful_bit
        self._log.begin(error, self._buffer.offset + start, self.planes)
        self._reader.forget_values()
        self._code_bit = None
        if doubtful is not None:
            self._scanned = (doubtful >> 3) - self._buffer.offset
        else:
            self._scanned = max((self._lost_from >> 3) + 1, 0) if self._objects else self._bit >> 3
        self._step = Decoder._resynchronise

    def _check_damage(self) -> None:
        """Stop with a LimitError where the list of damage takes more memory than allowed."""
        memory, read = len(self.damage) * _DAMAGE_BYTES, self._buffer.offset + self._buffer.length
        try:
            self._limits.check_bytes(memory, f"a list of {len(self.damage)} damages", source=read)
        except LimitError as error:
            self._error = error

    def _outside(self, position: int, code: int) -> BitstreamError:
        """Return the error for a plane start code, at a byte of the buffer, outside of an object."""
        bit = 8 * (self._buffer.offset + position)
        before = "no object has begun"
        if self._objects:
            end = self._object_end - 4
            before = f"the object ended with start code 00 00 01 {self._closing_code:02x} at byte {end}"
            self._lost_from = 8 * (self._object_end - self._buffer.offset)
        return BitstreamError(
            f"plane start code 00 00 01 {code:02x} outside of an object: {before}", plane=self.planes, bit=bit
        )

    def _report_missing_end(self) -> None:
        """List as damage that the data ends without an end code."""
        buffer = self._buffer
        length = buffer.offset + buffer.length
        error = BitstreamError(_NO_END, plane=self.planes - 1, bit=8 * length)
        self._log.add(error, min(self._absolute(self._bit) + 7 >> 3, length), length)

    def _raise_pending(self) -> None:
        """Raise the error that an earlier call left."""
        if self._error is not None:
            error, self._finished = self._error, True
            raise error

    @staticmethod
    def _warn(text: str) -> None:
        warnings.warn(text, FbaWarning, stacklevel=2)


def decode(
    data: bytes | bytearray | memoryview,
    *,
    bap_steps: str | None = None,
    on_error: Literal["raise", "salvage"] = "raise",
    limits: Limits = DEFAULT_LIMITS,
) -> Animation:
    """Return the animation of a complete FBA stream.

    bap_steps: "iso" or "visage", the table of BAP steps with which it was made; None: the one that its mark
    names (see `fba.codec.write_mark`), "iso" without a mark. on_error: see `Decoder`; with "salvage",
    FbaWarnings say what was lost. Times come from frame rate, skips and time codes. A stream that changes
    its rate is returned at the lowest rate at which all its times are exact. An FbaWarning says if the end
    code is missing. Raises BitstreamError, UnsupportedError.
    """
    view = memoryview(data)
    decoder = decoder_for(view, bap_steps=bap_steps, on_error=on_error, limits=limits)
    decoder._times.may_step_back = True
    frames = CompactBuffer(limits, len(view))
    for start in range(0, len(view), _CHUNK):
        for block in decoder.push_blocks(view[start : start + _CHUNK]):
            frames.add(block)
    for block in decoder.finish_blocks():
        frames.add(block)
    if on_error == "raise" and decoder.planes and decoder._closing_code is None:
        warnings.warn(f"plane {decoder.planes - 1}: {_NO_END}", FbaWarning, stacklevel=2)
    for damage in decoder.damage:
        warnings.warn(str(damage), FbaWarning, stacklevel=2)
    if not frames.frames:
        error = decoder.damage[0].error if decoder.damage else None
        raise BitstreamError("the stream holds no plane that can be decoded", plane=0) from error
    return frames.animation()


def decoder_for(
    data: memoryview,
    *,
    bap_steps: str | None,
    on_error: Literal["raise", "salvage"] = "raise",
    limits: Limits = DEFAULT_LIMITS,
) -> Decoder:
    """Return a decoder for a complete stream, which knows the marks behind its objects beforehand."""
    decoder = Decoder(bap_steps=bap_steps, on_error=on_error, limits=limits)
    if bap_steps is None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FbaWarning)  # the decoder gives them when it comes there
            decoder._marks = find_marks(data)
    return decoder
