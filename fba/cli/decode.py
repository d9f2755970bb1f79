"""`fba decode`: FBA streams to FAP, BAP and EPF files."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import click

from fba.animation import Animation
from fba.cli import options
from fba.errors import BitstreamError

_FOLDER_OR_FILE = click.Path(path_type=Path)


@click.command(
    epilog=options.examples(
        "fba decode talk.fba --fap talk.fap",
        "fba decode both.fba --fap face.fap --bap body.bap",
        "fba decode talk.fba --fap talk.fap --epf talk.epf    # encode --epf makes the same bytes again",
        "fba decode archive/*.fba --fap decoded/",
    )
)
@click.argument("inputs", metavar="IN.fba...", nargs=-1, required=True, type=options.EXISTING)
@click.option(
    "--fap", type=_FOLDER_OR_FILE, metavar="OUT.fap", help="Where the FAPs go; a folder for several inputs."
)
@click.option("--bap", type=_FOLDER_OR_FILE, metavar="OUT.bap", help="Where the BAPs go; likewise.")
@click.option(
    "--epf", type=_FOLDER_OR_FILE, metavar="OUT.epf", help="How it was coded, for fba encode --epf; likewise."
)
@options.bap_steps_option
@options.salvage_option
@options.json_option
def command(
    inputs: tuple[Path, ...],
    fap: Path | None,
    bap: Path | None,
    epf: Path | None,
    bap_steps: str,
    salvage: bool,
    as_json: bool,
) -> None:
    """Decode FBA streams to ASCII FAP and BAP files, and to EPF files that say how they were coded."""
    targets = {".fap": fap, ".bap": bap, ".epf": epf}
    if not any(targets.values()):
        raise click.UsageError("say what to write: --fap, --bap, --epf")
    several = len(inputs) > 1
    for suffix, target in targets.items():
        if target is not None and several and not target.is_dir():
            raise click.UsageError(f"several inputs need a folder for --{suffix[1:]}, and {target} is none")
    reports = []
    with options.progress("decoding", len(inputs)) as step:
        for path in inputs:
            reports.append(_decode(path, targets, bap_steps=bap_steps, salvage=salvage))
            step(1)
    if as_json:
        options.print_json(reports if several else reports[0])
        return
    for report in reports:
        click.echo(f"{report['input']}: {report['frames']} frames to {', '.join(report['written'])}")


def _decode(path: Path, targets: dict[str, Path | None], *, bap_steps: str, salvage: bool) -> dict[str, Any]:
    from fba.codec import Decoder, PlaneSettings, decode
    from fba.formats import write
    from fba.formats.epf import write_epf

    on_error: Literal["raise", "salvage"] = "salvage" if salvage else "raise"
    with options.input_file(path) as file:
        data = file.read_bytes()
    settings: list[PlaneSettings] = []
    if targets[".epf"] is not None:
        decoder = Decoder(bap_steps=bap_steps, on_error=on_error)
        frames = decoder.push(data) + decoder.finish()
        if not frames:
            raise BitstreamError("the stream holds no plane that can be decoded", plane=0)
        settings = [frame.plane.settings for frame in frames if frame.plane is not None]
        animation = Animation.from_frames(frames, name=path.stem)
    else:
        decoded = decode(data, bap_steps=bap_steps, on_error=on_error)
        animation = Animation(decoded.rate, decoded.index, decoded.face, decoded.body, path.stem)
    for suffix, track in ((".fap", animation.face), (".bap", animation.body)):
        if targets[suffix] is not None and track is None:
            raise click.UsageError(f"{path} carries no {suffix[1:].upper()}s; leave --{suffix[1:]} out")
    written = []
    for suffix, target in targets.items():
        if target is None:
            continue
        place = target / f"{path.stem}{suffix}" if target.is_dir() else target
        if suffix == ".epf":
            write_epf(place, settings)
        else:
            write(place, animation, format=suffix[1:])
        written.append(str(place))
    return {"input": str(path), "frames": len(animation), "rate": str(animation.rate), "written": written}
