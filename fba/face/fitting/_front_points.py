"""`find_front_points`: the feature points of a face on a frontal photograph.

The whole face is found first; then, from each place like one, a cascade of regressions moves the points of a
mean face to where gradients around them say; pupils last, by their brightness.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter, maximum_filter, zoom

from fba.arrays import Float64, UInt8
from fba.errors import ModelError, warn
from fba.face.fitting._features import (
    EYES,
    SMALL,
    WHOLE,
    WHOLE_LOCAL,
    even,
    features,
    from_standard,
    luminance,
    standard_face,
    standard_frame,
    subspace,
    to_standard,
)
from fba.face.fitting._found import FoundPoints, Step
from fba.face.fitting._photographs import Photograph
from fba.face.fitting._points_file import FRONT_POINTS

LARGEST = 0.5
"""Largest distance between the pupils that is looked for, as a share of the picture's smaller side."""
SMALLEST = 0.035
SIZES = 1.12
"""Ratio of successive sizes."""
FACE_SCORE = 0.0
"""Least likeness to a face; that of faces is about 1, of other things about -1."""
CANDIDATES = 60
"""Places like a whole face whose points are looked at, at most."""
OF_EACH_SIZE = 6
LARGER = 0.05
"""Likeness that a face of twice the size has ahead: portraits show large faces."""
SECOND_FACE = 0.5
"""A second place with this likeness may be another face."""
HARDLY_SEEN = ("2.13", "2.14", "10.9", "10.10", "10.5", "10.6", "11.1")
"""Points that are moved with the others, but not proposed: too little tells where they are."""
TURNS = (-12.0, 0.0, 12.0)
"""Degrees by which the picture is turned while the face is looked for."""
PUPIL = 5
"""Pixels of a face of standard size around a pupil in which it is looked for."""


def find_front_points(photograph: Photograph) -> FoundPoints:
    """Return the feature points of the face on a frontal photograph.

    Raises ModelError where no face is found. Warns (FbaWarning) where there may be several.
    """
    grey = luminance(photograph.pixels)
    middle, across, score, where = _find_face(grey, photograph.name)
    steps = [Step("Where a whole face is most likely", where)]
    mean = features().mean
    face = standard_face(grey, middle, across)
    places, _ = features().follow(face, mean)
    steps.append(Step("From the points of a mean face to those of this one", _draw(face, mean, places)))
    for _ in range(2):
        at = from_standard(places, middle, across)
        middle, across = standard_frame(at, mean)
        face = standard_face(grey, middle, across)
        places, _ = features().follow(face, to_standard(at, middle, across), 2)
    places = _with_pupils(face, places)
    steps.append(Step("The same from there, and pupils by their brightness", _draw(face, None, places)))
    at = from_standard(places, middle, across) * photograph.scale
    found = {name: (float(x), float(y)) for name, (x, y) in zip(FRONT_POINTS, at, strict=True)}
    return FoundPoints(
        {name: place for name, place in found.items() if name not in HARDLY_SEEN}, score, steps
    )


def _find_face(grey: Float64, name: str) -> tuple[Float64, Float64, float, UInt8]:
    """Return (middle of the eyes, right pupil to left one, likeness, picture of it); (2,), (2,) in pixels."""
    height, width = grey.shape
    whole = features().whole
    side = min(height, width)
    best: list[tuple[float, Float64, Float64]] = []
    shown = np.zeros((1, 1))
    for degrees in TURNS:
        eyes = LARGEST * side
        while eyes >= max(SMALLEST * side, EYES / SMALL):
            # The template has EYES / SMALL pixels between the pupils.
            factor = EYES / SMALL / eyes
            if min(height, width) * factor < whole.shape[1] * 0.8:
                eyes /= SIZES
                continue
            small = _turned(_reduced(grey, factor), degrees)
            # The surroundings are evened as in training: over as many pixels of the standard size.
            level = even(np.pad(small, 8, mode="edge"), WHOLE_LOCAL / SMALL)
            along, distance = subspace(level, whole[0], whole[1:])
            likeness = np.clip(along, 0, 1) * np.clip(1 - distance / 2, 0, 1)
            likeness = likeness[8:-8, 8:-8]
            for y, x in _maxima(likeness):
                _, above, below = WHOLE
                # The kernel's middle is not the middle of the eyes: it reaches further down.
                eye = np.array([float(x), float(y) - (below - above) / 2])
                middle, step = _turned_back(eye, small.shape, degrees)
                best.append((float(likeness[y, x]), middle / factor, step * eyes))
            if float(likeness.max()) >= max((one[0] for one in best), default=0.0):
                shown = likeness
            eyes /= SIZES
    if not best:
        raise ModelError(f"{name or 'the picture'}: is too small for a face to be found")
    best.sort(key=lambda one: -one[0])
    candidates = _distinct([one for one in best if _is_inside(one[1], one[2], grey.shape)])
    if not candidates:
        raise ModelError(f"{name or 'the picture'}: no face was found; place its points by hand")
    scored = [(_likeness(grey, place, size), place, size) for _, place, size in candidates]
    scored.sort(key=lambda one: -one[0] - LARGER * np.log2(np.linalg.norm(one[2])))
    score, middle, across = scored[0]
    if score < FACE_SCORE:
        raise ModelError(
            f"{name or 'the picture'}: no face was found that looks at the camera (likeness {score:.2f}, "
            f"at least {FACE_SCORE:g} is needed); place its points by hand"
        )
    for other, place, _ in scored[1:]:
        if other > SECOND_FACE and np.linalg.norm(place - middle) > 2.5 * np.linalg.norm(across):
            warn(
                f"{name or 'the picture'}: there may be a second face near ({place[0]:.0f}, {place[1]:.0f}); "
                "the likelier one is taken. Cut the picture to one face if it is the wrong one",
                stacklevel=3,
            )
            break
    return middle, across, score, _grey_picture(shown / max(float(shown.max()), 1e-9))


