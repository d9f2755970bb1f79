"""Prepare a captured motion: find which joint is which, which axis points up, and the rest pose.

The result is a motion with y up, whose rest pose a person can take. Each answer has a confidence; below
`MIN_CONFIDENCE` the motion is refused, and the error says what was seen.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fba import rotations
from fba.arrays import Float64, Intp
from fba.body import ROOT, Skeleton
from fba.capture import _rest_alignment as rest_alignment
from fba.capture import _standing as standing
from fba.capture._rest_from_motion import LOW_ARM, mean_turn, rest_from_motion
from fba.capture._up_axis import UPS, find_up_axis, nearest_axis
from fba.capture.bones import GIVE_JOINTS, check_extent, check_root, find_bones, refuse_swapped_sides
from fba.capture.motion import MappedMotion, SkeletonMotion, read_axis
from fba.choices import SignedUpAxis
from fba.errors import FbaWarning, ModelError, Remedy

MIN_CONFIDENCE = 0.5
"""Smallest confidence, 0 to 1, with which a motion is accepted."""
RESTS = ("auto", "file", "first", "motion")
MAX_POSED_DISTANCE = 3.0
"""Largest distance from standing, in degrees, of a rest pose that a file may store in any pose."""
MAX_FIRST_FRAME_DISTANCE = 4.0
"""Largest distance from standing, in degrees, of a first frame that serves as the rest pose."""
MAX_POSE_DIFFERENCE = 0.01
"""Share of the skeleton's size within which a rest pose equals a frame of the motion."""
MAX_ROW_TURN = {"hip": 25.0, "shoulder": 45.0}
"""Largest average turn, in degrees, of the row of hips or shoulders from the rest pose, relative to the joint
above them. In real files it is up to 6 for hips, up to 8 for shoulders."""
MAX_ARM_TILT = 10.0
"""Largest angle, in degrees, between an arm in a T-pose and the side."""
Y = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True, eq=False)
class Preparation:
    """A motion that is ready to be retargeted, and how it was understood.

    motion: y up, with a rest pose that a person can take. mapped: joint of the body -> number of the source's
    joint. family: of the joint names; "words" if they were read word by word, empty if the caller gave the
    joints. rest: "file", "first", "motion" or "frame 12". up: the source's axis, such as "+z". confidence: of
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
    up: SignedUpAxis = "auto",
) -> Preparation:
    """Return the motion prepared for retargeting.

    joints: source joint -> joint of the standard; None to find them. rest: "auto", "file" for the file's own
    rest pose, "first" for its first frame, a number for another frame, "motion" to work it out from the
    motion. up: "auto", or the source's axis that points up, such as "+z".

    Raises ModelError for less confidence than `MIN_CONFIDENCE`, where no bones are found, and for a frame
    that does not exist; ValueError for other wrong options.
    """
    if isinstance(rest, str) and rest not in RESTS:
        raise ValueError(f"rest must be one of {', '.join(RESTS)} or the number of a frame, not {rest!r}")
    if up != "auto" and up not in UPS:
        raise ValueError(f"up must be auto or one of {', '.join(UPS)}, not {up!r}")
    if not len(motion):
        raise ModelError("the motion has no frames")
    if not isinstance(rest, str) and not 0 <= rest < len(motion):
        raise ModelError(
            f"the motion has {len(motion)} frames, from 0; there is no frame {rest} to rest in"
        ).with_remedies(Remedy("rest", "choose one of these with {}", "0"))
    check_root(skeleton)
    check_extent(motion)
    bones = find_bones(motion, joints, skeleton)
    source = MappedMotion(motion, bones.joints)
    sample = source.select(motion.spread())
    at_rest = standing.measure_rest(source)
    found_up = find_up_axis(source, sample, at_rest, up)
    if joints is None:
        refuse_swapped_sides(sample)
    chosen, sure, reason = _choose_rest(sample, at_rest, rest)
    turn = rotations.between(read_axis(found_up.axis), Y)
    level = motion if found_up.axis == "+y" else motion.turn_axes(turn)
    if chosen == "motion":
        found = rest_from_motion(MappedMotion(level, bones.joints), skeleton)
        level, sure = found.motion, found.confidence
        reason = f"{reason}; worked out from the motion: {found.reason}"
    else:
        if chosen == "file":
            rest_up = turn @ nearest_axis(at_rest.up[0])
            if rest_up[1] < 0.5:
                back = rotations.between(rest_up, Y)
                level = level.with_rest(np.broadcast_to(back, (len(level.names), 3, 3)))
        else:
            frame = 0 if chosen == "first" else int(rest)
            level = level.with_rest_of(level, frame)
            if chosen != "first":
                chosen = f"frame {frame}"
        level = correct_rest(MappedMotion(level, bones.joints))
    confidence = {"bones": bones.confidence, "up": found_up.confidence, "rest": sure}
    reasons = {"bones": bones.reason, "up": found_up.reason, "rest": reason}
    result = Preparation(level, bones.joints, bones.family, chosen, found_up.axis, confidence, reasons)
    _refuse_doubt(result, joints is not None, rest != "auto", up != "auto")
    if found_up.doubt:
        warning = FbaWarning(f"up is taken to be {found_up.axis}: {found_up.doubt}")
        remedy = Remedy("up", "if another axis points up, say which with {}", f"'{found_up.instead}'")
        warnings.warn(warning.with_remedies(remedy), stacklevel=3)
    return result


def _refuse_doubt(result: Preparation, given_joints: bool, given_rest: bool, given_up: bool) -> None:
    """Raise ModelError for the first answer that is not sure enough, unless the caller gave it."""
    give_up = Remedy("up", "say which axis points up with {}", "'+y'")
    give_rest = Remedy("rest", "if a frame shows a T-pose, or somebody who stands, say which with {}", "0")
    for what, given, finding, remedy in (
        ("bones", given_joints, "which joint is which is not clear", GIVE_JOINTS),
        ("up", given_up, "which way is up is not clear", give_up),
        ("rest", given_rest, "the rest pose is not clear", give_rest),
    ):
        if not given and result.confidence[what] < MIN_CONFIDENCE:
            raise ModelError(
                f"{finding} (confidence {result.confidence[what]:.2f}, at least {MIN_CONFIDENCE} is needed): "
                f"{result.reasons[what]}"
            ).with_remedies(remedy)


def _choose_rest(sample: MappedMotion, at_rest: standing.Stance, rest: str | int) -> tuple[str, float, str]:
    """Return the rest pose to use ("file", "first", "motion" or `rest`), the confidence and a reason."""
    if rest != "auto":
        return str(rest), 1.0, "as given"
    distance = float(at_rest.distance[0])
    possible = bool(at_rest.possible[0])
    if possible and sample.motion.posed:
        possible = distance <= MAX_POSED_DISTANCE and not _rests_in_a_frame(sample)
        why = "the nodes' own pose is one of the motion"
    else:
        why = f"nobody can stand as in the file's rest pose ({at_rest.worst(0)})"
    if possible:
        turned = _find_turned_row(sample)
        if turned is None:
            return "file", max(0.6, 1.0 - distance / 50.0), "the file's own rest pose is a person's"
        why = f"the {turned[0]} are {turned[1]:.0f} degrees from the file's rest pose on average"
    first = standing.measure({joint: places[:1] for joint, places in sample.positions.items()})
    distance = float(first.distance[0])
    if bool(first.possible[0]) and distance <= MAX_FIRST_FRAME_DISTANCE and _arms_out(sample, first.left[0]):
        return "first", 0.9, f"{why}; the first frame is a T-pose"
    return "motion", 1.0, why


def _rests_in_a_frame(sample: MappedMotion) -> bool:
    """Return whether the rest pose is a pose of the motion."""
    root, rest, positions = sample.mapped[ROOT], sample.motion.rest(), sample.motion.world()[1]
    relative = rest - rest[root]
    size = float(np.ptp(relative, axis=0).max())
    differences = np.abs(positions - positions[:, [root]] - relative).max(axis=(1, 2))
    return len(differences) > 1 and float(differences.min()) < MAX_POSE_DIFFERENCE * size


def _find_turned_row(sample: MappedMotion) -> tuple[str, float] | None:
    """Return the row that is turned from the rest pose, hips or shoulders, and by how many degrees; or None.

    Rotations that were fitted to positions of joints may turn the pelvis aside and its hips back. The file's
    rest pose then says nothing.
    """
    for joint, most in MAX_ROW_TURN.items():
        left, right = f"l_{joint}", f"r_{joint}"
        if left not in sample or right not in sample:
            continue
        above = _common_parent(sample.motion, sample.mapped[left], sample.mapped[right])
        if above < 0:
            continue
        row = rotations.unit(sample.positions[left] - sample.positions[right])
        seen = np.einsum("tij,ti->j", sample.motion.joint_rotations(above), row)  # on average, as from above
        turn = float(rotations.degrees_between(seen, sample.rest[left] - sample.rest[right]))
        if turn > most:
            return f"{joint}s", turn
    return None


def _common_parent(motion: SkeletonMotion, first: int, second: int) -> int:
    """Return the number of the nearest joint above both joints, or -1."""
    while first != second:
        first, second = int(motion.parents[max(first, second)]), min(first, second)
    return first


def _arms_out(sample: MappedMotion, left: Float64) -> bool:
    """Return whether both arms point straight to the sides in the first frame. left: (3,), of the trunk."""
    for side, sign in (("l", 1.0), ("r", -1.0)):
        shoulder, wrist = f"{side}_shoulder", f"{side}_wrist"
        if shoulder not in sample or wrist not in sample:
            return False
        arm = rotations.unit(sample.positions[wrist][0] - sample.positions[shoulder][0])
        if float(arm @ left) * sign < np.cos(np.radians(MAX_ARM_TILT)):
            return False
    return True


@dataclass(frozen=True, eq=False)
class Rest:
    """A skeleton at rest; `find_rest` makes it.

    mapped: joint of the body -> number of the source's joint. positions: float64 (J, 3), of the source's
    joints at rest, in its unit, y up, facing +z. corrections: joint of the body -> rotation (3, 3) from the
    default posture to the rest pose, in the same axes. turn: (3, 3), from the source's frame to those axes.
    """

    mapped: Mapping[str, int]
    positions: Float64
    corrections: Mapping[str, Float64]
    turn: Float64


def find_rest(motion: SkeletonMotion, skeleton: Skeleton, joints: Mapping[str, str] | None = None) -> Rest:
    """Return how a skeleton rests. joints: as for `from_skeleton`. ModelError as `from_skeleton`."""
    mapped = find_bones(motion, joints, skeleton).joints
    axis = nearest_axis(standing.measure_rest(MappedMotion(motion, mapped)).up[0])
    upright = rotations.between(axis, Y)
    alignment = rest_alignment.align(MappedMotion(motion.turn_axes(upright), mapped), skeleton)
    ahead = alignment.corrections["sacroiliac"].T
    corrections = {joint: ahead @ correction for joint, correction in alignment.corrections.items()}
    turn = ahead @ upright
    return Rest(mapped, motion.rest() @ turn.T, corrections, turn)


MAX_FRAMES = 1000
"""Largest number of frames, spread evenly over the motion, that are examined."""
MIN_HANGING_FRAMES = 3
"""Smallest number of frames with a hanging arm that show how the clavicle rests."""
MAX_PERSONAL_TURN = 5.0
"""Largest angle, in degrees, between clavicles with hanging arms and at rest that is due to the person's
posture. The rest of a larger angle is due to the skeleton."""
MAX_STANDING_SPEED = 0.15
"""Largest speed of a standing foot, in sizes of the skeleton per second."""
MAX_STANDING_TURN = 8.0
"""Largest angle, in degrees, between the rotations of a standing foot."""
MAX_ASYMMETRY = 9.0
"""Largest difference, in degrees, between the correction of a foot and the mirror image of the other's."""
FOOT_TURN_RANGE = (2.0, 40.0)
"""Smallest and largest correction of a foot, in degrees: less is noise, and more is another rest pose."""
USUAL_SLOPE = -27.0
"""Average slope of feet from ankle to ball over many skeletons, in degrees from level."""
UP = np.array([0.0, 1.0, 0.0])


