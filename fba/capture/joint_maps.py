"""Maps from joints of a capture to those of the standard: to find, to change, and to keep in TOML files."""

from __future__ import annotations

from collections.abc import Mapping

from fba.body import ROOT, Skeleton
from fba.capture.bones import find_bones
from fba.capture.motion import SkeletonMotion
from fba.errors import FormatError, ModelError, OptionError, did_you_mean
from fba.limits import DEFAULT_LIMITS, Limits
from fba.name_maps import change_known_names, read_names, write_names
from fba.source import Path

TABLE = "joints"


def find_map(motion: SkeletonMotion, joints: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return joint of the capture -> joint of the standard that it moves, in the capture's order.

    joints: as for `from_skeleton`; None to find them. ModelError where none are found.
    """
    found = find_bones(motion, joints, Skeleton.default()).joints
    by_number = sorted((number, joint) for joint, number in found.items())
    return {motion.names[number]: joint for number, joint in by_number}


def change_map(
    motion: SkeletonMotion, base: Mapping[str, str] | None, pairs: Mapping[str, str]
) -> dict[str, str]:
    """Return a map in which some joints are changed by hand.

    base: the map before; None for what `find_map` returns, or for an empty map where it finds nothing. pairs:
    joint of the capture -> joint of the standard, or "" to leave the joint out. Another joint of the capture
    that had the same joint of the standard loses it.

    OptionError for a joint that the capture or the standard lacks, and where no joint is the root.
    """
    if base is None:
        try:
            base = find_map(motion)
        except ModelError:
            base = {}
    result = change_known_names(base, pairs, motion.names, "the skeleton has no joint", _check_joint)
    if ROOT not in result.values():
        raise OptionError(
            f"no joint of the skeleton is mapped to {ROOT}, the hips: give one, such as Hips={ROOT}"
        )
    return result


def read_map(path: Path, *, limits: Limits = DEFAULT_LIMITS) -> dict[str, str]:
    """Return the map in a TOML file: the table "joints", joint of the capture -> joint of the standard.

    Raises FormatError, with the line, for other files and for joints that the standard lacks.
    """
    table = read_names(path, TABLE, f'"Hips" = "{ROOT}"', limits)
    taken: dict[str, str] = {}
    for source, joint in table.items():
        if not isinstance(joint, str):
            raise FormatError(f"{source!r} must name one joint of the standard, not {joint!r}", path=path)
        try:
            _check_joint(joint)
        except OptionError as error:
            raise FormatError(f"{source!r}: {error}", path=path) from None
        if joint in taken:
            raise FormatError(f"{taken[joint]!r} and {source!r} are both mapped to {joint!r}", path=path)
        taken[joint] = source
    if ROOT not in taken:
        raise FormatError(f"maps no joint to {ROOT}, the hips", path=path)
    return dict(table)


def write_map(path: Path, joints: Mapping[str, str], motion: SkeletonMotion | None = None) -> None:
    """Write a map as TOML; comments name the joints without a counterpart, if the motion is given."""
    left = {}
    if motion is not None:
        free = [joint for joint in Skeleton.default().names if joint not in joints.values()]
        left = {
            "Joints of the capture that move nothing": [name for name in motion.names if name not in joints],
            "Joints of the standard that are free": free,
        }
    heading = (
        "Joints of a capture, and the joints of ISO/IEC 14496-2 that they move.",
        "Change it and give it to `fba encode --map`.",
    )
    write_names(path, TABLE, joints, heading, left)


def _check_joint(joint: str) -> None:
    """Raise OptionError for a joint that the standard lacks."""
    names = Skeleton.default().names
    if joint not in names:
        near = did_you_mean(joint, names)
        raise OptionError(
            f"the standard has no joint {joint!r}{near}; it has {ROOT}, vl5 to vl1, vt12 to vt1, vc7 to vc1, "
            "skullbase, l_hip, l_knee, l_ankle, l_metatarsal, l_sternoclavicular, l_shoulder, l_elbow, "
            "l_wrist, l_thumb1 to l_pinky3, and the same with r_"
        )
