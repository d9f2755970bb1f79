"""Hands outside the body: for display, arms are turned until hands and forearms leave thighs and trunk.

A motion was made for other proportions than those of the body that shows it, whose hands then reach into its
clothes. Legs and trunk are measured in the default posture, as radii about vertical lines that move with a
joint each; points of hands and forearms are kept outside. Shoulder and wrist turn for it, by damped least
squares in a fixed number of small steps: the result depends on the pose alone, and changes smoothly with it.
No smooth rule brings every hand out of a body and leaves those outside in place: one behind the middle of a
thigh or trunk, seen from where its arm hangs, is shown inside where it would change sides.

Whole rows are not computed at once in compiled code: numba takes seconds to compile that.

Bounds: `find_contact` makes all arrays for the joints of one skeleton, and `Contact.keep_apart` takes no
matrices of another shape; angles are in 0..1 turn, and heights are checked before radii are looked up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fba.arrays import Bool, Float64, Int64
from fba.body._skeleton import SIDES
from fba.compiled import compiled, inlined
from fba.rotations import lengths

if TYPE_CHECKING:
    from fba.body._model import BodyModel

OBSTACLES = (
    ("sacroiliac", "l_hip", -0.06, "vl5", 0.06),
    ("vl2", "vl5", 0.0, "vt11", 0.05),
    ("vt9", "vt12", 0.0, "vt5", 0.03),
    ("vt4", "vt8", 0.0, "vt1", 0.0),
    ("l_hip", "l_knee", -0.04, "l_hip", 0.06), ("r_hip", "r_knee", -0.04, "r_hip", 0.06),
    ("l_knee", "l_ankle", 0.06, "l_knee", 0.06), ("r_knee", "r_ankle", 0.06, "r_knee", 0.06),
)  # fmt: skip
"""Joint that carries a part of the body; joints at its lower and its upper end, and metres above each."""
LEVELS, AROUND = 20, 32
"""Heights and directions in which radii are measured."""
FADE = 0.04
"""Metres over which radii shrink to 0 beyond both ends of a part."""
WIDEST = 0.24
"""Largest radius of a part, metres: wide robes do not keep hands away."""
ARM_SHARE = 0.3
"""Weight of the arm from which a vertex does not belong to the trunk."""
HAND_POINTS, FOREARM_POINTS = 80, 10
"""Points of each arm that are kept outside."""
FOREARM = 0.3
"""Share of the forearm, from the elbow, that is not looked at."""
MARGIN = 0.008
"""Metres that these points keep from the body."""
STEPS = 24
"""Steps of the correction."""
DAMPING = (0.5, 0.6)
"""Metres: damping of the turns of shoulder and wrist."""
LARGEST = (0.10, 0.05)
"""Radians: largest turn of shoulder and wrist in a step."""
OUTWARDS = (0.7, 0.7)
"""How far arms are led to their own side, and ahead, in the middle of a part: there no direction leads away
from it. A share of the depth elsewhere."""
HELD = 0.5
"""Depth, as a share of a part's width, from which the way out is that of the pose as it came."""
SURE = 0.55
"""Length of the way out from which it is followed in full. Behind the middle it shrinks to 0 and turns round:
a hand that passes there is shown inside, for it would jump from one side to the other."""


class Parts(NamedTuple):
    """O parts of a body: joints (O,), middles (O, 2), x and z of their lines, and ends (O, 2), lowest and
    highest y, all relative to the joint; radii (O, LEVELS, AROUND), metres; widest (O,), of these."""

    joints: Int64
    middles: Float64
    ends: Float64
    radii: Float64
    widest: Float64


class Points(NamedTuple):
    """P points of an arm: joints (P,) and positions (P, 3) relative to them, in the default posture."""

    joints: Int64
    positions: Float64


