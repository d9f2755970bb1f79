"""Examples of the 35 classes: synthetic faces in several intensities and poses, with their true masks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64, Intp
from fba.parameters import FAP_COUNT
from fba.persona.points import fit_face_points
from fba.persona.points._tracked import register_points
from fba.persona.points.layout import REGISTERED, mask_of_face, points_of_face, standard_points
from tools.persona.training.camera import photograph
from tools.persona.training.classes import class_faps
from tools.persona.training.people import make_people, move_face

TURNS = np.radians([6.0, 12.0, 6.0])
"""Standard deviations of the head's pitch, yaw and roll; within two of them."""
INTENSITIES = (0.35, 1.1)
"""Least and largest intensity of an expression."""
STRAY = 0.06
"""How much of another class's FAPs each example has."""


@dataclass(frozen=True, eq=False)
class Examples:
    """Registered points of faces whose class is known.

    points: float64 (N, 64, 2), on the standard mask; neutral: (N, 64, 2), of the same person at rest.
    classes: int (N,), rows of `face_classes`. person: int (N,). intensity: (N,). depth: (N, 86),
    millimetres on the standard mask that vertices move forward from the neutral mask (Delta z of the
    source). jaw: (N,), FAP 3.
    """

    points: Float64
    neutral: Float64
    classes: Intp
    person: Intp
    intensity: Float64
    depth: Float64
    jaw: Float64

    def __len__(self) -> int:
        return len(self.points)


def make_examples(count: int = 40, each: int = 6, seed: int = 1) -> Examples:
    """Return `each` examples of every class from each of `count` persons.

    Points are projected with pose and noise, and registered as those of a film are; the neutral face is the
    median of 30 noisy frames of a head that looks ahead. Masks, whose depth is given, are those of the
    moved face itself.
    """
    random = np.random.default_rng(seed)
    people = make_people(count, random)
    table = class_faps()
    kinds = np.tile(np.arange(len(table)), each)
    parts: list[tuple[Float64, ...]] = []
    for person in range(count):
        intensity = random.uniform(*INTENSITIES, len(kinds))
        values = people.gains[person] * table[kinds] * intensity[:, None]
        values += (
            STRAY * random.uniform(0, 1, (len(kinds), 1)) * table[random.integers(0, len(table), len(kinds))]
        )
        values *= np.exp(0.08 * random.normal(size=values.shape))
        features = move_face(people, person, values)
        rest = move_face(people, person, np.zeros((1, FAP_COUNT)))
        points = _film(features, random)
        neutral = find_neutral(rest[0], random)
        true, still = mask_of_face(features), mask_of_face(rest)
        size = _size_ratio(rest[0])
        depth = (true - still)[..., 2] * size
        parts.append((points, np.broadcast_to(neutral, points.shape), intensity, depth, values[:, 2]))
    points, neutral, intensity, depth, jaw = (np.concatenate([part[n] for part in parts]) for n in range(5))
    persons = np.repeat(np.arange(count), len(kinds))
    return Examples(points, neutral, np.tile(kinds, count), persons, intensity, depth, jaw)


def find_neutral(rest: Float64, random: np.random.Generator, frames: int = 30) -> Float64:
    """Return the neutral points (64, 2) of a face at rest, (84, 3): the median of frames with noise."""
    still = np.broadcast_to(rest, (frames, *rest.shape))
    picture, angles = photograph(still, np.radians(2.0) * random.normal(size=(frames, 3)), random)
    return np.asarray(np.median(register_points(picture, angles[:, 1])[0], axis=0))


def _film(features: Float64, random: np.random.Generator) -> Float64:
    turns = TURNS * np.clip(random.normal(size=(len(features), 3)), -2, 2)
    picture, angles = photograph(features, turns, random)
    return register_points(picture, angles[:, 1])[0]


def _size_ratio(rest: Float64) -> float:
    """Return millimetres of the standard mask for each of a face's, by the six points of the registration."""
    rows = [number - 1 for number in REGISTERED]
    return float(
        fit_face_points(points_of_face(rest)[rows, :2], standard_points()[rows, :2], mirror=False).scale
    )
