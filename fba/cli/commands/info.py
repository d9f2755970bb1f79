"""`fba info`: the content of a file."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.cli import options, step_tables
from fba.cli.command import Command, EachFile, examples
from fba.cli.inputs import (
    Reading,
    check_clip,
    find_format,
    find_in_body,
    input_file,
    probe_input,
    read_stream,
    taken_options,
)
from fba.cli.option_fields import option, with_options
from fba.cli.printing import clock_text, print_json, rate_text, seconds_text
from fba.errors import FbaWarning, ModelError
from fba.parameters import BAP_STEPS_AUTO

if TYPE_CHECKING:
    from fba.carriage.mp4 import Mp4Track
    from fba.codec import PartInfo, StreamInfo
    from fba.formats import Format
    from fba.formats.gltf.bodies import PersonInfo
    from fba.formats.gltf.clips import ClipInfo

NAMED = 8
"""Most names of markers in a line."""


@click.command(
    cls=Command,
    epilog=examples(
        "fba info talk.fba",
        "fba info --json *.fba | jq .[].bits_per_second",
        "fba info --trace talk.fba | less",
    ),
)
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=options.EXISTING)
@with_options
def command(
    files: tuple[Path, ...],
    reading: Reading,
    as_json: bool = options.json_option,
    trace: bool = option(
        default=False, help="List every syntax element of an FBA stream with its bit position."
    ),
    values: bool = option(default=False, help="With --trace: the decoded symbols of every segment as well."),
    face: str | None = options.face_option,
) -> None:
    """Show what a file holds: frames, rate, parameters, bits. Any format is recognised by content.

    Of the capture of a face it also says what was recorded, and what is odd about it; of BAPs, whether knees
    bend forward.

    --trace reads the stream a second time, bit by bit, with an independent decoder. It is slow.
    """
    check_clip(reading, files)
    each = EachFile(files)
    if trace:
        for path in files:
            with each.file(path):
                _trace(path, reading, as_json=as_json, values=values)
        each.finish()
        return
    reports = []
    for path in files:
        with each.file(path), input_file(path) as file:
            reports.append(_report(path, file, reading, face, printed=not as_json))
    if as_json:
        print_json(reports if len(files) > 1 else reports[0])
    each.finish()


def _report(path: Path, file: Path, reading: Reading, face: str | None, *, printed: bool) -> dict[str, Any]:
    """Return the content of a file, for programs; print it for people as well if `printed`.

    path: as typed. file: to be read. face: the name of the captured face to read.
    """
    from fba.carriage.mp4 import list_tracks
    from fba.codec import StreamInfo

    reader, size = find_format(file, reading.format), file.stat().st_size
    clips: tuple[ClipInfo, ...] = ()
    if reader.read_face is not None:
        return _report_face(path, file, reader, reading, face, printed=printed)
    if reader.describe is None:
        info = probe_input(file, reading)
    else:
        content = reader.describe(file, clip=reading.clip, limits=reading.limit)
        if content.person is not None:
            if reading.clip is not None:
                raise ModelError(f"there is no animation {reading.clip!r}; the file has none")
            if printed:
                _print_person(path, size, content.person)
            return {"file": str(path), "format": "gltf", "size": size, "person": asdict(content.person)}
        assert content.animation is not None  # as there is no person
        info, clips = StreamInfo.of_animation(content.animation, reader.name, size), content.clips
    steps = ""
    if reader.read_stream is not None and info.body is not None:
        data = read_stream(file, reading, reader)
        steps = step_tables.explain_choice(data, reading.bap_steps, reading.limit)
        if reading.bap_steps != BAP_STEPS_AUTO:
            step_tables.warn_of_doubtful_stream(path, data, reading.bap_steps)
    tracks = list_tracks(file.read_bytes(), file) if reader.name == "mp4" else ()
    if printed:
        _print(path, info, clips, steps, tracks, size)
    findings = () if reader.is_capture or info.body is None else _find_in_body(file, reader, reading)
    if printed:
        _print_findings(findings)
    report = {"file": str(path), **info.to_dict(), "bap_steps_choice": steps or None, "findings": findings}
    if tracks:
        report |= {"file_size": size, "tracks": [each.to_dict() for each in tracks]}
    return report | ({"clips": [asdict(clip) for clip in clips]} if clips else {})


def _report_face(
    path: Path, file: Path, reader: Format, reading: Reading, face: str | None, *, printed: bool
) -> dict[str, Any]:
    """Return the content of the capture of a face; see `_report`."""
    from fba.capture import MarkerMotion, make_animation
    from fba.capture.markers.marker_maps import summarise
    from fba.codec import StreamInfo

    assert reader.read_face is not None  # or there were no face
    size, limits = file.stat().st_size, reading.limit
    given = {"source_rate": reading.source_rate, "face": face}
    captured = reader.read_face(file, limits=limits, **taken_options(given, reader.face_options))
    if isinstance(captured, MarkerMotion):
        markers = summarise(captured)
        if printed:
            click.echo(f"{path}: {reader.name.upper()}, {size} bytes")
            _print_markers(markers)
        return {"file": str(path), "format": reader.name, "size": size, "markers": markers}
    capture = captured.describe()
    with warnings.catch_warnings(action="ignore", category=FbaWarning):  # the description has them
        animation = make_animation(captured, path=file, limits=limits).animation
    info = StreamInfo.of_animation(animation, reader.name, size)
    if printed:
        _print(path, info, (), "")
        if capture["kind"] == "points":
            _print_points(capture)
        else:
            _print_shapes(capture)
        _print_findings(capture["findings"])
    return {"file": str(path), **info.to_dict(), "bap_steps_choice": None, "capture": capture}


def _find_in_body(file: Path, reader: Format, reading: Reading) -> tuple[str, ...]:
    """Return what is odd about the BAPs of a file."""
    given = {
        "source_rate": reading.source_rate,
        "bap_steps": reading.bap_steps,
        "track": reading.track,
        "salvage": True,
        "limits": reading.limit,
    }
    with warnings.catch_warnings(action="ignore", category=FbaWarning):  # the description has them
        finding = find_in_body(reader.read(file, **taken_options(given, reader.read_options)))
    return () if finding is None else (finding,)


def _print_findings(findings: Iterable[str]) -> None:
    for finding in findings:
        click.echo(f"  found    {finding}")


def _trace(path: Path, reading: Reading, *, as_json: bool, values: bool) -> None:
    import json

    from fba_conformance.trace import element_dict, format_trace, trace

    with input_file(path) as file:
        data = read_stream(file, reading)
        elements = trace(
            data, bap_steps=step_tables.table_to_read(path, data, reading.bap_steps, shown=values)
        )
    if as_json:
        for element in elements:
            click.echo(json.dumps(element_dict(element)))
        return
    for line in format_trace(elements, values=values):
        click.echo(line)


def _print_person(path: Path, size: int, person: PersonInfo) -> None:
    declared = f", as {person.declared} declares them" if person.declared else ""
    click.echo(f"{path}: GLTF, {size} bytes")
    click.echo(f"  person   {person.matched} of {person.joints} joints are the standard's{declared}")
    click.echo(f"  meshes   {person.meshes}; {person.shapes} shapes of a face with known names")
    click.echo(f"  motion   none; show one on it: fba play MOTION --body {path}")


def _print_markers(capture: Mapping[str, Any]) -> None:
    """Print the summary of a capture of markers, see `fba.capture.markers.marker_maps`."""
    start = f" from {clock_text(capture['start'])}" if capture["start"] is not None else ""
    click.echo(
        f"  time     {capture['frames']} frames, {seconds_text(capture['seconds'])} at "
        f"{rate_text(Fraction(capture['rate']))} frames/s{start}"
    )
    markers = capture["markers"]
    names = ", ".join(markers[:NAMED]) + (", ..." if len(markers) > NAMED else "")
    unit = f", in {capture['unit']}" if capture["unit"] else ", unit not given"
    up = f", {capture['up']} up" if capture["up"] else ""
    click.echo(f"  markers  {len(markers)}{unit}{up}: {names}")
    if capture["gaps"]:
        click.echo(
            f"  gaps     {capture['gaps']}, {100 * capture['missing']:.1f} % of all positions; the longest "
            f"{capture['longest']:.2f} s ({capture['longest_marker']})"
        )
    else:
        click.echo("  gaps     none")
    how = "the shape of the cloud" if capture["map"] == "shape" else f"the names ({capture['map']})"
    placed = f"{capture['placed']} markers have a place by {how}"
    click.echo(
        f"  face     {placed if capture['map'] else 'not found; fba encode --map says which marker is where'}"
    )


def _print(
    path: Path,
    info: StreamInfo,
    clips: tuple[ClipInfo, ...],
    steps: str,
    tracks: tuple[Mp4Track, ...] = (),
    size: int = 0,
) -> None:
    """Print a description. tracks: of an MP4 file of that size, in bytes."""
    click.echo(f"{path}: {info.format.upper()}, {size or info.size} bytes")
    for number, track in enumerate(tracks):
        about = f", the stream of {info.size} bytes" if track.is_fba else ""
        click.echo(f"  {'' if number else 'tracks':8} {track}{about}")
    skipped = f", {info.skipped} skipped" if info.skipped else ""
    start = f", starts at {seconds_text(info.start)}" if info.start else ""
    click.echo(
        f"  time     {info.frames} frames, {seconds_text(info.duration)} at "
        f"{rate_text(info.rate)} frames/s{skipped}{start}"
    )
    if info.intra_planes is not None:
        codes = f", {info.start_codes} with start codes" if info.start_codes else ""
        click.echo(
            f"  planes   {info.intra_planes} I, {info.frames - info.intra_planes} P{codes}; "
            f"{info.bits_per_second / 1000:.2f} kbit/s"
        )
    for name, part in (("face", info.face), ("body", info.body)):
        if part is not None:
            click.echo(f"  {name}     {_part_text(part, 'FAP' if name == 'face' else 'BAP', info.frames)}")
    if len(clips) > 1:
        for number, clip in enumerate(clips):
            click.echo(f"  {'clips' if not number else '':8} {clip.name!r}, {seconds_text(clip.seconds)}")
    if steps:
        click.echo(f"  steps    {steps}")
    for damage in info.damage:
        click.echo(f"  damage   {damage}")


def _print_shapes(capture: Mapping[str, Any]) -> None:
    """Print the description of a capture of blendshapes or action units."""
    count, still = len(capture["shapes"]), len(capture["still"])
    moving = f", {still} of which never move" if still else ""
    unseen = f", {capture['unseen']} of them without a face" if capture["unseen"] else ""
    start = f" from {clock_text(capture['start'])}" if capture["start"] is not None else ""
    turns = [what for what, turns in capture["angles"].items() if turns]
    click.echo(f"  capture  {capture['rows']} rows{unseen}, {capture['seconds']:.2f} s{start}")
    click.echo(f"  {capture['kind']:8} {count}{moving}; angles of {' and '.join(turns) or 'nothing'}")


def _print_points(capture: Mapping[str, Any]) -> None:
    """Print the description of a capture of tracked points."""
    unseen = f", {capture['unseen']} of them without a face" if capture["unseen"] else ""
    click.echo(f"  capture  {capture['rows']} rows{unseen}, {capture['seconds']:.2f} s")
    depth = {"none": "without depth", "relative": "with depth", "metres": "in three dimensions, in metres"}
    click.echo(f"  points   {capture['points']} {depth[capture['depth']]}")


def _part_text(part: PartInfo, kind: str, frames: int) -> str:
    count = len(part.parameters)
    plural = "" if count == 1 else "s"
    text = f"{count} {kind}{plural}: {_span_text(part.parameters)}" if count else f"no {kind}s"
    if part.frames != frames:
        text += f"; in {part.frames} frames"
    if part.quants:
        text += f"; quantiser {', '.join(map(str, part.quants))}"
    return text


def _span_text(numbers: tuple[int, ...]) -> str:
    """Return sorted numbers as text: "1..3, 5, 7..9"."""
    spans: list[list[int]] = []
    for number in numbers:
        if spans and number == spans[-1][1] + 1:
            spans[-1][1] = number
        else:
            spans.append([number, number])
    return ", ".join(str(a) if a == b else f"{a}..{b}" for a, b in spans)
