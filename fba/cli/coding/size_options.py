"""How small a stream is to be: options that say it, and which of them contradict each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import click

from fba.cli import options
from fba.cli.coding.fit_options import fit_option
from fba.cli.coding.rate_options import check_buffer, rate_options
from fba.cli.coding.tolerance_options import LengthType
from fba.cli.command import Decorated
from fba.cli.inputs import ExistingPath
from fba.presets import PRESETS, Preset


@dataclass(frozen=True)
class Size:
    """How small a stream is to be, and what may be lost for that, as far as options say it; else None.

    preset: what is sent. model: the face that all receivers have; fit: one that computes FAPs to within 3 mm.
    fap_quant, bap_quant: how finely. tolerance: metres by which vertices may move; body_tolerance: by which
    points beside joints may; every_frame: whether no frame is left out for that. bitrate:
    bits a second; buffer: seconds that the stream may be ahead of them. still: whether what rests is held
    still (`fba.planning.hold_still`); None: in bodies of motion capture.
    """

    preset: Preset | None = None
    fit: Path | None = None
    body_tolerance: float | None = None
    model: Path | None = None
    tolerance: float | None = None
    every_frame: bool = False
    bitrate: float | None = None
    buffer: float | None = None
    fap_quant: int | None = None
    bap_quant: int | None = None
    still: bool | None = None

    def quantisers(self) -> dict[str, int]:
        """Return the quantisers, by default the finest."""
        return {
            "fap_quant": 1 if self.fap_quant is None else self.fap_quant,
            "bap_quant": 1 if self.bap_quant is None else self.bap_quant,
        }


def size_options(command: Decorated) -> Decorated:
    """Add the options; the command takes them as keywords: the fields of `Size`."""
    for option in reversed(
        (
            click.option(
                "--preset",
                type=click.Choice(PRESETS),
                help="What is sent: all that is given (reference); of streams, not what never moves (exact); "
                "of the FAPs, only those that players do not derive from others (compact). Default: compact "
                "for captured faces, else exact.",
            ),
            click.option(
                "--model",
                type=ExistingPath(),
                metavar="FILE",
                help="The face that all receivers have: with --preset compact, what its interpolation table "
                "(FIT) gives is not sent; with --tolerance, its vertices count. Default: the built-in head.",
            ),
            click.option(
                "--tolerance",
                type=LengthType(),
                metavar="LENGTH",
                help="Send as little as keeps every vertex of the face within this distance (0.5mm, 0.05cm, "
                "500um), in the head's own frame, each angle of the head within 0.1 degree, and of the eyes "
                "within 1 degree.",
            ),
            click.option(
                "--body-tolerance",
                type=LengthType(),
                metavar="LENGTH",
                help="The same for bodies: points 3 cm from every joint stay within this distance, and feet "
                "that stand within half of it. Default, with --tolerance: 1cm.",
            ),
            click.option(
                "--every-frame",
                is_flag=True,
                help="With --tolerance: send all frames, for players that hold a frame until the next comes.",
            ),
            rate_options,
            fit_option,
            click.option(
                "--quant",
                "fap_quant",
                type=click.IntRange(0, 31),
                help="Quantiser of FAPs (fap_quant); 0: unquantised. Default: 1; 0 for FAP files with values "
                "between its steps.",
            ),
            click.option(
                "--bap-quant",
                type=click.IntRange(0, 31),
                help="Quantiser of BAPs (bap_quant); default as for FAPs.",
            ),
            click.option(
                "--still/--no-still",
                default=None,
                help="Hold joints and feet of a body still where they rest, within a step of the quantiser; "
                "default: for motion capture only.",
            ),
        )
    ):
        command = option(command)
    return command


LEVELS = ("fap_quant", "bap_quant", "still")
PLANES = ("intra_period", "start_codes", "time_codes", "unsent", "gender", "clamp")
"""Options of single planes."""
CONTRADICTIONS: Mapping[str, tuple[tuple[str, ...], str]] = {
    "epf": (
        (
            "preset",
            "fit",
            "model",
            "tolerance",
            "body_tolerance",
            "every_frame",
            "bitrate",
            *LEVELS,
            *PLANES,
        ),
        "the EPF file says how planes are coded",
    ),
    "tolerance": (
        ("preset", "fit", "bitrate", *LEVELS, "unsent"),
        "the tolerance decides what is sent, and how finely",
    ),
    "body_tolerance": (
        ("preset", "fit", "bitrate", *LEVELS, "unsent"),
        "the tolerance decides what is sent, and how finely",
    ),
    "bitrate": (
        ("preset", "fit", "model", *LEVELS, "unsent", "intra_period"),
        "the bit rate decides what is sent, how finely, and where I planes come",
    ),
    "fit": (("preset", "model", "unsent"), "the table of the head decides what is sent"),
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
    tolerances = options.is_given("tolerance") or options.is_given("body_tolerance")
    if options.is_given("every_frame") and not tolerances:
        raise click.UsageError("--every-frame goes with --tolerance")
    check_buffer()
    preset = context.params.get("preset")
    if options.is_given("model") and preset in ("reference", "exact"):
        raise click.UsageError(
            f"--model and --preset {preset} contradict each other: only --preset compact leaves out what "
            "that face gives"
        )
