"""`fba stats`: the bits of FBA streams."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from fba.cli import options, step_tables
from fba.cli.command import Command, EachFile, examples
from fba.cli.inputs import Reading, input_file, read_stream
from fba.cli.option_fields import group, with_options
from fba.cli.printing import print_json, print_table
from fba.parameters import BAP_STEPS_AUTO

if TYPE_CHECKING:
    from fba.codec import StreamInfo

COLUMNS = (
    "bytes", "frames", "seconds", "kbit/s", "peak kbit/s", "I planes", "bits/I", "bits/P", "P 95 %", "I share"
)  # fmt: skip


@click.command(cls=Command, epilog=examples("fba stats talk.fba", "fba stats --json *.fba"))
@click.argument("files", metavar="FILE.fba...", nargs=-1, required=True, type=options.EXISTING)
@with_options
def command(
    files: tuple[Path, ...],
    reading: Reading = group("bap_steps", "limit", "track"),
    as_json: bool = options.json_option,
) -> None:
    """Show where the bits of FBA streams go: I and P planes, mean and peak rates."""
    from fba.codec import probe_stream

    rows = []
    each = EachFile(files)
    for path in files:
        with each.file(path), input_file(path) as file:
            data = read_stream(file, reading)
            info = probe_stream(data, limits=reading.limit)
            if info.body is not None and reading.bap_steps != BAP_STEPS_AUTO:
                step_tables.warn_of_doubtful_stream(path, data, reading.bap_steps)
            rows.append({"file": str(path), **statistics(info)})
    if as_json:
        print_json(rows if len(files) > 1 else rows[0])
    elif rows:
        print_table(COLUMNS, [_cells(row) for row in rows])
    each.finish()


def _cells(row: dict[str, Any]) -> list[str]:
    return [
        row["file"],
        str(row["size"]),
        str(row["frames"]),
        f"{row['duration']:.2f}",
        f"{row['bits_per_second'] / 1000:.2f}",
        f"{row['peak_bits_per_second'] / 1000:.2f}",
        str(row["intra_planes"]),
        f"{row['intra_bits_mean']:.0f}",
        f"{row['predicted_bits_median']:.0f}",
        f"{row['predicted_bits_95']:.0f}",
        f"{100 * row['intra_share']:.0f} %",
    ]


def statistics(info: StreamInfo) -> dict[str, Any]:
    """Return the bits of a stream: in all, per second, in the busiest second, and those of its planes.

    intra_bits_mean, predicted_bits_median, predicted_bits_95: bits per plane; 0 without such planes.
    intra_share: share of the planes' bits that is in I planes.
    """
    assert info.plane_bits is not None
    assert info.plane_intra is not None
    assert info.frame_index is not None
    intra, predicted = info.plane_bits[info.plane_intra], info.plane_bits[~info.plane_intra]
    total = int(info.plane_bits.sum())
    return {
        "size": info.size,
        "frames": info.frames,
        "duration": float(info.duration),
        "bits_per_second": round(info.bits_per_second, 3),
        "peak_bits_per_second": _peak(info.plane_bits, info.frame_index / float(info.rate)),
        "intra_planes": len(intra),
        "intra_bits_mean": float(intra.mean()) if len(intra) else 0.0,
        "predicted_bits_mean": float(predicted.mean()) if len(predicted) else 0.0,
        "predicted_bits_median": float(np.median(predicted)) if len(predicted) else 0.0,
        "predicted_bits_95": float(np.percentile(predicted, 95)) if len(predicted) else 0.0,
        "intra_share": float(intra.sum() / total) if total else 0.0,
    }


def _peak(bits: np.ndarray, times: np.ndarray) -> int:
    """Return the most bits in a second that starts with a plane."""
    sums = np.concatenate([[0], np.cumsum(bits)])
    stops = np.searchsorted(times, times + 1.0 - 1e-9)
    return int((sums[stops] - sums[: len(bits)]).max())
