"""Some vertices of a face, moved as all of them are: for what is known by a few of them."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float32, Floating, Int64, Intp
from fba.face.deform.flat_tables import Shifts, Transforms, chosen_shifts


class ChosenVertices:
    """Moves vertices rows (N,), rising, of a face's V; `Deformer.chosen` makes it.

    vertices: (V, 3), the neutral face; part_start (P + 1,): where its parts begin.
    """

    def __init__(
        self, vertices: Float32, part_start: Int64, shifts: Shifts, transforms: Transforms, rows: Intp
    ) -> None:
        from fba.face.deform import _subset_loops as subset_loops
        from fba.face.deform._loops import Scratch

        self._loops = subset_loops
        self._rows = np.array(rows, dtype=np.int64)
        self._rest = np.array(vertices[rows], dtype=np.float32, order="C")
        self._part_start = np.searchsorted(self._rows, part_start).astype(np.int64)
        self._shifts = chosen_shifts(shifts, rows, len(vertices))
        self._transforms = transforms
        parts = len(part_start) - 1
        self._scratch = Scratch(
            moved=np.empty_like(self._rest),
            touched=np.zeros(parts, dtype=np.int64),
            poses=np.empty((parts + 1, 3, 4)),
            whole=np.empty((3, 4)),
            pose=np.empty((3, 4), dtype=np.float32),
            turn=np.empty((3, 3), dtype=np.float32),
        )

    def local(self, faps: Floating, out: Float32) -> None:
        """Writes their places for FAPs (68,) into their rows of out, float32 (V, 3), and leaves the others:
        what `Deformer.local` gives there, number for number."""
        with np.errstate(all="ignore"):
            self._loops.deform_chosen(
                np.ascontiguousarray(faps, dtype=np.float64),
                self._rest,
                self._rows,
                self._part_start,
                self._shifts,
                self._transforms,
                self._scratch,
                out,
            )
