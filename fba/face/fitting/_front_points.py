"""`find_front_points`: the feature points of a face on a frontal photograph.

The whole face is found first; then, from each place like one, a cascade of regressions moves the points of a
mean face to where gradients around them say, from the best place several times; then all go to where the
likeliest head has them, and brows along the dark ridge above the lids.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter, maximum_filter, zoom

from fba.arrays import Float64, UInt8
from fba.errors import ModelError, warn
from fba.face.feature_points import MATES
from fba.face.fitting._brows import follow_brows
from fba.face.fitting._features import (
    EYES,
    SMALL,
    features,
    from_standard,
    luminance,
    standard_face,
    standard_frame,
    to_standard,
    whole_likeness,
)
from fba.face.fitting._head import DISTANCE
from fba.face.fitting._photographs import FoundPoints, Photograph, Step
from fba.face.fitting._points_file import FRONT_POINTS
from fba.face.fitting._views import Observation, first_view, solve
from fba.parameters import point_rows

LARGEST = 0.5
"""Largest distance between the pupils that is looked for, as a share of the picture's smaller side."""
SMALLEST = 0.035
SIZES = 1.12
"""Ratio of successive sizes."""
FACE_SCORE = 0.0
"""Least likeness to a face; that of faces is about 1, of other things about -1."""
CANDIDATES = 40
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
TRIES = ((0.0, 0.0, 1.0), (0.06, 0.0, 0.94), (-0.06, 0.0, 1.06), (0.0, 0.06, 1.06), (0.0, -0.06, 0.94))
"""Shifts right and down, in distances between the pupils, and growth of what points are found from."""
PARTS = {
    "eyes": ("3.5", "3.6", "3.7", "3.11", "3.8", "3.12", "3.1", "3.3", "3.2", "3.4"),
    "brows": ("4.1", "4.3", "4.5", "4.2", "4.4", "4.6"),
    "nose": ("9.3", "9.1", "9.2", "9.15"),
    "mouth": ("8.3", "8.4", "8.1", "8.9", "8.10", "8.2", "8.5", "8.6", "8.7", "8.8", "2.2"),
    "chin": ("2.1", "2.10"),
}
DOUBT = {"eyes": 0.02, "brows": 0.027, "nose": 0.03, "mouth": 0.027, "chin": 0.045}
"""Spread of several tries beyond which the points of a part are doubtful, in distances between the pupils.

More than in any of 40 pictures of other heads on which the part was found; of brows, where they were."""
USUAL_ERROR, DOUBTED = 0.0015, 2.0
"""Error of points that are found, metres on the face, and how much more for each metre that tries are apart:
chosen on rendered heads from which nothing was learned."""


def find_front_points(photograph: Photograph) -> FoundPoints:
    """Return the feature points of the face on a frontal photograph.

    Raises ModelError where no face is found. Warns (FbaWarning) where there may be several, and of the parts
    of the face whose points are doubtful: those that end elsewhere when they are found again from other
    places and on the mirrored picture.
    """
    grey = luminance(photograph.pixels)
    middle, across, score, where = _find_face(grey, photograph.name)
    steps = [Step("How like a face of this size each place is", where)]
    face = standard_face(grey, middle, across)
    places, _ = features().follow(face, features().mean)
    steps.append(
        Step("From the points of a mean face to those of this one", _draw(face, features().mean, places))
    )
    at, spread = _found_again(grey, middle, across)
    at = _likely(at, spread)
    middle, across = standard_frame(at, features().mean)
    face = standard_face(grey, middle, across)
    colours = np.stack([standard_face(photograph.pixels[..., k] / 255, middle, across) for k in range(3)])
    places = follow_brows(colours, to_standard(at, middle, across))
    steps.append(
        Step("The middle of ten tries as a likely head shows it; brows by colour", _draw(face, None, places))
    )
    at = from_standard(places, middle, across) * photograph.scale
    found = {name: (float(x), float(y)) for name, (x, y) in zip(FRONT_POINTS, at, strict=True)}
    doubts = {
        part: float(spread[[FRONT_POINTS.index(name) for name in names]].mean())
        for part, names in PARTS.items()
    }
    doubtful = [part for part, doubt in doubts.items() if doubt > DOUBT[part]]
    if doubtful:
        warn(
            f"{photograph.name or 'the picture'}: the points of the {' and the '.join(doubtful)} are "
            "doubtful; look at them, and drag them to where they belong "
            "(`fba model photos ... --edit POINTS.json`)",
            stacklevel=2,
        )
    return FoundPoints(
        {name: place for name, place in found.items() if name not in HARDLY_SEEN}, score, steps, doubts
    )


