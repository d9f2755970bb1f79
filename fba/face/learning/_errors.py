"""How far a face is off that computes FAPs by a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float32, Float64
from fba.face.deform._deformer import Deformer
from fba.face.deform.displacements import vertex_distances
from fba.parameters import fap_steps


@dataclass(frozen=True)
class Spread:
    """The mean of errors, the value that 1 % of them exceed, and the largest."""

    mean: float
    percentile_99: float
    largest: float

    @classmethod
    def measure(cls, values: Float64) -> Spread:
        """Return the spread of values (N,), N at least 1."""
        return cls(float(values.mean()), float(np.quantile(values, 0.99)), float(values.max()))

    def text(self) -> str:
        """Return it in words, of millimetres."""
        return (
            f"{self.mean:.2f} mm off on average, {self.percentile_99:.2f} mm in the worst 1 %, "
            f"{self.largest:.2f} mm at most"
        )


@dataclass(frozen=True)
class FapError:
    """Errors of one computed FAP.

    fap: its number. steps: in steps of the standard's quantiser table. millimetres: the largest, at the
    vertex that the FAP moves most; 0 for one that the face does not show.
    """

    fap: int
    steps: Spread
    millimetres: float


@dataclass(frozen=True)
class FitError:
    """Errors of computed FAPs over all frames.

    millimetres: of each frame's worst vertex, in the frame of the head. explained: the share of the motion
    of the computed FAPs that is right: 1 - squared error / squared motion, both in mm. faps: of each.
    """

    millimetres: Spread
    explained: float
    faps: tuple[FapError, ...]


class ErrorSum:
    """Collects errors stream by stream."""

    def __init__(self, deformer: Deformer, motion: Float64) -> None:
        """motion: float64 (68, P, 3), mm, as `displacements` gives it."""
        self._deformer = deformer
        self._motion = motion
        self._distances: list[Float64] = []
        self._differences: list[Float64] = []
        self._computed: list[Bool] = []
        self._squares = np.zeros(2)

    def add(self, wanted: Float32, shown: Float32, computed: Bool) -> None:
        """Add frames. wanted, shown: float32 (T, 68). computed: bool (68,), FAPs to which a link leads."""
        off = shown.astype(np.float64) - wanted
        self._distances.append(vertex_distances(self._deformer, wanted, shown) * 1000)
        self._differences.append(np.where(computed, np.abs(off), np.nan))
        motion = self._motion[computed].reshape(int(computed.sum()), -1)
        self._squares += [float(((values[:, computed] @ motion) ** 2).sum()) for values in (off, wanted)]

    def result(self, columns: Sequence[int]) -> FitError:
        """Return the errors of the frames that were added; those of FAPs in these columns one by one."""
        differences = np.concatenate(self._differences)
        reach = np.linalg.norm(self._motion, axis=2).max(axis=1, initial=0.0)
        listed = []
        for column in columns:
            own = differences[~np.isnan(differences[:, column]), column]
            if len(own):
                steps = Spread.measure(own / fap_steps()[column])
                listed.append(FapError(column + 1, steps, float(own.max() * reach[column])))
        missed, moved = self._squares
        explained = 1.0 - missed / moved if moved else 1.0
        return FitError(Spread.measure(np.concatenate(self._distances)), float(explained), tuple(listed))
