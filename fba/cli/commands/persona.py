"""`fba persona`: learn how an actor moves the face, and play another person's performance in that way."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.choices import Means
from fba.cli import options
from fba.cli.command import Group, examples
from fba.cli.inputs import input_file
from fba.cli.map_options import aspect_option
from fba.cli.option_fields import group, option, with_options
from fba.cli.outputs import Output, Outputs, display_name, find_writer, further_output_option, output_option
from fba.cli.printing import print_json
from fba.limits import Limits

if TYPE_CHECKING:
    from fba.animation import Animation
    from fba.persona import Persona, TrackedFace


def _parse_span(text: str) -> tuple[float, float]:
    first, _, last = text.partition("-")
    try:
        span = float(first), float(last)
    except ValueError:
        raise ValueError(f"{text!r} is no span of seconds; expected for example 0.5-1.5") from None
    if not 0 <= span[0] < span[1] < float("inf"):
        raise ValueError(f"{text!r}: expected FROM-TO, and TO after FROM")
    return span


SPAN = options.TextType("seconds", _parse_span)
"""A part of a recording, FROM-TO in seconds."""


@dataclass(frozen=True, kw_only=True)
class _Tracking:
    """How recordings of tracked points are read."""

    neutral: tuple[float, float] | None = option(
        type=SPAN,
        metavar="FROM-TO",
        help="Seconds of each recording in which the face rests; default: the first second.",
    )
    aspect: float | None = aspect_option(
        "Width and height of the picture, 16:9 or 1920x1080; default: what makes the points a face."
    )
    source_rate: Fraction | None = option(
        "--source-fps", type=options.RATE, metavar="RATE",
        help="Frame rate of recordings that do not say theirs.",
    )  # fmt: skip
    face: str | None = options.face_option
    limit: Limits = options.limit_option

    def read(self, path: Path) -> TrackedFace:
        """Return the face in a recording."""
        from fba.persona import read_recording

        with input_file(path) as file:
            return read_recording(
                file, source_rate=self.source_rate, face=self.face, aspect=self.aspect, limits=self.limit
            )


@dataclass(frozen=True, kw_only=True)
class _Performer:
    """The Personas of actor and user, and their use."""

    persona_file: Path | None = option(
        "--persona", type=options.EXISTING, metavar="FILE.persona", help="The actor's way."
    )
    user_file: Path | None = option(
        "--user", type=options.EXISTING, metavar="FILE.persona", help="The user's own Persona."
    )
    means: Means = option(
        default="motion",
        help="How a face becomes the actor's: by maps and how it moves, by maps alone, or by masks.",
    )
    no_head: bool = option(default=False, help="Leave out how the user's head turns.")

    def play(self, file: Path, tracking: _Tracking) -> tuple[Persona | None, Animation]:
        """Return the actor's Persona, if any, and a user's recording played by it."""
        from fba.persona import animate_as

        persona = None if self.persona_file is None else _load(self.persona_file, tracking.limit)
        user = None if self.user_file is None else _load(self.user_file, tracking.limit)
        return persona, animate_as(
            tracking.read(file),
            persona,
            means=self.means,
            neutral=tracking.neutral,
            user=user,
            head=not self.no_head,
        )


@click.group(
    "persona",
    cls=Group,
    epilog=examples(
        "fba persona learn scene1.csv scene2.csv -o actor.persona --report actor.html",
        "fba persona info actor.persona",
        "fba persona play user.csv --persona actor.persona -o out.fba",
    ),
)
def command() -> None:
    """Learn how an actor moves the face, and play another person's performance in that way."""


@command.command(
    "learn", epilog=examples("fba persona learn scene1.csv scene2.csv -o actor.persona --report actor.html")
)
@click.argument("actors", metavar="ACTOR...", nargs=-1, required=True, type=options.EXISTING)
@with_options
def learn_command(
    actors: tuple[Path, ...],
    output: Path = output_option("OUT.persona", "Persona to write.", required=True),
    no_clobber: bool = options.no_clobber_option,
    name: str = option(default="", metavar="NAME", help="Name of the actor; default: that of the file."),
    warm_up: int = option(
        type=click.IntRange(0),
        default=0,
        metavar="N",
        help="Leave out the first N frames of each recording, in which the tracker looks for the face.",
    ),
    report: Path | None = further_output_option(
        "FILE.html", "Also write a page with masks, classes and plots."
    ),
    tracking: _Tracking = group(),
    as_json: bool = options.json_option,
) -> None:
    """Learn how an actor moves the face, from points that a tracker found in films.

    The face rests at the start of each film for a second, or where --neutral says, and looks into the camera:
    frames in which the head is turned by more than 30 degrees are left out.
    """
    if report is not None and report.suffix.lower() != ".html":
        raise click.UsageError(f"--report writes .html files, not {report.name}")
    written = [Output("--output", output)]
    if report is not None:
        written.append(Output("--report", report, text=True))
    outputs = Outputs(written, actors, no_clobber=no_clobber)
    from fba.persona import learn

    neutral = tracking.neutral
    faces = [tracking.read(path) for path in actors]
    persona = learn(faces, name or actors[0].stem, neutral=[neutral] * len(faces), warm_up=warm_up)
    with outputs.file(output) as file:
        persona.save(file)
    if report is not None:
        from fba.persona.report import make_report

        outputs.write(report, make_report(persona, faces, neutral=neutral, warm_up=warm_up).encode())
    if as_json:
        outputs.print_json(_describe(persona))
        return
    outputs.say(f"{display_name(output)}: {persona.kept} of {persona.frames} frames")
    for line in _lines(persona):
        outputs.say(line)


