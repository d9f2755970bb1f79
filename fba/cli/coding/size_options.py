"""How small a stream is to be: options that say it, and which of them contradict each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import click

from fba.cli import options
from fba.cli.command import Decorated


@dataclass(frozen=True)
class Size:
    """How small a stream is to be, and what may be lost for that: the options but for the quantisers.

    preset: what is sent.
    """

    preset: str = "reference"

    @classmethod
    def take(cls, settings: dict[str, Any]) -> Size:
        """Return what the options say, and remove them from the values of a command's options."""
        return cls(**{field.name: settings.pop(field.name) for field in fields(cls)})


def size_options(command: Decorated) -> Decorated:
    """Add the options; the command takes them as keywords: fields of `Size`, and the quantisers."""
    for option in reversed(
        (
            options.choice_option(
                "--preset",
                "What is sent: all that is given (reference); not what never moves (exact); of the FAPs only "
                "those that players do not derive from others (compact).",
                "reference", "exact", "compact",
            ),
            options.fap_quant_option,
            click.option(
                "--bap-quant",
                type=click.IntRange(0, 31),
                default=1,
                show_default=True,
                help="Quantiser of BAPs (bap_quant); 0: unquantised.",
            ),
        )
    ):  # fmt: skip
        command = option(command)
    return command


QUANTISERS = ("fap_quant", "bap_quant")
PLANES = ("intra_period", "start_codes", "time_codes", "unsent", "gender", "clamp")
"""Options of single planes."""
CONTRADICTIONS: Mapping[str, tuple[tuple[str, ...], str]] = {
    "epf": (
        ("preset", "tolerance", "bitrate", *QUANTISERS, *PLANES),
        "the EPF file says how planes are coded",
    ),
    "tolerance": (
        ("preset", "bitrate", *QUANTISERS, "unsent"),
        "the tolerance decides what is sent, and how finely",
    ),
    "bitrate": (
        ("preset", *QUANTISERS, "unsent"),
        "the bit rate decides what is sent, and how finely",
    ),
}
"""Options that decide all that some others decide, those others, and the reason to give."""


def check_sizes() -> None:
    """Raise click.UsageError for options of the running command that contradict each other."""
    context = click.get_current_context()
    flags = {one.name: one.opts[0] for one in context.command.params}
    for option, (others, reason) in CONTRADICTIONS.items():
        for other in others:
            if options.is_given(option) and options.is_given(other):
                raise click.UsageError(f"{flags[other]} and {flags[option]} contradict each other: {reason}")
