"""`--fit`: streams for a head that computes most FAPs by its interpolation table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from fba.cli.inputs import ExistingPath

if TYPE_CHECKING:
    from fba.planning.fit_streams import FitStream

fit_option = click.option(
    "--fit",
    metavar="HEAD.glb",
    type=ExistingPath(),
    help="Leave to this head the FAPs that it computes to within 3 mm by its interpolation table, which "
    "`fba model learn-fit` makes. The stream must be played with --model HEAD.glb.",
)


def fit_values(made: FitStream) -> dict[str, Any]:
    """Return what is sent and how far the head is off, for programs; lengths in mm."""
    off = made.errors
    return {
        "sent": list(made.sent),
        "added": list(made.added),
        "millimetres": {"mean": off.mean, "percentile_99": off.percentile_99, "largest": off.largest},
    }


def fit_lines(made: FitStream) -> list[str]:
    """Return the same for people."""
    added = f", {len(made.added)} of them as the head would miss them" if made.added else ""
    return [
        f"face: {len(made.sent)} FAPs sent{added}; the head computes the others",
        f"face: worst vertex of each frame {made.errors.text()}",
    ]
