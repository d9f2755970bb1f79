"""`PlaneSplitter`: a stream as planes, of which each can be sent alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

from fba.codec import Block, Decoder, PlaneSettings, write_opening
from fba.errors import BitstreamError, FbaError
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BAP_STEP_TABLES, BapTable

_CODE = b"\0\0\1"
_OBJECT = b"\0\0\1\xba"
_OBJECTS = (_OBJECT, b"\0\0\1\1")
_END = b"\0\0\1\xb1"
_STUFFING = b"\x7f"
_CHUNK = 1 << 16
_MOST_UNREAD = 1 << 20
"""Bytes that are kept while no plane comes: many times a plane."""
_FIRST_CODE = 2.0
"""Seconds of an object without a time code after which none is expected."""
_READ_AGAIN = 1 << 16
"""Bytes of the last planes that are kept: at damage, decoding may go on in one of them."""


@dataclass(frozen=True)
class Plane:
    """A plane as it is sent.

    data: bytes of the stream, from behind the plane before it to the byte in which this plane ends. time:
    seconds. rate: frames per second. opening: data for viewers who begin here, with the configuration; b""
    where nobody can begin. fresh: whether no decoder can go on to it from the plane before: it begins an
    object, or follows damage. units: the plane alone, without a start code: its bits, from the first of a
    byte on, and stuffing (0, then 1s) up to a byte; several, if more planes end in the last byte of `data`.
    """

    data: bytes
    time: float
    rate: float
    opening: bytes = b""
    fresh: bool = False
    units: tuple[bytes, ...] = ()

    @property
    def configuration(self) -> bytes:
        """What `opening` begins with: the headers up to the start code of the object."""
        return self.opening[: self.opening.find(_OBJECT) + len(_OBJECT)] if self.opening else b""


class PlaneSplitter:
    """Splits a stream that arrives in chunks into its planes, which it decodes to find where they end.

    bap_steps: table of BAP steps; by default the table that the stream names before its object, else the
    standard's. planes: number of planes so far. ending: at the end, the bytes that end the object behind the
    last plane, or b"" where something else follows. Damage is left out.
    """

    def __init__(self, bap_steps: BapTable | None = None, limits: Limits = DEFAULT_LIMITS) -> None:
        self.planes = 0
        self.ending = b""
        self._decoder = Decoder(bap_steps=bap_steps, on_error="salvage", limits=limits)
        self._bap_steps = bap_steps
        self._data = bytearray()
        self._offset = 0  # byte of the stream with which `_data` begins
        self._end = 0  # bit of the stream behind the last plane
        self._configuration = b""
        self._fault: FbaError | None = None  # the first
        self._state = _State(0.0)

    def push(self, chunk: bytes) -> list[Plane]:
        """Add bytes; return the planes that they complete. Raises LimitError."""
        self._data += chunk
        return self._planes(self._decoder.push_blocks(chunk))

    def finish(self) -> list[Plane]:
        """End the stream; return the last planes. Raises BitstreamError for a stream without planes."""
        planes = self._planes(self._decoder.finish_blocks())
        if not self.planes:
            raise self._fault or BitstreamError("the object has no plane", plane=0, bit=32)
        rest = self._data[(self._end + 7) // 8 - self._offset :]
        self.ending = next((code for code in (_END, _STUFFING + _END) if rest.startswith(code)), b"")
        return planes

    def _planes(self, blocks: list[Block]) -> list[Plane]:
        planes = [plane for block in blocks for plane in self._split(block)]
        read = (self._end >> 3) - self._offset - _READ_AGAIN
        dropped = max(read, len(self._data) - _MOST_UNREAD, 0)
        del self._data[:dropped]
        self._offset += dropped
        damage = self._decoder.damage
        self._fault = self._fault or (damage[0].error if damage else None)
        del damage[:-1]  # an endless stream may have any number
        return planes

    def _split(self, block: Block) -> list[Plane]:
        borders, rate = block.borders.tolist(), float(block.rate)
        first = int(block.index[0])
        times = [float(block.start + Fraction(at - first) / block.rate) for at in block.index.tolist()]
        start = borders[0]
        gap = self._bytes(self._end, start)
        fresh = start != self._end or not self.planes
        begins = fresh and (not self.planes or any(code in gap for code in _OBJECTS))
        if begins:
            self._state = _State(times[0])
            named = self._bap_steps or self._decoder.mark
            opening = b"".join(write_opening(table) for table in BAP_STEP_TABLES if table == named)
            self._configuration = opening + _OBJECT
        if fresh:
            self._end = start
        renewed = self._state.renewed_by(block.settings, times[0])
        joinable = begins or (renewed and block.settings.start_code)
        code = self._bytes(start, borders[1]).find(_CODE) if block.settings.start_code else -1
        begin = start if code < 0 else 8 * ((start + 7) // 8 + code + len(_CODE) + 1)
        planes: list[Plane] = []
        for time, end in zip(times, borders[1:], strict=True):
            data, unit = self._bytes(self._end, end), self._unit(begin, end)
            begin = self._end = end
            if data or not planes:
                planes.append(Plane(data, time, rate, units=(unit,)))
            else:
                planes[-1] = replace(planes[-1], units=(*planes[-1].units, unit))
        if planes and (fresh or joinable):
            data = planes[0].data
            at = data.find(_CODE) if block.settings.start_code else 0
            begun = self._configuration + data[at:] if joinable else b""
            planes[0] = replace(planes[0], opening=begun, fresh=fresh)
        self.planes += len(planes)
        return planes

    def _bytes(self, begin: int, end: int) -> bytes:
        """Return the bytes of the stream behind that of one bit, up to that of another."""
        return bytes(self._data[max((begin + 7) // 8 - self._offset, 0) : (end + 7) // 8 - self._offset])

    def _unit(self, begin: int, end: int) -> bytes:
        """Return the bits of the stream from one to another, and stuffing up to a byte."""
        number = int.from_bytes(self._data[begin // 8 - self._offset : (end + 7) // 8 - self._offset], "big")
        bits, stuffing = end - begin, 8 - (end - begin) % 8
        number = (number >> -end % 8) & ((1 << bits) - 1)
        return (number << stuffing | (1 << stuffing - 1) - 1).to_bytes((bits + stuffing) // 8, "big")


class _State:
    """What the I planes of an object have set so far, and stays in force until others set it anew.

    begun: seconds at which the object begins.
    """

    def __init__(self, begun: float) -> None:
        self._begun = begun
        self._set: set[str] = set()

    def renewed_by(self, settings: PlaneSettings, time: float) -> bool:
        """Whether a plane, at a time in seconds, sets all of it again, so that a decoder can begin there.

        A decoder that begins without a time code would be set to another time by the next.
        """
        if not settings.intra:
            return False
        sets = {"rate"} if settings.frame_rate is not None else set()
        if settings.time_code is not None:
            sets.add("time")
        for name, part in (("face", settings.face), ("body", settings.body)):
            if part is not None:
                sent = (f"{name}.{number}" for number, codes in enumerate(part.ranges) if codes is not None)
                sets |= {name, *sent}
        missing = self._set - sets
        self._set |= sets
        return not missing and ("time" in sets or time - self._begun >= _FIRST_CODE)


def split_stream(
    data: bytes, bap_steps: BapTable | None = None, limits: Limits = DEFAULT_LIMITS
) -> tuple[list[Plane], bytes]:
    """Return the planes of a stream, and the bytes that end it. Raises BitstreamError without planes."""
    splitter = PlaneSplitter(bap_steps, limits)
    chunks = (data[start : start + _CHUNK] for start in range(0, len(data), _CHUNK))
    planes = [plane for chunk in chunks for plane in splitter.push(chunk)]
    return planes + splitter.finish(), splitter.ending
