"""Prepare a captured motion: which joint is which, which way is up, and what the rest pose is.

The result is a motion with y up, whose rest pose is one that a person can take, so that what follows need not
ask again. Each answer has a confidence; below `LEAST` the motion is refused with what was seen.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.body.skeleton import ROOT, Skeleton
from fba.capture import _named_bones as named_bones
from fba.capture import _standing as standing
from fba.capture import matching
from fba.capture._rest_correction import correct_rest
from fba.capture._rest_from_motion import rest_from_motion, with_rest
from fba.capture.motion import SkeletonMotion
from fba.errors import ModelError, Remedy

LEAST = 0.5
"""Confidence below which a motion is refused."""
FRAMES = 400
"""Frames that are looked at."""
UPS = ("+x", "-x", "+y", "-y", "+z", "-z")
RESTS = ("auto", "file", "first", "motion")
CORE = tuple(
    f"{side}_{joint}" for side in "lr" for joint in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
)
"""Joints that a whole body has."""
LIMBS = tuple(
    tuple(f"{side}_{joint}" for joint in chain)
    for side in "lr"
    for chain in (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist"))
)
CLEAR_UP = 0.75
"""Length of the mean of upright directions from which on the motion says which way is up."""
POSED_DISTANCE = 3.0
"""Degrees from standing up to which a rest pose that might be any pose is believed."""
FIRST_DISTANCE = 4.0
"""The same for a first frame that is taken as the rest pose of a file that has none."""
SAME_POSE = 0.01
"""Share of the size within which a rest pose is a frame of the motion."""
MOST_ROW_TURN = {"hip": 25.0, "shoulder": 45.0}
"""Degrees by which the rows of hips and shoulders may differ, on average, from the rest pose, as the joint
sees them that they hang on. In real files hips differ by up to 6, shoulders by up to 8."""
FLOOR_NEAR = 0.12
"""Share of the size within which the lowest joints are at height 0."""


@dataclass(frozen=True, eq=False)
class Preparation:
    """A motion that is ready to be retargeted, and what was found out about it.

    motion: y up, with a rest pose that a person can take. mapped: joint of the body -> number of the source's
    joint. family: that of the joint names, "words" if they were read word by word, empty if joints were
    given. rest: "file", "first", "motion" or "frame 12". up: the source's axis, such as "+z". confidence: of
    "bones", "up" and "rest", 0 to 1. reasons: of the same, for people.
    """

    motion: SkeletonMotion
    mapped: dict[str, int]
    family: str
    rest: str
    up: str
    confidence: dict[str, float]
    reasons: dict[str, str]


def prepare(
    motion: SkeletonMotion,
    skeleton: Skeleton,
    *,
    joints: Mapping[str, str] | None = None,
    rest: str | int = "auto",
    up: str = "auto",
) -> Preparation:
    """Return a motion made ready, see `Preparation`.

    joints: source joint -> joint of the standard; None to find them. rest: "auto", "file" for the file's own
    rest pose, "first" for its first frame, a number for another frame, "motion" to work it out from the
    motion. up: "auto", or the source's axis that points up, such as "+z".

    ModelError for less confidence than `LEAST`, where no bones are found, and for a frame that is not there;
    ValueError for other wrong options.
    """
    if isinstance(rest, str) and rest not in RESTS:
        raise ValueError(f"rest must be one of {', '.join(RESTS)} or the number of a frame, not {rest!r}")
    if up != "auto" and up not in UPS:
        raise ValueError(f"up must be auto or one of {', '.join(UPS)}, not {up!r}")
    if not len(motion):
        raise ModelError("the motion has no frames")
    if not isinstance(rest, str) and not 0 <= rest < len(motion):
        raise ModelError(f"rest: the motion has {len(motion)} frames, from 0; there is no frame {rest}")
    matching.check_root(skeleton)
    if not np.ptp(motion.rest(), axis=0).any():
        raise ModelError("the source's joints all coincide in its rest pose; it has no bones")
    family, mapped, sure, how = find_bones(motion, joints, skeleton)
    confidence, reasons = {"bones": sure}, {"bones": how}
    few = _few(motion)
    quaternions, positions = few.world()
    at_rest = standing.measure(motion.rest()[None], mapped)
    axis, confidence["up"], reasons["up"] = _find_up(positions, mapped, at_rest, up, motion.up)
    turn = rotations.between(_axis(axis), np.array([0.0, 1.0, 0.0]))
    level = motion if axis == "+y" else turn_axes(motion, turn)
    chosen, confidence["rest"], reasons["rest"] = _choose_rest(
        motion, quaternions, positions, mapped, at_rest, rest
    )
    if chosen == "motion":
        found = rest_from_motion(level, mapped, skeleton)
        level, confidence["rest"] = found.motion, found.confidence
        reasons["rest"] = f"{reasons['rest']}; worked out from the motion: {found.reason}"
    elif chosen == "file":
        rest_up = turn @ _nearest_axis(at_rest.up[0])
        if rest_up[1] < 0.5:
            back = rotations.between(rest_up, np.array([0.0, 1.0, 0.0]))
            level = with_rest(level, np.broadcast_to(back, (len(level.names), 3, 3)))
    else:
        frame = 0 if chosen == "first" else int(rest)
        row = replace(level, rotations=level.rotations[[frame]], positions=level.positions[[frame]])
        level = with_rest(level, rotations.matrices(row.world()[0][0]))
        if chosen != "first":
            chosen = f"frame {frame}"
    if chosen != "motion":
        level = correct_rest(level, mapped)
    result = Preparation(level, mapped, family, chosen, axis, confidence, reasons)
    _refuse_doubt(result, joints is not None, rest != "auto", up != "auto")
    return result


def find_upright(motion: SkeletonMotion, mapped: Mapping[str, int]) -> Float64:
    """Return the rotation (3, 3) of the axes of a rest pose that brings the one closest to its up to +y."""
    stance = standing.measure(motion.rest()[None], mapped)
    return rotations.between(_nearest_axis(stance.up[0]), np.array([0.0, 1.0, 0.0]))


def find_bones(
    motion: SkeletonMotion, joints: Mapping[str, str] | None, skeleton: Skeleton
) -> tuple[str, dict[str, int], float, str]:
    """Return the family of names, body joint -> source's joint, the confidence, and a reason.

    A family that names all limbs is taken as it is. Otherwise names are read word by word; where that finds
    more limbs, its joints are added to a family that names at least as many joints, and else replace it.
    ModelError where no bones are found.
    """
    if joints is None and motion.declared:
        family, mapped = matching.map_joints(motion.names, motion.declared, skeleton)
        return family, mapped, 1.0, f"{len(mapped)} joints as the file says"
    if joints is not None:
        family, mapped = matching.map_joints(motion.names, joints, skeleton)
        return family, mapped, 1.0, f"{len(mapped)} joints as given"
    try:
        family, by_family = matching.map_joints(motion.names, None, skeleton)
        failure = None
    except ModelError as error:
        family, by_family, failure = "", {}, error
    own = _core(by_family, motion)
    if failure is not None or own < len(CORE):
        by_words = named_bones.find(motion.names, motion.parents, motion.offsets, skeleton)
        if _core(by_words, motion) > own:
            both = _fill_limbs(by_family, by_words)
            if len(by_family) >= len(by_words) and _core(both, motion) == _core(by_words, motion):
                by_family = both  # of a family, but for some joints that somebody renamed
            else:
                family, by_family, failure = "words", by_words, None
    if failure is not None:
        raise failure
    if count_limbs(by_family, motion) < 2:
        raise _unknown_bones(motion, by_family)
    missing = [joint for joint in CORE if joint not in by_family]
    sure = (1.0 if family != "words" else 0.9) - 0.03 * len(missing)
    how = f"{len(by_family)} of {len(motion.names)} joints by " + (
        "the words in their names" if family == "words" else f"names as of {family!r}"
    )
    return family, by_family, sure, how


def _fill_limbs(mapped: Mapping[str, int], others: Mapping[str, int]) -> dict[str, int]:
    """Return joints with those joints of limbs that are missing, from others."""
    used = set(mapped.values())
    missing = {joint: number for joint, number in others.items() if joint in CORE and number not in used}
    return {**missing, **mapped}


def count_limbs(mapped: Mapping[str, int], motion: SkeletonMotion) -> int:
    """Return the number of arms and legs whose upper bone is known, both its joints."""
    return sum(
        upper in mapped and lower in mapped and _is_below(motion, mapped[lower], mapped[upper])
        for upper, lower, _ in LIMBS
    )


def _core(mapped: Mapping[str, int], motion: SkeletonMotion) -> int:
    """Return how many of the core joints are known and hang where they should."""
    count = 0
    for limb in LIMBS:
        above = mapped.get(ROOT)
        for joint in limb:
            number = mapped.get(joint)
            if number is None:
                continue
            if above is not None and not _is_below(motion, number, above):
                continue
            count += 1
            above = number
    return count


def _is_below(motion: SkeletonMotion, joint: int, above: int) -> bool:
    while joint > above:
        joint = int(motion.parents[joint])
    return joint == above


def _few(motion: SkeletonMotion) -> SkeletonMotion:
    rows = np.unique(np.linspace(0, len(motion) - 1, min(len(motion), FRAMES)).astype(np.intp))
    return replace(motion, rotations=motion.rotations[rows], positions=motion.positions[rows])


def _axis(name: str) -> Float64:
    axis = np.zeros(3)
    axis["xyz".index(name[1])] = 1.0 if name[0] == "+" else -1.0
    return axis


def _nearest_axis(direction: Float64) -> Float64:
    axis = np.zeros(3)
    best = int(np.argmax(np.abs(direction)))
    axis[best] = np.sign(direction[best]) or 1.0
    return axis


def _name(axis: Float64) -> str:
    best = int(np.argmax(np.abs(axis)))
    return ("+" if axis[best] > 0 else "-") + "xyz"[best]


def _find_up(
    positions: Float64, mapped: Mapping[str, int], at_rest: standing.Stance, up: str, by_format: str
) -> tuple[str, float, str]:
    """Return the axis that points up, the confidence, and a reason.

    positions: (T, J, 3), of the source. up: as given. by_format: what the file's format says, or "".
    """
    if up != "auto":
        return up, 1.0, f"{up} as given"
    stance = standing.measure(positions, mapped)
    weight = np.exp(-((stance.distance / 20.0) ** 2)) + 0.02
    mean = (stance.up * weight[:, None]).sum(axis=0) / weight.sum()
    axis = _nearest_axis(mean)
    clear = float(mean @ axis)
    own = _nearest_axis(at_rest.up[0]) if bool(at_rest.possible[0]) else None
    own = _axis(by_format) if by_format else own
    source = "as the format says" if by_format else "as in the rest pose"
    if own is None or (own == axis).all():
        if clear >= CLEAR_UP or (own is not None and clear > 0):
            agrees = f", {source}" if own is not None else ""
            return _name(axis), max(clear, 0.8 if own is not None else 0.0), (
                f"{_name(axis)}: people stand along it{agrees} ({100 * clear:.0f} %)"
            )  # fmt: skip
        return _name(axis), clear * 0.6, f"perhaps {_name(axis)}: the body is upright for little of the time"
    floors = [_stands_on_zero(positions, candidate) for candidate in (own, axis)]
    if clear >= CLEAR_UP and (floors[1] or not floors[0]):
        return _name(axis), 0.8, (
            f"{_name(axis)}: the body stands along it while it moves, not along {_name(own)}, {source}"
        )  # fmt: skip
    sure = 0.7 if clear < CLEAR_UP or floors[0] else 0.4
    return _name(own), sure, f"{_name(own)}, {source}; the body hardly stands upright"


def _stands_on_zero(positions: Float64, axis: Float64) -> bool:
    """Whether the lowest joints are close to height 0 along an axis."""
    size = float(np.ptp(positions, axis=1).max())
    lowest = float(np.percentile((positions @ axis).min(axis=1), 20))
    return abs(lowest) < FLOOR_NEAR * size


def _choose_rest(
    motion: SkeletonMotion,
    quaternions: Float64,
    positions: Float64,
    mapped: Mapping[str, int],
    at_rest: standing.Stance,
    rest: str | int,
) -> tuple[str, float, str]:
    """Return which rest pose to take, the confidence, and a reason.

    quaternions, positions: (T, J, 4), (T, J, 3), of the source in the world.
    """
    if rest != "auto":
        return str(rest), 1.0, "as given"
    distance = float(at_rest.distance[0])
    possible = bool(at_rest.possible[0])
    if possible and motion.posed:
        relative = motion.rest() - motion.rest()[mapped[ROOT]]
        size = float(np.ptp(relative, axis=0).max())
        frames = positions - positions[:, [mapped[ROOT]]]
        same = len(frames) > 1 and float(np.abs(frames - relative).max(axis=(1, 2)).min()) < SAME_POSE * size
        possible = distance <= POSED_DISTANCE and not same
        why = "the nodes' own pose is one of the motion"
    else:
        why = f"nobody can stand as in the file's rest pose ({at_rest.worst(0)})"
    if possible:
        turned = _find_turned_row(motion, quaternions, positions, mapped)
        if turned is None:
            return "file", max(0.6, 1.0 - distance / 50.0), "the file's own rest pose is a person's"
        why = f"the {turned[0]} are {turned[1]:.0f} degrees from the file's rest pose on average"
    first = standing.measure(positions[:1], mapped)
    if (
        bool(first.possible[0])
        and float(first.distance[0]) <= FIRST_DISTANCE
        and _arms_out(positions[0], mapped, first)
    ):
        return "first", 0.9, f"{why}; the first frame is a T-pose"
    return "motion", 1.0, why


def _find_turned_row(
    motion: SkeletonMotion, quaternions: Float64, positions: Float64, mapped: Mapping[str, int]
) -> tuple[str, float] | None:
    """Return which row, of hips or shoulders, lies otherwise than in the rest pose, and by how many degrees.

    Turns that were fitted to positions of joints may leave the pelvis turned aside, whose hips then are
    turned back: such a rest pose says nothing.
    """
    at_rest = motion.rest()
    for joint, most in MOST_ROW_TURN.items():
        ends = [mapped[name] for name in (f"l_{joint}", f"r_{joint}") if name in mapped]
        if len(ends) < 2 or (above := _common(motion, *ends)) < 0:
            continue
        row = at_rest[ends[0]] - at_rest[ends[1]]
        frames = rotations.matrices(quaternions[:, above])
        turn = standing.row_turn(frames, positions[:, ends[0]] - positions[:, ends[1]], row)
        if turn > most:
            return f"{joint}s", turn
    return None


def _common(motion: SkeletonMotion, one: int, other: int) -> int:
    """Return the number of the joint that two joints hang on, -1 if there is none."""
    while one != other:
        one, other = int(motion.parents[max(one, other)]), min(one, other)
    return one


def _arms_out(positions: Float64, mapped: Mapping[str, int], stance: standing.Stance) -> bool:
    """Whether both arms point straight to the sides."""
    for side, sign in (("l", 1.0), ("r", -1.0)):
        if f"{side}_shoulder" not in mapped or f"{side}_wrist" not in mapped:
            return False
        arm = standing.unit(positions[mapped[f"{side}_wrist"]] - positions[mapped[f"{side}_shoulder"]])
        if float(arm @ stance.left[0]) * sign < np.cos(np.radians(10.0)):
            return False
    return True


def turn_axes(motion: SkeletonMotion, turn: Float64) -> SkeletonMotion:
    """Return the same motion in other axes of the world. turn: (3, 3), from the old axes to the new."""
    quaternion = rotations.quaternions(turn[None])[0]
    inverse = quaternion * [1, -1, -1, -1]
    local = rotations.multiply(
        rotations.multiply(np.broadcast_to(quaternion, motion.rotations.shape), motion.rotations),
        np.broadcast_to(inverse, motion.rotations.shape),
    )
    return replace(
        motion,
        offsets=motion.offsets @ turn.T,
        rotations=local / np.linalg.norm(local, axis=-1, keepdims=True),
        positions=motion.positions @ turn.T,
        end_offsets=motion.end_offsets @ turn.T,
        axes=rotations.quaternions(turn @ rotations.matrices(motion.axes)),
    )


def _unknown_bones(motion: SkeletonMotion, mapped: Mapping[str, int]) -> ModelError:
    found = ", ".join(f"{motion.names[number]} as {joint}" for joint, number in list(mapped.items())[:4])
    names = ", ".join(motion.names[:8]) + (", ..." if len(motion.names) > 8 else "")
    seen = f"; only {found} could be found" if found else ""
    return ModelError(
        f"no arms or legs are found among these {len(motion.names)} joint names: {names}{seen}"
    ).with_remedies(_joints_remedy())


def _joints_remedy() -> Remedy:
    return Remedy(
        "joints", "name each joint's counterpart in the standard with {}", "{'Pelvis': 'HumanoidRoot', ...}"
    )


def _refuse_doubt(result: Preparation, given_joints: bool, given_rest: bool, given_up: bool) -> None:
    """Raise ModelError for the first answer that is not sure enough, unless it was given."""
    for what, given, finding, remedy in (
        ("bones", given_joints, "which joint is which is not clear", _joints_remedy()),
        (
            "up",
            given_up,
            "which way is up is not clear",
            Remedy("up", "say which axis points up with {}", "'+y'"),
        ),
        (
            "rest",
            given_rest,
            "the rest pose is not clear",
            Remedy("rest", "if a frame shows a T-pose, or somebody who stands, say which with {}", "0"),
        ),
    ):
        if not given and result.confidence[what] < LEAST:
            raise ModelError(
                f"{finding} (confidence {result.confidence[what]:.2f}, at least {LEAST} is needed): "
                f"{result.reasons[what]}"
            ).with_remedies(remedy)
