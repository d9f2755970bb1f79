"""Checks that lips stay in touch when moved together, and that an opening jaw parts teeth and lips."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fba.arrays import Float64
from fba.face.checks._findings import Finding
from fba.face.checks._posing import Poser
from fba.face.points import OPEN_JAW

PAIRS = ((4, 5), (8, 10), (9, 11))
"""Inner lip FAPs, each upper one with the lower one below it."""
OUTER_PAIRS = ((51, 52), (55, 57), (56, 58))
TESTED_VALUE = 150.0
"""Value by which both lips are moved together, up and down."""
MAX_GAP = 0.06
"""How much the gap between lips that move together may widen, as a share of MNS0."""
OPEN_VALUE = 400.0
"""Value of open_jaw at which the mouth is checked."""
MAX_UNWANTED_MOTION = 0.03
"""Share of the chin's motion by which points may move that should stay."""


def check_mouth(poser: Poser) -> Iterator[Finding]:
    """Yield findings about lips, teeth and tongue."""
    present = set(poser.model.table_of)
    if all(fap in present for pair in PAIRS for fap in pair):
        yield from _check_touching_lips(poser)
    if OPEN_JAW in present and poser.has("2.1"):
        yield from _check_jaw_opening(poser)


def lip_gap(poser: Poser, value: float) -> float:
    """Return the widening of the gap between lips that all move down by the same value, as a share of
    MNS0."""
    pairs = [*PAIRS, *(pair for pair in OUTER_PAIRS if set(pair) <= set(poser.model.table_of))]
    values = {fap: sign * value for pair in pairs for fap, sign in zip(pair, (1, -1), strict=True)}
    now, before = (_lip_distances(poser, vertices) for vertices in (poser.pose(values), poser.neutral))
    if not len(now):
        return float("nan")
    return float(np.abs(now - before).max() / (poser.model.fapu.MNS * 1024))


def _check_touching_lips(poser: Poser) -> Iterator[Finding]:
    for value in (TESTED_VALUE, -TESTED_VALUE):
        gap = lip_gap(poser, value)
        if gap > MAX_GAP:
            yield Finding(
                "FAPs 4, 5 and 8-11, inner lips",
                "lips stay in touch where top and bottom add up to 0",
                f"{gap:.1%} of MNS0 further apart at {value:g} and {-value:g}",
                f"under {MAX_GAP:.0%}",
            )


def _lip_distances(poser: Poser, moved: Float64) -> Float64:
    """Return (C,) gap between the lips along the middle three quarters of the mouth, metres."""
    upper, lower = (poser.contour(f"{name} inner lip", moved) for name in ("upper", "lower"))
    if len(upper) < 3 or len(lower) < 3:
        return np.zeros(0)
    x = np.linspace(upper[0, 0], upper[-1, 0], 41)[5:-5]
    heights = [np.interp(x, *line[np.argsort(line[:, 0])].T[:2]) for line in (upper, lower)]
    result: Float64 = heights[0] - heights[1]
    return result


def _check_jaw_opening(poser: Poser) -> Iterator[Finding]:
    moved = poser.pose({OPEN_JAW: OPEN_VALUE})
    shift = moved - poser.neutral
    chin = float(np.linalg.norm(shift[poser.vertex("2.1")]))
    label = f"FAP {OPEN_JAW} open_jaw"
    for name in ("2.2", "2.3", "2.4", "2.5", "8.1", "8.2", "9.8", "9.10"):
        if poser.has(name):
            way = float(np.linalg.norm(shift[poser.vertex(name)]))
            if way > MAX_UNWANTED_MOTION * chin:
                yield Finding(
                    label,
                    f"{name} stays",
                    f"{way / chin:.1%} of the chin's way",
                    f"under {MAX_UNWANTED_MOTION:.0%}",
                )
    for name in ("9.9", "9.11", "6.1", "6.2"):
        if poser.has(name):
            way = float(shift[poser.vertex(name)][1])
            if way > -0.5 * OPEN_VALUE * poser.model.fapu.MNS:
                yield Finding(
                    label,
                    f"{name} sinks with the jaw",
                    f"{way * 1000:.2f} mm",
                    f"below {-500 * OPEN_VALUE * poser.model.fapu.MNS:.2f} mm",
                )
    if poser.has("9.10", "9.11"):
        gap = moved[poser.vertex("9.10"), 1] - moved[poser.vertex("9.11"), 1]
        was = poser.neutral[poser.vertex("9.10"), 1] - poser.neutral[poser.vertex("9.11"), 1]
        if gap - was < 0.5 * OPEN_VALUE * poser.model.fapu.MNS:
            yield Finding(
                label, "teeth part", f"{(gap - was) * 1000:.2f} mm", "at least half of the chin's way"
            )
    lips: dict[int, float] = {
        fap: -OPEN_VALUE for fap in (5, 10, 11, 52, 57, 58) if fap in poser.model.table_of
    }
    if {5, 10, 11} <= set(lips):
        wide = _lip_distances(poser, poser.pose(lips | {OPEN_JAW: OPEN_VALUE}))
        rest = _lip_distances(poser, poser.neutral)
        if len(wide) and (wide - rest).min() <= 0:
            yield Finding(
                label,
                "an opened mouth is open",
                f"lips {wide.min() * 1000:.2f} mm apart",
                "more than at rest",
            )
