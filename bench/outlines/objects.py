"""Nine objects, and their silhouettes from 180 sides each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import reduce

import numpy as np

from fba.arrays import Bool, Float64, Int32
from fba.body import BodyModel
from fba.face import FaceModel
from fba.outlines import Figure, View, draw_silhouette
from fba.parameters import BAP_COUNT, FAP_COUNT

Mesh = tuple[Float64, Int32]
Place = tuple[float, float, float]
ABOVE = [(yaw, pitch) for yaw in range(0, 360, 10) for pitch in range(0, 50, 10)]
"""180 sides around and above, in steps of 10 degrees."""
AROUND = [(yaw, 20) for yaw in range(0, 360, 2)]
"""180 sides around, in steps of 2 degrees, from 20 degrees above."""
ROUND = 24
"""Vertices around a tube."""


@dataclass(frozen=True)
class Seen:
    """A silhouette: of which object, from where, and the step to the next side, degrees."""

    name: str
    yaw: int
    pitch: int
    step: int
    mask: Bool

    def is_beside(self, other: Seen) -> bool:
        """Whether the other is of the same object, from a neighbouring side."""
        turned = abs((self.yaw - other.yaw + 180) % 360 - 180)
        return self.name == other.name and turned <= self.step and abs(self.pitch - other.pitch) <= self.step


def silhouettes(*, around: bool) -> Iterator[Seen]:
    """Yield all silhouettes, object by object. around: from `AROUND`, not from `ABOVE`."""
    step = 2 if around else 10
    for name, make in OBJECTS.items():
        vertices, triangles = make()
        for yaw, pitch in AROUND if around else ABOVE:
            yield Seen(name, yaw, pitch, step, draw_silhouette(vertices, triangles, View(yaw, pitch)))


def grid(rows: list[Float64]) -> Mesh:
    """Return the surface over rings of vertices, closed along each ring."""
    count, around = len(rows), len(rows[0])
    here = np.arange(count * around).reshape(count, around)
    quads = [here[:-1], np.roll(here, -1, axis=1)[:-1], np.roll(here, -1, axis=1)[1:], here[1:]]
    a, b, c, d = (part.ravel() for part in quads)
    triangles = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return np.concatenate(rows), triangles.astype(np.int32)


def tube(start: Place, end: Place, first: float, last: float) -> Mesh:
    """Return a cone or cylinder with closed ends between two places, by its radii there."""
    begin, finish = np.array(start), np.array(end)
    along = (finish - begin) / np.linalg.norm(finish - begin)
    aside = np.cross(along, [0.0, 0.0, 1.0] if abs(along[2]) < 0.9 else [1.0, 0.0, 0.0])
    aside /= np.linalg.norm(aside)
    angles = 2 * np.pi * np.arange(ROUND) / ROUND
    ring = np.outer(np.cos(angles), aside) + np.outer(np.sin(angles), np.cross(along, aside))
    places = ((begin, 0.0), (begin, first), (finish, last), (finish, 0.0))
    return grid([middle + radius * ring for middle, radius in places])


def ball(middle: Place, radii: Place) -> Mesh:
    """Return an ellipsoid."""
    angles = 2 * np.pi * np.arange(ROUND) / ROUND
    rows = []
    for height in np.linspace(-np.pi / 2, np.pi / 2, 13):
        flat = np.cos(height)
        ring = [flat * np.cos(angles), np.full(ROUND, np.sin(height)), flat * np.sin(angles)]
        rows.append(np.column_stack(ring) * radii + middle)
    return grid(rows)


def ring(middle: Place, radius: float, thickness: float) -> Mesh:
    """Return a torus that stands in the plane of x and y."""
    angles = 2 * np.pi * np.arange(ROUND + 1) / ROUND
    around = 2 * np.pi * np.arange(12) / 12
    rows = []
    for angle in angles:
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        circle = np.outer(np.cos(around), out) + np.outer(np.sin(around), [0.0, 0.0, 1.0])
        rows.append(np.array(middle) + radius * out + thickness * circle)
    return grid(rows)


def box(low: Place, high: Place) -> Mesh:
    """Return a box between two corners."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    floor = np.array([[x0, 0, z0], [x1, 0, z0], [x1, 0, z1], [x0, 0, z1]], dtype=np.float64)
    middle = floor.mean(axis=0)
    rows = [middle + 0 * floor, floor, floor, middle + 0 * floor]
    return grid([row + np.array([0, y, 0]) for row, y in zip(rows, (y0, y0, y1, y1), strict=True)])


