"""Memoryless collapses: volume, borders, seams, pinned vertices, history; and bad meshes."""

import numpy as np
import numpy.typing as npt
import pytest

from fba.compiled import is_compiled
from fba.errors import ModelError
from fba.mesh.simplify import Level, place_on_level, simplify
from fba.mesh.simplify._balls import cut_depth

pytestmark = pytest.mark.skipif(not is_compiled(), reason="too slow without numba")
Float64 = npt.NDArray[np.float64]
Int32 = npt.NDArray[np.int32]


def patch(count: int, height: float = 0.0) -> tuple[Float64, Int32]:
    """A square patch of count x count vertices that bulges by a height in the middle."""
    x, y = np.meshgrid(np.linspace(0, 1, count), np.linspace(0, 1, count))
    corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    one = np.stack([corner, corner + 1, corner + count], axis=1)
    other = np.stack([corner + 1, corner + count + 1, corner + count], axis=1)
    z = height * np.sin(np.pi * x) * np.sin(np.pi * y)
    return np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), np.concatenate([one, other]).astype(np.int32)


def ball(rings: int = 24, sectors: int = 32) -> tuple[Float64, Int32]:
    """A closed ball with poles, its seam closed."""
    angles = np.pi * np.arange(1, rings) / rings
    around = 2 * np.pi * np.arange(sectors) / sectors
    side = np.stack(
        [
            np.outer(np.sin(angles), np.cos(around)).ravel(),
            np.outer(np.cos(angles), np.ones(sectors)).ravel(),
            np.outer(np.sin(angles), -np.sin(around)).ravel(),
        ],
        axis=1,
    )
    row, column = np.meshgrid(np.arange(rings - 2), np.arange(sectors), indexing="ij")
    a, b = (row * sectors + column).ravel(), (row * sectors + (column + 1) % sectors).ravel()
    c, d = a + sectors, b + sectors
    first = np.arange(sectors)
    top, bottom = len(side), len(side) + 1
    last = (rings - 2) * sectors + first
    caps = [
        np.stack([np.full(sectors, top), first, (first + 1) % sectors], axis=1),
        np.stack([np.full(sectors, bottom), (rings - 2) * sectors + (first + 1) % sectors, last], axis=1),
    ]
    triangles = np.concatenate([np.stack([a, c, b], axis=1), np.stack([b, c, d], axis=1), *caps])
    return np.concatenate([side, [[0, 1, 0], [0, -1, 0]]]), triangles.astype(np.int32)


def volume(vertices: Float64, triangles: Int32) -> float:
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6


def edges_once(triangles: Int32) -> set[tuple[int, int]]:
    ends = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    found, times = np.unique(ends, axis=0, return_counts=True)
    return {(int(a), int(b)) for a, b in found[times == 1]}


def whole(level: Level) -> Int32:
    """The triangles between vertices that are one along seams."""
    return level.points[level.triangles]


@pytest.mark.parametrize("faces", [28, 24, 20, 12])
def test_the_patch_of_5_x_5_keeps_its_border(faces: int) -> None:
    vertices, triangles = patch(5, 0.3)
    level = simplify(vertices[None], triangles, faces).level(faces)
    assert len(level.triangles) == faces
    border = np.unique(list(edges_once(level.triangles)))
    at = level.positions[border]
    outside = (np.abs(at[:, :2] - 0.5).max(axis=1) > 0.5 - 1e-12) & (np.abs(at[:, 2]) < 1e-12)
    assert outside.all()
    flat = level.positions.copy()
    flat[:, 2] = 0
    a, b, c = (flat[level.triangles[:, k]] for k in range(3))
    assert np.cross(b - a, c - a)[:, 2].sum() / 2 == pytest.approx(1.0, abs=1e-12)


def test_closed_meshes_keep_their_volume() -> None:
    vertices, triangles = ball()
    made = simplify(vertices[None], triangles, 40)
    before = volume(vertices, triangles)
    assert before > 4
    for faces in (1000, 400, 100, 40):
        level = made.level(faces)
        assert len(level.triangles) <= faces
        assert volume(level.positions, level.triangles) == pytest.approx(before, rel=1e-9)
        assert not edges_once(level.triangles)
        radius = np.linalg.norm(level.positions, axis=1)
        assert np.abs(radius - 1).max() < 12 / faces


