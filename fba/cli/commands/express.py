"""`fba express`: named expressions and their mixtures, as streams, pictures and films."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.choices import Sending
from fba.cli import emotion_results as results
from fba.cli import options
from fba.cli.command import Command, examples, option_errors
from fba.cli.emotion_results import OUTPUT_TEXT, PICTURES, draw, picture_kind
from fba.cli.option_fields import option, with_options
from fba.cli.outputs import Output, Outputs, display_name, find_writer, output_option
from fba.cli.printing import seconds_text

if TYPE_CHECKING:
    from fba.animation import Animation
    from fba.emotion import Blend

DEFAULT_RATE = Fraction(25)
DEFAULT_SECONDS = 3.0
"""Length of an animation."""
DEFAULT_EASE = 0.5
"""Seconds from neutral to the expression, and back."""


def _parse_point(text: str) -> tuple[float, float]:
    try:
        activation, evaluation = (float(part) for part in text.split(","))
    except ValueError:
        raise ValueError(f"{text!r} is no activation and evaluation; write e.g. 4.0,1.1") from None
    return activation, evaluation


POINT = options.TextType("point", _parse_point)
"""A point of the plane: activation and evaluation, "4.0,1.1"."""


@dataclass(frozen=True, kw_only=True)
class _Asked:
    """The expression, by names with intensities or by a point of the plane, and the rules that mix it."""

    weights: tuple[str, ...]
    point: tuple[float, float] | None = option(
        "--at",
        type=POINT,
        metavar="A,E",
        help="Instead of names: activation and evaluation, 1 to 7 each; the named expressions around that "
        "point are mixed.",
    )
    interpolation: float | None = option(help="One family: share of the second; default: by intensities.")
    reduction: float | None = option(help="What remains of a FAP that only one expression moves; 0 to 1.")
    nearness: float | None = option(help="One family: how near such a FAP must be to stay; 0 to 1.")


@dataclass(frozen=True, kw_only=True)
class _Motion:
    """How an expression comes and goes, and how it is sent."""

    seconds: float | None = option(help=f"Length of a stream or a film; default: {DEFAULT_SECONDS:g}.")
    ease: float | None = option(
        metavar="SECONDS",
        help=f"Time from neutral to the expression, and back at the end; default: {DEFAULT_EASE:g}.",
    )
    rate: Fraction | None = options.rate_option(f"Frame rate; default: {DEFAULT_RATE}.")
    send: Sending = option(
        default="auto",
        help="expression: by FAP 2, which adds up two of its six expressions. faps: by low-level FAPs, "
        "mixed by the rules. auto: by FAP 2 where that can say it.",
    )


@dataclass(frozen=True, kw_only=True)
class _Target:
    """Where an expression goes."""

    output: Path | None = output_option("OUT", OUTPUT_TEXT)
    to: str | None = options.to_option
    no_clobber: bool = options.no_clobber_option
    model: Path | None = options.model_option("Pictures: the face; default: the built-in head.")
    size: tuple[int, int] | None = option(
        type=options.SIZE, metavar="WIDTHxHEIGHT", help="Pictures: default 1280x720."
    )

    def check(self, motion: _Motion) -> str:
        """Return the kind of the picture or film, else ""; click.UsageError for options that do not fit."""
        kind = "" if self.output is None else picture_kind(self.output, self.to)
        drawn = {"--model": self.model, "--size": self.size}
        moving = {"--seconds": motion.seconds, "--ease": motion.ease, "--fps": motion.rate, "--to": self.to}
        for flag, value in {**({} if kind else drawn), **(moving if self.output is None else {})}.items():
            if value is not None:
                what = "a picture or a film" if flag in drawn else "-o"
                raise click.UsageError(f"{flag} goes with {what}")
        return kind


@click.command(
    cls=Command,
    epilog=examples(
        'fba express "fear=60 joy=30" -o uneasy.fba',
        "fba express terror -o terror.png",
        "fba express --at 4.0,1.1 -o guilt.mp4 --seconds 4 --ease 1",
        'fba express "anger=80 surprise=40"',
        "fba express --list",
    ),
)
@click.argument("weights", nargs=-1, metavar="[NAME=INTENSITY...]")
@with_options
def command(
    asked: _Asked,
    target: _Target,
    motion: _Motion,
    listed: bool = option("--list", default=False, help="List the named expressions."),
    as_json: bool = options.json_option,
) -> None:
    """Show expressions: named ones, mixtures of them, or a point of the plane of activation and evaluation.

    NAME=INTENSITY: an intensity of 0 to 100; a name alone has 100. Without -o, what moves is printed.
    """
    output = target.output
    if sum((bool(asked.weights), asked.point is not None, listed)) != 1:
        raise click.UsageError("give one of expressions (fear=60), --at A,E and --list")
    if listed:
        if output is not None:
            raise click.UsageError("--list prints a table; -o goes with an expression")
        results.print_expressions(as_json)
        return
    kind = target.check(motion)
    blend = _make_blend(asked)
    if output is None:
        results.print_blend(blend, as_json)
        return
    if kind in PICTURES:
        if motion.seconds or motion.ease:
            raise click.UsageError("a picture shows the full expression; --seconds and --ease are for films")
        motion = replace(motion, seconds=0.0)
    with option_errors():
        animation = _perform(blend, motion, motion.send)
    report: dict[str, Any] = {"file": display_name(output), **results.blend_record(blend)}
    text = f"{display_name(output)}: {blend}"
    if kind:
        outputs = Outputs([Output("--output", output)], [target.model], no_clobber=target.no_clobber)
        draw(animation, output, outputs, kind, target.model, target.size)
    else:
        writing = find_writer(output, target.to)
        written = Output.of_format("--output", output, writing)
        outputs = Outputs([written], no_clobber=target.no_clobber)
        outputs.write_animation(output, animation, writing)
        bits = _count_bits(blend, motion)
        report |= {"frames": len(animation), "sent": _sent(animation), "bits": bits}
        text += f", {len(animation)} frames, {seconds_text(animation.duration)}"
        text += f"; {_bits_text(animation, bits)}"
    if as_json:
        outputs.print_json(report)
    else:
        outputs.say(text)


def _make_blend(asked: _Asked) -> Blend:
    from fba import emotion

    names = ("interpolation", "reduction", "nearness")
    given = {name: value for name in names if (value := getattr(asked, name)) is not None}
    with option_errors():
        rules = emotion.Rules(**given)
        if asked.point is not None:
            return emotion.expression_at(*asked.point, rules)
        return emotion.combine(emotion.parse_weights(" ".join(asked.weights)), rules)


def _perform(blend: Blend, motion: _Motion, send: Sending) -> Animation:
    from fba.emotion import animate

    seconds = DEFAULT_SECONDS if motion.seconds is None else motion.seconds
    ease = min(DEFAULT_EASE, seconds / 2) if motion.ease is None else motion.ease
    return animate(blend, seconds=seconds, ease=ease, rate=motion.rate or DEFAULT_RATE, send=send)


def _count_bits(blend: Blend, motion: _Motion) -> dict[str, int | None]:
    """Return the bits of the stream by how it is sent; None if FAP 2 cannot say it."""
    from fba.codec import EncoderOptions, encode_animation

    bare = EncoderOptions(mark=False)
    possible: dict[Sending, bool] = {"expression": blend.fields is not None, "faps": True}
    return {
        send: 8 * len(encode_animation(_perform(blend, motion, send), bare)[0]) if able else None
        for send, able in possible.items()
    }


def _sent(animation: Animation) -> str:
    assert animation.face is not None
    return "expression" if animation.face.mask[:, 1].any() else "faps"


def _bits_text(animation: Animation, bits: dict[str, int | None]) -> str:
    by_faps = f"{bits['faps']:,} bits"
    if bits["expression"] is None:
        return f"low-level FAPs, {by_faps} as a stream (FAP 2 cannot say it)"
    by_expression = f"{bits['expression']:,} bits"
    if _sent(animation) == "expression":
        return f"FAP 2, {by_expression} as a stream; low-level FAPs by the rules (--send faps): {by_faps}"
    return f"low-level FAPs by the rules, {by_faps} as a stream; FAP 2 (--send expression): {by_expression}"
