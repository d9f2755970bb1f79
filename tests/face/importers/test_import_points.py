"""Files of feature points: CSV, JSON, text FDP, Xface FDP; surfaces on which points are to be placed."""

import json
from pathlib import Path

import numpy as np
import pytest

from fba.errors import FbaWarning, ModelError, OptionError
from fba.face.fapu import Fapu
from fba.face.feature_points import neutral_points
from fba.face.importers import import_model
from fba.face.importers.head_surface import read_head_surface
from fba.face.importers.points.fdp import read_fdp, read_fdp_points
from fba.face.importers.points.points_file import GivenPoints, given_points, read_points, write_points
from fba.face.model import Part
from fba.parameters import point_rows
from mesh_files import write_obj
from mesh_files import write_points as write_csv
from small_head import ball, small_head

XFACE = """<?xml version="1.0"?><xfdp><head><file version="0.2"/>
<fapu ENS0="51" ES0="69" IRISD0="16" MNS0="30" MW0="50"/></head>
<source><entity alias="Rest" category="Expression"><mesh file="head.wrl" format="wrl"/>
<bind item="LeftEye" submesh="head.wrl_1"/></entity></source>
<fdp affects="head.wrl_0" index="2" name="9.3"><indices>0 1 2</indices>
<influence fap="62" type="RaisedCosInfluenceSph" weight="0.3"/></fdp>
<fdp affects="head.wrl_1" index="0" name="3.5"><indices/></fdp></xfdp>"""
WORLD = """#VRML V2.0 utf8
DEF one Shape { geometry IndexedFaceSet {
  coord Coordinate { point [ 0 0 0, 10 0 0, # a comment
    0 10 5 ] } coordIndex [ 0, 1, 2, -1 ]
  texCoord TextureCoordinate { point [ 0 0, 1 1 ] } } }
Shape { appearance Appearance { texture ImageTexture { url "a#b.png" } }
  geometry IndexedFaceSet { coord Coordinate { point [ 3 1 2, 4 1 2, 3 2 2, 4 2 2 ] }
  coordIndex [ 0 1 3 2 ] } }
"""


