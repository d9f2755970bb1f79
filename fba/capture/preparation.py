"""Prepare a captured motion: which joint is which, which way is up, and what the rest pose is.

The result is a motion with y up, whose rest pose is one that a person can take, so that what follows need not
ask again. Each answer has a confidence; below `LEAST` the motion is refused with what was seen.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fba import rotations
from fba.body.skeleton import Skeleton
from fba.capture import _standing as standing
from fba.capture import matching
from fba.capture._rest_choice import choose_rest
from fba.capture._rest_correction import correct_rest
from fba.capture._rest_from_motion import rest_from_motion, with_rest
from fba.capture._up_axis import UPS, find_up_axis, nearest_axis, turn_axes
from fba.capture.bones import check_extent, find_bones, joints_remedy, refuse_swapped_sides
from fba.capture.motion import SkeletonMotion, read_axis
from fba.errors import FbaWarning, ModelError, Remedy

LEAST = 0.5
"""Confidence below which a motion is refused."""
FRAMES = 400
"""Frames that are looked at."""
RESTS = ("auto", "file", "first", "motion")


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
        raise ModelError(
            f"the motion has {len(motion)} frames, from 0; there is no frame {rest} to rest in"
        ).with_remedies(Remedy("rest", "choose one of these with {}", "0"))
    matching.check_root(skeleton)
    check_extent(motion)
    family, mapped, sure, how = find_bones(motion, joints, skeleton)
    confidence, reasons = {"bones": sure}, {"bones": how}
    few = _few(motion)
    quaternions, positions = few.world()
    at_rest = standing.measure(motion.rest()[None], mapped)
    found_up = find_up_axis(motion, positions, mapped, at_rest, up)
    axis, confidence["up"], reasons["up"] = found_up.axis, found_up.confidence, found_up.reason
    turn = rotations.between(read_axis(axis), np.array([0.0, 1.0, 0.0]))
    level = motion if axis == "+y" else turn_axes(motion, turn)
    if joints is None:
        refuse_swapped_sides(few, mapped)
    chosen, confidence["rest"], reasons["rest"] = choose_rest(
        motion, quaternions, positions, mapped, at_rest, rest
    )
    if chosen == "motion":
        found = rest_from_motion(level, mapped, skeleton)
        level, confidence["rest"] = found.motion, found.confidence
        reasons["rest"] = f"{reasons['rest']}; worked out from the motion: {found.reason}"
    elif chosen == "file":
        rest_up = turn @ nearest_axis(at_rest.up[0])
        if rest_up[1] < 0.5:
            back = rotations.between(rest_up, np.array([0.0, 1.0, 0.0]))
            level = with_rest(level, np.broadcast_to(back, (len(level.names), 3, 3)))
    else:
        frame = 0 if chosen == "first" else int(rest)
        level = rest_on_frame(level, level, frame)
        if chosen != "first":
            chosen = f"frame {frame}"
    if chosen != "motion":
        level = correct_rest(level, mapped)
    result = Preparation(level, mapped, family, chosen, axis, confidence, reasons)
    _refuse_doubt(result, joints is not None, rest != "auto", up != "auto")
    if found_up.doubt:
        warning = FbaWarning(f"up is taken to be {axis}: {found_up.doubt}")
        remedy = Remedy("up", "if another axis points up, say which with {}", f"'{found_up.instead}'")
        warnings.warn(warning.with_remedies(remedy), stacklevel=3)
    return result


def rest_on_frame(motion: SkeletonMotion, other: SkeletonMotion, frame: int) -> SkeletonMotion:
    """Return a motion whose rest pose is a frame of another of the same skeleton, or of itself."""
    row = replace(other, rotations=other.rotations[[frame]], positions=other.positions[[frame]])
    return with_rest(motion, rotations.matrices(row.world()[0][0]))


def _few(motion: SkeletonMotion) -> SkeletonMotion:
    rows = np.unique(np.linspace(0, len(motion) - 1, min(len(motion), FRAMES)).astype(np.intp))
    return replace(motion, rotations=motion.rotations[rows], positions=motion.positions[rows])


def _refuse_doubt(result: Preparation, given_joints: bool, given_rest: bool, given_up: bool) -> None:
    """Raise ModelError for the first answer that is not sure enough, unless it was given."""
    for what, given, finding, remedy in (
        ("bones", given_joints, "which joint is which is not clear", joints_remedy()),
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