@dataclass(frozen=True, eq=False)
class Contact:
    """What keeps hands outside one body; see `find_contact`.

    arms: for each the joints that its shoulder carries, those that its wrist carries, its points, and 1 for
    the left one, -1 for the right.
    """

    parts: Parts
    arms: tuple[tuple[Int64, Int64, Points, float], ...]
    joints: int

    def keep_apart(self, matrices: Float64) -> Float64:
        """Turn arms in matrices (J, 4, 4) in place; return (arms, 2, 3), the turns of shoulder and wrist.

        matrices: float64, C-contiguous, as `BapSolver.pose` returns them. A turn is a vector along its axis,
        its length the angle in radians; zeros where nothing touches. ValueError for another shape.
        """
        if matrices.shape != (self.joints, 4, 4):
            raise ValueError(f"joint matrices must have shape ({self.joints}, 4, 4), not {matrices.shape}")
        turns = np.zeros((len(self.arms), 2, 3))
        for arm, (carried, hand, points, side) in enumerate(self.arms):
            push_out(matrices, self.parts, carried, hand, points, side, turns[arm])
        return turns

    def depths(self, matrices: Float64) -> Float64:
        """Return (arms,) metres by which the deepest point of each arm is inside the body; 0 for outside."""
        found = np.zeros(len(self.arms))
        for arm, (_, _, points, _) in enumerate(self.arms):
            for point in range(len(points.joints)):
                place = _place(matrices, points, point)
                for part in range(len(self.parts.joints)):
                    inside = _depth(matrices, self.parts, part, place)[0] - MARGIN
                    found[arm] = max(found[arm], inside)
        return found


def find_contact(body: BodyModel) -> Contact | None:
    """Return what keeps hands outside a body; None for one without arms, hands, thighs or trunk."""
    skeleton = body.skeleton
    standing = np.tile(np.eye(4), (len(skeleton), 1, 1))
    standing[:, :3, 3] = skeleton.centres
    vertices = body.skin(standing).astype(np.float64)
    arm = np.zeros(len(vertices))
    arms = []
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        names = [f"{side}_{name}" for name in ("shoulder", "elbow", "wrist")]
        if not all(name in skeleton for name in names):
            continue
        shoulder, elbow, wrist = (skeleton.number(name) for name in names)
        arm += _share(body, skeleton.descendants(shoulder))
        hand = skeleton.descendants(wrist)
        fraction = (skeleton.centres[elbow, 1] - vertices[:, 1]) / max(
            float(skeleton.centres[elbow, 1] - skeleton.centres[wrist, 1]), 1e-6
        )
        strongest = body.joints[:, 0]
        rows = np.concatenate([
            _spread(vertices, np.isin(strongest, hand), HAND_POINTS),
            _spread(vertices, (strongest == elbow) & (fraction > FOREARM), FOREARM_POINTS),
        ])  # fmt: skip
        if len(rows):
            joints = strongest[rows].astype(np.int64)
            points = Points(joints, vertices[rows] - skeleton.centres[joints])
            arms.append((np.array(skeleton.descendants(shoulder)), np.array(hand), points, sign))
    parts = _measure_parts(body, vertices, arm)
    return Contact(parts, tuple(arms), len(skeleton)) if arms and len(parts.joints) else None


def _share(body: BodyModel, joints: Sequence[int]) -> Float64:
    """Return (V,) the weight of some joints on each vertex."""
    return np.asarray((body.weights * np.isin(body.joints, joints)).sum(axis=1), dtype=np.float64)


def _spread(vertices: Float64, chosen: Bool, count: int) -> Int64:
    """Return up to `count` of the chosen vertices, each as far as possible from those before it."""
    rows = np.flatnonzero(chosen)
    if not len(rows):
        return rows
    places = vertices[rows]
    away = lengths(places - places.mean(axis=0))
    found = [int(away.argmax())]
    for _ in range(min(count, len(rows)) - 1):
        last = lengths(places - places[found[-1]])
        away = last if len(found) == 1 else np.minimum(away, last)
        found.append(int(away.argmax()))
    return np.asarray(rows[found])