def test_every_level_between_can_be_had_back() -> None:
    vertices, triangles = ball()
    made = simplify(vertices[None], triangles, 20)
    assert (np.diff(made.faces) < 0).all()
    full = made.level(len(triangles))
    np.testing.assert_array_equal(full.positions, vertices)
    np.testing.assert_array_equal(full.triangles, triangles)
    for faces in (1400, 700, 21, 1400):
        level = made.level(faces)
        assert len(level.triangles) <= faces < len(level.triangles) + 3
        assert level.triangles.max() == len(level.positions) - 1
    np.testing.assert_array_equal(made.after(10**9).triangles, made.level(20).triangles)


def test_levels_on_the_way_are_exact_where_a_border_allows_it() -> None:
    vertices, triangles = patch(33, 0.2)
    wanted = [1501, 1100, 777, 300, 41]
    made = simplify(vertices[None], triangles, wanted)
    assert [len(made.level(faces).triangles) for faces in wanted] == wanted


def test_what_moves_in_a_pose_keeps_its_vertices() -> None:
    vertices, triangles = patch(25)
    bulged = vertices.copy()
    right = vertices[:, 0] > 0.5
    bulged[right, 2] = 0.05 * np.sin(vertices[right, 0] * 40) * np.sin(vertices[right, 1] * 40)
    level = simplify(np.stack([vertices, bulged]), triangles, 300).level(300)
    assert (level.positions[:, 0] > 0.5).mean() > 0.85


def test_importance_keeps_vertices() -> None:
    vertices, triangles = ball()
    importance = np.where(vertices[:, 0] > 0, 1000.0, 1.0)
    level = simplify(vertices[None], triangles, 200, importance=importance).level(200)
    assert (level.positions[:, 0] > 0).mean() > 0.75


def test_pinned_vertices_stay_where_they_are() -> None:
    vertices, triangles = ball()
    pinned = np.zeros(len(vertices), dtype=bool)
    pinned[::29] = True
    level = simplify(vertices[None], triangles, 80, importance=np.where(pinned, np.inf, 1)).level(80)
    np.testing.assert_array_equal(level.positions[level.parents[pinned]], vertices[pinned])
    np.testing.assert_allclose(level.carry(vertices)[level.parents[pinned]], vertices[pinned], atol=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_pinned_vertices_of_a_torn_mesh_keep_a_triangle(seed: int) -> None:
    """Where triangles touch in a corner only, one goes with an edge of it."""
    random = np.random.default_rng(seed)
    vertices, triangles = patch(15, 0.2)
    torn = triangles[random.random(len(triangles)) < 0.6]
    pinned = np.isin(np.arange(len(vertices)), torn) & (random.random(len(vertices)) < 0.3)
    level = simplify(vertices[None], torn, 1, importance=np.where(pinned, np.inf, 1)).level(1)
    assert not level.gone[pinned].any()
    np.testing.assert_array_equal(level.positions[level.parents[pinned]], vertices[pinned])


def shortest_way(vertices: Float64, triangles: Int32, start: int, end: int) -> Int32:
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    one, other = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0).T
    lengths = np.linalg.norm(vertices[one] - vertices[other], axis=1)
    graph = csr_array((lengths, (one, other)), shape=(len(vertices), len(vertices)))
    before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)[1]
    way = [end]
    while way[-1] != start:
        way.append(int(before[way[-1]]))
    return np.array(way, dtype=np.int32)


@pytest.mark.parametrize("seed", range(4))
def test_lines_stay_the_shortest_way(seed: int) -> None:
    random = np.random.default_rng(seed)
    vertices, triangles = patch(30)
    vertices[:, 2] = random.uniform(0, 0.06, len(vertices))
    ways = [shortest_way(vertices, triangles, start, end) for start, end in ((65, 830), (480, 500))]
    lines, pinned = np.zeros(900, np.int32), np.zeros(900, bool)
    for bit, way in enumerate(ways):
        lines[way] |= 1 << bit
        pinned[way[[0, -1]]] = True
    made = simplify(vertices[None], triangles, 150, importance=np.where(pinned, np.inf, 1), lines=lines)
    assert len(made.level(150).triangles) == 150
    for faces in (1200, 600, 400):
        level = made.level(faces)
        for way in ways:
            ends = level.parents[way[[0, -1]]]
            left = shortest_way(level.positions, level.triangles, int(ends[0]), int(ends[1]))
            off = np.abs(level.positions[left][:, None] - vertices[way]).max(axis=2).min(axis=1)
            assert not off.any()
            assert 2 <= len(left) <= len(way)
            assert len(left) < len(way) or faces > 600  # every line loses vertices, not the first one only


