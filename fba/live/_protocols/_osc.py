"""Reader of OSC 1.0: the messages and bundles in a datagram.

Source: "The Open Sound Control 1.0 Specification". Texts end with a NUL and are padded to multiples of four
bytes; numbers are big-endian. The package python-osc is not used because it raises UnicodeDecodeError and
writes to the log for damaged datagrams.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from fba.live._protocols.sample import DatagramError

MAX_DEPTH = 8
"""Deepest nesting of bundles."""
MAX_ARGUMENTS = 256
BUNDLE = b"#bundle\0"
HEADER = 16
"""Size of a bundle before its first element, bytes: the word and a time."""
SIZES = {"i": 4, "f": 4, "r": 4, "c": 4, "m": 4, "h": 8, "d": 8, "t": 8, "T": 0, "F": 0, "N": 0, "I": 0}
NUMBERS = {tag: struct.Struct(form) for tag, form in (("i", ">i"), ("f", ">f"), ("h", ">q"), ("d", ">d"))}
WRONG = "not OSC"

Argument = str | float | None


class Message(NamedTuple):
    """An address such as "/VMC/Ext/T", and its arguments; None for any that is neither text nor number."""

    address: str
    arguments: tuple[Argument, ...]


def read_messages(data: bytes) -> list[Message]:
    """Return all messages of a datagram, in order. Raises DatagramError where it is damaged."""
    messages: list[Message] = []
    _read(data, messages, MAX_DEPTH)
    return messages


def _read(data: bytes, messages: list[Message], levels: int) -> None:
    if not data.startswith(BUNDLE):
        messages.append(_message(data))
        return
    if levels == 0 or len(data) < HEADER:
        raise DatagramError(WRONG)
    position = HEADER
    while position < len(data):
        size = int.from_bytes(data[position : position + 4], "big")
        position += 4
        if size == 0 or size % 4 or position + size > len(data):
            raise DatagramError(WRONG)
        _read(data[position : position + size], messages, levels - 1)
        position += size


def _message(data: bytes) -> Message:
    address, position = _text(data, 0)
    if not address.startswith("/"):
        raise DatagramError(WRONG)
    if position == len(data):  # old senders leave out the type tags if there are no arguments
        return Message(address, ())
    tags, position = _text(data, position)
    if not tags.startswith(",") or len(tags) > MAX_ARGUMENTS:
        raise DatagramError(WRONG)
    arguments: list[Argument] = []
    for tag in tags[1:]:
        if tag == "s":
            text, position = _text(data, position)
            arguments.append(text)
            continue
        if tag not in SIZES or position + SIZES[tag] > len(data):
            raise DatagramError(WRONG)
        arguments.append(NUMBERS[tag].unpack_from(data, position)[0] if tag in NUMBERS else None)
        position += SIZES[tag]
    return Message(address, tuple(arguments))


def _text(data: bytes, start: int) -> tuple[str, int]:
    """Return the text at a position, and the position of the next element."""
    end = data.find(b"\0", start)
    if end < 0:
        raise DatagramError(WRONG)
    return data[start:end].decode("utf-8", errors="replace"), start + (end - start) // 4 * 4 + 4
