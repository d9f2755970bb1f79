"""How a capture becomes BAPs and FAPs: the options of `fba encode` that say it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import click

from fba.cli import joint_options, marker_options, options
from fba.cli.command import Decorated
from fba.cli.inputs import Reading, check_capture_options


@dataclass(frozen=True)
class CaptureOptions:
    """How a capture becomes BAPs and FAPs.

    maps, map_out: places of joints or markers. The other fields are options of the readers of captures.
    """

    maps: tuple[Path | joint_options.Pair, ...]
    map_out: Path | None
    spine: str
    ground: str
    plant: bool
    origin: str
    rest: str | int
    up: str
    scale: float | None
    swap: str
    face: str | None
    neutral: marker_options.Neutral
    gaze: str
    head_path: bool | None
    aspect: float | None

    @property
    def map_files(self) -> list[Path]:
        """The files among the maps."""
        return [each for each in self.maps if isinstance(each, Path)]

    def for_readers(self, inputs: tuple[Path, ...], reading: Reading) -> dict[str, Any]:
        """Return the options of the readers of captures.

        Raises click.UsageError for one that was given and that no reader of the inputs takes.
        """
        names = [one.name for one in fields(self) if one.name not in ("maps", "map_out")]
        given = {name: f"--{name.replace('_', '-')}" for name in names if options.is_given(name)}
        check_capture_options(given, inputs, reading)
        taken = {name: getattr(self, name) for name in names}
        if self.head_path is None:
            taken["head_path"] = len(inputs) == 1  # of two files, the other has a body
        return taken


def capture_options(command: Decorated) -> Decorated:
    """Add the options; the command takes them as keywords: the fields of `CaptureOptions`."""
    for option in reversed(
        (
            options.choice_option(
                "--spine",
                "Motion capture: turn a dozen vertebrae, all, four, or one for each joint of the source.",
                "spread", "full", "simple", "joints",
            ),
            options.choice_option(
                "--ground",
                "Motion capture: feet stand at height 0, at the height of the source's ground, or "
                "uncorrected.",
                "floor", "source", "none",
            ),
            click.option(
                "--plant/--no-plant",
                default=True,
                show_default=True,
                help="Motion capture: bend legs a little where feet would otherwise miss the ground, or "
                "slip on it.",
            ),
            options.choice_option(
                "--origin",
                "Motion capture: what is placed at the default position.",
                "source", "start", "middle",
            ),
            joint_options.map_options(out=True),
            click.option(
                "--rest",
                type=joint_options.RestType(),
                default="auto",
                show_default=True,
                metavar="auto|file|first|motion|N",
                help="Motion capture: the rest pose is the file's own, its first frame, frame N, or found in "
                "the motion.",
            ),
            options.choice_option(
                "--up",
                "Motion capture: the axis that points up.",
                "auto", "+x", "-x", "+y", "-y", "+z", "-z",
            ),
            click.option(
                "--scale",
                type=click.FloatRange(1e-6, 1e6),
                metavar="METRES",
                help="Motion capture: metres of the person shown in one unit of the file, in place of what "
                "its legs say.",
            ),
            options.choice_option(
                "--swap",
                "Live Link Face's tables: MouthLeft and MouthRight, JawLeft and JawRight change places.",
                "auto", "yes", "no",
            ),
            options.face_option,
            marker_options.marker_options,
        )
    ):  # fmt: skip
        command = option(command)
    return command
