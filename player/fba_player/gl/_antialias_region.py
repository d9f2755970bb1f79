"""The regions of a picture in which a view may leave jagged edges; the rest need not be smoothed."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from fba.arrays import Float32, Float64, Floating
from fba.compiled import is_compiled
from fba_player.gl._silhouette import Outliner
from fba_player.view._geometry import transform, turn_partly
from fba_player.view._view import FaceMesh, View

MARGIN_SHARE = 0.03
"""Margin on every side, as a share of a rectangle's size."""
MIN_DEPTH = 1e-3
"""Metres in front of the camera; a corner that is nearer gives the whole picture."""
VERTICES_A_ROW = 64
"""Vertices in a row of numbers: NumPy finds extremes of long rows faster than of short ones."""
MAX_STILL_SWAY = 0.3
"""Vertices that turn with the head by less than this get a box of their own: shoulders are wide and low."""


Rectangle = tuple[int, int, int, int]


@dataclass(frozen=True, eq=False)
class Steps:
    """The regions of a picture to be smoothed.

    rectangles: left, bottom, width and height in pixels. tiles: float32 (N, 2), middles of squares of `TILE`
    pixels, -1..1 across the picture.
    """

    rectangles: list[Rectangle]
    tiles: Float32


def find_steps(view: View, matrix: Float64, size: tuple[int, int], outliner: Outliner) -> Steps:
    """Return the regions along the outlines of faces, and the rectangles that contain everything else.

    matrix: (4, 4), world to clip space. size: of the picture in pixels.
    """
    if not is_compiled():
        return Steps(bounding_rectangles(view, matrix, size), np.zeros((0, 2), dtype=np.float32))
    outliner.begin(size)
    for face in view.faces:
        outliner.add(face, matrix)
    rest = bounding_rectangles(replace(view, faces=[]), matrix, size)
    return Steps(rest, outliner.tiles())


def bounding_rectangles(view: View, matrix: Float64, size: tuple[int, int]) -> list[Rectangle]:
    """Return the rectangles in pixels that together contain all that is drawn; none lies within another.

    matrix: (4, 4), world to clip space.
    """
    boxes = [transform(_corners(mesh.positions), mesh.matrix) for mesh in view.meshes]
    boxes += [box for face in view.faces for box in _face_boxes(face)]
    for round_ in (view.capsules, view.marks):
        if len(round_):
            reach = float(round_[:, [3, 7]].max())
            ends = np.concatenate([round_[:, 0:3], round_[:, 4:7]])
            boxes.append(_box(ends.min(axis=0) - reach, ends.max(axis=0) + reach))
    rectangles: list[Rectangle] = []
    for rectangle in sorted({_rectangle(box, matrix, size) for box in boxes if len(box)}, key=_area):
        rectangles = [other for other in rectangles if not _within(other, rectangle)]
        if _area(rectangle):
            rectangles.append(rectangle)
    return rectangles


def _face_boxes(face: FaceMesh) -> list[Float64]:
    if not np.any(face.turn):
        return [transform(_corners(face.positions), face.matrix)]
    still = face.shape.sway < MAX_STILL_SWAY
    boxes = []
    for box in (_corners(face.positions[still]), _corners(face.positions[~still])):
        turned = turn_partly(box, np.ones(len(box)), face.turn, face.centre)
        both = np.concatenate([box, turned])  # the neck bends between them
        boxes.append(transform(both, face.matrix))
    return boxes


def _rectangle(points: Float64, matrix: Float64, size: tuple[int, int]) -> Rectangle:
    """Return the part of a picture with points (N, 3) and a margin; all of it if one is behind the camera."""
    clip = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    if not np.isfinite(clip).all() or (clip[:, 3] < MIN_DEPTH).any():
        return (0, 0, *size)
    flat = clip[:, :2] / clip[:, 3:]
    low, high = flat.min(axis=0), flat.max(axis=0)
    grown = MARGIN_SHARE * (high - low) + 4 / np.array(size)
    pixels = (np.stack([low - grown, high + grown]) * 0.5 + 0.5) * size
    left, bottom = np.clip(np.floor(pixels[0]), 0, size).astype(int)
    right, top = np.clip(np.ceil(pixels[1]), 0, size).astype(int)
    return int(left), int(bottom), int(right - left), int(top - bottom)


def _area(rectangle: Rectangle) -> int:
    return rectangle[2] * rectangle[3]


def _within(one: Rectangle, other: Rectangle) -> bool:
    begins = one[0] >= other[0] and one[1] >= other[1]
    return begins and one[0] + one[2] <= other[0] + other[2] and one[1] + one[3] <= other[1] + other[3]


def _corners(positions: Float32) -> Float64:
    if not len(positions):
        return np.zeros((0, 3))
    inner = len(positions) // VERTICES_A_ROW * VERTICES_A_ROW
    rows = (
        positions[:inner].reshape(-1, 3 * VERTICES_A_ROW)
        if inner
        else positions[:1].repeat(VERTICES_A_ROW, 0).reshape(1, -1)
    )
    low = np.concatenate([rows.min(axis=0).reshape(-1, 3), positions[inner:]])
    high = np.concatenate([rows.max(axis=0).reshape(-1, 3), positions[inner:]])
    return _box(low.min(axis=0), high.max(axis=0))


def _box(low: Floating, high: Floating) -> Float64:
    return np.array(list(itertools.product(*zip(low, high, strict=True))), dtype=np.float64)
