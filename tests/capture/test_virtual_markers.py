"""Virtual markers: the walk over the mesh, weights, and a head that moves as its markers do."""

import warnings
from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np
import pytest

from fba.capture.markers._motion import MarkerMotion
from fba.capture.virtual_markers import (
    MarkedHead,
    MarkerMapping,
    VirtualMarker,
    find_influence,
    head_of_model,
    move_head,
    propose_mapping,
)
from fba.capture.virtual_markers.influence import WalkedMesh, give_to_nearest
from fba.capture.virtual_markers.mapping import find_weights
from fba.errors import FbaWarning, ModelError, OptionError
from fba.face import Deformer, FaceModel
from fba.face.authoring.surface.landmarks import find_landmarks
from fba.face.model import Part
from fba.parameters import point_rows
from tools.captures.marked_actor import Take
from tools.captures.marked_actor import perform as act

EXAMPLE = np.array([
    (0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 6), (0, 6, 7), (0, 7, 1), (1, 2, 10), (1, 10, 9), (1, 9, 7),
    (2, 3, 11), (2, 11, 10), (3, 11, 4), (4, 6, 7), (4, 7, 5), (5, 7, 8), (7, 8, 9),
])  # fmt: skip
"""The triangles of the worked example in the source of the method, figures 3.6 and 3.7."""
INSIDE = (0, 1, 2, 3, 5, 6, 7)
"""What is within the radius there."""


def test_the_worked_example_of_the_source() -> None:
    places = np.zeros((12, 3))
    for vertex in range(12):
        angle = 2 * np.pi * vertex / 12
        far = 0.5 if vertex in INSIDE else 2.0
        places[vertex] = (0, 0, 0) if vertex == 0 else (far * np.cos(angle), far * np.sin(angle), 0.0)
    found = find_influence(places, EXAMPLE, 0, 1.0)
    assert found.vertices.tolist() == [0, 1, 2, 3, 6, 7, 5]  # one visit each: 7 calls
    assert found.levels.tolist() == [1, 2, 2, 2, 2, 2, 3]  # on 3 levels
    np.testing.assert_allclose(found.shares, [1, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5])


