"""The figure's rig in the standard's terms: H-Anim joints, their weights and their modelled rotations.

The figure was modelled with its arms held off its sides. `Rig.bind` holds the rotation of each joint there,
relative to the standard's default posture (arms at the sides, palms to the thighs, feet forward).
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fba.arrays import Float64, Int64
from fba.body import Skeleton
from fba.body.solve._bind_pose import (
    FINGERS,
    bind_matrices,
    chain_weights,
    place_vertebrae,
    skeleton_in_default_posture,
    vertebrae_between,
)
from fba.sampling import smoothstep
from tools.figure import arms, bending, figure
from tools.figure.person import Person, make_person, reproportion

HERE = Path(__file__).parent / "data"
SKULLBASE = np.array([0.0, 1.6182, -0.0177])
"""Centre of the head's rotation: feature point 7.1 of the built-in head."""
TORSO = ("Root", "Hips", "Spine1", "Spine2", "Chest")
NECK = ("Neck1", "Neck2")
ARM = ("shoulder", "elbow", "wrist", "thumb", *FINGERS)
HEAD = ("Head", "HeadEnd", "Jaw", "LeftEye", "RightEye")

CAP = (-0.14, 0.05)
"""Heights from the joint over which moving in the cap fades in, metres."""
LEFT = 0.48
"""Share that remains of its distance beyond SIDE, at the upper of these heights."""
SIDE = -0.010
"""Metres out from the joint from which that distance is measured."""
STRAIGHT = (0.13, 0.80)
"""Heights between which the outline of a leg is evened out, metres."""
EVEN, ROUND = 0.13, 0.16
"""Metres along the leg over which it is, and the length as which a radian around it counts."""
KNUCKLE = (0.010, 0.008, 0.0042)
"""Metres of a knuckle off the joint, to its edge, and by which it stands out."""


@dataclass(frozen=True, eq=False)
class Rig:
    """A rig of J joints.

    names: of the joints, parents first. parents (J,). centres (J, 3): in the default posture, metres.
    bind (J, 4, 4): each joint as the person is modelled. weights (V, J) of its vertices: rows sum to 1.
    """

    names: tuple[str, ...]
    parents: Int64
    centres: Float64
    bind: Float64
    weights: Float64


def make_rig() -> tuple[Person, Rig]:
    """Return the person, and its rig."""
    surface, data = figure.load()
    default = Skeleton.default()
    given = _joint_positions(data, default)
    coarse = _weights(surface, data, default, given)
    arm = np.array([name[2:].startswith(ARM) for name in default.names])
    made = make_person(surface, dict(zip(default.names, given, strict=True)), coarse[:, arm].sum(axis=1))
    positions = reproportion(given, arm.astype(np.float64))
    bind = bind_matrices(positions)
    weights = bending.ease_limb_weights(
        made, dict(zip(default.names, positions, strict=True)), made.blend @ coarse
    )
    return made, Rig(default.names, default.parents, skeleton_in_default_posture(bind).centres, bind, weights)


