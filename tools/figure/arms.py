"""Arms: muscles and bones that the figure only hints at, and the picture of their skin.

Both are given for the left arm as it hangs, palm to the thigh, by metres beyond the elbow and degrees around
the bone, from the front outwards. In the picture both halves of an arm, which meet at its front and at the
point of the elbow, have the same texels, so that it needs no seam.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Bool, Float64
from fba.sampling import smoothstep
from tools.figure.head.hair import noise
from tools.figure.paint import encode_linear

FORMS = (
    # beyond the elbow, around; metres and degrees over which it fades; its height, millimetres
    (-0.115, -10, 0.045, 42, 5.5),  # biceps
    (-0.045, 62, 0.050, 20, -4.0),  # groove beside it
    (-0.130, 92, 0.040, 34, 2.5),  # deltoid's end
    (-0.125, 160, 0.046, 36, 5.5),  # triceps
    (-0.045, 178, 0.026, 28, -4.5),  # its tendon
    (-0.003, 178, 0.014, 22, 8.0),  # point of the elbow
    (0.002, 138, 0.017, 18, -4.0),  # hollows on both sides of it
    (0.000, -142, 0.017, 18, -3.5),
    (-0.012, -98, 0.015, 24, 5.5),  # inner and outer knob above the joint
    (-0.008, 108, 0.014, 20, 2.5),
    (0.004, -5, 0.020, 36, -5.0),  # pit of the elbow
    (0.055, 55, 0.044, 36, 9.0),  # brachioradialis
    (-0.008, 62, 0.030, 26, 3.0),
    (0.075, 120, 0.044, 26, 4.5),  # extensors
    (0.062, -78, 0.048, 42, 7.5),  # flexors
    (0.085, 160, 0.065, 16, -3.5),  # along the ulna
    (0.185, 0, 0.045, 999, -3.0),  # forearm before the wrist
    (0.222, 90, 0.034, 48, -2.4),  # flat at the wrist, on both sides
    (0.226, -90, 0.034, 52, -3.0),
    (0.250, 136, 0.014, 30, 3.0),  # head of the ulna
    (0.246, 20, 0.014, 30, 1.5),  # end of the radius
)
CREASES = (
    # beyond the elbow, around; half its length in degrees; millimetres and depth
    (0.003, 0, 52, 0.9, 0.20), (0.012, 0, 38, 0.8, 0.13), (-0.008, 0, 34, 0.8, 0.08),  # in the pit
    (-0.019, 180, 36, 0.9, 0.12), (-0.011, 180, 42, 0.9, 0.14), (-0.001, 180, 40, 0.9, 0.13),  # on the elbow
    (0.009, 180, 32, 0.9, 0.09),
    (0.258, 90, 62, 0.8, 0.10), (0.266, 90, 70, 0.8, 0.12),  # below the palm
)  # fmt: skip
VEINS = (
    # points (beyond the elbow, around)
    ((-0.12, 40), (-0.03, 32), (0.05, 38), (0.14, 52), (0.24, 62)),
    ((0.02, 12), (0.07, 14), (0.13, 30), (0.20, 42)),
    ((0.09, 120), (0.16, 104), (0.24, 98)),
)
"""Of these, `FORMS` are around the whole arm; creases and veins, 0 to 180 degrees, on both halves."""
FRONT = -2
"""Degrees around of the front, where the halves of an arm meet."""
GRAINS = (0.028, 0.009, 0.0035, 0.05, 0.002)
"""Metres of blotches: three of blood, two of brown."""
SIZE = 768
"""Texels of the picture along each side."""
WIDE, AROUND = 0.68, 0.25
"""Metres of the picture along each side, and of a turn around an arm."""
FIRST = -0.19
"""Metres beyond the elbow of its upper edge."""
BELOW = (-0.070, 0.042)
"""Metres beyond the elbow up to which the sleeve darkens the skin below it, and over which that begins."""
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


def texcoords(p: Float64, joints: Float64, own: Bool) -> Float64:
    """Return places (V, 2) in the picture.

    p (V, 3): skin, the arms hanging. joints (3, 3): as for `arm_place`. own (V,): that of the arms; other
    skin lies where the picture is even.
    """
    along, turn, _ = arm_place(p * np.where(p[:, :1] < 0, (-1, 1, 1), 1), joints)
    half = np.abs((turn - FRONT + 180) % 360 - 180) / 360
    across = np.where(p[:, 0] > 0, half * AROUND / WIDE, 1 - half * AROUND / WIDE)
    places = np.stack([across, (along - FIRST) / WIDE], axis=1)
    return np.where(own[:, None], np.clip(places, 0, 1), (0.5, 0.5))


def tan(p: Float64, joints: Float64, own: Bool) -> Float64:
    """Return (V, 3) factors of the complexion: paler inside arms, browner outside. As for `texcoords`."""
    along, turn, _ = arm_place(p * np.where(p[:, :1] < 0, (-1, 1, 1), 1), joints)
    sun = (0.5 + 0.5 * np.cos(np.radians(turn - 110))) * smoothstep((along + 0.16) / 0.14) * own
    flushed = smoothstep((along - 0.23) / 0.08) * (0.3 + 0.7 * sun) * own
    factor = 1 - 0.14 * (sun[:, None] - 0.25 * own[:, None]) * np.array((0.75, 1.0, 1.25))
    return factor * (1 - 0.09 * flushed[:, None] * np.array((0.25, 1.0, 0.95)))


def paint_arms() -> bytes:
    """Return the picture: the skin of both arms, unrolled, as factors of the complexion; even between."""
    step = (np.arange(SIZE) + 0.5) / SIZE
    across, down = np.meshgrid(step, step)
    image = np.ones((SIZE, SIZE, 3))
    for side, seed in ((across, 30), (1 - across, 60)):
        near = side < 0.5 * AROUND / WIDE + 0.02
        image[near] = _paint_arm(2 * np.pi * side[near] * WIDE / AROUND, down[near] * WIDE + FIRST, seed)
    return encode_linear(WHITE * image)


def _paint_arm(turn: Float64, along: Float64, seed: int) -> Float64:
    """Return (N, 3) factors at angles (N,), radians from the front, and metres beyond the elbow (N,)."""
    p = np.stack([0.04 * np.cos(turn), along, 0.04 * np.sin(turn)], axis=1)
    degrees = np.degrees(turn)
    grain = [noise(p, scale, seed + number) for number, scale in enumerate(GRAINS)]
    blood = 0.45 * grain[0] + 0.35 * grain[1] + 0.25 * grain[2]
    brown = 0.3 * grain[3] + 0.12 * grain[4]
    for middle, length, wide, strength in ((-0.004, 0.020, 42, 1.9), (0.05, 0.06, 30, 0.7)):  # of the elbow
        blood += strength * np.exp(-(((along - middle) / length) ** 2) - ((degrees - 180) / wide) ** 2)
    freckles = smoothstep((noise(p, 0.0045, seed + 6) - 0.72) / 0.15)
    wander = 0.0022 * noise(p, 0.012, seed + 7) + 0.0008 * noise(p, 0.004, seed + 8)
    dark, vein = np.zeros(along.shape), np.zeros(along.shape)
    for middle, at, wide, millimetres, depth in CREASES:
        line = np.exp(-(((along + wander - middle) / (0.001 * millimetres)) ** 2))
        dark += depth * line * smoothstep(1 - np.abs(degrees - at) / wide)
    for points in VEINS:
        knots = np.array(points)
        bend = 900 * wander + 7 * noise(p, 0.05, seed + 9)
        away = (degrees - np.interp(along, knots[:, 0], knots[:, 1]) - bend) / 360 * AROUND
        ends = smoothstep((along - knots[0, 0]) / 0.02) * smoothstep((knots[-1, 0] - along) / 0.02)
        vein = np.maximum(vein, np.exp(-((away / 0.0022) ** 2)) * ends)
    factor = 1 - 0.13 * blood[:, None] * np.array((0.25, 1.0, 0.95))
    factor *= 1 - 0.15 * brown[:, None] * np.array((0.75, 1.0, 1.25))
    factor *= 1 - 0.10 * freckles[:, None] * np.array((0.6, 1.0, 1.2))
    factor *= 1 - dark[:, None] * np.array((0.75, 1.0, 1.0))
    factor *= 1 - 0.42 * smoothstep((BELOW[0] - along) / BELOW[1])[:, None] * np.array((0.85, 1.0, 1.0))
    return factor * (1 - 0.07 * vein[:, None] * np.array((1.3, 0.7, 0.4)))
