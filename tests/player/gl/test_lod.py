"""Levels of detail of faces: chosen by size, the same for all parts, and changed gradually."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fba.compiled import is_compiled
from fba.face import FaceModel
from fba.mesh.simplify import Level, place_on_level
from fba_player._figure.face import FaceFigure, build_figure
from fba_player.gl._lod import MORPH_SECONDS, Details
from fba_player.view._view import FaceMesh, FaceShape

pytestmark = pytest.mark.skipif(not is_compiled(), reason="without numba faces are drawn as they are")
PIXEL = 0.0006
NEAR, MIDDLE, FAR = ((0.0, 0.0, away) for away in (0.4, 1.3, 8.0))


@pytest.fixture(scope="module")
def figure() -> FaceFigure:
    return build_figure(FaceModel.default())


def meshes(figure: FaceFigure, **faps: int) -> list[FaceMesh]:
    values = np.zeros(68, dtype=np.float32)
    for name, value in faps.items():
        values[int(name[1:]) - 1] = value
    return figure.meshes(values, np.eye(4))


def shapes(chosen: list[FaceMesh]) -> list[FaceShape]:
    """But those of hairs, of which each `Details` has its own."""
    return [mesh.shape for mesh in chosen if mesh.shape.across is None]


def triangles(chosen: list[FaceMesh]) -> int:
    return sum(len(mesh.shape.triangles) for mesh in chosen if mesh.shape.across is None)


def test_the_smaller_the_fewer_triangles(figure: FaceFigure) -> None:
    full = meshes(figure)
    near, middle, far = (Details().choose(full, eye, PIXEL) for eye in (NEAR, MIDDLE, FAR))
    assert [mesh.shape for mesh in near] == [mesh.shape for mesh in full]
    assert triangles(near) > 2.5 * triangles(middle) > 6 * triangles(far)
    for mesh in far:
        assert len(mesh.positions) == len(mesh.normals) == len(mesh.light) == len(mesh.shape.sway)


@pytest.mark.parametrize(("lod", "level"), [("0", 0), ("full", 0), ("1", 1), ("2", 2), ("4", 2)])
def test_a_level_by_name(figure: FaceFigure, lod: str, level: int) -> None:
    full = meshes(figure)
    for mesh, drawn in zip(full, Details().choose(full, MIDDLE, PIXEL, lod), strict=True):
        shapes = [mesh.shape, *(each.shape for each in mesh.shape.levels)]
        assert drawn.shape is shapes[min(level, len(shapes) - 1)]


def test_a_level_moves_as_the_full_face_does(figure: FaceFigure) -> None:
    """Feature points are vertices of every level: they are where those of the full face are."""
    full = meshes(figure, f3=600, f19=1000, f20=1000, f16=300)
    for number, level in enumerate(figure.model.levels):
        drawn = Details().choose(full, FAR, PIXEL, str(number + 1))
        skin, coarse = full[0], drawn[0]
        bound = figure.model.bound[figure.model.bound >= 0]
        bound = bound[bound < len(skin.positions)]
        at = level.parents[bound]
        np.testing.assert_allclose(coarse.positions[at], skin.positions[bound], atol=1e-5)
        part, parents = level.model.parts[0], level.parents[: len(skin.positions)]
        gone = np.zeros(len(parents), dtype=bool)
        rest = Level(part.vertices, part.triangles, parents, parents, part.triangles, part.vertices, gone)
        rows, weights = place_on_level(figure.model.parts[0].vertices, rest)
        off = np.einsum("nk,nkd->nd", weights, coarse.positions[rows]) - skin.positions
        assert np.sqrt((off**2).sum(axis=1).mean()) < 1.2 * level.error


def test_levels_change_gradually_and_end_as_the_coarser_one(figure: FaceFigure) -> None:
    full = meshes(figure, f3=300)
    details = Details()
    details.choose(full, NEAR, PIXEL, now=1.0)
    assert not details.morphing
    first = details.choose(full, FAR, PIXEL, now=2.0)
    assert details.morphing
    np.testing.assert_array_equal(first[0].positions, full[0].positions)
    half = details.choose(full, FAR, PIXEL, now=2.0 + MORPH_SECONDS / 2)[0]
    late = details.choose(full, FAR, PIXEL, now=2.0 + MORPH_SECONDS * (1 - 1e-6))[0]
    done = details.choose(full, FAR, PIXEL, now=2.0 + MORPH_SECONDS * 1.01)
    assert not details.morphing
    alone = Details().choose(full, FAR, PIXEL)
    assert shapes(done) == shapes(alone)
    for one, other in zip(done, alone, strict=True):
        assert one.looks is None
        np.testing.assert_array_equal(one.positions, other.positions)
    parents = full[0].shape.levels[1].parents
    np.testing.assert_allclose(late.positions, done[0].positions[parents], atol=1e-5)
    assert late.looks is not None
    np.testing.assert_allclose(late.looks, done[0].shape.looks[parents], atol=1e-4)
    np.testing.assert_allclose(half.positions, (full[0].positions + late.positions) / 2, atol=1e-5)
    # and back, from the coarser to the full one
    details.choose(full, NEAR, PIXEL, now=5.0)
    back = details.choose(full, NEAR, PIXEL, now=5.0 + MORPH_SECONDS / 2)[0]
    np.testing.assert_allclose(back.positions, half.positions, atol=1e-5)


def test_without_a_clock_a_picture_depends_on_nothing_before_it(figure: FaceFigure) -> None:
    full = meshes(figure)
    details = Details()
    details.choose(full, NEAR, PIXEL, now=1.0)
    details.choose(full, FAR, PIXEL, now=1.1)
    drawn = details.choose(full, FAR, PIXEL)
    assert not details.morphing
    assert shapes(drawn) == shapes(Details().choose(full, FAR, PIXEL))


def test_two_persons_with_one_face_have_levels_of_their_own(figure: FaceFigure) -> None:
    here = meshes(figure)
    matrix = np.eye(4)
    matrix[2, 3] = -8.0
    there = [mesh._replace(matrix=matrix) for mesh in here]
    drawn = Details().choose([*here, *there], NEAR, PIXEL)
    assert drawn[0].shape is here[0].shape
    assert drawn[len(here)].shape is here[0].shape.levels[1].shape


def test_a_face_without_levels_is_drawn_in_full() -> None:
    plain = build_figure(replace(FaceModel.default(), levels=()))
    full = meshes(plain)
    assert shapes(Details().choose(full, FAR, PIXEL)) == shapes(full)


@pytest.mark.parametrize(("away", "halvings"), [(1.0, 0), (2.0, 1), (8.0, 3)])
def test_of_lashes_much_narrower_than_a_pixel_fewer_are_drawn(
    figure: FaceFigure, away: float, halvings: int
) -> None:
    full = meshes(figure)
    for mesh, drawn in zip(full, Details().choose(full, (0.0, 0.0, away), PIXEL), strict=True):
        assert len(drawn.shape.sway) == len(drawn.positions) == len(drawn.light)
        if mesh.shape.across is not None and drawn.shape.across is not None:
            fewer = 2**halvings if mesh.shape.kind == "lash" else 1
            assert len(drawn.shape.triangles) == pytest.approx(len(mesh.shape.triangles) / fewer, rel=0.1)
            assert len(drawn.shape.across) == len(drawn.positions)


def test_a_level_that_was_not_moved_is_not_drawn(figure: FaceFigure) -> None:
    """As after a jump of the camera: the change to the level at hand is at once, then gradual again."""
    full, details = meshes(figure), Details()
    details.choose(full, NEAR, PIXEL, now=1.0)
    moved = [mesh._replace(finest=1) for mesh in full]
    drawn = details.choose(moved, FAR, PIXEL, now=1.1)
    assert drawn[0].shape is full[0].shape.levels[0].shape
    assert details.morphing
