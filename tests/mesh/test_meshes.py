"""What face and body models share: parts counted through, and the arrays that vertices are written to."""

from dataclasses import dataclass

import numpy as np
import pytest

from fba.errors import ModelError
from fba.mesh._meshes import Meshes, mesh_arrays, result_array

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


class Piece:
    """A mesh by name."""

    def __init__(self, name: str, vertices: list[list[float]], triangles: list[list[int]]) -> None:
        arrays = mesh_arrays(name, vertices, triangles, None, None, None)
        self.name = name
        self.vertices, self.normals = arrays["vertices"], arrays["normals"]
        self.triangles: np.ndarray = arrays["triangles"]


@dataclass(frozen=True, eq=False)
class Model(Meshes[Piece]):
    parts: tuple[Piece, ...]


def test_parts_are_counted_through() -> None:
    model = Model(
        (Piece("front", SQUARE, [[0, 1, 2], [0, 2, 3]]), Piece("back", SQUARE[:3], [[2, 1, 0]])),
    )
    assert model.starts == {"front": 0, "back": 4}
    assert model.vertices.shape == (7, 3)
    assert model.vertices[6].tolist() == [1, 1, 0]
    assert model.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [6, 5, 4]]
    assert model.triangles.dtype == np.int32
    assert model.normals[[0, 6]].tolist() == [[0, 0, 1], [0, 0, -1]]
    for array in (model.vertices, model.triangles, model.normals):
        assert not array.flags.writeable
    assert model.part("back") is model.parts[1]
    with pytest.raises(ModelError, match="no part 'side'; there are front, back"):
        model.part("side")


def test_results_are_written_where_they_are_wanted() -> None:
    shape = (2, 4, 3)
    fresh = result_array(shape, None, None)
    assert (fresh.shape, fresh.dtype) == (shape, np.float32)
    given, normals = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    assert result_array(shape, given, normals) is given
    with pytest.raises(ValueError, match="share memory"):
        result_array(shape, given, given)
    with pytest.raises(ValueError, match=r"out must be a float32 array of shape \(2, 4, 3\), not float64"):
        result_array(shape, np.zeros(shape), None)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="normals must be C-contiguous and writable"):
        result_array(shape, None, np.zeros((2, 3, 4), np.float32).swapaxes(1, 2))
