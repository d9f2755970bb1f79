"""Tables made from a mesh and its feature points: what moves, how far, and what stays."""

from functools import cache

import numpy as np
import pytest

from fba.face import FaceModel
from fba.face.authoring import author
from fba.face.checks import check_faps
from fba.face.deform._deformer import Deformer
from fba.face.points import DIRECTIONS
from fba.parameters import faps, point_rows
from grid_head import EYE_RADIUS, grid_head

TRANSLATING = [
    fap.number
    for fap in faps()
    if fap.positive in DIRECTIONS and fap.unit not in ("", "AU") and fap.number not in (27, 28)
]
ALONG_AN_ARC = {3, 19, 20, 21, 22}
STRETCHING = (6, 7)
LIP_PAIRS = [(f.number, f.lip_mate) for f in faps() if f.group == 2 and f.lip_mate]


@pytest.fixture(scope="module")
def head() -> FaceModel:
    parts, points, bound = grid_head()
    return author(parts, points, bound=bound, name="grid", notes={"origin": "a test"})


@cache
def deformer(model: FaceModel) -> Deformer:
    """The deformer of a model, made once."""
    return Deformer(model)


def moved(model: FaceModel, values: dict[int, float]) -> np.ndarray:
    """(V, 3) shifts, by the deformer that players use."""
    row = np.zeros(68)
    for fap, value in values.items():
        row[fap - 1] = value
    return np.asarray(deformer(model).local(row), dtype=np.float64) - model.vertices


def vertex(model: FaceModel, point: str) -> int:
    return int(model.bound[point_rows()[point]])


