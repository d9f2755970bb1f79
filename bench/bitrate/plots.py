"""Plots of results: rate against error, and a bar chart of what each way takes live and as a file."""

from __future__ import annotations

import io
from collections.abc import Sequence
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np

from bench.bitrate.choices import best_within, compare, own_points, rivals_of, smallest_rates, together
from bench.bitrate.packages import require_package
from bench.bitrate.points import UNPLANNED
from bench.bitrate.published import Published, published_rates
from bench.bitrate.results import ALL, Result
from bench.bitrate.subjects import BODY, FACE

OURS, LIVE, FILE, QUIET = "#b3401f", "#1f5fb3", "#5b7f3a", "#777777"
LIGHT = {OURS: "#dfa791", LIVE: "#8fb0dc"}
SIZE = (7.6, 4.6)
LINEAR = 0.1
"""Millimetres up to which the axis of errors is linear where it has room for 0."""
ERROR = {
    FACE: "largest error, mm: the worst vertex in the worst frame, in the head's own frame",
    BODY: "largest error, mm: the worst point 3 cm off a joint, in the worst frame",
}
TICKS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
MOST = {FACE: 3.0, BODY: 60.0}
"""Millimetres up to which errors are drawn."""
CLOSEST = 0.055
"""Distance of labels, in heights of the plot."""
BARS = ("brotli 11", "xz", "zstd 19", "deflate", "glTF, int16, meshopt, zstd 19", "int16")
"""What is drawn as bars, by the beginning of its name."""


class _Label(NamedTuple):
    x: float
    y: float
    text: str
    colour: str


def draw_rates(group: Sequence[Result]) -> bytes:
    """Return an SVG of rate against error for a group of results. OptionError without matplotlib."""
    chosen, kind = together(group), group[0].kind
    figure, axes = _pyplot().subplots(figsize=SIZE, layout="constrained")
    own = [one for one in own_points(chosen) if one.max_mm <= MOST[kind]]
    planned = [one for one in own if one.method != UNPLANNED]
    compared = [one for one in compare(group) if one.own.max_mm <= MOST[kind]]
    rounded = [(one.max_mm, smallest_rates(_plain_rivals(chosen, one))[0]) for one in own]
    labels = [
        _line(axes, [(one.max_mm, one.live_rate) for one in planned], OURS, "FBA, live", "-", 2.6),
        _line(axes, rounded, LIVE, "best of deflate, brotli,\nzstd: live", "-", 1.8),
        _line(axes, [(one.own.max_mm, one.file.file_rate) for one in compared], FILE,
              "best of deflate, brotli,\nzstd, xz: a file", "--", 1.4),
    ]  # fmt: skip
    chosen_numbers = [(one.own.max_mm, one.live.live_rate) for one in compared]
    if not set(chosen_numbers) <= set(rounded):
        label = "the same, with what\nFBA chose to send"
        labels.append(_line(axes, chosen_numbers, LIGHT[LIVE], label, "-", 1.4))
    unplanned = [one for one in own if one.method == UNPLANNED]
    for one in unplanned:
        axes.plot(one.max_mm, one.live_rate, "o", markerfacecolor="white", color=OURS, markersize=5)
    rates = [one.live_rate for one in own] + [one.live.live_rate for one in compared]
    rates += [one.file.file_rate for one in compared] + [rate for _, rate in rounded]
    above = 1.25 * max(rate for rate in rates if rate)
    for one in unplanned[:1]:  # it may lie among the lines
        axes.annotate("FBA, live, with nothing known before", (one.max_mm, one.live_rate),
                      xytext=(one.max_mm, above), color=OURS, fontsize=8.5, arrowprops={
                          "arrowstyle": "-", "color": OURS, "linewidth": 0.7, "relpos": (0, 0)})  # fmt: skip
    _scale(axes, kind, [one.max_mm for one in own], [rate for rate in rates if rate])
    for published in published_rates():
        if published.kind == kind and published.short:
            _anchor(axes, published)
    _write_labels(axes, labels)
    axes.set_xlabel(ERROR[kind])
    axes.set_ylabel("kbit/s, without packet headers")
    return _svg(figure)


def draw_bars(group: Sequence[Result], limit: float) -> bytes:
    """Return an SVG of bars: what each way takes live and as a file, with an error of at most `limit` mm."""
    own = best_within(group, limit).own
    rows: list[tuple[str, float | None, float | None]] = [("FBA", own.live_rate, own.file_rate)]
    rivals = rivals_of(together(group), own)
    named = {name: [one for one in rivals if one.method.startswith(name)] for name in BARS}
    rows += [(name, *smallest_rates(same)) for name, same in named.items() if same]
    figure, axes = _pyplot().subplots(figsize=(SIZE[0], 0.46 * len(rows) + 1.5), layout="constrained")
    for number, (name, live, file) in enumerate(rows):
        colour = OURS if name == "FBA" else LIVE
        _bar(axes, number - 0.19, live, colour, "live" if number == 0 else "")
        _bar(axes, number + 0.19, file, LIGHT[colour], "as a file" if number == 0 else "")
    axes.set_yticks(range(len(rows)), [row[0].replace(", meshopt", ",\nmeshopt") for row in rows])
    axes.invert_yaxis()
    error = f"at most {own.max_mm:.2g} mm off" if own.max_mm else "without loss"
    axes.set_xlabel(f"kbit/s, {error}; live, packet headers add {own.header_rate:.0f} kbit/s to each")
    axes.spines[["top", "right"]].set_visible(False)
    axes.margins(x=0.16)
    return _svg(figure)


