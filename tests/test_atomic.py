"""Whole files or none."""

import os
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from fba.atomic import atomic, atomic_path
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