def hairs(count: int) -> tuple[Float64, Int32]:
    """Triangles side by side, 0.1 wide, and longer one after the other."""
    x = np.arange(count, dtype=np.float64)
    corners = np.zeros((count, 3, 3))
    corners[:, :, 0] = x[:, None]
    corners[:, 1, 0] += 0.1
    corners[:, 2, 1] = 1 + 0.01 * x
    return corners.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


def test_hairs_go_as_a_whole_but_for_the_last_of_a_part() -> None:
    """The shortest first; what is gone has the nearest vertex of its part as parent."""
    vertices, triangles = hairs(10)
    looks = np.repeat([[0.0], [1.0]], 15, axis=0)
    made = simplify(vertices[None], triangles, 1, looks=looks)
    assert made.faces.tolist() == [9, 8, 7, 6, 5, 4, 3, 2]
    level = made.level(6)
    gone = np.repeat(np.arange(10) < 4, 3)
    np.testing.assert_array_equal(level.gone, gone)
    np.testing.assert_array_equal(level.positions[level.parents[~gone]], vertices[~gone])
    assert (level.positions[level.parents[:12], 0] < 4.2).all()
    weights = place_on_level(vertices, level)[1]
    assert not weights[gone].any()
    np.testing.assert_allclose(weights[~gone].sum(axis=1), 1)
    bound = np.where(np.arange(30) == 0, np.inf, 1)  # a vertex that stays keeps its triangle
    made = simplify(vertices[None], triangles, 1, looks=looks, importance=bound)
    assert len(made.faces) == 8
    assert not made.level(1).gone[:3].any()


@pytest.mark.parametrize(
    ("angle", "lifted", "depth"),
    [
        (0.0, 0.0, 0.0),
        (30.0, 0.0, 1 - np.cos(np.radians(30))),  # the middle of a chord
        (30.0, 0.2, 0.0),
        (200.0, 0.0, 0.0),  # behind the ball
    ],
)
def test_the_depth_to_which_a_triangle_cuts_a_ball(angle: float, lifted: float, depth: float) -> None:
    """A narrow triangle above a ball of radius 2 closes onto it, its ends at angles from the gaze."""
    around = np.radians([-angle, angle, angle])
    around = around if angle < 180 else np.radians([angle - 30, angle, angle])
    moved = np.stack([0 * around, np.sin(around), np.cos(around)], axis=1) * 2 * (1 + lifted)
    moved[2, 0] = 1e-6
    rest = np.array([[0.0, -1, 3], [0, 1, 3], [1e-6, 1, 3]])
    round_ball = np.concatenate([[0, 0, 0, 0, 0, 1, 2], np.full(13, 2.0)])
    assert cut_depth(round_ball, rest, moved) == pytest.approx(depth, abs=1e-6)
    assert cut_depth(round_ball, rest / 2, moved) == 0.0  # it was inside already


def test_a_seam_stays_closed_and_its_sides_keep_their_looks() -> None:
    """Two halves of a curved patch with a picture each: the vertices between them are there twice."""
    one, triangles = patch(17, 0.4)
    other = one.copy()
    other[:, 0] = 2 - other[:, 0]  # mirrored, so the triangles turn over
    vertices = np.concatenate([one, other])
    both = np.concatenate([triangles, triangles[:, ::-1] + len(one)]).astype(np.int32)
    looks = np.concatenate([one[:, :2], 5 + one[:, :2]])
    part = np.zeros((len(looks), 1))
    level = simplify(vertices[None], both, 200, looks=np.hstack([part, looks])).level(200)
    assert len(level.positions) > len(np.unique(level.points))
    inner = [pair for pair in edges_once(whole(level)) if pair not in outer_edges(level)]
    assert not inner  # no edge between the halves gapes
    carried = level.carry(looks)
    assert not ((carried[:, 0] > 1.001) & (carried[:, 0] < 4.999)).any()  # never a mixture of the pictures
    sides = carried[level.triangles][:, :, 0] > 3
    assert (sides.all(axis=1) | ~sides.any(axis=1)).all()
    moved = level.carry(np.sin(7 * vertices))
    for point in np.unique(level.points):
        same = moved[level.points == point]
        np.testing.assert_allclose(same, same[:1] + np.zeros_like(same), atol=1e-9)


