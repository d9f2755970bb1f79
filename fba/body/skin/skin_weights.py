"""Checks of the joints and weights of vertices, and their reduction to the most that a vertex can have."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool, Float32, Float64, Int32
from fba.errors import ModelError

INFLUENCES = 4
"""Most joints that a vertex can have."""
WEIGHT_TOLERANCE = 1e-3
"""Largest error of the sum of a vertex's weights; they are then scaled to a sum of 1."""
WEIGHT_DEDUCTION = 0.012
"""Subtracted from every weight where chains are thinned, so that tiny weights take up no joint."""


def checked_weights(
    where: str, joints: npt.ArrayLike, weights: npt.ArrayLike, count: int
) -> tuple[Int32, Float32]:
    """Return read-only copies of joints and weights, (count, 4), that sum to 1; ModelError as `BodyPart`."""
    which = np.array(joints)
    if which.shape != (count, INFLUENCES) or which.dtype.kind not in "iu":
        raise ModelError(f"{where}: joints must be whole numbers, ({count}, {INFLUENCES}), not {which.shape}")
    share = np.array(weights, dtype=np.float32)
    if share.shape != which.shape:
        raise ModelError(f"{where}: weights must have shape {which.shape}, not {share.shape}")
    if which.size and int(which.min()) < 0:
        raise ModelError(f"{where}: joint numbers must not be negative")
    total = share.sum(axis=1, dtype=np.float64)
    # written so that NaN fails too
    wrong = ~((share >= 0).all(axis=1) & (np.abs(total - 1) <= WEIGHT_TOLERANCE))
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        raise ModelError(
            f"{where}: the weights of vertex {row}, {share[row].tolist()}, are not 0 or more with a sum of 1"
        )
    share = (share / total[:, None]).astype(np.float32)
    which = which.astype(np.int32)
    which[share == 0] = 0  # joints without weight must not matter
    which.flags.writeable = share.flags.writeable = False
    return which, share


def strongest_weights(dense: Float64, alike: Sequence[bool] | None = None) -> tuple[Int32, Float32]:
    """Return (joints, weights), each (V, 4), of dense weights (V, J).

    Where a vertex has more than four joints, the fifth weight is subtracted from all, so that weights change
    over the surface without a step. alike: (J,) whether a joint belongs to a chain of neighbours that move
    almost as one, as vertebrae do. Joints of a chain are dropped first, and the strongest of them take over
    their weight.
    """
    if alike is not None:
        dense = _thin_chain(dense, np.asarray(alike, dtype=bool))
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


def _thin_chain(dense: Float64, alike: Bool) -> Float64:
    """Return (V, J) weights with chain joints dropped so that each vertex has at most `INFLUENCES` joints."""
    dense = np.maximum(dense - WEIGHT_DEDUCTION, 0.0)
    dense /= np.maximum(dense.sum(axis=1, keepdims=True), 1e-12)
    free = np.clip(INFLUENCES - (dense[:, ~alike] > 0).sum(axis=1), 1, INFLUENCES)
    chain = dense[:, alike]
    if chain.shape[1] <= 1:
        return dense
    total = chain.sum(axis=1, keepdims=True)
    ranked = np.pad(-np.sort(-chain, axis=1), ((0, 0), (0, INFLUENCES)))
    less = np.maximum(chain - np.take_along_axis(ranked, free[:, None], axis=1), 0.0)
    remaining = less.sum(axis=1, keepdims=True)
    dense[:, alike] = np.where(remaining > 1e-9, less * (total / np.maximum(remaining, 1e-12)), chain)
    return dense
