"""Features of faces: what the surroundings of each point look like, learned from rendered faces.

The steps are those of Karpouzis, section 7.3: regions by anthropometry, templates (normalised correlation),
phases of Gabor filters in four directions, and eigenfeatures (distance from the space of the first two
eigenvectors). `learn` makes them; `tools/photos/learn_features.py` runs it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import as_file, files

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.signal import fftconvolve

from fba.arrays import Float64, Floating, UInt8
from fba.face.feature_points import MIRRORED
from fba.parameters import point_rows

EYES = 44.0
"""Pixels between the pupils in a face of standard size."""
FACE_SIZE = (200, 176)
"""Height and width of a face of standard size, pixels; the middle of the eyes is at `MIDDLE`."""
MIDDLE = (88.0, 70.0)
"""x and y of the middle of the eyes in a face of standard size."""
PATCH = 12
"""Pixels from the middle of a template to its edge."""
EIGENVECTORS = 2
SMALL = 4.0
"""Factor by which the template of a whole face is smaller."""
WHOLE = (14, 9, 20)
"""Beside, above and below the middle of the eyes: what the whole face's template shows, small pixels."""
WHOLE_VECTORS = 4
DIRECTIONS = 4
WAVELENGTH = 11.0
LOCAL = 14.0
"""Pixels over which brightness and contrast are evened."""

WHOLE_LOCAL = 28.0
"""The same for the template of the whole face."""

CENTRAL = ("9.3", "9.15", "8.1", "8.2", "2.2", "2.10", "2.1")
LEFT = ("3.5", "3.7", "3.11", "3.1", "3.3", "4.1", "4.3", "4.5", "9.1", "8.3", "8.5", "8.7")
POINTS = (*CENTRAL, *LEFT, *(MIRRORED[name] for name in LEFT))
"""Points with a template of their own; those of the right side are mirror images."""


@dataclass(frozen=True, eq=False)
class Features:
    """What points look like, by name (C of them, central and left): see `learn`.

    places, spreads: (C, 2), where points are in a face of standard size relative to the middle of the eyes,
    and their standard deviation, pixels. means: (C, S, S), templates. vectors: (C, 2, S, S), eigenvectors.
    phases: complex (C, 4), mean responses of Gabor filters, of length 1 where all faces agree. whole: (1 + 4,
    H, W), the template of the whole small face and its eigenvectors.
    """

    places: Float64
    spreads: Float64
    means: Float64
    vectors: Float64
    phases: np.ndarray
    whole: Float64

    def of(self, name: str) -> tuple[int, bool]:
        """Return the number of a point's feature, and whether it is its mirror image."""
        names = (*CENTRAL, *LEFT)
        if name in names:
            return names.index(name), False
        return names.index(next(left for left, right in MIRRORED.items() if right == name)), True

    def place(self, name: str) -> tuple[Float64, Float64]:
        """Return a point's mean place from the middle of the eyes and its standard deviation, pixels (2,)."""
        number, mirrored = self.of(name)
        sign = np.array([-1.0 if mirrored else 1.0, 1.0])
        return self.places[number] * sign, self.spreads[number]


@cache
def features() -> Features:
    """Return the features that come with the package."""
    with as_file(files(__package__) / "front_features.npz") as path, np.load(path) as content:
        arrays = {name: content[name].astype(np.float64) for name in content.files if name != "phases"}
        phases = content["phases"][..., 0].astype(float) + 1j * content["phases"][..., 1]
    return Features(**arrays, phases=phases)


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
    smooth = gaussian_filter(grey, blur) if blur > 0.2 else grey
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


@cache
def gabor_filters() -> np.ndarray:
    """Return the complex Gabor filters (4, 25, 25): exp(-(x^2 + y^2) / 2 s^2) exp(j (u x + v y))."""
    reach = int(WAVELENGTH)
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    bell = np.exp(-(x**2 + y**2) / (2 * (WAVELENGTH / 2.2) ** 2))
    filters = []
    for k in range(DIRECTIONS):
        angle = np.pi * k / DIRECTIONS
        wave = np.exp(2j * np.pi / WAVELENGTH * (np.cos(angle) * x + np.sin(angle) * y))
        one = bell * (wave - (bell * wave).sum() / bell.sum())
        filters.append(one / np.abs(one).sum())
    return np.array(filters)


def gabor(picture: Float64) -> np.ndarray:
    """Return the complex responses (4, H, W) of Gabor filters in four directions."""
    return np.array([fftconvolve(picture, one[::-1, ::-1], mode="same") for one in gabor_filters()])


