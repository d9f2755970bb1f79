"""The place of an actor's face among markers: unit, mirror image, axes, size and all feature points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64
from fba.capture.markers._targets import LOWER_LIDS, target_points
from fba.errors import ModelError, Remedy
from fba.face.feature_points import MIRRORED
from fba.geometry import fit_similarity, principal_axes
from fba.parameters import point_rows

SIZE_RANGE = (0.6, 1.6)
"""Smallest and largest size of a face that is accepted, relative to an adult's."""
UNIT_FACTORS = (0.001, 0.01, 0.1, 10.0, 100.0, 1000.0)
"""Factors that correct a wrong unit: metres, centimetres and millimetres taken for each other."""
MIN_MARKERS = 6
"""Smallest number of markers at known places from which a face is found."""
GIVE_MAP = Remedy("markers", "say which marker is where with {}", "{'Chin': '2.1', 'Cap1': 'head'}")
PAIRS = {**MIRRORED, "l_tragion": "r_tragion"}
MIRROR_IMAGE = np.array([-1.0, 1.0, 1.0])


@dataclass(frozen=True)
class Tuning:
    """Constants of the search for a face among markers; lengths in metres."""

    max_repair_ratio: float = 0.5  # of errors after and before mirroring, or swapping two markers
    min_mirror_error: float = 0.004  # error of mirrored markers: flat sets of markers do not show it
    max_tilt: float = np.radians(8.0)  # angle, in radians, of an upright head from an axis of the capture
    max_swapped_cosine: float = -0.5  # between the line of two swapped markers and that of their places
    min_distance: float = 0.008  # distance, in metres, between two swapped markers
    max_distance: float = 0.03  # of a marker from its place, on a face of the actor's size
    iris_width: float = 0.0117  # width of the iris of adults, in metres, which is nearly the same in all
    min_spread: float = 0.05  # sideways spread of markers, as a share of their length


TUNING = Tuning()


@dataclass(frozen=True, eq=False)
class Registration:
    """An actor's face among markers.

    factor: from the markers' coordinates to metres. mirrored: whether their x must be reversed first.
    swapped: pairs of markers with exchanged names. astray: markers that are not where they should be. axes:
    float64 (3, 3), whose rows are the actor's left, up and front in the markers' axes. scale: the actor's
    size relative to the template's. off: root mean square error, in the template's metres.
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
    """Return the place of the face.

    names, neutral: float64 (M, 3), markers of the neutral face, NaN for missing markers. markers: marker ->
    target. template: float64 (84, 3), feature points of a known face, metres, +x left, +y up, +z front.

    Raises ModelError if too few markers have a place, or they are not those of a face.
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
    if not spread[1] > TUNING.min_spread * spread[0]:
        raise ModelError("the markers of the face are all on one line, or in one place")
    mirrored = False
    error = fit_similarity(found, there).error
    mirror_error = fit_similarity(found, there, reflected=True).error
    if mirror_error < TUNING.max_repair_ratio * error and error > TUNING.min_mirror_error:
        mirrored, found = True, found * MIRROR_IMAGE
    swapped = _find_swaps(labels, found, there)
    for one, other in swapped:
        a, b = labels.index(one), labels.index(other)
        found[[a, b]] = found[[b, a]]
    astray = _find_astray(labels, found, there)
    kept = [n for n, label in enumerate(labels) if label not in astray]
    fit = fit_similarity(found[kept], there[kept])
    size = 1 / float(fit.scale)
    factor = _find_factor(size)
    pairs = _left_right([markers[labels[n]] for n in kept], found[kept])
    axes = _upright(fit.rotation, pairs)
    return Registration(
        factor, mirrored, tuple(swapped), tuple(astray), axes, size * factor, float(fit.error)
    )


def _find_swaps(labels: list[str], found: Float64, there: Float64) -> list[tuple[str, str]]:
    """Return pairs of markers that are at each other's places, each marker at most once."""
    placed = fit_similarity(found, there).apply(found)
    candidates = []
    for a in range(len(labels)):
        for b in range(a):
            line, wanted = placed[a] - placed[b], there[a] - there[b]
            lengths = np.linalg.norm(line), np.linalg.norm(wanted)
            if (
                min(lengths) > TUNING.min_distance
                and line @ wanted < TUNING.max_swapped_cosine * lengths[0] * lengths[1]
            ):
                before = np.linalg.norm(placed[a] - there[a]) + np.linalg.norm(placed[b] - there[b])
                after = np.linalg.norm(placed[b] - there[a]) + np.linalg.norm(placed[a] - there[b])
                if after < TUNING.max_repair_ratio * before:
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
        placed = fit_similarity(found[kept], there[kept]).apply(found[kept])
        off = np.linalg.norm(placed - there[kept], axis=1)
        worst = int(off.argmax())
        if off[worst] < max(TUNING.max_distance, 4 * float(np.median(off))):
            break
        result.append(labels[kept.pop(worst)])
    return result


