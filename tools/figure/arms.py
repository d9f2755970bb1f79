"""Arms: muscles and bones that the figure only hints at, and the picture of their skin.

Both are given for the left arm as it hangs, palm to the thigh, by metres beyond the elbow and degrees around
the bone, from the front outwards.
"""

from __future__ import annotations

import numpy as np
from hair import noise
from paint import encode_linear

from fba.arrays import Bool, Float64, Int64
from fba.sampling import smoothstep

FORMS = (
    # beyond the elbow, around; metres and degrees over which it fades; its height, millimetres
    (-0.110, -10, 0.050, 40, 3.5),  # biceps
    (-0.030, 58, 0.034, 22, -2.5),  # groove beside it
    (-0.125, 165, 0.050, 35, 3.5),  # triceps
    (-0.048, 178, 0.028, 28, -3.5),  # its tendon
    (-0.004, 178, 0.015, 24, 6.5),  # point of the elbow
    (0.002, 138, 0.017, 18, -3.5),  # hollows on both sides of it
    (0.000, -142, 0.017, 18, -3.0),
    (-0.014, -100, 0.014, 24, 4.0),  # inner and outer knob above the joint
    (-0.008, 108, 0.014, 20, 2.0),
    (0.006, -5, 0.019, 34, -4.0),  # pit of the elbow
    (0.052, 52, 0.048, 36, 6.5),  # brachioradialis
    (-0.005, 62, 0.034, 26, 3.0),
    (0.075, 118, 0.048, 26, 3.0),  # extensors
    (0.062, -78, 0.052, 40, 5.0),  # flexors
    (0.085, 160, 0.065, 18, -2.5),  # along the ulna
    (0.195, 0, 0.045, 999, -2.5),  # forearm before the wrist
    (0.252, 138, 0.011, 30, 4.0),  # head of the ulna
    (0.246, 20, 0.014, 30, 1.5),  # end of the radius
    (0.236, -90, 0.025, 50, -1.5),
)
CREASES = (
    # beyond the elbow, around; half its length in degrees; millimetres and depth
    (0.003, -5, 52, 0.9, 0.20), (0.012, 2, 38, 0.8, 0.13), (-0.008, -12, 34, 0.8, 0.08),  # in the pit
    (-0.019, 178, 36, 0.9, 0.12), (-0.011, 176, 42, 0.9, 0.14), (-0.001, 181, 40, 0.9, 0.13),  # on the elbow
    (0.009, 178, 32, 0.9, 0.09),
    (0.258, -90, 62, 0.8, 0.16), (0.266, -88, 70, 0.8, 0.18),  # below the palm
)  # fmt: skip
VEINS = (
    # points (beyond the elbow, around)
    ((-0.12, 40), (-0.03, 32), (0.05, 38), (0.14, 52), (0.24, 62)),
    ((0.00, 20), (0.03, -20), (0.09, -58), (0.17, -66), (0.24, -75)),
    ((0.02, 8), (0.07, -12), (0.13, -30), (0.20, -52)),
    ((0.27, 70), (0.31, 84), (0.345, 88)), ((0.28, 112), (0.31, 100), (0.35, 110)),
)  # fmt: skip
SIZE = 768
"""Texels of the picture along each side."""
WIDE, AROUND = 0.68, 0.25
"""Metres of the picture along each side, and of a turn around an arm."""
FIRST = -0.19
"""Metres beyond the elbow of its upper edge."""
WHITE = 0.78
"""Linear light of even skin in the picture; the colours of vertices are divided by it."""


def arm_place(p: Float64, joints: Float64) -> tuple[Float64, Float64, Float64]:
    """Return metres beyond the elbow, degrees around, and directions (N, 3) off the bone.

    p (N, 3): points of a left arm that hangs. joints (3, 3): its shoulder, elbow and wrist.
    """
    order = np.argsort(joints[:, 1])
    middle = np.stack([np.interp(p[:, 1], joints[order, 1], joints[order, k]) for k in (0, 2)], axis=1)
    away = p[:, [0, 2]] - middle
    away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-9)
    turn = np.degrees(np.arctan2(away[:, 0], away[:, 1]))
    return joints[1, 1] - p[:, 1], turn, np.stack([away[:, 0], np.zeros(len(p)), away[:, 1]], axis=1)


def shape_arm(p: Float64, joints: Float64, own: Bool) -> Float64:
    """Return (N, 3) by how much points p (N, 3) of a left arm that hangs are moved.

    joints (3, 3): as for `arm_place`. own (N,): points of the arm.
    """
    along, turn, outward = arm_place(p, joints)
    height = np.zeros(len(p))
    for middle, degrees, length, wide, millimetres in FORMS:
        around = (turn - degrees + 180) % 360 - 180
        height += millimetres * np.exp(-(((along - middle) / length) ** 2) - (around / wide) ** 2)
    return outward * (0.001 * height * own)[:, None]


