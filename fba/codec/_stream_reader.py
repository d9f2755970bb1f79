"""A reader of streams. It has three states: outside an object, between planes, and behind damage."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

from fba.codec._coded_frames import Block
from fba.codec._plane import loops, syntax
from fba.codec._plane.bits import OutOfDataError
from fba.codec._plane.reader import PlaneReader, Planes
from fba.codec._stream.checksums import CHECK_BYTES, PeriodChecks, find_wrong
from fba.codec._stream.damage import Damage, DamageLog
from fba.codec._stream.mark import MAX_MARK_BYTES, START, USER_DATA, Mark, bytes_needed
from fba.codec._stream.object_borders import Buffer, ObjectBorders
from fba.codec._stream.plane_times import PlaneTimes
from fba.errors import BitstreamError, LimitError, UnsupportedError, warn
from fba.limits import Limits
from fba.parameters import BAP_STEP_TABLES, BapTable
from fba.recognition import HEAD_BYTES, recognition_hint

NO_END = "the stream ends without the end code 00 00 01 b1: it may have been cut off behind this plane"
_END = bytes([*syntax.START_CODE_PREFIX, syntax.END_CODE])
_FRAME_BYTES = 500
"""Memory of a `fba.Frame` without its arrays."""
_DAMAGE_BYTES = 1000
"""Memory of a `Damage` with its error."""
_LARGE_PLANE_BYTES = 4096
"""Bytes above which an incomplete plane is not tried again with every byte that comes."""


class StreamReader:
    """Reads a stream that arrives in chunks; arguments as of `fba.codec.Decoder`.

    marks: of the whole stream, if known in advance.

    error: the error that ended the reading. planes: number of planes read. damage: in the skipped parts.
    times: of the planes. objects: their borders. wrong: when salvaging, the planes of I periods that do not
    match their checks.
    """

    def __init__(
        self,
        *,
        bap_steps: BapTable | None,
        on_error: Literal["raise", "salvage"],
        limits: Limits,
        marks: Sequence[Mark] = (),
    ) -> None:
        if bap_steps not in (None, *BAP_STEP_TABLES):
            raise ValueError(f"bap_steps must be one of {', '.join(BAP_STEP_TABLES)}, not {bap_steps!r}")
        if on_error not in ("raise", "salvage"):
            raise ValueError(f'on_error must be "raise" or "salvage", not {on_error!r}')
        self._log = DamageLog()
        self._salvage = on_error == "salvage"
        self._limits = limits
        self.error: BitstreamError | LimitError | UnsupportedError | None = None
        self.planes = 0
        self.damage: list[Damage] = self._log.damage
        self.times = PlaneTimes(self._log if self._salvage else None)
        self.objects = ObjectBorders(bap_steps, marks)
        self.wrong: list[range] = []
        self._was_at_end = False  # whether the bytes after an end were being read, after damage
        self._checks = PeriodChecks()
        self._buffer = Buffer()
        self._bit = 0  # next bit to decode, in the buffer
        self._scanned = 0  # byte up to which no start code was found, while looking for one
        self._retry_at = 0  # length of the buffer at which an incomplete plane is tried again
        # Plain functions: with a bound method, the reader would refer to itself until a garbage collection.
        self._state: Callable[[StreamReader, bool], list[Block] | None] = StreamReader._find_object
        self._kind = ""  # apparent kind of data without an object start code
        self._start_error: BitstreamError | None = None  # why the stream does not begin with an object
        self._lost_from = 0
        self._reader = PlaneReader(self.objects.table)
        self._code_bit: int | None = None  # where the start code before the next plane begins

    def push(self, chunk: bytes | bytearray | memoryview) -> list[Block]:
        """Add bytes; return the blocks of planes that they complete. An error is in `error` then."""
        self._buffer.append(chunk)
        blocks = self._advance(final=False)
        if self.error is None:
            self._drop_bytes()
        return blocks

    def finish(self) -> list[Block]:
        """End the stream; return the last blocks. An error is in `error` then."""
        return self._advance(final=True)

    def _drop_bytes(self) -> None:
        """Drop the bytes that neither the next plane nor a search for start codes after damage needs."""
        doubtful = self._log.first_doubtful_bit
        needed = (doubtful >> 3) - self._buffer.offset if doubtful is not None else self._bit >> 3
        if self._code_bit is not None:
            needed = min(needed, (self._code_bit >> 3) - self._buffer.offset)
        needed = min(needed, self._bit >> 3, self._scanned or self._bit >> 3)
        if self._buffer.can_drop(needed):
            self._checks.add(self._buffer.data, self._buffer.offset, self._buffer.offset + needed)
        dropped = self._buffer.drop(needed)
        self._bit -= 8 * dropped
        self._scanned = max(self._scanned - dropped, 0)
        self._retry_at = max(self._retry_at - dropped, 0)

    def _stop(self, error: BitstreamError | LimitError | UnsupportedError) -> None:
        """End the reading with an error. It may live long and must not keep bytes and models in memory."""
        _forget_frames(error)
        self.error = error
        del self._buffer, self._reader  # nothing is read any more

    # ---- states: each decodes what it can, or returns None if it needs more bytes

    def _advance(self, *, final: bool) -> list[Block]:
        """Return all blocks that can be decoded. final: no more bytes come."""
        blocks: list[Block] = []
        source, memory = self._buffer.length, 0
        while self.error is None:
            self._lost_from = self._bit
            try:
                new = self._state(self, final)
                if new is None:
                    break
                for block in new:
                    blocks.append(block)
                    memory += block.rows.nbytes + len(block.index) * _FRAME_BYTES
                self._limits.check_bytes(memory, "what one call returns", source=source)
            except LimitError as error:
                self._stop(error)
            except (BitstreamError, UnsupportedError) as error:
                if not self._salvage:
                    self._stop(error)
                    break
                self._skip_damage(error)
                try:
                    self._check_memory_of_damage()
                except LimitError as excess:
                    self._stop(excess)
        return blocks

    def _find_object(self, final: bool) -> list[Block] | None:
        """Look for the object start code; headers of other layers may come before it."""
        buffer = self._buffer
        if self.objects.count == 0 and buffer.offset + self._scanned == 0 and self._start_error is None:
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
                if self.objects.count or not self._salvage:
                    raise self._outside(position, code)
                if position + 4 >= buffer.length and not final:
                    break  # the first bit of the plane is not here yet
                if position + 4 < buffer.length and buffer.data[position + 4] & 0x80:
                    return self._join(position)
                self._start_error = self._start_error or self._outside(position, code)
            needed = position + 4 + self._user_data_needed(code, position)
            if needed > buffer.length and not final:
                break  # a mark may not be complete
            content = buffer.data[position + 4 : min(needed, buffer.length)].tobytes()
            for problem in self.objects.read_user_data(code, buffer.offset + position, content):
                self._warn(problem)
            self._scanned = position + 4
            self._compare_checks()
            if code in syntax.OBJECT_CODES:
                if self._start_error is not None and self.objects.count == 0:
                    self._log.add(self._start_error, 0, buffer.offset + position)
                self._bit = 8 * self._scanned
                self._scanned = 0
                self._begin_object(buffer.offset + position)
                self._state = StreamReader._decode_planes
                return []
        else:
            self._scanned = max(self._scanned, buffer.length - 3)
        if final:
            if self.objects.count == 0:
                raise BitstreamError(
                    f"no FBA object start code (00 00 01 ba) in the stream{self._kind}", plane=0, bit=0
                )
            rest = self.objects.unread(buffer.offset + buffer.length)
            if rest:
                self._warn(f"{rest} bytes follow the end of the FBA object; they were not read")
        else:
            self._bit = max(self._bit, 8 * self._scanned)
        return None

    def _user_data_needed(self, code: int, position: int) -> int:
        """Return how many bytes behind a start code, at a byte of the buffer, are needed to read a mark."""
        if code != USER_DATA:
            return 0
        words = self._buffer.data[position + 4 : min(position + 4 + MAX_MARK_BYTES, self._buffer.length)]
        return bytes_needed(words.tobytes(), self.objects.size)

    def _compare_checks(self) -> None:
        """Compare the I periods of an object with the checks behind it, if any; report mismatches."""
        listed, self.objects.checks = self.objects.checks, None
        if listed is None:
            return
        computed = self._checks
        wrong = find_wrong(bytes(computed.checks), listed)
        for number in wrong:
            planes = range(computed.planes[2 * number], computed.planes[2 * number + 1])
            self._report_wrong(
                f"the I period of planes {planes.start}..{planes.stop - 1} does not match its CRC-32: "
                "a part of it is wrong",
                planes, computed.starts[number],
            )  # fmt: skip
        missing = len(listed) // CHECK_BYTES - len(computed)
        if missing > 0 and not (computed.full or computed.left_out or wrong):
            self._report_wrong(
                f"{missing} of {len(listed) // CHECK_BYTES} I periods of the object are missing",
                range(self.planes, self.planes), self.objects.begin,
            )  # fmt: skip
        self.damage.sort(key=lambda damage: damage.start)
        self._checks = PeriodChecks()

    def _report_wrong(self, text: str, planes: range, byte: int) -> None:
        """Raise, or list, the error that planes of an I period are wrong. byte: where the period begins."""
        error = BitstreamError(text, plane=planes.start, bit=8 * byte)
        if not self._salvage:
            raise error
        self._log.add(error, byte, doubtful=planes)
        self._check_memory_of_damage()
        if planes:
            self.wrong.append(planes)

    def _join(self, position: int) -> list[Block]:
        """Start decoding at an I plane of an object whose start is missing or damaged."""
        error = self._start_error or BitstreamError(
            "the object start code 00 00 01 ba is missing", plane=0, bit=0
        )
        self._begin_object(self._buffer.offset + position)
        self._reader.forget_values()
        self._checks.abandon()
        self._log.add(error, 0, self._buffer.offset + position)
        self._bit = 8 * position
        self._scanned = 0
        self._state = StreamReader._decode_planes
        return []

    def _decode_planes(self, final: bool) -> list[Block] | None:
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
                self.objects.end = buffer.offset + buffer.length
                self._state = StreamReader._find_object
            return None
        if code != loops.NO_START_CODE:
            start, self._bit = self._bit, after
            self._log.confirm_planes()
            if code not in syntax.PLANE_CODES:
                self._code_bit = None
                self._checks.end(buffer.data, buffer.offset, self._absolute(after) // 8 - 4, self.planes)
            elif self._code_bit is None:
                self._code_bit = self._absolute(start)
            if code in syntax.OBJECT_CODES:
                self._begin_object(self._absolute(after) // 8 - 4)
            elif code not in syntax.PLANE_CODES:
                self._end_object(code)
            return []
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
            return []
        block = self._block(planes)
        if not planes.complete:
            self._await_bytes()
        return [block]

    def _await_bytes(self) -> None:
        """Do not try the next plane again before more bytes of it come."""
        length = self._buffer.length
        waiting = length - (self._bit >> 3)
        self._retry_at = length + (waiting // 4 if waiting > _LARGE_PLANE_BYTES else 1)

    def _resynchronise(self, final: bool) -> list[Block] | None:
        """Look, after damage, for the next start code of an object or of an I plane."""
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
            self._state = StreamReader._decode_planes
            return []
        self._scanned = max(self._scanned, buffer.length - 3)
        self._bit = 8 * self._scanned
        if final:
            end = self._find_end(max(self.damage[-1].start - buffer.offset, 0))
            self._log.end(buffer.offset + (buffer.length if end is None else end))
            self._log.resume(*(self._log.estimate() or (None, None)) if end is not None else (None, None))
            if end is not None and self.objects.count and not self._was_at_end:
                self._was_at_end = True
                self._scanned = end
                self.objects.end_object(syntax.END_CODE, buffer.offset + end)
                self._state = StreamReader._find_object
                return []
        return None

    def _find_end(self, begin: int) -> int | None:
        """Return the byte of the buffer after the last end code; None without one after `begin`."""
        data = self._buffer.data[: self._buffer.length].tobytes()
        end = data.rfind(_END, begin) + len(_END)
        ended = end >= len(_END) and (end == len(data) or data.startswith(START, end))
        return end if ended else None

    def _block(self, planes: Planes) -> Block:
        """Return planes with their times, and move on past them."""
        settings, times = planes.settings, self.times
        borders = planes.borders + 8 * self._buffer.offset
        if settings.intra:
            bit = int(borders[0])
            for problem in times.begin_intra(settings, self.planes, bit):
                self._warn(f"plane {self.planes}, bit {bit}: {problem}")
            begin = bit - 32 * (self._code_bit is not None)
            self._checks.begin_period(self._buffer.data, self._buffer.offset, begin, self.planes)
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
        self.objects.has_body |= settings.body is not None
        self._bit = int(planes.borders[-1])
        self._code_bit = None
        return block

    def _begin_object(self, byte: int) -> None:
        """Reset the reader for a new object, which begins at this byte of the stream."""
        self.objects.begin_object(byte)
        self._checks = PeriodChecks(byte)
        self._reader.begin_object(self.objects.table)
        self.times.begin_object()
        self._code_bit = None

    def _end_object(self, code: int) -> None:
        """End the object at a start code that is not a plane's; an unknown code is a warning, or damage."""
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
        self._scanned = self._bit >> 3
        problem = self.objects.end_object(code, self._buffer.offset + self._scanned)
        if problem:
            self._warn(problem)
        self._state = StreamReader._find_object

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

    def _skip_damage(self, error: BitstreamError | UnsupportedError) -> None:
        """List damage in the plane at `_lost_from`, and look for the next place to continue."""
        start = self._lost_from >> 3 if self.objects.count else -self._buffer.offset
        _forget_frames(error)  # there may be millions of errors
        doubtful = self._log.first_doubtful_bit
        self._log.begin(error, self._buffer.offset + start, self.planes)
        self._reader.forget_values()
        self._checks.abandon()
        self._code_bit = None
        if doubtful is not None:
            self._scanned = (doubtful >> 3) - self._buffer.offset
        else:
            self._scanned = max((self._lost_from >> 3) + 1, 0) if self.objects.count else self._bit >> 3
        self._state = StreamReader._resynchronise

    def _check_memory_of_damage(self) -> None:
        """Raise a LimitError if the list of damage takes more memory than allowed."""
        memory, read = len(self.damage) * _DAMAGE_BYTES, self._buffer.offset + self._buffer.length
        self._limits.check_bytes(memory, f"a list of {len(self.damage)} damages", source=read)

    def _outside(self, position: int, code: int) -> BitstreamError:
        """Return the error for a plane start code, at a byte of the buffer, outside of an object."""
        bit = 8 * (self._buffer.offset + position)
        before = "no object has begun"
        if self.objects.count:
            end = self.objects.end - 4
            before = f"the object ended with start code 00 00 01 {self.objects.end_code:02x} at byte {end}"
            self._lost_from = 8 * (self.objects.end - self._buffer.offset)
        return BitstreamError(
            f"plane start code 00 00 01 {code:02x} outside of an object: {before}", plane=self.planes, bit=bit
        )

    def _report_missing_end(self) -> None:
        """List as damage that the data ends without an end code."""
        buffer = self._buffer
        length = buffer.offset + buffer.length
        error = BitstreamError(NO_END, plane=self.planes - 1, bit=8 * length)
        self._log.add(error, min(self._absolute(self._bit) + 7 >> 3, length), length)

    @staticmethod
    def _warn(text: str) -> None:
        warn(text, stacklevel=2)


def _forget_frames(error: Exception) -> None:
    """Remove from an error, and from its cause, the frames that raised it: they refer to large arrays."""
    for raised in (error, error.__cause__):
        if raised is not None:
            raised.__traceback__ = raised.__context__ = None
