"""Where an actor's face is in the markers' axes: unit, mirror image, directions, size, all feature points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64
from fba.capture.markers._targets import target_points
from fba.errors import ModelError, Remedy
from fba.face.feature_points import MIRRORED, row_of
from fba.geometry import fit_similarity, principal_axes

SIZE_RANGE = (0.6, 1.6)
"""Smallest and largest size of a face that is accepted, relative to the adult's whose points are known."""
UNIT_FACTORS = (0.001, 0.01, 0.1, 10.0, 100.0, 1000.0)
"""Factors that correct a wrong unit: metres, centimetres and millimetres taken for each other."""
MIRROR = 0.5
"""Markers are mirrored if their mirror image leaves less than this share of the error."""
MIN_MIRROR_ERROR = 0.004
"""... and if the error is larger than this, in metres: flat sets of markers do not show it."""
MAX_TILT = np.radians(8.0)
"""Largest angle, in radians, of an upright head from an axis of the capture."""
MAX_SWAPPED_COSINE = -0.5
"""Two markers are swapped if the cosine between their line and that of their places is below this."""
MIN_DISTANCE = 0.008
"""Smallest distance, in metres, between two markers that are tested for being swapped."""
MAX_DISTANCE = 0.03
"""Largest distance of a marker from its place, in metres, on a face of the actor's size."""
IRIS_WIDTH = 0.0117
"""Width of the iris of adults, in metres, which is nearly the same in all."""
MIN_MARKERS = 6
"""Smallest number of markers at known places from which a face is found."""
GIVE_MAP = Remedy("markers", "say which marker is where with {}", "{'Chin': '2.1', 'Cap1': 'head'}")
MIN_SPREAD = 0.05
"""Smallest sideways spread of markers, as a share of their length."""
PAIRS = {**MIRRORED, "l_tragion": "r_tragion"}
MIRROR_IMAGE = np.array([-1.0, 1.0, 1.0])


@dataclass(frozen=True, eq=False)
class Registration:
    """An actor's face among markers.

    factor: by which the markers' coordinates become metres. mirrored: whether their x must be turned round
    first. swapped: pairs of markers that had each other's names. astray: markers that are not where they
    should be. axes: float64 (3, 3), whose rows are the actor's left, up and front in the markers' axes.
    scale: the actor's size relative to the template's.
    """

    factor: float
    mirrored: bool
    swapped: tuple[tuple[str, str], ...]
    astray: tuple[str, ...]
    axes: Float64
    scale: float
    off: float


def register(
    names: Sequence[str], markers: Mapping[str, str], neutral: Float64, template: Float64
) -> Registration:
    """Return where the face is.

    names, neutral: float64 (M, 3), markers of the neutral face, NaN where one is missing. markers: marker ->
    target. template: float64 (84, 3), feature points of a known face, metres, +x left, +y up, +z front.

    Raises ModelError if too few markers have a place, or what there is is no face.
    """
    places = target_points(template)
    whole: Bool = ~np.isnan(neutral[:, 0])
    rows = [n for n, name in enumerate(names) if markers.get(name) in places and whole[n]]
    if len(rows) < MIN_MARKERS:
        raise ModelError(
            f"{len(rows)} markers have a place on the face, but {MIN_MARKERS} are needed to find one"
        ).with_remedies(GIVE_MAP)
    found = neutral[rows]
    there = np.array([places[markers[names[n]]] for n in rows])
    labels = [names[n] for n in rows]
    _, spread = principal_axes(found)
    if not spread[1] > MIN_SPREAD * spread[0]:
        raise ModelError("the markers of the face are all on one line, or in one place")
    mirrored = False
    _, error, scale = _align(found, there)
    _, error_turned, _ = _align(found * MIRROR_IMAGE, there)
    if error_turned < MIRROR * error and error > MIN_MIRROR_ERROR:
        mirrored, found = True, found * MIRROR_IMAGE
    swapped = _find_swaps(labels, found, there)
    for one, other in swapped:
        a, b = labels.index(one), labels.index(other)
        found[[a, b]] = found[[b, a]]
    astray = _find_astray(labels, found, there)
    kept = [n for n, label in enumerate(labels) if label not in astray]
    rotation, error, scale = _align(found[kept], there[kept])
    factor = _find_factor(1 / scale)
    pairs = _left_right([markers[labels[n]] for n in kept], found[kept])
    axes = _upright(rotation, pairs)
    return Registration(factor, mirrored, tuple(swapped), tuple(astray), axes, 1 / scale * factor, error)


def _align(found: Float64, there: Float64) -> tuple[Float64, float, float]:
    """Return rotation (3, 3), root mean square error in the template's metres, and scale of the best fit."""
    fit = fit_similarity(found, there)
    return fit.rotation, float(fit.error), float(fit.scale)


def _find_swaps(labels: list[str], found: Float64, there: Float64) -> list[tuple[str, str]]:
    """Return pairs of markers that are at each other's places, each marker once at most."""
    rotation, _, scale = _align(found, there)
    placed = scale * (found - found.mean(axis=0)) @ rotation.T
    goal = there - there.mean(axis=0)
    candidates = []
    for a in range(len(labels)):
        for b in range(a):
            line, should = placed[a] - placed[b], goal[a] - goal[b]
            lengths = np.linalg.norm(line), np.linalg.norm(should)
            if min(lengths) > MIN_DISTANCE and line @ should < MAX_SWAPPED_COSINE * lengths[0] * lengths[1]:
                before = np.linalg.norm(placed[a] - goal[a]) + np.linalg.norm(placed[b] - goal[b])
                after = np.linalg.norm(placed[b] - goal[a]) + np.linalg.norm(placed[a] - goal[b])
                if after < MIRROR * before:
                    candidates.append((after - before, b, a))
    result: list[tuple[str, str]] = []
    taken: set[int] = set()
    for _, a, b in sorted(candidates):
        if not {a, b} & taken:
            taken |= {a, b}
            result.append((labels[a], labels[b]))
    return result