def join(*parts: Mesh) -> Mesh:
    """Return meshes as one."""

    def add(one: Mesh, other: Mesh) -> Mesh:
        return np.concatenate([one[0], other[0]]), np.concatenate([one[1], other[1] + np.int32(len(one[0]))])

    return reduce(add, parts)


def head() -> Mesh:
    return _figure(None)


def person() -> Mesh:
    return _figure(BodyModel.default())


def _figure(body: BodyModel | None) -> Mesh:
    figure = Figure(FaceModel.default(), body)
    rest = figure.vertices(np.zeros(FAP_COUNT, dtype=np.int32), np.zeros(BAP_COUNT, dtype=np.int32))
    return rest.astype(np.float64), figure.triangles


def aeroplane() -> Mesh:
    return join(
        ball((0, 0, 0), (0.5, 0.5, 3.2)), box((-3.2, -0.1, -0.6), (3.2, 0.05, 0.5)),
        box((-1.1, 0.1, -3.0), (1.1, 0.2, -2.5)), box((-0.06, 0, -3.1), (0.06, 1.2, -2.4)),
        *(tube((x, -0.4, -0.1), (x, -0.4, 1.0), 0.25, 0.25) for x in (-1.3, 1.3)),
    )  # fmt: skip


def mug() -> Mesh:
    return join(tube((0, 0, 0), (0, 2, 0), 0.75, 0.9), ring((1.15, 1.05, 0), 0.5, 0.11))


def chair() -> Mesh:
    legs = [box((x, 0, z), (x + 0.1, 1, z + 0.1)) for x in (-0.5, 0.4) for z in (-0.5, 0.4)]
    return join(*legs, box((-0.5, 1, -0.5), (0.5, 1.1, 0.5)), box((-0.5, 1.1, -0.5), (0.5, 2.3, -0.4)))


def lamp() -> Mesh:
    return join(
        tube((0, 0, 0), (0, 0.15, 0), 0.8, 0.7), tube((0, 0.1, 0), (0.2, 1.5, -0.5), 0.08, 0.08),
        tube((0.2, 1.5, -0.5), (0, 2.6, 0.6), 0.08, 0.08), tube((0, 2.7, 0.5), (0, 2.2, 1.3), 0.15, 0.6),
    )  # fmt: skip


def dog() -> Mesh:
    legs = [tube((x, 0, z), (x, 1.0, z), 0.12, 0.17) for x in (-0.25, 0.25) for z in (-0.8, 0.8)]
    return join(
        *legs, ball((0, 1.15, 0), (0.42, 0.45, 1.2)), tube((0, 1.3, 0.9), (0, 1.9, 1.4), 0.3, 0.2),
        ball((0, 2.0, 1.5), (0.28, 0.28, 0.32)), tube((0, 1.95, 1.6), (0, 1.88, 2.1), 0.17, 0.1),
        tube((0, 1.3, -1.1), (0, 2.0, -1.6), 0.09, 0.04), tube((0.2, 2.1, 1.4), (0.25, 2.5, 1.3), 0.1, 0.03),
        tube((-0.2, 2.1, 1.4), (-0.25, 2.5, 1.3), 0.1, 0.03),
    )  # fmt: skip


def hammer() -> Mesh:
    return join(
        tube((0, 0, 0), (0, 3, 0), 0.16, 0.12), tube((0, 2.9, 0.1), (0, 2.9, 0.8), 0.22, 0.3),
        tube((0, 2.9, 0), (0, 2.7, -0.9), 0.2, 0.04), box((-0.2, 2.75, -0.2), (0.2, 3.1, 0.2)),
    )  # fmt: skip


def teapot() -> Mesh:
    return join(
        ball((0, 0.9, 0), (1.1, 0.85, 1.1)), tube((-0.8, 0.7, 0), (-1.8, 1.6, 0), 0.3, 0.12),
        ring((1.3, 1.0, 0), 0.5, 0.1), ball((0, 1.85, 0), (0.18, 0.18, 0.18)),
        tube((0, 0, 0), (0, 0.2, 0), 0.7, 0.7),
    )  # fmt: skip


OBJECTS: dict[str, Callable[[], Mesh]] = {
    make.__name__: make for make in (head, person, aeroplane, mug, chair, lamp, dog, hammer, teapot)
}
