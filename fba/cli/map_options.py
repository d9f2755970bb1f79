"""`--map`, `--rest`, `--neutral` and `--aspect`: the joints of a captured skeleton, the places of markers."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.cli.command import as_typed, option_errors
from fba.cli.inputs import Reading, input_file
from fba.cli.option_fields import option
from fba.cli.options import TextType
from fba.errors import FbaWarning
from fba.limits import Limits

if TYPE_CHECKING:
    from fba.capture import MarkerMotion, PointMotion, SkeletonMotion

Pair = tuple[str, str]
Maps = tuple[Path | Pair, ...]
"""Values of `--map`: files, and pairs of names."""
Neutral = str | int | tuple[float, float]
MIN_ASPECT = 0.1
"""Smallest width of a picture, in heights; the largest is its inverse."""
_NUMBER = r"(\d{1,6}(?:\.\d{1,6})?)"


def _parse_map(text: str) -> Path | Pair:
    if Path(text).is_file():
        return Path(text)
    source, equals, joint = text.rpartition("=")
    if not equals or not source:
        raise ValueError(f"{text!r} is neither a file nor a pair of joints such as Pelvis=HumanoidRoot")
    return source, joint


def _parse_rest(text: str) -> str | int:
    from fba.capture.preparation import RESTS

    if text in RESTS:
        return text
    if not (text.isascii() and text.isdigit() and len(text) < 10):
        raise ValueError(f"{text!r} is not one of {', '.join(RESTS)}, nor the number of a frame")
    return int(text)


def _parse_aspect(text: str) -> float:
    match = re.fullmatch(rf"{_NUMBER}(?:[:x/]{_NUMBER})?", text, re.ASCII)
    ratio = float(match[1]) / (float(match[2] or 1) or 1e-9) if match else 0.0
    if not MIN_ASPECT <= ratio <= 1 / MIN_ASPECT:
        raise ValueError(f"{text!r} is no width and height of a picture, as 16:9, 1920x1080 or 1.78")
    return ratio


def _parse_neutral(text: str) -> Neutral:
    if text in ("auto", "first"):
        return text
    if re.fullmatch(r"\d{1,9}", text, re.ASCII):
        return int(text)
    times = re.fullmatch(f"{_NUMBER}-{_NUMBER}", text, re.ASCII)
    if times is None or not float(times[1]) < float(times[2]):
        expected = "auto, first, the number of a frame, or two times in seconds, 0.5-0.9"
        raise ValueError(f"{text!r} is not {expected}")
    return float(times[1]), float(times[2])


MAP = TextType("map", _parse_map)
"""A joint of the capture and a joint of the standard, Pelvis=HumanoidRoot, or a file of such pairs."""
REST = TextType("rest", _parse_rest)
"""The rest pose of a capture: a word, or the number of a frame."""
ASPECT = TextType("aspect", _parse_aspect)
"""The width of a picture divided by its height: 16:9, 1920x1080, or 1.78."""
NEUTRAL = TextType("neutral", _parse_neutral)
"""The frames with the neutral face: a word, the number of a frame, or two times, 0.5-0.9."""
map_option = option(
    "--map",
    default=(),
    type=MAP,
    multiple=True,
    metavar="NAME=PLACE|FILE",
    help="Motion capture: which joint of the standard a joint of the file is, Pelvis=HumanoidRoot; none: "
    "Hat=. Or where on the face a marker is, Chin=2.1. Repeatable. Or a TOML file of such pairs, in place "
    "of what is found.",
)


def neutral_option(subject: str) -> Any:
    """Return `--neutral`. subject: the first words of its help."""
    return option(
        type=NEUTRAL,
        default="auto",
        metavar="auto|first|N|FROM-TO",
        help=f"{subject} neutral face is found, the first moment, frame N, or between two times.",
    )


def aspect_option(text: str) -> Any:
    """Return `--aspect`. text: its help."""
    return option(type=ASPECT, metavar="W:H", help=text)


def files_of(maps: Maps) -> list[Path]:
    """Return the files among the values of `--map`."""
    return [each for each in maps if isinstance(each, Path)]


def split_maps(maps: Maps, content: str) -> tuple[Path | None, dict[str, str]]:
    """Return the file among the values of `--map`, None without it, and the pairs.

    content: of the file, for the click.UsageError about several files.
    """
    files = files_of(maps)
    if len(files) > 1:
        raise click.UsageError(f"--map: give one {content} at most; pairs change what it says")
    return files[0] if files else None, dict(each for each in maps if not isinstance(each, Path))


def read_joints(maps: Maps, captures: Sequence[Path], reading: Reading) -> dict[str, str] | None:
    """Return the map of `--map`, None without it; click.UsageError if there is no capture."""
    if not maps:
        return None
    if not captures:
        raise click.UsageError("--map goes with motion capture: joints of a body, or markers on a face")
    return _map_joints(maps, reading.limit, lambda: read_capture(captures[0], reading))


def read_body_joints(maps: Maps, body: Path | None, limits: Limits) -> dict[str, str] | None:
    """Return the map of `--map` for the person of `--body`, None without it."""
    if not maps:
        return None
    from fba.formats.gltf.bodies import read_skeleton

    if body is None:
        encode = as_typed("fba encode")
        raise click.UsageError(f"--map names the joints of a --body: give one; {encode} has it for captures")
    return _map_joints(maps, limits, lambda: read_skeleton(body, limits=limits))


def _map_joints(maps: Maps, limits: Limits, skeleton: Callable[[], SkeletonMotion]) -> dict[str, str]:
    """Return the map of a file, or else of a skeleton, changed by pairs."""
    from fba.capture.joint_maps import change_map, read_map
    from fba.formats.gltf.humanoid import joints_of_bones

    file, pairs = split_maps(maps, "file of joints")
    base = None if file is None else read_map(file, limits=limits)
    if base is not None and not pairs:
        return base
    bones = joints_of_bones()  # VRM's names are well known
    with option_errors("--map: "):
        return change_map(
            skeleton(), base, {source: bones.get(joint, joint) for source, joint in pairs.items()}
        )


def read_places(maps: Maps, captures: Sequence[Path], reading: Reading) -> dict[str, str] | None:
    """Return the places of markers in `--map`, None without it; click.UsageError for wrong places."""
    if not maps:
        return None
    from fba.capture import PointMotion
    from fba.capture.markers.marker_maps import change_map, check_map, read_map
    from fba.capture.points.places import change_places

    file, pairs = split_maps(maps, "file of markers")
    base = None if file is None else read_map(file, limits=reading.limit)
    if not pairs:
        return base
    with option_errors("--map: "):
        capture = read_capture(captures[0], reading)
        if isinstance(capture, PointMotion):
            return change_places(capture.count, base, pairs)
        changed = change_map(capture, base, pairs)
        check_map(changed)
        return changed


def write_used_joints(target: Path, joints: dict[str, str] | None, motion: SkeletonMotion) -> int:
    """Write the map that was used for a capture; return the count of its joints."""
    from fba.capture.joint_maps import find_map, write_map

    used = find_map(motion, joints)
    write_map(target, used, motion)
    return len(used)


def write_used_places(target: Path, places: dict[str, str] | None, motion: MarkerMotion | PointMotion) -> int:
    """Write the map that was used for a capture; return the count of its markers or points."""
    from fba.capture import PointMotion
    from fba.capture.markers.marker_maps import find_map, write_map
    from fba.capture.points.places import point_places, write_places

    if isinstance(motion, PointMotion):
        used = point_places(motion.count) if places is None else places
        write_places(target, used, motion.count)
    else:
        used = find_map(motion)[0] if places is None else places
        write_map(target, used, motion)
    return len(used)


def read_capture(path: Path, reading: Reading) -> Any:
    """Return the motion or the face in a capture, without warnings, which another reading gives."""
    from fba.formats import format_of

    with input_file(path) as file, warnings.catch_warnings(action="ignore", category=FbaWarning):
        reader = format_of(file, reading.format)
        read = reader.read_motion or reader.read_face
        assert read is not None  # the caller names captures only
        options: dict[str, Any] = {} if reader.describe is None else {"clip": reading.clip}
        return read(file, limits=reading.limit, **options)