def outer_edges(level: Level) -> set[tuple[int, int]]:
    """Edges once in the whole, both ends on the outline of the two halves."""
    places = np.zeros((int(level.points.max()) + 1, 3))
    places[level.points] = level.positions
    return {
        (a, b)
        for a, b in edges_once(whole(level))
        if all(
            min(abs(places[v, 0]), abs(places[v, 0] - 2), abs(places[v, 1]), abs(places[v, 1] - 1)) < 1e-9
            for v in (a, b)
        )
    }


def test_equal_double_vertices_are_one() -> None:
    """A soup of triangles, each with vertices of its own, is simplified like the mesh."""
    vertices, triangles = ball()
    soup = vertices[triangles.ravel()]
    level = simplify(soup[None], np.arange(len(soup), dtype=np.int32).reshape(-1, 3), 100).level(100)
    assert len(level.triangles) == 100
    assert not edges_once(whole(level))


def test_the_full_mesh_lies_on_a_level() -> None:
    vertices, triangles = ball()
    level = simplify(vertices[None], triangles, 300).level(300)
    rows, weights = place_on_level(vertices, level)
    np.testing.assert_allclose(weights.sum(axis=1), 1)
    assert (weights >= -1e-12).all()
    on = np.einsum("nk,nkd->nd", weights, level.positions[rows])
    assert np.linalg.norm(on - vertices, axis=1).max() < 0.05


@pytest.mark.parametrize("far", [np.nan, np.inf, 1e200, -1e300])
def test_a_place_that_is_no_number_or_too_far_away_is_not_in_a_ball(far: float) -> None:
    round_ball = np.array([0, 0, 0, 0, 0, 1, 2, 2, 2.0])
    near = np.array([[3.0, 0, 1], [-3, 0, 1], [0, 3, 1]])
    for beyond in (np.full((3, 3), far), near * (1, 1, far), np.where(np.eye(3) > 0, far, near)):
        assert cut_depth(round_ball, near, beyond) == 0.0
        assert 0.0 <= cut_depth(round_ball, beyond, near / 4) < 1.0


def test_a_mesh_of_no_vertices_has_no_collapses() -> None:
    made = simplify(np.zeros((2, 0, 3)), np.zeros((0, 3), dtype=np.int32), 1)
    assert made.faces.shape == (0,)


def test_edges_of_three_triangles_stay() -> None:
    vertices, triangles = patch(9)
    wall = vertices[:, [0, 2, 1]] * (1, 1, 0.5) + (0, 0.5, 0)  # stands on the middle row
    wall[:, 2] = vertices[:, 1] * 0.5
    wall[:, 1] = 0.5
    both = np.concatenate([triangles, triangles + len(vertices)]).astype(np.int32)
    together = np.concatenate([vertices, wall])
    level = simplify(together[None], both, 4).level(4)
    row = np.flatnonzero(np.abs(vertices[:, 1] - 0.5) < 1e-12)
    places = {tuple(np.round(place, 9)) for place in level.positions}
    assert {tuple(np.round(place, 9)) for place in vertices[row]} <= places
    assert np.isfinite(level.positions).all()


