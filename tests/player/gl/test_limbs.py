"""What an arm takes from a wall behind it: the key light by its shadow, and some of the sky as a limb."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from fba.arrays import Int32
from fba_player._figure.face_light import KEY_DIRECTION
from fba_player._mesh.primitives import sphere_mesh
from fba_player.gl._ground_shadow import GroundShadow, Shade
from fba_player.gl._mesh_renderer import FaceRenderer
from fba_player.view._view import FaceMesh, FaceShape

SIZE = 64
MIDDLE = np.array([0.0, 1.5, 0.0])
"""Of the wall, of 2 m by 2 m, metres."""


def mesh(places: npt.NDArray[np.float64], normals: npt.NDArray[np.float64], triangles: Int32) -> FaceMesh:
    count = len(places)
    colours = np.full((count, 4), 0.5, np.float32)
    shape = FaceShape(triangles, colours, np.ones(count, np.float32), two_sided=True, casts=True)
    points, light = (places + MIDDLE).astype(np.float32), np.ones((count, 4), np.float32)
    return FaceMesh(shape, points, normals.astype(np.float32), light, np.eye(4), np.zeros(3), np.zeros(3))


def wall() -> FaceMesh:
    x, y = np.meshgrid(np.linspace(-1, 1, 41), np.linspace(-1, 1, 41))
    corner = (np.arange(40)[:, None] * 41 + np.arange(40)).ravel()
    triangles = np.concatenate([corner[:, None] + (0, 1, 42), corner[:, None] + (0, 42, 41)]).astype(np.int32)
    places = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    return mesh(places, np.tile([0.0, 0.0, 1.0], (x.size, 1)), triangles)


@pytest.mark.parametrize("finely", [True, False], ids=["for each pixel", "for each vertex"])
def test_an_arm_before_a_wall_takes_its_key_light(context: Any, finely: bool) -> None:
    """An arm of 20 cm stands 35 cm from the wall's middle, on the way to the key light."""
    vertices, triangles = sphere_mesh(24, 32)
    towards = 0.35 * np.array(KEY_DIRECTION) / np.linalg.norm(KEY_DIRECTION)
    shadow = GroundShadow(context)
    pictures = []
    for up in (0.0, 3.0):  # before the wall's middle, and above the wall
        arm = mesh(vertices * (0.4, 0.1, 0.1) + towards + (0.0, up, 0.0), vertices, triangles)
        with_arm = [wall(), arm]
        target = context.simple_framebuffer((8, 8))
        target.use()
        shade = shadow.draw(with_arm, np.zeros((1, 2), np.float32), np.eye(4))
        assert shade is not None
        pictures.append(draw(context, wall(), shade._replace(finely=finely)))
        target.release()
    shadow.close()
    free = draw(context, wall())
    before, above = pictures
    middle = SIZE // 2
    assert before[middle, middle] < 0.7 * free[middle, middle]
    assert before[middle, middle] > 0.1 * free[middle, middle]  # other lights are left
    np.testing.assert_allclose(before[:4], free[:4], atol=2)
    np.testing.assert_allclose(above, free, atol=2)  # nor does the wall shade itself


def test_a_limb_near_a_wall_takes_some_of_its_sky(context: Any) -> None:
    limbs = [np.float32([(aside, height, 0.09, 0.08) for aside in (-0.3, 0.3)]) for height in (1.5, 4.5)]
    near, far = (draw(context, wall()._replace(limbs=each)) for each in limbs)
    none = np.zeros((0, 4), np.float32)  # clothes of bodies, which have limbs, are lit differently
    free, middle = draw(context, wall()._replace(limbs=none)), SIZE // 2
    assert 0.5 * free[middle, middle] < near[middle, middle] < 0.93 * free[middle, middle]
    np.testing.assert_allclose(near[:4], free[:4], atol=2)
    np.testing.assert_allclose(far, free, atol=2)


def draw(context: Any, shown: FaceMesh, shade: Shade | None = None) -> npt.NDArray[np.int64]:
    """Red (SIZE, SIZE), as displayed, of what lies within a metre of the middle, seen from the front."""
    renderer, target = FaceRenderer(context), context.simple_framebuffer((SIZE, SIZE))
    target.use()
    target.clear(0, 0, 0, 1, depth=1.0)
    context.enable_only(context.DEPTH_TEST)
    matrix = np.diag([1.0, 1.0, -0.2, 1.0])
    matrix[:3, 3] = -MIDDLE * (1.0, 1.0, 0.0)
    renderer.begin(MIDDLE + np.array([0.0, 0.0, 3.0]), matrix, 0.01, shade)
    renderer.draw_opaque([shown])
    pixels = np.frombuffer(target.read(components=3), dtype=np.uint8).reshape(SIZE, SIZE, 3)
    renderer.close()
    target.release()
    return pixels[..., 0].astype(np.int64)
