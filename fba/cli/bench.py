"""`fba bench`: how fast this codec is on a stream."""

from __future__ import annotations

from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

import click

from fba.cli import options


@click.command(
    cls=options.Command,
    epilog=options.examples("fba bench talk.fba", "fba bench talk.fba --rounds 20 --json"),
)
@click.argument("file", metavar="FILE.fba", type=options.EXISTING)
@click.option("--rounds", type=click.IntRange(1, 1000), default=9, show_default=True)
@options.bap_steps_option
@options.json_option
def command(file: Path, rounds: int, bap_steps: str, as_json: bool) -> None:
    """Measure decoding and encoding of a stream on one core: medians over several rounds.

    A symbol is one coded value of one plane. How the codec compares with a textbook's is in the bench/
    folder of the source.
    """
    from fba.codec import Decoder, EncoderOptions, decode, encode
    from fba.compiled import is_compiled

    with options.input_file(file) as path:
        data = path.read_bytes()
    animation = decode(data, bap_steps=bap_steps)
    tracks = [track for track in (animation.face, animation.body) if track is not None]
    symbols = sum(int(track.mask.sum()) for track in tracks)
    encoder = EncoderOptions(bap_steps=bap_steps, fap_quant=1, bap_quant=1, clamp=True)

    def stream() -> None:
        decoder = Decoder(bap_steps=bap_steps)
        for start in range(0, len(data), 512):
            decoder.push(data[start : start + 512])
        decoder.finish()

    timings: dict[str, Any] = {}
    for name, run in (
        ("decode", lambda: decode(data, bap_steps=bap_steps)),
        ("decode in chunks of 512 bytes", stream),
        ("encode", lambda: encode(animation, encoder)),
    ):
        run()
        times = []
        for _ in range(rounds):
            start = perf_counter()
            run()
            times.append(perf_counter() - start)
        timings[name] = {"seconds": median(times), "symbols_per_second": symbols / median(times)}
    if as_json:
        options.print_json({"file": str(file), "symbols": symbols, "compiled": is_compiled(), **timings})
        return
    how = "compiled" if is_compiled() else "not compiled: numba is missing or switched off"
    click.echo(f"{file}: {len(animation)} frames, {symbols} symbols ({how})")
    for name, timing in timings.items():
        click.echo(
            f"  {name}: {1000 * timing['seconds']:.2f} ms, "
            f"{timing['symbols_per_second'] / 1e6:.2f} million symbols/s"
        )
