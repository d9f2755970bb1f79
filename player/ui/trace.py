"""The picture behind the timeline: how many bits each plane took, I planes in another colour."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Float64 = npt.NDArray[np.float64]
UInt8 = npt.NDArray[np.uint8]

PREDICTED = (120, 160, 190)
INTRA = (238, 178, 84)
LEAST = 0.06
"""Height that even the smallest plane has, as a share of the whole."""
GAP = 5
"""From so many pixels on, planes have a gap between them."""


def trace_picture(
    amounts: Float64,
    intra: npt.NDArray[np.bool_] | None,
    shares: Float64,
    size: tuple[int, int],
) -> UInt8:
    """uint8 (H, W, 4), transparent but for a column for each plane.

    amounts: (T,) of each plane, at least 0; heights go with its square root, so that small planes are
    seen beside large ones. intra: (T,), which are I planes. shares: (T,) ascending, where on the line each
    plane is, 0 to 1. size: width and height. A pixel that several planes share shows the largest.
    """
    width, height = size
    picture = np.zeros((height, width, 4), dtype=np.uint8)
    if not len(amounts) or amounts.max() <= 0:
        return picture
    starts = np.clip(np.floor(shares * (width - 1)).astype(int), 0, width - 1)
    tall = np.zeros(width)
    np.maximum.at(tall, starts, amounts)
    owner = np.maximum.accumulate(np.where(tall > 0, np.arange(width), 0))
    key = np.zeros(width, dtype=bool)
    if intra is not None:
        key[starts[intra]] = True
        key = key[owner]
    tall = np.sqrt(tall[owner] / amounts.max())
    tall[tall > 0] = LEAST + (1 - LEAST) * tall[tall > 0]
    filled = np.bincount(starts, minlength=width) > 0
    if width / len(amounts) >= GAP:
        tall[np.flatnonzero(filled)[1:] - 1] = 0.0
    level = tall * height
    cover = np.clip(level[None, :] - (height - 1 - np.arange(height))[:, None], 0.0, 1.0)
    picture[..., :3] = np.where(key[:, None], INTRA, PREDICTED)
    picture[..., 3] = np.round(cover * np.where(key, 235, 150))
    return picture
