"""Joint matrices of a modelled figure, relative to the standard's default posture.

Models are made with their arms held off the sides or straight out. The directions of bones give each
joint's rotation relative to the default posture: arms at the sides, palms to the thighs, feet forward.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.body._skeleton import Skeleton
from fba.parameters import joints

FINGERS = ("index", "middle", "ring", "pinky")


def bind_matrices(positions: Float64) -> Float64:
    """Return bind matrices, float64 (J, 4, 4), for positions (J, 3) of the default skeleton's joints, metres.

    The figure stands upright, feet flat, looking along +z. Limbs are rotated as their bones are; trunk and
    head are not rotated.
    """
    default = Skeleton.default()
    bind = np.tile(np.eye(4), (len(default), 1, 1))
    bind[:, :3, 3] = positions
    centres = {name: positions[number] for number, name in enumerate(default.names)}
    rest = {name: default.centres[number] for number, name in enumerate(default.names)}

    def bone(joint: str, tip: str) -> tuple[Float64, Float64]:
        return rest[tip] - rest[joint], centres[tip] - centres[joint]

    def turn(joint: str, bones: tuple[Float64, Float64], sides: tuple[Float64, Float64]) -> None:
        before, after = (
            orthonormal_frame(direction, side) for direction, side in zip(bones, sides, strict=True)
        )
        bind[default.number(joint), :3, :3] = after @ before.T

    def follow(joint: str, other: str) -> None:
        bind[default.number(joint), :3, :3] = bind[default.number(other), :3, :3]

    for s in "lr":
        upper, lower = bone(f"{s}_shoulder", f"{s}_elbow"), bone(f"{s}_elbow", f"{s}_wrist")
        hinge = (np.array([-1.0, 0, 0]), np.cross(upper[1], lower[1]))  # the elbow bends forwards
        turn(f"{s}_shoulder", upper, hinge)
        turn(f"{s}_elbow", lower, hinge)
        across = bone(f"{s}_pinky1", f"{s}_index1")
        turn(f"{s}_wrist", bone(f"{s}_wrist", f"{s}_middle1"), across)
        for finger in FINGERS:
            for k in (0, 1, 2):
                turn(f"{s}_{finger}{k}", bone(f"{s}_{finger}{k}", f"{s}_{finger}{k + 1}"), across)
            follow(f"{s}_{finger}3", f"{s}_{finger}2")
        for k in (1, 2):
            turn(f"{s}_thumb{k}", bone(f"{s}_thumb{k}", f"{s}_thumb{k + 1}"), across)
        follow(f"{s}_thumb3", f"{s}_thumb2")
        foot = centres[f"{s}_metatarsal"] - centres[f"{s}_ankle"]
        ahead = (np.array([0.0, 0, 1]), np.array([foot[0], 0.0, foot[2]]))
        turn(f"{s}_hip", bone(f"{s}_hip", f"{s}_knee"), ahead)
        turn(f"{s}_knee", bone(f"{s}_knee", f"{s}_ankle"), ahead)
        down = np.array([0.0, -1, 0])
        flat = orthonormal_frame(down, ahead[1]) @ orthonormal_frame(down, ahead[0]).T
        for joint in ("ankle", "subtalar", "midtarsal", "metatarsal"):  # feet stand flat in both
            bind[default.number(f"{s}_{joint}"), :3, :3] = flat
    return bind


def skeleton_in_default_posture(bind: Float64) -> Skeleton:
    """Return the skeleton in the default posture of a figure with bind matrices (J, 4, 4)."""
    default = Skeleton.default()
    centres = bind[:, :3, 3].copy()
    for number in range(1, len(default)):
        above = default.parents[number]
        shift = bind[number, :3, 3] - bind[above, :3, 3]
        centres[number] = centres[above] + bind[above, :3, :3].T @ shift
    return Skeleton(default.names, default.parents, centres)


def place_vertebrae(positions: Float64, knots: Float64, neck: int) -> None:
    """Fill NaN rows of positions (J, 3) in place: vertebrae and other midline joints, along a spine.

    knots: (K, 3), points along the figure's spine from the pelvis up to the base of the skull, metres; knot
    number `neck` is where the neck begins. Heights between pelvis, neck and skull are in the proportions of
    the standard's body.
    """
    default = Skeleton.default()
    table = {joint.name: joint.centre for joint in joints()}
    known = [table["HumanoidRoot"][1], table["vc7"][1], table["skullbase"][1]]
    own = [knots[0, 1], knots[neck, 1], knots[-1, 1]]
    for number, name in enumerate(default.names):
        if np.isnan(positions[number]).any():
            height = np.interp(table[name][1], known, own)
            positions[number] = [0.0, height, np.interp(height, knots[:, 1], knots[:, 2])]


def vertebrae_between(first: str, last: str) -> list[str]:
    """Return names of the vertebrae from `first` to `last`, upwards, both included."""
    default = Skeleton.default()
    names = [name for name in default.names if name.startswith("v")]
    order = sorted(names, key=lambda name: default.centres[default.number(name), 1])
    return order[order.index(first) : order.index(last) + 1]


def chain_weights(height: Float64, joints_at: Float64, eased: int = 1) -> Float64:
    """Return (V, K) weights of a vertical chain of joints for vertices, at heights (K,) and (V,), metres.

    eased: how often weights are smoothed over the neighbours in the chain. At first two joints share a
    vertex, and two more after each smoothing; a vertex can have four.
    """
    middles = np.concatenate([(joints_at[:-1] + joints_at[1:]) / 2, [joints_at[-1] + 0.01]])
    weights = np.zeros((len(height), len(joints_at)))
    level = np.interp(height, middles, np.arange(len(middles)))
    low = np.floor(level).astype(int)
    high = np.minimum(low + 1, len(middles) - 1)
    rows = np.arange(len(height))
    weights[rows, low] += 1 - (level - low)
    weights[rows, high] += level - low
    for _ in range(eased):
        padded = np.pad(weights, ((0, 0), (1, 1)), mode="edge")
        weights = (padded[:, :-2] + 2 * padded[:, 1:-1] + padded[:, 2:]) / 4
        weights /= weights.sum(axis=1, keepdims=True)
    return weights


def orthonormal_frame(direction: Float64, side: Float64) -> Float64:
    """Return (3, 3), orthonormal columns: direction, side made perpendicular to it, cross product."""
    first = direction / max(float(np.linalg.norm(direction)), 1e-12)
    second = side - first * (first @ side)
    second = second / max(float(np.linalg.norm(second)), 1e-12)
    return np.stack([first, second, np.cross(first, second)], axis=1)
