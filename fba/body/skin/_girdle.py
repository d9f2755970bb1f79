"""Shoulder blades that turn with the arms, and armpits that stay taut.

Lifting an arm turns its shoulder blade and collar bone. BAPs often turn only the shoulder, and skin that
followed it alone would fold deeply between neck and arm. So the joints that carry the skin of the shoulder
girdle are turned by a share of the arm's swing, less their turn by BAPs. The positions of joints do not
change.

Between arm and ribs, dual quaternions would swing the skin of the armpit out in an arc about the shoulder, as
a bag below a raised arm. Real skin is stretched there, so linear skinning, which moves it in a straight line,
is blended in.

Bounds of the compiled loops: joints and rows of a `Girdle` are numbers in the skeleton and mesh that
`find_girdle` made it of; the rest as in `fba.body.skin._loops`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Float32, Float64, Int32, Int64
from fba.body._skeleton import Skeleton
from fba.compiled import compiled, inlined
from fba.sampling import smoothstep

CHAIN = ("sternoclavicular", "acromioclavicular", "shoulder", "elbow")
LIFT = 0.16
"""Turn of the shoulder blade, relative to the arm's swing; the collar bone turns by half of that."""
TAUT = 0.7
"""Share of linear skinning in the armpit."""
TAUT_FROM = 0.03
"""Metres below the shoulder at which linear skinning begins."""
TAUT_AT = 0.08
"""Metres below the shoulder from which linear skinning has its full share."""
MIN_SHARE = 0.02
"""Smallest weight of the arm, and of the trunk, of a vertex in the armpit."""


class Girdle(NamedTuple):
    """The shoulder girdles that turn with the arms, and the armpits. The first fields have a row a side.

    joints: the joint that carries the girdle, those of collar bone and blade, and the shoulder. centre: the
    point that the collar bone turns about. arm: unit vector along the upper arm as modelled. rows, shares:
    vertices of the armpits, and their shares of linear skinning.
    """

    joints: Int64
    centre: Float64
    arm: Float64
    rows: Int64
    shares: Float32


def find_girdle(
    skeleton: Skeleton, bind: Float64, vertices: Float32, joints: Int32, weights: Float32
) -> Girdle:
    """Return tables of both shoulder girdles for the compiled loops; empty if the skeleton has none."""
    chains, centres, arms = [], [], []
    taut = np.zeros(len(vertices))
    for side in ("l_", "r_"):
        names = [side + name for name in CHAIN]
        if not all(name in skeleton for name in names):
            continue
        inner, outer, shoulder, elbow = (skeleton.number(name) for name in names)
        trunk = int(skeleton.parents[inner])
        arm = bind[elbow, :3, 3] - bind[shoulder, :3, 3]
        length = float(np.linalg.norm(arm))
        if trunk < 0 or length < 1e-9:
            continue
        chains.append((trunk, inner, outer, shoulder))
        centres.append(bind[inner, :3, 3])
        arms.append(arm / length)
        carried = (weights * np.isin(joints, skeleton.descendants(shoulder))).sum(axis=1)
        depth = bind[shoulder, 1, 3] - vertices[:, 1].astype(np.float64)
        between = (carried > MIN_SHARE) & (carried < 1 - MIN_SHARE)
        taut = np.maximum(taut, TAUT * between * smoothstep((depth - TAUT_FROM) / (TAUT_AT - TAUT_FROM)))
    rows = np.flatnonzero(taut)
    return Girdle(
        np.array(chains, dtype=np.int64).reshape(-1, 4),
        np.array(centres, dtype=np.float64).reshape(-1, 3),
        np.array(arms, dtype=np.float64).reshape(-1, 3),
        rows.astype(np.int64),
        taut[rows].astype(np.float32),
    )


