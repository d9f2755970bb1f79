"""Placing feature points by hand: order, mirroring, undoing, saving, and what a mouse points at."""

from pathlib import Path

import numpy as np
import pytest

from fba.errors import FormatError, ModelError
from fba.face.fapu import FAPU_POINTS
from fba.face.feature_points import names
from fba.face.importers.head_surface import HeadSurface, read_head_surface
from fba.face.importers.points.points_file import read_points
from fba_player.scene._placement_scene import PlacementScene
from fba_player.scene._point_placement import PointPlacement, describe_point
from fba_player.view._camera import Camera
from fba_player.view._geometry import first_hit, ray_through

NONE = np.full((84, 3), np.nan)
CUBE = """v -1 -1 1
v 1 -1 1
v 1 1 1
v -1 1 1
v -1 -1 -1
v 1 -1 -1
v 1 1 -1
v -1 1 -1
v 9 9 9
g front
f 1 2 3
f 1 3 4
g back
f 6 5 8
f 6 8 7
"""
"""A front and a back wall; the vertices from 0 are lower right, lower left, upper left, upper right."""


@pytest.fixture
def surface(tmp_path: Path) -> HeadSurface:
    path = tmp_path / "cube.obj"
    path.write_text(CUBE)
    return read_head_surface(path, points={"9.15": 8})


@pytest.fixture
def placement(surface: HeadSurface, tmp_path: Path) -> PointPlacement:
    return PointPlacement(surface, tmp_path / "out.csv")


def test_points_that_every_face_needs_come_first_then_other_missing_points(
    placement: PointPlacement,
) -> None:
    needed = [name for name in FAPU_POINTS if name != "9.15"]
    assert list(placement.names[:9]) == needed
    assert placement.names[9] == "2.1"  # the first that has FAPs
    assert placement.names.index("2.11") == placement.names.index("10.4") + 1  # the first that has none
    assert placement.names[-1] == "9.15"  # known already: only to be checked
    assert sorted([*placement.names, "7.1", "11.5"]) == sorted(names())
    assert placement.missing_units == tuple(needed)
    assert placement.current == "3.5"


def test_what_a_point_is_comes_from_the_table() -> None:
    assert describe_point("2.1") == "chin, lowest point: FAPs 3, 14, 15"
    assert describe_point("8.3") == "outer lip contour, left corner: every face needs it; FAPs 53, 59"
    assert describe_point("2.13") == "jaw bone, left corner: makes the motions around it better"


def test_next_goes_round_and_next_missing_passes_over_what_has_a_place(placement: PointPlacement) -> None:
    placement.step(-1)
    assert placement.current == "9.15"
    placement.step(1)
    assert placement.current == "3.5"
    placement.choose("3.6")
    placement.place(2)
    placement.choose("3.5")
    assert placement.next_missing()
    assert placement.current == "3.1"
    placement.places = dict.fromkeys(placement.names, 0)
    assert not placement.next_missing()
    with pytest.raises(ValueError, match=r"7\.1"):
        placement.choose("7.1")


def test_mirror_places_the_other_side_about_the_middle_of_the_head(placement: PointPlacement) -> None:
    placement.remove()
    placement.choose("9.15")
    placement.remove()  # it lies at x = 9
    placement.choose("3.5")
    placement.place(2)
    assert (placement.mirror(), placement.places["3.6"]) == ("3.6", 3)
    placement.choose("8.4")
    assert placement.mirror() is None  # neither side has a place
    placement.choose("8.3")
    placement.place(1)
    placement.choose("8.4")
    assert placement.mirror() == "8.4"  # only the other side has one
    assert placement.places["8.4"] == 0
    placement.choose("9.15")
    assert placement.mirror() is None  # it has no other side


