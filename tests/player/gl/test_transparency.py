"""Holes and transparent surfaces: what stands behind them is seen as their material says."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest

from fba.mesh._meshes import Alpha
from fba_player._mesh.textures import load_picture
from fba_player.gl._mesh_renderer import FaceRenderer
from fba_player.view._view import FaceMesh, FaceShape

Image = pytest.importorskip("PIL.Image")
SIZE = 16
RED, WHITE, BLUE = (0.8, 0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 0.0), (0.0, 0.0, 0.8, 0.0)


def wall(depth: float, colour: tuple[float, ...], alphas: list[int], **look: Any) -> FaceMesh:
    """A square over the whole picture, whose columns from left to right have these alphas."""
    corners = np.array([[-1, -1, depth], [1, -1, depth], [1, 1, depth], [-1, 1, depth]], dtype=np.float32)
    pixels = np.full((1, len(alphas), 4), 255, dtype=np.uint8)
    pixels[0, :, 3] = alphas
    pixels[0, pixels[0, :, 3] == 0, :3] = 0  # as most programs save what is not seen
    file = io.BytesIO()
    Image.fromarray(np.repeat(np.repeat(pixels, 8, axis=0), 8, axis=1)).save(file, "WEBP", lossless=True)
    shape = FaceShape(
        np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32),
        np.tile(np.array(colour, dtype=np.float32), (4, 1)),
        np.ones(4, dtype=np.float32),
        np.array([[0, 1], [1, 1], [1, 0], [0, 0]], dtype=np.float32),
        load_picture(file.getvalue()),
        **look,
    )
    normals = np.tile(np.array([0, 0, 1], dtype=np.float32), (4, 1))
    light = np.ones((4, 4), dtype=np.float32)
    return FaceMesh(shape, corners, normals, light, np.eye(4), np.zeros(3), np.zeros(3))


def draw(context: Any, meshes: list[FaceMesh]) -> np.ndarray:
    """Red, green and blue at the middles of the left and the right half, (2, 3)."""
    return draw_row(context, meshes)[[SIZE // 4, 3 * SIZE // 4]]


def draw_row(context: Any, meshes: list[FaceMesh]) -> np.ndarray:
    """Red, green and blue along the middle of the picture, (SIZE, 3)."""
    renderer = FaceRenderer(context)
    target = context.simple_framebuffer((SIZE, SIZE))
    target.use()
    target.clear(0, 0, 0, 1, depth=1.0)
    context.enable_only(context.DEPTH_TEST)
    renderer.begin(np.array([0.0, 0.0, 3.0]), np.diag([1.0, 1.0, -0.2, 1.0]), 0.01)
    renderer.draw_opaque(meshes)
    renderer.draw_transparent(meshes)
    pixels = np.frombuffer(target.read(components=3), dtype=np.uint8).reshape(SIZE, SIZE, 3)
    renderer.close()
    target.release()
    return pixels[SIZE // 2].astype(int)


def shows_wall(colour: np.ndarray) -> bool:
    return bool(colour[0] > 100 and colour[1] < 40)


@pytest.mark.parametrize(
    ("alpha", "look", "left", "right"),
    [
        ("opaque", {}, False, False),
        ("mask", {}, True, False),
        ("mask", {"cutoff": 0.2}, False, False),
        ("mask", {"cutoff": 0.9}, True, True),
        ("mask", {"opacity": 0.6}, True, True),
    ],
)
def test_holes(context: Any, alpha: Alpha, look: dict[str, float], left: bool, right: bool) -> None:
    """In front of a red wall, a white one whose left half has an alpha of 0.3, the right one of 0.75."""
    behind = wall(0.0, RED, [255, 255])
    front = wall(0.5, WHITE, [76, 191], alpha=alpha, **look)
    seen = draw(context, [front, behind])
    assert [shows_wall(each) for each in seen] == [left, right]
    assert front.shape.see_through is False


def test_what_is_blended_lets_through_as_much_as_its_alpha_leaves(context: Any) -> None:
    behind = wall(0.0, RED, [255, 255])
    covered, full = (draw(context, [behind, wall(0.5, WHITE, [a, a], alpha="blend")])[0] for a in (0, 255))
    assert shows_wall(covered)
    for given, look, share in (([51, 51], {}, 0.2), ([255, 255], {"opacity": 0.4}, 0.4)):
        seen = draw(context, [wall(0.5, WHITE, given, alpha="blend", **look), behind])[0]
        np.testing.assert_allclose(seen, covered + share * (full - covered), atol=3)


def test_what_hides_most_hides_other_blended_parts_in_any_order(context: Any) -> None:
    """The nearest half is nearly opaque on the right: what is behind it is not seen there."""
    far, near = (
        wall(0.2, BLUE, [255, 255], alpha="blend"),
        wall(0.5, RED, [0, 250], alpha="blend"),
    )
    for order in ([far, near], [near, far]):
        left, right = draw(context, order)
        assert left[2] > 100 > left[0]
        assert right[0] > 100 > right[2]


def test_from_nine_tenths_on_a_blended_part_hides_others(context: Any) -> None:
    """The nearest has alphas of 0.92 and 0.86; what is behind it, drawn later, shows through the second."""
    far = wall(0.2, BLUE, [200, 200], alpha="blend")
    hidden, shown = draw(context, [wall(0.5, RED, [235, 220], alpha="blend"), far])
    assert hidden[0] > 100 > hidden[2]
    assert shown[2] > 100 > shown[0]


@pytest.mark.parametrize("alpha", ["mask", "blend"])
def test_edges_of_holes_are_not_dark(context: Any, alpha: Alpha) -> None:
    """A white wall with black holes before a white one is as bright at their edges as elsewhere."""
    behind = wall(0.0, WHITE, [255, 255])
    front = wall(0.5, WHITE, [255, 0, 255, 0, 255], alpha=alpha)  # no edge is at one of a pixel
    plain = draw_row(context, [behind])
    np.testing.assert_allclose(draw_row(context, [behind, front]), plain, atol=4)


def test_a_colour_is_the_same_at_any_alpha(context: Any) -> None:
    """A grey wall is as grey half transparent by its picture as by its material."""
    behind, grey = wall(0.0, RED, [255, 255]), (0.05, 0.05, 0.05, 0.0)
    by_picture = wall(0.5, grey, [128, 128], alpha="blend")
    by_material = wall(0.5, grey, [255, 255], alpha="blend", opacity=128 / 255)
    seen = [draw(context, [behind, front])[0] for front in (by_picture, by_material)]
    np.testing.assert_allclose(*seen, atol=3)
