"""Face models and findings of checks, as text and as JSON."""

from __future__ import annotations

import shutil
import sys
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

from fba.cli.printing import table_lines

if TYPE_CHECKING:
    from fba.face import FaceModel
    from fba.face.checks import Finding

LISTED_ERRORS = 8
"""Most errors that are listed after an import."""
MAX_FAIR_ERRORS = 10
"""Most errors of a face on which streams still look right on the whole."""
FAPU_DISTANCES = {
    "IRISD": "height of the lid opening",
    "ES": "between the pupils",
    "ENS": "pupils to nose",
    "MNS": "nose to mouth",
    "MW": "width of the mouth",
}


def summary(model: FaceModel) -> str:
    """Return a line with counts of vertices, feature points and FAPs."""
    from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP

    every = FAP_COUNT - FIRST_LOW_LEVEL_FAP + 1
    points = len(model.points) - len(model.missing)
    return (
        f"{len(model.parts)} parts, {len(model.vertices)} vertices, {len(model.triangles)} triangles, "
        f"{points} feature points, {len(model.tables)} of {every} FAPs"
    )


def lost_lines(model: FaceModel) -> list[str]:
    """Return a line for each reason why FAPs have no effect, with these FAPs."""
    from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP, faps

    reasons = defaultdict(list)
    for number in range(FIRST_LOW_LEVEL_FAP, FAP_COUNT + 1):
        if number not in model.table_of:
            reasons[model.lost.get(number, "no tables")].append(f"{number} {faps()[number - 1].name}")
    return [f"lost     FAP {', '.join(numbers)}: {reason}" for reason, numbers in reasons.items()]


def model_as_json(model: FaceModel) -> dict[str, Any]:
    """Return a model's properties for programs; lengths in metres."""
    from fba.face import feature_point_names as names

    low, high = model.vertices.min(axis=0), model.vertices.max(axis=0)
    return {
        "name": model.name,
        "notes": dict(model.notes),
        "vertices": len(model.vertices),
        "triangles": len(model.triangles),
        "size": [round(float(extent), 6) for extent in high - low],
        "parts": [
            {
                "name": part.name,
                "kind": part.kind,
                "vertices": len(part.vertices),
                "triangles": len(part.triangles),
                "texture": part.material.texture is not None,
            }
            for part in model.parts
        ],
        "fapu": {unit: model.fapu[unit] for unit in (*FAPU_DISTANCES, "AU")},
        "feature_points": {
            name: [round(float(number), 7) for number in place]
            for name, place in zip(names(), model.points, strict=True)
            if name not in model.missing
        },
        "bound": [name for name, vertex in zip(names(), model.bound, strict=True) if vertex >= 0],
        "missing": list(model.missing),
        "faps": sorted(model.table_of),
        "lost": {str(number): reason for number, reason in sorted(model.lost.items())},
        "fit": model.fit is not None,
        "wrinkles": model.wrinkles,
    }


def print_model(model: FaceModel) -> None:
    """Print a model's properties; lengths in millimetres."""
    from fba.face.fapu import PER_DISTANCE

    click.echo(f"{model.name or 'face'}: {summary(model)}")
    low, high = model.vertices.min(axis=0), model.vertices.max(axis=0)
    click.echo(f"  size     {' x '.join(f'{extent * 1000:.0f}' for extent in high - low)} mm")
    for key, text in model.notes.items():
        click.echo(f"  {key:<8} {text}")
    if model.fit is not None:
        click.echo("  FIT      its own table, by which unsent FAPs are estimated")
    click.echo(f"  wrinkles {'drawn on the skin as it moves' if model.wrinkles else 'none'}")
    bound = int((model.bound >= 0).sum())
    click.echo(
        f"  points   {len(model.points) - len(model.missing)} of {len(model.points)}, {bound} on a vertex"
    )
    if model.missing:
        click.echo(f"  missing  {', '.join(model.missing)}")
    for line in lost_lines(model):
        click.echo(f"  {line}")
    parts = []
    for part in model.parts:
        surface = "texture" if part.material.texture is not None else ""
        surface = surface or ("colours" if part.colours is not None else "plain")
        parts.append((part.name, part.kind, str(len(part.vertices)), str(len(part.triangles)), surface))
    units = []
    for unit, what in FAPU_DISTANCES.items():
        step = model.fapu[unit]
        units.append((unit, f"{step * PER_DISTANCE * 1000:.1f} mm", f"{step * 1e6:.1f} um", what))
    for head, rows, to_right in (
        (("part", "kind", "vertices", "triangles", "surface"), parts, (2, 3)),
        (("FAPU", "distance", "one step", "what it is"), units, (1, 2)),
    ):
        click.echo("\n".join(["", *table_lines(head, rows, to_right=to_right, width=_width(), gap=3)]))


def findings_as_json(findings: Sequence[Finding]) -> dict[str, Any]:
    """Return the findings with their counts."""
    errors = sum(finding.severity == "error" for finding in findings)
    return {
        "errors": errors,
        "warnings": len(findings) - errors,
        "findings": [{"severity": finding.severity, **asdict(finding)} for finding in findings],
    }


def error_lines(findings: Sequence[Finding]) -> list[str]:
    """Return a line for each of the first errors."""
    errors = [finding for finding in findings if finding.severity == "error"]
    lines = [
        f"error    {error.subject}: {error.rule}: {error.found}, not {error.expected}"
        for error in errors[:LISTED_ERRORS]
    ]
    more = len(errors) - LISTED_ERRORS
    return [*lines, f"         and {more} more"] if more > 0 else lines


def judge_import(findings: Sequence[Finding]) -> tuple[str, str]:
    """Return the verdict on an imported face, "good", "fair" or "poor", and a sentence that explains it."""
    errors = sum(finding.severity == "error" for finding in findings)
    counts = f"{_count(errors, 'error')}, {_count(len(findings) - errors, 'warning')}"
    if not errors:
        return "good", f"it meets the standard ({counts}; fba model validate lists them)"
    if errors <= MAX_FAIR_ERRORS:
        return "fair", f"it plays, but not all FAPs are right ({counts}; fba model validate lists them)"
    return (
        "poor",
        f"streams will look wrong on this face ({counts}); give its feature points or kinds of parts",
    )


def print_findings(name: str, findings: Sequence[Finding]) -> None:
    """Print a table of findings, errors first, and a line that counts them."""
    errors = [finding for finding in findings if finding.severity == "error"]
    warnings = [finding for finding in findings if finding.severity != "error"]
    if findings:
        rows = [(f.severity, f.subject, f.rule, f.found, f.expected) for f in (*errors, *warnings)]
        for line in table_lines(("", "about", "rule", "found", "expected"), rows, width=_width()):
            kind = line.partition(" ")[0]
            styled = click.style(kind, fg="red" if kind == "error" else "yellow", bold=kind == "error")
            click.echo(line.replace(kind, styled, 1) if kind else line)
    counts = f"{_count(len(errors), 'error')}, {_count(len(warnings), 'warning')}"
    click.echo(f"{name}: {counts if findings else 'meets the standard'}")


def _width() -> int:
    """Return the most characters in a line of a table."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else 160


def _count(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"
