"""Measures of poses: how parts of the result are turned, compared with the source's, in every frame.

Each function yields a `Row` for each part: values (T,), 0 or more; NaN where nothing can be compared.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from fba import rotations
from fba.arrays import Bool, Float64
from fba.body import ROOT, SIDES
from fba.capture.comparison._figure import Figure, degrees_turned, mean_rotation
from fba.rotations import degrees_between, unit

MIN_PAIRS = 4
"""Smallest number of pairs of joints, left and right, that show whether a pose is symmetric."""
MAX_ASYMMETRY = 0.05
"""Largest difference between joints of a pair in a symmetric pose, as a share of the legs' length."""
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
"""Parts, the source's joint that turns each, and the result's."""
FINGERS = ("thumb", "index", "middle", "ring", "pinky")
CHEST = ("vt1", "vt4", "vt6", "vt8", "vt9", "vt10", "vt12", "vl1", "vl2", "vl3", "vl5")
"""Joints that may be the source's chest, from the top."""
MIN_HANGING_COSINE = 0.5
"""Smallest cosine of the angle between a hanging arm and straight down."""
MAX_ROW_TURN = 25.0
"""Largest angle, in degrees, of the row of hips on average from that at rest, relative to the pelvis, at
which the rest pose shows where a head looks."""
MAX_STEEPNESS = 0.85
"""Largest cosine of the angle between straight down and a foot's bone that shows where the toes point."""
MAX_WRUNG = 100.0
"""Largest angle, in degrees, by which forearm and wrist of a person turn the palm to either side."""
LEG_PARTS = (("thigh", "sacroiliac", "{}_hip"), ("shank", "{}_hip", "{}_knee"))
"""Parts of the leg, the joint above each, and the joint where it begins."""


class Row(NamedTuple):
    """A measure of a part in every frame."""

    name: str
    part: str
    values: Float64


def directions(source: Figure, result: Figure) -> Iterator[Row]:
    """Angles in degrees between bones: arms, legs, hands, fingers, trunk, lines of hips and shoulders."""
    for side in SIDES:
        for bone, start, end in LIMBS:
            yield from _angle(f"{WORDS[side]} {bone}", source, result, f"{side}_{start}", f"{side}_{end}")
        both = [finger for finger in source.knuckles(side) if finger in result.knuckles(side)]
        wrist = f"{side}_wrist"
        if len(both) > 1 and wrist in source.points:
            lines = [
                unit(
                    np.mean([figure.knuckles(side)[finger] for finger in both], axis=0) - figure.points[wrist]
                )
                for figure in (source, result)
            ]
            yield Row("direction", f"{WORDS[side]} hand", degrees_between(*lines))
        hands = [_hand_axes(figure, side, tuple(both)) for figure in (source, result)]
        for finger in FINGERS:
            rows = []
            for n in (1, 2):
                ends = f"{side}_{finger}{n}", f"{side}_{finger}{n + 1}"
                expected, shown = source.direction(*ends), result.direction(*ends)
                if expected is not None and shown is not None:
                    inside = rotations.inside(hands[0], expected), rotations.inside(hands[1], shown)
                    rows.append(degrees_between(*inside))
            if rows:
                yield Row("finger", f"{WORDS[side]} {finger}", np.max(rows, axis=0))
    for joint in ("hip", "shoulder"):
        yield from _angle(f"line of the {joint}s", source, result, f"r_{joint}", f"l_{joint}")
    trunks = _trunk(source), _trunk(result)
    if trunks[0] is not None and trunks[1] is not None:
        yield Row("trunk", "trunk", degrees_between(trunks[0], trunks[1]))


def palms(source: Figure, result: Figure, rest: Figure) -> Iterator[Row]:
    """Angles in degrees between the palms.

    Knuckles of two fingers show the source's palms. Without these, a rest pose that stands shows them: palms
    face the thighs where arms hang, and the ground in a T-pose. Without either, the values are the angles by
    which the result's forearms are wrung more than people can.
    """
    axes = _standing_axes(rest) if _moves_from(rest, source) else None
    for side in SIDES:
        part = f"{WORDS[side]} hand"
        shown = list(result.knuckles(side))
        if f"{side}_wrist" not in source.points or f"{side}_elbow" not in source.points or len(shown) < 2:
            continue
        both = [finger for finger in source.knuckles(side) if finger in shown]
        if len(both) > 1:
            ends = both[0], both[-1]
            yield Row("palm", part, degrees_between(source.palm(side, ends), result.palm(side, ends)))
            continue
        palm = result.palm(side, (shown[0], shown[-1]))
        if axes is not None:
            inwards = axes[:, 0] * (-1.0 if side == "l" else 1.0)
            wrist = rest.points[f"{side}_wrist"]
            # turned so that it hangs, whatever the arm does at rest, the hand shows how hands hang
            bone = rest.tips.get(f"{side}_wrist", 2 * wrist - rest.points[f"{side}_elbow"]) - wrist
            raised = rotations.between(np.array([0.0, -1.0, 0.0]), unit(bone)[0])
            at_rest = rest.frames[f"{side}_wrist"][0].T @ raised @ inwards
            yield Row("palm", part, degrees_between(source.frames[f"{side}_wrist"] @ at_rest, palm))
        else:
            yield Row("palm", part, np.maximum(_wringing(result, side, palm) - MAX_WRUNG, 0.0))


