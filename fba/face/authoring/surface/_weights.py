"""Smooth fields on a surface that take given values at some vertices and vanish outside a region."""

from __future__ import annotations

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.errors import ModelError
from fba.face.authoring.surface.surface import Surface

MIN_SHARE = 0.006
"""Shares of a motion below this are set to 0."""


def solve_smooth_field(
    surface: Surface, free: Bool, fixed: Intp, values: Float64, *, slack: float, harmonic: bool = False
) -> Float64:
    """Return (N, K) fields that interpolate given values as smoothly as a bent plate.

    free: (N,) mask of vertices whose value is sought; all others that are not fixed keep 0, and the field
    fades towards them without a kink. fixed: (M,) vertices with given values (M, K). slack: metres; over
    longer distances the plate behaves like a stretched cloth, which does not overshoot. harmonic: a
    cloth throughout, so that no value exceeds the given ones. Raises ModelError where the system has no
    solution.
    """
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import splu

    given = surface.mask(fixed)
    laplacian, areas = surface.laplacian
    field = np.zeros((len(surface), values.shape[1]))
    field[fixed] = values
    sought = np.flatnonzero(free & ~given)
    if not len(sought):
        return field
    near = np.flatnonzero((abs(laplacian) @ (free | given).astype(np.float64)) > 0)
    rows = laplacian[near]
    system = local = rows[:, near]
    if not harmonic:
        # rows of L at the rim of this region are incomplete, but only those two rings further in are used
        system = rows @ diags_array(1 / areas) @ rows.T + local / slack**2
    inside = np.searchsorted(near, sought)
    known = np.setdiff1d(np.arange(len(near)), inside)
    right = -(system[inside][:, known] @ field[near[known]])
    try:
        solved = splu(system[inside][:, inside].tocsc(), permc_spec="MMD_AT_PLUS_A").solve(right)
    except (RuntimeError, MemoryError) as error:
        raise ModelError(
            f"the skin around vertices {sought[:3].tolist()}... gives no smooth field: {error}; "
            "are there vertices or triangles listed twice?"
        ) from None
    field[sought] = np.nan_to_num(solved)
    return field


def reachable_region(near: Float64, far: Float64, reach: float, share: float = 0.8) -> Bool:
    """Return (N,) mask of vertices near the moved, within `reach` and `share` of the way to the fixed."""
    with np.errstate(invalid="ignore"):
        return (near < reach) & (near < share * (near + far))


def trim_small(field: Float64, least: float = MIN_SHARE) -> Float64:
    """Return a field with values below `least` set to 0 and 1 unchanged, so that slow vertices rest."""
    return np.sign(field) * np.maximum(np.abs(field) - least, 0.0) / (1 - least)


def average_with_neighbours(surface: Surface, field: Float64, rounds: int) -> Float64:
    """Return a field (N,) averaged half and half with its neighbours', `rounds` times."""
    graph = surface.graph.astype(bool).astype(np.float64)
    count = np.maximum(graph.sum(axis=1), 1)
    result = field
    for _ in range(rounds):
        result = 0.5 * result + 0.5 * (graph @ result) / count
    return result


def carry_through(surface: Surface, field: Float64, targets: Intp, length: float) -> Float64:
    """Return a field (N,) that targets take over from skin up to `length` metres away in a straight line.

    Surfaces behind moving skin, such as the inside of a nostril, move with it.
    """
    from scipy.spatial import cKDTree

    sources = np.flatnonzero(field > 0.02)
    result = field.copy()
    if not len(sources) or not len(targets):
        return result
    tree, goal = cKDTree(surface.vertices[sources]), cKDTree(surface.vertices[targets])
    pairs = tree.sparse_distance_matrix(goal, length, output_type="ndarray")
    lifted = field[sources][pairs["i"]] * (1 - (pairs["v"] / length) ** 2) ** 2
    best = np.zeros(len(targets))
    np.maximum.at(best, pairs["j"], lifted)
    result[targets] = np.maximum(field[targets], best)
    return result
