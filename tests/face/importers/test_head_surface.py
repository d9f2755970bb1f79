"""Surfaces of heads whose points are to be placed: numbers of vertices, and what is known before."""

from pathlib import Path

import numpy as np
import pytest

from fba.errors import ModelError, OptionError
from fba.face.importers import import_model
from fba.face.importers.head_surface import read_head_surface
from fba.face.importers.points.points_file import GivenPoints, write_points
from fba.face.model import Part
from fba.parameters import point_rows
from mesh_files import write_obj
from mesh_files import write_points as write_csv
from small_head import ball, small_head


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("head")
    write_obj(made / "head.obj", small_head().parts, 100)
    return made


def test_a_mesh_without_shapes_gives_the_points_of_its_eyes(folder: Path) -> None:
    head = small_head()
    surface = read_head_surface(folder / "head.obj")
    assert surface.origin == "found by the eyeballs"
    assert surface.given.vertices["3.5"] == head.bound[point_rows()["3.5"]]
    assert surface.given.vertices["3.6"] == head.bound[point_rows()["3.6"]]
    assert "2.2" not in surface.given.vertices
    np.testing.assert_allclose(surface.vertices, head.vertices * 100.0, atol=1e-4)
    assert [part.name for part in surface.parts] == [part.name.replace(" ", "_") for part in head.parts]
    assert len(surface.triangles) == len(surface.part_of) == sum(len(one.triangles) for one in head.parts)
    third = surface.triangles[surface.part_of == 2]
    np.testing.assert_array_equal(third, head.parts[2].triangles + head.starts[head.parts[2].name])


@pytest.mark.parametrize(
    ("radii", "expected"),
    [
        ((0.012, 0.012), {"3.5", "3.6"}),
        ((0.012, 0.016), set()),  # unlike
        ((0.032, 0.032), set()),  # they overlap: 62 mm apart
    ],
)
def test_round_shells_that_cannot_be_eyes_give_no_pupils(
    tmp_path: Path, radii: tuple[float, float], expected: set[str]
) -> None:
    head = small_head()
    parts = [part for part in head.parts if part.kind != "eye"]
    for side, name, radius in zip(("left", "right"), ("3.5", "3.6"), radii, strict=True):
        centre = head.points[point_rows()[name]] - (0, 0, 0.012)
        parts.append(Part(f"{side} eye", "eye", *ball(centre, radius)))
    write_obj(tmp_path / "eyes.obj", parts)
    surface = read_head_surface(tmp_path / "eyes.obj")
    assert set(surface.given.vertices) & {"3.5", "3.6"} == expected
    assert surface.origin == ("found by the eyeballs" if expected else "")


def test_positions_become_vertices_of_the_right_lip(folder: Path) -> None:
    head = small_head()
    write_csv(folder / "all.csv", head, 100, vertices=False)
    surface = read_head_surface(folder / "head.obj", points=folder / "all.csv")
    for name in ("2.2", "2.3", "2.6", "2.9", "8.1", "9.3", "6.1"):
        assert surface.given.vertices[name] == head.bound[point_rows()[name]], name
    assert "7.1" not in surface.given.vertices
    np.testing.assert_allclose(
        surface.given.points[point_rows()["7.1"]], head.points[point_rows()["7.1"]] * 100, atol=1e-4
    )


def test_z_up_is_turned_only_to_be_seen(folder: Path) -> None:
    head = small_head()
    turned = [(x, -z, y) for x, y, z in head.vertices.tolist()]
    text = (folder / "head.obj").read_text().splitlines()
    rest = [line for line in text if not line.startswith("v ")]
    (folder / "z.obj").write_text("\n".join([*(f"v {x} {y} {z}" for x, y, z in turned), *rest]))
    surface = read_head_surface(folder / "z.obj", up="z")
    np.testing.assert_allclose(surface.vertices @ surface.upright.T, head.vertices, atol=1e-6)
    assert surface.given.vertices["3.5"] == head.bound[point_rows()["3.5"]]
    with pytest.raises(OptionError, match="up"):
        read_head_surface(folder / "z.obj", up="x")


def test_points_placed_and_written_are_imported(folder: Path) -> None:
    head = small_head()
    vertices = {
        name: int(vertex)
        for name, vertex in zip(point_rows(), head.bound.tolist(), strict=True)
        if vertex >= 0 and name.split(".")[0] in ("2", "3", "8", "9")
    }
    write_points(folder / "placed.csv", GivenPoints(np.full((84, 3), np.nan), vertices), "by\nhand")
    assert (folder / "placed.csv").read_text().startswith("# by hand\n2.1,")
    model = import_model(folder / "head.obj", points=folder / "placed.csv")
    assert {3, 4, 5, 19, 51} <= set(model.table_of)


def test_what_needs_no_points_or_has_no_such_vertex_is_refused(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="vertex 999999, but the mesh has"):
        read_head_surface(folder / "head.obj", points={"9.3": 999999})
    (tmp_path / "face.fdp").write_text("nothing")
    with pytest.raises(ModelError, match="its own feature points; give its mesh"):
        read_head_surface(tmp_path / "face.fdp", kind="fdp")


def test_a_model_of_ours_begins_with_its_points(tmp_path: Path) -> None:
    head = small_head()
    head.save(tmp_path / "own.glb")
    surface = read_head_surface(tmp_path / "own.glb")
    assert surface.origin == "of the model"
    for name in ("2.2", "2.3", "3.1", "9.3"):
        vertex = surface.given.vertices[name]
        away = np.linalg.norm(surface.vertices[vertex] - head.points[point_rows()[name]])
        assert away < 1e-5, name