def test_csv(tmp_path: Path) -> None:
    file = tmp_path / "p.csv"
    file.write_text('point,x,y,z\n# comment\n"9.3",0,-0.5,1e1\n\n2.1,17\n')
    given = read_points(file)
    assert given.vertices == {"2.1": 17}
    np.testing.assert_array_equal(given.points[point_rows()["9.3"]], [0, -0.5, 10])
    assert np.isfinite(given.points).all(axis=1).sum() == 1
    for separator in (";", "\t", "  "):
        file.write_text(separator.join(["9.3", "0", "-0.5", "10"]) + "\n")
        np.testing.assert_array_equal(read_points(file).points[point_rows()["9.3"]], [0, -0.5, 10])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("9.3,1,2\n", ":1: 'name,x,y,z'"),
        ("9.3,1\n9.3,2\n", ":2: feature point 9.3 is listed twice"),
        ("9.99,1\n", ":1: there is no feature point '9.99'"),
        ("name,x\nnose,1\n", ":2: there is no feature point 'nose'"),
        ("9.3,a,b,c\n", ":1: a coordinate must be a finite number"),
        ("9.3,0,0,nan\n", "finite number"),
        ("9.3,1.5\n", ":1: a vertex must be a whole number"),
        ("9.3,-1\n", "vertices count from 0"),
        ('"\n', "contains no feature points"),
        ('9.3,1\n"" "\n', ":2: there is no feature point ''"),
        ("# nothing\n", "contains no feature points"),
    ],
)
def test_bad_csv(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "p.csv"
    file.write_text(text)
    with pytest.raises(ModelError) as caught:
        read_points(file)
    assert words in str(caught.value)
    assert "p.csv" in str(caught.value)


def test_json(tmp_path: Path) -> None:
    file = tmp_path / "p.json"
    file.write_text(json.dumps({"points": {"9.3": [0, 1, 2], "2.1": 5}}))
    given = read_points(file)
    assert given.vertices == {"2.1": 5}
    np.testing.assert_array_equal(given.points[point_rows()["9.3"]], [0, 1, 2])
    for bad in ("{", "[]", '{"9.3": "here"}', '{"9.3": [1, 2]}', '{"9.3": true}', '{"x": 1}', "[" * 100000):
        file.write_text(bad)
        with pytest.raises(ModelError, match=r"p\.json"):
            read_points(file)


def test_points_as_arrays_and_mappings() -> None:
    assert given_points(neutral_points()).points.shape == (84, 3)
    assert given_points({"9.3": 4}).vertices == {"9.3": 4}
    for bad in (np.zeros((83, 3)), "", {}, [[1]], 5, np.full((84, 3), np.inf)):
        with pytest.raises(ModelError):
            given_points(bad)


def text_fdp(points: np.ndarray, **changed: str) -> str:
    lines = ["# FDP file", "1.0 test 0 0 0 0 0 0"]
    lines += [
        f"  {n} {x:.6f} {y:.6f} {z:.6f} 0.{r}"
        for (n, r), (x, y, z) in zip(point_rows().items(), points, strict=True)
    ]
    return "\r\n".join([*lines, *changed.values(), "NUL 0", "NLL 0"])


def test_text_fdp_gives_points_and_vertices(tmp_path: Path) -> None:
    file = tmp_path / "a.fdp"
    file.write_text(text_fdp(neutral_points()))
    fdp = read_fdp(file)
    np.testing.assert_allclose(fdp.points, neutral_points(), atol=1e-6)
    # "0.10" is vertex 10 of mesh 0, not a tenth
    assert fdp.vertices["2.12"] == ("0", point_rows()["2.12"])
    assert [name for name, row in point_rows().items() if row == 10] == [
        name for name, (_, vertex) in fdp.vertices.items() if vertex == 10
    ]


def test_wrong_sides_are_put_right_with_a_warning(tmp_path: Path) -> None:
    points, row = neutral_points().copy(), point_rows()
    points[row["10.10"], 0] *= -1
    points[[row["3.8"], row["3.12"]]] = points[[row["3.12"], row["3.8"]]]
    points[[row["4.1"], row["4.2"]]] = points[[row["4.2"], row["4.1"]]]
    file = tmp_path / "a.fdp"
    file.write_text(text_fdp(points))
    with pytest.warns(FbaWarning, match=r"4\.1 and 4\.2 .*3\.8 and 3\.12 .*10\.10 is on the other side"):
        found = read_fdp_points(file)
    np.testing.assert_allclose(found, neutral_points(), atol=1e-6)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("2.1 0 0 0 0.1\n", ":1: an FDP file begins with"),
        ("1.0 a\n2.1 0 0\n", ":2: a feature point is"),
        ("1.0 a\n2.1 0 0 x 0.1\n", ":2: a coordinate"),
        ("1.0 a\n2.1 0 0 0 0.x\n", ":2: the vertex in MESH.VERTEX"),
        ("1.0 a\n2.1 0 0 0\n2.1 0 0 0\n", ":3: feature point 2.1 is listed twice"),
        ("1.0 a\n", "contains no feature points"),
    ],
)
def test_bad_text_fdp(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "a.fdp"
    file.write_text(text)
    with pytest.raises(ModelError) as caught:
        read_fdp_points(file)
    assert words in str(caught.value)


def test_xface_names_vertices_of_its_meshes(tmp_path: Path) -> None:
    file = tmp_path / "head.fdp"
    file.write_text(XFACE)
    fdp = read_fdp(file)
    assert fdp.distances == {"ENS0": 51, "ES0": 69, "IRISD0": 16, "MNS0": 30, "MW0": 50}
    assert fdp.vertices == {"9.3": ("head.wrl_0", 2), "3.5": ("head.wrl_1", 0)}
    # such files count FAPs from 0: 62 is FAP 63, raise_nose
    assert [(i.fap, i.weight, i.vertices) for i in fdp.influences] == [(63, 0.3, (0, 1, 2))]
    assert fdp.meshes[0].bind == {"head.wrl_1": "LeftEye"}
    with pytest.raises(ModelError, match=r"needs head\.wrl, whose vertices it names"):
        read_fdp_points(file)
    (tmp_path / "head.wrl").write_text(WORLD)
    points = read_fdp_points(file)
    np.testing.assert_array_equal(points[point_rows()["9.3"]], [0, 10, 5])
    np.testing.assert_array_equal(points[point_rows()["3.5"]], [3, 1, 2])
    assert np.isfinite(points).all(axis=1).sum() == 2


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("</xfdp>", "", "not well-formed"),
        ("<xfdp>", "<!DOCTYPE a><xfdp>", "DOCTYPE"),
        ("xfdp>", "face>", "outermost element"),
        ('name="9.3"', 'name="nose"', "<fdp> number 1: there is no feature point 'nose'"),
        ('index="2"', 'index="two"', "<fdp> number 1: index"),
        ("0 1 2<", "0 -1 2<", "vertex -1 is negative"),
        ('fap="62"', 'fap="68"', "fap 68 of <influence> does not exist"),
        ('weight="0.3"', 'weight="inf"', "finite number"),
        ('index="2"', 'index="3"', "vertex 3 of shape 0"),
        ("head.wrl_0", "head.wrl_7", "shape 7"),
        ("head.wrl_0", "../head.wrl", "FILE_NUMBER"),
        ('ES0="69"', 'ES0="x"', "ES0 of <fapu>"),
    ],
)
def test_bad_xface(tmp_path: Path, old: str, new: str, words: str) -> None:
    (tmp_path / "head.wrl").write_text(WORLD)
    file = tmp_path / "head.fdp"
    assert old in XFACE
    file.write_text(XFACE.replace(old, new))
    with pytest.raises(ModelError) as caught:
        read_fdp_points(file)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("#VRML", "VRML", ":1: a VRML file"),
        ("0 10 5 ]", "0 10 ]", "not 3 each"),
        ("0, 1, 2, -1", "0, 1, 9, -1", "coordIndex 9"),
        ("0, 1, 2, -1", "0, 1, x, -1", "an index must be a whole number"),
        ("0 10 5", "0 10 nan", ":4: a coordinate"),
        ("Shape {", "Shape {{", "open brackets"),
        ("IndexedFaceSet", "IndexedLineSet", "no IndexedFaceSet"),
        ("DEF one", "}", "closed that is not open"),
    ],
)
def test_bad_vrml(tmp_path: Path, old: str, new: str, words: str) -> None:
    (tmp_path / "head.fdp").write_text(XFACE)
    (tmp_path / "head.wrl").write_text(WORLD.replace(old, new))
    with pytest.raises(ModelError) as caught:
        read_fdp_points(tmp_path / "head.fdp")
    assert words in str(caught.value)
    assert "head.wrl" in str(caught.value)


