"""Limbs that keep light from what is behind them: see shaders/face.vert."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from fba_player._figure.face_light import KEY_DIRECTION
from fba_player.gl._mesh_renderer import FaceRenderer
from fba_player.view._view import FaceMesh, FaceShape

SIZE = 64


def test_a_limb_before_a_wall_takes_its_key_light(context: Any) -> None:
    """A forearm of 8 cm stands 25 cm from the wall's middle, on the way to the key light."""
    x, y = np.meshgrid(np.linspace(-1, 1, 41), np.linspace(-1, 1, 41))
    places = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1).astype(np.float32)
    corner = (np.arange(40)[:, None] * 41 + np.arange(40)).ravel()
    triangles = np.concatenate([corner[:, None] + (0, 1, 42), corner[:, None] + (0, 42, 41)]).astype(np.int32)
    count = len(places)
    shape = FaceShape(triangles, np.full((count, 4), 0.5, np.float32), np.ones(count, np.float32))
    normals, light = np.tile(np.float32([0, 0, 1]), (count, 1)), np.ones((count, 4), np.float32)
    wall = FaceMesh(shape, places, normals, light, np.eye(4), np.zeros(3), np.zeros(3))
    arm = 0.25 * np.array(KEY_DIRECTION) / np.linalg.norm(KEY_DIRECTION)
    limbs = np.float32([(arm[0] + aside, arm[1], arm[2], 0.04) for aside in (-0.3, 0.3)])
    free, before, beside = (
        draw(context, wall._replace(limbs=each)) for each in (None, limbs, limbs + np.float32([0, 3, 0, 0]))
    )
    middle = SIZE // 2
    assert before[middle, middle] < 0.7 * free[middle, middle]
    assert before[middle, middle] > 0.1 * free[middle, middle]  # other lights are left
    np.testing.assert_allclose(before[:4], free[:4], atol=2)
    np.testing.assert_allclose(beside, free, atol=2)


def draw(context: Any, mesh: FaceMesh) -> npt.NDArray[np.int64]:
    """Red (SIZE, SIZE), as displayed, of what lies within a metre of the middle, seen from the front."""
    renderer, target = FaceRenderer(context), context.simple_framebuffer((SIZE, SIZE))
    target.use()
    target.clear(0, 0, 0, 1, depth=1.0)
    context.enable_only(context.DEPTH_TEST)
    renderer.begin(np.array([0.0, 0.0, 3.0]), np.diag([1.0, 1.0, -0.2, 1.0]), 0.01)
    renderer.draw([mesh])
    pixels = np.frombuffer(target.read(components=3), dtype=np.uint8).reshape(SIZE, SIZE, 3)
    renderer.close()
    target.release()
    return pixels[..., 0].astype(np.int64)