@pytest.mark.parametrize("seed", range(12))
def test_random_meshes_stay_meshes(seed: int) -> None:
    """Torn, doubled, folded and flat: no crash, no triangle of two corners, all indices valid."""
    random = np.random.default_rng(seed)
    count = int(random.integers(3, 60))
    vertices = random.standard_normal((count, 3)) * 10.0 ** random.integers(-6, 6)
    if seed % 3 == 0:
        vertices[:, 2] = 0
    if seed % 4 == 0:
        vertices[count // 2 :] = vertices[: count - count // 2]
    triangles = random.integers(0, count, (int(random.integers(1, 150)), 3))
    poses = np.stack([vertices, vertices + 0.1 * random.standard_normal((count, 3))])
    looks, lines = random.integers(0, 2, (count, 1)), random.integers(0, 8, count) * (seed % 2)
    balls = np.concatenate([vertices[0], [0, 0, 1, np.ptp(vertices) / 2], random.random(seed % 4 + 2)])
    made = simplify(poses, triangles, 1, looks=looks, lines=lines, balls=balls)
    for step in range(len(made.faces) + 1):
        level = made.after(step)
        if len(level.triangles):
            assert 0 <= level.triangles.min() <= level.triangles.max() == len(level.positions) - 1
        assert np.isfinite(level.positions).all()
        a, b, c = whole(level).T
        assert not ((a == b) | (b == c) | (c == a)).any()


def test_huge_and_tiny_meshes_give_the_same_triangles() -> None:
    vertices, triangles = ball()
    levels = [
        simplify(vertices[None] * scale, triangles, 200).level(200) for scale in (1.0, 2.0**20, 2.0**-20)
    ]
    for level in levels[1:]:
        np.testing.assert_array_equal(level.triangles, levels[0].triangles)


def test_a_single_triangle_and_a_tetrahedron_stay() -> None:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    for triangles in ([[0, 1, 2]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]):
        made = simplify(corners[None], np.array(triangles), 1)
        assert len(made.faces) == 0
        assert len(made.level(1).triangles) == len(triangles)


@pytest.mark.parametrize(
    ("poses", "triangles", "more", "message"),
    [
        (np.zeros((3, 3)), [[0, 1, 2]], {}, r"poses must have shape \(K, N, 3\)"),
        (np.zeros((0, 3, 3)), [[0, 1, 2]], {}, "at least one"),
        (np.full((1, 3, 3), np.nan), [[0, 1, 2]], {}, "not finite"),
        (np.zeros((1, 3, 3)), [[0, 1, 3]], {}, "vertices beyond the 3"),
        (np.zeros((1, 3, 3)), [[0, 1, -1]], {}, "vertices beyond the 3"),
        (np.zeros((1, 3, 3)), [[0.0, 1, 2]], {}, "whole numbers"),
        (np.zeros((1, 3, 3)), [0, 1, 2], {}, "whole numbers"),
        (np.zeros((1, 3, 3)), [[0, 1, 2]], {"importance": np.ones(2)}, "importance must be 3 numbers"),
        (np.full((1, 3, 3), 1e21), [[0, 1, 2]], {}, r"vertex 0 is at .* in pose 0, beyond 1e\+20"),
        (np.zeros((1, 3, 3)), [[0, 1, 2]], {"importance": np.full(3, np.nan)}, "importance must be 3"),
        (np.zeros((1, 3, 3)), [[0, 1, 2]], {"lines": np.full(3, np.inf)}, "lines must be 3 whole numbers"),
        (np.zeros((1, 3, 3)), [[0, 1, 2]], {"lines": np.array([0, 0, -1])}, "lines must be 3 whole numbers"),
        (np.zeros((1, 3, 3)), [[0, 1, 2]], {"balls": np.ones((1, 8))}, "at least two radii"),
        (np.zeros((1, 3, 3)), [[0, 1, 2]], {"balls": [0, 0, 0, 0, 0, 1, 0, 1, 1]}, "ball 0 .* its size"),
        (np.zeros((1, 3, 3)), [[0, 1, 2]], {"balls": [0, 0, 0, 0, 0, 2, 1, 1, 1]}, "its gaze of length 1"),
        (np.zeros((1, 3, 3)), [[0, 1, 2]], {"balls": [0, 0, 0, 0, 0, 1, 1, 1, -1]}, "no radius below 0"),
        (np.zeros((1, 3, 3)), [[0, 1, 2]], {"balls": [0, 0, 0, 0, 0, 1, 1, 1, np.nan]}, "must be finite"),
        (np.zeros((1, 3, 3)), [[0, 1, 2]], {"importance": np.full(3, -1.0)}, "importance must be 3 numbers"),
        (np.zeros((1, 3, 3)), [[0, 1, 2]], {"looks": np.zeros((2, 2))}, "looks must have 3 rows"),
    ],
)
def test_meshes_that_do_not_agree_are_refused(
    poses: Float64, triangles: list[object], more: dict[str, Float64], message: str
) -> None:
    with pytest.raises(ModelError, match=message):
        simplify(poses, np.array(triangles), 1, **more)


def test_a_mesh_without_area_gives_no_level() -> None:
    made = simplify(np.zeros((1, 3, 3)), np.array([[0, 1, 2]]), 1)
    with pytest.raises(ModelError, match="no triangle is left"):
        made.level(1)
