"""What faces look like, learned from rendered ones: the whole face, and how its points are found.

The template of a whole face, with the distance from the space of its eigenvectors, is that of Karpouzis,
section 7.3, and so are pupils by brightness. The other points come from a cascade of linear regressions on
gradients (X. Xiong and F. De la Torre, "Supervised descent method", 2013): templates, Gabor phases and
eigenfeatures of single points, his way, left those of the eyes nearly twice as far off.
`tools/photos/learn_features.py` makes the data.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import as_file, files

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.signal import fftconvolve

from fba.arrays import Float32, Float64, Floating, UInt8

EYES = 44.0
"""Pixels between the pupils in a face of standard size."""
FACE_SIZE = (200, 176)
"""Height and width of a face of standard size, pixels; the middle of the eyes is at `MIDDLE`."""
MIDDLE = (88.0, 70.0)
"""x and y of the middle of the eyes in a face of standard size."""
SMALL = 4.0
"""Factor by which the template of a whole face is smaller."""
WHOLE = (14, 9, 20)
"""Beside, above and below the middle of the eyes: what the whole face's template shows, small pixels."""
WHOLE_LOCAL = 28.0
"""Pixels over which brightness and contrast of a whole face are evened."""
REACHES = (4.0, 2.0)
"""Pixels over which gradients are summed, coarse and fine."""
STAGES = (0, 0, 1, 1, 1)
"""Reach, as a number in `REACHES`, of each regression of the cascade."""
CELLS = 4
"""Sums of gradients along each side of a square around a point."""


@dataclass(frozen=True, eq=False)
class Features:
    """What faces look like. P: points, those of `FRONT_POINTS`; D: numbers that describe all surroundings.

    mean: (P, 2), where points are in a face of standard size, pixels. weights: (5, D + 1, K), the
    regressions of the cascade, the constant last; times scales (5, K). bases: (5, K, 2P), the shifts
    of points that the K results stand for. likeness: (D + 1,), the regression of "is a face" (1) or not (-1).
    whole: (1 + 4, H, W), the template of the whole small face and its eigenvectors.
    """

    mean: Float64
    weights: Float32
    scales: Float32
    bases: Float32
    likeness: Float32
    whole: Float64

    def follow(self, face: Float64, places: Float64, first: int = 0) -> tuple[Float64, float]:
        """Return points (P, 2) found in a face of standard size from a guess, and their likeness to a face's.

        first: number of the first regression; later ones see smaller surroundings.
        """
        gradients = [gradient_sums(face, reach) for reach in REACHES]
        for stage in range(first, len(STAGES)):
            seen = describe(gradients[STAGES[stage]], places, REACHES[STAGES[stage]])
            results = (seen @ self.weights[stage, :-1] + self.weights[stage, -1]) * self.scales[stage]
            places = places + (results @ self.bases[stage]).reshape(-1, 2)
        seen = describe(gradients[-1], places, REACHES[-1])
        return places, float(seen @ self.likeness[:-1] + self.likeness[-1])


@cache
def features() -> Features:
    """Return the features that come with the package."""
    with as_file(files(__package__) / "front_features.npz") as path, np.load(path) as content:
        single = ("weights", "scales", "bases", "likeness")
        return Features(
            **{name: content[name].astype("f4" if name in single else "f8") for name in content.files}
        )


def gradient_sums(face: Float64, reach: float) -> Float32:
    """Return sums (4, H, W) of gradients right, left, down and up around each pixel, contrast evened."""
    down, right = np.gradient(gaussian_filter(face, reach / 2))
    strength = np.sqrt(gaussian_filter(right**2 + down**2, 5 * reach)) + 0.002
    parts = (right, -right, down, -down)
    sums = [gaussian_filter(np.maximum(part, 0), 0.75 * reach) / strength for part in parts]
    return np.array(sums, dtype=np.float32)


def describe(sums: Float32, places: Float64, reach: float) -> Float32:
    """Return the square roots of `gradient_sums` in a grid around places (P, 2): (4 * P * 16,)."""
    steps = (np.arange(CELLS) - (CELLS - 1) / 2) * 2 * reach
    cells = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    at = (places[:, None] + cells).reshape(-1, 2)
    height, width = sums.shape[1:]
    x, y = np.clip(at[:, 0], 0, width - 1.001), np.clip(at[:, 1], 0, height - 1.001)
    i, j = x.astype(int), y.astype(int)
    a, b = (x - i).astype(np.float32), (y - j).astype(np.float32)
    above = sums[:, j, i] * (1 - a) + sums[:, j, i + 1] * a
    below = sums[:, j + 1, i] * (1 - a) + sums[:, j + 1, i + 1] * a
    return np.asarray(np.sqrt(above * (1 - b) + below * b).ravel())


