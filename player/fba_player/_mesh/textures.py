"""Textures of faces: pictures in PNG, JPEG or WebP, how large they lie on a mesh, and the relief of skin.

Decoding a picture takes a tenth of a second, so the reduced sizes that screens show are cached on disk.
"""

from __future__ import annotations

import contextlib
import io
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from fba.arrays import Float32, Float64, Int32, UInt8
from fba.cache import load_or_make, make_key
from fba.limits import DEFAULT_LIMITS, Limits

MAX_PICTURE_SIZE = 4096
"""Pixels to which wider or higher pictures are scaled down."""
PIXEL_BYTES = 4
"""Memory of a decoded pixel."""
SCALED_BYTES = 8
"""Memory of a pixel while the picture is scaled down."""
COEFFICIENT_BYTES = 6
"""Memory of the coefficients of a pixel of a progressive JPEG."""
BAND_ROWS = 256
"""Rows that are converted at once."""
MIN_CACHED_BYTES = 100_000
"""Files of at least this many bytes are cached on disk when reduced."""
CACHE_VERSION = 2
"""Cache version of pictures; increment when `FacePicture` gives other pixels or measures."""

RELIEF_SIZE = 256
RELIEF = 0.022
"""Metres after which the skin's relief repeats."""
NOISE_BANDS = ((3.0, 0.35), (9.0, 0.7), (26.0, 1.0), (60.0, 0.6))
"""Bands of the relief's noise: grains across the picture, and their weights."""
NOISE_DEVIATION = 0.17
"""Standard deviation of a channel of the relief, as a share of its range."""
RELIEF_CACHE_VERSION = 1
"""Cache version of the relief; increment when `skin_relief` gives other pixels."""


