"""How parts of a result are turned otherwise than the source's, in every frame.

Each function returns rows of `Row`: name, part and values (T,), 0 or more; NaN where nothing can be compared.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from fba import rotations
from fba.arrays import Bool, Float64
from fba.body import SIDES
from fba.body.skeleton import ROOT
from fba.capture.comparison._figure import Figure, degrees_turned, mean_rotation
from fba.rotations import degrees_between, unit

MOST_PAIRS = 4
"""Pairs of joints, left and right, that show whether a pose is its own mirror image."""
MAX_ASYMMETRY = 0.05
"""Share of the legs' length by which pairs of joints may differ in a pose that is its own mirror image."""
MIN_STRAIGHTNESS = 0.9
"""Smallest cosine of the angle between trunk or legs and straight up in a pose that stands."""
WORDS = {"l": "left", "r": "right"}
LIMBS = (
    ("upper arm", "shoulder", "elbow"),
    ("forearm", "elbow", "wrist"),
    ("thigh", "hip", "knee"),
    ("shank", "knee", "ankle"),
)
TURNING = (
    ("pelvis", "HumanoidRoot", "sacroiliac"),
    ("head", "skullbase", "skullbase"),
    *((f"{WORDS[s]} {what}", f"{s}_{joint}", f"{s}_{shown}") for s in SIDES for what, joint, shown in (
        ("hand", "wrist", "wrist"), ("shank", "knee", "knee"), ("foot", "ankle", "midtarsal"),
    )),
)  # fmt: skip
"""Parts, the source's joint that turns each, and that of the result."""
DIGITS = ("thumb", "index", "middle", "ring", "pinky")
CHEST = ("vt1", "vt4", "vt6", "vt8", "vt9", "vt10", "vt12", "vl1", "vl2", "vl3", "vl5")
"""Where a source may have the joint of its chest, from the top."""
HANGS = 0.5
"""Cosine of the angle to straight down up to which an arm hangs."""
MOST_ROW_TURN = 25.0
"""Degrees by which hips may differ from the rest pose, as the pelvis sees them, for that pose to say where a
head looks."""
STEEP = 0.85
"""Cosine of the angle between a foot's bone and straight down beyond which it points nowhere."""
MAX_WRUNG = 100.0
"""Degrees to either side by which forearm and wrist of a person turn the palm."""
LEG_PARTS = (("thigh", "sacroiliac", "{}_hip"), ("shank", "{}_hip", "{}_knee"))
"""Parts of the leg, the joint above each, and its own joint."""


class Row(NamedTuple):
    """A measure of a part in every frame."""

    name: str
    part: str
    values: Float64


def directions(source: Figure, result: Figure) -> Iterator[Row]:
    """Angles in degrees between bones: arms, legs, hands, fingers, trunk, lines of hips and shoulders."""
    for side in SIDES:
        for what, start, end in LIMBS:
            yield from _angle(
                "direction", f"{WORDS[side]} {what}", source, result, f"{side}_{start}", f"{side}_{end}"
            )
        both = [f for f in source.knuckles(side) if f in result.knuckles(side)]
        if len(both) > 1 and f"{side}_wrist" in source.points:
            ways = [
                unit(np.mean([one.knuckles(side)[f] for f in both], axis=0) - one.points[f"{side}_wrist"])
                for one in (source, result)
            ]
            yield Row("direction", f"{WORDS[side]} hand", degrees_between(*ways))
        hands = [_hand_axes(one, side, tuple(both)) for one in (source, result)]
        for digit in DIGITS:
            rows = []
            for n in (1, 2):
                ends = f"{side}_{digit}{n}", f"{side}_{digit}{n + 1}"
                theirs, ours = source.direction(*ends), result.direction(*ends)
                if theirs is not None and ours is not None:
                    ways = [rotations.inside(axes, w) for axes, w in zip(hands, (theirs, ours), strict=True)]
                    rows.append(degrees_between(*ways))
            if rows:
                yield Row("finger", f"{WORDS[side]} {digit}", np.max(rows, axis=0))
    for what in ("hip", "shoulder"):
        yield from _angle("direction", f"line of the {what}s", source, result, f"r_{what}", f"l_{what}")
    trunks = [_trunk(one) for one in (source, result)]
    if trunks[0] is not None and trunks[1] is not None:
        yield Row("trunk", "trunk", degrees_between(trunks[0], trunks[1]))


