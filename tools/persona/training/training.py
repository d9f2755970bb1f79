"""Training of a recogniser from examples."""

from __future__ import annotations

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.persona import ClassRecogniser
from fba.persona.points.layout import PARTS, VERTICES, flat_mask, part_vertices
from fba.persona.recognition import Component, displacements
from fba.persona.recognition._faps import face_scale, mask_faps, measure_fapu
from fba.persona.recognition._recogniser import JAW_FAPS
from tools.persona.training.classes import class_labels, face_classes, part_classes
from tools.persona.training.examples import Examples
from tools.persona.training.networks import train_component

FOLDS = 5
"""Every fifth person is kept for validation."""
STORED = 2
"""Examples of each class and person that are stored, for depth and for the general curves."""
RIDGE = 1e-3
"""Assumed variance of a coordinate's noise, square millimetres an example."""
MAX_NEUTRALS = 3
"""Largest number of neutral examples of a part, relative to its largest other class."""


def train_recogniser(
    examples: Examples, *, tries: int = 3, seed: int = 1, about: str = ""
) -> ClassRecogniser:
    """Return a recogniser trained with examples; every fifth person is held back for validation."""
    check = examples.person % FOLDS == FOLDS - 1
    random = np.random.default_rng(seed)
    components: dict[str, Component] = {}
    moved = {part: displacements(examples.points, examples.neutral, part) for part in PARTS}
    for part in PARTS:
        targets = class_labels(part)[examples.classes]
        used = _thin_neutral(targets, random)
        components[part] = train_component(
            part, part_classes(part), moved[part][used], targets[used], check[used], tries=tries, seed=seed
        )
    kept = _stored(examples)
    return ClassRecogniser(
        components,
        tuple(each.name for each in face_classes()),
        examples.classes[kept],
        {part: class_labels(part)[examples.classes[kept]] for part in PARTS},
        {part: components[part].scores(moved[part][kept]) for part in PARTS},
        examples.depth[kept],
        _fit_jaw(examples),
        {part: _fit_vertices(examples, part, moved[part]) for part in PARTS},
        about,
    )


def _thin_neutral(targets: Bool, random: np.random.Generator) -> Intp:
    """Return rows of examples, with neutral ones (the first class) thinned to `MAX_NEUTRALS`."""
    most = MAX_NEUTRALS * int(targets[:, 1:].sum(axis=0).max())
    neutral = np.flatnonzero(targets[:, 0])
    chosen = random.permutation(neutral)[:most]
    return np.sort(np.concatenate([np.flatnonzero(~targets[:, 0]), chosen]))


def _stored(examples: Examples) -> Intp:
    """Return the first rows of each person and class: the examples that are stored."""
    key = examples.person * len(face_classes()) + examples.classes
    order = np.argsort(key, kind="stable")
    starts = np.searchsorted(key[order], key[order])
    return np.sort(order[np.arange(len(order)) - starts < STORED])


def _fit_vertices(examples: Examples, part: str, moved: Float64) -> Float64:
    """Return the map (2K, 2V) from displacements relative to a part's anchor to those of its vertices.

    The latter are scaled to the standard face (`face_scale`).
    """
    vertices = (flat_mask(examples.points) - flat_mask(examples.neutral))[:, part_vertices(part), :2]
    for person in np.unique(examples.person).tolist():
        rows = np.flatnonzero(examples.person == person)
        vertices[rows] /= face_scale(measure_fapu(examples.neutral[rows[0]]), part)
    targets = np.concatenate([vertices[..., 0], vertices[..., 1]], axis=1)
    normal = moved.T @ moved + RIDGE * len(moved) * np.eye(moved.shape[1])
    return np.asarray(np.linalg.solve(normal, moved.T @ targets))


def _fit_jaw(examples: Examples) -> Float64:
    """Return the coefficients (5,) of the lips' FAPs in FAP 3: least squares over all examples."""
    moved = np.zeros((len(examples), VERTICES, 3))
    moved[:, :60, :2] = (examples.points - examples.neutral)[:, :60]
    values = np.zeros((len(examples), len(JAW_FAPS)))
    for person in np.unique(examples.person).tolist():
        rows = np.flatnonzero(examples.person == person)
        fapu = measure_fapu(examples.neutral[rows[0]])
        values[rows] = mask_faps(moved[rows], fapu, np.zeros(len(JAW_FAPS)))[:, [fap - 1 for fap in JAW_FAPS]]
    if not examples.jaw.any():  # scans do not have it: that of the synthetic faces
        return ClassRecogniser.default().jaw
    return np.asarray(np.linalg.lstsq(values, examples.jaw, rcond=None)[0])
