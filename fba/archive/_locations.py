"""Folders of archives, on this machine or elsewhere: paths, and addresses that the package fsspec opens."""

from __future__ import annotations

import os
import secrets
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, BinaryIO

from fba.atomic import atomic, write_error
from fba.errors import FbaError, FormatError, OptionError

MARK = "://"
"""What an address has, and no path of a file: s3://bucket/archive, zip://archive::all.zip."""


@dataclass(frozen=True, order=True)
class RemotePath:
    """A file or a folder that fsspec opens: the few methods of `pathlib.Path` that archives need.

    It holds nothing but the address, so that it pickles, and each process makes its own connection. Raises
    FormatError for what the storage refuses, FbaError without fsspec or the package of that storage,
    OptionError for a protocol that does not exist.
    """

    address: str

    def __str__(self) -> str:
        return self.address

    def __fspath__(self) -> str:
        return self.address  # for errors

    def __truediv__(self, name: str) -> RemotePath:
        head, mark, rest = self.address.partition("::")  # behind it is what the first address lies in
        return RemotePath(f"{head.rstrip('/')}/{name}{mark}{rest}")

    @property
    def name(self) -> str:
        """The last part of the address."""
        return self.address.partition("::")[0].rstrip("/").rpartition("/")[2]

    @property
    def parent(self) -> RemotePath:
        """The folder."""
        head, mark, rest = self.address.partition("::")
        return RemotePath(head.rstrip("/").rpartition("/")[0] + mark + rest)

    def open(self) -> tuple[Any, Any]:
        """Return the file, opened for reading at any place, and what must be kept as long as it is read."""
        with self._storage("cannot be read") as (storage, path):
            return storage.open(path, "rb"), storage  # which closes an archive that the file lies in

    def size(self) -> int:
        """Return the bytes of the file."""
        with self._storage("cannot be read") as (storage, path):
            return int(storage.size(path))

    def is_file(self) -> bool:
        """Whether there is such a file."""
        with self._storage("cannot be read") as (storage, path):
            return bool(storage.isfile(path))

    def glob(self, pattern: str) -> list[RemotePath]:
        """Return the files in the folder whose names fit a pattern; none without the folder."""
        with self._storage("cannot be listed") as (storage, path):
            storage.invalidate_cache()  # other programs may have written there
            try:
                found = storage.ls(path, detail=False)
            except FileNotFoundError:
                return []
        names = {str(one).rstrip("/").rpartition("/")[2] for one in found}
        return [self / name for name in names if fnmatchcase(name, pattern)]

    def mkdir(self) -> None:
        """Make the folder, and those that it lies in, where the storage has folders."""
        with self._storage("cannot be made") as (storage, path):
            storage.makedirs(path, exist_ok=True)

    def upload(self, local: str) -> None:
        """Write a file of this machine there: under another name first, so that it appears whole."""
        with self._storage("could not be written") as (storage, path):
            temporary = f"{path.rpartition('/')[0]}/.fba-{secrets.token_hex(6)}.tmp"
            try:
                storage.put_file(local, temporary)
                storage.mv(temporary, path)
            except BaseException:
                with suppress(Exception):
                    storage.rm_file(temporary)
                raise

    @contextmanager
    def _storage(self, what: str) -> Iterator[tuple[Any, str]]:
        """Yield fsspec's file system for the address, and the path in it; turn its errors into FbaErrors."""
        try:
            from fsspec.core import url_to_fs
        except ImportError:
            raise FbaError(
                f'addresses such as {self} are opened by the package fsspec: pip install "mpeg4-fba[archive]"'
            ) from None
        try:
            storage, path = url_to_fs(self.address)
        except ImportError as error:
            raise FbaError(f"{self}: a package is missing: {error}") from error
        except ValueError as error:
            raise OptionError(f"{self} is no address of a folder: {error}") from error
        except Exception as error:
            raise _storage_error(self, error, what) from error
        try:
            yield storage, path
        except FbaError:
            raise
        except Exception as error:
            raise _storage_error(self, error, what) from error


def _storage_error(path: RemotePath, error: Exception, what: str) -> FormatError:
    """Return the error for one of a storage: each has classes of errors of its own."""
    reason = " ".join(str(error).split())[:200] or type(error).__name__
    return FormatError(f"{what}: {reason}", path=path)


Location = Path | RemotePath
"""A file or a folder, here or elsewhere."""


def find_location(folder: str | os.PathLike[str]) -> Location:
    """Return the place of a path, or of an address with `://`."""
    if isinstance(folder, RemotePath):
        return folder
    name = os.fspath(folder)
    return RemotePath(name) if isinstance(folder, str) and MARK in name else Path(name)


def make_folder(place: Location) -> None:
    """Make a folder, and those that it lies in. Raises FormatError where it cannot be made."""
    if isinstance(place, RemotePath):
        place.mkdir()
        return
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise write_error(place, error, "cannot be made") from error


def size_of(place: Location) -> int:
    """Return the bytes of a file."""
    return place.size() if isinstance(place, RemotePath) else place.stat().st_size


@contextmanager
def written(place: Location) -> Iterator[BinaryIO]:
    """Open a file to write, as `fba.atomic.atomic` does: it appears whole, and only without an error.

    What goes elsewhere is written to a temporary file of this machine first.
    """
    if not isinstance(place, RemotePath):
        with atomic(place) as file:
            yield file
        return
    try:
        handle, local = tempfile.mkstemp(prefix="fba-")
    except OSError as error:
        raise write_error(place, error) from error
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        place.upload(local)
    except FbaError:
        raise
    except OSError as error:
        raise write_error(place, error) from error
    finally:
        with suppress(OSError):
            os.unlink(local)