def palms(source: Figure, result: Figure, rest: Figure) -> Iterator[Row]:
    """Angles in degrees between the palms.

    The source's are those of the knuckles of two fingers. Without these, a rest pose that stands shows them:
    palms face the thighs where arms hang, and the ground in a T-pose. Without either, the result's palm shows
    whether a forearm is wrung more than people can: then the angles are what is too much.
    """
    axes = _standing_axes(rest) if _moves_from(rest, source) else None
    for side in SIDES:
        part = f"{WORDS[side]} hand"
        shown = list(result.knuckles(side))
        if f"{side}_wrist" not in source.points or f"{side}_elbow" not in source.points or len(shown) < 2:
            continue
        both = [f for f in source.knuckles(side) if f in shown]
        if len(both) > 1:
            ends = both[0], both[-1]
            yield Row("palm", part, degrees_between(source.palm(side, ends), result.palm(side, ends)))
            continue
        own = result.palm(side, (shown[0], shown[-1]))
        if axes is not None:
            inwards = axes[:, 0] * (-1.0 if side == "l" else 1.0)
            wrist = rest.points[f"{side}_wrist"]
            # a hand that hangs at rest, whatever the arm does, shows how hands hang
            bone = rest.tips.get(f"{side}_wrist", 2 * wrist - rest.points[f"{side}_elbow"]) - wrist
            raised = rotations.between(np.array([0.0, -1.0, 0.0]), unit(bone)[0])
            at_rest = rest.frames[f"{side}_wrist"][0].T @ raised @ inwards
            yield Row("palm", part, degrees_between(source.frames[f"{side}_wrist"] @ at_rest, own))
        else:
            yield Row("palm", part, np.maximum(_wringing(result, side, own) - MAX_WRUNG, 0.0))


def _wringing(result: Figure, side: str, palm: Float64) -> Float64:
    """Return degrees (T,) by which a palm is turned about the forearm from where the thumb points up."""
    ends = [result.points[f"{side}_{joint}"] for joint in ("elbow", "wrist")]
    forearm = unit(ends[1] - ends[0])
    inwards = result.frames[f"{side}_shoulder"][..., 0] * (-1.0 if side == "l" else 1.0)
    return degrees_between(_along(inwards, forearm), _along(palm, forearm))


def turns(source: Figure, result: Figure) -> Iterator[Row]:
    """Angles in degrees by which parts turn otherwise than the source's; constant ones do not count."""
    for part, joint, shown in TURNING:
        if joint in source.frames and shown in result.frames:
            between = np.swapaxes(source.frames[joint], 1, 2) @ result.frames[shown]
            yield Row("turn", part, degrees_turned(between @ mean_rotation(between).T))


def feet(source: Figure, result: Figure, standing: dict[str, Bool], rest: Figure) -> Iterator[Row]:
    """Angles in degrees between the feet as frames: where toes point and how soles are turned.

    The source's soles are level on average where it stands, or in a rest pose that stands: what fits better.
    """
    for side in SIDES:
        toe, shown = source.toe(side), result.toe(side)
        if f"{side}_ankle" not in source.frames or toe is None or shown is None:
            continue
        rows = [
            _foot(source, result, side, level[side], toe, shown)
            for level in (_levels_from_motion(source, standing), _levels_from_rest(rest))
            if side in level
        ]
        if rows:
            yield Row("foot", f"{WORDS[side]} foot", min(rows, key=lambda row: float(np.median(row))))


def level_soles(source: Figure, standing: dict[str, Bool], rest: Figure) -> dict[str, Float64]:
    """Return by side (3,): up, as the axes of a foot see it whose sole is level."""
    return _levels_from_rest(rest) | _levels_from_motion(source, standing)


def _levels_from_motion(source: Figure, standing: dict[str, Bool]) -> dict[str, Float64]:
    frames = {side: source.frames.get(f"{side}_ankle") for side in standing if standing[side].any()}
    return {
        side: unit(one[standing[side], 1].mean(axis=0)) for side, one in frames.items() if one is not None
    }


