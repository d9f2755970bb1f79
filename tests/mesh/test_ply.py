"""PLY files: ASCII and both byte orders, and damage."""

from pathlib import Path

import numpy as np
import pytest

from fba.errors import ModelError
from fba.mesh._ply import read_ply
from mesh_files import ply

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 2, 0.25]])
MIXED = [[0, 1, 2], [0, 2, 3], [3, 2, 4, 0]]


@pytest.mark.parametrize("order", ["ascii", "<", ">"])
@pytest.mark.parametrize("extra", [False, True])
@pytest.mark.parametrize("faces", [MIXED, MIXED[:2]])
def test_all_formats_agree(tmp_path: Path, order: str, extra: bool, faces: list[list[int]]) -> None:
    file = tmp_path / "mesh.ply"
    file.write_bytes(ply(VERTICES, faces, order, extra))
    mesh = read_ply(file)
    np.testing.assert_array_equal(mesh.vertices, VERTICES)
    found = [mesh.corners[a:b].tolist() for a, b in zip(mesh.starts[:-1], mesh.starts[1:], strict=True)]
    assert found == faces
    if extra:
        assert mesh.colours is not None
        # 127 of 255 is about 0.21 in linear light
        np.testing.assert_allclose(mesh.colours[0, :3], [1, 0, 0.2158], atol=0.01)
    else:
        assert mesh.colours is None


def damaged(old: bytes, new: bytes, order: str = "ascii") -> bytes:
    whole = ply(VERTICES, MIXED, order)
    assert old in whole
    return whole.replace(old, new, 1)


SIGNALLING = ply(VERTICES, MIXED[:2], "<").replace(b"end_header\n" + bytes(4), b"end_header\n\1\0\x80\x7f")
"""Its first coordinate is a signalling NaN, of which NumPy warns on conversion."""


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"ply\n", "end_header"),
        (b"ply\nformat ascii 1.0\nend_header\n", "x, y and z"),
        (damaged(b"format ascii 1.0", b"format morse 1.0"), ":2"),
        (damaged(b"format ascii 1.0", b"comment"), "no line 'format'"),
        (damaged(b"element vertex 5", b"element vertex 99999999"), ":4: 99999999 of element vertex"),
        (damaged(b"element vertex 5", b"element vertex -5"), ":4"),
        (damaged(b"element vertex 5", b"element vertex 500"), "is it whole?"),
        (damaged(b"property float x", b"property quaternion x"), ":5"),
        (damaged(b"property float x", b"property float w"), "x, y and z"),
        (damaged(b"list uchar int vertex_indices", b"list float int vertex_indices"), "fraction"),
        (damaged(b"vertex_indices", b"something_else"), "no list vertex_indices"),
        (damaged(b"element face 3", b"element face 0"), "0 faces"),
        (damaged(b"3 0 1 2\n", b"3 0 1 7\n"), "face 0 names vertex 7, but there are 5"),
        (damaged(b"3 0 1 2\n", b"3 0 1 -2\n"), "names vertex -2"),
        (damaged(b"3 0 1 2\n", b"200 0 1 2\n"), "is it whole?"),
        (damaged(b"3 0 1 2\n", b"-3 0 1 2\n"), "a list of -3"),
        (damaged(b"3 0 1 2\n", b"3.5 0 1 2\n"), "face 0: a list of 3.5; expected a whole number"),
        (damaged(b"3 0 1 2\n", b"3 0 1 1.5\n"), "face: an index is not a whole number"),
        (damaged(b"3 0 1 2\n", b"3 0 1 x\n"), "could not convert"),
        (damaged(b"3 0 1 2\n", b"inf 0 1 2\n"), "a list of inf"),
        (damaged(b"3 0 1 2\n", b"1e400 0 1 2\n"), "a list of inf"),
        (damaged(b"3 0 1 2\n", b"nan 0 1 2\n"), "a list of nan"),
        (damaged(b"3 0 1 2\n", b"1e9 0 1 2\n"), "a list of 1000000000"),
        (damaged(b"1.0 1.0 0.0\n", b"1.0 nan 0.0\n"), "not finite"),
        (ply(VERTICES, MIXED, "<")[:-3], "is it whole?"),
        (ply(VERTICES, MIXED[:2], ">")[:-3], "is it whole?"),
        (b"", "empty"),
        (SIGNALLING, "vertex 0 is at [nan, 0.0, 0.0], which is not finite"),
        (SIGNALLING.replace(b"\nend_header", b"\nproperty list uchar float w\nend_header"), "is it whole?"),
    ],
)
def test_damage_is_named(tmp_path: Path, data: bytes, words: str) -> None:
    file = tmp_path / "mesh.ply"
    file.write_bytes(data)
    with pytest.raises(ModelError) as caught:
        read_ply(file)
    assert "mesh.ply" in str(caught.value)
    assert words in str(caught.value)


STRIPS = b"""ply
format ascii 1.0
element vertex 6
property float x
property float y
property float z
element tristrips 2
property list int int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
1 1 0
0 2 0
1 2 0
8 0 1 2 3 -1 2 3 4
6 3 4 4 5 5 0
"""


def test_triangle_strips(tmp_path: Path) -> None:
    """As files of the Stanford repository have them: -1 between strips, corners given twice to join them."""
    file = tmp_path / "strip.ply"
    file.write_bytes(STRIPS)
    mesh = read_ply(file)
    assert mesh.corners.reshape(-1, 3).tolist() == [[0, 1, 2], [2, 1, 3], [2, 3, 4]]
    assert mesh.starts.tolist() == [0, 3, 6, 9]
    file.write_bytes(STRIPS.replace(b"-1 2 3 4", b"-2 2 3 4"))
    with pytest.raises(ModelError, match="names vertex -2"):
        read_ply(file)