def phase_distance(responses: np.ndarray, phases: np.ndarray) -> Float64:
    """Return how far the phases of responses (4, H, W) are from a prototype's (4,): 0 to 2, (H, W)."""
    weight = np.abs(phases)[:, None, None] + 1e-9
    unit = responses / (np.abs(responses) + 1e-4)
    agree = (unit * (phases / (np.abs(phases) + 1e-9)).conj()[:, None, None]).real
    return np.asarray(1 - (weight * agree).sum(axis=0) / weight.sum(axis=0))


def mirror_phases(phases: np.ndarray) -> np.ndarray:
    """Return the prototype (4,) of a feature's mirror image: waves across change direction, so do phases."""
    result = phases.copy()
    # The wave at an angle a runs, mirrored, at pi - a: cos changes its sign, which is the conjugate of -a.
    result[0] = phases[0].conj()
    for k in range(1, DIRECTIONS):
        result[k] = phases[DIRECTIONS - k]
    return result


def learn(pictures: list[UInt8], points: Float64) -> dict[str, np.ndarray]:
    """Return the arrays of `Features` from pictures of faces with known points (N, 84, 2), pixels."""
    row = point_rows()
    names = (*CENTRAL, *LEFT)
    places: list[list[Float64]] = [[] for _ in names]
    patches: list[list[Float64]] = [[] for _ in names]
    waves: list[list[np.ndarray]] = [[] for _ in names]
    wholes = []
    for pixels, at in zip(pictures, points, strict=True):
        grey = luminance(pixels)
        for mirrored in (False, True):
            here = grey[:, ::-1] if mirrored else grey
            shown = at * (-1, 1) + (grey.shape[1] - 1, 0) if mirrored else at
            first, second = (
                (shown[row["3.6"]], shown[row["3.5"]]) if mirrored else (shown[row["3.5"]], shown[row["3.6"]])
            )
            middle, across = (first + second) / 2, first - second
            plain = standard_face(here, middle, across)
            face = even(plain, LOCAL)
            responses = gabor(face)
            wholes.append(_unit(_whole(even(plain, WHOLE_LOCAL))))
            for number, name in enumerate(names):
                seen = MIRRORED.get(name, name) if mirrored else name
                place = to_standard(shown[row[seen]], middle, across)
                places[number].append(place - MIDDLE)
                patches[number].append(_unit(_cut(face, place)))
                spot = [
                    map_coordinates(one, [[place[1]], [place[0]]], order=1, mode="nearest")[0]
                    for one in responses
                ]
                waves[number].append(np.array([z / (abs(z) + 1e-9) for z in spot]))
    means = [np.mean(one, axis=0) for one in patches]
    vectors = [_principal(np.array(one), EIGENVECTORS) for one in patches]
    phases = np.array([np.mean(one, axis=0) for one in waves])
    whole = np.concatenate([np.mean(wholes, axis=0)[None], _principal(np.array(wholes), WHOLE_VECTORS)])
    return {
        "places": np.array([np.mean(one, axis=0) for one in places], dtype=np.float32),
        "spreads": np.array([np.std(one, axis=0) for one in places], dtype=np.float32),
        "means": np.array(means, dtype=np.float16),
        "vectors": np.array(vectors, dtype=np.float16),
        "phases": np.stack([phases.real, phases.imag], axis=-1).astype(np.float32),
        "whole": whole.astype(np.float16),
    }


def _whole(face: Float64) -> Float64:
    """Return the part of an evened face of standard size that the template of a whole face shows, small."""
    beside, above, below = WHOLE
    x = MIDDLE[0] + SMALL * np.arange(-beside, beside + 1)
    y = MIDDLE[1] + SMALL * np.arange(-above, below + 1)
    smooth = gaussian_filter(face, SMALL / 2)
    return np.asarray(map_coordinates(smooth, np.meshgrid(y, x, indexing="ij"), order=1, mode="nearest"))


def _cut(face: Float64, place: Float64) -> Float64:
    steps = np.arange(-PATCH, PATCH + 1)
    return np.asarray(
        map_coordinates(
            face, np.meshgrid(place[1] + steps, place[0] + steps, indexing="ij"), order=1, mode="nearest"
        )
    )


def _unit(patch: Float64) -> Float64:
    off = patch - patch.mean()
    return np.asarray(off / max(float(np.linalg.norm(off)), 1e-9))


def _principal(patches: Float64, count: int) -> Float64:
    """Return the first eigenvectors (count, S, T) of the covariance of patches (N, S, T)."""
    flat = patches.reshape(len(patches), -1)
    _, _, vectors = np.linalg.svd(flat - flat.mean(axis=0), full_matrices=False)
    return np.asarray(vectors[:count].reshape(count, *patches.shape[1:]))