def grid(wide: int, high: int, z: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A sheet of squares 1 wide, cut into triangles: vertex x + y * (wide + 1) is at (x, y, z)."""
    y, x = np.mgrid[: high + 1, : wide + 1]
    places = np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], axis=1).astype(float)
    corner = (np.arange(wide)[None] + np.arange(high)[:, None] * (wide + 1)).ravel()
    up = wide + 1
    triangles = np.concatenate([
        np.stack([corner, corner + 1, corner + up + 1], axis=1),
        np.stack([corner, corner + up + 1, corner + up], axis=1),
    ])  # fmt: skip
    return places, triangles


def test_weights_fall_off_linearly_within_a_cylinder() -> None:
    places, triangles = grid(10, 10)
    places[:, 2] = 0.9 * places[:, 0]  # a slope: deeper than the cylinder at its sides
    centre = 5 + 5 * 11
    found = find_influence(places, triangles, centre, 4.0, 1.0)
    away = np.linalg.norm(places[found.vertices] - places[centre], axis=1)
    np.testing.assert_allclose(found.shares, 1 - away / 4.0)
    beside = places - places[centre]
    expected = (np.hypot(beside[:, 0], beside[:, 1]) < 4) & (np.abs(beside[:, 2]) <= 1.0)
    assert sorted(found.vertices) == np.flatnonzero(expected).tolist()
    long = find_influence(places, triangles, centre, 4.0, 9.0)
    assert len(long.vertices) > len(found.vertices)
    assert long.shares.min() == 0  # farther than the radius, as the cylinder is longer than wide


def test_lips_that_touch_are_not_joined() -> None:
    upper, triangles = grid(10, 4)
    lower = upper * (1, -1, 1) - (0, 1e-3, 0)
    both = np.concatenate([upper, lower])
    found = find_influence(both, np.concatenate([triangles, triangles + len(upper)]), 5, 3.0)
    assert found.vertices.max() < len(upper)
    near = np.linalg.norm(both - both[5], axis=1) < 3
    assert near[len(upper) :].any()  # which a search by distance alone would take


def test_wrong_centres_and_sizes_are_refused() -> None:
    places, triangles = grid(2, 2)
    with pytest.raises(ModelError, match="no vertex 9: the mesh has 9, counted from 0"):
        find_influence(places, triangles, 9, 1.0)
    for radius, depth in ((0.0, 1.0), (1.0, -1.0), (np.nan, 1.0), (1.0, np.inf)):
        with pytest.raises(ModelError, match="must be positive numbers"):
            find_influence(places, triangles, 4, radius, depth)


@pytest.mark.parametrize("vertex", [-1, 9])
def test_triangles_of_vertices_that_are_not_there_are_refused(vertex: int) -> None:
    places, triangles = grid(2, 2)
    triangles = triangles.copy()
    triangles[-1, 2] = vertex
    with pytest.raises(ModelError, match="triangles name vertices that there are not: the mesh has 9"):
        find_influence(places, triangles, 4, 1.0)


def test_influences_beyond_the_memory_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fba.capture.virtual_markers.influence.MAX_SHARES", 100)
    with pytest.raises(ModelError, match="the first 2 virtual markers move 162 vertices together"):
        WalkedMesh(*grid(8, 8)).walk([(40, 50.0, 50.0), (41, 50.0, 50.0)])


def test_exclusive_vertices_go_to_the_nearest_marker() -> None:
    mesh = WalkedMesh(*grid(10, 1))
    shared = mesh.walk([(2, 5.0, 5.0), (6, 9.0, 9.0)])
    alone = give_to_nearest(shared)
    assert 4 in shared[0].vertices
    assert 4 in shared[1].vertices
    assert 4 in alone[0].vertices  # as far from both: the first keeps it
    assert set(alone[0].vertices) & set(alone[1].vertices) == set()
    assert set(alone[1].vertices) >= {5, 6, 7, 8, 9, 10}
    assert set(np.concatenate([each.vertices for each in alone])) == set(
        np.concatenate([each.vertices for each in shared])
    )
    assert give_to_nearest([]) == []


def sheet(wide: int = 20, high: int = 20) -> MarkedHead:
    """A flat head of one sheet, without feature points."""
    places, triangles = grid(wide, high)
    part = Part("sheet", "skin", places.astype(np.float32), triangles.astype(np.int32))
    rows = np.arange(len(places))
    return MarkedHead(
        "sheet", (part,), (rows,), places, np.full((84, 3), np.nan), np.full(84, -1, np.int32), 1.0
    )


CORNERS = {"A": 0, "B": 20, "C": 420, "D": 440}
"""Fixed markers of the sheet."""
MIDDLE, BESIDE = 10 + 10 * 21, 12 + 10 * 21


def mapping(**options: object) -> MarkerMapping:
    markers = {name: VirtualMarker(vertex, 2.0, 2.0, fixed=True) for name, vertex in CORNERS.items()}
    markers |= {"M": VirtualMarker(MIDDLE, 5.0, 5.0), "N": VirtualMarker(BESIDE, 5.0, 5.0)}
    return MarkerMapping(markers, scale=("A", "D"), **options)  # type: ignore[arg-type]


def capture(
    scale: float = 0.01, turn: np.ndarray | None = None, shift: tuple[float, float, float] = (0, 0, 0)
) -> MarkerMotion:
    """The sheet's markers in a smaller world: M rises by 1 unit of the sheet, N goes 2 to the left."""
    names = (*CORNERS, "M", "N")
    rest = sheet().vertices[[*CORNERS.values(), MIDDLE, BESIDE]]
    positions = np.repeat(rest[None], 40, axis=0)
    grown = np.clip((np.arange(40) - 15) / 10, 0, 1)
    positions[:, 4, 2] += grown
    positions[:, 5, 0] += 2 * grown
    turned = positions @ (np.eye(3) if turn is None else turn).T
    return MarkerMotion(names, scale * turned + np.array(shift), np.arange(40) / 50, Fraction(50))


def test_centres_go_where_their_markers_go() -> None:
    shown = move_head(capture(), sheet(), mapping())
    moved = shown.vertices(39) - sheet().vertices
    np.testing.assert_allclose(moved[MIDDLE], (0, 0, 1), atol=1e-9)
    np.testing.assert_allclose(moved[BESIDE], (2, 0, 0), atol=1e-9)
    np.testing.assert_allclose(moved[list(CORNERS.values())], 0, atol=1e-9)
    assert shown.scale == pytest.approx(100)
    np.testing.assert_allclose(shown.vertices(0), sheet().vertices, atol=1e-9)
    np.testing.assert_allclose(shown.vertices_between(15, 25, 0.5)[MIDDLE, 2], 0.5, atol=1e-9)


def test_added_displacements_are_those_of_the_source() -> None:
    moved = move_head(capture(), sheet(), mapping(overlap="add")).vertices(39) - sheet().vertices
    away = np.linalg.norm(sheet().vertices - sheet().vertices[[MIDDLE, BESIDE]][:, None], axis=2)
    by_middle, by_beside = np.maximum(1 - away / 5, 0)
    np.testing.assert_allclose(moved[:, 2], by_middle, atol=1e-9)
    np.testing.assert_allclose(moved[:, 0], 2 * by_beside, atol=1e-9)
    alone = move_head(capture(), sheet(), mapping(overlap="add", assignment="exclusive")).vertices(39)
    assert not ((alone[:, 2] > 0) & (alone[:, 0] != sheet().vertices[:, 0])).any()


QUARTERS = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def test_axes_and_place_of_the_capture_do_not_matter() -> None:
    expected = move_head(capture(), sheet(), mapping()).vertices(39)
    shown = move_head(capture(3.0, QUARTERS, (5, -2, 9)), sheet(), mapping())
    np.testing.assert_allclose(shown.vertices(39), expected, atol=1e-9)
    np.testing.assert_allclose(shown.rotation[39], np.eye(3), atol=1e-9)
    np.testing.assert_allclose(shown.cloud[0, 4], sheet().vertices[MIDDLE], atol=1e-9)


def test_the_head_s_motion_is_taken_off_and_given_back() -> None:
    motion = capture()
    angle = 0.3
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    positions = motion.positions.copy()
    positions[30:] = positions[30:] @ turn.T + (0.02, 0.0, 0.01)
    shown = move_head(replace(motion, positions=positions), sheet(), mapping())
    np.testing.assert_allclose(
        shown.vertices(39), move_head(motion, sheet(), mapping()).vertices(39), atol=1e-6
    )
    pose = shown.pose_between(39, 39, 0.0)
    np.testing.assert_allclose(pose[:3, :3], turn, atol=1e-6)
    there = shown.vertices(39)[MIDDLE] @ pose[:3, :3].T + pose[:3, 3]
    np.testing.assert_allclose(there, 100 * positions[39, 4], atol=1e-4)
    np.testing.assert_allclose(shown.cloud[39, 4], there, atol=1e-4)
    half = shown.pose_between(29, 30, 0.5)
    assert np.degrees(np.arccos((np.trace(half[:3, :3]) - 1) / 2)) == pytest.approx(
        np.degrees(angle / 2), 1e-3
    )


def test_gaps_are_filled() -> None:
    motion = capture()
    positions = motion.positions.copy()
    positions[18:22, 4] = np.nan
    positions[5:9, 0] = np.nan
    shown = move_head(replace(motion, positions=positions), sheet(), mapping())
    whole = move_head(motion, sheet(), mapping())
    np.testing.assert_allclose(shown.displacements, whole.displacements, atol=0.02)
    assert np.isnan(shown.cloud[20, 4]).all()


def test_motion_of_a_single_fixed_marker_is_noise() -> None:
    positions = capture().positions.copy()
    positions[20:, 1, 2] += 0.002
    shown = move_head(replace(capture(), positions=positions), sheet(), mapping())
    for name in CORNERS:
        assert not shown.displacements[:, shown.names.index(name)].any()
    assert shown.displacements[39, shown.names.index("M"), 2] == pytest.approx(1.0, abs=0.1)


def test_a_marker_that_is_never_seen_stays_where_it_is() -> None:
    positions = capture().positions.copy()
    positions[:, 5] = np.nan
    with pytest.warns(FbaWarning, match="seen in less than 10% of the frames, and left out: N"):
        shown = move_head(replace(capture(), positions=positions), sheet(), mapping())
    np.testing.assert_allclose(shown.vertices(39)[BESIDE], sheet().vertices[BESIDE], atol=1e-9)
    np.testing.assert_allclose(shown.vertices(39)[MIDDLE, 2], 1.0, atol=1e-9)


def without(*names: str) -> MarkerMapping:
    kept = {name: marker for name, marker in mapping().markers.items() if name not in names}
    return MarkerMapping(kept)


def test_mappings_that_fit_neither_capture_nor_head() -> None:
    with pytest.raises(ModelError, match=r"needs 3 fixed markers .* the mapping has 2: mark more"):
        move_head(capture(), sheet(), without("A", "B"))
    with pytest.raises(ModelError, match="all markers of the mapping are fixed"):
        move_head(capture(), sheet(), without("M", "N"))
    other = mapping().changed("Chin", VirtualMarker(7, 1.0, 1.0))
    with pytest.raises(
        ModelError, match="the capture has no marker Chin, which the mapping names; it has A, B"
    ):
        move_head(capture(), sheet(), other)
    far = mapping().changed("M", VirtualMarker(441, 1.0, 1.0))
    with pytest.raises(ModelError, match="'M' is at vertex 441, but sheet has 441 vertices, counted from 0"):
        move_head(capture(), sheet(), far)
    three = replace(capture(), names=("A", "B", "C"), positions=capture().positions[:, :3])
    with pytest.raises(ModelError, match="the capture has no marker D, M, N"):
        move_head(three, sheet(), mapping())
    with pytest.raises(ModelError, match="all markers of the mapping are fixed"):
        move_head(three, sheet(), without("D", "M", "N"))


def test_fixed_markers_at_one_place_give_no_scale() -> None:
    positions = capture().positions.copy()
    positions[:, 3] = positions[:, 0] + (1e-6, 0, 0)
    with pytest.raises(
        ModelError, match="the markers of 'A' and 'D', which tell the scale, are at one place"
    ):
        move_head(replace(capture(), positions=positions), sheet(), mapping())
    head = sheet()
    head.vertices[440] = head.vertices[0]
    with pytest.raises(
        ModelError, match="the vertices of 'A' and 'D', which tell the scale, are at one place"
    ):
        move_head(capture(), head, mapping())
    caps = {
        name: replace(marker, vertex=None) if marker.fixed and name != "A" else marker
        for name, marker in mapping().markers.items()
    }
    with pytest.raises(ModelError, match="scale needs two fixed markers with a vertex; the mapping has 1"):
        move_head(capture(), sheet(), MarkerMapping(caps))
    doubtful = mapping().changed("D", VirtualMarker(8 + 8 * 21, 2.0, 2.0, fixed=True))
    with pytest.warns(FbaWarning, match="by A and D the head is 40 times as large as the actor's, by all"):
        move_head(capture(), sheet(), replace(doubtful, scale=("A", "D")))


def test_a_changed_mesh_is_recognised() -> None:
    made = mapping().for_head(sheet())
    move_head(capture(), sheet(), made)
    with pytest.raises(ModelError, match="441 vertices and 800 triangles there, 462 and 840 here"):
        move_head(capture(), sheet(21, 20), made)
    head = sheet()
    part = replace(head.parts[0], triangles=head.parts[0].triangles[::-1])
    with pytest.raises(ModelError, match=r"made for another mesh .*its triangles join other vertices"):
        move_head(capture(), replace(head, parts=(part,)), made)
    with pytest.warns(FbaWarning, match="vertices were moved since the mapping was made"):
        move_head(capture(), replace(head, vertices=head.vertices + 0.01), made)


def test_contradictions_within_a_mapping() -> None:
    with pytest.raises(OptionError, match="'M' and 'N' are both at vertex 5"):
        MarkerMapping({"M": VirtualMarker(5, 1, 1), "N": VirtualMarker(5, 1, 1)})
    with pytest.raises(OptionError, match="scale: 'M' is no fixed marker with a vertex"):
        replace(mapping(), scale=("A", "M"))
    with pytest.raises(OptionError, match="two different markers"):
        replace(mapping(), scale=("A", "A"))
    with pytest.raises(OptionError, match="scale needs two markers, not 1"):
        replace(mapping(), scale=("A",))
    with pytest.raises(OptionError, match="overlap must be one of match, add"):
        mapping(overlap="mix")
    with pytest.raises(OptionError, match="without a vertex must be fixed"):
        VirtualMarker(None)
    with pytest.raises(OptionError, match="the radius must be a positive number, not nan"):
        VirtualMarker(1, float("nan"), 1.0)


def test_changing_a_mapping_keeps_it_consistent() -> None:
    moved = mapping().changed("N", VirtualMarker(MIDDLE, 1.0, 1.0))
    assert "M" not in moved.markers  # was at that vertex
    assert moved.scale == ("A", "D")
    assert mapping().changed("A", None).scale == ()
    assert mapping().changed("A", VirtualMarker(0, 1.0, 1.0)).scale == ()  # no longer fixed


@cache
def head() -> MarkedHead:
    return head_of_model(FaceModel.default())


@cache
def take() -> Take:
    return act(FaceModel.default(), 160, 50)


@cache
def proposed() -> MarkerMapping:
    return propose_mapping(take().motion, head())


def error_of(chosen: MarkerMapping) -> float:
    """Root mean square distance of the moving skin from where the FAPs put it, as a share of its motion."""
    shown = move_head(take().motion, head(), chosen)
    deformer = Deformer(FaceModel.default())
    faps = take().faps.astype(np.float32)
    faps[:, 47:50] = 0
    off, way = 0.0, 0.0
    for frame in range(30, 160, 20):
        truth = deformer.local(faps[frame]).astype(float)[head().face]
        own = head().vertices[head().face]
        moves = np.linalg.norm(truth - own, axis=1)
        moving = (moves > 5e-4) & (own[:, 2] > 0)
        off += float(((truth - shown.vertices(frame)[head().face])[moving] ** 2).sum())
        way += float((moves[moving] ** 2).sum())
    return float(np.sqrt(off / way))


def test_a_proposed_mapping_moves_a_head_as_its_actor_moved() -> None:
    assert proposed().fixed == ("FHC", "FHL", "FHR", "NSB", "EAL", "EAR")
    captured = [name for name, one in proposed().centres.items() if not one.follows]
    assert captured == list(take().motion.names)
    matched = error_of(proposed())
    assert matched < 0.36
    assert matched < 0.8 * error_of(replace(proposed(), assignment="exclusive"))
    assert matched < 0.65 * error_of(replace(proposed(), overlap="add"))


def test_inner_lips_follow_the_outer_ones() -> None:
    model, shown = FaceModel.default(), move_head(take().motion, head(), proposed())
    inner = {"LPT inner": "2.2", "LPB inner": "2.3", "LPL1 inner": "2.6", "LPR1 inner": "2.7",
             "LPL2 inner": "2.8", "LPR2 inner": "2.9"}  # fmt: skip
    following = {name for name, one in proposed().markers.items() if one.follows}
    assert {name for name in following if name.endswith(" inner")} == set(inner)
    moved = shown.vertices(90) - head().vertices
    for name, point in inner.items():
        vertex = model.bound[point_rows()[point]]
        outer = name.removesuffix(" inner")
        assert proposed().markers[name].vertex == vertex
        assert proposed().markers[name].follows == outer
        way = shown.displacements[90, shown.names.index(outer)]
        np.testing.assert_allclose(moved[vertex], way, atol=1e-9)  # both lips, though they touch


def test_lids_shut_along_their_whole_length() -> None:
    model, weights = FaceModel.default(), find_weights(head(), proposed())
    shut = np.zeros((len(weights.names), 3))
    for name, marker in proposed().markers.items():
        if name == "LIDL" or marker.follows == "LIDL":
            shut[weights.names.index(name), 1] = -0.009 * marker.share
    moved = weights.moved(shut)[:, 1] / -0.009
    faps = np.zeros(68, np.float32)
    faps[18] = 900  # close_t_l_eyelid
    deformer = Deformer(model)
    truth = np.linalg.norm(deformer.local(faps) - deformer.local(np.zeros(68, np.float32)), axis=1)
    margin = find_landmarks(head().skin, model.points, model.bound).contour("left upper lid")
    at = [int(np.flatnonzero(head().skin.number == vertex)[0]) for vertex in margin]
    middle = model.bound[point_rows()["3.1"]]
    assert len(at) > 20
    np.testing.assert_allclose(moved[at], truth[at] / truth[middle], atol=0.15)
    below = model.bound[point_rows()["3.3"]]
    assert abs(moved[below]) < 0.02  # the walk does not go round the corners of the eye


def test_a_marker_may_move_several_places() -> None:
    several = mapping().changed("M too", VirtualMarker(100, 3.0, 3.0, follows="M"))
    assert several.captured == ("A", "B", "C", "D", "M", "N")
    moved = move_head(capture(), sheet(), several).vertices(39) - sheet().vertices
    np.testing.assert_allclose(moved[[100, MIDDLE]], [(0, 0, 1), (0, 0, 1)], atol=1e-9)
    without_own = several.changed("M", None)
    moved = move_head(capture(), sheet(), without_own).vertices(39) - sheet().vertices
    np.testing.assert_allclose(moved[100], (0, 0, 1), atol=1e-9)
    lost = mapping().changed("Hat", VirtualMarker(100, 3.0, 3.0, follows="Cap"))
    with pytest.raises(ModelError, match="the capture has no marker Cap, which the mapping names"):
        move_head(capture(), sheet(), lost)
    half = mapping().changed("M too", VirtualMarker(100, 3.0, 3.0, follows="M", share=0.5))
    moved = move_head(capture(), sheet(), half).vertices(39) - sheet().vertices
    np.testing.assert_allclose(moved[100], (0, 0, 0.5), atol=1e-9)
    for share, follows in ((0.5, ""), (0.0, "M"), (-1.0, "M"), (float("nan"), "M"), (11.0, "M")):
        with pytest.raises(OptionError, match="a share, from above 0 to 10, is of what another"):
            VirtualMarker(3, 1.0, 1.0, follows=follows, share=share)
    with pytest.raises(OptionError, match="what follows 'M' needs a vertex, and cannot be fixed"):
        VirtualMarker(3, 1.0, 1.0, fixed=True, follows="M")


def test_teeth_and_lashes_go_with_the_face() -> None:
    model, weights = FaceModel.default(), find_weights(head(), proposed())
    down = np.zeros((len(weights.names), 3))
    for name in ("CHN", "CHB", "CHC"):
        down[weights.names.index(name), 1] = -0.01
    moved = weights.moved(down)[:, 1]

    def of(name: str) -> np.ndarray:
        return moved[model.starts[name] : model.starts[name] + len(model.part(name).vertices)]

    assert -0.01 <= of("teeth_lower").min() < of("teeth_lower").max() < -0.003
    assert not of("teeth_upper").any()
    assert not of("eye_left").any()
    shut = np.zeros((len(weights.names), 3))
    shut[weights.names.index("LIDL"), 1] = -0.008
    moved = weights.moved(shut)[:, 1]
    assert of("lashes_left").min() < -0.004
    assert abs(of("lashes_right")).max() < 1e-3


def test_markers_in_a_mirrored_capture_move_the_right_side() -> None:
    mirrored = replace(take().motion, positions=take().motion.positions * (1, 1, -1))
    with warnings.catch_warnings(action="error"):
        expected = move_head(take().motion, head(), proposed())
    with pytest.warns(FbaWarning, match="the capture is mirrored"):
        shown = move_head(mirrored, head(), proposed())
    np.testing.assert_allclose(shown.displacements, expected.displacements, atol=1e-6)


def test_without_feature_points_nothing_is_proposed() -> None:
    with pytest.raises(
        ModelError, match="of 34 markers with a place on the face, sheet has the feature points of 0"
    ):
        propose_mapping(take().motion, sheet())