def _plain_rivals(chosen: Sequence[Result], own: Result) -> list[Result]:
    """Return rivals that send all numbers, rounded as by the quantiser of one of this codec's points."""
    if "quantiser" not in own.point:
        return []
    return [one for one in rivals_of(chosen, own) if one.numbers == ALL]


def _line(
    axes: Any, points: Sequence[tuple[float, float | None]], colour: str, label: str, style: str, width: float
) -> _Label:
    """Draw the points that no other beats in both error and rate."""
    kept: list[tuple[float, float]] = []
    for error, rate in sorted((error, rate) for error, rate in points if rate is not None):
        if not kept or rate < kept[-1][1]:
            kept.append((error, rate))
    x, y = zip(*kept, strict=True)
    axes.plot(x, y, style, color=colour, linewidth=width, marker="o", markersize=3.5)
    return _Label(x[-1], y[-1], label, colour)


def _scale(axes: Any, kind: str, errors: list[float], rates: list[float]) -> None:
    """Set the scales: logarithmic, from 0 on where there is an error of 0; room for labels at the right."""
    errors = errors + [
        one.max_mm for one in published_rates() if one.kind == kind and one.short and one.max_mm
    ]
    largest, exact = max(*errors, 2 * LINEAR), min(errors) == 0
    if exact:
        axes.set_xscale("symlog", linthresh=LINEAR, linscale=0.45)
        axes.set_xlim(-0.25 * LINEAR, 5 * largest)
    else:
        axes.set_xscale("log")
        axes.set_xlim(0.7 * min(errors), 5.5 * largest)
    low = LINEAR if exact else min(errors)
    shown = [tick for tick in TICKS if low <= tick <= 1.2 * largest]
    axes.set_xticks([0.0] * exact + shown, ["0: exact"] * exact + [f"{tick:g}" for tick in shown])
    axes.set_yscale("log")
    axes.set_ylim(0.7 * min(rates), 1.7 * max(rates))
    ticks = [tick for tick in TICKS if 0.7 * min(rates) <= tick <= 1.7 * max(rates)]
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)


def _anchor(axes: Any, one: Published) -> None:
    """Draw a published rate: a point where its error is known, else a line or a band."""
    text = f"{one.short}: {one.low:g}" + (f" to {one.high:g}" if one.high > one.low else "")
    style = {"color": QUIET, "fontsize": 8}
    if one.low > axes.get_ylim()[1]:
        axes.annotate(f"published: {text} \N{UPWARDS ARROW}", (0.99, 0.99), xycoords="axes fraction",
                      ha="right", va="top", **style)  # fmt: skip
    elif one.max_mm:
        axes.plot(one.max_mm, one.low, "D", color=QUIET, markersize=5)
        words = "\n".join(wrap(f"published: {text}, of other data", 34))
        axes.annotate(words, (one.max_mm, one.low), xytext=(0, 10), va="bottom",
                      textcoords="offset points", **style)  # fmt: skip
    else:
        axes.axhspan(one.low, one.high, color=QUIET, alpha=0.12, linewidth=0)
        axes.annotate(f"published, {text}", (0.01, 1.03 * one.low), xycoords=("axes fraction", "data"),
                      va="bottom", **style)  # fmt: skip


def _write_labels(axes: Any, labels: Sequence[_Label]) -> None:
    """Write labels at the ends of lines, moved up or down so that none covers another."""
    low, high = np.log(axes.get_ylim())
    order = sorted(labels, key=lambda one: one.y)
    places = [(np.log(one.y) - low) / (high - low) for one in order]
    needed = [CLOSEST * (1 + ("\n" in one.text)) for one in order]
    for number in range(1, len(order)):
        apart = (needed[number - 1] + needed[number]) / 2
        places[number] = max(places[number], places[number - 1] + apart)
    for one, place in zip(order, places, strict=True):
        axes.annotate(one.text, (one.x, np.exp(low + place * (high - low))), xytext=(8, 0), color=one.colour,
                      textcoords="offset points", va="center", fontsize=9,
                      fontweight="bold" if one.colour == OURS else "normal")  # fmt: skip


def _bar(axes: Any, place: float, value: float | None, colour: str, label: str) -> None:
    if value is None:
        axes.annotate("not live: needs all frames first", (0, place), xytext=(3, 0), color=QUIET, fontsize=8,
                      textcoords="offset points", va="center")  # fmt: skip
        return
    axes.barh(place, value, height=0.36, color=colour)
    text = f"{value:.2f}" + (f"  {label}" if label else "")
    axes.annotate(text, (value, place), xytext=(3, 0), textcoords="offset points", va="center", fontsize=8.5)


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