def correct_rest(source: MappedMotion) -> SkeletonMotion:
    """Return a motion, y up, whose rest pose has clavicles as with hanging arms, and flat feet.

    Files agree on where limbs point at rest, but some raise clavicles for a T-pose or turn them by a constant
    angle, and some draw feet level from the ankle, or rolled with straddled legs. What the motion shows of
    them corrects that.
    """
    motion = source.motion
    rows = motion.spread(MAX_FRAMES)
    sample = source.select(rows)
    rest = np.tile(np.eye(3), (len(motion.names), 1, 1))
    for side in "lr":
        _correct_clavicle(side, sample, rest)
    _correct_feet(sample, rows, rest)
    return motion if (rest == np.eye(3)).all() else motion.with_rest(rest)


def _correct_clavicle(side: str, sample: MappedMotion, rest: Float64) -> None:
    joints = inner, shoulder, elbow = [f"{side}_{j}" for j in ("sternoclavicular", "shoulder", "elbow")]
    if not all(joint in sample for joint in joints):
        return
    arm = rotations.unit(sample.positions[elbow] - sample.positions[shoulder])
    low = np.flatnonzero(arm[:, 1] < -LOW_ARM)
    number = sample.mapped[inner]
    above = int(sample.motion.parents[number])
    if above < 0 or len(low) < MIN_HANGING_FRAMES:
        return
    turn = mean_turn(sample.motion.joint_rotations(above, low), sample.rotations(inner, low))
    angle = float(np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1.0, 1.0))))
    if angle > MAX_PERSONAL_TURN:
        rest[number] = rotations.part(np.eye(3), turn, 1.0 - MAX_PERSONAL_TURN / angle)


