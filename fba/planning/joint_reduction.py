"""Fewer joints: those that others can turn for, without anything moving far, are not turned at all."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.body.solve.conventions import NO_BAP
from fba.planning.body_rows import BodyTarget, all_rows, blocks

SAMPLES = 160
"""Frames by which joints are chosen; the choice is then checked at all frames."""


def reduce_joints(target: BodyTarget, share: float) -> Float64:
    """Return BAPs (T, 296) that turn as few joints as can be, within a share of the tolerance at every frame.

    What is left out is made up for by the joints below: a spine bends at a few vertebrae instead of all.
    """
    solver = target.solver
    rows = all_rows(solver.skeleton)
    rules = solver.convention
    moved = np.asarray(target.values.any(axis=0))
    used = [
        joint
        for joint, columns in zip(rules.joints, rules.bap, strict=True)
        if joint in solver.skeleton and moved[columns[columns != NO_BAP]].any()
    ]
    frames = np.unique(np.linspace(0, len(target.values) - 1, SAMPLES).astype(int))
    matrices = solver.pose(target.values[frames])
    wanted, weights = rows.points(matrices), target.weights(rows)[frames]

    def off_without(joint: str) -> float:
        solved = solver.solve(matrices, [one for one in kept if one != joint], target.values[0])
        apart = rows.points(solver.pose(solved)) - wanted
        return float((np.linalg.norm(apart, axis=2) * weights).max())

    root = solver.skeleton.names[0]
    kept, dropped = list(used), []
    candidates = [joint for joint in used if joint != root]
    while candidates:
        off = {joint: off_without(joint) for joint in candidates}
        candidates = [joint for joint in candidates if off[joint] <= share]
        if candidates:
            best = min(candidates, key=lambda joint: off[joint])
            candidates.remove(best)
            kept.remove(best)
            dropped.append(best)
    while dropped:
        reduced = _solve(target, kept)
        if target.longest(reduced, rows).max(initial=0.0) <= share:
            return reduced
        kept.append(dropped.pop())
    return target.values


def _solve(target: BodyTarget, joints: list[str]) -> Float64:
    """Return BAPs (T, 296) of the same poses that turn only these joints."""
    result = np.zeros_like(target.values)
    previous = target.values[0]
    for block in blocks(len(result)):
        matrices = target.solver.pose(target.values[block])
        result[block] = target.solver.solve(matrices, joints, previous)
        previous = result[block.stop - 1]
    result[:, 186:] = target.values[:, 186:]
    return result
