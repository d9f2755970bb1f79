"""Arrays that grow at their end: rows of numbers, and masks that rarely change between frames."""

from __future__ import annotations

import numpy as np

from fba.arrays import Array, Bool, Int64


class Rows:
    """An array (T, *shape) that grows by an eighth at a time.

    count: rows at the start, all zeros. in_place: resize the memory itself, which takes half as much memory,
    but invalidates older views; otherwise older views do not change.
    """

    def __init__(
        self, shape: tuple[int, ...], dtype: type[np.generic], count: int = 0, *, in_place: bool = False
    ) -> None:
        self.count = count
        self._in_place = in_place
        self._array: Array = np.zeros((count, *shape), dtype=dtype)

    def append(self, rows: Array | int | None, count: int) -> None:
        """Append `count` rows: the given rows, a value for all of them, or zeros."""
        need = self.count + count
        if need > len(self._array):
            self._resize(max(need, self.count + self.count // 8))
        if rows is not None:
            self._array[self.count : need] = rows
        self.count = need

    @property
    def width(self) -> int:
        """Number of columns of an array of rows."""
        return int(self._array.shape[1])

    def append_columns(self, rows: Array, columns: Int64 | slice) -> None:
        """Append rows, of which only these columns are given; the others are zeros."""
        first = self.count
        self.append(None, len(rows))
        if rows.shape[1]:
            self._array[first : self.count, columns] = rows

    def widen(self, width: int) -> None:
        """Add columns of zeros up to this number."""
        wider = np.zeros((len(self._array), width), dtype=self._array.dtype)
        wider[:, : self.width] = self._array
        self._array = wider

    def view(self) -> Array:
        """Return all rows, read-only, without a copy."""
        if self._in_place and self.count < len(self._array):
            self._resize(self.count)
        view = self._array[: self.count]
        view.flags.writeable = False
        return view

    def _resize(self, count: int) -> None:
        """Make room for `count` rows in all."""
        shape = (count, *self._array.shape[1:])
        if self._in_place:
            self._array.resize(shape, refcheck=False)
        else:
            larger = np.zeros(shape, dtype=self._array.dtype)
            larger[: self.count] = self._array[: self.count]
            self._array = larger


class GrowingMasks:
    """Growing masks, bool (T, columns), stored as a single row until a different row comes, which is rare."""

    def __init__(self, columns: int, count: int) -> None:
        self.any = False
        """Whether a bit is set anywhere."""
        self._row: Bool = np.zeros(columns, dtype=np.bool_)
        self._count = count
        self._rows: Rows | None = None

    def append(self, mask: Bool | None, count: int) -> None:
        """Append a row (columns,) `count` times, or rows (count, columns); None for zeros."""
        new = mask if mask is not None else np.zeros_like(self._row)
        self.any = self.any or bool(new.any())
        if not self._count and new.ndim == 1:
            self._row = new
        elif self._rows is None and (new.ndim > 1 or not np.array_equal(new, self._row)):
            self._rows = Rows(self._row.shape, np.bool_)
            self._rows.append(self._row, self._count)
        if self._rows is not None:
            self._rows.append(new, count)
        self._count += count

    def view(self) -> Bool:
        """Return all masks, read-only."""
        if self._rows is not None:
            return self._rows.view()
        return np.broadcast_to(self._row, (self._count, len(self._row)))
