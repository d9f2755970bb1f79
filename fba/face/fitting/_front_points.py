"""`find_front_points`: the feature points of a face on a frontal photograph, the classical way.

The whole face is found first; then, in a region for each point that anthropometry gives, the place whose
surroundings are most like the point's; then the most likely head through all of these places, which corrects
single mistakes; pupils, nostrils and brows last, by their brightness.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter, maximum_filter, zoom

from fba.arrays import Float64, UInt8
from fba.errors import ModelError, warn
from fba.face.fitting._features import (
    EYES,
    LOCAL,
    MIDDLE,
    PATCH,
    POINTS,
    SMALL,
    WHOLE,
    WHOLE_LOCAL,
    even,
    features,
    from_standard,
    gabor,
    luminance,
    mirror_phases,
    phase_distance,
    standard_face,
    subspace,
    to_standard,
)
from fba.face.fitting._found import FoundPoints, Step
from fba.face.fitting._photographs import Photograph
from fba.face.fitting._points_file import FRONT_POINTS
from fba.face.fitting._views import Observation, first_view, solve
from fba.parameters import point_rows

LARGEST = 0.5
"""Largest distance between the pupils that is looked for, as a share of the picture's smaller side."""
SMALLEST = 0.06
SIZES = 1.12
"""Ratio of successive sizes."""
FACE_SCORE = 0.58
"""Least likeness, 0 to 1, to the template of a whole face."""
CANDIDATES = 60
"""Places like a whole face whose points are looked at, at most."""
OF_EACH_SIZE = 6
LARGER = 0.05
"""Likeness that a face of twice the size has ahead: portraits show large faces."""
SURE = (
    "3.5",
    "3.6",
    "3.7",
    "3.12",
    "3.8",
    "3.11",
    "9.3",
    "9.1",
    "9.2",
    "8.3",
    "8.4",
    "8.1",
    "4.3",
    "4.4",
    "2.1",
)
"""Points that tell faces from other things."""
SECOND_FACE = 0.93
"""A second place as like a face as this share of the first's likeness may be another face."""
REGION = 2.5
"""Half width of a point's region, in standard deviations of its place in faces."""
ROUNDS = ((1.0, 6.0), (0.5, 3.0), (0.35, 2.0))
"""Of the search: share of the region, and least half width of it, pixels of a face of standard size."""
GUESS_NOISE = 2.0
"""Pixels of a face of standard size by which points are misplaced, beyond which they count less."""
WEIGHTS = (1.0, 0.35, 0.25, 0.6)
"""Of correlation, distance from the feature space, phase distance, and distance from the expected place."""
TURNS = (-12.0, 0.0, 12.0)
"""Degrees by which the picture is turned while the face is looked for."""


def find_front_points(photograph: Photograph) -> FoundPoints:
    """Return the feature points of the face on a frontal photograph.

    Raises ModelError where no face is found. Warns (FbaWarning) where there may be several.
    """
    grey = luminance(photograph.pixels)
    middle, across, score, where = _find_face(grey, photograph.name)
    steps = [Step("Where a whole face is most likely", where)]
    places: dict[str, Float64] = {}
    for turn, (share, least) in enumerate(ROUNDS):
        face = even(standard_face(grey, middle, across), LOCAL)
        expected = {name: to_standard(place, middle, across) for name, place in places.items()}
        found, likeness = _search(face, expected, share, least)
        if turn == 0:
            steps.append(
                Step("Regions by anthropometry and the most likely places", _draw(face, found, likeness))
            )
        spots = {name: from_standard(place, middle, across) for name, place in found.items()}
        places, middle, across = _likely_head(spots, float(np.linalg.norm(across)))
    face = standard_face(grey, middle, across)
    shown = {name: to_standard(place, middle, across) for name, place in places.items()}
    refined = _refine(face, shown)
    steps.append(
        Step("The most likely head, pupils and brows by brightness", _draw(even(face, LOCAL), refined, {}))
    )
    result = {
        name: from_standard(refined[name], middle, across) * photograph.scale
        for name in FRONT_POINTS
        if name in POINTS
    }
    return FoundPoints({name: (float(x), float(y)) for name, (x, y) in result.items()}, score, steps)


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
            f"at least {FACE_SCORE} is needed); place its points by hand"
        )
    for other, place, _ in scored[1:]:
        if other > max(SECOND_FACE * score, FACE_SCORE) and np.linalg.norm(
            place - middle
        ) > 2.5 * np.linalg.norm(across):
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
    """Return how like those of a face the points around two eyes are, 0 to 1."""
    _, likeness = _search(even(standard_face(grey, middle, across), LOCAL), {}, 1.0, 4.0, SURE, phases=False)
    return float(np.mean(list(likeness.values())))


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


