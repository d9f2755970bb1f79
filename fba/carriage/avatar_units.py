"""Avatar animation units (ISO/IEC 23090-39, Avatar Representation Format): bytes to arrays and back.

A stream is units one after another; all numbers are big-endian. A unit is a byte, its type times 2; the
length of what follows, 4 bytes; a time in ticks, 4 bytes; and then, by type:

0, configuration: length of a name, 1 byte; the name of a profile; ticks per second, float32.
1, weights of blendshapes: number of the set, 2 bytes; a byte of flags; their count less 1, 2 bytes; for each
its number, 2 bytes, and weight, float32; a confidence, float32, follows where the flag 128 is set.
2, joints: the same, with a matrix of 16 float32 in rows in place of the weight, from the joint's frame into
its parent's, and one of velocities where the flag 128 is set.

Other types are stepped over, as the standard asks.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64, Int64, to_float64
from fba.errors import FormatError
from fba.limits import DEFAULT_LIMITS, Limits

CONFIGURATION, SHAPES, JOINTS = 0, 1, 2
"""Types of units."""
TICKS_MAX = (1 << 32) - 1
"""The latest time, in ticks."""
TIMESCALE_MAX = 1e9
"""Most ticks per second that a stream may have."""
_HEADER = struct.Struct(">BII")
_LIST = struct.Struct(">HBH")
_EXTRA = 128
"""Flag: each entry has a confidence, or velocities."""
_WIDTHS = {SHAPES: 1, JOINTS: 16}
_CELL_BYTES = 24
"""Memory that a number of the result takes while it is made."""


@dataclass(frozen=True, eq=False)
class UnitTrack:
    """Units of one type and one set.

    set_number: the set of shapes or joints that they name. profile: of the configuration before them. times:
    float64 (T,), seconds, increasing. values: float64, weights (T, N) or matrices (T, N, 4, 4); NaN where a
    unit does not mention the shape or joint.
    """

    set_number: int
    profile: str
    times: Float64
    values: Float64


@dataclass(frozen=True, eq=False)
class AvatarUnits:
    """The content of a stream.

    shapes, joints: None where it has none. left_out: count of units by type that are not here: those of
    unknown types, and of further sets.
    """

    shapes: UnitTrack | None
    joints: UnitTrack | None
    left_out: Mapping[int, int]


@dataclass
class _Collected:
    """Units of one type so far."""

    set_number: int
    profile: str
    times: list[float]
    entries: list[npt.NDArray[np.void]]


def begins_stream(head: bytes) -> bool:
    """Whether bytes begin like a stream: with a configuration at time 0 whose lengths agree."""
    if len(head) < _HEADER.size + 1 or head[0] >> 1 != CONFIGURATION:
        return False
    _, length, ticks = _HEADER.unpack_from(head)
    return bool(ticks == 0 and length == 9 + head[_HEADER.size])


def read_units(data: bytes, limits: Limits = DEFAULT_LIMITS) -> AvatarUnits:
    """Return the weights and the matrices of a stream.

    Raises FormatError, which names the unit and its byte, for units that are cut off, contradict themselves,
    come before a configuration, or are not later than the one before; LimitError.
    """
    collected: dict[int, _Collected] = {}
    left_out: Counter[int] = Counter()
    profile, timescale = "", 0.0
    at = number = 0
    while at < len(data):
        place = f"unit {number}, byte {at}"
        if len(data) - at < _HEADER.size:
            raise FormatError(f"{place}: the stream ends in the head of this unit")
        kind, length, ticks = _HEADER.unpack_from(data, at)
        begin, end = at + _HEADER.size, at + 5 + length
        if length < 4 or end > len(data):
            raise FormatError(f"{place}: has {length} bytes; expected 4 to {len(data) - at - 5}")
        content = memoryview(data)[begin:end]
        kind >>= 1
        if kind == CONFIGURATION:
            profile, timescale = _read_configuration(content, place)
        elif kind in _WIDTHS:
            if not timescale:
                raise FormatError(f"{place}: no configuration before it says how long a tick is")
            set_number, entries = _read_entries(content, kind, place)
            found = collected.setdefault(kind, _Collected(set_number, profile, [], []))
            if found.set_number != set_number:
                left_out[kind] += 1
            else:
                seconds = ticks / timescale
                if found.times and seconds <= found.times[-1]:
                    raise FormatError(f"{place}: is at {seconds:g} s, not later than the one before it")
                found.times.append(seconds)
                found.entries.append(entries)
        else:
            left_out[kind] += 1
        at, number = end, number + 1
    tracks = {kind: _track(found, kind, len(data), limits) for kind, found in collected.items()}
    return AvatarUnits(tracks.get(SHAPES), tracks.get(JOINTS), dict(left_out))


def _read_configuration(content: memoryview, place: str) -> tuple[str, float]:
    """Return the profile and the ticks per second."""
    size = content[0] if content else 0
    if len(content) != size + 5:
        raise FormatError(f"{place}: a configuration of {len(content) + 4} bytes; its name needs {size + 9}")
    (timescale,) = struct.unpack_from(">f", content, size + 1)
    if not 0 < timescale <= TIMESCALE_MAX:
        raise FormatError(f"{place}: {timescale:g} ticks per second; expected 0 to {TIMESCALE_MAX:g}")
    return bytes(content[1 : size + 1]).decode("utf-8", "replace"), timescale


def _entry(kind: int, *, extra: bool) -> np.dtype[np.void]:
    width = _WIDTHS[kind]
    more = [("extra", ">f4", (width,))] if extra else []
    return np.dtype([("number", ">u2"), ("value", ">f4", (width,)), *more])


def _read_entries(content: memoryview, kind: int, place: str) -> tuple[int, npt.NDArray[np.void]]:
    """Return the number of the set, and what a unit lists."""
    if len(content) < _LIST.size:
        raise FormatError(f"{place}: ends before its list")
    set_number, flags, last = _LIST.unpack_from(content)
    entry = _entry(kind, extra=bool(flags & _EXTRA))
    count = last + 1
    if len(content) != _LIST.size + count * entry.itemsize:
        there = (len(content) - _LIST.size) / entry.itemsize
        raise FormatError(f"{place}: lists {count} entries, but has the bytes of {there:g}")
    entries = np.frombuffer(content, entry, count, _LIST.size)
    if not np.isfinite(entries["value"]).all():
        raise FormatError(f"{place}: has a number that is not finite")
    return set_number, entries


def _track(found: _Collected, kind: int, source: int, limits: Limits) -> UnitTrack:
    """Return arrays of what units list."""
    frames, width = len(found.times), _WIDTHS[kind]
    count = 1 + max(int(entries["number"].max()) for entries in found.entries)
    limits.check_frames(frames, "the stream")
    limits.check_bytes(_CELL_BYTES * frames * count * width, "the stream", source=source)
    values = np.full((frames, count, width), np.nan)
    for frame, entries in enumerate(found.entries):
        values[frame, entries["number"]] = to_float64(entries["value"])
    shape = (frames, count) if kind == SHAPES else (frames, count, 4, 4)
    return UnitTrack(found.set_number, found.profile, np.array(found.times), values.reshape(shape))


def write_configuration(profile: str, timescale: float) -> bytes:
    """Return a configuration. profile: up to 255 bytes of UTF-8. timescale: ticks per second."""
    name = profile.encode()
    content = bytes([len(name)]) + name + struct.pack(">f", timescale)
    return _HEADER.pack(CONFIGURATION << 1, 4 + len(content), 0) + content


def write_units(kind: int, ticks: Int64, values: Float64, numbers: Int64 | None = None) -> list[bytes]:
    """Return a unit for each frame, of set 0.

    kind: SHAPES or JOINTS. ticks: int64 (T,), 0 to `TICKS_MAX`. values: weights (T, N) or matrices (T, N, 4,
    4). numbers: int64 (N,), of the shapes or joints; None for 0, 1, ...
    """
    frames, count = values.shape[:2]
    entries = np.zeros((frames, count), _entry(kind, extra=False))
    entries["number"] = np.arange(count) if numbers is None else numbers
    entries["value"] = values.reshape(frames, count, -1)
    listed = _LIST.pack(0, 0, count - 1)
    length = 4 + len(listed) + count * entries.itemsize
    return [
        _HEADER.pack(kind << 1, length, tick) + listed + row.tobytes()
        for tick, row in zip(ticks.tolist(), entries, strict=True)
    ]