def _find_astray(labels: list[str], found: Float64, there: Float64) -> list[str]:
    """Return the markers that are far from their places, the farthest first."""
    kept = list(range(len(labels)))
    result: list[str] = []
    while len(kept) > MIN_MARKERS:
        rotation, _, scale = _align(found[kept], there[kept])
        placed = scale * (found[kept] - found[kept].mean(axis=0)) @ rotation.T
        off = np.linalg.norm(placed - (there[kept] - there[kept].mean(axis=0)), axis=1)
        worst = int(off.argmax())
        if off[worst] < max(MAX_DISTANCE, 4 * float(np.median(off))):
            break
        result.append(labels[kept.pop(worst)])
    return result


def _find_factor(size: float) -> float:
    """Return the factor that makes coordinates metres, by the size of the face in them.

    size: of the actor's face, relative to a known one, if coordinates were metres.
    """
    if SIZE_RANGE[0] < size < SIZE_RANGE[1]:
        return 1.0
    for factor in UNIT_FACTORS:
        if SIZE_RANGE[0] < size * factor < SIZE_RANGE[1]:
            return factor
    raise ModelError(
        f"the face would be {size:.3g} times as large as an adult's, and no unit of length explains that; "
        "are these the right markers?"
    ).with_remedies(GIVE_MAP)


def _left_right(targets: list[str], found: Float64) -> Float64:
    """Return lines from right markers to their left mates: float64 (N, 3)."""
    place = dict(zip(targets, found, strict=True))
    lines = [place[a] - place[b] for a, b in PAIRS.items() if a in place and b in place]
    return np.array(lines).reshape(-1, 3)


def _upright(rotation: Float64, pairs: Float64) -> Float64:
    """Return the actor's left, up and front: across pairs of markers, and along an axis of the capture if the
    head is about upright in it."""
    up = rotation[1]
    nearest = np.zeros(3)
    nearest[np.abs(up).argmax()] = np.sign(up[np.abs(up).argmax()])
    if np.arccos(np.clip(up @ nearest, -1, 1)) < MAX_TILT:
        up = nearest
    left = rotation[0]
    if len(pairs):
        across = pairs.sum(axis=0)
        across /= np.linalg.norm(across)
        left = across if across @ left > np.cos(2 * MAX_TILT) else left
    front = np.cross(left, up)
    front /= np.linalg.norm(front)
    return np.stack([left, np.cross(front, left), front])


def complete_points(known: Mapping[str, Float64], template: Float64) -> Float64:
    """Return all 84 feature points of an actor: float64 (84, 3).

    known: target -> position, in the actor's axes. Points that have no marker are those of the template,
    moved and scaled as the markers around them are.
    """
    from scipy.interpolate import RBFInterpolator

    places = target_points(template)
    names = [name for name in known if name in places]
    here = np.array([known[name] for name in names])
    there = np.array([places[name] for name in names])
    rotation, _, scale = _align(there, here)
    moved = scale * (template - there.mean(axis=0)) @ rotation.T + here.mean(axis=0)
    base = scale * (there - there.mean(axis=0)) @ rotation.T + here.mean(axis=0)
    field = RBFInterpolator(base, here - base, kernel="linear", degree=0)
    result: Float64 = moved + field(moved)
    rows = row_of()
    for name, position in known.items():
        if name in rows:
            result[rows[name]] = position
    _shut_lips(result, known, template, scale)
    _open_lids(result, known)
    return result


def _shut_lips(points: Float64, known: Mapping[str, Float64], template: Float64, scale: float) -> None:
    """Put the line between the lips, if no marker is on it, at the height of the mouth's corners, or half as
    far from there as on the template: both heights are found in faces."""
    rows = row_of()
    if "2.2" in known or not {"8.3", "8.4"} <= set(known):
        return
    inner = [rows[name] for name in ("2.2", "2.3", "2.4", "2.5", "2.6", "2.7", "2.8", "2.9")]
    corners = [rows["8.3"], rows["8.4"]]
    above = template[rows["2.2"], 1] - template[corners, 1].mean()
    points[inner, 1] += points[corners, 1].mean() + scale * above / 2 - points[rows["2.2"], 1]


def _open_lids(points: Float64, known: Mapping[str, Float64]) -> None:
    """Open lids without markers on both of them as far as the template's are on a face of this size, or as an
    iris is wide in all adults: half-way between the two."""
    rows = row_of()
    for upper, lower in (("3.1", "3.3"), ("3.2", "3.4")):
        if upper in known and lower in known:
            continue
        opening = (points[rows[upper], 1] - points[rows[lower], 1] + IRIS_WIDTH) / 2
        held, other, sign = (upper, lower, -1.0) if upper in known else (lower, upper, 1.0)
        points[rows[other], 1] = points[rows[held], 1] + sign * opening