def _normals(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    first, second, third = (vertices[triangles[:, k]] for k in range(3))
    return np.cross(second - first, third - first)


def test_every_fap_has_tables(head: FaceModel) -> None:
    assert not head.lost
    assert set(head.table_of) == {fap.number for fap in faps()[2:]}
    assert head.name == "grid"
    assert head.notes == {"origin": "a test"}


def test_nothing_is_found_wrong(head: FaceModel) -> None:
    assert [str(finding) for finding in check_faps(head)] == []


@pytest.mark.parametrize("number", TRANSLATING)
def test_own_point_moves_by_value_times_unit(head: FaceModel, number: int) -> None:
    fap = faps()[number - 1]
    wanted = 10 * head.fapu[fap.unit] * np.array(DIRECTIONS[fap.positive])
    way = moved(head, {number: 10})[vertex(head, fap.feature_points[0])]
    if number in ALONG_AN_ARC:
        way[2] = 0
    np.testing.assert_allclose(way, wanted, atol=0.05 * np.linalg.norm(wanted))


@pytest.mark.parametrize("number", [n for n in TRANSLATING if faps()[n - 1].left_right_mate])
def test_mates_mirror_each_other_and_leave_each_other_alone(head: FaceModel, number: int) -> None:
    fap = faps()[number - 1]
    mate = faps()[(fap.left_right_mate or 0) - 1]
    own, other = vertex(head, fap.feature_points[0]), vertex(head, mate.feature_points[0])
    shift = moved(head, {number: 100})
    assert np.linalg.norm(shift[other]) < 0.01 * np.linalg.norm(shift[own])
    mirrored = moved(head, {mate.number: 100})[other] * (-1, 1, 1)
    np.testing.assert_allclose(shift[own], mirrored, atol=1e-5)


@pytest.mark.parametrize("number", [4, 8, 9, 51, 55, 56])
def test_an_upper_lip_point_never_grips_the_lower_lip(head: FaceModel, number: int) -> None:
    shift = np.linalg.norm(moved(head, {number: 200}), axis=1)
    for name in ("2.3", "2.8", "2.9", "8.2", "8.7", "8.8"):
        assert shift[vertex(head, name)] < 0.01 * shift.max(), name


@pytest.mark.parametrize("number", [5, 10, 11, 52, 57, 58])
def test_a_lower_lip_point_never_grips_the_upper_lip(head: FaceModel, number: int) -> None:
    shift = np.linalg.norm(moved(head, {number: -200}), axis=1)
    for name in ("2.2", "2.6", "2.7", "8.1", "8.5", "8.6"):
        assert shift[vertex(head, name)] < 0.01 * shift.max(), name


@pytest.mark.parametrize(("inner", "outer"), LIP_PAIRS)
def test_inner_and_outer_lip_together_go_straight(head: FaceModel, inner: int, outer: int) -> None:
    """Each alone may stop where skin would fold; both together carry on."""
    for sign in (1, -1):
        small = moved(head, {inner: 10 * sign, outer: 10 * sign})
        large = moved(head, {inner: 100 * sign, outer: 100 * sign})
        # A mouth that is drawn wide bends round the teeth.
        axes = slice(0, 2) if sign > 0 and inner in STRETCHING else slice(0, 3)
        np.testing.assert_allclose(large[:, axes], 10 * small[:, axes], atol=2e-5)


def test_the_jaw_is_a_hinge_in_at_least_five_intervals(head: FaceModel) -> None:
    skin = next(mesh for mesh in head.table_of[3].meshes if mesh.part == "skin")
    assert np.count_nonzero(np.abs(skin.displacements).max(axis=(0, 2)) > 0) >= 5
    chin = vertex(head, "2.1")
    for value in (100, 333, 600):
        assert moved(head, {3: value})[chin, 1] == pytest.approx(-value * head.fapu.MNS, rel=0.01)


def test_lower_teeth_and_tongue_turn_rigidly_with_the_jaw(head: FaceModel) -> None:
    shift = moved(head, {3: 500})
    still = head.part("upper teeth")
    start = head.starts["upper teeth"]
    assert np.abs(shift[start : start + len(still.vertices)]).max() == 0
    for name in ("lower teeth", "tongue"):
        start, part = head.starts[name], head.part(name)
        before = part.vertices.astype(np.float64)
        after = before + shift[start : start + len(before)]
        assert after[:, 1].mean() < before[:, 1].mean() - 0.003
        # between two borders the arc is a chord
        lengths = [np.linalg.norm(place[1:] - place[:-1], axis=1) for place in (before, after)]
        np.testing.assert_allclose(lengths[1], lengths[0], atol=2e-5)


def test_the_jaw_leaves_lips_and_upper_face(head: FaceModel) -> None:
    shift = np.linalg.norm(moved(head, {3: 500}), axis=1)
    for name in ("2.2", "2.3", "2.4", "2.5", "8.1", "8.2", "8.3", "9.3", "3.1", "4.3", "10.1", "11.1"):
        assert shift[vertex(head, name)] < 1e-5, name
    # and the neck's lower end
    rim = head.part("skin").vertices[:, 1] < -0.127
    assert shift[: len(rim)][rim].max() < 1e-6


@pytest.mark.parametrize("split", [1024, 700, 512, 424])
def test_lids_meet_at_1024(head: FaceModel, split: int) -> None:
    for pair, (top, bottom) in (((19, 21), ("3.1", "3.3")), ((20, 22), ("3.2", "3.4"))):
        place = head.vertices + moved(head, {pair[0]: split, pair[1]: 1024 - split})
        gap = np.linalg.norm(place[vertex(head, top)] - place[vertex(head, bottom)])
        assert gap < 0.02 * head.fapu.IRISD * 1024


def test_closing_lids_stay_outside_the_eyeball(head: FaceModel) -> None:
    centre = head.points[point_rows()["3.5"]] - (0, 0, EYE_RADIUS)
    skin = len(head.part("skin").vertices)
    for value in (200, 500, 800, 1024):
        place = (head.vertices + moved(head, {19: value}))[:skin]
        assert np.linalg.norm(place - centre, axis=1).min() > EYE_RADIUS


@pytest.mark.parametrize(("number", "side", "axis"), [(23, 3.5, 0), (24, 3.6, 0), (25, 3.5, 1), (26, 3.6, 1)])
def test_eyeballs_turn_about_their_centres(head: FaceModel, number: int, side: float, axis: int) -> None:
    pupil = vertex(head, str(side))
    centre = head.points[point_rows()[str(side)]] - (0, 0, EYE_RADIUS)
    place = (head.vertices + moved(head, {number: 20000}))[pupil] - centre
    assert np.linalg.norm(place) == pytest.approx(EYE_RADIUS, rel=1e-3)
    # 0.2 rad: yaw to the subject's left is +x, pitch goes down
    assert place[axis] == pytest.approx((1, -1)[axis] * EYE_RADIUS * np.sin(0.2), rel=1e-2)


def test_a_pupil_dilates_on_its_eyeball(head: FaceModel) -> None:
    eye = head.part("left eye").vertices.astype(np.float64)
    centre = head.points[point_rows()["3.5"]] - (0, 0, EYE_RADIUS)
    radius = head.fapu.IRISD * 1024 / 6
    off_axis = np.hypot(*(eye - centre)[:, :2].T)
    rim = (np.abs(off_axis - radius) < 0.25 * radius) & (eye[:, 2] > centre[2])
    start = head.starts["left eye"]
    place = (head.vertices + moved(head, {29: 200}))[start : start + len(eye)][rim]
    grown = np.hypot(*(place - centre)[:, :2].T) / off_axis[rim]
    # the pupil is a third of the iris: 200 steps of its diameter's unit add 200 / 341 of it
    inside = off_axis[rim] <= radius
    np.testing.assert_allclose(grown[inside], 1 + 200 * 3 / 1024, rtol=0.02)
    np.testing.assert_allclose(np.linalg.norm(place - centre, axis=1), EYE_RADIUS, rtol=0.03)


def test_tongue_rolls_up_on_both_sides(head: FaceModel) -> None:
    place = head.vertices + moved(head, {47: 50000})
    middle, left, right = (place[vertex(head, name)] for name in ("6.2", "6.3", "6.4"))
    arm = head.vertices[vertex(head, "6.3")] - head.vertices[vertex(head, "6.2")]
    rest = np.arctan2(arm[1], arm[0])
    for tip, sign in ((left, 1), (right, -1)):
        x, y = (tip - middle)[:2]
        assert np.arctan2(y, sign * x) - rest == pytest.approx(0.5, rel=0.1)


def test_values_beyond_the_range_move_nothing_further(head: FaceModel) -> None:
    for fap in faps()[2:]:
        if fap.i_limits is None or head.table_of[fap.number].transforms:
            continue
        limit = fap.i_limits[1] * fap.step
        at_limit, beyond = (moved(head, {fap.number: value}) for value in (limit + 1500, 40 * limit + 1500))
        np.testing.assert_allclose(beyond, at_limit, atol=1e-5, err_msg=fap.name)


@pytest.mark.parametrize("number", [n for n in TRANSLATING if n not in ALONG_AN_ARC])
def test_no_triangle_turns_over_at_the_limits(head: FaceModel, number: int) -> None:
    fap = faps()[number - 1]
    assert fap.i_limits is not None
    triangles = head.triangles
    neutral = head.vertices.astype(np.float64)
    normal = _normals(neutral, triangles)
    for limit in fap.i_limits:
        place = neutral + moved(head, {number: limit * fap.step})
        now = _normals(place, triangles)
        assert ((normal * now).sum(axis=1) > 0).all()


def test_points_find_their_vertices_by_themselves(head: FaceModel) -> None:
    """Upper and lower lip lie on each other, and so do upper and lower teeth: still each gets its own."""
    parts, points, bound = grid_head()
    alone = author(parts, points)
    found = [n for n in point_rows() if alone.bound[point_rows()[n]] != bound[point_rows()[n]]]
    assert found == []


def test_both_sides_of_a_texture_seam_move_alike(head: FaceModel) -> None:
    from fba.face.model import Part

    parts, points, bound = grid_head()
    skin = parts[0]
    # cut the mask in two along the midline, as a texture may
    right = skin.vertices[skin.triangles].mean(axis=1)[:, 0] < 0
    used = np.unique(skin.triangles[right])
    middle = used[np.isin(used, skin.triangles[~right])]
    number = np.arange(len(skin.vertices))
    number[middle] = len(skin.vertices) + np.arange(len(middle))
    triangles = skin.triangles.copy()
    triangles[right] = number[triangles[right]]
    split = Part("skin", "skin", np.vstack([skin.vertices, skin.vertices[middle]]), triangles)
    bound = np.where(bound >= len(skin.vertices), bound + len(middle), bound)
    model = author([split, *parts[1:]], points, bound=bound)
    for fap in (3, 4, 31, 63, 51):
        shift = moved(model, {fap: 200})
        np.testing.assert_array_equal(
            shift[middle], shift[len(skin.vertices) : len(skin.vertices) + len(middle)]
        )
