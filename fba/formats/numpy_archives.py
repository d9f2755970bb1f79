"""Read arrays of numbers from files of NumPy (.npy, .npz); Python objects in them are never loaded."""

from __future__ import annotations

import io
import math
import zipfile
from tokenize import TokenError
from typing import Any

import numpy as np

from fba.arrays import to_float64
from fba.errors import FbaError, FormatError
from fba.limits import Limits
from fba.source import Path, read_whole

NPY, ZIP = b"\x93NUMPY", b"PK\x03\x04"
"""First bytes of an array, and of an archive of arrays."""
MOST_ARRAYS = 1000


def read_arrays(path: Path, limits: Limits, *, single: str, objects: bool = False) -> dict[str, Any]:
    """Return the arrays of numbers in a file as float64, by name; other arrays are left out.

    single: the name for the array of an .npy file. objects: leave out arrays of Python objects as well;
    otherwise they are an error. Raises FormatError, LimitError.
    """
    data = read_whole(path)
    if data.startswith(NPY):
        return {single: _read_array(data, path, limits, objects)}
    arrays = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            if len(members) > MOST_ARRAYS:
                raise FormatError(f"holds {len(members)} files; expected a few arrays", path=path)
            for member in members:
                if member.filename.endswith(".npy"):
                    limits.check_bytes(member.file_size, f"{path}: {member.filename}", source=len(data))
                    arrays[member.filename[:-4]] = _read_array(archive.read(member), path, limits, objects)
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, OSError, ValueError) as error:
        if isinstance(error, FbaError):
            raise
        raise FormatError(f"is no archive of arrays that can be read: {error}", path=path) from error
    except Exception as error:  # zlib.error and the like have no common class
        if type(error).__module__ in ("zlib", "lzma", "_lzma"):
            raise FormatError(f"is damaged: {error}", path=path) from error
        raise
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
    return to_float64(np.load(file, allow_pickle=False))
