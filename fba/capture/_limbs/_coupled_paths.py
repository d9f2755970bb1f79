"""Solve for paths over time in which each frame is coupled with its neighbours; compiled."""

from __future__ import annotations

from fba.arrays import Float64
from fba.compiled import compiled


@compiled
def chain(weights: Float64, bonds: Float64, pull: Float64, path: Float64) -> None:
    """Fill path (T,) with x, minimising sum weights[t] x[t]^2 + bonds[t] (x[t+1] - x[t])^2 - 2 pull[t] x[t].

    weights: (T,), positive. bonds: (T - 1,), not negative. pull: (T,). weights and pull are overwritten.
    Thomas's algorithm. IndexError for arrays of other lengths.
    """
    count = weights.shape[0]
    if min(bonds.shape[0] + 1, pull.shape[0], path.shape[0]) < count:
        raise IndexError("paths of different lengths")
    for t in range(count - 1):
        weights[t] += bonds[t]
        weights[t + 1] += bonds[t]
    for t in range(1, count):
        share = bonds[t - 1] / weights[t - 1]
        weights[t] -= share * bonds[t - 1]
        pull[t] += share * pull[t - 1]
    for t in range(count - 1, -1, -1):
        path[t] = (pull[t] + (bonds[t] * path[t + 1] if t < count - 1 else 0.0)) / weights[t]
