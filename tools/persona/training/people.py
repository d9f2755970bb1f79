"""Synthetic faces: feature points of two base heads, varied as adults' faces vary, and how FAPs move
them.

Base 0 is the standard's neutral face, moved by the standard's rules; base 1 the built-in head, moved by its
tables. Measures vary by published deviations of adults' faces, each within two of them, and all points by
smooth errors; the two sides of a face differ a little.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from fba.arrays import Float64, Intp
from fba.capture.markers._solving import JAW, JAW_VALUES, measure_responses
from fba.errors import ModelError
from fba.face import FaceModel, Fapu, FeaturePointFace, neutral_points
from fba.face.feature_points import MIRRORED
from fba.parameters import FAP_COUNT, faps, point_rows

DEVIATIONS = {
    "size": 0.04, "width": 0.045, "eyes": 0.055, "nose": 0.065, "lip": 0.11, "chin": 0.08, "mouth": 0.068,
    "lids": 0.1, "nostrils": 0.075, "brows": 0.12, "lips": 0.18,
}  # fmt: skip
"""Standard deviations of measures of adults' faces, as shares: after Farkas's tables of North Americans."""
MOST = 2.0
"""Largest deviation of a measure, in standard deviations."""
SMOOTH = 0.0012
"""Standard deviation of a smooth displacement of all points, metres."""
REACH = 0.02
"""Distance over which that displacement is similar, metres."""
ONE_SIDED = 0.3
"""Share of it that differs between the sides."""
GAIN = 0.2
"""Standard deviation of the amplitude of each FAP between persons, natural logarithm."""
LOPSIDED = 0.1
"""The same between the sides of a face."""
JAW_POINTS = ("2.1", "2.10", "2.11", "2.12", "2.13", "2.14")
TEETH = ("9.8", "9.9", "9.10", "9.11")
EYES = ("3.", "4.")
LIDS_UP = ("3.1", "3.2", "3.13", "3.14")
LIDS_DOWN = ("3.3", "3.4", "3.9", "3.10")


@dataclass(frozen=True, eq=False)
class People:
    """Synthetic faces. points: float64 (N, 84, 3), metres. base: int (N,), 0 or 1. gains: (N, 68)."""

    points: Float64
    base: Intp
    gains: Float64

    def __len__(self) -> int:
        return len(self.points)


def make_people(count: int, random: np.random.Generator) -> People:
    """Return this many faces, half of each base. No two are alike."""
    base = np.arange(count) % 2
    points = np.stack([_vary(_base_points(int(one)), random) for one in base])
    return People(points, base.astype(np.intp), np.stack([_make_gains(random) for _ in range(count)]))


def move_face(people: People, person: int, values: Float64) -> Float64:
    """Return feature points (T, 84, 3), metres, of a person whose face shows FAPs (T, 68), looking ahead."""
    points = people.points[person]
    if people.base[person] == 0:
        return FeaturePointFace(points).local(values).astype(np.float64)
    responses = measure_responses(FaceModel.default())
    fapu = Fapu.measure(points)
    units = np.array([fapu[fap.unit] if fap.unit not in ("AU", "") else 0.0 for fap in faps()])
    linear = values * units
    linear[:, JAW - 1] = 0.0
    moved = np.einsum("tf,fnc->tnc", linear, responses.each)
    jaw = values[:, JAW - 1]
    place = np.clip(np.interp(jaw, JAW_VALUES, np.arange(len(JAW_VALUES))), 0, len(JAW_VALUES) - 1.001)
    low = place.astype(int)
    share = (place - low)[:, None, None]
    arc = responses.jaw[low] * (1 - share) + responses.jaw[low + 1] * share
    return np.asarray(points + moved + arc * fapu.MNS)


@cache
def _base_points(base: int) -> Float64:
    return neutral_points() if base == 0 else FaceModel.default().points


def _draw(random: np.random.Generator, deviation: float) -> float:
    """Return a factor around 1, within `MOST` deviations."""
    return 1.0 + deviation * float(np.clip(random.normal(), -MOST, MOST))


def _vary(base: Float64, random: np.random.Generator) -> Float64:
    """Return points (84, 3) of another face; tried again where it would be none."""
    for _ in range(20):
        points = _vary_once(base, random)
        try:
            Fapu.measure(points)
        except ModelError:
            continue
        return points
    raise ModelError("no face could be made of these deviations")


def _vary_once(base: Float64, random: np.random.Generator) -> Float64:
    by = {name: _draw(random, deviation) for name, deviation in DEVIATIONS.items()}
    rows, points = point_rows(), base.copy()
    nose, mouth, chin = (float(base[rows[name], 1]) for name in ("9.15", "2.2", "2.1"))
    heights = np.array([chin - 0.02, chin, mouth, nose, 0.0, 0.2])
    steps = np.array([1.0, by["chin"], by["lip"], by["nose"], by["width"]]) * np.diff(heights)
    moved = np.cumsum([0.0, *steps])
    points[:, 1] = np.interp(base[:, 1], heights, moved - moved[4])
    names = list(rows)
    mouths = np.array([name.startswith(("2.", "8.")) and name not in JAW_POINTS for name in names])
    noses = np.array([name.startswith("9.") and name not in TEETH for name in names])
    points[:, 0] *= by["width"]
    points[mouths, 0] *= by["mouth"] / by["width"]
    points[noses, 0] *= by["nostrils"] / by["width"]
    line = float(points[rows["2.2"], 1])
    points[mouths, 1] = line + (points[mouths, 1] - line) * by["lips"]
    eyes = np.array([name.startswith(EYES) for name in names])
    apart = 0.031 * (by["eyes"] - by["width"]) * np.sign(points[:, 0])
    points[eyes, 0] += apart[eyes]
    brows = np.array([name.startswith("4.") for name in names])
    points[brows, 1] *= by["brows"]
    points += _smooth_errors(base, random)
    for name in (*LIDS_UP, *LIDS_DOWN):
        pupil = points[rows["3.5" if name in ("3.1", "3.13", "3.3", "3.9") else "3.6"]]
        points[rows[name], 1] = pupil[1] + (points[rows[name], 1] - pupil[1]) * by["lids"]
    for upper, lower in (("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9")):  # lips of a neutral face touch
        points[[rows[upper], rows[lower]]] = points[[rows[upper], rows[lower]]].mean(axis=0)
    return np.asarray(points * by["size"])


def _smooth_errors(base: Float64, random: np.random.Generator) -> Float64:
    """Return shifts (84, 3), metres, alike where points are near each other, mostly alike on both sides."""
    apart = np.linalg.norm(base[:, None] - base[None], axis=2)
    root = np.linalg.cholesky(np.exp(-((apart / REACH) ** 2) / 2) + 1e-6 * np.eye(len(base)))
    errors = SMOOTH * np.clip(root @ random.normal(size=(len(base), 3)), -MOST, MOST)
    other = np.arange(len(base))
    for left, right in MIRRORED.items():
        other[point_rows()[left]], other[point_rows()[right]] = point_rows()[right], point_rows()[left]
    mirrored = errors[other] * (-1.0, 1.0, 1.0)
    even, odd = (errors + mirrored) / 2, (errors - mirrored) / 2
    return np.asarray(even + ONE_SIDED * odd)


def _make_gains(random: np.random.Generator) -> Float64:
    """Return how much a person moves by each FAP: (68,). Both sides alike but for a little, lips as their
    contour."""
    side = LOPSIDED * float(np.clip(random.normal(), -MOST, MOST))
    logs = np.zeros(FAP_COUNT)
    drawn: dict[str, float] = {}
    for fap in faps()[2:]:
        group = (
            fap.name.removesuffix("_o")
            .replace("_l_", "_")
            .replace("_r_", "_")
            .replace("lm", "m")
            .replace("rm", "m")
        )
        if group not in drawn:
            drawn[group] = GAIN * float(np.clip(random.normal(), -MOST, MOST))
        own = (
            side
            if ("_l_" in fap.name or "_lm" in fap.name)
            else -side
            if ("_r_" in fap.name or "_rm" in fap.name)
            else 0.0
        )
        logs[fap.number - 1] = drawn[group] + own
    logs[[4, 9, 10, 51, 56, 57]] = logs[4]  # the lower lip goes with the jaw that opens
    logs[2] = logs[4]
    return np.exp(logs)
