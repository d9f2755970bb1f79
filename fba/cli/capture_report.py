"""Reports of `fba encode` on motion capture: what differs from the source, and joints beyond human limits."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fba.animation import Animation
from fba.cli.inputs import ReadFile, Reading
from fba.cli.printing import colour_grade
from fba.errors import FbaError, FbaWarning
from fba.parameters import baps

if TYPE_CHECKING:
    from fba.arrays import Float64, UInt8
    from fba.capture import SkeletonMotion
    from fba.capture.comparison import Comparison, Difference
    from fba.capture.preparation import Preparation
    from fba.codec import ClampedParameter

NAME_WIDTH, PART_WIDTH = 16, 24
MOST_NAMES = 12
SAMPLE = 2048
"""Frames that are compared where no report is asked for."""
PICTURES = 4
"""Frames that a report shows."""
APART = 0.5
"""Seconds between these, at least."""
SUFFIXES = (".html", ".png")
"""Of files for reports."""


@dataclass(frozen=True, eq=False)
class CaptureReport:
    """A capture beside the person that its stream shows.

    path: of the capture. motion: what was read of it. mapped: joint of the standard -> number of the
    source's. animation: what a decoder returns. comparison: how they differ. bones: what `retarget_report`
    says of the motion before coding; None where no report was asked for. up: what brings the source's axis up
    that the user named; None if that was found. scale: metres in one unit of the source, as given; else None.
    """

    path: Path
    motion: SkeletonMotion
    mapped: Mapping[str, int]
    animation: Animation
    comparison: Comparison
    bones: dict[str, Any] | None = None
    up: Float64 | None = None
    scale: float | None = None


def apply_limits(animation: Animation, limits: str) -> tuple[Animation, dict[str, Any]]:
    """Return the animation, clamped to the limits of human motion if limits is "clamp"; and a report."""
    if limits == "off" or animation.body is None:
        return animation, {}
    from fba.body import JointLimits

    human = JointLimits.human()
    excesses = human.check(animation.body.values)
    rows = [
        {
            "limit": excess.limit.name, "low": excess.limit.low, "high": excess.limit.high,
            "frames": excess.frames, "first": excess.first, "worst": round(excess.worst, 3),
        }
        for excess in excesses
    ]  # fmt: skip
    if limits == "clamp" and excesses:
        body = replace(animation.body, values=human.clamp(animation.body.values))
        animation = replace(animation, body=body)
    return animation, {"limits": rows, "limits_clamped": limits == "clamp"}


@dataclass(frozen=True, eq=False)
class CodedBody:
    """A captured body before coding and after.

    clamped: what the encoder clamped. lead: frames of the capture that are before the first one.
    """

    before: Animation
    after: Animation
    clamped: Mapping[str, ClampedParameter]
    lead: int = 0


def compare_captures(
    captures: Sequence[ReadFile],
    body: CodedBody,
    options: Mapping[str, Any],
    reading: Reading,
    *,
    detailed: bool,
) -> list[CaptureReport]:
    """Return reports of captures.

    options: those with which captures were read, of which ground, joints, rest, up and scale count. detailed:
    compare all frames, and bones before coding.
    """
    from fba import rotations
    from fba.capture import measure_bones
    from fba.capture.comparison import compare
    from fba.capture.motion import read_axis

    reports = []
    for file in captures:
        if file.animation.body is None:  # the file has a face alone, and the body comes from another
            continue
        try:
            motion, ready = _find_motion(file, options, reading)
        except FbaError:
            if detailed:
                raise
            continue
        if body.lead:
            rate, rows = body.before.rate, slice(body.lead, None)
            motion = motion.resample(rate).select(rows)
            ready = replace(ready, motion=ready.motion.resample(rate).select(rows))
        path, scale = file.path, options["scale"]
        level = 0.0 if options["ground"] == "floor" else None
        up = rotations.between(read_axis(ready.up), np.array([0.0, 1.0, 0.0]))
        most = None if detailed else SAMPLE
        comparison = compare(motion, body.after, ready.mapped, scale=scale, up=up, level=level, most=most)
        comparison = comparison.with_more(_clamped_differences(body.clamped))
        bones = None
        if detailed:
            bones = asdict(measure_bones(ready, body.before, scale=scale))
        reports.append(CaptureReport(path, motion, ready.mapped, body.after, comparison, bones, up, scale))
    return reports


def _find_motion(
    file: ReadFile, options: Mapping[str, Any], reading: Reading
) -> tuple[SkeletonMotion, Preparation]:
    """Return the motion that a body was made of, and how it was prepared.

    A file with BAPs has not been read as a motion, and one of the standard's own joints not been prepared.
    """
    from fba.body import Skeleton
    from fba.capture.preparation import prepare
    from fba.cli.joint_options import read_capture

    assert file.captured is not None  # the caller names captures only
    motion, ready = file.captured.capture, file.captured.ready
    if motion is None:
        motion = read_capture(file.path, reading)
    if ready is None:
        asked = {name: options[name] for name in ("joints", "rest", "up")}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FbaWarning)  # the reader has said it
            ready = prepare(motion, Skeleton.default(), **asked)
    return motion, ready


def report_values(report: CaptureReport) -> dict[str, Any]:
    """Return a report for programs."""
    differences = [
        {**asdict(one), "grade": one.grade, "unit": _unit(one)} for one in report.comparison.differences
    ]
    verdict = {"verdict": report.comparison.verdict, "differences": differences}
    return {"input": str(report.path), **verdict, **(report.bones or {})}


def report_lines(report: CaptureReport) -> list[str]:
    """Return a report as lines of text: the worst part of each measure, and all that is not good."""
    comparison = report.comparison
    result = [f"{report.path}: {comparison.frames} frames beside the source: {comparison.verdict}"]
    result.append(
        f"  {'measure':{NAME_WIDTH}}{'part':{PART_WIDTH}}{'typical':>8}{'worst':>8}  unit     frame  grade"
    )
    shown: set[str] = set()
    for one in comparison.differences:
        if one.measure in shown and one.grade == "good":
            continue
        shown.add(one.measure)
        result.append(
            f"  {one.measure:{NAME_WIDTH}}{one.part:{PART_WIDTH}}{one.typical:8.1f}{one.worst:8.1f}  "
            f"{_unit(one):8} {one.frame:5}  {colour_grade(one.grade, one.grade)}"
        )
    bones = report.bones or {}
    result += [f"  {what}: {reason}" for what, reason in bones.get("found", {}).items()]
    for what, key in (("unused joints of the source", "unused"), ("joints that the source lacks", "missing")):
        if names := bones.get(key):
            more = f", and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
            result.append(f"  {what}: {', '.join(names[:MOST_NAMES])}{more}")
    return result


def limit_lines(limits: Mapping[str, Any]) -> list[str]:
    """Return what `apply_limits` reports as lines of text."""
    if "limits" not in limits:
        return []
    if not limits["limits"]:
        return ["all joints keep within the limits of human motion"]
    verb = "held within" if limits["limits_clamped"] else "beyond"
    return [
        f"{excess['limit']}: {verb} {excess['low']:g}..{excess['high']:g} degrees in "
        f"{excess['frames']} frames, {excess['worst']:.1f} too much at worst"
        for excess in limits["limits"]
    ]


def poor_line(report: CaptureReport, *, detailed: bool) -> str:
    """Return a line, in red, that says what is wrong with a poor result; "" for any other."""
    reasons = report.comparison.reasons
    if report.comparison.verdict != "poor":
        return ""
    more = f", and {len(reasons) - 1} more" if len(reasons) > 1 else ""
    ask = "" if detailed else "; --report FILE.html shows it"
    worst = f"{reasons[0].sentence} in frame {reasons[0].frame}"
    return colour_grade(f"fba: poor: {report.path}: {worst}{more}{ask}", "poor")


def draw_report(report: CaptureReport) -> bytes:
    """Return a picture, PNG, of the source and the result side by side in the worst frames."""
    from io import BytesIO

    from PIL import Image

    file = BytesIO()
    Image.fromarray(draw_sights(report, PICTURES)).save(file, "png", optimize=True)
    return file.getvalue()


def draw_sights(report: CaptureReport, count: int) -> UInt8:
    """Return a picture, uint8 (H, W, 3), of the source and the result in at most `count` frames."""
    from fba.capture.comparison import bounds, find_sticks
    from fba_player.export.capture_sheet import Sight, draw_sheet

    rate = float(report.animation.rate)
    worst = report.comparison.worst_frames(count, max(1, round(APART * rate)))
    frames = [one.frame for one in worst]
    sticks = find_sticks(
        report.motion, report.animation, report.mapped, frames, scale=report.scale, up=report.up
    )
    sights = [
        Sight(
            one.frame,
            one.sentence,
            f"frame {one.frame}, {one.frame / rate:.2f} s: {one.grade} (fair from "
            f"{bounds()[one.measure].fair:g}, poor from {bounds()[one.measure].poor:g} {_unit(one)})",
            one.grade,
            "right" if one.part.startswith("right") else "left",
            stick,
        )
        for one, stick in zip(worst, sticks, strict=True)
    ]
    headline = f"{report.path.name}: {report.comparison.verdict}"
    return draw_sheet(report.animation, sights, headline, report.comparison.verdict)


def write_page(report: CaptureReport) -> bytes:
    """Return a page, HTML, with the picture and all differences."""
    from base64 import b64encode
    from html import escape

    from fba.capture.comparison import bounds

    comparison = report.comparison
    rows = "".join(
        f'<tr class="{one.grade}"><td>{escape(one.measure)}<td>{escape(one.part)}<td>{one.typical:.1f}'
        f"<td>{one.worst:.1f}<td>{escape(_unit(one))}<td>{one.frame}<td>{bounds()[one.measure].fair:g}"
        f"<td>{bounds()[one.measure].poor:g}<td>{one.grade}\n"
        for one in comparison.differences
    )
    picture = b64encode(draw_report(report)).decode()
    measures = "".join(f"<dt>{one.measure}<dd>{escape(one.says)}\n" for one in bounds().values())
    name = escape(report.path.name)
    return _PAGE.format(
        name=name, verdict=comparison.verdict, frames=comparison.frames, rows=rows, picture=picture,
        measures=measures,
    ).encode()  # fmt: skip


_PAGE = """<!DOCTYPE html>
<html lang="en"><meta charset="utf-8"><title>{name}: {verdict}</title>
<style>
body {{ font: 15px/1.45 system-ui, sans-serif; max-width: 1640px; margin: 2em auto; padding: 0 1em;
  color: #20242c }}
h1 {{ font-size: 1.5em }} img {{ max-width: 100%; border: 1px solid #dfe2e8 }}
table {{ border-collapse: collapse; margin: 1em 0 }} td, th {{ padding: .2em .8em; text-align: right }}
td:nth-child(-n+2), th:nth-child(-n+2), td:last-child, th:last-child {{ text-align: left }}
tr:nth-child(even) {{ background: #f4f5f7 }}
.good td:last-child {{ color: #2e7d32 }} .fair td {{ color: #a86500 }}
.poor td {{ color: #c62828; font-weight: 600 }} dt {{ font-weight: 600 }}
</style>
<h1>{name}: {verdict}</h1>
<p>{frames} frames of the source beside the person that a decoder shows. Thin lines over the result are the
source's bones. Blue is left, red is right; palms are light, backs of hands dark.</p>
<p><img alt="Source and result in the worst frames" src="data:image/png;base64,{picture}"></p>
<table><tr><th>measure<th>part<th>typical<th>worst<th>unit<th>frame<th>fair from<th>poor from<th>grade
{rows}</table>
<dl>
{measures}</dl>
</html>
"""


def _clamped_differences(clamped: Mapping[str, ClampedParameter]) -> tuple[Difference, ...]:
    """Return what the encoder clamped of bodies, in degrees and mm."""
    from math import degrees

    from fba.capture.comparison import Difference

    result = []
    for label, one in clamped.items():
        kind, number, name = label.split(maxsplit=2)
        if kind != "BAP":
            continue
        angle = baps()[int(number) - 1].unit != "mm"
        worst = degrees(one.off * 1e-5) if angle else float(one.off)
        result.append(Difference("clamped" if angle else "clamped root", name, 0.0, worst, one.frame))
    return tuple(result)


def _unit(one: Difference) -> str:
    from fba.capture.comparison import bounds

    return bounds()[one.measure].unit