def _is_inside(middle: Float64, across: Float64, shape: tuple[int, ...]) -> bool:
    """Whether a face with these eyes, from brows to chin, is inside a picture of this shape."""
    down = np.array([-across[1], across[0]])
    corners = np.array([middle + a * across + b * down for a in (-0.9, 0.9) for b in (-0.6, 1.6)])
    return bool((corners >= 0).all() and (corners <= np.array(shape[1::-1])).all())


def _maxima(likeness: Float64) -> list[tuple[int, int]]:
    """Return rows and columns of the four highest local maxima."""
    peaks = np.argwhere((likeness == maximum_filter(likeness, 5)) & (likeness > 0))
    order = np.argsort(-likeness[tuple(peaks.T)], kind="stable")[:4]
    return [(int(y), int(x)) for y, x in peaks[order]]


def _distinct(
    best: list[tuple[float, Float64, Float64]],
) -> list[tuple[float, Float64, Float64]]:
    """Return the likeliest places of a face that differ in position, size or turn."""
    result: list[tuple[float, Float64, Float64]] = []
    sizes: dict[int, int] = {}
    for one in best:
        size = float(np.linalg.norm(one[2]))
        bucket = round(np.log(size) / np.log(SIZES**2))
        if sizes.get(bucket, 0) < OF_EACH_SIZE and all(
            np.linalg.norm(one[1] - other[1]) > 0.25 * size or np.linalg.norm(one[2] - other[2]) > 0.18 * size
            for other in result
        ):
            result.append(one)
            sizes[bucket] = sizes.get(bucket, 0) + 1
        if len(result) == CANDIDATES:
            break
    return result


def _likeness(grey: Float64, middle: Float64, across: Float64) -> float:
    """Return how like a face's the points are that are found from a place: about 1, or -1 of no face."""
    return features().follow(standard_face(grey, middle, across), features().mean)[1]


def _reduced(grey: Float64, factor: float) -> Float64:
    smooth = gaussian_filter(grey, max(0.5 / factor - 0.3, 0.0)) if factor < 1 else grey
    return np.asarray(zoom(smooth, factor, order=1, grid_mode=True, mode="nearest"))


def _turned(picture: Float64, degrees: float) -> Float64:
    if not degrees:
        return picture
    from scipy.ndimage import rotate

    return np.asarray(rotate(picture, degrees, reshape=False, order=1, mode="nearest"))


def _turned_back(place: Float64, shape: tuple[int, ...], degrees: float) -> tuple[Float64, Float64]:
    """Return where a place (x, y) of a turned picture was before, and the direction to the right there."""
    angle = np.radians(degrees)
    centre = (np.array(shape[::-1]) - 1) / 2
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return turn @ (place - centre) + centre, turn[:, 0]


def _with_pupils(face: Float64, places: Float64) -> Float64:
    """Return places (P, 2) with the pupils at the darkest column and row (integral projections) near them."""
    result = places.copy()
    smooth = gaussian_filter(face, 1.0)
    reach = PUPIL
    for row in (FRONT_POINTS.index("3.5"), FRONT_POINTS.index("3.6")):
        x, y = np.round(places[row]).astype(int)
        window = smooth[y - reach : y + reach + 1, x - reach - 1 : x + reach + 2]
        if window.shape != (2 * reach + 1, 2 * reach + 3):
            continue
        # V(x) = sum of I over y, H(y) = sum of I over x; only as far as the iris is wide
        columns, rows = window.sum(axis=0), window.sum(axis=1)
        dark = (columns.max() - columns) ** 2, (rows.max() - rows) ** 2
        if min(one.sum() for one in dark) <= 0:
            continue
        right = float((dark[0] * np.arange(len(columns))).sum() / dark[0].sum()) - reach - 1
        down = float((dark[1] * np.arange(len(rows))).sum() / dark[1].sum()) - reach
        result[row] += np.clip([x + right, y + down] - places[row], -2, 2) * 0.5
    return result


def _draw(face: Float64, before: Float64 | None, places: Float64) -> UInt8:
    """Return a picture of a face of standard size, three times as large, with points and their ways there."""
    from PIL import Image, ImageDraw

    low, high = np.percentile(face, (1, 99))
    image = Image.fromarray(_grey_picture((face - low) / max(high - low, 1e-9)))
    image = image.resize((image.width * 3, image.height * 3))
    pen = ImageDraw.Draw(image)
    for row, (x, y) in enumerate((places + 0.5) * 3):
        if before is not None:
            start = (before[row] + 0.5) * 3
            pen.line([*start, x, y], fill=(90, 140, 255), width=2)
        pen.ellipse([x - 3, y - 3, x + 3, y + 3], fill=(40, 220, 60))
    return np.asarray(image)


def _grey_picture(values: Float64) -> UInt8:
    return np.repeat((np.clip(values, 0, 1) * 255).astype(np.uint8)[..., None], 3, axis=2)