def _correct_feet(sample: MappedMotion, rows: Intp, rest: Float64) -> None:
    """Turn the rest of both feet. rows: numbers of the sample's frames in the whole motion."""
    size = float(np.ptp(sample.motion.rest(), axis=0).max())
    ups = []
    for side in "lr":
        ankle = f"{side}_ankle"
        if ankle not in sample or len(rows) < 2:
            return
        seconds = np.gradient(rows.astype(np.float64)) / float(sample.motion.rate)
        speed = np.linalg.norm(np.gradient(sample.positions[ankle], axis=0), axis=1) / (seconds * size)
        height = sample.positions[ankle][:, 1]
        low = np.flatnonzero(height <= np.median(height))
        still = low[np.argsort(speed[low], kind="stable")][: max(1, len(low) // 3)]
        if speed[still].max() > MAX_STANDING_SPEED:
            return
        up = sample.rotations(ankle, still)[:, 1].mean(axis=0)  # world up as the foot sees it
        if np.degrees(np.arccos(np.clip(np.linalg.norm(up), 0.0, 1.0))) > MAX_STANDING_TURN:
            return
        ups.append(rotations.unit(up))
    facing = standing.measure_rest(sample)
    ahead, left = np.cross(facing.left[0], UP), facing.left[0]
    pitch = [float(np.degrees(np.arctan2(up @ ahead, up[1]))) for up in ups]
    roll = [float(np.degrees(np.arctan2(up @ left, up[1]))) for up in ups]
    mean_pitch = sum(pitch) / 2 if abs(pitch[0] - pitch[1]) < MAX_ASYMMETRY else 0.0
    mean_roll = (roll[0] - roll[1]) / 2 if abs(roll[0] + roll[1]) < MAX_ASYMMETRY else 0.0
    for side, own_roll in (("l", mean_roll), ("r", -mean_roll)):
        ankle, toe = f"{side}_ankle", f"{side}_metatarsal"
        own_pitch = 0.0
        if toe in sample:
            bone = sample.rest[toe] - sample.rest[ankle]
            slope = float(np.degrees(np.arctan2(bone[1], bone @ ahead)))
            if abs(slope + mean_pitch - USUAL_SLOPE) <= abs(slope - USUAL_SLOPE):
                own_pitch = mean_pitch
        if FOOT_TURN_RANGE[0] <= max(abs(own_pitch), abs(own_roll)) <= FOOT_TURN_RANGE[1]:
            up = UP + np.tan(np.radians(own_pitch)) * ahead + np.tan(np.radians(own_roll)) * left
            rest[sample.motion.descendants(sample.mapped[ankle])] = rotations.between(up, UP)