def test_the_plane_between_the_sides_follows_the_points(placement: PointPlacement) -> None:
    assert placement.middle == 9.0  # where the one point of the midline is
    placement.places = {}
    assert placement.middle == 0.0  # of the surface; the vertex without triangles does not count
    placement.places = {"3.5": (3.0, 0.0, 0.0), "3.6": (1.0, 0.0, 0.0)}
    assert placement.middle == 2.0


def test_all_missing_mates_are_mirrored_at_once_and_undone_at_once(placement: PointPlacement) -> None:
    placement.places = {"3.5": 2, "8.3": 1, "8.4": 4}
    assert placement.mirror_all() == 1
    assert placement.places == {"3.5": 2, "3.6": 3, "8.3": 1, "8.4": 4}
    assert placement.undo()
    assert placement.places == {"3.5": 2, "8.3": 1, "8.4": 4}


def test_where_two_vertices_coincide_the_mirror_image_faces_the_same_way(tmp_path: Path) -> None:
    # an upper lip that faces down and a lower one that faces up touch along a line
    (tmp_path / "lips.obj").write_text(
        "v -1 0 0\nv 1 0 0\nv 1 0 -1\nv -1 0 -1\nv -1 0 0\nv 1 0 0\nv 1 0 -1\nv -1 0 -1\nv 0 1 0\nv 0 2 0\n"
        "v 1 2 0\nf 1 3 2\nf 1 4 3\nf 5 6 7\nf 5 7 8\nf 9 10 11\n"
    )
    placement = PointPlacement(read_head_surface(tmp_path / "lips.obj", points={"9.15": 8}), "x.csv")
    for here, other in ((1, 0), (5, 4)):
        placement.choose("2.4")
        placement.place(here)
        placement.mirror()
        assert placement.places["2.5"] == other


def test_undo_takes_back_places_moves_and_removals(placement: PointPlacement) -> None:
    placement.place(1)
    placement.place(1)  # nothing changes
    placement.place(2)
    placement.step(5)
    placement.remove()  # nothing to remove
    placement.choose("3.5")
    placement.remove()
    assert "3.5" not in placement.places
    for place in (2, 1):
        assert placement.undo()
        assert (placement.current, placement.places["3.5"]) == ("3.5", place)
    assert placement.undo()
    assert placement.places == {"9.15": 8}
    assert not placement.undo()


def test_saving_writes_what_the_importer_reads(placement: PointPlacement) -> None:
    assert not placement.changed
    placement.place(2)
    placement.places["7.1"] = (0.5, -1.25, 1e-3)
    assert placement.changed
    placement.save()
    assert placement.written
    assert not placement.changed
    assert placement.path.read_text().splitlines() == [
        "# feature points of cube.obj, vertices counted from 0",
        "3.5,2",
        "7.1,0.5,-1.25,0.001",
        "9.15,8",
    ]
    given = read_points(placement.path)
    assert given.vertices == {"3.5": 2, "9.15": 8}
    again = PointPlacement(read_head_surface(placement.surface.path, points=placement.path), "x.csv")
    assert again.places == placement.places


def test_what_cannot_be_saved_leaves_the_old_file(placement: PointPlacement, tmp_path: Path) -> None:
    placement.path.write_text("9.3,1\n")
    placement.places = {}
    with pytest.raises(ModelError, match="no feature points"):
        placement.save()
    assert placement.path.read_text() == "9.3,1\n"
    placement.places = {"9.3": 2}
    placement.path = tmp_path / "nowhere" / "p.csv"
    with pytest.raises(FormatError):
        placement.save()
    assert not placement.written


