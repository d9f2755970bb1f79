"""The shadow on the ground: of shapes for which geometry says where it lies, and how large it is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fba_player._mesh.primitives import sphere_mesh
from fba_player.gl._ground_shadow import CELLS, GroundShadow, _ground_around
from fba_player.view._view import FaceMesh, FaceShape

KEY_SHARE, SKY_SHARE = 0.62, 0.85
"""As in shaders/shaded.frag."""
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
        casts=True,
    )
    matrix = np.eye(4)
    matrix[:3, 3] = centre
    light = np.ones((count, 4), dtype=np.float32)
    return FaceMesh(shape, places, vertices.astype(np.float32), light, matrix, np.zeros(3), np.zeros(3))


class Ground:
    """The darkness, 0..1, that meshes bring to the ground around the origin."""

    def __init__(self, context: Any, *meshes: FaceMesh) -> None:
        places = np.zeros((1, 2), dtype=np.float32)
        self.low, self.width = _ground_around(places)
        shadow = GroundShadow(context)
        self.darkness = shadow.darkness(list(meshes), places) / 255
        shadow.close()

    def at(self, x: float, z: float) -> float:
        column, row = (int((at - low) / self.width * CELLS) for at, low in zip((x, z), self.low, strict=True))
        return float(self.darkness[row, column]) if 0 <= row < CELLS and 0 <= column < CELLS else 0.0


def test_a_shadow_lies_where_the_light_throws_it(context: Any) -> None:
    height = 1.2
    ground = Ground(context, ball(0.4, (0.0, height, 0.0)))
    x, z = (-LIGHT[axis] / LIGHT[1] * height for axis in (0, 2))
    assert ground.at(x, z) == pytest.approx(KEY_SHARE, abs=0.1)  # all of the key light is hidden
    assert ground.at(-x, -z) < 0.03
    # The ball's section, thrown on the ground, is the longer the lower the light stands.
    covered = (ground.darkness > KEY_SHARE / 2).sum() * (ground.width / CELLS) ** 2
    assert covered == pytest.approx(np.pi * 0.4**2 / LIGHT[1], rel=0.2)


def test_what_touches_the_ground_darkens_it_most_and_sharply(context: Any) -> None:
    low, high = (Ground(context, ball(0.3, (0.0, height, 0.0))) for height in (0.28, 0.9))
    assert low.at(0.0, 0.0) > high.at(0.0, 0.0) + 0.3
    assert low.darkness.max() <= 1 - (1 - KEY_SHARE) * (1 - SKY_SHARE) + 0.01
    steepest = [
        max(np.abs(np.diff(ground.darkness, axis=axis)).max() for axis in (0, 1)) for ground in (low, high)
    ]
    assert steepest[0] > 1.3 * steepest[1]
    assert steepest[1] < 0.2  # a soft edge, without steps


def test_a_shadow_moves_smoothly_with_what_casts_it(context: Any) -> None:
    """Ten steps of a millimetre change each piece of ground little, and no step more than the others."""
    pictures = np.array([Ground(context, ball(0.3, (0.001 * step, 0.6, 0.0))).darkness for step in range(10)])
    assert np.abs(np.diff(pictures, axis=0)).max() < 0.04


def test_a_shadow_is_reproducible_and_nothing_casts_no_shadow(context: Any) -> None:
    mesh = ball(0.25, (0.3, 0.7, -0.2))
    np.testing.assert_array_equal(Ground(context, mesh).darkness, Ground(context, mesh).darkness)
    assert not Ground(context).darkness.any()


def draw_from_above(context: Any, height: float, at: tuple[float, float] = (0.0, 0.0)) -> Any:
    """Return the white ground below a ball, 1 cm a pixel, a metre to each side of a place (x, z)."""
    size = 200
    target = context.simple_framebuffer((size, size))
    camera = np.zeros((4, 4))
    camera[0, 0] = camera[1, 2] = camera[3, 3] = 1.0
    camera[:2, 3] = -np.array(at)
    target.use()
    target.clear(1.0, 1.0, 1.0, 1.0)
    shadow = GroundShadow(context)
    assert shadow.draw([ball(0.05, (0.0, height, 0.0))], np.zeros((3, 2), np.float32), camera)
    shadow.close()
    seen = np.frombuffer(target.read(components=1, alignment=1), np.uint8).reshape(size, size).astype(int)
    target.release()
    return seen


def test_what_stands_on_the_ground_is_dark_at_its_foot_alone(context: Any) -> None:
    """Near feet the ground is drawn more finely than its map of darkness."""
    rows = []
    for height in (0.04, 0.2):
        seen = draw_from_above(context, height)
        rows.append(seen[100])
        assert np.abs(np.diff(seen[:, :50])).max() <= 2  # nothing to see at edges of maps
    touching, raised = rows
    assert touching[100] < 0.35 * 255
    assert touching[100] < raised[100] - 60
    assert touching[112] > 0.85 * 255  # 12 cm away, on the side of the light


@pytest.mark.parametrize("at", [(90, 0), (-70, 90), (3, -104), (-96, -97), (140, 30), (600, 0)])
def test_ground_partly_in_the_picture_is_as_dark_as_in_a_whole_one(context: Any, at: tuple[int, int]) -> None:
    whole = np.pad(draw_from_above(context, 0.04), 700, mode="edge")  # the edge is white
    x, z = at
    part = draw_from_above(context, 0.04, (x / 100, z / 100))
    inside = whole[700 + z :, 700 + x :][:200, :200]
    assert np.abs(part - inside).max() <= 2
