"""`fba emote`: a performance in a mood."""

from __future__ import annotations

import csv
import math
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from fba.cli import options
from fba.cli.command import Command, examples, option_errors, usage_errors
from fba.cli.emotion_results import OUTPUT_TEXT, draw, picture_kind
from fba.cli.inputs import Reading, read_input, read_model
from fba.cli.option_fields import group, option, with_options
from fba.cli.outputs import Output, Outputs, display_name, find_writer, output_option
from fba.cli.printing import Progress, seconds_text
from fba.errors import SAVE_AS_UTF8, FormatError

if TYPE_CHECKING:
    from fba.animation import Animation
    from fba.emotion import Mood, MoodCurve
    from fba.face import FaceModel

MOST_KEYS = 1_000_000
KEY_HEADER = ("seconds", "emotion", "intensity")
_Typed = tuple[str, float | None, float | None]
"""A name with its intensity, as text, and its begin and end, in seconds."""


def _parse_seconds(typed: str) -> float:
    text = typed.strip().lower()
    scale = 0.001 if text.endswith("ms") else 1.0
    seconds = options.parse_number(text.removesuffix("ms").removesuffix("s")) * scale
    if math.isnan(seconds):
        raise ValueError(f"{typed!r} is no time; write e.g. 2s or 500ms")
    return seconds


def _parse_mood(typed: str) -> _Typed:
    text, at, span = typed.partition("@")
    if not at:
        return text, None, None
    first, dash, last = span.partition("-")
    if not dash or not (first or last):
        raise ValueError(f"{typed!r}: write times as @2s-6s, @2s- or @-6s")
    return text, _parse_seconds(first) if first else None, _parse_seconds(last) if last else None


SECONDS = options.TextType("time", _parse_seconds)
"""A time: 2, 2s, 500ms."""
MOOD = options.TextType("emotion", _parse_mood)
"""An emotion with its intensity, with or without times: angry=70, sad=50@2s-6s."""


@dataclass(frozen=True, kw_only=True)
class _Asked:
    """Moods as they are typed, with times in seconds or None."""

    moods: tuple[_Typed, ...] = option(
        "--emotion",
        default=(),
        type=MOOD,
        multiple=True,
        metavar="NAME=INTENSITY[@FROM-TO]",
        help="An expression and its intensity, 0 to 100; repeatable. `fba express --list` lists all.",
    )
    start: float | None = option(
        type=SECONDS, metavar="TIME", help="When it begins; default: with the performance."
    )
    end: float | None = option(
        type=SECONDS, metavar="TIME", help="When it ends; default: with the performance."
    )
    ease: float = option(
        default=0.5,
        typed="0.5s",
        type=SECONDS,
        metavar="TIME",
        help="From none to full, and back. Not at either end of the performance.",
    )
    keys: Path | None = option(
        type=options.EXISTING,
        metavar="FILE.csv",
        help=f"Intensities over time: a table with the columns {', '.join(KEY_HEADER)}.",
    )

    def parse(self, moods: tuple[_Typed, ...]) -> list[Mood]:
        """Return moods with their times."""
        from fba.emotion import Mood, parse_weights

        result = []
        for text, start, end in moods:
            span = (self.start, self.end) if start is None and end is None else (start, end)
            result += [
                Mood(name, intensity, *span, self.ease) for name, intensity in parse_weights(text).items()
            ]
        return result


@dataclass(frozen=True, kw_only=True)
class _Target:
    """Where the performance goes."""

    output: Path = output_option("OUT", OUTPUT_TEXT, required=True)
    to: str | None = options.to_option
    no_clobber: bool = options.no_clobber_option
    model: Path | None = options.model_option(
        "The face whose visemes and expressions IN means, and that is drawn; default: the built-in head."
    )
    size: tuple[int, int] | None = option(
        type=options.SIZE,
        metavar="WIDTHxHEIGHT",
        help="Pictures: default 1280x720; of each side by side, 320x320.",
    )