@compiled
def turn_girdles(duals: Float32, girdle: Girdle) -> None:
    """Turn shoulder girdles with their arms, in place in duals (J, 8)."""
    for side in range(len(girdle.joints)):
        trunk, inner, outer, shoulder = girdle.joints[side]
        arm, centre = girdle.arm[side], girdle.centre[side]
        w, x, y, z = _relative(duals, trunk, shoulder)
        # The arm's present direction, seen from the trunk, and the shortest rotation to it.
        ux, uy, uz = y * arm[2] - z * arm[1], z * arm[0] - x * arm[2], x * arm[1] - y * arm[0]
        dx = arm[0] + 2.0 * (w * ux + y * uz - z * uy)
        dy = arm[1] + 2.0 * (w * uy + z * ux - x * uz)
        dz = arm[2] + 2.0 * (w * uz + x * uy - y * ux)
        cx, cy, cz = arm[1] * dz - arm[2] * dy, arm[2] * dx - arm[0] * dz, arm[0] * dy - arm[1] * dx
        sine = np.sqrt(cx * cx + cy * cy + cz * cz)
        cosine = arm[0] * dx + arm[1] * dy + arm[2] * dz
        if sine < 1e-6:
            continue
        cx, cy, cz = cx / sine, cy / sine, cz / sine
        fade = smoothstep_of_one((cosine + 1.0) / 0.15)  # near 180 degrees the axis is undefined
        wanted = LIFT * np.arctan2(sine, cosine) * fade
        a, b, c, d = _relative(duals, trunk, outer)
        along = b * cx + c * cy + d * cz
        turned = 2.0 * np.arctan2(along if a >= 0.0 else -along, abs(a))
        angle = wanted - min(max(turned, 0.0), wanted)
        for k in range(2):  # one call: each would be compiled by itself
            _turn(duals, inner if k else outer, 0.5 * angle if k else angle, cx, cy, cz, centre)


@inlined
def smoothstep_of_one(value: float) -> float:
    """Return `smoothstep` of a single number, for compiled loops."""
    t = min(max(value, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


@inlined
def _relative(duals: Float32, one: int, other: int) -> tuple[float, float, float, float]:
    """Return the rotation of one joint seen from another: the quaternion w, x, y, z."""
    w, x, y, z = duals[one, 0], duals[one, 1], duals[one, 2], duals[one, 3]
    a, b, c, d = duals[other, 0], duals[other, 1], duals[other, 2], duals[other, 3]
    return (
        w * a + x * b + y * c + z * d,
        w * b - x * a - y * d + z * c,
        w * c + x * d - y * a - z * b,
        w * d - x * c + y * b - z * a,
    )


@inlined
def _turn(duals: Float32, joint: int, angle: float, cx: float, cy: float, cz: float, centre: Float64) -> None:
    """Turn a joint, in place in duals, about a unit axis through a point, before its own motion."""
    s, g = np.sin(0.5 * angle), np.cos(0.5 * angle)
    h, i, j = s * cx, s * cy, s * cz
    # The dual part of a turn that leaves the point p where it is: (e, f, k) = p x (h, i, j).
    px, py, pz = centre[0], centre[1], centre[2]
    e, f, k = py * j - pz * i, pz * h - px * j, px * i - py * h
    w, x, y, z = duals[joint, 0], duals[joint, 1], duals[joint, 2], duals[joint, 3]
    a, b, c, d = duals[joint, 4], duals[joint, 5], duals[joint, 6], duals[joint, 7]
    duals[joint, 0] = w * g - x * h - y * i - z * j
    duals[joint, 1] = w * h + x * g + y * j - z * i
    duals[joint, 2] = w * i + y * g + z * h - x * j
    duals[joint, 3] = w * j + z * g + x * i - y * h
    duals[joint, 4] = a * g - b * h - c * i - d * j - x * e - y * f - z * k
    duals[joint, 5] = a * h + b * g + c * j - d * i + w * e + y * k - z * f
    duals[joint, 6] = a * i + c * g + d * h - b * j + w * f + z * e - x * k
    duals[joint, 7] = a * j + d * g + b * i - c * h + w * k + x * f - y * e


@compiled
def straighten_armpits(
    vertices: Float32, joints: Int32, weights: Float32, counts: Int32, duals: Float32,
    girdle: Girdle, out: Float32,
) -> None:  # fmt: skip
    """Blend the armpits' vertices in out (V, 3) with linear skinning."""
    for n in range(len(girdle.rows)):
        i, straight = girdle.rows[n], girdle.shares[n]
        px, py, pz = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        remaining, two = np.float32(1.0) - straight, np.float32(2.0)
        for axis in range(3):
            out[i, axis] *= remaining
        for k in range(counts[i]):
            j, share = joints[i, k], straight * weights[i, k]
            w, x, y, z = duals[j, 0], duals[j, 1], duals[j, 2], duals[j, 3]
            a, b, c, d = duals[j, 4], duals[j, 5], duals[j, 6], duals[j, 7]
            ux, uy, uz = y * pz - z * py + w * px, z * px - x * pz + w * py, x * py - y * px + w * pz
            out[i, 0] += share * (px + two * (y * uz - z * uy + w * b - x * a + y * d - z * c))
            out[i, 1] += share * (py + two * (z * ux - x * uz + w * c - y * a + z * b - x * d))
            out[i, 2] += share * (pz + two * (x * uy - y * ux + w * d - z * a + x * c - y * b))
