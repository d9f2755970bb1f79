"""The inputs of `fba encode`, read and put on one clock: `--sync`, `--offset` and `--trim`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from fba.animation import Animation
from fba.choices import Sync
from fba.cli.command import STANDARD_INPUT, option_errors
from fba.cli.inputs import ReadFile, Reading, read_file
from fba.cli.option_fields import option
from fba.cli.options import TextType, parse_number
from fba.cli.printing import Progress, rate_text
from fba.errors import FormatError
from fba.formats import merge
from fba.formats.synchronisation import Recording, Together, join
from fba.formats.time_codes import parse_time_code, parse_time_of_day
from fba.parameters import BapTable

if TYPE_CHECKING:
    from fba.capture import FaceCapture
    from fba.formats import Format


MAX_COUNTED_RATE = 60
"""Highest rate, in rows per second, of captures whose rows are the frames of their time codes."""


@dataclass(frozen=True)
class Moment:
    """The begin of the second of two recordings, as typed. seconds: after the first; None for clock times."""

    text: str
    seconds: float | None


def _parse_offset(text: str) -> Moment:
    if ":" in text:
        if parse_time_code(text) is None and parse_time_of_day(text) is None:
            raise ValueError(f"{text!r} is no time of day; write 18:48:59:39, or 18:48:59.65")
        return Moment(text, None)
    seconds = parse_number(text)
    if math.isnan(seconds):
        raise ValueError(f"{text!r} is neither a number of seconds nor a time code HH:MM:SS:FF")
    return Moment(text, seconds)


OFFSET = TextType("offset", _parse_offset)
"""Seconds, or a time of day: 2.4, 18:48:59:39, 18:48:59.65."""


@dataclass(frozen=True, kw_only=True)
class SyncOptions:
    """How two recordings are put together."""

    sync: Sync | None = option(
        help="A face and a body: by the times of day at which they were recorded, or both from the start on; "
        "default: time codes where both have them."
    )
    offset: Moment | None = option(
        type=OFFSET,
        metavar="SECONDS|HH:MM:SS:FF",
        help="When the second input begins: seconds after the first, or the time code of its first frame.",
    )
    trim: bool = option(
        default=False, help="Leave out what only one of the two inputs covers; else it is kept."
    )


@dataclass(frozen=True, eq=False)
class Inputs:
    """The inputs of a stream.

    animation: of all inputs. start: time of day at its index 0, in seconds; None if unknown. together: two
    inputs with a capture among them, put together; else None. is_resampled: whether frames were interpolated.
    """

    animation: Animation
    start: float | None
    together: Together | None
    files: tuple[ReadFile, ...]
    is_resampled: bool

    @property
    def tables(self) -> tuple[BapTable, ...]:
        """Tables of BAP steps of the streams among the inputs."""
        return tuple(file.table for file in self.files if file.table is not None)

    @property
    def formats(self) -> Mapping[str, Format]:
        """The formats of the files with "face" and "body"."""
        return {
            part: file.format
            for file in self.files
            for part, track in (("face", file.animation.face), ("body", file.animation.body))
            if track is not None
        }

    @property
    def is_captured(self) -> bool:
        """Whether a capture is among the inputs."""
        return any(each.is_capture for each in self.formats.values())

    @property
    def has_captured_face(self) -> bool:
        """Whether the face is from a capture."""
        return "face" in self.formats and self.formats["face"].is_capture

    @property
    def text_parts(self) -> tuple[str, ...]:
        """The parts, "face" and "body", whose frames are those of a FAP or BAP file."""
        if self.is_resampled:
            return ()
        return tuple(part for part, each in self.formats.items() if each.name in ("fap", "bap"))

    @property
    def has_captured_body(self) -> bool:
        """Whether the body is, or may be, from a capture: of a skeleton, or of the path of a head."""
        return any(
            each.read_motion is not None or "head_path" in each.read_options for each in self.formats.values()
        )

    def capture_of(self, path: Path) -> Any:
        """Return the motion or the face of which the animation of an input was made; None for other files."""
        return next(
            (file.captured.capture for file in self.files if file.path == path and file.captured), None
        )

    def body_of(self, animation: Animation) -> tuple[Animation, int]:
        """Return the frames that a captured body covers, and the count of frames of the capture before them.

        animation: with the rows of that of the inputs.
        """
        if self.together is None:
            return animation, 0
        return animation[self.together.body_rows], self.together.body_lead


def read_inputs(
    files: tuple[Path, ...],
    reading: Reading,
    *,
    capture: Mapping[str, object],
    sync: SyncOptions,
    rate: Fraction | None,
    name: str | None,
) -> Inputs:
    """Return face and body of one or two files as one animation. capture, rate, name: see `read_file`.

    Raises click.UsageError for two faces, two bodies, and different rates without a capture.
    """
    _check_sync(files, sync)
    read: list[ReadFile] = []
    recordings: list[Recording] = []
    faces: list[FaceCapture | None] = []
    with Progress("reading", len(files)) as step:
        for path in files:
            read.append(read_file(path, reading, rate=rate, name=name, capture=capture))
            animation = read[-1].animation
            step.advance()
            if not len(animation):
                raise FormatError("the file holds no frames; there is nothing to encode", path=path)
            _check_parts(path, animation, [earlier.animation for earlier in recordings])
            faces.append(_captured_face(read[-1]))
            shown = STANDARD_INPUT if str(path) == "-" else str(path)
            recordings.append(Recording(shown, animation, None if faces[-1] is None else faces[-1].start))
    rates = [file.rate for file in read]
    if len(recordings) == 1:
        only = recordings[0]
        resampled = only.animation.rate != rates[0]
        return Inputs(only.animation, only.start, None, tuple(read), resampled)
    first, second = recordings
    offset = sync.offset
    if sync.sync is None and offset is None and not any(file.format.is_capture for file in read):
        resampled = [recording.animation.rate for recording in recordings] != rates
        return Inputs(_merge(first, second), None, None, tuple(read), resampled)
    with option_errors():
        together = join(
            first,
            second,
            sync="offset" if offset is not None and offset.seconds is not None else sync.sync,
            offset=0.0 if offset is None or offset.seconds is None else offset.seconds,
            begins=None if offset is None or offset.seconds is not None else _time_of_day(offset, faces[0]),
            trim=sync.trim,
            limits=reading.limit,
        )
    resampled = any(each != together.animation.rate for each in rates)
    return Inputs(together.animation, together.start, together, tuple(read), resampled)


def _captured_face(file: ReadFile) -> FaceCapture | None:
    """Return the captured face of which an animation was made; None for other files."""
    if file.captured is None or file.format.read_face is None:
        return None
    return cast("FaceCapture", file.captured.capture)


def together_lines(files: tuple[Path, ...], together: Together) -> list[str]:
    """Return the begin and end of two recordings, and the rates of resampled ones, as lines of text."""
    (first, _), (second, _) = together.spans
    how = "by their time codes" if together.how == "timecode" else "both from the start on"
    if together.how == "offset" and first != second:
        how = "by --offset"
    spans = ", ".join(
        f"{path} {begin:.2f} to {end:.2f} s" for path, (begin, end) in zip(files, together.spans, strict=True)
    )
    low, high = together.common
    lines = [f"together, {how}: {spans}; both from {low:.2f} to {high:.2f} s"]
    lines += [
        f"{name}: {rate_text(rate)} frames/s, interpolated at {rate_text(together.animation.rate)}"
        for name, rate in together.resampled.items()
    ]
    return lines


def together_values(files: tuple[Path, ...], together: Together) -> dict[str, Any]:
    """Return the begin and end of two recordings, for programs."""
    parts = [
        {"file": str(path), "begins": round(begin, 6), "ends": round(end, 6)}
        for path, (begin, end) in zip(files, together.spans, strict=True)
    ]
    return {"sync": together.how, "parts": parts}


def _time_of_day(offset: Moment, first: FaceCapture | None) -> float:
    """Return a time of day in seconds. first: the capture whose rate its frames have."""
    seconds = parse_time_of_day(offset.text)
    if seconds is None and first is not None and first.rate <= MAX_COUNTED_RATE:
        seconds = parse_time_code(offset.text, first.rate)
    if seconds is None:
        raise click.UsageError(
            f"--offset {offset.text}: the first input's time codes do not count such frames; write parts of "
            "a second, as 18:48:59.65"
        )
    return seconds


def _check_sync(files: tuple[Path, ...], given: SyncOptions) -> None:
    """Raise click.UsageError for options that contradict each other or the number of files."""
    sync, offset = given.sync, given.offset
    typed = [f"--{name}" for name in ("sync", "offset", "trim") if getattr(given, name)]
    if typed and len(files) != 2:
        raise click.UsageError(f"{typed[0]} is for two inputs, a face and a body; there is {len(files)}")
    if offset is not None and sync is not None and (offset.seconds is None) != (sync == "timecode"):
        raise click.UsageError(f"--sync {sync} and --offset {offset.text} contradict each other")


def _check_parts(path: Path, animation: Animation, before: list[Animation]) -> None:
    """Raise click.UsageError for a second face or a second body."""
    for part in ("face", "body"):
        if getattr(animation, part) is not None and any(getattr(each, part) is not None for each in before):
            raise click.UsageError(
                f"{path} is a second {part} file; encode one face and one body file at most"
            )


def _merge(first: Recording, second: Recording) -> Animation:
    """Return files of FAPs and BAPs as one animation, joined by frame number."""
    one, other = first.animation, second.animation
    if one.rate != other.rate:
        raise click.UsageError(
            f"{second.name} has {rate_text(other.rate)} frames/s, the file before it {rate_text(one.rate)}; "
            "bring them to one rate with --fps"
        )
    return merge(one, other) if one.face is not None else merge(other, one)
