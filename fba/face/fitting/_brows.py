"""Brows followed as dark ridges above the lids: their ends, and the top of their upper edge."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter, gaussian_filter1d, map_coordinates
from scipy.special import expit

from fba.arrays import Float64, Intp
from fba.face.fitting._features import LUMINANCE, features
from fba.face.fitting._points_file import FRONT_POINTS

BROWS = (("4.1", "4.3", "4.5"), ("4.2", "4.4", "4.6"))
"""Inner end, highest point and outer end of each brow."""
EYES = (("3.5", "3.1"), ("3.6", "3.2"))
"""Pupil and upper lid below each brow."""
TRUST = np.array([[0.1, 0.6], [0.5, 0.3], [0.1, 0.3]])
"""How far these three go sideways and up to what the ridge shows; chosen on rendered heads from which nothing
was learned, like `SPREAD` and `LASHES`."""
COLUMNS, BEYOND = 40, 0.15
"""Columns that are looked at, and shares of the brow's length beyond its ends."""
UP, DOWN = 16, 23
"""Pixels of a face of standard size above and below the middle between the brow that was found and the usual
one above the pupil."""
USUAL, SPREAD = 4.0, 7.0
"""Pixels below that line where the ridge usually is, and by which that differs."""
LASHES = 4.0
"""Pixels above the upper lid up to which dark is lashes or a fold."""
BLACK = 0.03
"""Brightness that is added before logarithms are taken: dark noise is no brow."""
HUE = 0.5
"""How much another colour than the skin's counts beside darkness: brows may be as bright, but are not as red.
Chosen like `TRUST`."""
STEP = 0.06
"""What a pixel up or down from column to column costs, in shares of the strongest ridge."""
FAINT = 0.4
"""The brow ends where it is fainter than this share of its middle's median."""
NONE = 0.002
"""Curvature of the logarithm of brightness below which no brow is seen."""
LEAST = 12
"""Columns that a brow has at least."""


def follow_brows(face: Float64, places: Float64) -> Float64:
    """Return points (P, 2) in a face of standard size, those of the brows moved towards what it shows.

    face: (3, H, W), red, green and blue, 0 to 1.
    """
    result, mean = places.copy(), features().mean
    smooth = np.log(np.maximum(gaussian_filter(face, (0.0, 1.0, 1.0)), 0) + BLACK)
    for names, eye in zip(BROWS, EYES, strict=True):
        rows = [FRONT_POINTS.index(name) for name in names]
        pupil, lid = (FRONT_POINTS.index(name) for name in eye)
        line = _line(*(places[rows] + mean[rows] - mean[pupil] + places[pupil]) / 2)
        down = np.arange(-UP, DOWN)
        x, y = np.broadcast_arrays(line[:, :1], line[:, 1:] + down)
        strip = _skin_likeness(
            np.stack([map_coordinates(one, [y, x], order=1, mode="nearest") for one in smooth])
        )
        ridge = np.maximum(gaussian_filter1d(strip, 2.0, axis=1, order=2), 0)
        ridge *= expit(places[lid, 1] - LASHES - y)
        ridge = gaussian_filter1d(ridge, 1.5, axis=0) * np.exp(-(((down - USUAL) / SPREAD) ** 2) / 2)
        if ridge.max() < NONE:
            continue
        path = _strongest_path(ridge / (ridge.max() + 1e-9))
        strength = ridge[np.arange(COLUMNS), path]
        dark = np.flatnonzero(strength > FAINT * np.median(strength[8:32]))
        run = max(np.split(dark, np.flatnonzero(np.diff(dark) > 2) + 1), key=len)
        if len(run) < LEAST:
            continue
        slope = gaussian_filter1d(strip, 1.0, axis=1, order=1)
        edge = [at - int(slope[k, max(at - 7, 0) : at + 1][::-1].argmin()) for k, at in enumerate(path)]
        upper = np.column_stack([line[:, 0], gaussian_filter1d(line[:, 1] + down[edge], 1.5)])
        inner, outer, top = run[0], run[-1], run[upper[run, 1].argmin()]
        tip = line[outer] + (0, down[path[outer]])
        result[rows] += TRUST * (np.array([upper[inner], upper[top], tip]) - places[rows])
    return result


def _skin_likeness(colours: Float64) -> Float64:
    """Return how bright and like the skin places (...) are, from the logarithms (3, ...) of their colours."""
    shades = colours[::2] - colours[1]
    usual = np.median(shades, axis=(1, 2), keepdims=True)
    return np.asarray(np.tensordot(LUMINANCE, colours, 1) - HUE * np.linalg.norm(shades - usual, axis=0))


def _line(inner: Float64, top: Float64, outer: Float64) -> Float64:
    """Return (COLUMNS, 2): a parabola through three points, and some way beyond its ends."""
    along = np.linspace(-BEYOND, 1 + BEYOND, COLUMNS)[:, None]
    middle = np.clip((top[0] - inner[0]) / (outer[0] - inner[0] + 1e-9), 0.25, 0.75)
    lift = top - inner - (outer - inner) * middle
    bend = along * (1 - along) / (middle * (1 - middle))
    return np.asarray(inner + (outer - inner) * along + lift * np.clip(bend, -0.3, 1))


def _strongest_path(strength: Float64) -> Intp:
    """Return (N,) the row in each of N columns (N, R) of the strongest path from the first to the last."""
    count, rows = strength.shape
    total, before = strength.copy(), np.zeros((count, rows), dtype=np.intp)
    steps = np.arange(-2, 3)
    for k in range(1, count):
        padded = np.pad(total[k - 1], 2, constant_values=-np.inf)
        coming = np.stack([padded[2 - step : 2 - step + rows] for step in steps]) - STEP * abs(steps)[:, None]
        best = coming.argmax(axis=0)
        before[k] = np.arange(rows) - steps[best]
        total[k] += coming[best, np.arange(rows)]
    path = np.full(count, total[-1].argmax())
    for k in range(count - 1, 0, -1):
        path[k - 1] = before[k, path[k]]
    return path