@click.command(
    cls=Command,
    epilog=examples(
        "fba emote talk.fba -o angry.fba --emotion angry=70 --start 2s --end 6s --ease 0.5s",
        "fba emote talk.fba -o moods.mp4 --emotion happy=60@0s-3s --emotion sleepy=80@3s-",
        "fba emote talk.fap -o talk2.fap --keys moods.csv",
        "fba emote talk.fba -o moods.mp4 --side-by-side --emotion neutral --emotion angry=80",
    ),
)
@click.argument("source", metavar="IN", type=options.EXISTING)
@with_options
def command(
    source: Path,
    asked: _Asked,
    target: _Target,
    side_by_side: bool = option(
        default=False,
        help="Pictures and films: draw IN once for each --emotion, beside each other; --emotion neutral "
        "draws IN as it is.",
    ),
    reading: Reading = group("format", "limit"),
) -> None:
    """Put a performance into a mood: angry, surprised, sad, sleepy, happy, or any named expression.

    The mood moves the face at rest, and the performance is added, less where a feature is near its limit
    already. Lips that touch still touch, eyes that close still close. --start, --end and --ease are for
    emotions without times of their own.
    """
    from fba.emotion import emote

    keys, moods, output, model = asked.keys, asked.moods, target.output, target.model
    if not moods and keys is None:
        raise click.UsageError("give a mood: --emotion angry=70, or --keys FILE.csv")
    kind = picture_kind(output, target.to)
    for flag, wanted in (("--size", target.size is not None), ("--side-by-side", side_by_side)):
        if wanted and not kind:
            raise click.UsageError(f"{flag} goes with a picture or a film")
    if side_by_side and (keys is not None or not moods):
        raise click.UsageError("--side-by-side draws one performance for each --emotion; leave --keys out")
    writing = None if kind else find_writer(output, target.to)
    out = Output("--output", output) if writing is None else Output.of_format("--output", output, writing)
    outputs = Outputs([out], [source, keys, model], no_clobber=target.no_clobber)
    with option_errors():
        given: list[Mood | MoodCurve] = [*asked.parse(moods)]
        if keys is not None:
            given += _read_keys(keys)
    animation = read_input(source, reading)
    face = read_model(model)
    if side_by_side:
        with option_errors():
            several = {
                text: emote(animation, asked.parse((mood,)), model=face)
                for mood in moods
                for text in [mood[0].replace("=", " ")]
            }
        _draw_side_by_side(several, target, outputs, kind, face)
        outputs.say(f"{display_name(output)}: {', '.join(several)}; {seconds_text(animation.duration)}")
        return
    with option_errors():
        made = emote(animation, given, model=face)
    if writing is None:
        draw(made, output, outputs, kind, model, target.size)
    else:
        outputs.write_animation(output, made, writing)
    names = ", ".join(dict.fromkeys(mood.name for mood in given))
    outputs.say(f"{display_name(output)}: {names}; {len(made)} frames, {seconds_text(made.duration)}")


def _draw_side_by_side(
    performances: dict[str, Animation], target: _Target, outputs: Outputs, kind: str, model: FaceModel | None
) -> None:
    from fba_player.export.side_by_side import draw_side_by_side
    from fba_player.scene.scene import Scene

    scenes = {name: Scene(animation, model) for name, animation in performances.items()}
    with outputs.file(target.output, f".{kind}") as file, Progress("rendering", None) as step, usage_errors():
        draw_side_by_side(scenes, file, tile=target.size, progress=step.show)


def _read_keys(path: Path) -> list[MoodCurve]:
    """Read keys from a table. Raises FormatError for other files."""
    from fba.emotion import MoodCurve

    keys: dict[str, list[tuple[float, float]]] = defaultdict(list)
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = csv.DictReader(file)
            missing = [name for name in KEY_HEADER if name not in (rows.fieldnames or [])]
            if missing:
                raise FormatError(
                    f"{path}: the column {missing[0]!r} is missing; the first line must be "
                    f"{','.join(KEY_HEADER)}"
                )
            for number, row in enumerate(rows):
                if number >= MOST_KEYS:
                    raise FormatError(f"{path}: more than {MOST_KEYS} keys")
                try:
                    key = float(row["seconds"]), float(row["intensity"])
                except (TypeError, ValueError):
                    raise FormatError(
                        f"{path}:{rows.line_num}: seconds and intensity must be numbers, not "
                        f"{row['seconds']!r} and {row['intensity']!r}"
                    ) from None
                keys[str(row["emotion"]).strip()].append(key)
    except UnicodeDecodeError as error:
        raise FormatError(f"is not UTF-8 text (byte {error.start}); {SAVE_AS_UTF8}", path=path) from None
    except csv.Error as error:
        raise FormatError(f"{path}: no table of keys ({error})") from error
    if not keys:
        raise FormatError(f"{path}: there are no keys behind the header")
    return [MoodCurve(name, *np.array(pairs).T) for name, pairs in keys.items()]
