"""What light reaches which vertex: against shapes whose shadows are known."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from fba.compiled import is_compiled
from fba.mesh._meshes import vertex_normals
from fba_player._figure.occlusion import Visibility, bake, harmonics, weights
from fba_player._mesh.primitives import sphere_mesh

compiled = pytest.mark.skipif(not is_compiled(), reason="without numba everything counts as free")
Float32 = npt.NDArray[np.float32]
UP, DOWN, ASIDE = (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (1.0, 0.0, 0.0)


def joined(*shapes: tuple[Float32, npt.NDArray[np.int32]]) -> tuple[Float32, npt.NDArray[np.int32]]:
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in shapes)])
    triangles = [triangles + start for (_, triangles), start in zip(shapes, starts, strict=False)]
    return (
        np.concatenate([vertices for vertices, _ in shapes]).astype(np.float32),
        np.concatenate(triangles).astype(np.int32),
    )


def ball(radius: float, centre: tuple[float, float, float]) -> tuple[Float32, npt.NDArray[np.int32]]:
    vertices, triangles = sphere_mesh(24, 32)
    volume = np.einsum("ij,ij->", *(np.cross(vertices[triangles[:, 0]], vertices[triangles[:, 1]]),
                                    vertices[triangles[:, 2]]))  # fmt: skip
    return vertices * radius + np.array(centre, dtype=np.float32), triangles if volume > 0 else triangles[
        :, ::-1
    ]


def floor(size: float, count: int = 31) -> tuple[Float32, npt.NDArray[np.int32]]:
    """A square on y = 0, seen from above."""
    x, z = np.meshgrid(np.linspace(-size, size, count), np.linspace(-size, size, count))
    corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    triangles = [(corner, corner + count, corner + 1), (corner + 1, corner + count, corner + count + 1)]
    vertices = np.stack([x.ravel(), np.zeros(count * count), z.ravel()], axis=1)
    return vertices.astype(np.float32), np.concatenate([np.stack(t, axis=1) for t in triangles]).astype(
        np.int32
    )


def baked(vertices: Float32, triangles: npt.NDArray[np.int32]) -> Visibility:
    return bake(vertices, vertex_normals(vertices, triangles), triangles)


def test_harmonics_are_orthonormal() -> None:
    random = np.random.default_rng(1)
    directions = random.standard_normal((200_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    basis = harmonics(directions)
    products = basis.T @ basis * (4 * np.pi / len(basis))
    np.testing.assert_allclose(products, np.eye(16), atol=0.03)


def light_from(
    direction: tuple[float, float, float], found: Visibility
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Light from a direction at each vertex, and light through the skin: float32 (V,), 0..1."""
    basis = weights(np.array([direction]))[0].astype(np.float32)
    return np.clip(found.light @ basis, 0, 1), np.clip(found.through @ basis, 0, 1)


@compiled
def test_nothing_hides_a_ball_from_the_light() -> None:
    vertices, triangles = ball(0.1, (0, 0, 0))
    found = baked(vertices, triangles)
    np.testing.assert_allclose(found.open, 1.0, atol=0.02)
    light, _ = light_from(UP, found)
    assert light[vertices[:, 1] > 0].min() > 0.85


@compiled
def test_a_ball_shades_the_floor_below_it() -> None:
    radius, height = 0.05, 0.12
    vertices, triangles = joined(floor(0.15), ball(radius, (0, height, 0)))
    found = baked(vertices, triangles)
    flat = np.abs(vertices[:, 1]) < 1e-6
    away = np.hypot(vertices[:, 0], vertices[:, 2])
    below, far = flat & (away < 0.02), flat & (away > 0.13)
    # The ball fills a cone of sine r / h: this share of the light, weighted by the cosine, is lost.
    np.testing.assert_allclose(found.open[below].mean(), 1 - (radius / height) ** 2, atol=0.06)
    assert found.open[far].min() > 0.9
    light, _ = light_from(UP, found)
    assert light[below].max() < 0.75  # a light of some 40 degrees reaches round it
    assert light[far].min() > 0.85
    slanted, _ = light_from((0.7071, 0.7071, 0.0), found)  # the shadow lies at x = -height
    shaded = flat & (np.hypot(vertices[:, 0] + height, vertices[:, 2]) < 0.02)
    assert slanted[shaded].mean() < light[shaded].mean() - 0.07


@compiled
def test_thin_lets_more_light_through_than_thick() -> None:
    through = []
    for thick in (0.002, 0.02):
        vertices, triangles = joined(floor(0.05), (floor(0.05)[0] - (0, thick, 0), floor(0.05)[1][:, ::-1]))
        found = baked(vertices, triangles)
        middle = (np.abs(vertices) < 0.02)[:, [0, 2]].all(axis=1) & (vertices[:, 1] < -thick / 2)
        through.append(float(light_from(UP, found)[1][middle].mean()))
    assert through[0] > 0.3
    assert through[1] < 0.1


@compiled
def test_what_is_worked_out_coarsely_counts_as_free() -> None:
    vertices, triangles = joined(floor(0.15), ball(0.05, (0, 0.12, 0)))
    only_ball = vertices[:, 1] > 0.01
    found = bake(vertices, vertex_normals(vertices, triangles), triangles, only_ball)
    flat = np.abs(vertices[:, 1]) < 1e-6
    np.testing.assert_allclose(found.open[flat], 1.0, atol=1e-3)


def test_a_mesh_without_vertices_is_baked() -> None:
    found = bake(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))
    assert found.open.shape == (0,)