def _search(
    face: Float64,
    expected: dict[str, Float64],
    share: float,
    least: float,
    names: tuple[str, ...] = POINTS,
    *,
    phases: bool = True,
) -> tuple[dict[str, Float64], dict[str, float]]:
    """Return the likeliest places (2,) of points in an evened face of standard size, and their likeness."""
    known = features()
    responses = gabor(face) if phases else None
    found, likeness = {}, {}
    first, second, third, fourth = WEIGHTS
    for name in names:
        number, mirrored = known.of(name)
        usual, spread = known.place(name)
        centre = expected.get(name, usual + MIDDLE)
        half = np.maximum(REGION * share * spread, least)
        mean, vectors, prototype = known.means[number], known.vectors[number], known.phases[number]
        if mirrored:
            mean, vectors, prototype = mean[:, ::-1], vectors[:, :, ::-1], mirror_phases(prototype)
        low = np.maximum(np.floor(centre - half).astype(int), PATCH)
        high = np.minimum(np.ceil(centre + half).astype(int) + 1, np.array(face.shape[::-1]) - PATCH)
        if (high - low < 1).any():
            found[name], likeness[name] = centre, 0.0
            continue
        rows, columns = slice(low[1] - PATCH, high[1] + PATCH), slice(low[0] - PATCH, high[0] + PATCH)
        along, distance = (
            one[PATCH:-PATCH, PATCH:-PATCH] for one in subspace(face[rows, columns], mean, vectors)
        )
        y, x = np.mgrid[low[1] : high[1], low[0] : high[0]]
        away = ((x - centre[0]) / half[0]) ** 2 + ((y - centre[1]) / half[1]) ** 2
        score = first * along - second * distance - fourth * away
        if responses is not None:
            score -= third * phase_distance(responses[:, low[1] : high[1], low[0] : high[0]], prototype)
        top = np.unravel_index(int(score.argmax()), score.shape)
        found[name] = _peak(score, top) + low
        likeness[name] = float(np.clip(along[top], 0, 1))
    return found, likeness


def _peak(score: Float64, top: tuple[np.intp, ...]) -> Float64:
    """Return x and y of a maximum between pixels, by a parabola along each axis."""
    y, x = int(top[0]), int(top[1])
    result = np.array([float(x), float(y)])
    for axis, line, at in ((0, score[y, :], x), (1, score[:, x], y)):
        if 0 < at < len(line) - 1:
            bend = line[at - 1] - 2 * line[at] + line[at + 1]
            if bend < -1e-9:
                result[axis] += float(np.clip((line[at - 1] - line[at + 1]) / (2 * bend), -0.5, 0.5))
    return result


def _likely_head(places: dict[str, Float64], eyes: float) -> tuple[dict[str, Float64], Float64, Float64]:
    """Return where the most likely head shows its points, given places in a picture, and its eyes.

    eyes: distance between the pupils, pixels. Returns (places, middle of the pupils, right pupil to left).
    """
    from fba.face.builtin import default

    base = default().points
    row = point_rows()
    names = list(places)
    seen = Observation([row[name] for name in names], np.array([places[name] for name in names]))
    view = first_view(base, seen, 1.5)
    _, views = solve(base, [view], [seen], rigid=True)
    head, views = solve(base, views, [seen], noise=GUESS_NOISE / EYES * 0.0625, hidden=True)
    shown = views[0].project(head)
    result = {name: shown[row[name]] for name in (*POINTS, *FRONT_POINTS)}
    left, right = result["3.5"], result["3.6"]
    return result, (left + right) / 2, left - right


def _refine(face: Float64, places: dict[str, Float64]) -> dict[str, Float64]:
    """Return places with the pupils at the darkest column and row (integral projections) near them."""
    result = dict(places)
    smooth = gaussian_filter(face, 1.0)
    for name, reach in (("3.5", 5), ("3.6", 5)):
        x, y = np.round(places[name]).astype(int)
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
        result[name] = (
            places[name] + np.clip([x + right - places[name][0], y + down - places[name][1]], -2, 2) * 0.5
        )
    return result


def _draw(face: Float64, places: dict[str, Float64], likeness: dict[str, float]) -> UInt8:
    """Return a picture of a face of standard size, three times as large, with places on it."""
    from PIL import Image, ImageDraw

    low, high = np.percentile(face, (1, 99))
    image = Image.fromarray(_grey_picture(np.clip((face - low) / max(high - low, 1e-9), 0, 1)))
    image = image.resize((image.width * 3, image.height * 3))
    pen = ImageDraw.Draw(image)
    for name, place in places.items():
        x, y = (place + 0.5) * 3
        share = likeness.get(name, 1.0)
        pen.ellipse([x - 3, y - 3, x + 3, y + 3], fill=(int(255 * (1 - share)), int(255 * share), 60))
        if name in likeness:
            usual, spread = features().place(name)
            left, top = (usual + MIDDLE - REGION * spread) * 3
            right, bottom = (usual + MIDDLE + REGION * spread) * 3
            pen.rectangle([left, top, right, bottom], outline=(90, 140, 255))
    return np.asarray(image)


def _grey_picture(values: Float64) -> UInt8:
    return np.repeat((np.clip(values, 0, 1) * 255).astype(np.uint8)[..., None], 3, axis=2)
