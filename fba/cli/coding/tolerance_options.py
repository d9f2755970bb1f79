"""`--tolerance`: the largest error of the shown face and body, and reports of the result."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import click

from fba.cli.options import TextType, parse_number

if TYPE_CHECKING:
    from fba.animation import Animation
    from fba.planning import FaceErrors, NearLossless, Tolerance

METRES = {"mm": 1e-3, "cm": 1e-2, "um": 1e-6, "\u00b5m": 1e-6, "\u03bcm": 1e-6}
"""Metres of each unit of a length; the last two have the micro sign and the Greek letter."""


def _parse_length(typed: str) -> float:
    text = typed.strip()
    match = re.fullmatch(r"([0-9.eE+-]+)\s*([a-zA-Z\u00b5\u03bc]*)", text)
    number = parse_number(match[1]) if match else math.nan
    if match is None or math.isnan(number):
        raise ValueError(f"{text!r} is not a length; write a number and its unit, as 0.5mm")
    if number <= 0:
        raise ValueError(f"{text} is not positive")
    if not match[2]:
        raise ValueError(f"{text} has no unit; write {match[1]}mm, {match[1]}cm or {match[1]}um")
    if match[2] not in METRES:
        raise ValueError(f"{match[2]!r} is not a unit of a tolerance; use mm, cm or um")
    return number * METRES[match[2]]


LENGTH = TextType("length", _parse_length)
"""A positive length with its unit, in metres: 0.5mm."""


def tolerance_in_metres(animation: Animation, face: float | None, body: float | None) -> Tolerance:
    """Return a tolerance in metres. None: the default of `fba.planning.Tolerance`.

    body: of points beside joints; half of it applies to feet that stand.
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
    """Return the result of a tolerance, for people."""
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
    """Return the errors of the face."""
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
    """Return the result of a tolerance, for programs."""
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
    body = result.body
    if body is not None:
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
