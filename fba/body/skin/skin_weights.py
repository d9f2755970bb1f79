"""Weights of many joints brought down to the few that a vertex has room for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from fba.body.model import INFLUENCES

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]
Int32 = npt.NDArray[np.int32]

LEAST = 0.012
"""Taken from every weight: what is less does not count, and takes no place."""


def strongest(dense: Float64, alike: Sequence[bool] | None = None) -> tuple[Int32, Float32]:
    """Joints and weights (V, 4) of dense weights (V, J).

    Of more than four joints, what the fifth has is taken from all, so that weights fade in and out over the
    surface without a step. alike: of each joint, whether it is one of a chain of neighbours that move almost
    as one, as vertebrae do. Those give way first, the greatest of them taking over what others carry.
    """
    if alike is not None:
        dense = _thinned(dense, np.asarray(alike, dtype=bool))
    joints = dense.shape[1]
    if joints < INFLUENCES:
        dense = np.pad(dense, ((0, 0), (0, INFLUENCES - joints)))
    order = np.argsort(-dense, axis=1, kind="stable")[:, : INFLUENCES + 1]
    ranked = np.take_along_axis(dense, order, axis=1)
    fifth = ranked[:, INFLUENCES:] if ranked.shape[1] > INFLUENCES else 0.0
    share = np.clip(ranked[:, :INFLUENCES] - fifth, 0.0, None)
    share[:, 0] = np.where(share.sum(axis=1) > 1e-9, share[:, 0], 1.0)
    share /= share.sum(axis=1, keepdims=True)
    share[share < 1e-4] = 0.0
    share /= share.sum(axis=1, keepdims=True)
    return order[:, :INFLUENCES].astype(np.int32), share.astype(np.float32)


def _thinned(dense: Float64, alike: npt.NDArray[np.bool_]) -> Float64:
    """The same weights with fewer of those that move alike, in all no more than there is room for."""
    dense = np.maximum(dense - LEAST, 0.0)
    dense /= np.maximum(dense.sum(axis=1, keepdims=True), 1e-12)
    rooms = np.clip(INFLUENCES - (dense[:, ~alike] > 0).sum(axis=1), 1, INFLUENCES)
    chain = dense[:, alike]
    if chain.shape[1] <= 1:
        return dense
    total = chain.sum(axis=1, keepdims=True)
    ranked = np.pad(-np.sort(-chain, axis=1), ((0, 0), (0, INFLUENCES)))
    less = np.maximum(chain - np.take_along_axis(ranked, rooms[:, None], axis=1), 0.0)
    kept = less.sum(axis=1, keepdims=True)
    dense[:, alike] = np.where(kept > 1e-9, less * (total / np.maximum(kept, 1e-12)), chain)
    return dense
