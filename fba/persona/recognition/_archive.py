"""Files of Personas and recognisers: zip archives of a JSON header and arrays.

`header.json` has the kind of file, its version and plain values; each other member is an array of numbers in
NumPy's format (.npy), never of Python objects. Equal content gives equal bytes.
"""

from __future__ import annotations

import io
import json
import zipfile
from typing import Any

import numpy as np

from fba.arrays import Array, Float64
from fba.errors import FormatError, UnsupportedError
from fba.formats.zip_files import ZIP, read_arrays
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path, read_head

HEADER = "header.json"
MAX_HEADER = 1 << 20
"""Largest size of a header, bytes."""
DATE = (1980, 1, 1, 0, 0, 0)
"""Modification date of all members."""


def pack_archive(kind: str, version: int, header: dict[str, Any], arrays: dict[str, Array]) -> bytes:
    """Return the bytes of a file."""
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as archive:
        text = json.dumps({"kind": kind, "version": version, **header}, indent=1, sort_keys=True)
        archive.writestr(zipfile.ZipInfo(HEADER, DATE), text, zipfile.ZIP_DEFLATED)
        for name, array in sorted(arrays.items()):
            member = io.BytesIO()
            np.lib.format.write_array(member, np.ascontiguousarray(array), version=(1, 0), allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy", DATE), member.getvalue(), zipfile.ZIP_DEFLATED)
    return data.getvalue()


def read_archive(
    path: Path, kind: str, version: int, limits: Limits = DEFAULT_LIMITS, *, oldest: int | None = None
) -> tuple[dict[str, Any], dict[str, Float64]]:
    """Return the header and the arrays of a file. oldest: oldest version that is read; by default `version`.

    Raises FormatError for a file of another kind or a damaged one; UnsupportedError for another version;
    LimitError.
    """
    if not read_head(path).startswith(ZIP):
        raise FormatError(f"is not a {kind} file", path=path)
    try:
        with zipfile.ZipFile(path) as archive:
            size = archive.getinfo(HEADER).file_size
            if size > MAX_HEADER:
                raise FormatError(f"has a header of {size} bytes; expected {MAX_HEADER} at most", path=path)
            header = json.loads(archive.read(HEADER))
    except KeyError as error:
        raise FormatError(f"is not a {kind} file: it has no {HEADER}", path=path) from error
    except FormatError:
        raise
    except Exception as error:  # zipfile, zlib and json fail in many ways on damage
        raise FormatError(f"is damaged: its header cannot be read: {error}", path=path) from error
    if not isinstance(header, dict) or header.get("kind") != kind:
        raise FormatError(f"is not a {kind} file", path=path)
    given = header.get("version")
    oldest = version if oldest is None else oldest
    if type(given) is not int or not oldest <= given <= version:
        raise UnsupportedError(
            f"{path}: a {kind} file of version {given!r}; this is {version}: make it again"
        )
    return header, read_arrays(path, limits, single="")


class Fields:
    """Checked access to the content of a file; FormatError where something is missing or has another form."""

    def __init__(self, path: Path, header: dict[str, Any], arrays: dict[str, Float64]) -> None:
        self._path, self._header, self._arrays = path, header, arrays

    def array(self, name: str, *shape: int | None) -> Float64:
        """Return an array of finite numbers of this shape; None stands for any length."""
        array = self._arrays.get(name)
        if array is None:
            raise FormatError(f"lacks the array {name}", path=self._path)
        fits = array.ndim == len(shape) and all(
            want in (None, size) for want, size in zip(shape, array.shape, strict=True)
        )
        if not fits:
            expected = ", ".join("any" if want is None else str(want) for want in shape)
            raise FormatError(f"{name} has shape {array.shape}; expected ({expected})", path=self._path)
        if not np.isfinite(array).all():
            raise FormatError(f"{name} has numbers that are not finite", path=self._path)
        return array

    def indices(self, name: str, most: int, length: int | None = None) -> Array:
        """Return whole numbers from 0 to below `most`."""
        array = self.array(name, length)
        if ((array < 0) | (array >= most) | (array != np.floor(array))).any():
            raise FormatError(f"{name} must be whole numbers from 0 to {most - 1}", path=self._path)
        return array.astype(np.intp)

    def text(self, name: str) -> str:
        """Return a text from the header."""
        value = self._header.get(name)
        if not isinstance(value, str):
            raise FormatError(f"{name} must be a text, not {value!r}"[:200], path=self._path)
        return value

    def texts(self, name: str) -> tuple[str, ...]:
        """Return a list of texts from the header."""
        value = self._header.get(name)
        if not isinstance(value, list) or not all(isinstance(text, str) for text in value):
            raise FormatError(f"{name} must be a list of texts", path=self._path)
        return tuple(value)

    def number(self, name: str) -> float:
        """Return a finite number from the header."""
        value = self._header.get(name)
        if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
            raise FormatError(f"{name} must be a number, not {value!r}"[:200], path=self._path)
        return float(value)
