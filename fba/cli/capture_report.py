"""Reports of `fba encode` on motion capture: differences from the source, joints beyond human limits."""

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

NAME_WIDTH = 16
PART_WIDTH = 24
"""Characters of columns."""
MAX_NAMES = 12
"""Most joints in a line."""
SAMPLED_FRAMES = 2048
"""Frames that are compared without a report."""
SHOWN_FRAMES = 4
"""Frames in the picture of a report."""
MIN_SECONDS_APART = 0.5
"""Least seconds between these frames."""
SUFFIXES = (".html", ".png")
"""Suffixes of files for reports."""


@dataclass(frozen=True, eq=False)
class CaptureReport:
    """A capture beside the person that its stream shows.

    motion: as captured. mapped: joint of the standard -> number of the source's joint. animation: as decoded.
    comparison: of both. bones: `retarget_report` of the motion before coding; None without `--report`. up:
    the rotation to the axis that points up. scale: metres per unit of the source, if given.
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
    """Return the animation, clamped to the limits of human motion if `limits` is "clamp", and a report."""
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

    clamped: the parameters that the encoder clamped. lead: count of frames of the capture before the first.
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
    """Return reports about captures.

    options: with which captures were read; ground, joints, rest, up and scale are used. detailed: compare all
    frames, and bones before coding.
    """
    from fba import rotations
    from fba.capture import measure_bones
    from fba.capture.comparison import compare
    from fba.capture.motion import read_axis

    reports = []
    for file in captures:
        if file.animation.body is None:  # the body is in another file
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
        most = None if detailed else SAMPLED_FRAMES
        comparison = compare(motion, body.after, ready.mapped, scale=scale, up=up, level=level, most=most)
        comparison = comparison.with_more(_clamped_differences(body.clamped))
        bones = asdict(measure_bones(ready, body.before, scale=scale)) if detailed else None
        reports.append(CaptureReport(path, motion, ready.mapped, body.after, comparison, bones, up, scale))
    return reports


def _find_motion(
    file: ReadFile, options: Mapping[str, Any], reading: Reading
) -> tuple[SkeletonMotion, Preparation]:
    """Return the motion of which a body was made, and its preparation.

    A file with BAPs was not read as a motion, and a skeleton of the standard's joints was not prepared.
    """
    from fba.body import Skeleton
    from fba.capture.preparation import prepare
    from fba.cli.map_options import read_capture

    assert file.captured is not None  # the caller names captures only
    motion, ready = file.captured.capture, file.captured.ready
    if motion is None:
        motion = read_capture(file.path, reading)
    if ready is None:
        asked = {name: options[name] for name in ("joints", "rest", "up")}
        with warnings.catch_warnings(action="ignore", category=FbaWarning):  # the reader gave them
            ready = prepare(motion, Skeleton.default(), **asked)
    return motion, ready


def report_values(report: CaptureReport) -> dict[str, Any]:
    """Return a report for programs."""
    differences = [
        {**asdict(each), "grade": each.grade, "unit": _unit(each)} for each in report.comparison.differences
    ]
    verdict = {"verdict": report.comparison.verdict, "differences": differences}
    return {"input": str(report.path), **verdict, **(report.bones or {})}


def report_lines(report: CaptureReport) -> list[str]:
    """Return a report as lines of text: the worst part of each measure, and all parts that are not good."""
    comparison = report.comparison
    result = [f"{report.path}: {comparison.frames} frames beside the source: {comparison.verdict}"]
    result.append(
        f"  {'measure':{NAME_WIDTH}}{'part':{PART_WIDTH}}{'typical':>8}{'worst':>8}  unit     frame  grade"
    )
    shown: set[str] = set()
    for each in comparison.differences:
        if each.measure in shown and each.grade == "good":
            continue
        shown.add(each.measure)
        result.append(
            f"  {each.measure:{NAME_WIDTH}}{each.part:{PART_WIDTH}}{each.typical:8.1f}{each.worst:8.1f}  "
            f"{_unit(each):8} {each.frame:5}  {colour_grade(each.grade, each.grade)}"
        )
    bones = report.bones or {}
    result += [f"  {what}: {reason}" for what, reason in bones.get("found", {}).items()]
    for what, key in (("unused joints of the source", "unused"), ("joints that the source lacks", "missing")):
        if names := bones.get(key):
            more = f", and {len(names) - MAX_NAMES} more" if len(names) > MAX_NAMES else ""
            result.append(f"  {what}: {', '.join(names[:MAX_NAMES])}{more}")
    return result


def limit_lines(limits: Mapping[str, Any]) -> list[str]:
    """Return the report of `apply_limits` as lines of text."""
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
    """Return a line, in red, with the fault of a poor result; "" for other results."""
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
    Image.fromarray(draw_sights(report, SHOWN_FRAMES)).save(file, "png", optimize=True)
    return file.getvalue()


def draw_sights(report: CaptureReport, count: int) -> UInt8:
    """Return a picture, uint8 (H, W, 3), of the source and the result in at most `count` frames."""
    from fba.capture.comparison import bounds, find_sticks
    from fba_player.export.capture_sheet import Sight, draw_sheet

    rate = float(report.animation.rate)
    worst = report.comparison.worst_frames(count, max(1, round(MIN_SECONDS_APART * rate)))
    frames = [each.frame for each in worst]
    sticks = find_sticks(
        report.motion, report.animation, report.mapped, frames, scale=report.scale, up=report.up
    )
    sights = [
        Sight(
            each.frame,
            each.sentence,
            f"frame {each.frame}, {each.frame / rate:.2f} s: {each.grade} (fair from "
            f"{bounds()[each.measure].fair:g}, poor from {bounds()[each.measure].poor:g} {_unit(each)})",
            each.grade,
            "right" if each.part.startswith("right") else "left",
            stick,
        )
        for each, stick in zip(worst, sticks, strict=True)
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
        f'<tr class="{each.grade}"><td>{escape(each.measure)}<td>{escape(each.part)}<td>{each.typical:.1f}'
        f"<td>{each.worst:.1f}<td>{escape(_unit(each))}<td>{each.frame}<td>{bounds()[each.measure].fair:g}"
        f"<td>{bounds()[each.measure].poor:g}<td>{each.grade}\n"
        for each in comparison.differences
    )
    picture = b64encode(draw_report(report)).decode()
    measures = "".join(f"<dt>{bound.measure}<dd>{escape(bound.says)}\n" for bound in bounds().values())
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
    """Return the errors of clamped BAPs, in degrees and mm."""
    from math import degrees

    from fba.capture.comparison import Difference

    result = []
    for label, cut in clamped.items():
        kind, number, name = label.split(maxsplit=2)
        if kind != "BAP":
            continue
        angle = baps()[int(number) - 1].unit != "mm"
        worst = degrees(cut.off * 1e-5) if angle else float(cut.off)
        result.append(Difference("clamped" if angle else "clamped root", name, 0.0, worst, cut.frame))
    return tuple(result)


def _unit(difference: Difference) -> str:
    from fba.capture.comparison import bounds

    return bounds()[difference.measure].unit
