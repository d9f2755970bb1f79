"""Options about the size of a stream, and the contradictions between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import click

from fba.cli import options
from fba.cli.coding.rate_options import bit_rate_option, buffer_option, check_buffer
from fba.cli.coding.tolerance_options import LENGTH
from fba.cli.option_fields import option, option_like
from fba.encoder_options import QUANT_MAX, EncoderOptions, Preset

QUANTISER = click.IntRange(0, QUANT_MAX)


@dataclass(frozen=True, kw_only=True)
class Size:
    """Options about the size and the loss of a stream; None if they are not given.

    tolerance, body_tolerance: in metres. bit_rate: bits per second. buffer: seconds.
    """

    preset: Preset | None = option_like(
        EncoderOptions, "preset", default=None, by_default="compact for captured faces, else exact"
    )
    model: Path | None = options.model_option(
        "The face that all receivers have: with --preset compact, what its interpolation table (FIT) gives "
        "is not sent; with --tolerance, its vertices count. Default: the built-in head."
    )
    tolerance: float | None = option(
        type=LENGTH,
        metavar="LENGTH",
        help="Send as little as keeps every vertex of the face within this distance (0.5mm, 0.05cm, 500um), "
        "in the head's own frame, each angle of the head within 0.1 degree, and of the eyes within 1 degree.",
    )
    body_tolerance: float | None = option(
        type=LENGTH,
        metavar="LENGTH",
        help="The same for bodies: points 3 cm from every joint stay within this distance, and feet that "
        "stand within half of it. Default, with --tolerance: 1cm.",
    )
    every_frame: bool = option(
        default=False,
        help="With --tolerance: send all frames, for players that hold a frame until the next comes.",
    )
    bit_rate: float | None = bit_rate_option
    buffer: float = buffer_option
    fit: Path | None = option(
        type=options.ExistingPath(),
        metavar="HEAD.glb",
        help="Leave to this head the FAPs that it computes to within 3 mm by its interpolation table, which "
        "`fba model learn-fit` makes. The stream must be played with --model HEAD.glb.",
    )
    fap_quant: int | None = option_like(
        EncoderOptions, "fap_quant", "--quant", type=QUANTISER, default=None,
        by_default="1; 0 for FAP files with values between its steps",
    )  # fmt: skip
    bap_quant: int | None = option_like(
        EncoderOptions, "bap_quant", type=QUANTISER, default=None, by_default="as for FAPs"
    )
    still: bool | None = option(
        help="Hold joints and feet of a body still where they rest, within a step of the quantiser; default: "
        "for motion capture only."
    )

    def quantisers(self) -> dict[str, int]:
        """Return the quantisers, by default the finest."""
        given = {"fap_quant": self.fap_quant, "bap_quant": self.bap_quant}
        return {name: 1 if quant is None else quant for name, quant in given.items()}


LEVELS = ("fap_quant", "bap_quant", "still")
"""Options of the levels that are sent."""
PLANES = ("intra_period", "start_codes", "time_codes", "unsent", "gender", "clamp")
"""Options of single planes."""
BY_TOLERANCE = (
    ("preset", "fit", "bit_rate", *LEVELS, "unsent"),
    "the tolerance decides what is sent, and how finely",
)
CONTRADICTIONS: Mapping[str, tuple[tuple[str, ...], str]] = {
    "epf": (
        (
            "preset",
            "fit",
            "model",
            "tolerance",
            "body_tolerance",
            "every_frame",
            "bit_rate",
            *LEVELS,
            *PLANES,
        ),
        "the EPF file says how planes are coded",
    ),
    "tolerance": BY_TOLERANCE,
    "body_tolerance": BY_TOLERANCE,
    "bit_rate": (
        ("preset", "fit", "model", *LEVELS, "unsent", "intra_period"),
        "the bit rate decides what is sent, how finely, and where I planes come",
    ),
    "fit": (("preset", "model", "unsent"), "the table of the head decides what is sent"),
}
"""Options, the other options that each excludes, and the reason."""


def check_sizes() -> None:
    """Raise click.UsageError for options of the running command that contradict each other."""
    context = click.get_current_context()
    flags = {param.name: param.opts[0] for param in context.command.params}
    for decider, (others, reason) in CONTRADICTIONS.items():
        for other in others:
            if options.is_given(decider) and options.is_given(other):
                raise click.UsageError(f"{flags[other]} and {flags[decider]} contradict each other: {reason}")
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