def _levels_from_rest(rest: Figure) -> dict[str, Float64]:
    if _standing_axes(rest) is None:
        return {}
    return {side: rest.frames[f"{side}_ankle"][0, 1] for side in SIDES}


def _foot(source: Figure, result: Figure, side: str, level: Float64, toe: Float64, shown: Float64) -> Float64:
    """Return angles (T,) between feet. level: (3,), up in the source's foot's axes. toe, shown: (T, 3)."""
    frames = source.frames[f"{side}_ankle"]
    ups = frames @ level, result.frames[f"{side}_midtarsal"][..., 1]
    bone = unit(toe - source.points[f"{side}_ankle"])
    if np.median(np.abs((bone * ups[0]).sum(axis=1))) > STEEP:
        return degrees_between(*ups)  # the bone does not show where the toes point
    ahead = [
        _along(end - one.points[f"{side}_ankle"], up)
        for one, end, up in ((source, toe, ups[0]), (result, shown, ups[1]))
    ]
    own = [np.stack([np.cross(u, a), u, a], axis=-1) for u, a in zip(ups, ahead, strict=True)]
    return degrees_turned(np.swapaxes(own[0], 1, 2) @ own[1])


def heads(source: Figure, result: Figure, rest: Figure) -> Iterator[Row]:
    """Angle in degrees between the heads, where the source's rest pose shows where its head looks.

    rest: the source's, which shows that if it stands as a mirror would show it, and the pelvis of the motion
    has its hips where the rest pose has them.
    """
    ahead = _standing_axes(rest)
    if ahead is None or "skullbase" not in source.frames or not _moves_from(rest, source):
        return
    looks = source.frames["skullbase"] @ rest.frames["skullbase"][0].T @ ahead, result.frames["skullbase"]
    yield Row("head", "head", degrees_turned(np.swapaxes(looks[0], 1, 2) @ looks[1]))


def clavicles(source: Figure, result: Figure, neutral: Figure) -> Iterator[Row]:
    """Angles in degrees of the clavicles from where they belong.

    That is the default posture's place while the source's are where they are with hanging arms; from there
    they move as the source's do. neutral: the body in its default posture.
    """
    chest = next((joint for joint in CHEST if joint in source.frames), None)
    for side in SIDES:
        names = f"{side}_sternoclavicular", f"{side}_shoulder"
        own, rest = result.direction(*names), neutral.direction(*names)
        assert own is not None
        assert rest is not None
        frames = result.frames["vt1"]
        expected = frames @ rest[0]
        theirs = source.direction(*names)
        arm = source.direction(f"{side}_shoulder", f"{side}_elbow")
        if theirs is not None and chest is not None:
            inside = rotations.inside(source.frames[chest], theirs)
            hangs = arm is not None and arm[:, 1] < -HANGS
            usual = unit(np.median(inside[hangs] if np.any(hangs) else inside, axis=0))
            moved = rotations.between_all(np.broadcast_to(source.frames[chest] @ usual, theirs.shape), theirs)
            ways = [(moved @ expected[..., None])[..., 0]]
            if (turning := _turning(source, chest, names[0], hangs)) is not None:
                # as the joint turns, which differs where a clavicle points far from its neutral place
                ways.append((turning @ expected[..., None])[..., 0])
            off = np.min([degrees_between(own, way) for way in ways], axis=0)
        else:
            off = degrees_between(own, expected)
        yield Row("clavicle", f"{WORDS[side]} clavicle", off)


def _turning(source: Figure, chest: str, joint: str, hangs: Bool | bool) -> Float64 | None:
    """Return (T, 3, 3), world turns of a clavicle against the chest, from where it is with hanging arms."""
    if joint not in source.frames:
        return None
    above = source.frames[chest]
    inside = np.swapaxes(above, 1, 2) @ source.frames[joint]
    usual = mean_rotation(inside[hangs] if np.any(hangs) else inside)
    return above @ inside @ usual.T @ np.swapaxes(above, 1, 2)