def _measure_parts(body: BodyModel, vertices: Float64, arm: Float64) -> Parts:
    """Return the parts of a body in the default posture. vertices (V, 3); arm (V,): weight of the arms."""
    skeleton = body.skeleton
    rows = []
    for joint, low, above_low, high, above_high in OBSTACLES:
        if not all(name in skeleton for name in (joint, low, high)):
            continue
        number = skeleton.number(joint)
        if joint[:2] in ("l_", "r_"):
            own = np.setdiff1d(skeleton.descendants(number), skeleton.descendants(skeleton.number(low)))
            chosen = _share(body, own.tolist()) > 0.5
        else:
            chosen = arm < ARM_SHARE
        centre = skeleton.centres[number]
        ends = [skeleton.centres[skeleton.number(low), 1] + above_low,
                skeleton.centres[skeleton.number(high), 1] + above_high]  # fmt: skip
        above, below = vertices[:, 1] > ends[0], vertices[:, 1] < ends[1]
        a, b, c = body.triangles.T  # several times as fast as any and all over an axis
        used = chosen[a] & chosen[b] & chosen[c] & (above[a] | above[b] | above[c])
        used &= below[a] | below[b] | below[c]
        samples = _samples(vertices[body.triangles[used]])
        samples = samples[(samples[:, 1] > ends[0]) & (samples[:, 1] < ends[1])] - centre
        if len(samples):
            ends = [end - centre[1] for end in ends]
            middle = (samples[:, [0, 2]].min(axis=0) + samples[:, [0, 2]].max(axis=0)) / 2
            rows.append((number, middle, ends, _radii(samples - [middle[0], 0, middle[1]], ends)))
    joints, middles, lines, radii = zip(*rows, strict=True) if rows else ((), (), (), ())
    table = np.array(radii, dtype=np.float64).reshape(-1, LEVELS, AROUND)
    return Parts(
        np.array(joints, dtype=np.int64),
        np.array(middles, dtype=np.float64).reshape(-1, 2),
        np.array(lines, dtype=np.float64).reshape(-1, 2),
        table,
        table.max(axis=(1, 2)) if len(table) else np.zeros(0),
    )


def _samples(corners: Float64) -> Float64:
    """Return (N, 3) points spread over triangles with corners (F, 3, 3)."""
    steps = 5
    shares = np.array([(a, b, steps - a - b) for a in range(steps + 1) for b in range(steps + 1 - a)]) / steps
    return np.asarray(np.tensordot(shares, corners, (1, 1)).reshape(-1, 3))


def _radii(samples: Float64, ends: Sequence[float]) -> Float64:
    """Return (LEVELS, AROUND) radii of points (N, 3) about the y axis; gaps take those beside them."""
    level = np.rint((samples[:, 1] - ends[0]) / (ends[1] - ends[0]) * (LEVELS - 1)).astype(int)
    turn = np.arctan2(samples[:, 0], samples[:, 2]) / (2 * np.pi) % 1
    column = np.rint(turn * AROUND).astype(int) % AROUND
    radii = np.zeros((LEVELS, AROUND))
    np.maximum.at(radii, (level, column), np.hypot(samples[:, 0], samples[:, 2]))
    for _ in range(LEVELS):
        if radii.all():
            break
        beside = np.maximum(np.roll(radii, 1, axis=1), np.roll(radii, -1, axis=1))
        padded = np.pad(radii, ((1, 1), (0, 0)))
        radii = np.where(radii > 0, radii, np.where(beside > 0, beside, np.maximum(padded[2:], padded[:-2])))
    return np.minimum(radii, WIDEST)


@compiled
def _place(matrices: Float64, points: Points, point: int) -> tuple[float, float, float]:
    """Return where a point is."""
    j = points.joints[point]
    x, y, z = points.positions[point, 0], points.positions[point, 1], points.positions[point, 2]
    m = matrices
    return (
        m[j, 0, 0] * x + m[j, 0, 1] * y + m[j, 0, 2] * z + m[j, 0, 3],
        m[j, 1, 0] * x + m[j, 1, 1] * y + m[j, 1, 2] * z + m[j, 1, 3],
        m[j, 2, 0] * x + m[j, 2, 1] * y + m[j, 2, 2] * z + m[j, 2, 3],
    )


