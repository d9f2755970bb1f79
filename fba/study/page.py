"""The page of results: tables and pictures in Markdown, in neutral words."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files

from fba.study import plots, tables
from fba.study.choices import compare, of_kind
from fba.study.results import Result
from fba.study.subjects import BODY, FACE
from fba.study.summary import LIMITS, subjects_text, summary_lines

TITLES = {FACE: "Faces", BODY: "Bodies"}
FILES = {FACE: "faces", BODY: "bodies"}
PICTURES = tuple(f"{name}{part}.svg" for name in FILES.values() for part in ("", "-bars"))
MEASURE = {
    FACE: "Errors are those of the built-in head's vertex that is worst in each frame, in the head's own "
    "frame; its rotation is measured in degrees.",
    BODY: "Errors are those of points 3 cm off each joint along its axes, the worst of three, for every "
    "joint in every frame.",
}


def make_pictures(results: Sequence[Result], prefix: str = "") -> dict[str, bytes]:
    """Return the pictures of the page by file name. OptionError without matplotlib."""
    found = {}
    for kind in _kinds(results):
        found[f"{prefix}{FILES[kind]}.svg"] = plots.draw_rates(results, kind)
        found[f"{prefix}{FILES[kind]}-bars.svg"] = plots.draw_bars(results, kind, LIMITS[kind])
    return found


def make_page(results: Sequence[Result]) -> str:
    """Return the page for results that `make_pictures` draws beside it."""
    lines = ["# Bit rates", "", *summary_lines(results), ""]
    for kind in _kinds(results):
        lines += make_section(results, kind)
    lines += ["## Published rates of others", "", "On data of their own, and not measured again here.", ""]
    return "\n".join([*lines, *tables.published_table(), "", method_text()])


def make_section(results: Sequence[Result], kind: str, prefix: str = "") -> list[str]:
    """Return the lines about faces or bodies. prefix: of the pictures' names."""
    compared = compare(of_kind(results, kind))
    points = [(one.own.method, one.own.point) for one in compared]
    name = FILES[kind]
    best = plots.best_within(of_kind(results, kind), LIMITS[kind]).own
    lines = [
        f"## {TITLES[kind]}: {subjects_text(compared[0].own)}", "", f"{MEASURE[kind]} Rates are kbit/s.", "",
        f"![Bit rate against error, {name}]({prefix}{name}.svg)", "",
        f"![What each way takes live and as a file, {name}]({prefix}{name}-bars.svg)", "",
        *tables.comparison_table(results, kind), "",
        "Every way to code the values of the first row:", "",
        *tables.rivals_table(results, compared[0].own), "",
    ]  # fmt: skip
    if best != compared[0].own:
        lines += [f"Those with errors of at most {tables.error_text(best.max_mm)} mm:", ""]
        lines += [*tables.rivals_table(results, best), ""]
    lines += ["All settings of FBA:", "", *tables.settings_table(results, kind), ""]
    if per_file := files_section(results, kind, points[:1] + points[-3:-1]):
        lines += per_file
    return lines


def files_section(results: Sequence[Result], kind: str, points: Sequence[tuple[str, str]]) -> list[str]:
    """Return the table of single files, with a line before it; nothing where there is one file."""
    if not any(one.kind == kind and one.subject != "all" for one in results):
        return []
    return [
        "Each file, live, with its largest error:", "", *tables.files_table(results, kind, points), ""
    ]  # fmt: skip


def method_text() -> str:
    """Return the section that says how rates and errors are measured."""
    return (files("fba.study") / "method.md").read_text(encoding="utf-8")


def _kinds(results: Sequence[Result]) -> list[str]:
    return [kind for kind in (FACE, BODY) if compare(of_kind(results, kind))]
