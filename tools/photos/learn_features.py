"""Learns what faces look like: python -m tools.photos.learn_features [HEADS] [SEED]

Renders six pictures of each head and writes fba/face/fitting/front_features.npz. On one core without a
graphics card: three seconds for each head, and as long for the regressions.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.ndimage import map_coordinates, zoom

import fba
from fba.arrays import Float32, Float64, UInt8
from fba.face.feature_points import MIRRORED
from fba.face.fitting._features import (
    EYES,
    REACHES,
    SMALL,
    STAGES,
    describe,
    gradient_sums,
    luminance,
    small_face,
    standard_face,
    standard_frame,
    to_standard,
    unit,
    whole_likeness,
)
from fba.face.fitting._points_file import FRONT_POINTS
from fba.parameters import point_rows
from tools.photos.rendered_faces import rendered_faces

OUTPUT = Path(fba.__file__).parent / "face/fitting/front_features.npz"
GUESSES = 3
"""Wrong places from which each picture, and its mirror image, is learned."""
SHIFT, GROW, TURN = 4.0, 0.08, np.radians(6)
"""Usual errors of a face that is found: pixels of the standard size, logarithm of the size, radians."""
WARP = 2.5
"""Pixels by which a picture is bent in each direction: faces of other proportions."""
DAMPING = 4.0
"""Weight of small regressions against exact ones, in variances of a number."""
RESULTS = 36
"""Numbers that a regression gives: shifts of the points are like these."""
WHOLE_DAMPING = 1.0
"""The same for the template of a whole face."""
ROUNDS = 2
"""Times that the template is learned again, with the places that it takes for faces."""

Gradients = tuple[np.ndarray, np.ndarray]
"""Sums of gradients of a face, coarse and fine, float16."""


def main(heads: int = 72, seed: int = 1) -> None:
    arrays = learn(list(rendered_faces(heads, seed)), seed)
    np.savez_compressed(OUTPUT, allow_pickle=False, **arrays)
    print(f"{OUTPUT}: {OUTPUT.stat().st_size} bytes from {heads} heads")


def learn(faces: list[tuple[UInt8, Float64]], seed: int) -> dict[str, np.ndarray]:
    """Return the arrays of `Features` from pictures (H, W, 3) and places (84, 2) of their feature points."""
    random = np.random.default_rng(seed)
    rows = [point_rows()[name] for name in FRONT_POINTS]
    pictures = [one for pixels, at in faces for one in _both_sides(luminance(pixels), at[rows])]
    mean = np.mean([_upright(at) for _, at in pictures], axis=0)
    gradients: list[Gradients] = []
    targets = []
    for grey, at in pictures:
        for _ in range(GUESSES):
            middle, across = _misplaced(*standard_frame(at, mean), random)
            face, target = _bent(standard_face(grey, middle, across), to_standard(at, middle, across), random)
            gradients.append(_small(face))
            targets.append(target)
    arrays, places = _cascade(gradients, np.array(targets, dtype=np.float32), mean)
    no_faces = list(_no_faces(pictures, mean, random))
    whole, mistaken = _whole(pictures, no_faces, random)
    others = [_small(face) for face in [*no_faces, *mistaken]]
    return {
        "mean": mean.astype(np.float32),
        **arrays,
        "likeness": _likeness(arrays, mean, (gradients, places), others),
        "whole": whole.astype(np.float16),
    }


def _both_sides(grey: Float64, at: Float64) -> Iterator[tuple[Float64, Float64]]:
    """Yield a picture and its mirror image, with the places of the points that have the same names there."""
    others = {**MIRRORED, **{right: left for left, right in MIRRORED.items()}}
    order = [FRONT_POINTS.index(others.get(name, name)) for name in FRONT_POINTS]
    yield grey, at
    yield grey[:, ::-1], at[order] * (-1, 1) + (grey.shape[1] - 1, 0)


def _upright(at: Float64) -> Float64:
    return to_standard(at, (at[0] + at[1]) / 2, at[0] - at[1])


def _small(face: Float64) -> Gradients:
    # half as exact, and half as large: 0.6 MB for each of some thousand faces
    coarse, fine = (gradient_sums(face, reach).astype(np.float16) for reach in REACHES)
    return coarse, fine


def _misplaced(
    middle: Float64, across: Float64, random: np.random.Generator, share: float = 1.0
) -> tuple[Float64, Float64]:
    """Return where a face of standard size would be cut out if it were found with some errors."""
    turn, grow = random.normal(0, TURN) * share, np.exp(random.normal(0, GROW) * share)
    shift = random.normal(0, SHIFT, 2) * share * np.linalg.norm(across) / EYES
    cosine, sine = np.cos(turn) * grow, np.sin(turn) * grow
    return middle + shift, np.array([[cosine, -sine], [sine, cosine]]) @ across


def _bent(face: Float64, at: Float64, random: np.random.Generator) -> tuple[Float64, Float64]:
    """Return a face of standard size of other proportions, and the places (P, 2) of its points."""
    coarse = random.normal(0, WARP, (2, 6, 6))
    height, width = face.shape
    field = np.array([zoom(one, (height / 6, width / 6), order=3) for one in coarse])
    down, across = np.mgrid[0:height, 0:width]
    bent = map_coordinates(face, [down + field[1], across + field[0]], order=1, mode="nearest")
    moved = at
    for _ in range(4):  # the place that is taken from `at`
        moved = (
            at - np.array([map_coordinates(one, moved.T[::-1], order=1, mode="nearest") for one in field]).T
        )
    return np.asarray(bent), np.asarray(moved)


def _cascade(
    gradients: list[Gradients], targets: Float32, mean: Float64
) -> tuple[dict[str, np.ndarray], Float32]:
    """Return the regressions, each learned from where those before it end, and where the last one ends."""
    places = np.repeat(mean[None], len(targets), axis=0).astype(np.float32)
    all_weights, all_scales, all_bases = [], [], []
    for stage in STAGES:
        seen = _described(gradients, places, stage)
        off = (targets - places).reshape(len(targets), -1)
        weights = _regression(seen, off)
        basis = np.linalg.svd((seen @ weights)[::2], full_matrices=False)[2][:RESULTS]
        weights = weights @ basis.T
        scales = np.abs(weights[:-1]).max(axis=0) / 127
        exact = weights[-1] / scales  # the constant does not fit 8 bits
        whole = np.round(np.vstack([weights[:-1] / scales, exact]))
        all_weights.append(whole.astype(np.float32))
        all_scales.append(scales)
        all_bases.append(basis)
        places = places + ((seen @ whole * scales) @ basis).reshape(places.shape).astype(np.float32)
        error = np.linalg.norm(targets - places, axis=2).mean() / EYES
        print(f"stage {len(all_weights)}: {100 * error:.1f} % of the distance between the pupils", flush=True)
    return {
        "weights": np.array(all_weights).astype(np.int16),
        "scales": np.array(all_scales, dtype=np.float32),
        "bases": np.array(all_bases, dtype=np.float16),
    }, places


def _described(gradients: list[Gradients], places: Float32, stage: int) -> Float32:
    """Return what is seen around places (N, P, 2) in gradients (N), and a constant: (N, D + 1)."""
    rows = [
        describe(one[stage].astype(np.float32), at, REACHES[stage])
        for one, at in zip(gradients, places, strict=True)
    ]
    return np.column_stack([np.array(rows), np.ones(len(rows), dtype=np.float32)])


def _regression(seen: Float32, results: Float32, damping_share: float = DAMPING) -> Float32:
    """Return the weights (D + 1, R) of the ridge regression of results (N, R) on what is seen (N, D + 1)."""
    normal = seen.T @ seen
    damping = np.full(len(normal), damping_share * len(seen) * seen[:, :-1].var(axis=0).mean())
    damping[-1] = 1
    normal[np.diag_indices(len(normal))] += damping
    return np.asarray(cho_solve(cho_factor(normal), seen.T @ results))


def _no_faces(
    pictures: list[tuple[Float64, Float64]], mean: Float64, random: np.random.Generator
) -> Iterator[Float64]:
    """Yield what is cut out where no face is: beside it, in another size, or upside down."""
    for grey, at in pictures:
        middle, across = standard_frame(at, mean)
        eyes = float(np.linalg.norm(across))
        kind = int(random.integers(3))
        if kind == 0:
            middle = middle + random.uniform(0.8, 2.5) * eyes * unit(random.standard_normal(2) + 1e-9)
        elif kind == 1:
            across = across * random.choice([random.uniform(0.3, 0.6), random.uniform(1.7, 3)])
        else:
            across = -across
        yield standard_face(grey, *_misplaced(middle, across, random))


def _whole(
    pictures: list[tuple[Float64, Float64]], no_faces: list[Float64], random: np.random.Generator
) -> tuple[Float32, list[Float64]]:
    """Return the template of a whole face (4 * H * W + 1,), and what it took for faces, at standard size."""
    found = []
    for grey, at in pictures:
        frame = _misplaced((at[0] + at[1]) / 2, at[0] - at[1], random, 0.4)
        found.append(small_face(standard_face(grey, *frame)).ravel())
    others = [small_face(face).ravel() for face in no_faces]
    mistaken: list[Float64] = []
    for step in range(ROUNDS + 1):
        seen = np.array([*found, *others], dtype=np.float32)
        seen = np.column_stack([seen, np.ones(len(seen), dtype=np.float32)])
        sign = np.where(np.arange(len(seen)) < len(found), 1, -1)[:, None].astype(np.float32)
        whole = _regression(seen, sign, WHOLE_DAMPING)[:, 0]
        if step < ROUNDS:
            new = [face for one in pictures[step::4] for face in _mistaken(*one, whole)]
            others += [small_face(face).ravel() for face in new]
            mistaken += new
    return whole, mistaken


def _mistaken(grey: Float64, at: Float64, whole: Float32) -> Iterator[Float64]:
    """Yield what a template finds most like a face where there is none, at standard size."""
    true, eyes = (at[0] + at[1]) / 2, float(np.linalg.norm(at[0] - at[1]))
    for size in (0.4, 0.6, 0.8, 1.0, 1.3, 1.7):
        factor = EYES / SMALL / (eyes * size)
        likeness = whole_likeness(zoom(grey, factor, order=1, grid_mode=True, mode="nearest"), whole)
        down, right = np.mgrid[: likeness.shape[0], : likeness.shape[1]] / factor
        if 0.7 < size < 1.5:
            likeness[np.hypot(right - true[0], down - true[1]) < 0.4 * eyes] = -np.inf
        y, x = np.unravel_index(int(likeness.argmax()), likeness.shape)
        if likeness[y, x] > -0.5:
            yield standard_face(grey, np.array([x, y]) / factor, np.array([eyes * size, 0.0]))


def _likeness(
    arrays: dict[str, np.ndarray],
    mean: Float64,
    found: tuple[list[Gradients], Float32],
    others: list[Gradients],
) -> Float32:
    """Return the regression (D + 1,) that tells the surroundings of points that were found from others."""
    places = np.repeat(mean[None], len(others), axis=0).astype(np.float32)
    for k, stage in enumerate(STAGES):
        results = _described(others, places, stage) @ arrays["weights"][k] * arrays["scales"][k]
        places = places + (results @ arrays["bases"][k].astype(np.float32)).reshape(places.shape)
    is_face, is_none = _described(*found, 1)[::GUESSES], _described(others, places, 1)
    sign = np.append(np.ones(len(is_face)), -np.ones(len(is_none)))[:, None].astype(np.float32)
    return _regression(np.concatenate([is_face, is_none]), sign)[:, 0].astype(np.float32)


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
