"""Where the vertices of a figure are in one pose: worked out where somebody asks for them, all or some.

A picture that is deformed on the graphics card needs few of them here: those that shadows, light, eyes and
distances are taken from.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any
from weakref import WeakSet

import numpy as np
import numpy.typing as npt

Float32 = npt.NDArray[np.float32]
Rows = npt.NDArray[np.intp]
SomeRows = npt.NDArray[np.integer[Any]]
Arrays = tuple[Float32, Float32]


_sparing: WeakSet[Any] = WeakSet()


def spare(who: Any, does: bool) -> None:
    """Whether somebody makes vertices by other means. Where nobody does, all are made here sooner or later,
    and with the first that is asked for."""
    if does:
        _sparing.add(who)
    else:
        _sparing.discard(who)


class Probe:
    """The vertices of a figure that are asked for one by one: those asked for once are worked out with every
    pose from then on, all together.

    count: of all vertices, V. prepare: for rows (N,), rising, gives what writes them: (pose, *arrays), which
    are float32 (V, 3), places and, where these are wanted, normals.
    """

    def __init__(
        self, count: int, prepare: Callable[[Rows], Callable[..., None]], *, normals: bool = False
    ) -> None:
        self._prepare = prepare
        self._wanted = np.zeros(count, dtype=bool)
        self._write: Callable[..., None] | None = None
        self._arrays = tuple(np.zeros((count, 3), dtype=np.float32) for _ in range(2 if normals else 1))
        self._pose: Any = None

    def at(self, pose: Any, rows: SomeRows) -> tuple[Float32, ...]:
        """The arrays, right at the rows (N,); to be used at once: the next pose overwrites them."""
        if not self._wanted[rows].all():
            self._wanted[rows] = True
            self._write = self._pose = None
        if self._pose is not pose:
            if self._write is None:
                self._write = self._prepare(np.flatnonzero(self._wanted))
            self._write(pose, *self._arrays)
            self._pose = pose
        return self._arrays


class Whole:
    """All vertices of a face or of a body in one pose.

    count: V. make: gives all positions and normals, float32 (V, 3). some: gives places (V, 3) that are right
    at rows (N,), without making all; None where that is not quicker. motion: what a graphics card needs to
    make them itself, see `fba_player.gl.gpu`; None where it cannot.
    """

    def __init__(
        self,
        count: int,
        make: Callable[[], Arrays],
        some: Callable[[SomeRows], Float32] | None = None,
        motion: Callable[[], Any] | None = None,
    ) -> None:
        self.count = count
        self._parts = (make, some, motion)
        self._made: Arrays | None = None

    @property
    def arrays(self) -> Arrays:
        """Positions and normals, both (V, 3)."""
        if self._made is None:
            self._made = self._parts[0]()
        return self._made

    @property
    def is_made(self) -> bool:
        """Whether they have been asked for."""
        return self._made is not None

    def at(self, rows: SomeRows) -> Float32:
        """(V, 3) positions that are right at the rows (N,); to be used at once."""
        some = self._parts[1]
        if some is None or self._made is not None or not len(_sparing):
            return self.arrays[0]
        return some(rows)

    @cached_property
    def motion(self) -> Any:
        """What a graphics card needs to make them, or None."""
        make = self._parts[2]
        return None if make is None else make()

    @property
    def moves(self) -> bool:
        """Whether a graphics card can make them."""
        return self._parts[2] is not None

    def afresh(self) -> Whole:
        """The same, not worked out yet."""
        return Whole(self.count, *self._parts)


class Places:
    """The vertices of one part in one pose: those of a whole from `start` on, (V, 3). chosen: (N,), some of
    them only."""

    def __init__(self, whole: Whole, start: int, count: int, chosen: Rows | None = None) -> None:
        self.whole = whole
        self.start = start
        self.chosen = chosen
        self._all = count
        self._sample: Float32 | None = None

    @staticmethod
    def of(positions: Float32, normals: Float32) -> Places:
        """Of arrays (V, 3)."""
        return Places(Whole(len(positions), lambda: (positions, normals)), 0, len(positions))

    def __len__(self) -> int:
        return self._all if self.chosen is None else len(self.chosen)

    @cached_property
    def positions(self) -> Float32:
        """float32 (V, 3)."""
        return self._taken(self.whole.arrays[0])

    @cached_property
    def normals(self) -> Float32:
        """float32 (V, 3)."""
        return self._taken(self.whole.arrays[1])

    def reached(self, rows: SomeRows) -> Float32:
        """(V, 3) positions of all that are right at the rows (N,); to be used at once."""
        return self.whole.at(rows + self.start)[self.start : self.start + self._all]

    def sampled(self, step: int) -> Float32:
        """(N, 3) every so manieth position. Where not all are made, those first asked for: of `some`, too."""
        if self.whole.is_made:
            return self.positions[::step]
        if self._sample is None:
            rows = np.arange(0, self._all, step) if self.chosen is None else self.chosen[::step]
            rows = rows + self.start
            self._sample = self.whole.at(rows)[rows]
        return self._sample

    def some(self, rows: Rows) -> Places:
        """Some of them: (N,)."""
        found = Places(self.whole, self.start, self._all, rows)
        found._sample = self._sample
        return found

    def afresh(self, wholes: dict[int, Whole]) -> Places:
        """The same, not worked out yet. wholes: by the id of what they stand for, those made anew already."""
        found = wholes.setdefault(id(self.whole), self.whole.afresh())
        return Places(found, self.start, self._all, self.chosen)

    def _taken(self, array: Float32) -> Float32:
        part = array[self.start : self.start + self._all]
        return part if self.chosen is None else part.take(self.chosen, axis=0)