def _wringing(result: Figure, side: str, palm: Float64) -> Float64:
    """Return degrees (T,) by which a palm is turned about the forearm from where the thumb points up."""
    forearm = unit(result.points[f"{side}_wrist"] - result.points[f"{side}_elbow"])
    inwards = result.frames[f"{side}_shoulder"][..., 0] * (-1.0 if side == "l" else 1.0)
    return degrees_between(_along(inwards, forearm), _along(palm, forearm))


def turns(source: Figure, result: Figure) -> Iterator[Row]:
    """Angles in degrees between the turns of parts and the source's, apart from constant ones."""
    for part, joint, shown in TURNING:
        if joint in source.frames and shown in result.frames:
            between = np.swapaxes(source.frames[joint], 1, 2) @ result.frames[shown]
            yield Row("turn", part, degrees_turned(between @ mean_rotation(between).T))


def feet(source: Figure, result: Figure, standing: dict[str, Bool], rest: Figure) -> Iterator[Row]:
    """Angles in degrees between the frames of feet: where toes point and how soles are turned.

    The source's soles are level on average while it stands, or in a rest pose that stands: the measure is the
    smaller.
    """
    for side in SIDES:
        toe, result_toe = source.toe(side), result.toe(side)
        if f"{side}_ankle" not in source.frames or toe is None or result_toe is None:
            continue
        rows = [
            _foot(source, result, side, level[side], toe, result_toe)
            for level in (_levels_from_motion(source, standing), _levels_from_rest(rest))
            if side in level
        ]
        if rows:
            yield Row("foot", f"{WORDS[side]} foot", min(rows, key=lambda row: float(np.median(row))))


def level_soles(source: Figure, standing: dict[str, Bool], rest: Figure) -> dict[str, Float64]:
    """Return by side (3,): up in the axes of a foot whose sole is level."""
    return _levels_from_rest(rest) | _levels_from_motion(source, standing)


def _levels_from_motion(source: Figure, standing: dict[str, Bool]) -> dict[str, Float64]:
    frames = {side: source.frames.get(f"{side}_ankle") for side in standing if standing[side].any()}
    return {
        side: unit(frame[standing[side], 1].mean(axis=0))
        for side, frame in frames.items()
        if frame is not None
    }


def _levels_from_rest(rest: Figure) -> dict[str, Float64]:
    if _standing_axes(rest) is None:
        return {}
    return {side: rest.frames[f"{side}_ankle"][0, 1] for side in SIDES}


def _foot(
    source: Figure, result: Figure, side: str, level: Float64, toe: Float64, result_toe: Float64
) -> Float64:
    """Return angles (T,) between feet. level: (3,), up in the axes of the source's foot. toes: (T, 3)."""
    ankle = f"{side}_ankle"
    ups = source.frames[ankle] @ level, result.frames[f"{side}_midtarsal"][..., 1]
    bone = unit(toe - source.points[ankle])
    if np.median(np.abs((bone * ups[0]).sum(axis=1))) > MAX_STEEPNESS:
        return degrees_between(*ups)  # the bone does not show where the toes point
    aheads = _along(toe - source.points[ankle], ups[0]), _along(result_toe - result.points[ankle], ups[1])
    frames = [
        np.stack([np.cross(up, ahead), up, ahead], axis=-1) for up, ahead in zip(ups, aheads, strict=True)
    ]
    return degrees_turned(np.swapaxes(frames[0], 1, 2) @ frames[1])


def heads(source: Figure, result: Figure, rest: Figure) -> Iterator[Row]:
    """Angle in degrees between the heads, where the source's rest pose shows where its head looks.

    It does if it stands symmetrically, and the hips of the motion are where the rest pose has them.
    """
    ahead = _standing_axes(rest)
    if ahead is None or "skullbase" not in source.frames or not _moves_from(rest, source):
        return
    expected = source.frames["skullbase"] @ rest.frames["skullbase"][0].T @ ahead
    yield Row("head", "head", degrees_turned(np.swapaxes(expected, 1, 2) @ result.frames["skullbase"]))


