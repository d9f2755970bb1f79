"""The options of `fba encode` for captures, which become BAPs and FAPs."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from fba.choices import Gaze, Ground, Origin, SignedUpAxis, Spine, Swap
from fba.cli import map_options, options
from fba.cli.inputs import Reading, check_capture_options
from fba.cli.option_fields import option
from fba.cli.outputs import further_output_option


@dataclass(frozen=True, kw_only=True)
class CaptureOptions:
    """How a capture becomes BAPs and FAPs: options of the readers of captures, and `maps` and `map_out`."""

    spine: Spine = option(
        default="spread",
        help="Motion capture: turn a dozen vertebrae, all, four, or one for each joint of the source.",
    )
    ground: Ground = option(
        default="floor",
        help="Motion capture: feet stand at height 0, at the height of the source's ground, or uncorrected.",
    )
    plant: bool = option(
        default=True,
        help="Motion capture: bend legs a little where feet would otherwise miss the ground, or slip on it.",
    )
    origin: Origin = option(default="source", help="Motion capture: what is placed at the default position.")
    maps: map_options.Maps = map_options.map_option
    map_out: Path | None = further_output_option(
        "FILE.toml", "Motion capture: write the joints or markers that were found, for --map."
    )
    rest: str | int = option(
        type=map_options.REST,
        default="auto",
        metavar="auto|file|first|motion|N",
        help="Motion capture: the rest pose is the file's own, its first frame, frame N, or found in the "
        "motion.",
    )
    up: SignedUpAxis = option(default="auto", help="Motion capture: the axis that points up.")
    scale: float | None = option(
        type=options.FloatRange(1e-6, 1e6),
        metavar="METRES",
        help="Motion capture: metres of the person shown in one unit of the file, in place of what its legs "
        "say.",
    )
    swap: Swap = option(
        default="auto",
        help="Live Link Face's tables: MouthLeft and MouthRight, JawLeft and JawRight change places.",
    )
    face: str | None = options.face_option
    neutral: map_options.Neutral = map_options.neutral_option("Markers, points: the")
    gaze: Gaze = option(
        default="none",
        help="Markers, points: eyes turn as their pupils say, if these are there, or keep looking at the "
        "camera.",
    )
    aspect: float | None = map_options.aspect_option(
        "Points: width and height of the picture, 16:9 or 1920x1080; default: what makes them a face."
    )
    head_path: bool | None = option(
        help="Markers: where the head goes moves the body; default: unless another file has a body."
    )

    def for_readers(self, inputs: tuple[Path, ...], reading: Reading) -> dict[str, Any]:
        """Return the options of the readers of captures.

        Raises click.UsageError for a given option that no reader of the inputs takes.
        """
        names = [field.name for field in fields(self) if field.name not in ("maps", "map_out")]
        given = {name: f"--{name.replace('_', '-')}" for name in names if options.is_given(name)}
        check_capture_options(given, inputs, reading)
        taken = {name: getattr(self, name) for name in names}
        if self.head_path is None:
            taken["head_path"] = len(inputs) == 1  # a second file has a body
        return taken