def test_a_guess_is_the_nearest_vertex_to_where_an_adult_has_the_point(tmp_path: Path) -> None:
    from fba.face.feature_points import neutral_points
    from fba.parameters import point_rows

    adult = neutral_points() * 100 + (3, 2, 1)
    (tmp_path / "dots.obj").write_text(
        "".join(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in adult)
        + "".join(f"f {n} {n % 84 + 1} {(n + 1) % 84 + 1}\n" for n in range(1, 85))
    )
    given = {name: point_rows()[name] for name in ("3.5", "3.6", "9.15")}
    placement = PointPlacement(read_head_surface(tmp_path / "dots.obj", points=given), "x.csv")
    placement.choose("2.1")
    assert placement.guess() is None  # of three points
    placement.places["8.3"] = point_rows()["8.3"]
    guess = placement.guess()
    assert guess is not None
    np.testing.assert_allclose(guess, adult[point_rows()["2.1"]], rtol=1e-5)


def test_a_ray_meets_the_nearest_triangle_from_either_side() -> None:
    walls = np.array([[[-1, -1, z], [1, -1, z], [0, 2, z]] for z in (-1.0, 1.0)])
    for origin, towards, nearest in ((5.0, -1.0, 1), (-5.0, 1.0, 0)):
        hit = first_hit(np.array([0.0, -1.0, origin]), np.array([0.0, 0.0, towards]), walls)
        assert hit[0] == nearest
        np.testing.assert_allclose(hit[1], [0.5, 0.5, 0], atol=1e-12)
    assert first_hit(np.array([3.0, 0, 5]), np.array([0.0, 0, -1]), walls) is None
    assert first_hit(np.array([0.0, 0, 5]), np.array([0.0, 0, 1]), walls) is None  # behind the eye
    assert first_hit(np.array([0.0, 0, 5]), np.array([1.0, 0, 0]), walls) is None  # along the walls


def test_a_ray_goes_through_the_pixel_that_shows_its_points() -> None:
    camera = Camera(target=(0.1, -0.2, 0.3), yaw=40, pitch=-15, distance=0.7)
    origin, direction = ray_through(camera, 123, 456, (640, 480))
    point = np.append(origin + 0.6 * direction, 1.0)
    clip = camera.projection_matrix(640 / 480) @ camera.view_matrix() @ point
    seen = clip[:2] / clip[3]
    np.testing.assert_allclose([(seen[0] + 1) * 320, (1 - seen[1]) * 240], [123, 456], atol=1e-6)


def test_a_click_finds_the_nearest_corner_and_goes_through_hidden_parts(placement: PointPlacement) -> None:
    scene = PlacementScene(placement)
    camera = scene.camera("front", 1.0)
    size = (200, 200)

    def pixel(point: tuple[float, float, float]) -> tuple[float, float]:
        world = np.append(scene.to_world(np.array([point]))[0], 1.0)
        clip = camera.projection_matrix(1.0) @ camera.view_matrix() @ world
        return (clip[0] / clip[3] + 1) * 100, (1 - clip[1] / clip[3]) * 100

    for corner, vertex in (((0.9, 0.8, 1.0), 2), ((-0.9, 0.8, 1.0), 3), ((-0.7, -0.9, 1.0), 0)):
        assert scene.vertex_under(camera, *pixel(corner), size) == vertex
    assert scene.vertex_under(camera, 0, 0, size) is None
    placement.hidden.add(0)  # the front
    assert scene.vertex_under(camera, *pixel((0.6, 0.6, -1.0)), size) == 6
    assert len(scene.view_at(0.0).faces) == 1


def test_dots_show_the_current_point_its_mate_and_the_others(placement: PointPlacement) -> None:
    placement.places = {"3.5": 2, "3.6": 3, "2.1": 0}
    scene = PlacementScene(placement)

    def dots() -> list[tuple[str, ...]]:
        extras = scene.view_at(0.0).extras
        return [group.names for group in extras.dots]

    assert dots() == [("2.1",), ("3.6",), ("3.5",)]
    placement.choose("2.2")
    assert dots() == [("3.5", "3.6", "2.1")]  # too few for a guess
    placement.places["8.3"] = 1
    assert dots()[-1] == ("2.2?",)
    with pytest.raises(ValueError, match="finite"):
        scene.view_at(float("nan"))
