"""The shadow on the ground: of shapes for which geometry says where it lies, and how large it is."""

from __future__ import annotations

import numpy as np
import pytest

from fba.compiled import is_compiled
from fba.mesh.simplify import DetailLevels
from fba_player._mesh.primitives import sphere_mesh
from fba_player.gl._ground_shadow import CELL, KEY_SHARE, SKY_SHARE, CastShadow, ShadowCaster
from fba_player.view._view import FaceMesh, FaceShape

pytestmark = pytest.mark.skipif(not is_compiled(), reason="without numba there are blobs instead")
LIGHT = np.array([0.70, 0.68, 0.80]) / np.linalg.norm([0.70, 0.68, 0.80])


def ball(radius: float, centre: tuple[float, float, float]) -> FaceMesh:
    vertices, triangles = sphere_mesh(24, 32)
    corners = vertices[triangles]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    if (outward * corners[:, 0]).sum() < 0:
        triangles = np.ascontiguousarray(triangles[:, ::-1])
    places, count = (vertices * radius).astype(np.float32), len(vertices)
    shape = FaceShape(
        triangles.astype(np.int32),
        np.zeros((count, 4), np.float32),
        np.ones(count, np.float32),
        coarser=DetailLevels(places, 1, triangles.astype(np.int32)),
    )
    matrix = np.eye(4)
    matrix[:3, 3] = centre
    light = np.ones((count, 4), dtype=np.float32)
    return FaceMesh(shape, places, vertices.astype(np.float32), light, matrix, np.zeros(3), np.zeros(3))


def brightness_at(shadow: CastShadow, x: float, z: float) -> float:
    column, row = int((x - shadow.low[0]) / CELL), int((z - shadow.low[1]) / CELL)
    inside = 0 <= row < shadow.darkness.shape[0] and 0 <= column < shadow.darkness.shape[1]
    return float(shadow.darkness[row, column]) / 255 if inside else 0.0


def test_a_shadow_lies_where_the_light_throws_it() -> None:
    height = 1.2
    shadow = ShadowCaster().cast([ball(0.4, (0.0, height, 0.0))], (0.0, 0.0))
    assert shadow is not None
    x, z = (-LIGHT[axis] / LIGHT[1] * height for axis in (0, 2))
    assert brightness_at(shadow, x, z) == pytest.approx(KEY_SHARE, abs=0.12)  # all of the key light is hidden
    assert brightness_at(shadow, -x, -z) < 0.03
    # The ball's section, thrown on the ground, is the longer the lower the light stands.
    covered = (shadow.darkness > shadow.darkness.max() / 2).sum() * CELL**2
    assert covered == pytest.approx(np.pi * 0.4**2 / LIGHT[1], rel=0.2)


def test_what_touches_the_ground_darkens_it_most() -> None:
    low, high = (ShadowCaster().cast([ball(0.3, (0.0, height, 0.0))], (0.0, 0.0)) for height in (0.28, 0.9))
    assert low is not None
    assert high is not None
    assert brightness_at(low, 0.0, 0.0) > brightness_at(high, 0.0, 0.0) + 0.3
    assert low.darkness.max() / 255 <= 1 - (1 - KEY_SHARE) * (1 - SKY_SHARE) + 0.01


def test_a_shadow_is_reproducible_and_nothing_casts_no_shadow() -> None:
    caster = ShadowCaster()
    mesh = ball(0.25, (0.3, 0.7, -0.2))
    first, again = caster.cast([mesh], (0.3, -0.2)), caster.cast([mesh], (0.3, -0.2))
    assert first is not None
    assert again is not None
    np.testing.assert_array_equal(first.darkness, again.darkness)
    assert caster.cast([], (0.0, 0.0)) is None
