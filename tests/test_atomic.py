"""Whole files or none.

What is kept on disk is found again, and never trusted.
"""

import os
import stat
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from fba.atomic import atomic, atomic_path
from fba.body import BodyModel
from fba.body.skin._moving_normals import normal_rings
from fba.cache import MAX_FILES, load_or_make, make_key
from fba.errors import DisplayError, FormatError


def put(path: Path | str, data: bytes = b"new") -> None:
    with atomic(path) as file:
        file.write(data)


def test_a_new_file_gets_the_permissions_of_the_umask(tmp_path: Path) -> None:
    put(tmp_path / "a")
    (tmp_path / "plain").write_bytes(b"")
    assert (tmp_path / "a").read_bytes() == b"new"
    assert (tmp_path / "a").stat().st_mode == (tmp_path / "plain").stat().st_mode


@pytest.mark.parametrize("error", [KeyboardInterrupt, FormatError("x"), MemoryError, DisplayError("y")])
def test_whatever_interrupts_leaves_the_old_file(
    tmp_path: Path, error: BaseException | type[BaseException]
) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"old")
    kind = error if isinstance(error, type) else type(error)

    def interrupted() -> None:
        with atomic(path) as file:
            file.write(b"x" * 100_000)
            raise error

    with pytest.raises(kind):
        interrupted()
    assert path.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["a"]


@pytest.mark.parametrize("writer", ["fba.atomic import atomic as w", "fba.atomic import atomic_path as w"])
def test_an_interruption_just_when_the_temporary_file_appears(tmp_path: Path, writer: str) -> None:
    code = f"""
import os
from {writer}
made = os.open
def open_and_stop(*arguments):
    made(*arguments)
    assert len(os.listdir({str(tmp_path)!r})) == 1
    raise KeyboardInterrupt
os.open = open_and_stop
with w({str(tmp_path / "a.mp4")!r}):
    pass
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "KeyboardInterrupt" in result.stderr
    assert os.listdir(tmp_path) == []


def test_a_failing_disk_is_a_clear_error(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="could not be written: No space left"), atomic(tmp_path / "a"):
        raise OSError(28, "No space left on device")
    assert os.listdir(tmp_path) == []


def test_permissions_of_an_existing_file_stay(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"old")
    path.chmod(0o640)
    put(path)
    assert path.read_bytes() == b"new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_links_are_written_through(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    target, link = tmp_path / "folder" / "target", tmp_path / "link"
    link.symlink_to(target)
    put(link, b"1")  # to where nothing is yet
    put(link, b"2")
    assert link.is_symlink()
    assert target.read_bytes() == b"2"
    assert os.listdir(tmp_path / "folder") == ["target"]
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    with pytest.raises(FormatError, match="cannot be written"):
        put(tmp_path / "loop")


def test_places_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="is a folder"):
        put(tmp_path)
    with pytest.raises(FormatError, match=r"No such file or directory; make the folder .*missing first"):
        put(tmp_path / "missing" / "a")
    with pytest.raises(FormatError, match="cannot be written"):
        put(f"{tmp_path}/a\0b")
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(FormatError, match="written: Not a directory"):
        put(tmp_path / "file" / "a")


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may write anywhere")
def test_write_protection_is_respected(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"old")
    path.chmod(0o444)
    with pytest.raises(FormatError, match="write-protected"):
        put(path)
    path.chmod(0o644)
    tmp_path.chmod(0o555)
    with pytest.raises(FormatError, match="Permission denied"):
        put(path)
    tmp_path.chmod(0o755)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_devices_and_pipes_are_written_to_not_replaced(tmp_path: Path) -> None:
    put("/dev/null")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(FormatError, match="could not be written"):
        put(pipe)  # nobody reads: an error, not a wait
    received: list[bytes] = []
    descriptor = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    os.set_blocking(descriptor, True)

    def collect() -> None:
        with os.fdopen(descriptor, "rb") as reader:
            received.append(reader.read())

    thread = threading.Thread(target=collect)
    # the writer must be there before the reader reads, else it sees an end
    with atomic(pipe) as file:
        thread.start()
        file.write(b"x" * 200_000)
    thread.join(10)
    assert received == [b"x" * 200_000]
    assert stat.S_ISFIFO(pipe.stat().st_mode)


@pytest.mark.skipif(os.name != "posix", reason="names of open files, as Unix has them")
def test_an_open_file_is_written_to_where_it_stands(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"one ")
    with path.open("ab") as file:
        put(f"/dev/fd/{file.fileno()}", b"two ")
        put(f"/dev/fd/{file.fileno()}", b"three")
        with (
            pytest.raises(FormatError, match="is a device or a pipe"),
            atomic_path(f"/dev/fd/{file.fileno()}"),
        ):
            pass
    assert path.read_bytes() == b"one two three"
    assert os.listdir(tmp_path) == ["a"]
    with pytest.raises(FormatError, match="Bad file descriptor"):
        put("/dev/fd/987654")


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