def _find_factor(size: float) -> float:
    """Return the factor from coordinates to metres.

    size: of the face, relative to an adult's, if coordinates were metres.
    """
    for factor in (1.0, *UNIT_FACTORS):
        if SIZE_RANGE[0] < size * factor < SIZE_RANGE[1]:
            return factor
    raise ModelError(
        f"the face would be {size:.3g} times as large as an adult's, and no unit of length explains that; "
        "are these the right markers?"
    ).with_remedies(GIVE_MAP)


def _left_right(targets: list[str], found: Float64) -> Float64:
    """Return lines from right markers to their left mates: float64 (N, 3)."""
    at = dict(zip(targets, found, strict=True))
    lines = [at[left] - at[right] for left, right in PAIRS.items() if left in at and right in at]
    return np.array(lines).reshape(-1, 3)


def _upright(rotation: Float64, pairs: Float64) -> Float64:
    """Return rows (3, 3): the actor's left, up and front.

    Left is across pairs of markers. Up is an axis of the capture if the head is about upright in it.
    """
    up = rotation[1]
    nearest = np.zeros(3)
    nearest[np.abs(up).argmax()] = np.sign(up[np.abs(up).argmax()])
    if np.arccos(np.clip(up @ nearest, -1, 1)) < TUNING.max_tilt:
        up = nearest
    left = rotation[0]
    if len(pairs):
        across = pairs.sum(axis=0)
        across /= np.linalg.norm(across)
        left = across if across @ left > np.cos(2 * TUNING.max_tilt) else left
    front = np.cross(left, up)
    front /= np.linalg.norm(front)
    return np.stack([left, np.cross(front, left), front])


def complete_points(known: Mapping[str, Float64], template: Float64) -> Float64:
    """Return all 84 feature points of an actor: float64 (84, 3).

    known: target -> position, in the actor's axes. Points without markers are those of the template, moved
    and scaled like the markers around them.
    """
    from scipy.interpolate import RBFInterpolator

    places = target_points(template)
    names = [name for name in known if name in places]
    here = np.array([known[name] for name in names])
    there = np.array([places[name] for name in names])
    fit = fit_similarity(there, here)
    moved, base = fit.apply(template), fit.apply(there)
    field = RBFInterpolator(base, here - base, kernel="linear", degree=0)
    result: Float64 = moved + field(moved)
    rows = point_rows()
    for name, position in known.items():
        if name in rows:
            result[rows[name]] = position
    _shut_lips(result, known, template, float(fit.scale))
    _open_lids(result, known)
    return result


def _shut_lips(points: Float64, known: Mapping[str, Float64], template: Float64, scale: float) -> None:
    """Put the line between the lips, if it has no marker, half-way between two heights that real faces have:
    that of the mouth's corners, and that of the template."""
    rows = point_rows()
    if "2.2" in known or not {"8.3", "8.4"} <= set(known):
        return
    inner = [rows[name] for name in ("2.2", "2.3", "2.4", "2.5", "2.6", "2.7", "2.8", "2.9")]
    corners = [rows["8.3"], rows["8.4"]]
    above = template[rows["2.2"], 1] - template[corners, 1].mean()
    points[inner, 1] += points[corners, 1].mean() + scale * above / 2 - points[rows["2.2"], 1]


def _open_lids(points: Float64, known: Mapping[str, Float64]) -> None:
    """Open eyes without markers on both lids half-way between two openings: that of the template on a face of
    this size, and the width of an iris, which is alike in all adults."""
    rows = point_rows()
    for upper, lower in LOWER_LIDS.items():
        if upper in known and lower in known:
            continue
        opening = (points[rows[upper], 1] - points[rows[lower], 1] + TUNING.iris_width) / 2
        fixed, moved, sign = (upper, lower, -1.0) if upper in known else (lower, upper, 1.0)
        points[rows[moved], 1] = points[rows[fixed], 1] + sign * opening
