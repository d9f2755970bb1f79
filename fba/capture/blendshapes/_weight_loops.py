"""The loop that finds weights of shapes, compiled (see `fba.compiled`).

Bounds: it goes by the shape of goals, in which it writes; products are read, and checked to be as many.
"""

from __future__ import annotations

from fba.arrays import Float64
from fba.compiled import compiled


@compiled
def find_weights(products: Float64, goals: Float64, sweeps: int, settled: float) -> Float64:
    """Turn goals (T, N) into weights (T, N) of 0 to 1 that solve least squares; return them.

    products: (N, N), of all shapes with each other, goals: of what is wanted with each shape. Each weight in
    turn is set to its best value for the others, up to `sweeps` times, until none changes by more than
    `settled`. A frame starts from the weights of the one before it.
    """
    frames, shapes = goals.shape
    if products.shape[0] < shapes or products.shape[1] < shapes:
        raise IndexError("fewer products than shapes")
    for frame in range(frames):
        row = goals[frame].copy()
        weights = goals[frame]
        for shape in range(shapes):
            weights[shape] = goals[frame - 1, shape] if frame else 0.0
        for _ in range(sweeps):
            change = 0.0
            for shape in range(shapes):
                rest = row[shape]
                for other in range(shapes):
                    rest -= products[shape, other] * weights[other]
                better = weights[shape] + rest / products[shape, shape]
                better = min(max(better, 0.0), 1.0)
                change = max(change, abs(better - weights[shape]))
                weights[shape] = better
            if change < settled:
                break
    return goals
