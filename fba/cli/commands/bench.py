"""`fba bench`: measures the speed of this codec on a stream; `fba bench bitrate`, the bit rates of files."""

from __future__ import annotations

from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

import click

from fba.cli import options, step_tables
from fba.cli.command import EachFile, Group, examples
from fba.cli.inputs import EXISTING, input_file
from fba.cli.printing import print_json
from fba.cli.subcommands import bench_bitrate
from fba.limits import Limits

SPEED = "speed"


class _Bench(Group):
    """Subcommands, of which the one that measures speed needs no name: `fba bench talk.fba`."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if not args or (args[0].startswith("-") and args[0] not in ctx.help_option_names):
            args = [SPEED, *args]
        return super().parse_args(ctx, args)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        return super().resolve_command(ctx, args if args[0] in self.commands else [SPEED, *args])

    def format_usage(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        formatter.write_usage(ctx.command_path, "[OPTIONS] FILE.fba...")
        formatter.write_usage(
            f"{ctx.command_path} {bench_bitrate.command.name}", "[OPTIONS] [FILE...]", "       "
        )

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Show the options of the command that needs no name, and the other one."""
        _speed.format_options(ctx, formatter)
        with formatter.section("Commands"):
            formatter.write_dl(
                [(str(one.name), one.get_short_help_str(100)) for one in self.commands.values()]
            )


@click.group(
    cls=_Bench,
    epilog=examples(
        "fba bench talk.fba",
        "fba bench talk.fba --rounds 20 --json",
        "fba bench bitrate talk.fba walk.bvh -o study",
    ),
)
def command() -> None:
    """Measure decoding and encoding of streams on one core: medians over several rounds.

    `fba bench bitrate` measures bit rates and errors instead, beside those of other ways to send the same.
    """


command.add_command(bench_bitrate.command)


@command.command(SPEED, epilog=examples("fba bench talk.fba", "fba bench talk.fba --rounds 20 --json"))
@click.argument("files", metavar="FILE.fba...", nargs=-1, required=True, type=EXISTING)
@click.option("--rounds", type=click.IntRange(1, 1000), default=9, show_default=True)
@options.bap_steps_option
@options.json_option
@options.limit_option
def _speed(files: tuple[Path, ...], rounds: int, bap_steps: str, as_json: bool, limit: Limits) -> None:
    """Measure decoding and encoding of streams on one core: medians over several rounds.

    A symbol is one coded value of one plane. The source's bench/ folder compares the codec with a textbook's.
    """
    each = EachFile(files)
    results = []
    for path in files:
        with each.file(path):
            results.append(_measure(path, rounds, bap_steps, limit))
            if not as_json:
                _print(results[-1])
    if as_json:
        print_json(results if len(files) > 1 else results[0])
    each.finish()


def _measure(file: Path, rounds: int, bap_steps: str, limits: Limits) -> dict[str, Any]:
    """Return the symbols of a stream, and seconds and symbols per second of decoding and encoding it."""
    from fba.codec import Decoder, EncoderOptions, decode, encode_with_statistics
    from fba.compiled import is_compiled

    with input_file(file) as path:
        data = path.read_bytes()
    bap_steps = step_tables.table_to_read(file, data, bap_steps, limits)
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
        ("encode", lambda: encode_with_statistics(animation, encoder)),
    ):
        run()
        times = []
        for _ in range(rounds):
            start = perf_counter()
            run()
            times.append(perf_counter() - start)
        timings[name] = {"seconds": median(times), "symbols_per_second": symbols / median(times)}
    return {
        "file": str(file),
        "frames": len(animation),
        "symbols": symbols,
        "compiled": is_compiled(),
        **timings,
    }


def _print(result: dict[str, Any]) -> None:
    how = "compiled" if result["compiled"] else "not compiled: numba is missing or switched off"
    click.echo(f"{result['file']}: {result['frames']} frames, {result['symbols']} symbols ({how})")
    for name, timing in result.items():
        if isinstance(timing, dict):
            click.echo(
                f"  {name}: {1000 * timing['seconds']:.2f} ms, "
                f"{timing['symbols_per_second'] / 1e6:.2f} million symbols/s"
            )
