"""How different two pictures look: CIEDE2000, finely, in spots, and over broad areas.

Where edges lie differs by a fraction of a pixel from one OpenGL driver to the next, so pictures are blurred
by about a pixel before they are compared. What remains is judged by its mean and its 99th percentile. Two
things hide in these: a change in one small place, which more blur tells from an edge that moved; and light
that is off by a few hundredths, which the median of a neighbourhood shows, as edges do not count in it.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Float64 = npt.NDArray[np.float64]
UInt8 = npt.NDArray[np.uint8]

FINE, SPOT = 0.8, 2.0
"""Standard deviations of the blurs, pixels."""
AROUND = 7
"""Half the side of a broad area, pixels."""
MOST_MEAN, MOST_PERCENTILE, MOST_SPOT, MOST_BROAD = 0.4, 3.0, 7.0, 0.6
"""What is passed. Measured on the references: noise of a step in every value gives at most 0.31, 0.9, 1.2
and 0.11; all edges moved by a twentieth of a pixel 0.25, 2.5, 4.9 and 0.5; Mesa's softpipe, a rasteriser of
its own, 0.13, 2.3, 5.4 and 0.15. A missing eye gives a spot of 11, light brighter by 3 % in a third of the
picture 0.78 in broad areas."""
CHEQUERS = 6
"""Pixels a square of the board that transparent pictures are laid on."""


@dataclass(frozen=True)
class Difference:
    """Colour differences: 1 is about what one just sees. broad is of lightness (L*) alone."""

    mean: float
    percentile: float
    spot: float
    broad: float

    @property
    def alike(self) -> bool:
        """Whether one would take the pictures for the same."""
        return (
            self.mean <= MOST_MEAN
            and self.percentile <= MOST_PERCENTILE
            and self.spot <= MOST_SPOT
            and self.broad <= MOST_BROAD
        )

    def __str__(self) -> str:
        return (
            f"mean {self.mean:.2f} (at most {MOST_MEAN}), 99th percentile {self.percentile:.2f} (at most "
            f"{MOST_PERCENTILE}), spot {self.spot:.2f} (at most {MOST_SPOT}), broad areas {self.broad:.2f} "
            f"(at most {MOST_BROAD})"
        )


def difference(one: UInt8, other: UInt8) -> Difference:
    """Of pictures uint8 (H, W, 3 or 4), sRGB, of one size; ValueError for two."""
    if one.shape[:2] != other.shape[:2]:
        raise ValueError(f"pictures of {one.shape[1::-1]} and {other.shape[1::-1]} pixels")
    from scipy.ndimage import median_filter

    light = [_linear(laid_on_chequers(picture)) for picture in (one, other)]
    colours = [lab(blurred(picture, FINE)) for picture in light]
    fine = ciede2000(*colours)
    spot = ciede2000(*(lab(blurred(picture, SPOT)) for picture in light))
    lighter = (colours[0] - colours[1])[::2, ::2, 0]
    broad = np.abs(median_filter(lighter, AROUND))
    return Difference(
        float(fine.mean()), float(np.percentile(fine, 99)), float(spot.max()), float(broad.max())
    )


def laid_on_chequers(picture: UInt8) -> Float64:
    """(H, W, 3), 0..1: what is transparent shows a board of dark and light squares."""
    colour = picture[..., :3] / 255
    if picture.shape[2] == 3:
        return np.asarray(colour)
    rows, columns = np.indices(picture.shape[:2]) // CHEQUERS
    board = np.where((rows + columns) % 2, 0.75, 0.45)[..., None]
    opaque = picture[..., 3:] / 255
    return np.asarray(colour * opaque + board * (1 - opaque))


def blurred(picture: Float64, sigma: float) -> Float64:
    """Through a Gaussian; edges go on as they are."""
    from scipy.ndimage import gaussian_filter1d

    down = gaussian_filter1d(picture, sigma, axis=0, mode="nearest")
    across: Float64 = gaussian_filter1d(down, sigma, axis=1, mode="nearest")
    return across


def _linear(picture: Float64) -> Float64:
    return np.where(picture <= 0.04045, picture / 12.92, ((picture + 0.055) / 1.055) ** 2.4)


def lab(light: Float64) -> Float64:
    """Linear sRGB (..., 3) as CIE L*a*b* under D65 (IEC 61966-2-1, CIE 15)."""
    matrix = np.array([
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ])  # fmt: skip
    ratio = light @ matrix.T / matrix.sum(axis=1)
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    x, y, z = np.moveaxis(f, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def ciede2000(one: Float64, other: Float64) -> Float64:
    """Colour difference of L*a*b* colours (..., 3): CIE 142-2001, all weights 1."""
    (l1, a1, b1), (l2, a2, b2) = (np.moveaxis(colour, -1, 0) for colour in (one, other))
    mean = ((np.hypot(a1, b1) + np.hypot(a2, b2)) / 2) ** 7
    grey = 0.5 * (1 - np.sqrt(mean / (mean + 25.0**7)))
    a1, a2 = a1 * (1 + grey), a2 * (1 + grey)
    c1, c2 = np.hypot(a1, b1), np.hypot(a2, b2)
    h1, h2 = np.arctan2(b1, a1) % (2 * np.pi), np.arctan2(b2, a2) % (2 * np.pi)
    colourless = c1 * c2 == 0
    turn = np.where(colourless, 0.0, (h2 - h1 + np.pi) % (2 * np.pi) - np.pi)
    hue = 2 * np.sqrt(c1 * c2) * np.sin(turn / 2)
    middle = np.where(colourless, h1 + h2, h1 + turn / 2)
    chroma, level = (c1 + c2) / 2, (l1 + l2) / 2
    degrees = np.degrees(middle) % 360
    t = (
        1
        - 0.17 * np.cos(middle - np.pi / 6)
        + 0.24 * np.cos(2 * middle)
        + 0.32 * np.cos(3 * middle + np.radians(6))
        - 0.20 * np.cos(4 * middle - np.radians(63))
    )
    by_level = 1 + 0.015 * (level - 50) ** 2 / np.sqrt(20 + (level - 50) ** 2)
    by_chroma, by_hue = 1 + 0.045 * chroma, 1 + 0.015 * chroma * t
    rotated = -2 * np.sqrt(chroma**7 / (chroma**7 + 25.0**7))
    rotated = rotated * np.sin(np.radians(60 * np.exp(-(((degrees - 275) / 25) ** 2))))
    lightness, saturation, tone = (l2 - l1) / by_level, (c2 - c1) / by_chroma, hue / by_hue
    squares = lightness**2 + saturation**2 + tone**2 + rotated * saturation * tone
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))
