"""Reports of `fba encode` on motion capture: errors of bones, and joints beyond human limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from fba.animation import Animation

NAME_WIDTH = 32
MOST_NAMES = 12


def apply_limits(animation: Animation, limits: str) -> tuple[Animation, dict[str, Any]]:
    """Return the animation, clamped to the limits of human motion if limits is "clamp"; and a report."""
    if limits == "off" or animation.body is None:
        return animation, {}
    from fba.body import Limits

    human = Limits.human()
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


def compare(
    captures: Sequence[Path],
    animation: Animation,
    format: str | None = None,
    clip: str | None = None,
    joints: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """Return a report of the angles between the bones of captures and of the body, before coding.

    clip: the animation that was read of a file with several, by name or number. joints: the map of joints
    that was given.
    """
    from fba.capture import retarget_report
    from fba.formats import format_of

    reports = []
    for path in captures:
        reader = format_of(path, format)
        assert reader.read_motion is not None  # the caller names captures only
        motion = reader.read_motion(path, **({} if reader.list_clips is None else {"clip": clip}))
        report = asdict(retarget_report(motion, animation, joints=joints))
        reports.append({"input": str(path), **report})
    return {"captures": reports}


def report_lines(report: dict[str, Any]) -> list[str]:
    """Return reports as lines of text."""
    result = []
    for capture in report.get("captures", ()):
        result.append(f"{capture['input']}: bones against the source's, degrees ({capture['frames']} frames)")
        result.append(f"  {'bone':{NAME_WIDTH}}{'mean':>8}{'worst':>8}  frame")
        for bone in capture["bones"]:
            name = f"{bone['joint']} - {bone['aim']}"
            result.append(f"  {name:{NAME_WIDTH}}{bone['mean']:8.3f}{bone['worst']:8.3f}  {bone['frame']}")
        if (feet := capture["feet"]) is not None:
            result.append(
                f"  feet on the ground: {1000 * feet['mean']:.1f} mm off on average, "
                f"{1000 * feet['worst']:.1f} mm at worst, {100 * feet['within']:.1f} % within 1 cm"
            )
        for what, names in (
            ("unused joints of the source", capture["unused"]),
            ("joints that the source lacks", capture["missing"]),
        ):
            if names:
                more = f", and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
                result.append(f"  {what}: {', '.join(names[:MOST_NAMES])}{more}")
    if "limits" in report:
        verb = "held within" if report["limits_clamped"] else "beyond"
        if not report["limits"]:
            result.append("all joints keep within the limits of human motion")
        result += [
            f"{excess['limit']}: {verb} {excess['low']:g}..{excess['high']:g} degrees in "
            f"{excess['frames']} frames, {excess['worst']:.1f} too much at worst"
            for excess in report["limits"]
        ]
    return result
