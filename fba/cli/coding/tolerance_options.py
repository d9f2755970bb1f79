"""`--tolerance`: how far what is shown may be off, and what encoding within that came to."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from fba.animation import Animation
    from fba.planning import FaceErrors, NearLossless, Tolerance

UNITS = {"mm": 1e-3, "cm": 1e-2, "um": 1e-6, "\u00b5m": 1e-6, "\u03bcm": 1e-6}
"""Metres of the units that a length may have; the last two have the micro sign and the Greek letter."""


class LengthType(click.ParamType[float]):
    """A positive length with its unit, in metres: 0.5mm."""

    name = "length"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        text = str(value).strip()
        match = re.fullmatch(r"([0-9.eE+-]+)\s*([a-zA-Z\u00b5\u03bc]*)", text)
        try:
            number = float(match[1]) if match else math.nan
        except ValueError:
            number = math.nan
        if match is None or not math.isfinite(number):
            self.fail(f"{text!r} is not a length; write a number and its unit, as 0.5mm", param, ctx)
        if number <= 0:
            self.fail(f"{text} is not positive", param, ctx)
        if not match[2]:
            self.fail(f"{text} has no unit; write {match[1]}mm, {match[1]}cm or {match[1]}um", param, ctx)
        if match[2] not in UNITS:
            self.fail(f"{match[2]!r} is not a unit of a tolerance; use mm, cm or um", param, ctx)
        return number * UNITS[match[2]]


def tolerance_in_metres(animation: Animation, face: float | None, body: float | None) -> Tolerance:
    """Return a tolerance in metres; what is None is as `fba.planning.Tolerance` has it by default.

    body: of points beside joints; half of it holds for feet that stand.
    """
    from fba.planning import Tolerance

    if body is not None and animation.body is None:
        raise click.UsageError(
            "--body-tolerance is for bodies, and the input has none; give --tolerance for faces"
        )
    if face is None and animation.face is not None:
        raise click.UsageError(
            "the input has a face, too: give --tolerance for it as well as --body-tolerance"
        )
    given = {} if face is None else {"face": face}
    if body is not None:
        given |= {"joint": body, "foot": body / 2}
    return Tolerance(**given)


def tolerance_lines(result: NearLossless, animation: Animation) -> list[str]:
    """Return what encoding within a tolerance came to, for people."""
    lines = [] if result.face is None else _face_lines(result, result.face, animation)
    body = result.body
    if body is not None:
        lines.append(
            f"body: points 3 cm from joints move by at most {body.largest * 1000:.2f} mm ({body.joint} at "
            f"{float(animation.times[body.frame]):.2f} s), 99 % of them by at most "
            f"{body.percentile_99 * 1000:.2f} mm; feet that stand by at most {body.foot * 1000:.2f} mm"
        )
    if result.left_out:
        used = f"quantiser of FAPs {result.fap_quant}" if result.face is not None else ""
        used = used or f"quantiser of BAPs {result.bap_quant}"
        lines.append(
            f"{result.left_out} of {len(animation)} frames are not sent; players fill them in between those "
            f"beside them; {used}"
        )
    return lines


def _face_lines(result: NearLossless, face: FaceErrors, animation: Animation) -> list[str]:
    """Return how near the face is."""
    head = f"head within {face.head:.3f} degrees, eyes within {face.gaze:.3f}"
    if face.largest:
        lines = [
            f"face: vertices move by at most {face.largest * 1000:.3f} mm (vertex {face.vertex} at "
            f"{float(animation.times[face.frame]):.2f} s), 99 % of them by at most "
            f"{face.percentile_99 * 1000:.3f} mm; {head}"
        ]
    else:
        lines = [f"face: no vertex moves; {head}"]
    if result.compact:
        lines.append("nothing smaller keeps within the tolerance than what keeps all that is shown")
    return lines


def tolerance_values(result: NearLossless) -> dict[str, Any]:
    """Return the same for programs."""
    face = result.face
    values: dict[str, Any] = {
        "fap_quant": result.fap_quant,
        "frames_left_out": result.left_out,
        "compact": result.compact,
    }
    if face is not None:
        values["face"] = {
            "largest_mm": round(face.largest * 1000, 6),
            "percentile_99_mm": round(face.percentile_99 * 1000, 6),
            "frame": face.frame,
            "vertex": face.vertex,
            "head_degrees": round(face.head, 6),
            "gaze_degrees": round(face.gaze, 6),
        }
    if result.body is not None:
        body = result.body
        values["body"] = {
            "largest_mm": round(body.largest * 1000, 6),
            "percentile_99_mm": round(body.percentile_99 * 1000, 6),
            "share_within": body.share,
            "joint": body.joint,
            "frame": body.frame,
            "foot_mm": round(body.foot * 1000, 6),
            "bap_quant": result.bap_quant,
        }
    return values
