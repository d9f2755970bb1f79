"""A body's own head with shapes: FAPs mix its shapes and turn its eyes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from fba import rotations
from fba.arrays import Float32, Float64, Intp
from fba.parameters import FAP_COUNT, fap_numbers

UP = np.array([0.0, 1.0, 0.0])
ASIDE = np.array([1.0, 0.0, 0.0])
SMALL_WEIGHT = 0.1
"""Weight of keeping shapes small, relative to reaching the largest values of a FAP."""
FEW_WEIGHT = 0.03
"""Weight of using few shapes, relative to reaching the largest values of a FAP."""


@dataclass(frozen=True, eq=False)
class HeadShape:
    """A shape of a head.

    faps: float64 (68,), shown at weight 1. rows: (N,), vertices of the body that it moves. shifts: float32
    (N, 3), by which it moves them, metres, in the body's axes as modelled.
    """

    name: str
    faps: Float64
    rows: Intp
    shifts: Float32


@dataclass(frozen=True, eq=False)
class OwnEye:
    """An eyeball of a head: side "l" or "r", the vertices that turn with it, (N,), and its centre (3,)."""

    side: str
    rows: Intp
    centre: Float64


@dataclass(frozen=True, eq=False)
class OwnHead:
    """Shapes and eyes of a body's own head. ranges: (68,), largest FAPs, to which others are scaled."""

    ranges: Float64
    shapes: Sequence[HeadShape] = ()
    eyes: Sequence[OwnEye] = ()
    _last: list[tuple[bytes, Float64]] = field(default_factory=list, repr=False)

    @cached_property
    def mixing(self) -> tuple[Float64, Float64]:
        """Scales (68,) of FAPs, and the matrix (68 + K, K) that mixes shapes."""
        faps = np.array([shape.faps for shape in self.shapes]).reshape(-1, FAP_COUNT).copy()
        for eye in self.eyes:  # the eyeballs turn, so shapes need not look aside
            for what in ("yaw", "pitch"):
                faps[:, fap_numbers()[f"{what}_{eye.side}_eyeball"] - 1] = 0
        used = np.abs(faps).max(axis=0, initial=0.0) > 0
        scales = np.where(used, 1 / np.maximum(self.ranges, 1.0), 0.0)
        return scales, np.concatenate([(faps * scales).T, SMALL_WEIGHT * np.eye(len(faps))])

    def weights(self, faps: npt.ArrayLike) -> Float64:
        """Return the weights (K,), 0 to 1, of the shapes that together come closest to FAPs (68,)."""
        from scipy.optimize import nnls

        values = np.asarray(faps, dtype=np.float64)
        if not self.shapes or not values.any():
            return np.zeros(len(self.shapes))
        key = values.tobytes()
        for last, weights in self._last:  # one, if any; other threads may replace it meanwhile
            if last == key:
                return weights
        scales, matrix = self.mixing
        count, reached = len(self.shapes), values * scales
        chosen = nnls(matrix, np.concatenate([reached, np.full(count, -FEW_WEIGHT / SMALL_WEIGHT)]))[0] > 0
        result: Float64 = np.zeros(count)
        matrix = matrix[:FAP_COUNT]
        while chosen.any():  # shapes above 1 are fixed at 1, and the others compensate
            result[chosen] = nnls(matrix[:, chosen], reached - matrix[:, ~chosen] @ result[~chosen])[0]
            over = result > 1
            if not over.any():
                break
            result[over] = 1.0
            chosen &= ~over
        self._last[:] = [(key, result)]
        return result

    def move(self, vertices: Float32, faps: npt.ArrayLike) -> Float32:
        """Return the body's vertices (V, 3) as modelled with the head moved by FAPs (68,)."""
        moved = vertices.astype(np.float32)  # a copy
        for shape, weight in zip(self.shapes, self.weights(faps), strict=True):
            if weight > 0:
                moved[shape.rows] += np.float32(weight) * shape.shifts
        values = np.asarray(faps, dtype=np.float64) / 1e5
        for eye in self.eyes:
            yaw, pitch = (
                values[fap_numbers()[f"{what}_{eye.side}_eyeball"] - 1] for what in ("yaw", "pitch")
            )
            if yaw or pitch:
                turn = rotations.turn(UP, np.array(yaw)) @ rotations.turn(ASIDE, np.array(pitch))
                turned = (moved[eye.rows] - eye.centre) @ turn.T + eye.centre
                moved[eye.rows] = turned.astype(np.float32)
        return moved