def standard_frame(places: Float64, mean: Float64) -> tuple[Float64, Float64]:
    """Return (middle, across) of a face of standard size: the mean (P, 2) lies best on places (P, 2) in it.

    By least squares over shift, turn and size; as `standard_face` takes them.
    """
    a, b = mean - mean.mean(axis=0), places - places.mean(axis=0)
    right = np.array([(a * b).sum(), (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()]) / (a**2).sum()
    x, y = np.array(MIDDLE) - mean.mean(axis=0)
    return places.mean(axis=0) + x * right + y * np.array([-right[1], right[0]]), right * EYES


def luminance(pixels: UInt8) -> Float64:
    """Return the brightness (H, W), 0 to 1, of a picture (H, W, 3), as its file stores it."""
    return np.asarray(pixels @ np.array([0.299, 0.587, 0.114]) / 255)


def even(grey: Float64, reach: float) -> Float64:
    """Return a picture with the same brightness and contrast everywhere, over this many pixels."""
    low = grey - gaussian_filter(grey, reach)
    return np.asarray(low / (np.sqrt(gaussian_filter(low**2, reach)) + 0.02))


def standard_face(grey: Float64, middle: Float64, across: Float64) -> Float64:
    """Return a face cut out at standard size, upright: (200, 176).

    middle: (2,), x and y between the eyes. across: (2,), from the right pupil to the left one, pixels.
    """
    height, width = FACE_SIZE
    step = np.asarray(across) / EYES
    down = np.array([-step[1], step[0]])
    x, y = np.meshgrid(np.arange(width) - MIDDLE[0], np.arange(height) - MIDDLE[1])
    at = middle + x[..., None] * step + y[..., None] * down
    blur = max(float(np.hypot(*step)) - 1, 0) * 0.5
    corners = at.reshape(-1, 2)
    low = np.clip(np.floor(corners.min(axis=0) - 4 * blur - 1), 0, np.array(grey.shape[::-1]) - 1).astype(int)
    high = np.ceil(np.maximum(corners.max(axis=0) + 4 * blur + 2, low + 1)).astype(int)
    near = grey[low[1] : high[1], low[0] : high[0]]
    smooth = gaussian_filter(near, blur, mode="nearest") if blur > 0.2 else near
    at = at - low
    return np.asarray(map_coordinates(smooth, [at[..., 1], at[..., 0]], order=1, mode="nearest"))


def to_standard(places: Float64, middle: Float64, across: Float64) -> Float64:
    """Return places (..., 2) of a picture in its face of standard size."""
    step = np.asarray(across) / EYES
    size = float(step @ step)
    off = places - middle
    x = off @ step / size
    y = off @ np.array([-step[1], step[0]]) / size
    return np.stack([x, y], axis=-1) + MIDDLE


def from_standard(places: Float64, middle: Float64, across: Float64) -> Float64:
    """Return places (..., 2) of a face of standard size in its picture."""
    step = np.asarray(across) / EYES
    off = np.asarray(places) - MIDDLE
    return np.asarray(middle + off[..., :1] * step + off[..., 1:] * np.array([-step[1], step[0]]))


def correlate(picture: Floating, kernel: Floating) -> Float64:
    """Return the sums of products (H, W) of a kernel with the picture around each pixel."""
    return np.asarray(fftconvolve(picture, kernel[::-1, ::-1].conj(), mode="same"))


def windows(picture: Float64, shape: tuple[int, int]) -> tuple[Float64, Float64]:
    """Return the mean (H, W) of the window around each pixel, and the length of its difference from that."""
    ones = np.ones(shape)
    count = shape[0] * shape[1]
    mean = correlate(picture, ones) / count
    square = correlate(picture**2, ones)
    return mean, np.sqrt(np.maximum(square - count * mean**2, 1e-6 * count))


def subspace(picture: Float64, mean: Float64, vectors: Float64) -> tuple[Float64, Float64]:
    """Return (correlation, distance from the feature space) of the window around each pixel, each (H, W).

    mean: (S, T), of windows of mean 0 and length 1. vectors: (K, S, T), orthonormal, of mean 0.
    """
    _, length = windows(picture, mean.shape)
    along = correlate(picture, mean) / length
    size = float((mean**2).sum())
    distance = 1 + size - 2 * along
    for vector in vectors:
        distance -= (correlate(picture, vector) / length - float((vector * mean).sum())) ** 2
    return along / max(np.sqrt(size), 1e-9), np.maximum(distance, 0.0)


def whole_face(face: Float64) -> Float64:
    """Return the part of an evened face of standard size that the template of a whole face shows, small."""
    beside, above, below = WHOLE
    x = MIDDLE[0] + SMALL * np.arange(-beside, beside + 1)
    y = MIDDLE[1] + SMALL * np.arange(-above, below + 1)
    smooth = gaussian_filter(face, SMALL / 2)
    return np.asarray(map_coordinates(smooth, np.meshgrid(y, x, indexing="ij"), order=1, mode="nearest"))


def unit(patch: Float64) -> Float64:
    off = patch - patch.mean()
    return np.asarray(off / max(float(np.linalg.norm(off)), 1e-9))
