"""Mutations of files and streams. What a mutation does depends on the random numbers alone."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from random import Random

MOST_BYTES = 60_000
"""Length above which no mutation makes a file longer: more finds nothing else, and takes longer."""

_NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
_NUMBERS = (
    b"0", b"1", b"-1", b"2", b"255", b"65536", b"2147483647", b"-2147483648", b"4294967295",
    b"99999999999999999999", b"0.1", b"-0.0", b"1e-320", b"1e30", b"-1e308", b"1e308", b"1e400", b"nan",
    b"inf",
    b"-inf", b"1e", b"1" + b"0" * 400, b"16000", b"\xd9\xa3",
)  # fmt: skip
_WORDS = (
    b"",
    b" ",
    b"\n",
    b"\r",
    b"\r\n",
    b"\t",
    b"#",
    b'"',
    b"\\",
    b"{",
    b"}",
    b"[",
    b"]",
    b",",
    b"\0",
    b"\xff",
)
_INTEGERS = (0, 1, 2, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFE, 0xFFFFFFFF)

Mutation = Callable[[bytearray, Random, Sequence[bytes], Sequence[bytes]], None]


def mutate(files: Sequence[bytes], random: Random, words: Sequence[bytes] = ()) -> tuple[bytes, bytes]:
    """Return one of the files with one to four mutations, and the file as it was.

    Mutations flip a bit, change, insert, delete, repeat or move bytes, change numbers in text and integers
    in binary data, insert one of `words`, cut the end off, or append the end of another file.
    """
    original = random.choice(files)
    data = bytearray(original)
    for _ in range(random.choice((1, 1, 1, 2, 2, 3, 4))):
        random.choice(_MUTATIONS)(data, random, files, words)
        del data[max(MOST_BYTES, len(original)) :]
    return bytes(data), original


def _flip(data: bytearray, random: Random, _files: Sequence[bytes], _words: Sequence[bytes]) -> None:
    if data:
        bit = random.randrange(8 * len(data))
        data[bit >> 3] ^= 128 >> (bit & 7)


def _change(data: bytearray, random: Random, _files: Sequence[bytes], _words: Sequence[bytes]) -> None:
    if data:
        data[random.randrange(len(data))] = random.choice((0, 0xFF, 0x7F, 0x80, 1, random.randrange(256)))


def _insert(data: bytearray, random: Random, _files: Sequence[bytes], _words: Sequence[bytes]) -> None:
    position = random.randrange(len(data) + 1)
    byte = random.choice((0, 0xFF, random.randrange(256)))
    data[position:position] = bytes([byte]) * random.choice((1, 1, 2, 3, 40))


def _delete(data: bytearray, random: Random, _files: Sequence[bytes], _words: Sequence[bytes]) -> None:
    position = random.randrange(len(data) + 1)
    del data[position : position + random.choice((1, 1, 2, 5, 30))]


def _repeat(data: bytearray, random: Random, _files: Sequence[bytes], _words: Sequence[bytes]) -> None:
    position = random.randrange(len(data) + 1)
    piece = data[position : position + random.choice((1, 2, 4, 8, 50))]
    target = random.randrange(len(data) + 1)
    data[target:target] = piece * random.choice((1, 1, 1, 3, 3, 500))


def _cut(data: bytearray, random: Random, _files: Sequence[bytes], _words: Sequence[bytes]) -> None:
    del data[random.randrange(len(data) + 1) :]


def _splice(data: bytearray, random: Random, files: Sequence[bytes], _words: Sequence[bytes]) -> None:
    other = random.choice(files)
    data[random.randrange(len(data) + 1) :] = other[random.randrange(len(other) + 1) :]


def _word(data: bytearray, random: Random, _files: Sequence[bytes], words: Sequence[bytes]) -> None:
    position = random.randrange(len(data) + 1)
    word = random.choice(words or _WORDS)
    data[position : position + random.choice((0, 0, len(word)))] = word


def _number(data: bytearray, random: Random, _files: Sequence[bytes], words: Sequence[bytes]) -> None:
    """Change a number in a text, or an integer of four bytes in other data."""
    position = random.randrange(len(data) + 1)
    match = _NUMBER.search(data, position) or _NUMBER.search(data)
    if match is not None and random.random() < 0.7:
        data[match.start() : match.end()] = random.choice(_NUMBERS)
    elif data:
        start = random.randrange(len(data))
        integer = random.choice(_INTEGERS).to_bytes(4, random.choice(("little", "big")))
        data[start : start + 4] = integer


def _line(data: bytearray, random: Random, _files: Sequence[bytes], _words: Sequence[bytes]) -> None:
    """Delete, repeat or move a line."""
    lines = bytes(data).split(b"\n")
    position = random.randrange(len(lines))
    line = lines[position]
    if random.random() < 0.6:
        del lines[position]
    target = random.randrange(len(lines) + 1)
    lines[target:target] = [line] * random.choice((0, 1, 1, 2, 300))
    data[:] = b"\n".join(lines)


_MUTATIONS: tuple[Mutation, ...] = (
    _flip, _flip, _flip, _change, _insert, _delete, _repeat, _cut, _splice, _word, _word, _number, _number,
    _line,
)  # fmt: skip
