"""Silhouettes of meshes, drawn by the processor.

Bounds: `draw_silhouette` checks the triangles against the vertices, and `fill_triangles` cuts every triangle
at the edges of the mask.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64, Floating, Int32, Integer
from fba.compiled import compiled
from fba.errors import ModelError
from fba.outlines._mask import SIDE

DISTANCE = 4.0
"""Distance of the camera from the middle of the figure, in radii of the sphere around it."""
SIDES = ("front", "front left", "left", "back left", "back", "back right", "right", "front right")
"""Sides of a figure at yaws of 0, 45, 90 degrees and so on."""


@dataclass(frozen=True)
class View:
    """The side from which a figure is seen.

    yaw: degrees, 0 from its front, 90 from its left, -90 from its right. pitch: degrees, 90 from above.
    """

    yaw: float = 0.0
    pitch: float = 0.0

    @property
    def side(self) -> str:
        """The nearest of eight sides in words, "front left", and the angle from above where there is one."""
        name = SIDES[round(self.yaw / 45) % 8]
        return f"{name}, {self.pitch:+g} degrees" if self.pitch else name

    @property
    def axes(self) -> Float64:
        """Rows (3, 3): to the right, up and towards the camera, in the figure's axes."""
        yaw, pitch = math.radians(self.yaw), math.radians(self.pitch)
        right = np.array([math.cos(yaw), 0.0, -math.sin(yaw)])
        back = np.array([math.sin(yaw) * math.cos(pitch), math.sin(pitch), math.cos(yaw) * math.cos(pitch)])
        return np.stack([right, np.cross(back, right), back])


def draw_silhouette(vertices: Floating, triangles: Integer, view: View = View(), *, side: int = SIDE) -> Bool:
    """Return the mask (H, W) of a mesh: `side` pixels along its longer side, and a margin of 2 pixels.

    vertices: (V, 3), all of them used; +x its left, +y up, +z forward; any unit. triangles: (F, 3). The
    camera is 4 radii of the mesh from its middle. Raises ModelError for a mesh without triangles, with
    triangles of other vertices, without size, or edge-on.
    """
    whole = vertices.astype(np.float64)
    if not len(triangles) or not np.isfinite(whole).all():
        raise ModelError("a silhouette needs a mesh with triangles, and finite vertices")
    if triangles.min() < 0 or triangles.max() >= len(whole):
        raise ModelError(f"the triangles name vertices beyond the {len(whole)} of the mesh")
    whole -= (whole.min(axis=0) + whole.max(axis=0)) / 2
    radius = math.sqrt(float(np.einsum("vk,vk->v", whole, whole).max()))
    if radius == 0:
        raise ModelError("the mesh has no size: all its vertices coincide")
    seen = whole @ (view.axes.T / radius)
    flat = seen[:, :2] * (DISTANCE / (DISTANCE - seen[:, 2:]))
    low, high = flat.min(axis=0), flat.max(axis=0)
    scale = side / max(float((high - low).max()), 1e-9)
    size = np.maximum((high - low) * scale, 1.0)
    places = (flat - low) * scale
    places[:, 1] = size[1] - places[:, 1]
    mask = np.zeros(np.ceil(size - 1e-6).astype(int)[::-1], dtype=np.bool_)
    fill_triangles(places, np.ascontiguousarray(triangles, dtype=np.int32), mask)
    if not mask.any():
        raise ModelError("the mesh is so thin from this side that nothing of it is seen")
    return np.pad(mask, 2)


@compiled
def fill_triangles(places: Float64, triangles: Int32, mask: Bool) -> None:
    """Set all pixels of a mask (H, W) whose centre lies in a triangle. places: (V, 2), x and y in pixels."""
    height, width = mask.shape
    for number in range(triangles.shape[0]):
        x0, y0 = places[triangles[number, 0], 0], places[triangles[number, 0], 1]
        x1, y1 = places[triangles[number, 1], 0], places[triangles[number, 1], 1]
        x2, y2 = places[triangles[number, 2], 0], places[triangles[number, 2], 1]
        left = max(int(np.ceil(min(x0, x1, x2) - 0.5)), 0)
        right = min(int(np.floor(max(x0, x1, x2) - 0.5)), width - 1)
        top = max(int(np.ceil(min(y0, y1, y2) - 0.5)), 0)
        bottom = min(int(np.floor(max(y0, y1, y2) - 0.5)), height - 1)
        for row in range(top, bottom + 1):
            y = row + 0.5
            for column in range(left, right + 1):
                x = column + 0.5
                a = (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
                b = (x2 - x1) * (y - y1) - (y2 - y1) * (x - x1)
                c = (x0 - x2) * (y - y2) - (y0 - y2) * (x - x2)
                if (a >= 0 and b >= 0 and c >= 0) or (a <= 0 and b <= 0 and c <= 0):
                    mask[row, column] = True