def _found_again(grey: Float64, middle: Float64, across: Float64) -> tuple[Float64, Float64]:
    """Return the points (P, 2), pixels, in the middle of several tries, and how far tries are apart.

    The spread (P,) is the mean distance from that middle, in distances between the pupils.
    """
    mirror = np.array([grey.shape[1] - 1.0, 0.0])
    swapped = [FRONT_POINTS.index(MATES.get(name, name)) for name in FRONT_POINTS]
    tries = []
    for right, down, grow in TRIES:
        start = middle + right * across + down * np.array([-across[1], across[0]])
        tries.append(_points_from(grey, start, across * grow))
        other = _points_from(grey[:, ::-1], mirror + start * (-1, 1), across * (grow, -grow))
        tries.append((mirror + other * (-1, 1))[swapped])
    at = np.median(tries, axis=0)
    spread = np.linalg.norm(np.array(tries) - at, axis=2).mean(axis=0)
    return at, spread / float(np.linalg.norm(at[0] - at[1]))


def _points_from(grey: Float64, middle: Float64, across: Float64) -> Float64:
    """Return the points (P, 2), pixels, found from where a face may be; as `standard_face` takes it."""
    known = features()
    places, first = known.mean, 0
    for _ in range(2):
        face = standard_face(grey, middle, across)
        places, _ = known.follow(face, places, first)
        at = from_standard(places, middle, across)
        middle, across = standard_frame(at, known.mean)
        places, first = to_standard(at, middle, across), 2
    places, _ = known.follow(standard_face(grey, middle, across), places, first)
    return from_standard(places, middle, across)


def _find_face(grey: Float64, name: str) -> tuple[Float64, Float64, float, UInt8]:
    """Return (middle of the eyes, right pupil to left one, likeness, picture of it); (2,), (2,) in pixels."""
    height, width = grey.shape
    whole = features().whole
    side = min(height, width)
    best: list[tuple[float, Float64, Float64]] = []
    for degrees in TURNS:
        eyes = LARGEST * side
        while eyes >= max(SMALLEST * side, EYES / SMALL):
            # The template has EYES / SMALL pixels between the pupils.
            factor = EYES / SMALL / eyes
            if min(height, width) * factor < 24:
                eyes /= SIZES
                continue
            small = _turned(_reduced(grey, factor), degrees)
            likeness = whole_likeness(small, whole)
            for y, x in _maxima(likeness):
                middle, step = _turned_back(np.array([x, y], dtype=np.float64), small.shape, degrees)
                best.append((float(likeness[y, x]), middle / factor, step * eyes))
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
    shown = whole_likeness(_reduced(grey, EYES / SMALL / float(np.linalg.norm(across))), whole)
    return middle, across, score, _grey_picture((shown + 1) / max(float(shown.max()) + 1, 1e-9))


def _is_inside(middle: Float64, across: Float64, shape: tuple[int, ...]) -> bool:
    """Whether a face with these eyes, from brows to chin, is inside a picture of this shape."""
    down = np.array([-across[1], across[0]])
    corners = np.array([middle + a * across + b * down for a in (-0.9, 0.9) for b in (-0.6, 1.6)])
    return bool((corners >= 0).all() and (corners <= np.array(shape[1::-1])).all())


def _maxima(likeness: Float64) -> list[tuple[int, int]]:
    """Return rows and columns of the highest local maxima."""
    peaks = np.argwhere(likeness == maximum_filter(likeness, 5))
    order = np.argsort(-likeness[tuple(peaks.T)], kind="stable")[:OF_EACH_SIZE]
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


def _likely(at: Float64, spread: Float64) -> Float64:
    """Return places (P, 2), pixels, moved to those of the likeliest head that a camera may show there.

    spread: how far tries are apart, in distances between the pupils. Where they are, other points say more.
    """
    from fba.face.builtin import default

    points, rows = default().points, [point_rows()[name] for name in FRONT_POINTS]
    eyes = float(np.linalg.norm(points[rows[0]] - points[rows[1]]))
    seen = Observation(rows, at)
    view = first_view(points, seen, DISTANCE)
    head, views = solve(points, [view], [seen], noise=np.hypot(USUAL_ERROR, DOUBTED * spread * eyes))
    return views[0].project(head[rows])


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
