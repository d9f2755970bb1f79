"""Moves, tints and joins views, to show several performances in one picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fba.arrays import Float32, Float64
from fba_player.view._geometry import translation
from fba_player.view._view import Dots, Extras, Lines, MeshShape, View, srgb

JOINT = 1e-3
"""Capsules shorter than this (m) are joints, not bones."""
BONE_WIDTH = 2.6
"""Width of bones drawn as lines, pixels in a picture 720 high."""
BONE_LIFT = 0.3
"""Depth (m) through which bones show."""
LINE_LIFT = 0.02
"""Depth (m) by which another face may hide the lines of a face."""


def move_view(view: View, offset: Float64) -> View:
    """Return the view with everything moved by offset (3,), metres."""
    if not offset.any():
        return view
    shift = translation(offset)
    # Parts with one matrix keep one: renderers set it once.
    matrices = {id(mesh.matrix): shift @ mesh.matrix for mesh in view.faces}
    flat = np.array([offset[0], offset[2], 0.0, 0.0], dtype=np.float32)
    return replace(
        view,
        meshes=[replace(mesh, matrix=shift @ mesh.matrix) for mesh in view.meshes],
        faces=[mesh._replace(matrix=matrices[id(mesh.matrix)]) for mesh in view.faces],
        eyes=[eye._replace(matrix=shift @ eye.matrix) for eye in view.eyes],
        capsules=_move_capsules(view.capsules, offset),
        marks=_move_capsules(view.marks, offset),
        blobs=view.blobs + flat if len(view.blobs) else view.blobs,
        extras=None if view.extras is None else _move_extras(view.extras, offset),
    )


def join_views(views: Sequence[View]) -> View:
    """Return one view of everything in all views, with the background, grid and legend of the first."""
    first = views[0]
    return replace(
        first,
        meshes=[mesh for view in views for mesh in view.meshes],
        faces=[mesh for view in views for mesh in view.faces],
        eyes=[eye for view in views for eye in view.eyes],
        capsules=np.concatenate([view.capsules for view in views]),
        marks=np.concatenate([view.marks for view in views]),
        blobs=np.concatenate([view.blobs for view in views]),
        ground=any(view.ground for view in views),
        extras=_join_extras([view.extras for view in views if view.extras is not None]),
    )


def _join_extras(extras: Sequence[Extras]) -> Extras | None:
    if not extras:
        return None
    return replace(
        extras[0],
        lines=tuple(lines for part in extras for lines in part.lines),
        dots=tuple(dots for part in extras for dots in part.dots),
        shells=tuple(shell for part in extras for shell in part.shells),
    )


class Drawing:
    """Turns a view of feature points and bones into a drawing in one colour, to lie over another figure.

    colour: sRGB, "#rrggbb". Tinted shapes are cached for the renderer.
    """

    def __init__(self, colour: str) -> None:
        self._colour = srgb(colour)
        red, green, blue = (value / 255 for value in bytes.fromhex(colour[1:]))
        self._ink = (red, green, blue, 0.95)  # of lines, as displayed
        self._shapes: dict[int, tuple[MeshShape, MeshShape]] = {}

    def __call__(self, view: View, eyeballs: int) -> View:
        """Return the drawing of a view. eyeballs: number of capsules to leave out, the first ones."""
        bones = view.capsules[eyeballs:]
        ends = np.stack([bones[:, 0:3], bones[:, 4:7]], axis=1)
        long = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) > JOINT
        lines = Lines(ends[long], self._ink, BONE_WIDTH, BONE_LIFT)
        return View(
            meshes=[replace(mesh, shape=self._tint(mesh.shape)) for mesh in view.meshes],
            marks=self._paint(view.marks),
            blobs=view.blobs,
            ground=view.ground,
            extras=Extras(lines=(lines,)) if long.any() else None,
        )

    def _tint(self, shape: MeshShape) -> MeshShape:
        if id(shape) not in self._shapes:
            colours = np.empty_like(shape.colours)
            colours[:] = (*self._colour, 0.0)
            tinted = replace(shape, colours=colours, raised=max(shape.raised, LINE_LIFT))
            self._shapes[id(shape)] = (shape, tinted)
        return self._shapes[id(shape)][1]

    def _paint(self, capsules: Float32) -> Float32:
        painted = capsules.copy()
        painted[:, 12:15] = self._colour
        return painted


def make_captions(texts: tuple[str, ...], positions: Float64) -> Dots:
    """Return labels at points (N, 3)."""
    points = positions.astype(np.float32)
    return Dots(points, (1.0, 1.0, 1.0, 1.0), 0.0, 1.0, texts, np.zeros_like(points))


def _move_capsules(capsules: Float32, offset: Float64) -> Float32:
    if not len(capsules):
        return capsules
    shifted = capsules.copy()
    shifted[:, 0:3] += offset.astype(np.float32)
    shifted[:, 4:7] += offset.astype(np.float32)
    return shifted


def _move_extras(extras: Extras, offset: Float64) -> Extras:
    shift, by = translation(offset), offset.astype(np.float32)
    grid = extras.grid
    if grid is not None:
        centre = (grid.centre[0] + float(offset[0]), grid.centre[1] + float(offset[2]))
        grid = replace(grid, height=grid.height + float(offset[1]), centre=centre)
    return replace(
        extras,
        lines=tuple(replace(lines, ends=np.asarray(lines.ends + by)) for lines in extras.lines),
        dots=tuple(replace(dots, positions=dots.positions + by) for dots in extras.dots),
        shells=tuple(mesh._replace(matrix=shift @ mesh.matrix) for mesh in extras.shells),
        grid=grid,
    )
