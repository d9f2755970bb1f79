"""What faces look like, learned from rendered ones: the whole face, and how its points are found.

A whole face is found by a template of gradients (N. Dalal and B. Triggs, "Histograms of oriented gradients",
2005), its points by a cascade of linear regressions on gradients (X. Xiong and F. De la Torre, "Supervised
descent method", 2013). The templates with eigenvectors of Karpouzis, section 7.3, of the whole face and of
single points, his Gabor phases, and his darkest column and row for the pupils missed more.
`tools/photos/learn_features.py` makes the data.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import as_file, files

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.signal import fftconvolve

from fba.arrays import Float32, Float64, UInt8

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
REACHES = (4.0, 2.0)
"""Pixels over which gradients are summed, coarse and fine."""
STAGES = (0, 0, 1, 1, 1)
"""Reach, as a number in `REACHES`, of each regression of the cascade."""
LUMINANCE = np.array([0.299, 0.587, 0.114])
"""Shares of red, green and blue in brightness."""
CELLS = 4
"""Sums of gradients along each side of a square around a point."""


@dataclass(frozen=True, eq=False)
class Features:
    """What faces look like. P: points, those of `FRONT_POINTS`; D: numbers that describe all surroundings.

    mean: (P, 2), where points are in a face of standard size, pixels. weights: (5, D + 1, K), the
    regressions of the cascade, the constant last; times scales (5, K). bases: (5, K, 2P), the shifts
    of points that the K results stand for. likeness: (D + 1,), the regression of "is a face" (1) or not (-1).
    whole: (4 * H * W + 1,), the regression of "is a face" on the gradients of a whole small face, `WHOLE`.
    """

    mean: Float64
    weights: Float32
    scales: Float32
    bases: Float32
    likeness: Float32
    whole: Float32

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
        single = ("weights", "scales", "bases", "likeness", "whole")
        return Features(
            **{name: content[name].astype("f4" if name in single else "f8") for name in content.files}
        )


def gradient_sums(face: Float64, reach: float) -> Float32:
    """Return sums (4, H, W) of gradients right, left, down and up around each pixel, contrast evened."""
    down, right = np.gradient(gaussian_filter(face.astype(np.float32), reach / 2))
    strength = np.sqrt(gaussian_filter(right**2 + down**2, 5 * reach, truncate=2.0)) + 0.002
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
    return np.asarray(pixels @ LUMINANCE / 255)


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


def small_face(face: Float64) -> Float32:
    """Return `gradient_sums` (4, H, W) of a whole face of standard size, small: what its template shows."""
    height, width = face.shape
    x = np.arange(MIDDLE[0] % SMALL, width - 1, SMALL)
    y = np.arange(MIDDLE[1] % SMALL, height - 1, SMALL)
    smooth = gaussian_filter(face, SMALL / 2)
    small = map_coordinates(smooth, np.meshgrid(y, x, indexing="ij"), order=1, mode="nearest")
    beside, above, below = WHOLE
    column, row = int(MIDDLE[0] // SMALL), int(MIDDLE[1] // SMALL)
    sums = np.sqrt(gradient_sums(small, 1.0))
    return np.asarray(sums[:, row - above : row + below + 1, column - beside : column + beside + 1])


def whole_likeness(small: Float64, whole: Float32) -> Float64:
    """Return how like a face's the surroundings of each pixel are as the middle of the eyes: (H, W).

    small: a picture in which faces have EYES / SMALL pixels between the pupils. whole: as in `Features`.
    """
    beside, above, below = WHOLE
    kernels = whole[:-1].reshape(4, above + below + 1, 2 * beside + 1)
    sides = ((above, below), (beside, beside))
    sums = np.sqrt(gradient_sums(np.pad(small, sides, mode="edge"), 1.0))
    parts = (
        fftconvolve(one, kernel[::-1, ::-1], mode="valid") for one, kernel in zip(sums, kernels, strict=True)
    )
    return np.asarray(sum(parts) + float(whole[-1]), dtype=np.float64)


def unit(patch: Float64) -> Float64:
    off = patch - patch.mean()
    return np.asarray(off / max(float(np.linalg.norm(off)), 1e-9))
