"""Options for captures of markers: `--neutral`, `--gaze`, and `--map` for markers in place of joints."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.cli.inputs import Reading, input_file
from fba.cli.joint_options import Pair
from fba.cli.option_fields import option
from fba.errors import FbaWarning, OptionError

if TYPE_CHECKING:
    from fba.capture import MarkerMotion, PointMotion

Neutral = str | int | tuple[float, float]
WORDS = ("auto", "first")
LEAST_ASPECT, MOST_ASPECT = 0.1, 10.0


class AspectType(click.ParamType["float"]):
    """Width to height of a picture: 16:9, 1920x1080, or 1.78."""

    name = "aspect"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        if isinstance(value, float):
            return value
        number = r"(\d{1,6}(?:\.\d{1,6})?)"
        match = re.fullmatch(rf"{number}(?:[:x/]{number})?", str(value), re.ASCII)
        ratio = float(match[1]) / (float(match[2] or 1) or 1e-9) if match else 0.0
        if not LEAST_ASPECT <= ratio <= MOST_ASPECT:
            self.fail(
                f"{value!r} is no width and height of a picture, as 16:9, 1920x1080 or 1.78", param, ctx
            )
        return ratio


class NeutralType(click.ParamType["Neutral"]):
    """Which frames show the neutral face: a word, the number of a frame, or two times, 0.5-0.9."""

    name = "neutral"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Neutral:
        if not isinstance(value, str):
            return value  # type: ignore[no-any-return]
        if value in WORDS:
            return value
        if re.fullmatch(r"\d{1,9}", value, re.ASCII):
            return int(value)
        times = re.fullmatch(r"(\d{1,6}(?:\.\d{1,6})?)-(\d{1,6}(?:\.\d{1,6})?)", value, re.ASCII)
        if times is None or not float(times[1]) < float(times[2]):
            self.fail(
                f"{value!r} is not auto, first, the number of a frame, or two times in seconds, 0.5-0.9",
                param, ctx,
            )  # fmt: skip
        return float(times[1]), float(times[2])


def neutral_option(subject: str) -> Any:
    """Return `--neutral`. subject: the first words of its help."""
    return option(
        type=NeutralType(),
        default="auto",
        metavar="auto|first|N|FROM-TO",
        help=f"{subject} neutral face is found, the first moment, frame N, or between two times.",
    )


def aspect_option(text: str) -> Any:
    """Return `--aspect`. text: its help."""
    return option(type=AspectType(), metavar="W:H", help=text)


def read_places(
    maps: Sequence[Path | Pair], captures: Sequence[Path], reading: Reading
) -> dict[str, str] | None:
    """Return the places of markers that `--map` gives, None without; click.UsageError for wrong ones."""
    if not maps:
        return None
    from fba.capture import PointMotion
    from fba.capture.markers.marker_maps import change_map, check_map, read_map
    from fba.capture.points.places import change_places

    saved = [each for each in maps if isinstance(each, Path)]
    pairs = dict(each for each in maps if not isinstance(each, Path))
    if len(saved) > 1:
        raise click.UsageError("--map: give one file of markers at most; pairs change what it says")
    base = read_map(saved[0], limits=reading.limit) if saved else None
    if not pairs:
        return base
    try:
        capture = read_capture(captures[0], reading)
        if isinstance(capture, PointMotion):
            return change_places(capture.count, base, pairs)
        changed = change_map(capture, base, pairs)
        check_map(changed)
    except OptionError as error:
        raise click.UsageError(f"--map: {error}") from error
    return changed


def write_used_places(target: Path, places: dict[str, str] | None, motion: MarkerMotion | PointMotion) -> int:
    """Write the map that was used for a capture; return the number of its markers or points."""
    from fba.capture import PointMotion
    from fba.capture.markers.marker_maps import find_map, write_map
    from fba.capture.points.places import point_places, write_places

    if isinstance(motion, PointMotion):
        taken = point_places(motion.count) if places is None else places
        write_places(target, taken, motion.count)
        return len(taken)
    used = places if places is not None else find_map(motion)[0]
    write_map(target, used, motion)
    return len(used)


def read_capture(path: Path, reading: Reading) -> MarkerMotion | PointMotion:
    """Return the markers or points of a capture, without warnings, which reading it again would repeat."""
    from fba.capture import MarkerMotion, PointMotion
    from fba.formats import format_of

    with input_file(path) as file, warnings.catch_warnings():
        warnings.simplefilter("ignore", FbaWarning)
        reader = format_of(file, reading.format)
        assert reader.read_face is not None  # the caller names captures of markers and points only
        motion = reader.read_face(file, limits=reading.limit)
        assert isinstance(motion, MarkerMotion | PointMotion)
        return motion
