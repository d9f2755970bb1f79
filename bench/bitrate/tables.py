"""Tables of results in Markdown, and the main results in a few rows."""

from __future__ import annotations

from collections.abc import Sequence

from bench.bitrate.choices import (
    Comparison,
    best_within,
    compare,
    group_results,
    own_points,
    rivals_of,
    together,
)
from bench.bitrate.errors import THRESHOLDS
from bench.bitrate.published import published_rates
from bench.bitrate.results import ALL, EVERYTHING, SENT, Result
from bench.bitrate.subjects import BODY, FACE

HEADER = ("what", "error", "FBA live", "smallest other, live", "FBA file", "smallest other, file")
LIMITS = {FACE: 0.5, BODY: 10.0}
"""Millimetres of error of the second row of a kind."""
ABSENT = "–"


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return a table in Markdown; all columns but the first are right-aligned."""
    rule = ["---", *["---:"] * (len(header) - 1)]
    return [f"| {' | '.join(row)} |" for row in (header, rule, *rows)]


def rate_text(rate: float | None) -> str:
    """Return kilobits a second with two digits behind the point, a dash for None."""
    return ABSENT if rate is None else f"{rate:.2f}"


def error_text(millimetres: float) -> str:
    """Return millimetres: "0" for exactly that, else two digits behind the point, or three below 0.1."""
    if millimetres == 0:
        return "0"
    return f"{millimetres:.2f}" if millimetres >= 0.1 else f"{millimetres:.3f}"


def share_text(share: float) -> str:
    """Return a share in percent."""
    return f"{100 * share:.2f} %"


def settings_table(group: Sequence[Result]) -> list[str]:
    """Return this codec's results at all settings."""
    own, kind = own_points(together(group)), group[0].kind
    more = "head, degrees" if kind == FACE else "standing feet, mm"
    header = ["setting", "live, kbit/s", "file, kbit/s", "max, mm", "99 % within, mm",
              f"within {THRESHOLDS[kind]:g} mm", more, _unit_header(kind)]  # fmt: skip
    rows = [
        [f"{one.method}, {one.point}", rate_text(one.live_rate), rate_text(one.file_rate),
         error_text(one.max_mm), error_text(one.p99_mm), share_text(one.under),
         f"{one.degrees:.2f}" if kind == FACE else error_text(one.feet_mm),
         f"{one.units:,.0f}"]
        for one in own
    ]  # fmt: skip
    return table(header, rows)


def _unit_header(kind: str) -> str:
    return "max, units of the FAP" if kind == FACE else "max, 1e-5 rad or mm"


def rivals_table(group: Sequence[Result], own: Result) -> list[str]:
    """Return what every other way takes for the values of one of this codec's points."""
    rivals = rivals_of(together(group), own)
    fewer = [SENT] if own.kind == FACE else []
    header = ["", *[f"{form}, {what}" for form in ("live", "file") for what in _number_names(fewer)]]
    first = rate_text(own.live_rate), rate_text(own.file_rate)
    spare = [ABSENT] * len(fewer)
    rows = [[f"**{own.method}, {own.point}**", *spare, f"**{first[0]}**", *spare, f"**{first[1]}**"]]
    for name in dict.fromkeys(one.method for one in rivals):
        same = {one.numbers: one for one in rivals if one.method == name}
        cells = [
            rate_text(getattr(same[numbers], form) if numbers in same else None)
            for form in ("live_rate", "file_rate")
            for numbers in (ALL, *fewer)
        ]
        rows.append([name, *cells])
    return table(header, rows)


def _number_names(fewer: Sequence[str]) -> list[str]:
    return ["all numbers", "those that FBA sends"] if fewer else ["kbit/s"]


def comparison_table(group: Sequence[Result]) -> list[str]:
    """Return this codec and the smallest others at the same errors."""
    header = ["setting", "max, mm", "FBA live", "smallest other, live", "times", "FBA file",
              "smallest other, file", "times"]  # fmt: skip
    return table(header, [_comparison_row(one) for one in compare(group)])


def _comparison_row(one: Comparison) -> list[str]:
    return [
        f"{one.own.method}, {one.own.point}", error_text(one.own.max_mm),
        rate_text(one.own.live_rate), f"{rate_text(one.live.live_rate)} ({one.live.method})",
        _times(one.live.live_rate, one.own.live_rate), rate_text(one.own.file_rate),
        f"{rate_text(one.file.file_rate)} ({one.file.method})", _times(one.file.file_rate, one.own.file_rate),
    ]  # fmt: skip


def _times(theirs: float | None, ours: float | None) -> str:
    assert theirs is not None
    assert ours is not None
    return f"{theirs / ours:.2f}"


def published_table() -> list[str]:
    """Return published rates of others."""
    rows = [
        [one.what, f"{one.low:g}" if one.low == one.high else f"{one.low:g} to {one.high:g}", one.conditions,
         one.error]
        for one in sorted(published_rates(), key=lambda one: (one.kind != FACE, one.low))
    ]  # fmt: skip
    return [
        "| what | kbit/s | conditions | error |",
        "|---|---|---|---|",
        *[f"| {' | '.join(row)} |" for row in rows],
    ]


def files_table(group: Sequence[Result], points: Sequence[tuple[str, str]]) -> list[str]:
    """Return the live rates and largest errors of every file, at some points of this codec."""
    names = list(dict.fromkeys(one.subject for one in group if one.subject != EVERYTHING))
    header = ["file", "seconds", *[f"{method}, {point}" for method, point in points]]
    rows = []
    for name in names:
        own = {(one.method, one.point): one for one in group if one.subject == name}
        found = [own[point] for point in points if point in own]
        if found:
            cells = [f"{rate_text(one.live_rate)} ({error_text(one.max_mm)} mm)" for one in found]
            rows.append([name, f"{found[0].seconds:.1f}", *cells])
    return table(header, rows)


def summary_lines(results: Sequence[Result]) -> list[str]:
    """Return a table of the streams without loss and with a small one, of faces and bodies."""
    lines = [f"| {' | '.join(HEADER)} |", "|---|---|---|---|---|---|"]
    for group in group_results(results):
        if compared := compare(group):
            rows = dict.fromkeys((compared[0], best_within(group, LIMITS[group[0].kind])))
            lines += [f"| {' | '.join(_row(one))} |" for one in rows]
    return lines


def subjects_text(one: Result) -> str:
    """Return "24 faces, 177 s"."""
    names = {FACE: ("face", "faces"), BODY: ("body", "bodies")}[one.kind]
    return f"{one.subjects} {names[one.subjects != 1]}, {one.seconds:.0f} s"


def _row(one: Comparison) -> list[str]:
    own = one.own
    error = "none" if own.max_mm == 0 else f"at most {error_text(own.max_mm)} mm"
    return [
        f"{own.data}: {subjects_text(own)}", error, f"{rate_text(own.live_rate)} kbit/s",
        f"{rate_text(one.live.live_rate)} ({one.live.method})", f"{rate_text(own.file_rate)} kbit/s",
        f"{rate_text(one.file.file_rate)} ({one.file.method})",
    ]  # fmt: skip
