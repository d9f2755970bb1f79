"""Coarser meshes: fewer triangles of the same vertices, on the same surface; chosen by size on the screen."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from fba.cache import load_or_make
from fba.compiled import is_compiled
from fba.mesh.simplify import TOLERANCES, DetailLevels, simplify_by_quadrics
from fba_player._mesh.primitives import sphere_mesh
from fba_player.gl._lod import Details, distance, share_memory
from fba_player.view._view import FaceMesh, FaceShape

pytestmark = pytest.mark.skipif(not is_compiled(), reason="without numba meshes are drawn as they are")
Int32 = npt.NDArray[np.int32]


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))


def grid(count: int, size: float) -> tuple[npt.NDArray[np.float64], Int32]:
    """A flat square of count x count vertices."""
    x, y = np.meshgrid(np.linspace(0, size, count), np.linspace(0, size, count))
    corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    one = np.stack([corner, corner + 1, corner + count], axis=1)
    other = np.stack([corner + 1, corner + count + 1, corner + count], axis=1)
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(count * count)], axis=1)
    return vertices, np.concatenate([one, other]).astype(np.int32)


def area(vertices: npt.NDArray[np.float64], triangles: Int32) -> float:
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2


def mesh_of(vertices: npt.NDArray[np.float32], triangles: Int32) -> FaceMesh:
    count = len(vertices)
    shape = FaceShape(
        triangles,
        np.zeros((count, 4), np.float32),
        np.ones(count, np.float32),
        coarser=DetailLevels(vertices, 1, triangles),
    )
    return FaceMesh(
        shape,
        vertices,
        vertices,
        np.ones((count, 4), np.float32),
        np.eye(4),
        np.zeros(3),
        np.zeros(3),
    )


def test_a_flat_square_needs_few_triangles_and_keeps_its_border() -> None:
    vertices, triangles = grid(21, 0.1)
    found = DetailLevels(vertices.astype(np.float32), 1, triangles).triangles_within(0.0004)
    assert found is not None
    assert len(found) < len(triangles) / 4
    assert area(vertices, found) == pytest.approx(0.01, rel=1e-6)
    normal = np.cross(
        vertices[found[:, 1]] - vertices[found[:, 0]], vertices[found[:, 2]] - vertices[found[:, 0]]
    )
    assert (normal[:, 2] > 0).all()  # none turned over


@pytest.mark.parametrize("tolerance", TOLERANCES[2:])
def test_a_ball_stays_a_ball_of_that_size(tolerance: float) -> None:
    """Vertices stay on the sphere; what lies between is off by no more than a few times the mean error."""
    unit, triangles = sphere_mesh(48, 64)
    vertices = (unit * 0.1).astype(np.float32)
    found = DetailLevels(vertices, 1, triangles.astype(np.int32)).triangles_within(tolerance)
    assert found is not None
    assert len(found) < len(triangles)
    middles = vertices[found].mean(axis=1)
    assert (0.1 - np.linalg.norm(middles, axis=1)).max() < 6 * tolerance + 0.0005


def test_levels_only_leave_out() -> None:
    unit, triangles = sphere_mesh(32, 48)
    coarse = DetailLevels((unit * 0.1).astype(np.float32), 1, triangles.astype(np.int32))
    before = set(range(len(unit)))
    counts = []
    for tolerance in TOLERANCES:
        found = coarse.triangles_within(tolerance)
        assert found is not None
        assert set(found.ravel().tolist()) <= before
        before = set(found.ravel().tolist())
        counts.append(len(found))
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] < len(triangles) / 5
    assert coarse.triangles_within(TOLERANCES[0] / 2) is None


def test_what_moves_in_a_pose_keeps_its_vertices() -> None:
    """A flat square that bulges in its second pose keeps more than one that does not."""
    vertices, triangles = grid(25, 0.1)
    bulged = vertices.copy()
    bulged[:, 2] = 0.01 * np.sin(vertices[:, 0] * 60) * np.sin(vertices[:, 1] * 60)
    flat = simplify_by_quadrics(np.concatenate([vertices, vertices], axis=1), 2, triangles, (0.0004,))[1]
    moving = simplify_by_quadrics(np.concatenate([vertices, bulged], axis=1), 2, triangles, (0.0004,))[1]
    assert (moving == 1).sum() > 2 * (flat == 1).sum()


def test_a_seam_does_not_gape() -> None:
    """Two squares side by side whose vertices along the seam are there twice."""
    left, triangles = grid(11, 0.05)
    right = left + np.array([0.05, 0.0, 0.0])
    vertices = np.concatenate([left, right])
    both = np.concatenate([triangles, triangles + len(left)]).astype(np.int32)
    onto, _ = simplify_by_quadrics(vertices, 1, both, (0.001,))
    seam = np.flatnonzero(np.abs(vertices[:, 0] - 0.05) < 1e-9)
    assert (onto[seam] == seam).all()


def test_a_file_that_was_tampered_with_is_made_anew(tmp_path: Path) -> None:
    unit, triangles = sphere_mesh(24, 32)
    points = (unit * 0.1).astype(np.float32)
    good = DetailLevels(points, 1, triangles.astype(np.int32)).triangles_within(0.0016)
    (path,) = (tmp_path / "fba").glob("coarse-*.fbk")
    count = len(points)
    zeros = np.zeros(count, dtype=np.int32)
    path.unlink()
    load_or_make(path.stem, ((count,),) * 2, lambda: [np.full(count, 10**6, dtype=np.int32), zeros], np.int32)
    again = DetailLevels(points, 1, triangles.astype(np.int32)).triangles_within(0.0016)
    assert good is not None
    assert again is not None
    np.testing.assert_array_equal(good, again)
    circle = np.roll(np.arange(count), 1).astype(np.int32)
    path.unlink()
    load_or_make(path.stem, ((count,),) * 2, lambda: [circle, zeros], np.int32)
    assert (
        DetailLevels(points, 1, triangles.astype(np.int32)).triangles_within(0.0016) is not None
    )  # and no endless walk


def test_the_farther_the_coarser() -> None:
    unit, triangles = sphere_mesh(48, 64)
    mesh = mesh_of((unit * 0.1).astype(np.float32), triangles.astype(np.int32))
    details, pixel = Details(), 0.0006
    near, far = (details.choose([mesh], (0.0, 0.0, away), pixel)[0] for away in (0.15, 6.0))
    assert near is mesh
    assert len(far.shape.triangles) < len(triangles) / 3
    assert len(far.positions) == len(far.normals) == len(far.light) == int(far.shape.triangles.max()) + 1
    np.testing.assert_allclose(np.linalg.norm(far.positions, axis=1), 0.1, rtol=1e-5)
    again = details.choose([mesh], (0.0, 0.0, 6.0), pixel)[0]
    assert again.shape is far.shape
    assert again.light is far.light
    assert distance(mesh, np.array([0.0, 0.0, 6.0])) == pytest.approx(5.9, abs=0.02)


def test_equal_views_of_an_array_share_memory() -> None:
    light = np.ones((8, 4), dtype=np.float32)
    assert share_memory(light[2:5], light[2:5])
    assert not share_memory(light[2:5], light[3:6])
    assert not share_memory(light[2:5], light.copy()[2:5])


@pytest.mark.parametrize(
    ("poses", "vertex", "message"),
    [
        (2, 0, "cannot hold 2 poses"),
        (1, -1, "vertices beyond the 8 that exist"),
        (1, 8, "vertices beyond the 8 that exist"),
    ],
)
def test_meshes_that_do_not_agree_are_refused(poses: int, vertex: int, message: str) -> None:
    points = np.random.default_rng(0).random((8, 3))
    triangles = np.array([[0, 1, 2], [2, 3, vertex]], dtype=np.int32)
    with pytest.raises(ValueError, match=message):
        simplify_by_quadrics(points, poses, triangles)
