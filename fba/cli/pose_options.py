"""FAPs, visemes and expressions on the command line, which `fba render` takes instead of a file."""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches
from fractions import Fraction
from typing import TYPE_CHECKING

import click

from fba.cli.option_fields import option

if TYPE_CHECKING:
    from fba.animation import Animation

MAX_SELECTS = 2
"""Most visemes, and most expressions, in a frame."""
MAX_FAP = 2**31 - 1
"""Largest value of a FAP."""


@dataclass(frozen=True)
class Pose:
    """A face as typed; a name may be a number."""

    faps: tuple[str, ...] = option(
        "--fap",
        default=(),
        metavar="NAME=VALUE",
        help="Without a file: a FAP of the face, by name or number; repeatable. A left or right FAP alone "
        "moves both sides, as in a stream; give its counterpart as well to move them apart.",
    )
    visemes: tuple[str, ...] = option(
        "--viseme",
        default=(),
        metavar="NAME[=BLEND]",
        help="Without a file: a viseme by number, name or sound; of two, BLEND (0..63) is the share of one.",
    )
    expressions: tuple[str, ...] = option(
        "--expression",
        default=(),
        metavar="NAME[=INTENSITY]",
        help="Without a file: an expression, 0..63; up to two.",
    )

    open_mouth: int | None = option(
        "--open-mouth",
        type=click.IntRange(0, 100),
        metavar="PERCENT",
        help="Without a file: opens the mouth, jaw and lips together; what --fap gives overrides it.",
    )

    @property
    def given(self) -> list[str]:
        """The options that were used."""
        used = {"--fap": self.faps, "--viseme": self.visemes, "--expression": self.expressions}
        opened = ["--open-mouth"] if self.open_mouth is not None else []
        return [option for option, values in used.items() if values] + opened


def still_animation(pose: Pose) -> Animation:
    """Return an animation of one frame that sends only the FAPs, visemes and expressions of a pose.

    Raises click.UsageError, which suggests similar names.
    """
    import numpy as np

    from fba.animation import Animation
    from fba.parameters import FAP_COUNT, INTENSITY_MAX
    from fba.tracks import FaceTrack

    values = np.zeros((1, FAP_COUNT), dtype=np.int32)
    mask = np.zeros((1, FAP_COUNT), dtype=bool)
    for text in pose.faps:
        number, value = _parse_fap(text)
        if mask[0, number - 1]:
            raise click.UsageError(f"--fap {text}: FAP {number} is given twice")
        values[0, number - 1], mask[0, number - 1] = value, True
    if pose.open_mouth is not None:
        from fba.face.macros import open_mouth

        opened = np.rint(open_mouth(pose.open_mouth)).astype(np.int32)
        np.copyto(values[0], opened, where=~mask[0])
        mask[0] |= opened != 0
    viseme, expression = np.zeros((1, 4), dtype=np.int16), np.zeros((1, 6), dtype=np.int16)
    if pose.visemes:
        pairs = _parse_selects("viseme", pose.visemes)
        viseme[0, : len(pairs)] = [select for select, _ in pairs]
        viseme[0, 2] = _blend([share for _, share in pairs])
        mask[0, 0] = True
    if pose.expressions:
        for number, (select, intensity) in enumerate(_parse_selects("expression", pose.expressions)):
            expression[0, 2 * number] = select
            expression[0, 2 * number + 1] = INTENSITY_MAX if intensity is None else intensity
        mask[0, 1] = True
    return Animation(Fraction(25), np.arange(1), FaceTrack(values, mask, viseme, expression), name="still")


def _parse_fap(text: str) -> tuple[int, int]:
    from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP, fap_numbers

    name, equals, amount = text.partition("=")
    name = name.strip()
    numbers = {key: number for key, number in fap_numbers().items() if number >= FIRST_LOW_LEVEL_FAP}
    if name in ("1", "2", "viseme", "expression"):
        raise click.UsageError(
            f"--fap {text}: visemes and expressions have options of their own, --viseme and --expression"
        )
    if name.isdecimal() and FIRST_LOW_LEVEL_FAP <= int(name[:9]) <= FAP_COUNT:
        number = int(name)
    elif name in numbers:
        number = numbers[name]
    else:
        raise click.UsageError(
            f"--fap {text}: there is no FAP {name!r}{_suggestion(name, list(numbers))}; "
            f"give a name or a number {FIRST_LOW_LEVEL_FAP}..{FAP_COUNT}"
        )
    try:
        value = int(amount)
    except ValueError:
        value = MAX_FAP + 1
    if not equals or abs(value) > MAX_FAP:
        raise click.UsageError(
            f"--fap {text}: a value is missing or no whole number; write e.g. --fap {name}=200"
        )
    return number, value


def _parse_selects(kind: str, texts: tuple[str, ...]) -> list[tuple[int, int | None]]:
    """Return the select of each viseme or expression, and its amount or None."""
    from fba.parameters import EXPRESSIONS, INTENSITY_MAX, VISEMES

    names = VISEMES if kind == "viseme" else EXPRESSIONS
    if len(texts) > MAX_SELECTS:
        raise click.UsageError(f"--{kind}: a frame holds at most {MAX_SELECTS}, not {len(texts)}")
    pairs = []
    for text in texts:
        name, equals, amount = text.partition("=")
        select = _select(name.strip(), names)
        if select is None:
            words = [*names[1:], *(word for each in names[1:] for word in each.split())]
            raise click.UsageError(
                f"--{kind} {text}: there is no {kind} {name!r}{_suggestion(name, words)}; "
                f"they are {', '.join(f'{n} {each}' for n, each in enumerate(names) if n)}"
            )
        if equals and not (amount.strip().isdecimal() and int(amount.strip()[:9]) <= INTENSITY_MAX):
            raise click.UsageError(
                f"--{kind} {text}: {amount!r} is no whole number from 0 to {INTENSITY_MAX}"
            )
        pairs.append((select, int(amount) if equals else None))
    return pairs


def _select(name: str, names: tuple[str, ...]) -> int | None:
    """Return the number of a viseme or expression, from its name, sound or number; None for other text."""
    if name.isdecimal():
        number = int(name[:9])
        return number if 0 < number < len(names) else None
    for select, each in enumerate(names):
        if select and (name == each or name in each.split()):
            return select
    return None


def _blend(shares: list[int | None]) -> int:
    """Return viseme_blend: the share of the first of one or two visemes, in 63rds."""
    from fba.parameters import INTENSITY_MAX

    if len(shares) == 1:
        return INTENSITY_MAX if shares[0] is None else shares[0]
    first, second = shares
    if first is not None and second is not None and first + second != INTENSITY_MAX:
        raise click.UsageError(
            f"--viseme: the blends of two visemes add up to {INTENSITY_MAX}, not {first} + {second}; "
            "give one of them"
        )
    if first is not None:
        return first
    return (INTENSITY_MAX + 1) // 2 if second is None else INTENSITY_MAX - second


def _suggestion(name: str, names: list[str]) -> str:
    similar = get_close_matches(name, names, n=3)
    return f" (near: {', '.join(dict.fromkeys(similar))})" if similar else ""
