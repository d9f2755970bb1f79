"""Members of ZIP archives, and arrays of NumPy files, within the limits of memory; damage: FormatError."""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Callable, Iterator
from tokenize import TokenError
from typing import Any

import numpy as np

from fba.arrays import to_float64
from fba.errors import FbaError, FormatError
from fba.limits import Limits
from fba.source import Path, read_whole

ZIP = b"PK\x03\x04"
"""First bytes of an archive."""
MOST_MEMBERS = 10_000


def read_members(
    data: bytes, path: Path, limits: Limits, wanted: Callable[[str], bool]
) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of the wanted members of an archive.

    Raises FormatError for damage, and for what is encrypted or compressed in ways that are not supported;
    LimitError for a member that is larger than the limits allow.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            if len(members) > MOST_MEMBERS:
                raise FormatError(f"holds {len(members)} files; expected {MOST_MEMBERS} at most", path=path)
            for member in members:
                if wanted(member.filename):
                    limits.check_bytes(member.file_size, f"{path}: {member.filename}", source=len(data))
                    yield member.filename, archive.read(member)
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, OSError, ValueError) as error:
        if isinstance(error, FbaError):
            raise
        raise FormatError(f"is no archive that can be read: {error}", path=path) from error
    except Exception as error:  # zlib.error and the like have no common class
        if type(error).__module__ in ("zlib", "lzma", "_lzma"):
            raise FormatError(f"is damaged: {error}", path=path) from error
        raise


NPY = b"\x93NUMPY"
"""First bytes of an array."""


def read_arrays(path: Path, limits: Limits, *, single: str, objects: bool = False) -> dict[str, Any]:
    """Return the arrays of numbers in a file as float64, by name; other arrays are left out.

    single: the name for the array of an .npy file. objects: leave out arrays of Python objects as well;
    otherwise they are an error. Raises FormatError, LimitError.
    """
    data = read_whole(path)
    if data.startswith(NPY):
        arrays = {single: _read_array(data, path, limits, objects)}
    else:
        members = read_members(data, path, limits, lambda name: name.endswith(".npy"))
        arrays = {name[:-4]: _read_array(content, path, limits, objects) for name, content in members}
    return {name: array for name, array in arrays.items() if array is not None}


def _read_array(data: bytes, path: Path, limits: Limits, objects: bool) -> Any:
    """Return an array of numbers as float64; None for an array of other values."""
    file = io.BytesIO(data)
    try:
        if np.lib.format.read_magic(file) == (1, 0):
            shape, _, dtype = np.lib.format.read_array_header_1_0(file)
        else:
            shape, _, dtype = np.lib.format.read_array_header_2_0(file)
    except (ValueError, TypeError, SyntaxError, EOFError, TokenError) as error:
        raise FormatError(f"is no array that can be read: {error}", path=path) from error
    if dtype.kind not in "fiu":
        if dtype.hasobject and not objects:
            raise FormatError(
                "holds Python objects, which are not read, as they may run programs; save numbers", path=path
            )
        return None
    count = math.prod(shape)
    if count * dtype.itemsize > len(data) - file.tell():
        raise FormatError("is cut off: the array says that it has more numbers than there are", path=path)
    limits.check_bytes(8 * count, f"{path}: an array", source=len(data))
    file.seek(0)
    try:
        return to_float64(np.load(file, allow_pickle=False))
    except (ValueError, EOFError) as error:
        raise FormatError(f"holds an array that cannot be read: {error}", path=path) from error
