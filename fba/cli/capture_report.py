"""What `fba encode` says of motion capture: how close bones come, and where joints leave human limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from fba.animation import Animation

NAME_WIDTH = 32
MOST_NAMES = 12


def limited(animation: Animation, limits: str) -> tuple[Animation, dict[str, Any]]:
    """The animation, within the limits of human motion with "clamp", and where it left them."""
    if limits == "off" or animation.body is None:
        return animation, {}
    from fba.body import Limits

    human = Limits.human()
    found = human.check(animation.body.values)
    said = [
        {
            "limit": excess.limit.name, "low": excess.limit.low, "high": excess.limit.high,
            "frames": excess.frames, "first": excess.first, "worst": round(excess.worst, 3),
        }
        for excess in found
    ]  # fmt: skip
    if limits == "clamp" and found:
        body = replace(animation.body, values=human.clamp(animation.body.values))
        animation = replace(animation, body=body)
    return animation, {"limits": said, "limits_clamped": limits == "clamp"}


def compared(captures: Sequence[Path], animation: Animation, format: str | None = None) -> dict[str, Any]:
    """The angle between every bone of a capture and the body's, before it is coded."""
    from fba.capture import retarget_report
    from fba.formats import format_of

    reports = []
    for path in captures:
        read_motion = format_of(path, format).read_motion
        assert read_motion is not None  # the caller names captures only
        motion = read_motion(path)
        report = asdict(retarget_report(motion, animation))
        reports.append({"input": str(path), **report})
    return {"captures": reports}


def lines(said: dict[str, Any]) -> list[str]:
    """The same as text."""
    result = []
    for capture in said.get("captures", ()):
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
    if "limits" in said:
        verb = "held within" if said["limits_clamped"] else "beyond"
        if not said["limits"]:
            result.append("all joints keep within the limits of human motion")
        result += [
            f"{excess['limit']}: {verb} {excess['low']:g}..{excess['high']:g} degrees in "
            f"{excess['frames']} frames, {excess['worst']:.1f} too much at worst"
            for excess in said["limits"]
        ]
    return result
