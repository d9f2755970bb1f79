"""The table of BAP steps with which a stream is read or written, and messages about it."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fba.choices import BapTableOrAuto
from fba.cli.command import as_typed
from fba.errors import warn
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BAP_STEPS_AUTO, BAP_STEPS_DEFAULT, BapTable, bap_numbers, bap_steps
from fba.tracks import batches

if TYPE_CHECKING:
    from fba.animation import Animation

FINE: BapTable = "visage"


def explain_choice(data: bytes, asked: BapTableOrAuto, limits: Limits = DEFAULT_LIMITS) -> str:
    """Return a stream's table and the reason: "visage: the stream says so"; "" if it makes no difference."""
    from fba.formats.step_choice import choose_steps

    if asked != BAP_STEPS_AUTO:
        return f"{asked}: as given"
    return choose_steps(data, limits=limits).explanation


def table_to_read(
    name: str | Path,
    data: bytes,
    asked: BapTableOrAuto,
    limits: Limits = DEFAULT_LIMITS,
    *,
    shown: bool = True,
) -> BapTable:
    """Return the table with which a stream is to be decoded; print a line with it and the reason.

    asked: the value of --bap-steps. shown: whether BAPs are shown or written. Nothing is printed if they are
    not, if `asked` names a table, or if the table makes no difference.
    """
    from fba.formats.step_choice import choose_steps

    if asked != BAP_STEPS_AUTO:
        return asked
    choice = choose_steps(data, limits=limits)
    if choice.reason and shown:
        click.echo(f"fba: {_display_name(name)}: {choice}", err=True)
    return choice.table


def table_to_write(
    asked: BapTableOrAuto, *, made: bool, marked: bool, read: BapTable | None = None
) -> BapTable:
    """Return the table with which a body is to be encoded.

    asked: the value of --bap-steps. made: whether the body is motion capture, or was generated. marked:
    whether the stream will name its table. read: the table of the stream with the body.
    """
    if asked != BAP_STEPS_AUTO:
        return asked
    if read is not None:
        return read
    return FINE if made and marked else BAP_STEPS_DEFAULT


def remind(
    output: Path, animation: Animation, table: BapTable, quant: int = 1, *, marked: bool = True
) -> None:
    """Print the option that later commands need to read a written stream, if any.

    Unquantised BAPs (quant 0) are the same with every table.
    """
    if animation.body is not None and table != BAP_STEPS_DEFAULT and quant > 0 and not marked:
        again = as_typed(f"fba play {shlex.quote(str(output))} --bap-steps {table}")
        click.echo(f"Play it with: {again}", err=True)


def warn_of_coarse_steps(
    animation: Animation, table: BapTable, quant: int = 1, *, captured: bool = False
) -> None:
    """Warn if a body is coded with the standard's steps and its root moves by less than a step.

    captured: whether the body is motion capture, whose angles these steps may cut as well.
    """
    if animation.body is None or table != BAP_STEPS_DEFAULT or quant == 0:
        return
    root = [bap_numbers()[f"HumanoidRoot_tr_{axis}"] - 1 for axis in ("vertical", "lateral", "frontal")]
    steps = bap_steps(table)[root]
    between = any((batch.values[:, root] % steps).any() for batch in batches(animation.body))
    if captured or between:
        warn(
            "the standard's BAP steps move the root by 64 mm at a time and code angles up to 1.19 rad; "
            f"--bap-steps {FINE} has 2 mm and 3.16 rad",
            stacklevel=2,
        )


def warn_of_doubt(
    name: str | Path, animation: Animation, table: BapTable, marked: str | None = None
) -> str | None:
    """Warn if a decoded body was read with the wrong table; return the warning.

    marked: the table that the stream names, which is right. Without it, a table is wrong if the body looks
    wrong with it, and right with the other.
    """
    from fba.body.plausibility import find_doubt

    if animation.body is None or marked == table:
        return None
    doubt: object
    if marked is None:
        doubt = find_doubt(animation.body, animation.index, animation.rate, table)
    elif any((batch.values % bap_steps(table)).any() for batch in batches(animation.body)):
        doubt = None  # unquantised BAPs are the same with every table
    else:
        doubt = (
            f"the stream says that its BAP steps are {marked!r}, but it is read with {table!r}, as given; "
            "without --bap-steps it is read rightly"
        )
    if doubt is None:
        return None
    text = f"{_display_name(name)}: {doubt}"
    warn(text, stacklevel=2)
    return text


def warn_of_doubtful_stream(name: str | Path, data: bytes, table: BapTable) -> None:
    """Warn as `warn_of_doubt` does about a stream, of which the first frames with a body are decoded."""
    from fba.codec import marked_table
    from fba.formats.step_choice import first_frames

    moving = first_frames(data, table)
    if moving is not None:
        warn_of_doubt(name, moving, table, marked_table(data))


def _display_name(name: str | Path) -> str:
    return "standard input" if str(name) == "-" else str(name)
