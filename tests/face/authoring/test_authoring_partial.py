"""Heads with something missing, and meshes that cannot be a head."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from fba.errors import ModelError
from fba.face import FaceModel
from fba.face.authoring import author
from fba.face.authoring._author import author_lids
from fba.face.checks import check_faps
from fba.face.model import Part
from fba.parameters import point_rows
from grid_head import grid_head


@pytest.fixture
def parts() -> list[Part]:
    return grid_head()[0]


@pytest.fixture
def points() -> np.ndarray:
    return grid_head()[1]


@pytest.fixture
def bound() -> np.ndarray:
    return grid_head()[2]


def without(points: np.ndarray, bound: np.ndarray, *names: str) -> tuple[np.ndarray, np.ndarray]:
    points, bound = points.copy(), bound.copy()
    rows = [point_rows()[name] for name in names]
    points[rows], bound[rows] = np.nan, -1
    return points, bound


def ways(model: FaceModel, fap: int, part: str) -> np.ndarray:
    """(V,) how far each vertex of a part goes at 100, in FAPU."""
    result = np.zeros(len(model.part(part).vertices))
    for mesh in model.table_of[fap].meshes:
        if mesh.part == part:
            result[mesh.vertices] = np.linalg.norm(mesh.shift(100), axis=1)
    return result


def test_without_eyes_tongue_and_teeth_the_rest_plays() -> None:
    parts, points, bound = grid_head(eyes=False, mouth=False)
    model = author(parts, points, bound=bound)
    assert set(model.lost) == {23, 24, 25, 26, 27, 28, 29, 30, 43, 44, 45, 46, 47}
    assert model.lost[23] == "there is no left eyeball"
    assert model.lost[45] == "there is no tongue"
    assert set(model.table_of) == set(range(3, 69)) - set(model.lost)


def test_an_eye_without_a_lids_margin_has_no_opening() -> None:
    """A shape may close an eye of which a feature point is missing, so that no margin is found."""
    parts, points, bound = grid_head()
    corners = ("3.7", "3.11", "3.1")
    upper_lid = points[point_rows()["3.1"]].copy()
    model = author(parts, points, bound=bound)
    shape = np.zeros((sum(len(part.vertices) for part in parts), 3))
    assert author_lids(model, {19: [shape]}) == {}
    lost_points, lost_bound = model.points.copy(), model.bound.copy()
    lost_bound[[point_rows()[name] for name in corners]] = -1
    lost_points[point_rows()["3.1"]] = upper_lid + np.array([0, 0, 0.05])
    lost = replace(model, points=lost_points, bound=lost_bound)
    assert author_lids(lost, {19: [shape], 21: [shape]}) == {}


@pytest.mark.parametrize(
    "faps_of",
    [
        {"4.1": {31, 37}, "9.3": {63, 64}, "2.6": {8}},
        {"2.10": {18}, "5.3": {41}, "10.3": {67}},
        {"8.7": {57}, "2.1": {3, 14, 15}, "3.1": {19, 21}},
    ],
    ids=" ".join,
)
def test_missing_points_lose_their_faps_alone(
    parts: list[Part], points: np.ndarray, bound: np.ndarray, faps_of: dict[str, set[int]]
) -> None:
    """Points of different regions, so that each reason must name its own."""
    upper_lid = points[point_rows()["3.1"]].copy()
    points, bound = without(points, bound, *faps_of)
    if "3.1" in faps_of:  # its height is needed for IRISD0
        points[point_rows()["3.1"]] = upper_lid + np.array([0, 0, 0.05])
    model = author(parts, points, bound=bound)
    assert set(model.lost) == set.union(*faps_of.values())
    for point, faps in faps_of.items():
        assert all(point in model.lost[fap] or "margin" in model.lost[fap] for fap in faps)


def test_a_point_far_from_the_mesh_is_named_with_its_distance(
    parts: list[Part], points: np.ndarray, bound: np.ndarray
) -> None:
    row = point_rows()["9.3"]
    points[row] += (0, 0, 0.05)
    bound[row] = -1
    model = author(parts, points, bound=bound)
    assert set(model.lost) == {63, 64}
    assert "9.3" in model.lost[63]
    assert " mm away" in model.lost[63]
    assert model.bound[row] == -1
    np.testing.assert_array_equal(model.points[row], points[row])


def test_lips_that_are_one_cannot_part(parts: list[Part], points: np.ndarray, bound: np.ndarray) -> None:
    for upper, lower in (("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9")):
        bound[point_rows()[lower]] = bound[point_rows()[upper]]
    model = author(parts, points, bound=bound)
    assert "no opening" in model.lost[4]
    assert {4, 5} <= set(model.lost)
    assert {3, 19, 31, 51, 52} <= set(model.table_of)


def test_small_parts_on_the_skin_are_carried_and_others_are_not(
    parts: list[Part], points: np.ndarray, bound: np.ndarray
) -> None:
    brow = points[point_rows()["4.1"]]
    patch = np.array([(x, y, 0.0006) for y in (-0.001, 0.001) for x in (-0.003, 0, 0.003)])
    faces = np.array([(0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4)])
    extra = [
        Part("brow", "brow", brow + patch, faces),
        Part("mole", "other", points[point_rows()["5.1"]] + patch, faces),
        Part("shirt", "other", points[point_rows()["2.1"]] + patch * 40, faces),
        Part("hair", "hair", brow + patch, faces),
    ]
    model = author([*parts, *extra], points, bound=bound)
    np.testing.assert_allclose(ways(model, 31, "brow"), 100, rtol=0.15)
    assert ways(model, 39, "mole").min() > 60
    for fap in (3, 14, 31):
        assert ways(model, fap, "shirt").max() == 0
        assert ways(model, fap, "hair").max() == 0


def test_lashes_turn_with_their_lid(parts: list[Part], points: np.ndarray, bound: np.ndarray) -> None:
    root = points[point_rows()["3.1"]] + (0, 0, 0.0002)
    hair = np.array([(-0.0005, 0, 0), (0.0005, 0, 0), (-0.0003, 0.001, 0.006), (0.0003, 0.001, 0.006)])
    lash = Part("lash", "lash", root + hair, np.array([(0, 1, 3), (0, 3, 2)]))
    model = author([*parts, lash], points, bound=bound)
    mesh = next(mesh for mesh in model.table_of[19].meshes if mesh.part == "lash")
    shift = np.zeros((4, 3))
    shift[mesh.vertices] = mesh.shift(700) * model.fapu.IRISD
    height = 700 * model.fapu.IRISD
    assert shift[0, 1] == pytest.approx(-height, rel=0.05)
    place = lash.vertices + shift
    # as long as before, and its tip further down than its root
    length = [np.linalg.norm(v[2] - v[0]) for v in (lash.vertices, place)]
    assert length[1] == pytest.approx(length[0], rel=0.02)
    assert place[2, 1] < place[0, 1]
    assert all(mesh.part != "lash" for mesh in model.table_of[20].meshes)


def test_pieces_of_skin_that_hang_on_nothing_stay(
    parts: list[Part], points: np.ndarray, bound: np.ndarray
) -> None:
    patch = np.array([(0.0, 0.3, 0.0), (0.01, 0.3, 0.0), (0.0, 0.31, 0.0)])
    skin = parts[0]
    count = len(skin.vertices)
    triangles = np.vstack([skin.triangles, [[count, count + 1, count + 2]]])
    whole = Part("skin", "skin", np.vstack([skin.vertices, patch]), triangles)
    bound = np.where(bound >= count, bound + 3, bound)
    model = author([whole, *parts[1:]], points, bound=bound)
    assert not model.lost
    for table in model.table_of.values():
        for mesh in table.meshes:
            assert mesh.part != "skin" or mesh.vertices.max() < count


def test_edges_of_three_triangles_and_doubled_ones_do_no_harm(
    parts: list[Part], points: np.ndarray, bound: np.ndarray
) -> None:
    skin = parts[0]
    a, b = (
        bound[point_rows()["5.1"]],
        skin.triangles[(skin.triangles == bound[point_rows()["5.1"]]).any(axis=1)][0],
    )
    other = next(v for v in b if v != a)
    fin = skin.vertices[a] + (0.004, 0, 0.004)
    triangles = np.vstack([skin.triangles, [[a, other, len(skin.vertices)]], skin.triangles[:3]])
    whole = Part("skin", "skin", np.vstack([skin.vertices, fin]), triangles)
    bound = np.where(bound >= len(skin.vertices), bound + 1, bound)
    model = author([whole, *parts[1:]], points, bound=bound)
    assert not model.lost
    assert ways(model, 39, "skin")[-1] > 30  # the fin goes with the cheek


def test_parts_without_skin_are_refused(parts: list[Part], points: np.ndarray) -> None:
    with pytest.raises(ModelError, match=r"a part of kind 'skin'.*'left eye' \(eye, \d+ triangles\)"):
        author(parts[1:], points)
    with pytest.raises(ModelError, match=r"kind 'skin'.*there are none"):
        author([], points)
    empty = Part("skin", "skin", np.zeros((0, 3)), np.zeros((0, 3), dtype=int))
    with pytest.raises(ModelError, match="kind 'skin'"):
        author([empty], points)


def test_a_mesh_beyond_the_limit_is_refused_at_once(
    parts: list[Part], points: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.modules["fba.face.authoring._author"], "MOST_VERTICES", 5000)
    with pytest.raises(ModelError, match=r"has \d+ vertices, but at most 5000 .* decimate"):
        author(parts, points)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.zeros((83, 3)), r"must have shape \(84, 3\), not \(83, 3\)"),
        (np.full((84, 3), np.nan), "only 0 of the 84 feature points are known"),
        (np.full((84, 3), np.inf), "feature point 2.1 is infinite"),
        (np.zeros((84, 3)), "feature points are far from the mesh"),
    ],
)
def test_points_that_make_no_face(parts: list[Part], points: np.ndarray, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        author(parts, points)


def test_points_in_another_unit_are_recognised(parts: list[Part], points: np.ndarray) -> None:
    with pytest.raises(ModelError, match=r"far from the mesh.*same unit and axes"):
        author(parts, points * 1000)


@pytest.mark.parametrize("number", [10**6, -2])
def test_bound_vertices_must_exist(
    parts: list[Part], points: np.ndarray, bound: np.ndarray, number: int
) -> None:
    bound[point_rows()["4.3"]] = number
    with pytest.raises(ModelError, match=rf"4\.3 is bound to vertex {number}"):
        author(parts, points, bound=bound)


@pytest.mark.parametrize("bad", [[0, 1], np.zeros(84)])
def test_bound_must_be_a_list_of_whole_numbers(parts: list[Part], points: np.ndarray, bad: object) -> None:
    with pytest.raises(ModelError, match="84 whole numbers"):
        author(parts, points, bound=bad)  # type: ignore[arg-type]


def test_a_face_without_height_of_the_eye_opening_has_no_unit(
    parts: list[Part], points: np.ndarray, bound: np.ndarray
) -> None:
    for upper, lower in (("3.1", "3.3"), ("3.2", "3.4")):
        bound[point_rows()[lower]] = bound[point_rows()[upper]]
    with pytest.raises(ModelError, match="IRISD0 is 0"):
        author(parts, points, bound=bound)


def test_a_point_of_a_lip_on_the_vertex_of_another_is_lost_alone(
    parts: list[Part], points: np.ndarray, bound: np.ndarray
) -> None:
    for point, other in (("2.6", "2.2"), ("8.8", "8.4")):
        points[point_rows()[point]], bound[point_rows()[point]] = (
            points[point_rows()[other]],
            bound[point_rows()[other]],
        )
    model = author(parts, points, bound=bound)
    assert model.lost == {
        8: "feature point 2.6 stands on the same vertex as 2.2, which has a FAP of its own",
        58: "feature point 8.8 stands on the same vertex as 8.4, which has a FAP of its own",
    }
    errors = [
        finding for finding in check_faps(model, [4, 6, 7, 51, 53, 54, 60]) if finding.severity == "error"
    ]
    assert not errors


def test_a_drawn_lash_stays_with_its_lid_as_the_brow_rises(
    parts: list[Part], points: np.ndarray, bound: np.ndarray
) -> None:
    """It is so broad that it lies on skin that the brow lifts, which took it along."""
    skin = next(part for part in parts if part.kind == "skin")
    margin, brow = (points[point_rows()[name]] for name in ("3.1", "4.3"))
    band = np.stack(
        [margin + share * (brow - margin) + (x, 0, 0.001) for share in (0.0, 0.8) for x in (0, 0.004)]
    )
    lash = Part("lash", "lash", band.astype(np.float32), np.array([(0, 1, 3), (0, 3, 2)], dtype=np.int32))
    model = author([*parts, lash], points, bound=bound)
    moved = {mesh.part for mesh in model.table_of[33].meshes}
    assert moved == {skin.name}
    assert "lash" in {mesh.part for mesh in model.table_of[19].meshes}
