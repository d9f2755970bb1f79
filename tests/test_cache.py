"""What is kept on disk is found again, and never trusted."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from fba.body import BodyModel
from fba.body.skin._moving_normals import normal_rings
from fba.cache import MAX_FILES, load_or_make, make_key


def numbers(value: float) -> list[npt.NDArray[np.float16]]:
    return [np.full((3, 2), value, dtype=np.float16)]


def test_what_was_made_is_found_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))
    shapes = ((3, 2),)
    assert load_or_make("one", shapes, lambda: numbers(1))[0][0, 0] == 1
    assert load_or_make("one", shapes, lambda: numbers(2))[0][0, 0] == 1
    assert load_or_make("two", shapes, lambda: numbers(2))[0][0, 0] == 2


@pytest.mark.parametrize("content", [b"", b"nothing", b"x" * 44, b"x" * 100_000])
def test_a_damaged_file_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: bytes) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))
    load_or_make("one", ((3, 2),), lambda: numbers(1))
    path = tmp_path / "fba" / "one.fbk"
    path.write_bytes(content)
    assert load_or_make("one", ((3, 2),), lambda: numbers(5))[0][0, 0] == 5
    assert load_or_make("one", ((3, 2),), lambda: numbers(6))[0][0, 0] == 5


def test_every_flipped_bit_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))
    load_or_make("one", ((3, 2),), lambda: numbers(1))
    path = tmp_path / "fba" / "one.fbk"
    good = path.read_bytes()
    for bit in range(8 * len(good)):
        bad = bytearray(good)
        bad[bit // 8] ^= 1 << bit % 8
        path.write_bytes(bad)
        assert (load_or_make("one", ((3, 2),), lambda: numbers(1))[0] == 1).all(), bit
        assert path.read_bytes() == good, bit


def test_a_cut_file_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))
    load_or_make("one", ((3, 2),), lambda: numbers(1))
    path = tmp_path / "fba" / "one.fbk"
    good = path.read_bytes()
    for length in range(len(good)):
        path.write_bytes(good[:length])
        assert (load_or_make("one", ((3, 2),), lambda: numbers(1))[0] == 1).all()
        assert path.read_bytes() == good


def test_another_kind_of_the_same_size_is_not_taken_for_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))
    load_or_make("one", ((3, 2),), lambda: numbers(1))
    path = tmp_path / "fba" / "one.fbk"
    path.rename(path.with_name("two.fbk"))
    assert (
        load_or_make("two", ((3, 2),), lambda: numbers(2))[0] == 2
    ).all()  # nor what was kept for another key
    made = load_or_make("one", ((3, 2),), lambda: numbers(3))
    assert made[0].dtype == np.float16
    integers: list[npt.NDArray[Any]] = [np.full((3, 2), 7, dtype=np.int16)]
    assert (load_or_make("one", ((3, 2),), lambda: integers, np.int16)[0] == 7).all()


@pytest.mark.skipif(os.name == "nt", reason="limits of POSIX")
def test_a_full_disk_is_no_error(tmp_path: Path) -> None:
    code = """
import resource, sys
import numpy as np
from fba.cache import load_or_make
resource.setrlimit(resource.RLIMIT_FSIZE, (20, 20))
print(load_or_make("one", ((3, 2),), lambda: [np.ones((3, 2), np.float16)])[0].sum())
"""
    environment = {**os.environ, "FBA_CACHE": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False
    )
    assert (done.stdout, done.stderr) == ("6.0\n", "")
    assert list((tmp_path / "fba").iterdir()) == []


def test_not_more_is_kept_than_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))
    for number in range(MAX_FILES + 5):
        load_or_make(f"file{number}", ((3, 2),), lambda: numbers(1))
    assert len(list((tmp_path / "fba").iterdir())) == MAX_FILES


def test_where_nothing_can_be_kept_it_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("FBA_CACHE", str(tmp_path / "file"))
    assert load_or_make("one", ((3, 2),), lambda: numbers(4))[0][0, 0] == 4


def test_arrays_of_several_kinds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))
    made: list[npt.NDArray[Any]] = [
        np.array([[1, -2]], dtype=np.int32),
        np.array([True, False]),
        np.array([0.1]),
    ]
    kinds = [np.int32, np.bool_, np.float64]
    shapes = ((1, 2), (2,), (1,))
    load_or_make("mixed", shapes, lambda: made, kinds)
    found: list[npt.NDArray[Any]] = load_or_make("mixed", shapes, list, kinds)
    assert [array.tolist() for array in found] == [[[1, -2]], [True, False], [0.1]]
    assert [array.dtype for array in found] == kinds
    assert len(load_or_make("mixed", shapes, lambda: [np.zeros(1)], [np.int64, *kinds[1:]])) == 1


def test_a_key_tells_kinds_and_shapes_apart() -> None:
    numbers = np.arange(6, dtype=np.int32)
    views: list[npt.NDArray[Any]] = [
        numbers,
        numbers.reshape(2, 3),
        numbers.view(np.uint32),
        numbers.astype(np.int64),
        numbers + 1,
    ]
    assert len({make_key("one", view) for view in views} | {make_key("two", numbers)}) == 6
    assert make_key("one", numbers.reshape(2, 3).T.copy().T) == make_key("one", numbers.reshape(2, 3))
    assert make_key("one", 1, numbers) != make_key("one", 2, numbers)


def test_neighbours_out_of_range_are_not_believed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))
    body = BodyModel.default()
    first = normal_rings(body.vertices, body.normals, body.triangles)
    (path,) = (tmp_path / "fba").iterdir()
    path.unlink()
    wrong: list[npt.NDArray[Any]] = [np.full_like(first[0], len(body.vertices)), first[1]]
    load_or_make(path.stem, (first[0].shape, first[1].shape), lambda: wrong, [np.int32, np.float32])
    again = normal_rings(body.vertices, body.normals, body.triangles)
    assert (again[0] == first[0]).all()
    assert (again[1] == first[1]).all()
