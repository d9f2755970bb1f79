"""What is kept on disk is found again, and never trusted."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from fba.body.model import BodyModel
from fba.body.rings import rings
from fba.kept import MOST_FILES, kept, key_of


def numbers(value: float) -> list[npt.NDArray[np.float16]]:
    return [np.full((3, 2), value, dtype=np.float16)]


def test_what_was_made_is_found_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))
    shapes = ((3, 2),)
    assert kept("one", shapes, lambda: numbers(1))[0][0, 0] == 1
    assert kept("one", shapes, lambda: numbers(2))[0][0, 0] == 1
    assert kept("two", shapes, lambda: numbers(2))[0][0, 0] == 2


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 nothing", b"x" * 100_000, None])
def test_a_damaged_file_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: bytes) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))
    kept("one", ((3, 2),), lambda: numbers(1))
    path = tmp_path / "fba" / "one.npz"
    if content is None:  # what another version wrote
        np.savez(path, np.full((3, 2), np.nan, dtype=np.float16))
    else:
        path.write_bytes(content)
    assert kept("one", ((3, 2),), lambda: numbers(5))[0][0, 0] == 5
    assert kept("one", ((3, 2),), lambda: numbers(6))[0][0, 0] == 5


def test_not_more_is_kept_than_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))
    for number in range(MOST_FILES + 5):
        kept(f"file{number}", ((3, 2),), lambda: numbers(1))
    assert len(list((tmp_path / "fba").iterdir())) == MOST_FILES


def test_where_nothing_can_be_kept_it_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("FBA_CACHE", str(tmp_path / "file"))
    assert kept("one", ((3, 2),), lambda: numbers(4))[0][0, 0] == 4


def test_arrays_of_several_kinds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))
    made: list[npt.NDArray[Any]] = [
        np.array([[1, -2]], dtype=np.int32),
        np.array([True, False]),
        np.array([0.1]),
    ]
    kinds = [np.int32, np.bool_, np.float64]
    shapes = ((1, 2), (2,), (1,))
    kept("mixed", shapes, lambda: made, kinds)
    found: list[npt.NDArray[Any]] = kept("mixed", shapes, list, kinds)
    assert [array.tolist() for array in found] == [[[1, -2]], [True, False], [0.1]]
    assert [array.dtype for array in found] == kinds
    assert len(kept("mixed", shapes, lambda: [np.zeros(1)], [np.int64, *kinds[1:]])) == 1


def test_a_key_tells_kinds_and_shapes_apart() -> None:
    numbers = np.arange(6, dtype=np.int32)
    views: list[npt.NDArray[Any]] = [
        numbers,
        numbers.reshape(2, 3),
        numbers.view(np.uint32),
        numbers.astype(np.int64),
        numbers + 1,
    ]
    assert len({key_of("one", view) for view in views} | {key_of("two", numbers)}) == 6
    assert key_of("one", numbers.reshape(2, 3).T.copy().T) == key_of("one", numbers.reshape(2, 3))
    assert key_of("one", 1, numbers) != key_of("one", 2, numbers)


def test_neighbours_out_of_range_are_not_believed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))
    body = BodyModel.default()
    first = rings(body.vertices, body.normals, body.triangles)
    (path,) = (tmp_path / "fba").iterdir()
    np.savez(path, np.full_like(first[0], len(body.vertices)), first[1])
    again = rings(body.vertices, body.normals, body.triangles)
    assert (again[0] == first[0]).all()
    assert (again[1] == first[1]).all()