@command.command("info", epilog=examples("fba persona info actor.persona"))
@click.argument("file", metavar="FILE.persona", type=options.EXISTING)
@with_options
def info_command(
    file: Path, as_json: bool = options.json_option, limit: Limits = options.limit_option
) -> None:
    """Show what a Persona holds: frames, classes, masks, and the classes that are missing."""
    persona = _load(file, limit)
    if as_json:
        print_json(_describe(persona))
        return
    click.echo(f"{persona.name}: {persona.kept} of {persona.frames} frames")
    for line in _lines(persona):
        click.echo(line)
    for part, style in persona.parts.items():
        counts = ", ".join(f"{name} {count}" for name, count in sorted(style.count().items()))
        click.echo(f"masks of {part}: {counts}")


@command.command(
    "play",
    epilog=examples(
        "fba persona play user.csv --persona actor.persona -o out.fba",
        "fba persona play user.csv --persona actor.persona --user user.persona -o out.fba",
        "fba persona play user.csv -o own.fba      # the user's own way, to compare",
    ),
)
@click.argument("file", metavar="USER", type=options.EXISTING)
@with_options
def play_command(
    file: Path,
    performer: _Performer,
    output: Path = output_option(
        "OUT", "File to write; its suffix says in which format. - for standard output.", required=True
    ),
    to: str | None = options.to_option,
    no_clobber: bool = options.no_clobber_option,
    tracking: _Tracking = group(),
) -> None:  # fmt: skip
    """Play a user's performance in an actor's way: tracked points to FAPs, which move any face.

    Without --persona, the FAPs are those of the user's own way.
    """
    if performer.persona_file is None and performer.user_file is not None:
        raise click.UsageError("--user goes with --persona")
    writing = find_writer(output, to)
    inputs = (file, performer.persona_file, performer.user_file)
    outputs = Outputs([Output.of_format("--output", output, writing)], inputs, no_clobber=no_clobber)
    persona, animation = performer.play(file, tracking)
    extra: dict[str, Any] = {"clamp": True} if writing.name == "fba" else {}
    outputs.write_animation(output, animation, writing, **extra)
    whose = "the user's own way" if persona is None else f"the way of {persona.name}"
    outputs.say(f"{display_name(output)}: {len(animation)} frames in {whose}")


def _load(path: Path, limits: Limits) -> Persona:
    from fba.persona import Persona

    with input_file(path) as file:
        return Persona.load(file, limits=limits)


def _describe(persona: Persona) -> dict[str, Any]:
    """Return the content of a Persona, for programs."""
    from fba.persona.motion import describe_motion

    missing = _missing(persona)
    return {
        "name": persona.name,
        "frames": persona.frames,
        "kept": persona.kept,
        "turned": persona.turned,
        "untracked": persona.untracked,
        "bytes": persona.size,
        "motion": describe_motion(persona.motions),
        "parts": {
            part: {"masks": dict(sorted(style.count().items())), "missing": missing[part]}
            for part, style in persona.parts.items()
        },
    }


def _missing(persona: Persona) -> dict[str, list[str]]:
    from fba.persona import ClassRecogniser

    known = ClassRecogniser.default().components
    return persona.missing({part: component.classes for part, component in known.items()})


def _lines(persona: Persona) -> list[str]:
    """Return lines about the parts (counts of classes and masks, missing classes) and about the motion."""
    from fba.persona.motion import describe_motion

    lines = []
    for part, missing in _missing(persona).items():
        counts = persona.parts[part].count()
        line = f"{part}: {len(counts)} classes, {counts.total()} masks"
        lines.append(line + (f"; missing: {', '.join(missing)}" if missing else ""))
    motion = describe_motion(persona.motions)
    if motion is None:
        return [*lines, "motion: not known, as the file is of version 1; learn it again"]
    sides = ", ".join(f"{name} {times:.2f}" for name, times in motion["left_over_right"].items())
    moves = (
        f"{part} {one['millimetres']:.2f} mm, {one['speed']:.1f}/s" for part, one in motion["parts"].items()
    )
    return [*lines, f"motion: {'; '.join(moves)}", f"left over right: {sides}"]
