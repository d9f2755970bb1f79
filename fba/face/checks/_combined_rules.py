"""Checks of FAPs that act together: lids and lips.

Closed lids meet and do not cut into the eyeball. Lips stay in touch when moved together, and an opening jaw
parts teeth and lips.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.face.authoring.regions._eyes import Eye
from fba.face.checks._findings import Finding
from fba.face.checks._posing import Poser
from fba.face.eyeball import polar
from fba.face.points import OPEN_JAW

SIDES = {"left": (19, 21), "right": (20, 22)}
"""FAPs of the upper and the lower lid."""
CLOSED = 1024
SPLITS = (1024, 896, 768, 640, 512, 424)
"""Values of the upper lid's FAP that are tried, each with the rest to 1024 for the lower lid."""
MAX_LID_GAP = 0.02
"""Widest gap allowed, as a share of IRISD0."""
CORNER_WIDTH = 0.04
"""Share of the opening's width at each end that is not checked."""
MAX_CUT = 0.01
"""Depth to which a closed lid may cut into the eyeball beyond the open one, as a share of its radius."""
OUTSIDE_RADII = 0.97
"""Only vertices that are at least this many radii from the eyeball's centre on the open lid are checked."""
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


def check_lids(poser: Poser, side: str) -> Iterator[Finding]:
    """Yield findings about the lids of one side, "left" or "right"."""
    upper, lower = SIDES[side]
    subject = f"FAP {upper} and {lower}, {side} lids"
    gap, split = max((lid_gap(poser, side, split), split) for split in SPLITS)
    if not gap <= MAX_LID_GAP:
        found = f"a gap of {gap:.1%} of IRISD0 at {split} + {CLOSED - split}"
        expected = f"under {MAX_LID_GAP:.0%}"
        yield Finding(subject, "lids meet where their values add up to 1024", found, expected)
    if not poser.eyes[side].measured or poser.eyes[side].flat:
        return
    cut, split = max((lid_cut(poser, side, split), split) for split in SPLITS)
    if not cut <= MAX_CUT:
        found = f"{cut:.1%} of its radius deep at {split} + {CLOSED - split}"
        yield Finding(subject, "lids do not cut the eyeball", found, f"at most {MAX_CUT:.0%}")


def lid_gap(poser: Poser, side: str, split: float) -> float:
    """Return the widest gap between closed lids, as a share of IRISD0; nan without margins.

    What margins of few edges cannot avoid is not counted: where one has a corner between two vertices of the
    other, the other's edge cuts it off.
    """
    upper, lower = SIDES[side]
    moved = poser.pose({upper: split, lower: CLOSED - split})
    lines = [poser.contour(f"{side} {lid} lid", moved) for lid in ("upper", "lower")]
    if any(len(line) < 3 for line in lines):
        return float("nan")
    # At the corners the lids are one skin.
    ends = sorted((lines[0][0, 0], lines[0][-1, 0]))
    margin = CORNER_WIDTH * (ends[1] - ends[0])
    widest = 0.0
    for line, other in (lines, lines[::-1]):
        between = (line[:, 0] > ends[0] + margin) & (line[:, 0] < ends[1] - margin)
        distances = _distances_to_line(line, other) - _cut_corners(line, other)
        widest = max(widest, float(distances[between].max(initial=0.0)))
    return widest / (poser.model.fapu.IRISD * 1024)


def _cut_corners(line: Float64, other: Float64) -> Float64:
    """Return (N,) distances of a line (N, 3) from itself, sampled at the x of the other's vertices."""
    order = np.argsort(line[:, 0], kind="stable")
    x = np.clip(np.sort(other[:, 0]), line[order[0], 0], line[order[-1], 0])
    sampled = np.stack([np.interp(x, line[order, 0], line[order, axis]) for axis in range(3)], axis=1)
    return _distances_to_line(line, sampled)


def lid_cut(poser: Poser, side: str, split: float) -> float:
    """Return how much deeper closed lids cut the eyeball than open ones, as a share of its radius."""
    upper, lower = SIDES[side]
    eye = poser.eyes[side]
    surface = poser.marks.surface
    before = surface.vertices
    after = poser.surface(poser.pose({upper: split, lower: CLOSED - split}))
    moving = np.abs(after - before).max(axis=1) > 1e-6
    profile = _measure_profile(poser, side)
    # The inner side of a lid may run into the eyeball where it cannot be seen.
    outside = profile.depth(before) < (1 - OUTSIDE_RADII) * eye.radius
    triangles = surface.triangles[
        moving[surface.triangles].any(axis=1) & outside[surface.triangles].all(axis=1)
    ]
    deepest = 0.0
    # Midpoints of edges and triangles are deeper inside than their corners.
    for shares in ((1, 0, 0), (0.5, 0.5, 0), (0, 0.5, 0.5), (0.5, 0, 0.5), (1 / 3, 1 / 3, 1 / 3)):
        was, now = (np.einsum("fkd,k->fd", vertices[triangles], shares) for vertices in (before, after))
        deeper = profile.depth(now) - np.maximum(profile.depth(was), 0.0)
        deepest = max(deepest, float(deeper[now[:, 2] > eye.centre[2]].max(initial=0.0)))
    return deepest / eye.radius


