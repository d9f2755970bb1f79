"""What folds are measured by, and how motions are eased around them, on a rumpled plate."""

import numpy as np
import pytest

from fba.face.authoring.surface._fold_limits import LEAST_AREA, MOST_STRETCH, Limiter, Patch
from fba.face.authoring.surface._motion import _solve_harmonic
from fba.face.authoring.surface.surface import Surface, weld_parts
from fba.face.model import Part

SIDE = 12


@pytest.fixture(scope="module")
def plate() -> Surface:
    """SIDE x SIDE vertices, 1 cm apart, a little out of place, every cell two triangles."""
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(SIDE**2)]) + rng.uniform(-0.2, 0.2, (SIDE**2, 3))
    cells = [SIDE * j + i for j in range(SIDE - 1) for i in range(SIDE - 1)]
    triangles = [t for c in cells for t in ((c, c + 1, c + SIDE + 1), (c, c + SIDE + 1, c + SIDE))]
    return weld_parts([Part("plate", "skin", points / 100, np.array(triangles))])


def random_shifts(seed: int, size: float) -> np.ndarray:
    return np.random.default_rng(seed).normal(scale=size, size=(SIDE**2, 3))


def test_neighbours_are_the_ends_of_the_edges(plate: Surface) -> None:
    asked = np.array([0, 40, 77])
    wanted = {int(b) for edge in plate.edges.tolist() for a, b in (edge, edge[::-1]) if a in asked}
    assert plate.neighbours(asked).tolist() == sorted(wanted)
    assert plate.neighbours(asked[:0]).tolist() == []


def test_harmonic_vertices_are_the_average_of_their_neighbours(plate: Surface) -> None:
    shifts = random_shifts(1, 0.003)
    free = np.array([27, 28, 39, 40, 41, 90, 143])  # two groups, and a corner
    solved = _solve_harmonic(plate, shifts, free)
    others = np.setdiff1d(np.arange(SIDE**2), free)
    np.testing.assert_array_equal(solved[others], shifts[others])
    laplacian = plate.laplacian[0]
    assert np.abs((laplacian @ solved)[free]).max() < 1e-12
    assert np.abs((laplacian @ shifts)[free]).max() > 1e-3
    np.testing.assert_array_equal(_solve_harmonic(plate, shifts, free[:0]), shifts)


def test_a_piece_without_a_fixed_vertex_stays_as_it_is() -> None:
    corners = np.array(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 5], [1, 0, 5], [0, 1, 5], [1, 1, 5]]
    )
    cell = np.array([[0, 1, 2], [1, 3, 2]])
    two = weld_parts([Part("pieces", "skin", corners / 100, np.concatenate([cell, cell + 4]))])
    shifts = np.random.default_rng(0).normal(size=(8, 3))
    np.testing.assert_array_equal(_solve_harmonic(two, shifts, np.arange(4)), shifts)


@pytest.mark.parametrize("vertices", [np.array([65]), np.array([0, 13, 140]), np.arange(SIDE**2 // 2)])
def test_a_patch_has_every_triangle_at_the_given_vertices(plate: Surface, vertices: np.ndarray) -> None:
    """Few vertices are looked up one by one, many by a mask of all."""
    patch = Limiter.from_mesh(plate.vertices, plate.triangles).patch(vertices)
    given = set(vertices.tolist())
    assert patch.triangles.tolist() == [t for t in plate.triangles.tolist() if given & set(t)]


def test_a_motion_reaches_as_far_as_no_triangle_is_flat_or_torn(plate: Surface) -> None:
    patch = Patch(plate.vertices, plate.triangles)
    field = random_shifts(2, 0.01)
    reach = patch.reach(field)

    def measure(row: int, share: float) -> tuple[float, float]:
        """Share of the area, seen along the neutral normal, and the largest stretch of an edge."""
        before, after = (v[plate.triangles[row]] for v in (plate.vertices, plate.vertices + share * field))
        normals = [np.cross(v[1] - v[0], v[2] - v[0]) for v in (before, after)]
        edges = [np.linalg.norm(v - np.roll(v, 1, axis=0), axis=1) for v in (before, after)]
        return float(normals[0] @ normals[1] / (normals[0] @ normals[0])), float((edges[1] / edges[0]).max())

    for row in range(0, len(reach), 5):
        area, stretch = measure(row, float(reach[row]))
        assert area == pytest.approx(LEAST_AREA) or stretch == pytest.approx(MOST_STRETCH)
        for share in np.linspace(0, 0.99, 8) * reach[row]:
            area, stretch = measure(row, float(share))
            assert area > LEAST_AREA
            assert stretch < MOST_STRETCH
    assert patch.least_reach(field) == reach.min()
    sound = patch.soundness(field * patch.least_reach(field))
    assert sound.all()
    assert not patch.soundness(field * reach.max() * 1.2).all()


def test_turned_as_a_whole_a_plate_is_sound_only_if_it_may_turn(plate: Surface) -> None:
    patch = Patch(plate.vertices, plate.triangles)
    upside_down = plate.vertices * (1, -1, -1) - plate.vertices
    assert patch.is_sound(upside_down, turning=True)
    assert not patch.is_sound(upside_down)
    folded = np.zeros_like(upside_down)
    folded[65] = (0.014, 0.0, 0.0)  # over its neighbour
    assert not patch.is_sound(folded, turning=True)
    assert not patch.is_sound(folded)
