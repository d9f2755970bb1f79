"""Smooth shares of the points of a contour: 1 at the own point, 0 at the others, 1 together everywhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fba.arrays import Float64, Intp

TANGENT = 1.0
"""1 makes straight lines through the points stay straight, 0 keeps the shares of far points from dipping
below 0; between them lies what looks best."""


def shares(vertices: Float64, walk: Intp, nodes: Sequence[int | None]) -> Float64:
    """(M, K) for each vertex of a walk its shares of the K nodes along it.

    vertices: (N, 3). walk: (M,) vertices from the first to the last node. nodes: the vertex of each
    node, None for nodes that the face does not have: they lie evenly between the others.
    """
    from scipy.interpolate import PchipInterpolator

    steps = np.linalg.norm(np.diff(vertices[walk], axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(np.maximum(steps, 1e-12))])
    place: Mapping[int, int] = {int(v): k for k, v in enumerate(walk)}
    known = [(length[place[node]], float(k)) for k, node in enumerate(nodes) if node is not None]
    along = np.array([k for _, k in known]) if len(known) == len(walk) else None
    number = along if along is not None else PchipInterpolator(*zip(*known, strict=True))(length)
    return _cardinal(np.clip(number, 0, len(nodes) - 1), len(nodes))


def _cardinal(x: Float64, count: int) -> Float64:
    """(M, count) weights of values at 0, 1, ... in the smooth curve through them, at x."""
    k = np.clip(np.floor(x).astype(np.intp), 0, count - 2)
    t = x - k
    start, end = 2 * t**3 - 3 * t**2 + 1, -2 * t**3 + 3 * t**2
    leave, arrive = (t**3 - 2 * t**2 + t) * TANGENT, (t**3 - t**2) * TANGENT
    row = np.arange(len(x))
    weights = np.zeros((len(x), count))
    for tangent, node in ((leave, k), (arrive, k + 1)):
        before, after = np.maximum(node - 1, 0), np.minimum(node + 1, count - 1)
        width = (after - before).astype(np.float64)
        np.add.at(weights, (row, after), tangent / width)
        np.add.at(weights, (row, before), -tangent / width)
    np.add.at(weights, (row, k), start)
    np.add.at(weights, (row, k + 1), end)
    return weights