@dataclass(frozen=True, eq=False)
class _EyeballProfile:
    """Distance of the eyeball's surface from its centre, `reach`, at each of the `angles` from its gaze."""

    eye: Eye
    angles: Float64
    reach: Float64

    def depth(self, points: Float64) -> Float64:
        """Return (N,) metres below the eyeball's surface, negative outside."""
        angle, distance = polar(points, self.eye.centre, self.eye.gaze)
        return np.interp(angle, self.angles, self.reach) - distance


def _measure_profile(poser: Poser, side: str) -> _EyeballProfile:
    eye = poser.eyes[side]
    angles = np.radians(np.arange(0, 186, 6.0))
    reach = np.full(len(angles), eye.radius)
    for name in eye.parts:
        angle, distance = polar(poser.model.part(name).vertices.astype(np.float64), eye.centre, eye.gaze)
        for k in range(len(angles)):
            near = np.abs(angle - angles[k]) <= np.radians(3.0)
            if near.any():
                reach[k] = max(float(np.median(distance[near])), eye.radius)
    return _EyeballProfile(eye, angles, reach)


def _distances_to_line(points: Float64, line: Float64) -> Float64:
    """Return (N,) distances of points from a polyline (M, 3)."""
    start, along = line[:-1], np.diff(line, axis=0)
    length = np.maximum((along**2).sum(axis=1), 1e-30)
    share = np.clip(((points[:, None] - start) * along).sum(axis=2) / length, 0.0, 1.0)
    nearest = start + share[:, :, None] * along
    return np.asarray(np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1))


def check_mouth(poser: Poser) -> Iterator[Finding]:
    """Yield findings about lips, teeth and tongue."""
    present = set(poser.model.table_of)
    if all(fap in present for pair in PAIRS for fap in pair):
        yield from _check_touching_lips(poser)
    if OPEN_JAW in present and poser.has("2.1"):
        yield from _check_jaw_opening(poser)


def lip_gap(poser: Poser, value: float) -> float:
    """Return how much the gap between lips that move down together widens, as a share of MNS0."""
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
            rule = "lips stay in touch where top and bottom add up to 0"
            found = f"{gap:.1%} of MNS0 further apart at {value:g} and {-value:g}"
            yield Finding("FAPs 4, 5 and 8-11, inner lips", rule, found, f"under {MAX_GAP:.0%}")


def _lip_distances(poser: Poser, moved: Float64) -> Float64:
    """Return (C,) gap between the lips along the middle three quarters of the mouth, metres."""
    upper, lower = (poser.contour(f"{name} inner lip", moved) for name in ("upper", "lower"))
    if len(upper) < 3 or len(lower) < 3:
        return np.zeros(0)
    x = np.linspace(upper[0, 0], upper[-1, 0], 41)[5:-5]
    heights = [np.interp(x, *line[np.argsort(line[:, 0])].T[:2]) for line in (upper, lower)]
    return heights[0] - heights[1]


def _check_jaw_opening(poser: Poser) -> Iterator[Finding]:
    moved = poser.pose({OPEN_JAW: OPEN_VALUE})
    shift = moved - poser.neutral
    chin = float(np.linalg.norm(shift[poser.vertex("2.1")]))
    label = f"FAP {OPEN_JAW} open_jaw"
    for name in ("2.2", "2.3", "2.4", "2.5", "8.1", "8.2", "9.8", "9.10"):
        if poser.has(name):
            way = float(np.linalg.norm(shift[poser.vertex(name)]))
            if way > MAX_UNWANTED_MOTION * chin:
                found, expected = f"{way / chin:.1%} of the chin's way", f"under {MAX_UNWANTED_MOTION:.0%}"
                yield Finding(label, f"{name} stays", found, expected)
    for name in ("9.9", "9.11", "6.1", "6.2"):
        if poser.has(name):
            way = float(shift[poser.vertex(name)][1])
            if way > -0.5 * OPEN_VALUE * poser.model.fapu.MNS:
                expected = f"below {-500 * OPEN_VALUE * poser.model.fapu.MNS:.2f} mm"
                yield Finding(label, f"{name} sinks with the jaw", f"{way * 1000:.2f} mm", expected)
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
            found, expected = f"lips {wide.min() * 1000:.2f} mm apart", "more than at rest"
            yield Finding(label, "an opened mouth is open", found, expected)