@compiled
def _depth(
    matrices: Float64, parts: Parts, part: int, place: tuple[float, float, float]
) -> tuple[float, float, float, float]:
    """Return metres: how deep a point is in a part with its margin, the radius, x and z from the middle."""
    j, m = parts.joints[part], matrices
    a, b, c = place[0] - m[j, 0, 3], place[1] - m[j, 1, 3], place[2] - m[j, 2, 3]
    y = m[j, 0, 1] * a + m[j, 1, 1] * b + m[j, 2, 1] * c
    low, high = parts.ends[part, 0], parts.ends[part, 1]
    if not (low - FADE <= y <= high + FADE):  # written so that NaN is outside
        return -1.0, 1.0, 0.0, 0.0
    x = m[j, 0, 0] * a + m[j, 1, 0] * b + m[j, 2, 0] * c - parts.middles[part, 0]
    z = m[j, 0, 2] * a + m[j, 1, 2] * b + m[j, 2, 2] * c - parts.middles[part, 1]
    away = np.sqrt(x * x + z * z)
    if not away <= parts.widest[part] + MARGIN:
        return -1.0, 1.0, 0.0, 0.0
    fade = 1.0 - _smoothstep(max(low - y, y - high) / FADE)
    at = min(max((y - low) / (high - low), 0.0), 1.0) * (LEVELS - 1)
    row = min(int(at), LEVELS - 2)
    up = at - row
    turn = np.arctan2(x, z) / (2.0 * np.pi) * AROUND
    turn = turn + AROUND if turn < 0.0 else turn
    first = int(turn) % AROUND
    on = turn - int(turn)
    second = (first + 1) % AROUND
    lower = parts.radii[part, row, first] * (1.0 - on) + parts.radii[part, row, second] * on
    upper = parts.radii[part, row + 1, first] * (1.0 - on) + parts.radii[part, row + 1, second] * on
    radius = (lower * (1.0 - up) + upper * up + MARGIN) * fade
    return radius - away, radius, x, z


@inlined
def _measure(
    matrices: Float64, parts: Parts, points: Points, depths: Float64, ways: Float64, side: float
) -> float:
    """Fill depths (P,), metres, and ways (2, 3); return how deep the arm is, as a share of a part's width.

    The first way is the mean direction from the middles of the parts to the points in them, shorter near the
    middles; the second is to the side and ahead, the longer the deeper.
    """
    m = matrices
    ways[:], depths[:] = 0.0, 0.0
    total, most = 0.0, 0.0
    for part in range(len(parts.joints)):
        j = parts.joints[part]
        x_sum, z_sum, deepest = 0.0, 0.0, 0.0
        for point in range(len(depths)):
            depth, radius, x, z = _depth(m, parts, part, _place(m, points, point))
            if depth > 0.0:
                depths[point] = max(depths[point], depth)
                deepest = max(deepest, depth)
                total += depth * depth
                x_sum += depth * depth * x / radius
                z_sum += depth * depth * z / radius
        share = deepest / parts.widest[part] if deepest > 0.0 else 0.0
        most = max(most, share)
        for i in range(3):
            ways[0, i] += x_sum * m[j, i, 0] + z_sum * m[j, i, 2]
            ways[1, i] += share * (OUTWARDS[0] * side * m[j, i, 0] + OUTWARDS[1] * m[j, i, 2])
    for i in range(3):
        ways[0, i] /= max(total, 1e-12)
    return most


@inlined
def _find_turns(
    matrices: Float64, joints: tuple[int, int], points: Points, depths: Float64, way: Float64, wanted: Float64
) -> None:
    """Fill wanted (6,): turns of shoulder and wrist that move points by depths (P,) along a way (3,)."""
    normal, row = np.zeros((6, 6)), np.zeros(6)
    wanted[:] = 0.0
    deepest = 0.0
    for point in range(len(depths)):
        depth = depths[point]
        if depth <= 0.0:
            continue
        deepest = max(deepest, depth)
        place = _place(matrices, points, point)
        for k in range(2):
            x = place[0] - matrices[joints[k], 0, 3]
            y = place[1] - matrices[joints[k], 1, 3]
            z = place[2] - matrices[joints[k], 2, 3]
            held = 1.0 if k == 0 or points.joints[point] >= joints[1] else 0.0
            row[3 * k] = held * (y * way[2] - z * way[1])
            row[3 * k + 1] = held * (z * way[0] - x * way[2])
            row[3 * k + 2] = held * (x * way[1] - y * way[0])
        for i in range(6):
            wanted[i] += row[i] * depth * depth
            for k in range(6):
                normal[i, k] += row[i] * row[k] * depth
    for i in range(6):
        damping = DAMPING[0] if i < 3 else DAMPING[1]
        normal[i, i] += damping * damping * deepest
    _solve(normal, wanted)
    for k in range(2):
        turn = wanted[3 * k : 3 * k + 3]
        shorter = 1.0 + _length(turn) / LARGEST[k]
        for i in range(3):
            turn[i] /= shorter