def _angle(name: str, part: str, source: Figure, result: Figure, start: str, end: str) -> Iterator[Row]:
    theirs, ours = source.direction(start, end), result.direction(start, end)
    if theirs is not None and ours is not None:
        yield Row(name, part, degrees_between(theirs, ours))


def _trunk(figure: Figure) -> Float64 | None:
    hips, shoulders = figure.middle("hip"), figure.middle("shoulder")
    return None if hips is None or shoulders is None else unit(shoulders - hips)


def _standing_axes(rest: Figure) -> Float64 | None:
    """Return (3, 3): to the left, up and ahead, of a figure that stands straight, or None.

    Left and right must be mirror images of each other, the trunk above the legs.
    """
    pairs = [
        (p, f"r{n[1:]}") for n, p in rest.points.items() if n.startswith("l_") and f"r{n[1:]}" in rest.points
    ]
    trunk, left = _trunk(rest), rest.direction("r_hip", "l_hip")
    foot = rest.middle("ankle")
    if trunk is None or left is None or foot is None or len(pairs) < MOST_PAIRS:
        return None
    middle = rest.middle("hip")
    assert middle is not None
    normal, size = left[0], float(np.linalg.norm(middle[0] - foot[0]))
    ends = np.array([[one[0], rest.points[other][0]] for one, other in pairs]) - middle[0]
    mirrored = ends[:, 0] - 2 * (ends[:, 0] @ normal)[:, None] * normal
    off = np.linalg.norm(mirrored - ends[:, 1], axis=1).max()
    upright = min(float(trunk[0, 1]), float(unit(middle - foot)[0, 1]))
    if off > MAX_ASYMMETRY * size or upright < MIN_STRAIGHTNESS:
        return None
    up = np.array([0.0, 1.0, 0.0])
    side = _along(left, up[None])[0]
    return np.stack([side, up, np.cross(side, up)], axis=-1)


def _moves_from(rest: Figure, source: Figure) -> bool:
    """Whether the hips of a motion lie on average as in a rest pose, as the pelvis sees them."""
    rows = [one.direction("r_hip", "l_hip") for one in (rest, source)]
    if rows[0] is None or rows[1] is None or ROOT not in source.frames:
        return True
    turns = source.frames[ROOT] @ rest.frames[ROOT][0].T
    usual = np.einsum("tij,ti->j", turns, rows[1])
    return bool(degrees_between(usual, rows[0][0]) < MOST_ROW_TURN)


def _hand_axes(figure: Figure, side: str, fingers: tuple[str, ...]) -> Float64:
    """Return (T, 3, 3), the axes of a hand with these knuckles; of the world if there are not two."""
    wrist = figure.points.get(f"{side}_wrist")
    if wrist is None or len(fingers) < 2:
        return np.broadcast_to(np.eye(3), (1, 3, 3))
    palm = figure.palm(side, (fingers[0], fingers[-1]))
    ahead = _along(figure.points[f"{side}_{fingers[0]}1"] - wrist, palm)
    return np.stack([np.cross(palm, ahead), palm, ahead], axis=-1)


def _along(vectors: Float64, normal: Float64) -> Float64:
    """Return unit vectors (T, 3) without their part along normals (T, 3)."""
    return unit(vectors - normal * (vectors * normal).sum(axis=-1, keepdims=True))


def leg_twists(result: Figure) -> Iterator[Row]:
    """Yield the twist, in degrees, of thighs and shanks about their length, against pelvis and thigh.

    Directions of bones do not show it: a thigh turned round, with a shank turned back, points the right way,
    and the skin between is twisted like a cloth.
    """
    for side in SIDES:
        for part, above, joint in LEG_PARTS:
            upper, lower = (result.frames[name.format(side)] for name in (above, joint))
            yield Row("wrung", f"{WORDS[side]} {part}", _twists(np.swapaxes(upper, -1, -2) @ lower))


def _twists(turns: Float64) -> Float64:
    """Return the angles (T,), in degrees, of the turns about +y closest to rotations (T, 3, 3)."""
    sine = turns[:, 0, 2] - turns[:, 2, 0]
    cosine = turns[:, 0, 0] + turns[:, 2, 2]
    result: Float64 = np.abs(np.degrees(np.arctan2(sine, cosine)))
    return result