def clavicles(source: Figure, result: Figure, neutral: Figure) -> Iterator[Row]:
    """Angles in degrees between the clavicles and where they should be.

    They should be as in the default posture while the source's are as with hanging arms, and move from there
    as the source's do. neutral: the body in its default posture.
    """
    chest = next((joint for joint in CHEST if joint in source.frames), None)
    for side in SIDES:
        names = f"{side}_sternoclavicular", f"{side}_shoulder"
        shown, rest = result.direction(*names), neutral.direction(*names)
        assert shown is not None
        assert rest is not None
        expected = [result.frames["vt1"] @ rest[0]]
        clavicle = source.direction(*names)
        if clavicle is not None and chest is not None:
            arm = source.direction(f"{side}_shoulder", f"{side}_elbow")
            inside = rotations.inside(source.frames[chest], clavicle)
            hangs = arm is not None and arm[:, 1] < -MIN_HANGING_COSINE
            usual = unit(np.median(inside[hangs] if np.any(hangs) else inside, axis=0))
            start = np.broadcast_to(source.frames[chest] @ usual, clavicle.shape)
            turns = [rotations.between_all(start, clavicle)]
            if (turning := _turning(source, chest, names[0], hangs)) is not None:
                turns.append(turning)  # differs where a clavicle points far from its neutral direction
            expected = [(turn @ expected[0][..., None])[..., 0] for turn in turns]
        off = np.min([degrees_between(shown, direction) for direction in expected], axis=0)
        yield Row("clavicle", f"{WORDS[side]} clavicle", off)


def _turning(source: Figure, chest: str, joint: str, hangs: Bool | bool) -> Float64 | None:
    """Return the turns (T, 3, 3) of a clavicle relative to the chest, in the world, from hanging arms."""
    if joint not in source.frames:
        return None
    above = source.frames[chest]
    inside = np.swapaxes(above, 1, 2) @ source.frames[joint]
    usual = mean_rotation(inside[hangs] if np.any(hangs) else inside)
    return above @ inside @ usual.T @ np.swapaxes(above, 1, 2)


def _angle(part: str, source: Figure, result: Figure, start: str, end: str) -> Iterator[Row]:
    expected, shown = source.direction(start, end), result.direction(start, end)
    if expected is not None and shown is not None:
        yield Row("direction", part, degrees_between(expected, shown))


def _trunk(figure: Figure) -> Float64 | None:
    hips, shoulders = figure.middle("hip"), figure.middle("shoulder")
    return None if hips is None or shoulders is None else unit(shoulders - hips)


def _standing_axes(rest: Figure) -> Float64 | None:
    """Return columns (3, 3), left, up and ahead, of a figure that stands symmetrically; else None."""
    pairs = [
        (point, rest.points[f"r{name[1:]}"])
        for name, point in rest.points.items()
        if name.startswith("l_") and f"r{name[1:]}" in rest.points
    ]
    trunk, left = _trunk(rest), rest.direction("r_hip", "l_hip")
    foot = rest.middle("ankle")
    if trunk is None or left is None or foot is None or len(pairs) < MIN_PAIRS:
        return None
    middle = rest.middle("hip")
    assert middle is not None
    normal, size = left[0], float(np.linalg.norm(middle[0] - foot[0]))
    ends = np.array([[left_end[0], right_end[0]] for left_end, right_end in pairs]) - middle[0]
    mirrored = ends[:, 0] - 2 * (ends[:, 0] @ normal)[:, None] * normal
    off = np.linalg.norm(mirrored - ends[:, 1], axis=1).max()
    upright = min(float(trunk[0, 1]), float(unit(middle - foot)[0, 1]))
    if off > MAX_ASYMMETRY * size or upright < MIN_STRAIGHTNESS:
        return None
    up = np.array([0.0, 1.0, 0.0])
    side = _along(left, up[None])[0]
    return np.stack([side, up, np.cross(side, up)], axis=-1)


def _moves_from(rest: Figure, source: Figure) -> bool:
    """Whether the hips of a motion lie on average as in a rest pose, relative to the pelvis."""
    at_rest, row = rest.direction("r_hip", "l_hip"), source.direction("r_hip", "l_hip")
    if at_rest is None or row is None or ROOT not in source.frames:
        return True
    turns = source.frames[ROOT] @ rest.frames[ROOT][0].T
    usual = np.einsum("tij,ti->j", turns, row)
    return bool(degrees_between(usual, at_rest[0]) < MAX_ROW_TURN)


def _hand_axes(figure: Figure, side: str, fingers: tuple[str, ...]) -> Float64:
    """Return the axes (T, 3, 3) of a hand with these knuckles; those of the world for less than two."""
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
    """Twists in degrees of thighs and shanks about their length, relative to pelvis and thigh.

    Directions of bones do not show them: a thigh that is turned round, with a shank that is turned back,
    points in the right direction, and the skin between them is twisted like a cloth.
    """
    for side in SIDES:
        for part, above, joint in LEG_PARTS:
            upper, lower = (result.frames[name.format(side)] for name in (above, joint))
            yield Row("wrung", f"{WORDS[side]} {part}", _twists(np.swapaxes(upper, -1, -2) @ lower))


def _twists(turns: Float64) -> Float64:
    """Return the angles (T,), in degrees, of the turns about +y closest to rotations (T, 3, 3)."""
    sine = turns[:, 0, 2] - turns[:, 2, 0]
    cosine = turns[:, 0, 0] + turns[:, 2, 2]
    return np.abs(np.degrees(np.arctan2(sine, cosine)))
