"""The VMC protocol: bones and expressions of an avatar, as OSC messages.

Senders divide frames into datagrams in any way. A frame lies between two messages `/VMC/Ext/T`, which give
its time. Other senders end frames with `/VMC/Ext/Blend/Apply`, or begin the next by repeating a bone. Bones
and expressions that a frame leaves out keep their values.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fba.live._protocols import unity_bones
from fba.live._protocols.ifacialmocap import SteadyClock
from fba.live._protocols.sample import BoneTurn, DatagramError, Sample

PREFIX = "/VMC/"
MAX_NAMES = 400
"""Largest number of expressions of an avatar; others are ignored."""
MAX_COORDINATE = 1e4
"""Largest coordinate of a bone, metres."""
MAX_VALUE = 4.0
"""Largest value of an expression."""
INITIAL_PERIOD = 1 / 60
NOTHING = "without messages of VMC"
WRONG = "with wrong messages of VMC"


class VmcReader:
    """Reads datagrams of a VMC performer."""

    def __init__(self) -> None:
        self._bones: dict[str, BoneTurn] = {}
        self._expressions: dict[str, float] = {}
        self._sent: set[str] = set()  # bones and expressions of this frame
        self._time: float | None = None  # of this frame, by the sender
        self._timed = False
        self._clock = SteadyClock(INITIAL_PERIOD)
        self._now = 0.0

    def read(self, data: bytes, now: float) -> list[Sample]:
        """Return the frames that a datagram completes; see `DatagramReader`."""
        messages = read_messages(data)
        if not any(message.address.startswith(PREFIX) for message in messages):
            raise DatagramError(NOTHING)
        self._now = now
        samples: list[Sample] = []
        for message in messages:
            samples += self._take(message)
        return samples

    def newest(self) -> Sample | None:
        """Return the newest values, even if the frame is not complete."""
        return self._sample(self._now) if self._bones or self._expressions else None

    def _take(self, message: Message) -> list[Sample]:
        """Process a message; return the frame that it ends, if any."""
        address, arguments = message
        if address == "/VMC/Ext/T":
            (time,) = _numbers(arguments[:1], 1)
            return self._end(time)
        if address == "/VMC/Ext/Blend/Apply" and not self._timed:
            return self._end(None)
        if address == "/VMC/Ext/Root/Pos":
            self._bones[""] = _turn(arguments)
        elif address == "/VMC/Ext/Bone/Pos":
            name = arguments[0] if arguments else None
            if not isinstance(name, str):
                raise DatagramError(WRONG)
            if name not in unity_bones.parents():
                return []
            ended = self._end(None) if name in self._sent and not self._timed else []
            self._bones[name] = _turn(arguments)
            self._sent.add(name)
            return ended
        elif address == "/VMC/Ext/Blend/Val":
            name = arguments[0] if arguments else None
            (value,) = _numbers(arguments[1:2], 1)
            if not isinstance(name, str) or abs(value) > MAX_VALUE:
                raise DatagramError(WRONG)
            if name in self._expressions or len(self._expressions) < MAX_NAMES:
                self._expressions[name] = value
                self._sent.add(f"/{name}")
        return []

    def _end(self, time: float | None) -> list[Sample]:
        """End a frame. time: of the next frame, by the sender, or None."""
        before, self._time, self._timed = self._time, time, time is not None
        if not self._sent or (time is not None and before == time):
            return []
        self._sent.clear()
        return [self._sample(before if before is not None else self._clock.time(self._now))]

    def _sample(self, time: float) -> Sample:
        names = tuple(self._expressions)
        return Sample(time, names, np.array(list(self._expressions.values())), bones=dict(self._bones))


def _numbers(arguments: Sequence[Argument], count: int) -> list[float]:
    """Return arguments as numbers; DatagramError for other arguments, or too few."""
    result = [float(value) for value in arguments if isinstance(value, int | float) and math.isfinite(value)]
    if len(result) != count:
        raise DatagramError(WRONG)
    return result


def _turn(arguments: Sequence[Argument]) -> BoneTurn:
    """Return the position and the rotation that follow the name of a bone."""
    numbers = np.array(_numbers(arguments[1:8], 7))
    rotation = unity_bones.rotation(numbers[3:])
    if rotation is None or np.abs(numbers[:3]).max() > MAX_COORDINATE:
        raise DatagramError(WRONG)
    return BoneTurn(unity_bones.position(numbers[:3]), rotation)


MAX_DEPTH = 8
"""Deepest nesting of bundles."""
MAX_ARGUMENTS = 256
BUNDLE = b"#bundle\0"
HEADER = 16
"""Size of a bundle before its first element, bytes: the word and a time."""
SIZES = {"i": 4, "f": 4, "r": 4, "c": 4, "m": 4, "h": 8, "d": 8, "t": 8, "T": 0, "F": 0, "N": 0, "I": 0}
NUMBERS = {tag: struct.Struct(form) for tag, form in (("i", ">i"), ("f", ">f"), ("h", ">q"), ("d", ">d"))}
NOT_OSC = "not OSC"

Argument = str | float | None


class Message(NamedTuple):
    """An address such as "/VMC/Ext/T", and its arguments; None for any that is neither text nor number."""

    address: str
    arguments: tuple[Argument, ...]


def read_messages(data: bytes) -> list[Message]:
    """Return all messages of a datagram in OSC 1.0, in order. Raises DatagramError where it is damaged.

    Source: "The Open Sound Control 1.0 Specification". Texts end with a NUL and are padded to multiples of
    four bytes; numbers are big-endian. The package python-osc is not used because it raises
    UnicodeDecodeError and writes to the log for damaged datagrams.
    """
    messages: list[Message] = []
    _read(data, messages, MAX_DEPTH)
    return messages


def _read(data: bytes, messages: list[Message], levels: int) -> None:
    if not data.startswith(BUNDLE):
        messages.append(_message(data))
        return
    if levels == 0 or len(data) < HEADER:
        raise DatagramError(NOT_OSC)
    position = HEADER
    while position < len(data):
        size = int.from_bytes(data[position : position + 4], "big")
        position += 4
        if size == 0 or size % 4 or position + size > len(data):
            raise DatagramError(NOT_OSC)
        _read(data[position : position + size], messages, levels - 1)
        position += size


def _message(data: bytes) -> Message:
    address, position = _text(data, 0)
    if not address.startswith("/"):
        raise DatagramError(NOT_OSC)
    if position == len(data):  # old senders leave out the type tags if there are no arguments
        return Message(address, ())
    tags, position = _text(data, position)
    if not tags.startswith(",") or len(tags) > MAX_ARGUMENTS:
        raise DatagramError(NOT_OSC)
    arguments: list[Argument] = []
    for tag in tags[1:]:
        if tag == "s":
            text, position = _text(data, position)
            arguments.append(text)
            continue
        if tag not in SIZES or position + SIZES[tag] > len(data):
            raise DatagramError(NOT_OSC)
        arguments.append(NUMBERS[tag].unpack_from(data, position)[0] if tag in NUMBERS else None)
        position += SIZES[tag]
    return Message(address, tuple(arguments))


def _text(data: bytes, start: int) -> tuple[str, int]:
    """Return the text at a position, and the position of the next element."""
    end = data.find(b"\0", start)
    if end < 0:
        raise DatagramError(NOT_OSC)
    return data[start:end].decode("utf-8", errors="replace"), start + (end - start) // 4 * 4 + 4