@dataclass(frozen=True, eq=False)
class FacePicture:
    """A texture; see `load_picture`.

    data: the bytes of a PNG, JPEG or WebP file. size: width and height. opaque: whether alpha is 255
    everywhere.
    """

    data: bytes
    size: tuple[int, int]
    opaque: bool

    @property
    def pixels(self) -> UInt8:
        """uint8 (H, W, 4), sRGB and alpha, decoded on every access."""
        return _decode(self.data)

    def reduced(self, factor: int) -> UInt8:
        """Return uint8 (h, w, 4): reduced by `factor`, as square roots of linear light, and alpha."""
        if factor < 2 or len(self.data) < MIN_CACHED_BYTES:
            return _reduced(self.pixels, factor)
        width, height = (-(-across // factor) for across in self.size)
        key = make_key("texture", CACHE_VERSION, factor, np.frombuffer(self.data, dtype=np.uint8))
        shape = (height, width, 4)
        return load_or_make(key, (shape,), lambda: [_reduced(self.pixels, factor)], np.uint8)[0]


def load_picture(data: bytes, *, limits: Limits = DEFAULT_LIMITS) -> FacePicture:
    """Return the picture in the bytes of a PNG, JPEG or WebP file.

    Raises OSError, ValueError or SyntaxError if it cannot be read, LimitError if it has more pixels, or takes
    more memory for its bytes, than the limits allow.
    """
    _check_size(data, limits)

    def measure() -> list[Int32]:
        """Return the width, height, and 1 if it is opaque."""
        pixels = _decode(data)
        height, width = pixels.shape[:2]
        return [np.array([width, height, (pixels[..., 3] == 255).all()], dtype=np.int32)]

    if len(data) < MIN_CACHED_BYTES:
        (measures,) = measure()
    else:
        key = make_key("picture", CACHE_VERSION, np.frombuffer(data, dtype=np.uint8))
        (measures,) = load_or_make(key, ((3,),), measure, np.int32)
        if measures.min() < 0 or measures.max() > MAX_PICTURE_SIZE:
            (measures,) = measure()
    return FacePicture(data, (int(measures[0]), int(measures[1])), bool(measures[2]))


def _check_size(data: bytes, limits: Limits) -> None:
    """Raise LimitError for a picture that is too large to be decoded."""
    with _opened(data) as image:
        width, height = image.size
        what = f"the picture of a texture, {width} x {height} pixels,"
        limits.check_pixels(width, height, "the picture of a texture")
        if image.info.get("progressive"):  # reduced only after all of it was decoded
            needed = width * height * COEFFICIENT_BYTES
        else:
            _prepare(image)
            scaled = max(image.size) > MAX_PICTURE_SIZE
            needed = image.width * image.height * (SCALED_BYTES if scaled else PIXEL_BYTES)
        limits.check_bytes(needed, what, source=len(data))


@contextlib.contextmanager
def _opened(data: bytes) -> Iterator[Any]:
    """The `PIL.Image` in the bytes of a file, not decoded yet. `Limits` say how large it may be, not PIL."""
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            image = Image.open(io.BytesIO(data), formats=("PNG", "JPEG", "WEBP"))
    except Image.DecompressionBombError as error:
        raise ValueError(str(error)) from error
    with image:
        yield image


def _prepare(image: Any) -> None:
    """Let a large JPEG be decoded at half its size or less."""
    if max(image.size) > MAX_PICTURE_SIZE:
        least = MAX_PICTURE_SIZE * 9 // 10  # so that one of 8000 pixels becomes one of 4000
        image.draft("RGB", (least, least))


def _decode(data: bytes) -> UInt8:
    """Return uint8 (H, W, 4): the pixels of a file, at most `MAX_PICTURE_SIZE` wide and high."""
    with _opened(data) as image:
        _prepare(image)
        if max(image.size) > MAX_PICTURE_SIZE:
            image.thumbnail((MAX_PICTURE_SIZE, MAX_PICTURE_SIZE))
        pixels = np.empty((image.height, image.width, 4), dtype=np.uint8)
        for top in range(0, image.height, BAND_ROWS):  # a whole copy in RGBA would double the memory
            rows = image.crop((0, top, image.width, min(top + BAND_ROWS, image.height)))
            pixels[top : top + BAND_ROWS] = np.asarray(rows.convert("RGBA"))
        return pixels


def _reduced(pixels: UInt8, factor: int) -> UInt8:
    from PIL import Image

    image = Image.fromarray(pixels)
    if factor > 1:
        image = image.reduce(factor)
    return np.asarray(image.point([*_roots()] * 3 + list(range(256))))


@cache
def _roots() -> tuple[int, ...]:
    """Return the table from sRGB codes to square roots of linear light, 0..255."""
    return tuple(int(v) for v in np.round(255 * np.sqrt(linear_light(np.arange(256) / 255))))


def linear_light(srgb: Float64) -> Float64:
    """Return linear light of values in sRGB, both 0..1."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def texture_breadth(positions: Float32, texcoords: Float32, triangles: Int32) -> float:
    """Return the metres that the width of a texture covers on a mesh (a median); 0 if it covers nothing."""
    if not len(triangles):
        return 0.0
    corners, flat = positions[triangles], texcoords[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    a, b = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    spread = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    laid = spread > 1e-9
    return float(np.sqrt(np.median(area[laid] / spread[laid]))) if laid.any() else 0.0


def skin_relief() -> UInt8:
    """Return uint8 (256, 256, 3): the fine relief of skin, three channels of repeating noise around 128.

    From pores to the coarser grain seen from further away; always the same, stored in the disk cache.
    """
    key = make_key("relief", RELIEF_CACHE_VERSION, RELIEF_SIZE, NOISE_DEVIATION, NOISE_BANDS)
    return load_or_make(key, ((RELIEF_SIZE, RELIEF_SIZE, 3),), lambda: [_make_relief()], np.uint8)[0]


def _make_relief() -> UInt8:
    random = np.random.default_rng(20)
    along = np.fft.fftfreq(RELIEF_SIZE, 1 / RELIEF_SIZE)
    distance = np.hypot(along[:, None], along[None])
    bands = sum(
        share * np.exp(-(((distance - grains) / (0.45 * grains)) ** 2)) / grains
        for grains, share in NOISE_BANDS
    )
    white = np.fft.fft2(random.standard_normal((3, RELIEF_SIZE, RELIEF_SIZE)))
    noise = np.real(np.fft.ifft2(white * bands))
    noise /= noise.std(axis=(1, 2), keepdims=True)
    pixels = np.clip(127.5 + 255 * NOISE_DEVIATION * noise, 0, 255).astype(np.uint8)
    return np.ascontiguousarray(pixels.transpose(1, 2, 0))
