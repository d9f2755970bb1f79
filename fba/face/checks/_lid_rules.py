"""Checks that closed lids meet and do not cut into the eyeball."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.face.authoring.regions._eyes import Eye
from fba.face.checks._findings import Finding
from fba.face.checks._posing import Poser

SIDES = {"left": (19, 21), "right": (20, 22)}
"""FAPs of the upper and the lower lid."""
CLOSED = 1024
SPLITS = (1024, 896, 768, 640, 512, 424)
"""Values of the upper lid's FAP that are tried, each with the rest to 1024 for the lower lid."""
MAX_GAP = 0.02
"""Widest gap allowed, as a share of IRISD0."""
CORNER_WIDTH = 0.04
"""Share of the opening's width at each end that is not checked."""
MAX_CUT = 0.01
"""Depth to which a closed lid may cut into the eyeball beyond the open one, as a share of its radius."""
OUTSIDE_RADII = 0.97
"""Only vertices that are at least this many radii from the eyeball's centre on the open lid are checked."""


def check_lids(poser: Poser, side: str) -> Iterator[Finding]:
    """Yield findings about the lids of one side, "left" or "right"."""
    upper, lower = SIDES[side]
    subject = f"FAP {upper} and {lower}, {side} lids"
    gap, split = max((lid_gap(poser, side, split), split) for split in SPLITS)
    if not gap <= MAX_GAP:
        yield Finding(
            subject,
            "lids meet where their values add up to 1024",
            f"a gap of {gap:.1%} of IRISD0 at {split} + {CLOSED - split}",
            f"under {MAX_GAP:.0%}",
        )
    if not poser.eyes[side].measured or poser.eyes[side].flat:
        return
    cut, split = max((lid_cut(poser, side, split), split) for split in SPLITS)
    if not cut <= MAX_CUT:
        yield Finding(
            subject,
            "lids do not cut the eyeball",
            f"{cut:.1%} of its radius deep at {split} + {CLOSED - split}",
            f"at most {MAX_CUT:.0%}",
        )


def lid_gap(poser: Poser, side: str, split: float) -> float:
    """Return the widest distance between the margins of closed lids, as a share of IRISD0; nan without
    margins.

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
    """Return (N,) distances of the vertices of a line (N, 3) from itself, as the other's vertices (M, 3)
    sample it.

    The samples are the line's points at the x of the other's vertices.
    """
    order = np.argsort(line[:, 0], kind="stable")
    x = np.clip(np.sort(other[:, 0]), line[order[0], 0], line[order[-1], 0])
    sampled = np.stack([np.interp(x, line[order, 0], line[order, axis]) for axis in range(3)], axis=1)
    return _distances_to_line(line, sampled)


def lid_cut(poser: Poser, side: str, split: float) -> float:
    """Return the greatest depth of closed lids inside the eyeball beyond that of open ones, as a share of its
    radius."""
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
        angle, distance = _polar(self.eye, points)
        result: Float64 = np.interp(angle, self.angles, self.reach) - distance
        return result


def _measure_profile(poser: Poser, side: str) -> _EyeballProfile:
    eye = poser.eyes[side]
    angles = np.radians(np.arange(0, 186, 6.0))
    reach = np.full(len(angles), eye.radius)
    for name in eye.parts:
        angle, distance = _polar(eye, poser.model.part(name).vertices.astype(np.float64))
        for k in range(len(angles)):
            near = np.abs(angle - angles[k]) <= np.radians(3.0)
            if near.any():
                reach[k] = max(float(np.median(distance[near])), eye.radius)
    return _EyeballProfile(eye, angles, reach)


def _polar(eye: Eye, points: Float64) -> tuple[Float64, Float64]:
    """Return (N,) angle of points (N, 3) from the gaze, radians, and distance from the eyeball's centre."""
    arms = points - eye.centre
    distance = np.linalg.norm(arms, axis=1)
    return np.arccos(np.clip(arms @ eye.gaze / np.maximum(distance, 1e-12), -1, 1)), distance


def _distances_to_line(points: Float64, line: Float64) -> Float64:
    """Return (N,) distances of points from a polyline (M, 3)."""
    start, along = line[:-1], np.diff(line, axis=0)
    length = np.maximum((along**2).sum(axis=1), 1e-30)
    share = np.clip(((points[:, None] - start) * along).sum(axis=2) / length, 0.0, 1.0)
    nearest = start + share[:, :, None] * along
    result: Float64 = np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)
    return result
