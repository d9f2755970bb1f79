"""The fine relief of skin: noise that repeats, from pores to the coarser grain seen at some distance."""

from __future__ import annotations

import numpy as np

from fba.arrays import UInt8
from fba.cache import kept, key_of

SIZE = 256
RELIEF = 0.022
"""Metres until it repeats."""
SHARES = ((3.0, 0.35), (9.0, 0.7), (26.0, 1.0), (60.0, 0.6))
"""Bands of the noise: grains across the picture, and how much they count."""
SPREAD = 0.17
"""Standard deviation of a channel, as a share of its range."""
MAKING = 1
"""Counts up with every change of how it is made: what was kept before is then made anew."""


def relief() -> UInt8:
    """(SIZE, SIZE, 3) three channels of noise about 128; the same every time, and so kept on disk."""
    key = key_of("relief", MAKING, SIZE, SPREAD, SHARES)
    (found,) = kept(key, ((SIZE, SIZE, 3),), lambda: [_relief()], np.uint8)
    return found


def _relief() -> UInt8:
    random = np.random.default_rng(20)
    along = np.fft.fftfreq(SIZE, 1 / SIZE)
    distance = np.hypot(along[:, None], along[None])
    bands = sum(
        share * np.exp(-(((distance - grains) / (0.45 * grains)) ** 2)) / grains for grains, share in SHARES
    )
    white = np.fft.fft2(random.standard_normal((3, SIZE, SIZE)))
    noise = np.real(np.fft.ifft2(white * bands))
    noise /= noise.std(axis=(1, 2), keepdims=True)
    pixels = np.clip(127.5 + 255 * SPREAD * noise, 0, 255).astype(np.uint8)
    return np.ascontiguousarray(pixels.transpose(1, 2, 0))
