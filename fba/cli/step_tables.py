"""Which table of BAP steps a stream is read and written with, and what users are told about it."""

from __future__ import annotations

import shlex
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fba.choices import BapTableOrAuto
from fba.cli.program import as_typed
from fba.errors import FbaWarning
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BAP_STEPS_AUTO, BAP_STEPS_DEFAULT, BapTable, bap_numbers, bap_steps
from fba.tracks import batches

if TYPE_CHECKING:
    from fba.animation import Animation

FINE: BapTable = "visage"


def explain_choice(data: bytes, asked: BapTableOrAuto, limits: Limits = DEFAULT_LIMITS) -> str:
    """Return a stream's table, and why: "visage: the stream says so"; "" if it makes no difference."""
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
    """Return the table with which a stream is to be decoded; print in one line which it is, and why.

    asked: the value of --bap-steps. shown: whether its BAPs are shown or written at all. Nothing is printed
    where they are not, where `asked` names a table, or where none makes a difference.
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
    whether the stream will say which table it is. read: the table of the stream that the body comes from.
    """
    if asked != BAP_STEPS_AUTO:
        return asked
    if read is not None:
        return read
    return FINE if made and marked else BAP_STEPS_DEFAULT


def remind(
    output: Path, animation: Animation, table: BapTable, quant: int = 1, *, marked: bool = True
) -> None:
    """Print the option that later commands need to read a stream that was just written, if any.

    Unquantised BAPs (quant 0) are the same under every table.
    """
    if animation.body is not None and table != BAP_STEPS_DEFAULT and quant > 0 and not marked:
        again = as_typed(f"fba play {shlex.quote(str(output))} --bap-steps {table}")
        click.echo(f"Play it with: {again}", err=True)


def warn_of_coarse_steps(
    animation: Animation, table: BapTable, quant: int = 1, *, captured: bool = False
) -> None:
    """Warn if a body is about to be coded with the standard's steps and its root moves by less than them.

    captured: the body is motion capture, whose angles these steps may cut as well.
    """
    if animation.body is None or table != BAP_STEPS_DEFAULT or quant == 0:
        return
    root = [bap_numbers()[f"HumanoidRoot_tr_{way}"] - 1 for way in ("vertical", "lateral", "frontal")]
    steps = bap_steps(table)[root]
    between = any((batch.values[:, root] % steps).any() for batch in batches(animation.body))
    if captured or between:
        warnings.warn(
            "the standard's BAP steps move the root by 64 mm at a time and code angles up to 1.19 rad; "
            f"--bap-steps {FINE} has 2 mm and 3.16 rad",
            FbaWarning,
            stacklevel=2,
        )


def warn_of_doubt(
    name: str | Path, animation: Animation, table: BapTable, marked: str | None = None
) -> str | None:
    """Warn if a decoded body was read with the wrong table; return the warning.

    marked: the table that the stream names, which is right beyond doubt. Without one, the wrong table is the
    one under which the body looks wrong while it looks right under the other.
    """
    from fba.body.plausibility import find_doubt

    if animation.body is None or marked == table:
        return None
    doubt: object
    if marked is None:
        doubt = find_doubt(animation.body, animation.index, animation.rate, table)
    elif any((batch.values % bap_steps(table)).any() for batch in batches(animation.body)):
        doubt = None  # BAPs that are not quantised are the same with every table
    else:
        doubt = (
            f"the stream says that its BAP steps are {marked!r}, but it is read with {table!r}, as given; "
            "without --bap-steps it is read rightly"
        )
    if doubt is None:
        return None
    text = f"{_display_name(name)}: {doubt}"
    warnings.warn(text, FbaWarning, stacklevel=2)
    return text


def warn_of_doubtful_stream(name: str | Path, data: bytes, table: BapTable) -> None:
    """Do the same for a stream, of which the first frames with a body are decoded."""
    from fba.codec import marked_table
    from fba.formats.step_choice import first_frames

    moving = first_frames(data, table)
    if moving is not None:
        warn_of_doubt(name, moving, table, marked_table(data))


def _display_name(name: str | Path) -> str:
    return "standard input" if str(name) == "-" else str(name)