def test_the_real_xface_file_says_which_mesh_it_needs(shared: Path) -> None:
    file = shared / "data/xface/alice.fdp"
    fdp = read_fdp(file)
    assert fdp.distances == {"ENS0": 51, "ES0": 69, "IRISD0": 16, "MNS0": 30, "MW0": 50}
    assert (len(fdp.vertices), len(fdp.influences), len(fdp.meshes)) == (33, 43, 29)
    assert fdp.vertices["2.1"] == ("alice.wrl_3", 2395)
    if not (file.parent / "alice.wrl").exists():
        with pytest.raises(ModelError, match=r"needs alice\.wrl"):
            read_fdp_points(file)


def test_the_real_text_file(shared: Path) -> None:
    with pytest.warns(FbaWarning) as seen:
        points = read_fdp_points(shared / "data/candide/candide3.fdp")
    said = " ".join(str(warning.message) for warning in seen)
    for words in ("12.1", "3.5 is on the other side", "3.8 and 3.12 have changed places"):
        assert words in said
    assert np.isfinite(points).all(axis=1).sum() == 67
    # from the lines of the file: 2 x 0.4256 between the pupils, -0.371 - -0.6454 from nose to mouth
    fapu = Fapu.measure(points)
    np.testing.assert_allclose(
        [fapu.ES * 1024, fapu.MNS * 1024, fapu.MW * 1024], [0.8512, 0.2744, 0.6888], rtol=1e-6
    )


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
