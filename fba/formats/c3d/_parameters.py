"""The parameter section of C3D files: groups of named arrays.

See "The C3D file format user guide", Motion Lab Systems. The first block of the section names the processor
that wrote the file. All numbers of the file, also of header and data, are in that processor's byte order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Array, Float64, to_float64
from fba.errors import FormatError
from fba.source import Path

BLOCK_BYTES = 512
"""Bytes of a block, the unit of positions in the file."""
INTEL, DEC, MIPS = 84, 85, 86
"""Codes of processors."""
KEY = 0x50
"""The second byte of every C3D file."""
MOST_PARAMETERS = 4096
TEXT, BYTE, INTEGER, FLOAT = -1, 1, 2, 4
"""Codes of types of parameters."""
_KINDS = {TEXT: "S1", BYTE: "i1", INTEGER: "i2", FLOAT: "f4"}


@dataclass(frozen=True)
class Numbers:
    """How numbers are stored. order: "<" or ">". dec: whether floats are those of a VAX."""

    order: str
    dec: bool

    def words(self, data: bytes | memoryview, count: int, start: int = 0) -> Array:
        """Return signed numbers of 16 bits: int16 (count,)."""
        return np.frombuffer(data, f"{self.order}i2", count, start)

    def floats(self, data: bytes | memoryview, count: int, start: int = 0) -> Array:
        """Return numbers of 32 bits: float32 (count,)."""
        if not self.dec:
            return np.frombuffer(data, f"{self.order}f4", count, start)
        halves = np.frombuffer(data, "<u2", 2 * count, start).reshape(-1, 2)
        # the word with sign and exponent comes first, and the bias of the exponent is larger by 2
        floats: Array = np.ascontiguousarray(halves[:, ::-1]).view("<f4").ravel()
        with np.errstate(invalid="ignore"):  # as in `to_float64`
            return floats / np.float32(4)


@dataclass(frozen=True)
class Parameters:
    """The parameters of a file, by "GROUP:NAME" in upper case: arrays of numbers, and lists of texts."""

    numbers: Numbers
    arrays: dict[str, Array]
    texts: dict[str, tuple[str, ...]]

    def number(self, name: str, default: float = 0.0) -> float:
        """Return the first number of a parameter, or the default if the parameter is empty."""
        array = self.arrays.get(name)
        return float(array[0]) if array is not None and len(array) else default

    def unsigned(self, name: str) -> Float64:
        """Return the numbers of a parameter as float64; 16-bit numbers are read without a sign."""
        array = self.arrays.get(name, np.zeros(0))
        return to_float64(array.view(np.uint16) if array.dtype == np.int16 else array)

    def numbered_texts(self, name: str) -> tuple[str, ...]:
        """Return the texts of NAME, NAME2, NAME3 ...: a parameter holds at most 255 of them."""
        result = list(self.texts.get(name, ()))
        number = 2
        while f"{name}{number}" in self.texts:
            result += self.texts[f"{name}{number}"]
            number += 1
        return tuple(result)


def read_parameters(data: bytes, path: Path) -> Parameters:
    """Return the parameters of a C3D file.

    Raises FormatError where the section is cut off or contradicts itself.
    """
    start = (data[0] - 1) * BLOCK_BYTES
    if start < BLOCK_BYTES or start + 4 > len(data):
        raise FormatError(
            f"its first byte says that parameters begin in block {data[0]}, but the file has "
            f"{len(data) // BLOCK_BYTES} blocks of {BLOCK_BYTES} bytes; was it copied whole?", path=path,
        )  # fmt: skip
    processor = data[start + 3]
    if processor not in (INTEL, DEC, MIPS):
        raise FormatError(
            f"byte {start + 3} names no processor (84 Intel, 85 DEC, 86 MIPS)",
            path=path,
            token=str(processor),
        )
    numbers = Numbers(">" if processor == MIPS else "<", processor == DEC)
    groups: dict[int, str] = {}
    found: list[tuple[int, str, int]] = []
    position = start + 4
    while True:
        if position + 2 > len(data):
            raise FormatError(f"is cut off in its parameters, at byte {len(data)}", path=path)
        length, group = abs(_signed(data[position])), _signed(data[position + 1])
        if not length or not group:
            break
        after_name = position + 2 + length
        if after_name + 2 > len(data):
            raise FormatError(f"is cut off in its parameters, at byte {len(data)}", path=path)
        name = _text(data[position + 2 : after_name]).upper()
        if group < 0:
            groups.setdefault(-group, name)
        else:
            found.append((group, name, after_name + 2))
        if len(found) + len(groups) > MOST_PARAMETERS:
            raise FormatError(f"has more than {MOST_PARAMETERS} parameters", path=path)
        step = int(np.frombuffer(data, f"{numbers.order}u2", 1, after_name)[0])
        if not step:
            break
        if step < 2:
            raise FormatError(f"parameter {name!r} at byte {position} points at itself", path=path)
        position = after_name + step
    result = Parameters(numbers, {}, {})
    for group, name, place in found:
        _read_one(f"{groups.get(group, group)}:{name}", data, place, result, path)
    return result


def _read_one(name: str, data: bytes, place: int, result: Parameters, path: Path) -> None:
    """Read the values of one parameter into the result."""
    if place + 2 > len(data):
        raise FormatError(f"is cut off in parameter {name!r}", path=path)
    kind, dimensions = _signed(data[place]), data[place + 1]
    if kind not in _KINDS or dimensions > 7:
        raise FormatError(
            f"parameter {name!r} at byte {place} has type {kind} and {dimensions} dimensions; expected types "
            "-1, 1, 2, 4 and at most 7 dimensions",
            path=path,
        )
    shape = data[place + 2 : place + 2 + dimensions]
    count = 1
    for size in shape:
        count *= size
    begin = place + 2 + dimensions
    if len(shape) < dimensions or begin + count * abs(kind) > len(data):
        raise FormatError(
            f"parameter {name!r} at byte {place} has {count} values, more than the file holds", path=path
        )
    if kind == TEXT:
        # the first dimension is the length of each text
        each = shape[0] if dimensions > 1 else count
        texts = [_text(data[begin + n : begin + n + each]) for n in range(0, count, each)] if each else []
        result.texts.setdefault(name, tuple(texts))
    elif kind == FLOAT:
        result.arrays.setdefault(name, result.numbers.floats(data, count, begin))
    else:
        order = result.numbers.order if kind == INTEGER else ""
        array = np.frombuffer(data, f"{order}{_KINDS[kind]}", count, begin)
        result.arrays.setdefault(name, array.astype(array.dtype.newbyteorder("=")))


def _signed(byte: int) -> int:
    return byte - 256 if byte > 127 else byte


def _text(raw: bytes) -> str:
    try:
        text = raw.decode()
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    return text.split("\0")[0].strip()
