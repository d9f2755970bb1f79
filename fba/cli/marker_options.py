"""Options for captures of markers: `--neutral`, `--gaze`, and `--map` for markers in place of joints."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.cli import options
from fba.cli.command import Decorated
from fba.cli.inputs import input_file
from fba.cli.joint_options import Pair
from fba.errors import FbaWarning, OptionError
from fba.limits import Limits

if TYPE_CHECKING:
    from fba.capture.markers.motion import MarkerMotion

Neutral = str | int | tuple[float, float]
WORDS = ("auto", "first")


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


def marker_options(command: Decorated) -> Decorated:
    """Add the options that say how markers become FAPs."""
    neutral = click.option(
        "--neutral",
        type=NeutralType(),
        default="auto",
        show_default=True,
        metavar="auto|first|N|FROM-TO",
        help="Markers: the neutral face is found, the first moment, frame N, or between two times.",
    )
    gaze = options.choice_option(
        "--gaze",
        "Markers: eyes stay still in the head, or keep looking at the camera.",
        "none",
        "camera",
    )
    path = click.option(
        "--head-path/--no-head-path",
        default=None,
        help="Markers: where the head goes moves the body; default: unless another file has a body.",
    )
    decorated: Any = path(command)
    decorated = gaze(decorated)
    return neutral(decorated)  # type: ignore[no-any-return]


def read_places(
    maps: Sequence[Path | Pair], captures: Sequence[Path], format: str | None, limits: Limits
) -> dict[str, str] | None:
    """Return the places of markers that `--map` gives, None without; click.UsageError for wrong ones."""
    if not maps:
        return None
    from fba.capture.markers.marker_maps import change_map, check_map, read_map

    saved = [each for each in maps if isinstance(each, Path)]
    pairs = dict(each for each in maps if not isinstance(each, Path))
    if len(saved) > 1:
        raise click.UsageError("--map: give one file of markers at most; pairs change what it says")
    base = read_map(saved[0], limits=limits) if saved else None
    if not pairs:
        return base
    try:
        changed = change_map(read_markers(captures[0], format, limits), base, pairs)
        check_map(changed)
    except OptionError as error:
        raise click.UsageError(f"--map: {error}") from error
    return changed


def write_places(
    target: Path, places: dict[str, str] | None, capture: Path, format: str | None, limits: Limits
) -> int:
    """Write the map that was used for a capture; return the number of its markers."""
    from fba.capture.markers.marker_maps import find_map, write_map

    motion = read_markers(capture, format, limits)
    used = places if places is not None else find_map(motion)[0]
    write_map(target, used, motion)
    return len(used)


def read_markers(path: Path, format: str | None, limits: Limits) -> MarkerMotion:
    """Return the markers of a capture, without the warnings that reading it a second time would repeat."""
    from fba.capture.markers.motion import MarkerMotion
    from fba.formats import format_of

    with input_file(path) as file, warnings.catch_warnings():
        warnings.simplefilter("ignore", FbaWarning)
        reader = format_of(file, format)
        assert reader.read_face is not None  # the caller names captures of markers only
        motion = reader.read_face(file, limits=limits)
        assert isinstance(motion, MarkerMotion)
        return motion
