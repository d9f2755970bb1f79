"""The figure's rig in the standard's terms: H-Anim joints, what each moves, and how they stand.

The figure was modelled with its arms held off its sides. `Rig.bind` says how each joint is turned
there, seen from the standard's default posture (arms at the sides, palms to the thighs, feet forward).
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import figure
import numpy as np
import numpy.typing as npt

from fba.body import Skeleton
from fba.parameters import joints

Float64 = npt.NDArray[np.float64]
HERE = Path(__file__).parent
SKULLBASE = np.array([0.0, 1.6182, -0.0177])
"""Where the head turns: feature point 7.1 of the built-in head."""
TORSO = ("Root", "Hips", "Spine1", "Spine2", "Chest")
NECK = ("Neck1", "Neck2")
HEAD = ("Head", "HeadEnd", "Jaw", "LeftEye", "RightEye")
FINGERS = ("index", "middle", "ring", "pinky")


@dataclass(frozen=True, eq=False)
class Rig:
    """names: J joints, parents first. parents (J,). centres (J, 3): in the default posture, metres.
    bind (J, 4, 4): each joint as the figure is modelled. weights (V, J): rows sum to 1."""

    names: tuple[str, ...]
    parents: npt.NDArray[np.int64]
    centres: Float64
    bind: Float64
    weights: Float64


def rig() -> Rig:
    """The rig of the whole figure."""
    surface, data = figure.load()
    default = Skeleton.default()
    places = _places(data, default)
    turns = _turns(places, default)
    parents = default.parents
    bind = np.tile(np.eye(4), (len(default), 1, 1))
    bind[:, :3, :3], bind[:, :3, 3] = turns, places
    centres = places.copy()
    for number in range(1, len(default)):
        above = parents[number]
        centres[number] = centres[above] + turns[above].T @ (places[number] - places[above])
    return Rig(default.names, parents, centres, bind, _weights(surface, data, default, places))


def _places(data: dict[str, np.ndarray], default: Skeleton) -> Float64:
    """(J, 3) where the joints are in the figure as modelled."""
    source = dict(zip(data["joint_names"].tolist(), data["joint_centres"].astype(np.float64), strict=True))
    places = np.full((len(default), 3), np.nan)
    with (HERE / "rig.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            for side, word in (("l", "Left"), ("r", "Right")) if "?" in row["joint"] else (("", ""),):
                start = source[row["from"].replace("?", word)]
                end = source[row["to"].replace("?", word)] if row["to"] else start
                name = row["joint"].replace("?", side)
                places[default.number(name)] = start + (end - start) * float(row["share"])
    for side in "lr":  # where a foot turns on its heel, and bends at its middle
        ankle, toe = (places[default.number(f"{side}_{joint}")] for joint in ("ankle", "metatarsal"))
        places[default.number(f"{side}_subtalar")] = [ankle[0], ankle[1] * 0.55, ankle[2] + 0.012]
        places[default.number(f"{side}_midtarsal")] = (ankle * 0.4 + toe * 0.6) + (0, 0.008, 0)
    # Vertebrae stand along the figure's spine as they stand along the standard's.
    knots = np.array([source[name] for name in ("Hips", "Spine1", "Spine2", "Chest", "Neck1", "Neck2")])
    knots = np.concatenate([knots, SKULLBASE[None]])
    table = {joint.name: joint.centre for joint in joints()}
    known = [table["HumanoidRoot"][1], table["vc7"][1], table["skullbase"][1]]
    for number, name in enumerate(default.names):
        if np.isnan(places[number]).any():
            height = np.interp(table[name][1], known, [knots[0, 1], knots[4, 1], SKULLBASE[1]])
            places[number] = [0.0, height, np.interp(height, knots[:, 1], knots[:, 2])]
    places[default.number("skullbase")] = SKULLBASE
    return places


def _turns(places: Float64, default: Skeleton) -> Float64:
    """(J, 3, 3) rotations from the default posture to the figure as modelled."""
    turns = np.tile(np.eye(3), (len(default), 1, 1))
    at = {name: places[number] for number, name in enumerate(default.names)}
    rest = {name: default.centres[number] for number, name in enumerate(default.names)}

    def bone(joint: str, tip: str) -> tuple[Float64, Float64]:
        return rest[tip] - rest[joint], at[tip] - at[joint]

    def turn(joint: str, bones: tuple[Float64, Float64], sides: tuple[Float64, Float64]) -> None:
        before, after = (_frame(direction, side) for direction, side in zip(bones, sides, strict=True))
        turns[default.number(joint)] = after @ before.T

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
            turns[default.number(f"{s}_{finger}3")] = turns[default.number(f"{s}_{finger}2")]
        for k in (1, 2):
            turn(f"{s}_thumb{k}", bone(f"{s}_thumb{k}", f"{s}_thumb{k + 1}"), across)
        turns[default.number(f"{s}_thumb3")] = turns[default.number(f"{s}_thumb2")]
        foot = at[f"{s}_metatarsal"] - at[f"{s}_ankle"]
        ahead = (np.array([0.0, 0, 1]), np.array([foot[0], 0.0, foot[2]]))
        turn(f"{s}_hip", bone(f"{s}_hip", f"{s}_knee"), ahead)
        turn(f"{s}_knee", bone(f"{s}_knee", f"{s}_ankle"), ahead)
        flat = _frame(np.array([0.0, -1, 0]), ahead[1])
        for joint in ("ankle", "subtalar", "midtarsal", "metatarsal"):  # feet stand flat in both
            turns[default.number(f"{s}_{joint}")] = flat @ _frame(np.array([0.0, -1, 0]), ahead[0]).T
    return turns


def _frame(direction: Float64, side: Float64) -> Float64:
    """(3, 3) columns: the direction, what is left of the side across it, and both crossed."""
    first = direction / np.linalg.norm(direction)
    second = side - first * (first @ side)
    second /= np.linalg.norm(second)
    return np.stack([first, second, np.cross(first, second)], axis=1)


def _weights(
    surface: figure.Surface, data: dict[str, np.ndarray], default: Skeleton, places: Float64
) -> Float64:
    source = data["joint_names"].tolist()
    given = np.zeros((len(surface.vertices), len(source)))
    np.put_along_axis(given, data["weight_joints"].astype(int), data["weights"].astype(np.float64), axis=1)
    weights = np.zeros((len(surface.vertices), len(default)))
    with (HERE / "rig.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        if "?" not in row["from"] or row["share"] != "0":
            continue
        for side, word in (("l", "Left"), ("r", "Right")):
            column = given[:, source.index(row["from"].replace("?", word))]
            weights[:, default.number(row["joint"].replace("?", side))] += column
    height = surface.vertices[:, 1]
    groups = {
        "torso": ["sacroiliac", *_chain(default, "vl5", "vc7")],
        "neck": [*_chain(default, "vt1", "vc1"), "skullbase"],
    }
    for group, names in (("torso", TORSO), ("neck", NECK)):
        share = given[:, [source.index(name) for name in names]].sum(axis=1)
        numbers = [default.number(name) for name in groups[group]]
        weights[:, numbers] += share[:, None] * _hats(height, places[numbers, 1])
    weights[:, default.number("skullbase")] += given[:, [source.index(name) for name in HEAD]].sum(axis=1)
    for side in "lr":  # the sole's parts: toes bend, the rest follows the ankle
        _split(weights, default, surface, f"{side}_ankle", f"{side}_midtarsal", places)
        # The shoulder girdle: what is near the arm goes with the blade.
        out = np.abs(surface.vertices[:, 0])
        far = _smooth((out - 0.07) / 0.06)
        inner, outer = (
            default.number(f"{side}_{name}") for name in ("sternoclavicular", "acromioclavicular")
        )
        weights[:, outer] += weights[:, inner] * far
        weights[:, inner] *= 1 - far
    return weights / weights.sum(axis=1, keepdims=True)


def _split(
    weights: Float64, default: Skeleton, surface: figure.Surface, rear: str, front: str, places: Float64
) -> None:
    """Part of what one joint moves given to the joint before it, by how far forward it is."""
    a, b = default.number(rear), default.number(front)
    ahead = _smooth((surface.vertices[:, 2] - places[b, 2] + 0.02) / 0.04)
    weights[:, b] += weights[:, a] * ahead
    weights[:, a] *= 1 - ahead


def _chain(default: Skeleton, first: str, last: str) -> list[str]:
    names = [name for name in default.names if name.startswith("v")]
    order = sorted(names, key=lambda name: default.centres[default.number(name), 1])
    return order[order.index(first) : order.index(last) + 1]


def _hats(height: Float64, joints_at: Float64) -> Float64:
    """(V, K) shares of a chain of joints in what lies at a height: each moves what is above it."""
    middles = np.concatenate([(joints_at[:-1] + joints_at[1:]) / 2, [joints_at[-1] + 0.01]])
    shares = np.zeros((len(height), len(joints_at)))
    place = np.interp(height, middles, np.arange(len(middles)))
    low = np.floor(place).astype(int)
    high = np.minimum(low + 1, len(middles) - 1)
    rows = np.arange(len(height))
    shares[rows, low] += 1 - (place - low)
    shares[rows, high] += place - low
    for _ in range(2):  # eased over the neighbours
        padded = np.pad(shares, ((0, 0), (1, 1)), mode="edge")
        shares = (padded[:, :-2] + 2 * padded[:, 1:-1] + padded[:, 2:]) / 4
        shares /= shares.sum(axis=1, keepdims=True)
    return shares


def _smooth(value: Float64) -> Float64:
    t = np.clip(value, 0.0, 1.0)
    return t * t * (3 - 2 * t)
