"""`fba bench`: measures the speed of this codec on a stream."""

from __future__ import annotations

from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

import click

from fba.cli import options, step_tables
from fba.cli.command import Command, EachFile, examples
from fba.cli.inputs import Reading, input_file
from fba.cli.option_fields import group, option, with_options
from fba.cli.printing import print_json


@click.command(cls=Command, epilog=examples("fba bench talk.fba", "fba bench talk.fba --rounds 20 --json"))
@click.argument("files", metavar="FILE.fba...", nargs=-1, required=True, type=options.EXISTING)
@with_options
def command(
    files: tuple[Path, ...],
    rounds: int = option(type=click.IntRange(1, 1000), default=9),
    reading: Reading = group("bap_steps", "limit"),
    as_json: bool = options.json_option,
) -> None:
    """Measure decoding and encoding of streams on one core: medians over several rounds.

    A symbol is one coded value of one plane. The source's bench/ folder compares the codec with a textbook's.
    """
    each = EachFile(files)
    results = []
    for path in files:
        with each.file(path):
            results.append(_measure(path, rounds, reading))
            if not as_json:
                _print(results[-1])
    if as_json:
        print_json(results if len(files) > 1 else results[0])
    each.finish()


def _measure(file: Path, rounds: int, reading: Reading) -> dict[str, Any]:
    """Return the count of symbols of a stream; seconds and symbols per second of decoding and encoding it."""
    from fba.codec import Decoder, EncoderOptions, decode, encode_animation
    from fba.compiled import is_compiled

    with input_file(file) as path:
        data = path.read_bytes()
    limits = reading.limit
    bap_steps = step_tables.table_to_read(file, data, reading.bap_steps, limits)
    animation = decode(data, bap_steps=bap_steps, limits=limits)
    tracks = [track for track in (animation.face, animation.body) if track is not None]
    symbols = sum(int(track.mask.sum()) for track in tracks)
    encoder = EncoderOptions(bap_steps=bap_steps, fap_quant=1, bap_quant=1, clamp=True)

    def stream() -> None:
        decoder = Decoder(bap_steps=bap_steps, limits=limits)
        for start in range(0, len(data), 512):
            decoder.push(data[start : start + 512])
        decoder.finish()

    timings: dict[str, Any] = {}
    for name, run in (
        ("decode", lambda: decode(data, bap_steps=bap_steps, limits=limits)),
        ("decode in chunks of 512 bytes", stream),
        ("encode", lambda: encode_animation(animation, encoder)),
    ):
        run()
        times = []
        for _ in range(rounds):
            start = perf_counter()
            run()
            times.append(perf_counter() - start)
        timings[name] = {"seconds": median(times), "symbols_per_second": symbols / median(times)}
    counts = {"file": str(file), "frames": len(animation), "symbols": symbols, "compiled": is_compiled()}
    return counts | timings


def _print(result: dict[str, Any]) -> None:
    how = "compiled" if result["compiled"] else "not compiled: numba is missing or switched off"
    click.echo(f"{result['file']}: {result['frames']} frames, {result['symbols']} symbols ({how})")
    for name, timing in result.items():
        if isinstance(timing, dict):
            click.echo(
                f"  {name}: {1000 * timing['seconds']:.2f} ms, "
                f"{timing['symbols_per_second'] / 1e6:.2f} million symbols/s"
            )
