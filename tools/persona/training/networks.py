"""Training of a part's network: SciPy's L-BFGS, over examples held back for validation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64
from fba.persona.recognition import Component, Network

DIMENSIONS = {"mouth": 11, "left_eye": 5, "right_eye": 5, "left_brow": 5, "right_brow": 5}
"""Number of principal components of each part."""
UNITS = {"mouth": 30, "left_eye": 20, "right_eye": 20, "left_brow": 20, "right_brow": 20}
"""Number of hidden units of each network."""
WANTED_ACCURACY = {"mouth": 0.6, "left_eye": 0.9, "right_eye": 0.9, "left_brow": 0.9, "right_brow": 0.9}
"""Share of the validation examples that a network must get right."""
MIN_SPREAD = 0.4
"""Smallest standard deviation of a coordinate, millimetres: otherwise the noise of steady points, such as the
corners of the eyes, would be scaled up."""
DECAY = 1e-4
"""Weight of the squared weights, relative to the mean squared error."""
MAX_ROUNDS = 16
"""Largest number of rounds of training; the validation error is measured after each."""
ROUND_STEPS = 25
"""Steps of L-BFGS in a round."""
BLOCK = 256
"""Examples multiplied at once: so few that NumPy uses one thread."""
PATIENCE = 2
"""Rounds after which training ends if the validation error has not fallen."""


@dataclass(frozen=True)
class Training:
    """A network, the share of the validation examples it gets right, and how many networks were trained."""

    network: Network
    share: float
    tries: int


def train(
    inputs: Float64,
    targets: Bool,
    check_inputs: Float64,
    check_targets: Bool,
    *,
    units: int,
    enough: float,
    tries: int = 3,
    seed: int = 0,
) -> Training:
    """Return the first network that gets more than `enough` of the validation examples right, else the best.

    inputs: (N, D). targets: bool (N, C), one or several classes of each. check_inputs, check_targets: the
    same for validation. A network is right where its largest output is one of the classes. Examples are
    weighted as if every class had equally many; training ends when the validation error rises.
    """
    random = np.random.default_rng(seed)
    best: Training | None = None
    for number in range(tries):
        network = _train_once(inputs, targets, check_inputs, check_targets, units, random)
        share = share_right(network(check_inputs), check_targets)
        if best is None or share > best.share:
            best = Training(network, share, number + 1)
        if share > enough:
            break
    assert best is not None
    return best


def share_right(outputs: Float64, targets: Bool) -> float:
    """Return the share of examples whose largest output is one of their classes."""
    return float(targets[np.arange(len(targets)), outputs.argmax(axis=1)].mean())


def _train_once(
    inputs: Float64,
    targets: Bool,
    check: Float64,
    check_targets: Bool,
    units: int,
    random: np.random.Generator,
) -> Network:
    from scipy.optimize import minimize

    sizes = [inputs.shape[1], units, targets.shape[1]]
    spread = 1 / np.sqrt(sizes[0])
    parts = [
        random.normal(0, spread, (sizes[0], units)), np.zeros(units),
        random.normal(0, 1 / np.sqrt(units), (units, sizes[2])), np.zeros(sizes[2]),
    ]  # fmt: skip
    weights = np.concatenate([part.ravel() for part in parts])
    wanted, importance = np.where(targets, 1.0, -1.0), _importance(targets)
    checked, check_importance = np.where(check_targets, 1.0, -1.0), _importance(check_targets)
    best, best_error, risen = weights, np.inf, 0
    for _ in range(MAX_ROUNDS):
        step = minimize(
            _loss, weights, args=(sizes, inputs, wanted, importance), jac=True, method="L-BFGS-B",
            options={"maxiter": ROUND_STEPS, "maxcor": 20},
        )  # fmt: skip
        weights = step.x
        error = float((check_importance * (_unpack(weights, sizes)(check) - checked) ** 2).sum())
        if error < best_error:
            best, best_error, risen = weights, error, 0
        else:
            risen += 1
        if risen >= PATIENCE or step.nit < ROUND_STEPS:
            break
    return _unpack(best, sizes)


def _importance(targets: Bool) -> Float64:
    """Return the weights (N, C) of outputs, sum 1; wanted outputs weigh as much as the others."""
    counts = np.maximum(targets.sum(axis=0), 1)
    rarest = (targets / counts).max(axis=1)  # of the classes of an example
    wanted = targets * 1.0
    others = (1.0 - wanted) / np.maximum((1.0 - wanted).sum(axis=1, keepdims=True), 1)
    each: Float64 = rarest[:, None] * (wanted + 2.0 * others)
    return np.asarray(each / each.sum())


def _unpack(weights: Float64, sizes: list[int]) -> Network:
    inputs, units, classes = sizes
    ends = np.cumsum([inputs * units, units, units * classes])
    hidden, hidden_shift, output, output_shift = np.split(weights, ends)
    return Network(hidden.reshape(inputs, units), hidden_shift, output.reshape(units, classes), output_shift)


def _loss(
    weights: Float64, sizes: list[int], inputs: Float64, wanted: Float64, importance: Float64
) -> tuple[float, Float64]:
    """Return the error of a network and its gradient (back-propagation)."""
    network = _unpack(weights, sizes)
    error, slope = DECAY * float(weights @ weights) / len(weights), 2 * DECAY * weights / len(weights)
    for first in range(0, len(inputs), BLOCK):
        rows, goal, counts = (array[first : first + BLOCK] for array in (inputs, wanted, importance))
        hidden = np.tanh(rows @ network.hidden + network.hidden_shift)
        off = hidden @ network.output + network.output_shift - goal
        weighted = counts * off
        back = (weighted @ network.output.T) * (1 - hidden**2)
        slopes = [rows.T @ back, back.sum(axis=0), hidden.T @ weighted, weighted.sum(axis=0)]
        error += float((weighted * off).sum())
        slope += 2 * np.concatenate([each.ravel() for each in slopes])
    return error, slope


def train_component(
    part: str,
    classes: tuple[str, ...],
    moved: Float64,
    targets: Bool,
    check: Bool,
    *,
    tries: int = 3,
    seed: int = 0,
) -> Component:
    """Return the trained component of a part.

    moved: displacements (N, 2K) of examples. targets: bool (N, C), their classes. check: bool (N,), the
    examples for validation.
    """
    used = targets.any(axis=1)
    mean, spread = moved[~check].mean(axis=0), np.maximum(moved[~check].std(axis=0), MIN_SPREAD)
    standard = (moved - mean) / spread
    variance, axes = find_axes(standard[~check])
    axes = axes[: DIMENSIONS[part]]
    scores = standard @ axes.T
    learnt, checked = used & ~check, used & check
    training = train(
        scores[learnt], targets[learnt], scores[checked], targets[checked],
        units=UNITS[part], enough=WANTED_ACCURACY[part], tries=tries, seed=seed,
    )  # fmt: skip
    return Component(part, classes, mean, spread, axes, variance, training.network, training.share)


def find_axes(values: Float64) -> tuple[Float64, Float64]:
    """Return the principal components of values (N, K): shares of variance (K,) and axes (K, K).

    Axes are rows, in order of decreasing variance; the largest number of each is positive.
    """
    centred = values - values.mean(axis=0)
    sizes, vectors = np.linalg.eigh(centred.T @ centred)
    sizes, axes = np.maximum(sizes[::-1], 0.0), vectors.T[::-1]
    largest = axes[np.arange(len(axes)), np.abs(axes).argmax(axis=1)]
    return np.asarray(sizes / sizes.sum()), np.asarray(axes * np.sign(largest)[:, None])
