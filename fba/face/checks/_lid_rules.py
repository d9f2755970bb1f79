"""Checks that closed lids meet and do not cut the eyeball."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fba.arrays import Float64
from fba.face.checks._findings import Finding
from fba.face.checks.posing import Poser

SIDES = {"left": (19, 21), "right": (20, 22)}
"""FAPs of the upper and the lower lid."""
CLOSED = 1024
SPLITS = (1024, 896, 768, 640, 512, 424)
"""Values of the upper lid's FAP that are tried; the lower lid makes the rest of the way to 1024."""
GAP = 0.02
"""The widest gap left, as a share of IRISD0."""
CORNER = 0.04
"""Share of the opening's width at each end that is left out as corner."""
CUT = 0.01
"""Depth that a closed lid may be in the eyeball beyond the open one, as a share of its radius."""
OUTSIDE = 0.97
"""Vertices of the open lid this far out, in radii of the eyeball, must stay outside."""


def check_lids(poser: Poser, side: str) -> Iterator[Finding]:
    """Yields findings about the lids of one side, "left" or "right"."""
    upper, lower = SIDES[side]
    gaps = {split: lid_gap(poser, side, split) for split in SPLITS}
    worst = max(gaps, key=lambda split: gaps[split])
    if not gaps[worst] <= GAP:
        yield Finding(
            f"FAP {upper} and {lower}, {side} lids",
            "lids meet where their values add up to 1024",
            f"a gap of {gaps[worst]:.1%} of IRISD0 at {worst} + {CLOSED - worst}",
            f"under {GAP:.0%}",
        )
    if not poser.eyes[side].measured:
        return
    cuts = {split: lid_cut(poser, side, split) for split in SPLITS}
    worst = max(cuts, key=lambda split: cuts[split])
    if not cuts[worst] <= CUT:
        yield Finding(
            f"FAP {upper} and {lower}, {side} lids",
            "lids do not cut the eyeball",
            f"{cuts[worst]:.1%} of its radius deep at {worst} + {CLOSED - worst}",
            f"at most {CUT:.0%}",
        )


def lid_gap(poser: Poser, side: str, split: float) -> float:
    """The widest distance between the margins of closed lids, as a share of IRISD0; nan without margins."""
    upper, lower = SIDES[side]
    moved = poser.pose({upper: split, lower: CLOSED - split})
    lines = [poser.contour(f"{side} {lid} lid", moved) for lid in ("upper", "lower")]
    if any(len(line) < 3 for line in lines):
        return float("nan")
    # in the very corners the lids are one skin
    ends = sorted((lines[0][0, 0], lines[0][-1, 0]))
    hem = CORNER * (ends[1] - ends[0])
    widest = 0.0
    for line, other in (lines, lines[::-1]):
        between = (line[:, 0] > ends[0] + hem) & (line[:, 0] < ends[1] - hem)
        widest = max(widest, float(_distances_to_line(line[between], other).max(initial=0.0)))
    return widest / (poser.model.fapu.IRISD * 1024)


def lid_cut(poser: Poser, side: str, split: float) -> float:
    """Greatest depth of closed lids in the eyeball beyond the open ones, as a share of its radius."""
    upper, lower = SIDES[side]
    eye = poser.eyes[side]
    surface = poser.marks.surface
    before = surface.vertices
    after = poser.surface(poser.pose({upper: split, lower: CLOSED - split}))
    moving = np.abs(after - before).max(axis=1) > 1e-6
    profile = _EyeballProfile(poser, side)
    # a lid's inner side may run into the eyeball where nobody sees it
    outside = profile.depth(before) < (1 - OUTSIDE) * eye.radius
    triangles = surface.triangles[
        moving[surface.triangles].any(axis=1) & outside[surface.triangles].all(axis=1)
    ]
    deepest = 0.0
    # the middles of edges and triangles dip deeper than their corners
    for shares in ((1, 0, 0), (0.5, 0.5, 0), (0, 0.5, 0.5), (0.5, 0, 0.5), (1 / 3, 1 / 3, 1 / 3)):
        was, now = (np.einsum("fkd,k->fd", place[triangles], shares) for place in (before, after))
        deeper = profile.depth(now) - np.maximum(profile.depth(was), 0.0)
        deepest = max(deepest, float(deeper[now[:, 2] > eye.centre[2]].max(initial=0.0)))
    return deepest / eye.radius


class _EyeballProfile:
    """Distance of the eyeball's surface from its centre at each angle from its gaze."""

    def __init__(self, poser: Poser, side: str) -> None:
        self._eye = poser.eyes[side]
        self._edges = np.radians(np.arange(0, 186, 6.0))
        self._reach = np.full(len(self._edges), self._eye.radius)
        for name in self._eye.parts:
            arms = poser.model.part(name).vertices.astype(np.float64) - self._eye.centre
            angle, reach = self._polar(arms)
            for k, at in enumerate(self._edges):
                near = np.abs(angle - at) <= np.radians(3.0)
                if near.any():
                    self._reach[k] = max(float(np.median(reach[near])), self._eye.radius)

    def depth(self, points: Float64) -> Float64:
        """(N,) metres below the eyeball's surface, negative outside."""
        angle, reach = self._polar(points - self._eye.centre)
        result: Float64 = np.interp(angle, self._edges, self._reach) - reach
        return result

    def _polar(self, arms: Float64) -> tuple[Float64, Float64]:
        reach = np.linalg.norm(arms, axis=1)
        return np.arccos(np.clip(arms @ self._eye.gaze / np.maximum(reach, 1e-12), -1, 1)), reach


def _distances_to_line(points: Float64, line: Float64) -> Float64:
    """(N,) distances of points from a polyline (M, 3)."""
    start, along = line[:-1], np.diff(line, axis=0)
    length = np.maximum((along**2).sum(axis=1), 1e-30)
    share = np.clip(((points[:, None] - start) * along).sum(axis=2) / length, 0.0, 1.0)
    nearest = start + share[:, :, None] * along
    result: Float64 = np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1)
    return result
