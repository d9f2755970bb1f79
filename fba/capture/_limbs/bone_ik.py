"""Find joint angles that point bones in given directions, for joints that lack a degree of freedom."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fba import rotations
from fba.arrays import Float64

MAX_ITERATIONS = 8
"""Largest number of iterations."""
MAX_STEP = 0.5
"""Largest change of an angle in one iteration, in radians, so that almost straight limbs do not flip."""
MAX_CHANGE = 1e-7
"""Change in radians below which the iteration ends."""


@dataclass(frozen=True, eq=False)
class Target:
    """Target direction of a line of bones.

    pieces: the bones, (3,) or (T, 3), each with the number of axes that turn it, counted from the outermost.
    wanted: unit (T, 3).
    """

    pieces: tuple[tuple[Float64, int], ...]
    wanted: Float64


def product(axes: Float64, angles: Float64) -> Float64:
    """Return matrices (T, 3, 3): turns about axes (K, 3) by angles (T, K), outermost first."""
    result = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    for number, axis in enumerate(axes):
        result = result @ rotations.turn(axis, angles[:, number])
    return result


def aim(axes: Float64, start: Float64, bone: Float64, wanted: Float64, weights: Float64) -> Float64:
    """Return angles (T, K) whose turns about axes (K, 3) bring bone (3,) or (T, 3) to wanted (T, 3).

    Of all solutions, the one closest to start (T, K), by weights (K,): angles with small weights change most.
    Start must be close to a solution. Directions are unit vectors.
    """
    return aim_all(axes, start, (Target(((bone, len(axes)),), wanted),), weights)


def aim_all(axes: Float64, start: Float64, targets: Sequence[Target], weights: Float64) -> Float64:
    """Return angles (T, K) of nested turns about axes (K, 3) that reach several targets at once.

    See `aim`. If not all can be reached, the sum of squared errors is minimal. Gauss-Newton method.
    """
    angles = np.array(start)
    count = axes.shape[0]
    square = weights * weights
    for _ in range(MAX_ITERATIONS):
        frames = [np.broadcast_to(np.eye(3), (len(angles), 3, 3))]
        for number, axis in enumerate(axes):
            frames.append(frames[-1] @ rotations.turn(axis, angles[:, number]))
        world = [frames[number] @ axis for number, axis in enumerate(axes)]
        normal = np.zeros((len(angles), count, count)) + np.diag(square)
        pull = square * (start - angles)
        for target in targets:
            turned = [(frames[used] @ bone[..., None])[:, :, 0] for bone, used in target.pieces]
            line = np.sum(turned, axis=0)
            length = np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-12)
            line = line / length
            slopes = np.zeros((len(angles), 3, count))
            for number, axis in enumerate(world[: max(used for _, used in target.pieces)]):
                moved = sum(
                    (t for t, (_, used) in zip(turned, target.pieces, strict=True) if used > number),
                    np.zeros(3),
                )
                slope = rotations.cross(axis, np.broadcast_to(moved, line.shape)) / length
                slopes[:, :, number] = slope - line * np.einsum("ti,ti->t", slope, line)[:, None]
            normal += np.swapaxes(slopes, 1, 2) @ slopes
            pull += np.einsum("tik,ti->tk", slopes, target.wanted - line)
        step = np.linalg.solve(normal, pull[:, :, None])[:, :, 0]
        largest = np.abs(step).max(axis=1, keepdims=True)
        step *= np.minimum(1.0, MAX_STEP / np.maximum(largest, 1e-12))
        angles += step
        if np.abs(step).max(initial=0.0) < MAX_CHANGE:
            break
    return angles