def texcoords(p: Float64, triangles: Int64, joints: Float64, own: Bool) -> tuple[Int64, Int64, Float64]:
    """Return the vertices to double (W,), triangles (F, 3) of these, and their places (W, 2) in the picture.

    p (V, 3): skin, the arms hanging. joints (3, 3): as for `arm_place`. own (V,): that of the arms; other
    skin lies where the picture is even.
    """
    left = p[triangles].mean(axis=1)[:, 0] > 0
    along, turn, _ = arm_place(np.abs(p) * (1, 1, 0) + p * (0, 0, 1), joints)
    around = turn[triangles] / 360
    around[:, 1:] -= np.rint(around[:, 1:] - around[:, :1])
    around -= np.rint(around.mean(axis=1, keepdims=True))
    across = np.where(left, 0.25, 0.75)[:, None] + np.where(left, 1, -1)[:, None] * around * AROUND / WIDE
    places = np.stack([across, (along[triangles] - FIRST) / WIDE], axis=-1)
    places[~own[triangles].all(axis=1)] = 0.5, 0.002
    keys = np.concatenate([triangles.reshape(-1, 1), np.rint(places.reshape(-1, 2) * SIZE * 64)], axis=1)
    unique, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return unique[:, 0].astype(int), number.reshape(-1, 3), np.clip(places.reshape(-1, 2)[first], 0, 1)


def paint_arms() -> bytes:
    """Return the picture: the skin of both arms, unrolled, as factors of the complexion."""
    step = (np.arange(SIZE) + 0.5) / SIZE
    across, down = np.meshgrid(step, step)
    sides = [_paint_arm((across - 0.25) * WIDE / AROUND, down * WIDE + FIRST, 30),
             _paint_arm((0.75 - across) * WIDE / AROUND, down * WIDE + FIRST, 60)]  # fmt: skip
    image = np.where((across < 0.5)[..., None], *sides)
    image[: SIZE // 100] = 1.0
    return encode_linear(WHITE * image)


def _paint_arm(around: Float64, along: Float64, seed: int) -> Float64:
    """Return (H, W, 3) factors at turns and metres beyond the elbow (H, W). seed: of its noise."""
    turn = 2 * np.pi * around
    p = np.stack([0.04 * np.cos(turn), along, 0.04 * np.sin(turn)], axis=-1).reshape(-1, 3)

    def grain(scale: float, number: int) -> Float64:
        return noise(p, scale, seed + number).reshape(along.shape)

    def near(middle: float, degrees: float, length: float, wide: float) -> Float64:
        angle = (360 * around - degrees + 180) % 360 - 180
        return np.exp(-(((along - middle) / length) ** 2) - (angle / wide) ** 2)

    blood = 0.45 * grain(0.028, 1) + 0.35 * grain(0.009, 2) + 0.25 * grain(0.0035, 3)
    blood += 1.9 * near(-0.004, 178, 0.020, 42) + 0.7 * near(0.05, 178, 0.06, 30)
    blood += 0.9 * smoothstep((along - 0.23) / 0.08) * (0.6 + 0.4 * np.cos(turn - 1.6))
    sun = 0.5 + 0.5 * np.cos(turn - np.radians(120))  # outwards and back
    sun *= smoothstep((along + 0.16) / 0.14)
    brown = 0.9 * sun + 0.25 * grain(0.05, 4) + 0.12 * grain(0.002, 5)
    freckles = smoothstep((grain(0.0045, 6) - 0.72) / 0.15) * sun
    dark = np.zeros(along.shape)
    wander = 0.0022 * grain(0.012, 7) + 0.0008 * grain(0.004, 8)
    for middle, degrees, wide, millimetres, depth in CREASES:
        angle = (360 * around - degrees + 180) % 360 - 180
        line = np.exp(-(((along + wander - middle) / (0.001 * millimetres)) ** 2))
        dark += depth * line * smoothstep(1 - np.abs(angle) / wide)
    vein = np.zeros(along.shape)
    for points in VEINS:
        knots = np.array(points)
        angle = np.interp(along, knots[:, 0], knots[:, 1]) + 900 * wander
        away = ((360 * around - angle + 180) % 360 - 180) / 360 * AROUND
        ends = smoothstep((along - knots[0, 0]) / 0.02) * smoothstep((knots[-1, 0] - along) / 0.02)
        vein = np.maximum(vein, np.exp(-((away / 0.0022) ** 2)) * ends)
    factor = 1 - 0.13 * blood[..., None] * np.array((0.25, 1.0, 0.95))
    factor *= 1 - 0.15 * (brown[..., None] - 0.25) * np.array((0.75, 1.0, 1.25))
    factor *= 1 - 0.16 * freckles[..., None] * np.array((0.6, 1.0, 1.2))
    factor *= 1 - dark[..., None] * np.array((0.75, 1.0, 1.0))
    return factor * (1 - 0.10 * vein[..., None] * np.array((1.3, 0.7, 0.4)))
