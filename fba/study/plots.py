"""Plots of results: rate against error, and a bar chart of what each way takes live and as a file."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

from fba.study.choices import best_within, compare, own_points, rivals_of, together
from fba.study.packages import require_package
from fba.study.published import Published, published_rates
from fba.study.results import Result
from fba.study.subjects import BODY, FACE

OURS, LIVE, FILE, QUIET = "#b3401f", "#1f5fb3", "#5b7f3a", "#777777"
SIZE = (7.6, 4.4)
EXACT = {FACE: 0.1, BODY: 0.02}
"""Millimetres up to which the axis of errors is linear, so that it has room for 0."""
ERROR = {
    FACE: "largest error, mm: the worst vertex of the worst frame, in the head's frame",
    BODY: "largest error, mm: the worst point 3 cm off a joint",
}
ANCHORS = {FACE: (1.75, 153.0), BODY: (15.6, 3.3)}
"""The published rates that are drawn."""


def draw_rates(group: Sequence[Result]) -> bytes:
    """Return an SVG of rate against error for a group of results. OptionError without matplotlib."""
    pyplot = _pyplot()
    chosen, kind = together(group), group[0].kind
    figure, axes = pyplot.subplots(figsize=SIZE, layout="constrained")
    own = _lower_hull([one for one in own_points(chosen) if "look-ahead" not in one.method])
    compared = compare(group)
    _line(axes, [(one.max_mm, one.live_rate) for one in own], OURS, "FBA, live", 2.4)
    _line(axes, [(one.own.max_mm, one.live.live_rate) for one in compared], LIVE,
          "best general\ncompressor, live", 1.8)  # fmt: skip
    _line(axes, [(one.own.max_mm, one.file.file_rate) for one in compared], FILE,
          "best general compressor,\nwhole file first", 1.4, "--")  # fmt: skip
    for one in published_rates():
        if one.kind == kind and one.low in ANCHORS[kind]:
            _anchor(axes, one)
    axes.set_xscale("symlog", linthresh=EXACT[kind], linscale=0.4)
    axes.set_yscale("log")
    ticks = [
        tick for tick in (0, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100) if tick == 0 or tick >= EXACT[kind]
    ]
    largest = max(one.max_mm for one in chosen)
    ticks = [tick for tick in ticks if tick <= 1.2 * largest]
    axes.set_xticks(ticks, ["0: exact", *(f"{tick:g}" for tick in ticks[1:])])
    axes.set_xlim(-0.2 * EXACT[kind], 3.2 * largest)
    _rate_ticks(axes)
    axes.set_xlabel(ERROR[kind])
    axes.set_ylabel("kbit/s, without packet headers")
    return _svg(figure)


def draw_bars(group: Sequence[Result], limit: float) -> bytes:
    """Return an SVG of bars: what each way takes live and as a file, with an error of at most `limit` mm."""
    pyplot = _pyplot()
    best = best_within(group, limit)
    rows = [("FBA", best.own.live_rate, best.own.file_rate)]
    rivals = rivals_of(together(group), best.own)
    for name in ("brotli 11", "xz", "zstd 19", "deflate", "glTF, int16, meshopt, zstd 19", "int16"):
        same = [one for one in rivals if one.method.startswith(name)]
        if same:
            live = min((one.live_rate for one in same if one.live_rate is not None), default=None)
            rows.append((name, live, min(one.file_rate for one in same if one.file_rate is not None)))
    figure, axes = pyplot.subplots(figsize=(SIZE[0], 0.5 * len(rows) + 1.3), layout="constrained")
    for number, (name, live, file) in enumerate(rows):
        ours = name == "FBA"
        _bar(axes, number - 0.19, live, OURS if ours else LIVE, "live" if number == 0 else "")
        _bar(axes, number + 0.19, file, "#d99c84" if ours else "#a9c1e0", "as a file" if number == 0 else "")
    axes.set_yticks(range(len(rows)), [row[0] for row in rows])
    axes.invert_yaxis()
    axes.set_xlabel(f"kbit/s, at most {best.own.max_mm:.2g} mm off; packet headers not counted: "
                    f"{best.own.header_rate:.1f} kbit/s more for each of them, live")  # fmt: skip
    axes.spines[["top", "right"]].set_visible(False)
    axes.margins(x=0.14)
    return _svg(figure)


def _lower_hull(own: Sequence[Result]) -> list[Result]:
    """Return the points that no other beats in both error and live rate, the smallest errors first."""
    kept: list[Result] = []
    for one in sorted(own, key=lambda one: (one.max_mm, one.live_rate)):
        if not kept or (one.live_rate or 0.0) < (kept[-1].live_rate or 0.0):
            kept.append(one)
    return kept


def _line(
    axes: Any, points: Sequence[tuple[float, float | None]], colour: str, label: str, width: float,
    style: str = "-",
) -> None:  # fmt: skip
    x, y = [point[0] for point in points], [point[1] for point in points]
    axes.plot(x, y, style, color=colour, linewidth=width, marker="o", markersize=3.5)
    axes.annotate(label, (x[-1], y[-1]), xytext=(7, 0), textcoords="offset points", color=colour,
                  va="center", fontsize=9, fontweight="bold" if colour == OURS else "normal")  # fmt: skip


def _anchor(axes: Any, one: Published) -> None:
    if one.low == one.high:
        axes.axhline(one.low, color=QUIET, linewidth=0.9, linestyle=":")
    else:
        axes.axhspan(one.low, one.high, color=QUIET, alpha=0.13, linewidth=0)
    rate = f"{one.low:g}" if one.low == one.high else f"{one.low:g} to {one.high:g}"
    axes.annotate(
        f"published: {one.what}, {rate}",
        (0.995, one.high),
        xycoords=("axes fraction", "data"),
        xytext=(0, 2),
        textcoords="offset points",
        ha="right",
        va="bottom",
        color=QUIET,
        fontsize=8,
    )


def _bar(axes: Any, place: float, value: float | None, colour: str, label: str) -> None:
    if value is None:
        axes.annotate("none: needs all frames first", (0, place), xytext=(3, 0), textcoords="offset points",
                      va="center", color=QUIET, fontsize=8)  # fmt: skip
        return
    axes.barh(place, value, height=0.36, color=colour)
    text = f"{value:.2f}" + (f"  {label}" if label else "")
    axes.annotate(text, (value, place), xytext=(3, 0), textcoords="offset points", va="center", fontsize=8.5)


def _rate_ticks(axes: Any) -> None:
    low, high = axes.get_ylim()
    ticks = [tick for tick in (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500) if low <= tick <= high]
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)


def _pyplot() -> Any:
    matplotlib: Any = require_package("matplotlib", "drawing plots")
    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "fba", "font.size": 9.5, "svg.fonttype": "path"})
    return require_package("matplotlib.pyplot", "drawing plots")


def _svg(figure: Any) -> bytes:
    text = io.BytesIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    _pyplot().close(figure)
    return text.getvalue()