@compiled
def push_out(
    matrices: Float64, parts: Parts, carried: Int64, hand: Int64, points: Points, side: float, turns: Float64
) -> None:
    """Turn shoulder and wrist of an arm in place, and add up the turns in (2, 3), until it is outside.

    All points go one way: if each chose its own, a hand through a thigh would be held there from both sides.
    """
    moved = matrices.copy()  # goes all the way out; `matrices` a share of it where no way is sure
    depths, wanted = np.zeros(len(points.joints)), np.zeros(6)
    now, first, way = np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(3)
    part = np.zeros(3)
    share, hold = 1.0, 0.0
    for step in range(STEPS):
        most = _measure(moved, parts, points, depths, now, side)
        if most <= 0.0:
            return
        for i in range(3):
            if step == 0:
                first[0, i], first[1, i] = now[0, i], now[1, i]
            way[i] = now[0, i] + now[1, i]
        if step == 0:
            share = _smoothstep(_length(way) / SURE)
            hold = _smoothstep(most / HELD)
        for i in range(3):
            way[i] = now[0, i] * (1.0 - hold) + first[0, i] * hold + first[1, i]
        long = max(_length(way), 1e-9)
        for i in range(3):
            way[i] /= long
        _find_turns(moved, (carried[0], hand[0]), points, depths, way, wanted)
        for k in range(2):
            turn, joints = wanted[3 * k : 3 * k + 3], carried if k == 0 else hand
            _turn(moved, joints, turn)
            for i in range(3):
                part[i] = turn[i] * share
                turns[k, i] += part[i]
            _turn(matrices, joints, part)


@inlined
def _smoothstep(t: float) -> float:
    """Return 0 up to 0 and 1 from 1 on, smoothly."""
    t = min(max(t, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


@inlined
def _length(vector: Float64) -> float:
    """Return the length of a vector."""
    return float(np.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]))


@inlined
def _solve(normal: Float64, wanted: Float64) -> None:
    """Solve normal (6, 6), symmetric and positive, for wanted (6,), in place."""
    for i in range(6):
        for k in range(i + 1, 6):
            factor = normal[k, i] / normal[i, i]
            for n in range(i, 6):
                normal[k, n] -= factor * normal[i, n]
            wanted[k] -= factor * wanted[i]
    for i in range(5, -1, -1):
        for k in range(i + 1, 6):
            wanted[i] -= normal[i, k] * wanted[k]
        wanted[i] /= normal[i, i]


@inlined
def _turn(matrices: Float64, joints: Int64, turn: Float64) -> None:
    """Turn joints about the first of them, in place, by a vector (3,)."""
    angle = _length(turn)
    if angle < 1e-12:
        return
    x, y, z = turn[0] / angle, turn[1] / angle, turn[2] / angle
    sine, cosine = np.sin(angle), np.cos(angle)
    first = joints[0]
    px, py, pz = matrices[first, 0, 3], matrices[first, 1, 3], matrices[first, 2, 3]
    for j in joints:
        for column in range(4):
            a, b, c = matrices[j, 0, column], matrices[j, 1, column], matrices[j, 2, column]
            if column == 3:
                a, b, c = a - px, b - py, c - pz
            along = (x * a + y * b + z * c) * (1.0 - cosine)
            d = cosine * a + sine * (y * c - z * b) + along * x
            e = cosine * b + sine * (z * a - x * c) + along * y
            f = cosine * c + sine * (x * b - y * a) + along * z
            if column == 3:
                d, e, f = d + px, e + py, f + pz
            matrices[j, 0, column], matrices[j, 1, column], matrices[j, 2, column] = d, e, f
