"""OBJ files: all ways to write a face, and all ways to break one."""

from pathlib import Path

import numpy as np
import pytest

from fba import text_files
from fba.errors import FbaWarning, ModelError
from fba.face.importers.assembly._polygon_parts import make_piece
from fba.mesh import _obj as obj
from fba.mesh._materials import read_mtl
from fba.mesh._obj import read_obj
from fba.mesh._polygons import triangulate

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def written(path: Path, text: str | bytes) -> Path:
    file = path / "mesh.obj"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file


def triangles(path: Path, text: str) -> list[list[int]]:
    mesh = read_obj(written(path, text))
    return triangulate(mesh, np.ones(len(mesh), dtype=bool)).corners.tolist()


def test_polygons_become_fans(tmp_path: Path) -> None:
    assert triangles(tmp_path, SQUARE + "f 1 2 3 4\n") == [[0, 1, 2], [0, 2, 3]]
    pentagon = SQUARE + "v -1 0.5 0\nf 1 2 3 4 5\nf 1 2 3\n"
    assert triangles(tmp_path, pentagon) == [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 1, 2]]


def test_negative_indices_count_from_the_line(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 9 9 9\nf -2 -3 -4\n"
    assert triangles(tmp_path, text) == [[0, 1, 2], [2, 1, 0]]


def test_lines_go_on_and_comments_end_them(tmp_path: Path) -> None:
    assert triangles(tmp_path, SQUARE + "f 1 \\\n2 3 # 4\r\n") == [[0, 1, 2]]


def test_groups_objects_and_materials(tmp_path: Path) -> None:
    text = SQUARE + "f 1 2 3\no Eye Left\nusemtl Iris\nf 1 2 3\ng\nf 2 3 4\n"
    mesh = read_obj(written(tmp_path, text))
    assert mesh.groups == (("", ""), ("Eye Left", "Iris"), ("", "Iris"))
    assert mesh.group.tolist() == [0, 1, 2]


def test_texture_coordinates_are_turned_over_and_seams_split(tmp_path: Path) -> None:
    text = SQUARE + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0.25 1\nf 1/1 2/2 3/3\nf 1/4/1 3/3/1 4//1\n"
    mesh = read_obj(written(tmp_path, text))
    source = make_piece(mesh, np.ones(2, dtype=bool), "skin", "skin", scale=0.5)
    part = source.part
    # vertex 0 has two texture coordinates, the others one each
    assert sorted(source.origin.tolist()) == [0, 0, 1, 2, 3]
    assert part.texcoords is not None
    ends = {tuple(part.texcoords[i]) for i in np.flatnonzero(source.origin == 0)}
    assert ends == {(0.0, 1.0), (0.25, 0.0)}
    np.testing.assert_allclose(part.vertices[source.origin == 2], [[0.5, 0.5, 0.0]])
    np.testing.assert_allclose(part.normals, np.tile([0, 0, 1], (5, 1)))


def test_colours_after_the_position(tmp_path: Path) -> None:
    text = "v 0 0 0 1 0 0.5\nv 1 0 0 1 0 0.5\nv 1 1 0 1 0 0.5\nf 1 2 3\n"
    colours = read_obj(written(tmp_path, text)).colours
    assert colours is not None
    # sRGB 0.5 is 0.214 in linear light
    np.testing.assert_allclose(colours[:, :3], np.tile([1, 0, 0.21404], (3, 1)), atol=1e-4)


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("v 0 0\n", ":1", "three numbers"),
        ("v 0 0 nan\n", ":1", "finite number"),
        ("v 0 0 1e999\n", ":1", "finite number"),
        ("v 0 0 x\n", ":1", "finite number"),
        (SQUARE + "f 1 2\n", ":5", "three corners"),
        (SQUARE + "f 1 2 9\n", ":5", "vertex 9 does not exist; 4"),
        (SQUARE + "f 1 2 0\n", ":5", "vertex 0 does not exist"),
        (SQUARE + "f 1 2 -5\n", ":5", "vertex -5 does not exist"),
        (SQUARE + "f 1 2 3.5\n", ":5", "whole number"),
        (SQUARE + "f 1/1 2/1 3/1\n", ":5", "texture coordinate 1 does not exist"),
        (SQUARE + "f 1 2 99999999999999999999999999\n", ":5", "whole number"),
        ("vt 1\n", ":1", "two numbers"),
        (SQUARE, "", "0 faces"),
        ("# nothing\n", "", "0 vertices"),
        (SQUARE.encode("utf-16"), "", "UTF-16"),
        (b"v 0 0 0\nv 1\x000 0\n", ":2", "zero bytes"),
        (b"v " + b"1" * (text_files.MAX_LINE + 5), ":1", "longer than"),
        (b"", "", "empty"),
    ],
)
def test_damage_is_named(tmp_path: Path, text: str | bytes, place: str, words: str) -> None:
    file = written(tmp_path, text)
    with pytest.raises(ModelError) as caught:
        read_obj(file)
    assert f"mesh.obj{place}" in str(caught.value)
    assert words in str(caught.value)


def test_names_of_files_that_no_system_takes(tmp_path: Path) -> None:
    long = "m" * 5000
    with pytest.warns(FbaWarning, match="is not in its folder; left out"):
        assert read_mtl(tmp_path / "mesh.obj", long) == {}
    (tmp_path / "a.mtl").write_text(f"newmtl a\nmap_Kd {long}.png\n")
    with pytest.warns(FbaWarning, match="is not in the folder of the file; left out"):
        assert read_mtl(tmp_path / "mesh.obj", "a.mtl")["a"].texture is None


def test_folders_and_missing_files(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="is a folder"):
        read_obj(tmp_path)
    with pytest.raises(ModelError, match="no such file"):
        read_obj(tmp_path / "none.obj")


def test_too_many_vertices_are_refused_while_reading(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(obj, "MAX_VERTICES", 3)
    with pytest.raises(ModelError, match=r"mesh\.obj:4: more than 3 vertices"):
        read_obj(written(tmp_path, SQUARE + "this line is never reached"))
    monkeypatch.setattr(obj, "MAX_VERTICES", 4)
    monkeypatch.setattr(obj, "MAX_FACES", 1)
    with pytest.raises(ModelError, match="more than 1 faces"):
        read_obj(written(tmp_path, SQUARE + "f 1 2 3\nf 1 2 3\n"))
