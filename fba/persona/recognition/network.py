"""A network of one hidden layer of tanh units and a linear output for each class, trained by SciPy's
L-BFGS."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64

DECAY = 1e-4
"""Weight of the squared weights beside the mean squared error."""
MAX_ROUNDS = 16
"""Rounds of training, at most; after each the error of the examples for validation is measured."""
ROUND_STEPS = 25
"""Steps of L-BFGS in a round."""
BLOCK = 256
"""Examples multiplied at once: so few that one thread does it; threads of a busy machine wait for others."""
PATIENCE = 2
"""Rounds after which training ends if that error has not fallen."""


@dataclass(frozen=True, eq=False)
class Network:
    """outputs = tanh(inputs . hidden + hidden_shift) . output + output_shift.

    hidden: float64 (D, H); hidden_shift: (H,); output: (H, C); output_shift: (C,).
    """

    hidden: Float64
    hidden_shift: Float64
    output: Float64
    output_shift: Float64

    def __call__(self, inputs: Float64) -> Float64:
        """Return outputs (..., C), about -1 to 1, for inputs (..., D)."""
        return np.asarray(np.tanh(inputs @ self.hidden + self.hidden_shift) @ self.output + self.output_shift)


@dataclass(frozen=True)
class Training:
    """A network and how it was found. share: of the validation examples that are right; tries: networks
    trained."""

    network: Network
    share: float
    tries: int


def train(
    inputs: Float64,
    targets: Bool,
    check: Bool,
    *,
    units: int,
    enough: float,
    tries: int = 3,
    seed: int = 0,
) -> Training:
    """Return the first network that is right for more than `enough` of the validation examples, or the best
    one.

    inputs: (N, D); targets: bool (N, C), the classes of each, one or several; check: bool (N,), those kept
    for validation. A network is right where its largest output is one of the classes. The examples of a class
    count as much as they would in equal numbers; training ends when the error of validation rises.
    """
    random = np.random.default_rng(seed)
    best: Training | None = None
    for number in range(tries):
        network = _train_once(inputs, targets, check, units, random)
        share = share_right(network(inputs[check]), targets[check])
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
    inputs: Float64, targets: Bool, check: Bool, units: int, random: np.random.Generator
) -> Network:
    """Return a network trained from random weights; arguments as of `train`."""
    from scipy.optimize import minimize

    sizes = [inputs.shape[1], units, targets.shape[1]]
    spread = 1 / np.sqrt(sizes[0])
    parts = [
        random.normal(0, spread, (sizes[0], units)), np.zeros(units),
        random.normal(0, 1 / np.sqrt(units), (units, sizes[2])), np.zeros(sizes[2]),
    ]  # fmt: skip
    weights = np.concatenate([part.ravel() for part in parts])
    wanted = np.where(targets, 1.0, -1.0)
    importance, check_importance = _importance(targets[~check]), _importance(targets[check])
    best, best_error, risen = weights, np.inf, 0
    for _ in range(MAX_ROUNDS):
        found = minimize(
            _loss, weights, args=(sizes, inputs[~check], wanted[~check], importance), jac=True,
            method="L-BFGS-B", options={"maxiter": ROUND_STEPS, "maxcor": 20},
        )  # fmt: skip
        weights = found.x
        error = float(
            (check_importance * (_unpack(weights, sizes)(inputs[check]) - wanted[check]) ** 2).sum()
        )
        if error < best_error:
            best, best_error, risen = weights, error, 0
        else:
            risen += 1
        if risen >= PATIENCE or found.nit < ROUND_STEPS:
            break
    return _unpack(best, sizes)


def _importance(targets: Bool) -> Float64:
    """Return how much each output of each example counts: (N, C), in sum 1; wanted ones as much as all
    others."""
    counts = np.maximum(targets.sum(axis=0), 1)
    own = (targets / counts).max(axis=1)  # the rarest class of an example
    wanted = targets * 1.0
    others = (1.0 - wanted) / np.maximum((1.0 - wanted).sum(axis=1, keepdims=True), 1)
    each: Float64 = own[:, None] * (wanted + 2.0 * others)
    return np.asarray(each / each.sum())


def _unpack(weights: Float64, sizes: list[int]) -> Network:
    inputs, units, classes = sizes
    ends = np.cumsum([inputs * units, units, units * classes])
    hidden, hidden_shift, output, output_shift = np.split(weights, ends)
    return Network(hidden.reshape(inputs, units), hidden_shift, output.reshape(units, classes), output_shift)


def _loss(
    weights: Float64, sizes: list[int], inputs: Float64, wanted: Float64, importance: Float64
) -> tuple[float, Float64]:
    """Return the error of a network and its slope by each weight (back-propagation)."""
    network = _unpack(weights, sizes)
    error, slope = DECAY * float(weights @ weights) / len(weights), 2 * DECAY * weights / len(weights)
    for first in range(0, len(inputs), BLOCK):
        some, goal, counts = (array[first : first + BLOCK] for array in (inputs, wanted, importance))
        hidden = np.tanh(some @ network.hidden + network.hidden_shift)
        off = hidden @ network.output + network.output_shift - goal
        weighted = counts * off
        back = (weighted @ network.output.T) * (1 - hidden**2)
        slopes = [some.T @ back, back.sum(axis=0), hidden.T @ weighted, weighted.sum(axis=0)]
        error += float((weighted * off).sum())
        slope += 2 * np.concatenate([one.ravel() for one in slopes])
    return error, slope
