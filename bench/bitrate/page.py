"""The page of results: tables and pictures in Markdown, in neutral words."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib.resources import files

from bench.bitrate import plots, tables
from bench.bitrate.choices import best_within, compare, group_results
from bench.bitrate.results import EVERYTHING, Result
from bench.bitrate.subjects import BODY, FACE
from bench.bitrate.tables import LIMITS, subjects_text, summary_lines

NAMES = {FACE: "faces", BODY: "bodies"}
MEASURE = {
    FACE: "Errors are those of the built-in head's vertex that is worst in each frame, in the head's own "
    "frame; its rotation is measured in degrees.",
    BODY: "Errors are those of points 3 cm off each joint along its axes, the worst of three, for every "
    "joint in every frame.",
}


def picture_names(data: str) -> list[str]:
    """Return the names of all pictures that results of some data may have."""
    return [f"{_slug(data)}-{name}{part}.svg" for name in NAMES.values() for part in ("", "-bars")]


def make_pictures(results: Sequence[Result]) -> dict[str, bytes]:
    """Return the pictures of the page by file name. OptionError without matplotlib."""
    found = {}
    for group in _groups(results):
        rates, bars = _picture_names(group)
        found[rates] = plots.draw_rates(group)
        found[bars] = plots.draw_bars(group, LIMITS[group[0].kind])
    return found


def make_page(results: Sequence[Result]) -> str:
    """Return the page for results that `make_pictures` draws beside it."""
    lines = ["# Bit rates", "", "Rates are kbit/s, without packet headers.", "", *summary_lines(results), ""]
    for group in _groups(results):
        own = compare(group)[0].own
        lines += [f"## {own.data}: {subjects_text(own)}", "", *make_section(group)]
    lines += [
        "## Published rates of others",
        "",
        "As published, on other data, and not measured again here.",
        "",
    ]
    return "\n".join([*lines, *tables.published_table(), "", method_text()])


def make_section(group: Sequence[Result], folder: str = "") -> list[str]:
    """Return the lines about the faces or the bodies of some data. folder: of the pictures, with a slash."""
    kind, compared = group[0].kind, compare(group)
    best = best_within(group, LIMITS[kind]).own
    rates, bars = _picture_names(group)
    lines = [
        MEASURE[kind], "",
        f"![Bit rate against error of {NAMES[kind]}]({folder}{rates})", "",
        f"![What each way takes, live and as a file, for {NAMES[kind]}]({folder}{bars})", "",
        *tables.comparison_table(group), "",
        "Every way to code the values of the first row:", "",
        *tables.rivals_table(group, compared[0].own), "",
    ]  # fmt: skip
    if best != compared[0].own:
        lines += [
            f"And those of *{best.method}, {best.point}*, at most {tables.error_text(best.max_mm)} mm off:"
        ]
        lines += ["", *tables.rivals_table(group, best), ""]
    lines += ["All settings of FBA:", "", *tables.settings_table(group), ""]
    if any(one.subject != EVERYTHING for one in group):
        points = dict.fromkeys((one.method, one.point) for one in (compared[0].own, best))
        lines += [
            "Each file, live, with its largest error:",
            "",
            *tables.files_table(group, list(points)),
            "",
        ]
    return lines


def method_text() -> str:
    """Return the section that says how rates and errors are measured."""
    return (files("bench.bitrate") / "method.md").read_text(encoding="utf-8")


def _groups(results: Sequence[Result]) -> list[list[Result]]:
    return [group for group in group_results(results) if compare(group)]


def _picture_names(group: Sequence[Result]) -> tuple[str, str]:
    name = f"{_slug(group[0].data)}-{NAMES[group[0].kind]}"
    return f"{name}.svg", f"{name}-bars.svg"


def _slug(data: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", data.lower()).strip("-") or "data"
