"""A file of named numbers and arrays that the web player reads: `figure/container.js`.

"FBAW", the length of the header (uint32, little-endian as all numbers), the header: JSON in UTF-8, then the
bytes of the arrays. `arrays` in the header lists them; other members name one by its place in that list. An
array: [type, rows, columns, first byte after the header, coding]. Types: u1, i1, u2, i2, i4. Codings,
which make gzip's work easier, store the bytes of one column after the other: first the lowest bytes of all
its rows, then the next. Coded are:

- "delta": the difference from the row above, modulo the type, as 2 d for d >= 0 and -2 d - 1 below.
- "rise", for corners of triangles, numbered in the order in which they first occur: by how much each is below
  the number of those that occurred before, 0 for the next new one; one column.
- "bytes": those of a file, such as a picture; one column.

Fractions are whole multiples of a step: {"array": place, "step": step, "origin": [one per column]}.
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from fba.arrays import Array, Float64, Int64
from fba.errors import ModelError

MAGIC = b"FBAW"
TYPES = ("u1", "i1", "u2", "i2", "i4")


class Container:
    """Arrays that are collected for one file."""

    def __init__(self) -> None:
        self._arrays: list[list[Any]] = []
        self._bytes = bytearray()

    def add_integers(self, values: npt.ArrayLike) -> int:
        """Add whole numbers (N,) or (N, K); return their place. ModelError where they do not fit 32 bits."""
        array = np.asarray(values, dtype=np.int64)
        rows = array[:, None] if array.ndim == 1 else array
        low, high = int(rows.min(initial=0)), int(rows.max(initial=0))
        kinds = [kind for kind in TYPES if np.iinfo(kind).min <= low and high <= np.iinfo(kind).max]
        if not kinds:
            raise ModelError(
                f"numbers from {low} to {high} do not fit 32 bits: the model is too large for a page"
            )
        kind = kinds[0]
        bits = 8 * int(kind[1])
        change = np.diff(rows, axis=0, prepend=0)
        change = (change + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1)
        return self._add(kind, np.where(change >= 0, 2 * change, -2 * change - 1), bits // 8, "delta")

    def add_triangles(self, triangles: Int64) -> int:
        """Add corners (F, 3), numbered in the order in which they first occur; return their place."""
        flat = triangles.reshape(-1, 1)
        seen = np.maximum.accumulate(np.concatenate([[[-1]], flat]), axis=0)[:-1] + 1
        below = seen - flat
        kind = "u2" if below.max(initial=0) < 1 << 16 else "i4"
        return self._add(kind, below, int(kind[1]), "rise")

    def add_fractions(self, values: npt.ArrayLike, step: float, *, centred: bool = False) -> dict[str, Any]:
        """Add numbers (N, K), rounded to multiples of a step; return their member of the header.

        centred: count from the middle of each column, for numbers far from 0.
        """
        rows = np.asarray(values, dtype=np.float64)
        origin = np.zeros(rows.shape[1])
        if centred and len(rows):
            origin = np.round((rows.min(axis=0) + rows.max(axis=0)) / 2, 6)
        whole = np.rint((rows - origin) / step).astype(np.int64)
        return {"array": self.add_integers(whole), "step": step, "origin": origin.tolist()}

    def add_bytes(self, data: bytes) -> int:
        """Add the bytes of a file; return their place."""
        return self._add("u1", np.frombuffer(data, dtype=np.uint8)[:, None], 1, "bytes")

    def finish(self, header: dict[str, Any]) -> bytes:
        """Return the file. header: what is to be found in it besides the arrays."""
        text = json.dumps({**header, "arrays": self._arrays}, separators=(",", ":"), allow_nan=False)
        encoded = text.encode()
        return MAGIC + struct.pack("<I", len(encoded)) + encoded + bytes(self._bytes)

    def _add(self, kind: str, codes: Array, width: int, coding: str) -> int:
        rows, columns = codes.shape
        self._arrays.append([kind, rows, columns, len(self._bytes), coding])
        planes = np.ascontiguousarray(codes.T.astype(f"<u{width}")).view(np.uint8)
        self._bytes += planes.reshape(columns, rows, width).transpose(0, 2, 1).tobytes()
        return len(self._arrays) - 1


def rounded(values: npt.ArrayLike, digits: int = 9) -> Any:
    """Return numbers as lists, rounded to a number of significant digits, for a header."""
    array: Float64 = np.asarray(values, dtype=np.float64)
    if array.ndim:
        return [rounded(value, digits) for value in array]
    return float(f"{float(array):.{digits}g}")