def _joint_positions(data: dict[str, np.ndarray], default: Skeleton) -> Float64:
    """Return (J, 3) positions of the joints in the figure as modelled, metres."""
    source = dict(zip(data["joint_names"].tolist(), data["joint_centres"].astype(np.float64), strict=True))
    positions = np.full((len(default), 3), np.nan)
    with (HERE / "rig.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            for side, word in (("l", "Left"), ("r", "Right")) if "?" in row["joint"] else (("", ""),):
                start = source[row["from"].replace("?", word)]
                end = source[row["to"].replace("?", word)] if row["to"] else start
                name = row["joint"].replace("?", side)
                positions[default.number(name)] = start + (end - start) * float(row["share"])
    for side in "lr":  # joints at the heel and in the middle of the foot
        ankle, toe = (positions[default.number(f"{side}_{joint}")] for joint in ("ankle", "metatarsal"))
        positions[default.number(f"{side}_subtalar")] = [ankle[0], ankle[1] * 0.55, ankle[2] + 0.012]
        positions[default.number(f"{side}_midtarsal")] = (ankle * 0.4 + toe * 0.6) + (0, 0.008, 0)
    # Vertebrae are distributed along the figure's spine in the standard's proportions.
    knots = np.array([source[name] for name in ("Hips", "Spine1", "Spine2", "Chest", "Neck1", "Neck2")])
    knots = np.concatenate([knots, SKULLBASE[None]])
    place_vertebrae(positions, knots, 4)
    positions[default.number("skullbase")] = SKULLBASE
    return positions


def _weights(
    surface: figure.Surface, data: dict[str, np.ndarray], default: Skeleton, positions: Float64
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
        "torso": ["sacroiliac", *vertebrae_between("vl5", "vc7")],
        "neck": [*vertebrae_between("vt1", "vc1"), "skullbase"],
    }
    for group, names in (("torso", TORSO), ("neck", NECK)):
        share = given[:, [source.index(name) for name in names]].sum(axis=1)
        numbers = [default.number(name) for name in groups[group]]
        weights[:, numbers] += share[:, None] * chain_weights(
            height, positions[numbers, 1], 1 if group == "torso" else 0
        )
    weights[:, default.number("skullbase")] += given[:, [source.index(name) for name in HEAD]].sum(axis=1)
    for side in "lr":  # the foot: toes bend, the rest follows the ankle
        _share_forward(weights, default, surface, f"{side}_ankle", f"{side}_midtarsal", positions)
        # The shoulder girdle: weight near the arm goes to the blade.
        out = np.abs(surface.vertices[:, 0])
        far = smoothstep((out - 0.07) / 0.06)
        inner, outer = (
            default.number(f"{side}_{name}") for name in ("sternoclavicular", "acromioclavicular")
        )
        weights[:, outer] += weights[:, inner] * far
        weights[:, inner] *= 1 - far
    return weights / weights.sum(axis=1, keepdims=True)


def _share_forward(
    weights: Float64, default: Skeleton, surface: figure.Surface, rear: str, front: str, positions: Float64
) -> None:
    """Give part of the rear joint's weight to the front joint, in place, by how far forward vertices are."""
    a, b = default.number(rear), default.number(front)
    ahead = smoothstep((surface.vertices[:, 2] - positions[b, 2] + 0.02) / 0.04)
    weights[:, b] += weights[:, a] * ahead
    weights[:, a] *= 1 - ahead


def stand(vertices: Float64, weights: Float64, bones: Rig) -> tuple[Float64, Float64]:
    """Return points (V, 3) of the figure in the default posture, and the rotations (V, 3, 3) to there."""
    upright = np.tile(np.eye(4), (len(bones.names), 1, 1))
    upright[:, :3, 3] = bones.centres
    standing = upright @ np.linalg.inv(bones.bind)
    turned = np.einsum("vj,jab->vab", weights, standing)
    points = np.pad(vertices, ((0, 0), (0, 1)), constant_values=1.0)
    return np.einsum("vab,vb->va", turned, points)[:, :3], turned[:, :3, :3]


def arm_joints(bones: Rig, side: str) -> Float64:
    """Return (3, 3), where shoulder, elbow and wrist are in the default posture."""
    return bones.centres[[bones.names.index(f"{side}_{name}") for name in ("shoulder", "elbow", "wrist")]]


def shape_for_standing(person: Person, bones: Rig) -> Person:
    """Return the person reshaped where clothes lie on it, for hanging arms and straight legs.

    With the arms down, the cap of the figure's shoulder would stick out as a corner beside the joint; a
    person's slopes from the neck into the arm. Cloth falls from the thigh past the hollows of knee and shin.
    Arms get muscles and bones. All is made in the default posture, and transformed back into that of the
    figure.
    """
    positions, turned = stand(person.vertices, bones.weights, bones)
    shift = np.zeros_like(positions)
    for side, sign in (("l", 1.0), ("r", -1.0)):
        joint = bones.centres[bones.names.index(f"{side}_shoulder")]
        out = sign * (positions[:, 0] - joint[0]) - SIDE
        high = smoothstep((positions[:, 1] - joint[1] - CAP[0]) / (CAP[1] - CAP[0]))
        shift[:, 0] -= sign * np.maximum(out, 0.0) * (1 - LEFT) * high
        knee = bones.centres[bones.names.index(f"{side}_knee")]
        mine = (sign * positions[:, 0] > 0) & (person.arms < 0.5) & (positions[:, 1] < STRAIGHT[1])
        shift[mine] += _straighten(positions[mine] - (knee[0], 0.0, knee[2]))
        mirror = np.array([sign, 1.0, 1.0])
        own = (person.arms > 0.5) & (sign * positions[:, 0] > 0)
        shift += mirror * arms.shape_arm(positions * mirror, arm_joints(bones, side) * mirror, own)
        for finger in FINGERS:
            knuckle = bones.centres[bones.names.index(f"{side}_{finger}1")] + (sign * KNUCKLE[0], 0.0, 0.0)
            near = np.exp(-(((positions - knuckle) / KNUCKLE[1]) ** 2).sum(axis=1))
            shift[:, 0] += sign * KNUCKLE[2] * near
    back = np.einsum("vab,va->vb", turned, shift)  # by the inverse rotations
    return replace(person, vertices=person.vertices + back)


def _straighten(p: Float64) -> Float64:
    """Return by how much points (N, 3) about the upright axis of a leg are moved, to even out its outline."""
    away = np.hypot(p[:, 0], p[:, 2])
    used = p[:, 1] > STRAIGHT[0]
    chart = np.stack([ROUND * p[:, 0] / away, ROUND * p[:, 2] / away, p[:, 1]], axis=1) / EVEN
    moved = np.zeros_like(p)
    for k in np.flatnonzero(used):
        near = np.exp(-((chart[used] - chart[k]) ** 2).sum(axis=1))
        # A straight line through the radii near it keeps the taper, also at the ends.
        line = np.polyfit(p[used, 1] - p[k, 1], away[used], 1, w=np.sqrt(near))
        moved[k] = p[k] * (1.0, 0.0, 1.0) * (line[1] / away[k] - 1)
    fade = smoothstep((STRAIGHT[1] - p[:, 1]) / 0.20) * smoothstep((p[:, 1] - STRAIGHT[0]) / 0.08)
    return moved * fade[:, None]
