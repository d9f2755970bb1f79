"""The opening of an eye, cut into upright columns in which its lids slide about the eyeball."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.face.authoring.regions._eyes import Eye
from fba.face.authoring.surface.landmarks import Landmarks

LIDS = {19: ("left", "upper"), 20: ("right", "upper"), 21: ("left", "lower"), 22: ("right", "lower")}
CLOSED = 1024
COLUMNS = 65


@dataclass(frozen=True, eq=False)
class Opening:
    """The opening of one eye by columns.

    x: (C,) rising. upper, lower: (C, 2) height and depth of the margins there from the eyeball's centre,
    metres.
    """

    x: Float64
    upper: Float64
    lower: Float64


def measure_opening(marks: Landmarks, eye: Eye) -> Opening | None:
    """Return the columns of an eye's opening, or None where its lids are not one above the other.

    None also if a margin is not on the skin, as when one of its feature points is missing.
    """
    lines = []
    for lid in ("upper", "lower"):
        walk = marks.surface.vertices[marks.contour(f"{eye.side} {lid} lid")]
        if not len(walk):
            return None
        lines.append(walk[np.argsort(walk[:, 0], kind="stable")])
    left = max(line[0, 0] for line in lines)
    right = min(line[-1, 0] for line in lines)
    if not right > left:
        return None
    x = np.linspace(left, right, COLUMNS)
    x = np.unique(
        np.concatenate([x, *(line[(line[:, 0] > left) & (line[:, 0] < right), 0] for line in lines)])
    )
    margins = [
        np.stack([np.interp(x, line[:, 0], line[:, axis] - eye.centre[axis]) for axis in (1, 2)], axis=1)
        for line in lines
    ]
    if not (margins[0][1:-1, 0] > margins[1][1:-1, 0]).mean() > 0.7:
        return None
    return Opening(x, *margins)


def slide_lid(
    points: Float64,
    share: Float64,
    opening: Opening,
    eye: Eye,
    lid: str,
    way: Float64,
    *,
    columns: Float64 | None = None,
) -> Float64:
    """Return (K, N, 3) shifts of points (N, 3), metres, when a lid has moved by shares (K,) of the distance
    to the other.

    share: (N,), share of the margin's motion in each point's column. columns: (N,), x of the columns, where
    they are not the points' own, as of a lash that goes with its root.
    """
    own, other = (opening.upper, opening.lower) if lid == "upper" else (opening.lower, opening.upper)
    column = np.clip(points[:, 0] if columns is None else columns, opening.x[0], opening.x[-1])
    here, there = (
        np.stack([np.interp(column, opening.x, line[:, axis]) for axis in (0, 1)], axis=1)
        for line in (own, other)
    )
    radius, across = np.hypot(*here.T), np.hypot(*there.T)
    height = points[:, 1] - eye.centre[1]
    depth = points[:, 2] - eye.centre[2]
    distance = np.hypot(height, depth)
    # points further out than the margin turn less, so that they move no further than it does
    part = share if columns is not None else share * np.minimum(1.0, radius / np.maximum(distance, 1e-12))
    start = np.arcsin(np.clip(here[:, 0] / np.maximum(radius, 1e-12), -1, 1))
    shifts = np.zeros((len(way), len(points), 3))
    for k, t in enumerate(way):
        goal = here[:, 0] + t * (there[:, 0] - here[:, 0])
        size = radius + np.clip(t, 0, 1) * (across - radius)
        size = np.maximum(size, np.abs(goal) * 1.0001)
        turn = (np.arcsin(goal / np.maximum(size, 1e-12)) - start) * part
        grown = 1 + share * (size / np.maximum(radius, 1e-12) - 1)
        cos, sin = np.cos(turn), np.sin(turn)
        shifts[k, :, 1] = (height * cos + depth * sin) * grown - height
        shifts[k, :, 2] = (depth * cos - height * sin) * grown - depth
    shifts[way == 0] = 0.0
    return shifts
