"""Vertices and grouped polygons of an OBJ file, all that a rigged body needs of it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from fba.errors import FormatError, ModelError

Float64 = npt.NDArray[np.float64]
Int64 = npt.NDArray[np.int64]

MAX_BYTES = 256 << 20
MAX_CORNERS = 1 << 23


@dataclass(frozen=True, eq=False)
class ObjMesh:
    """vertices: float64 (V, 3), in the file's unit. triangles: int64 (F, 3), polygons cut into fans. group:
    int64 (F,), index into `groups`, the names of the file's groups."""

    vertices: Float64
    triangles: Int64
    group: Int64
    groups: tuple[str, ...]

    def of(self, *names: str) -> Int64:
        """(N, 3) triangles of some groups."""
        wanted = [number for number, name in enumerate(self.groups) if name in names]
        chosen: Int64 = self.triangles[np.isin(self.group, wanted)]
        return chosen


def read_text(path: str | os.PathLike[str], most: int = MAX_BYTES) -> str:
    """A text file's content; FormatError where it cannot be read, ModelError where it is too large."""
    name = os.fspath(path)
    try:
        size = Path(name).stat().st_size
        if size > most:
            raise ModelError(f"{name}: {size} bytes, more than the {most} that are read")
        return Path(name).read_bytes().decode("utf-8", errors="replace")
    except (OSError, ValueError) as error:
        raise FormatError(
            f"cannot be read: {getattr(error, 'strerror', None) or error}", path=name
        ) from error


def read_obj_mesh(path: str | os.PathLike[str]) -> ObjMesh:
    """Read an OBJ file. Raises FormatError or ModelError naming file and line."""
    name = os.fspath(path)
    places: list[list[float]] = []
    triangles: list[tuple[int, int, int]] = []
    group: list[int] = []
    groups: dict[str, int] = {"": 0}
    current = 0
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        key, *words = line.split() or [""]
        try:
            if key == "v":
                places.append([float(word) for word in words[:3]])
                if len(places[-1]) != 3 or not all(abs(value) < 1e9 for value in places[-1]):
                    raise ValueError("a vertex needs three finite numbers")
            elif key in ("g", "o"):
                current = groups.setdefault(" ".join(words), len(groups))
            elif key == "f":
                corners = [int(word.split("/")[0]) for word in words]
                corners = [corner - 1 if corner > 0 else len(places) + corner for corner in corners]
                if not all(0 <= corner < len(places) for corner in corners):
                    raise ValueError(f"a face names a vertex that is not there ({len(places)} so far)")
                if len(triangles) + len(corners) > MAX_CORNERS:
                    raise ValueError("more faces than are read")
                for k in range(1, len(corners) - 1):
                    triangles.append((corners[0], corners[k], corners[k + 1]))
                    group.append(current)
        except ValueError as error:
            raise ModelError(f"{name}:{number}: {error} (found {line.strip()[:60]!r})") from None
    if not places or not triangles:
        raise ModelError(
            f"{name}: there is no mesh in this file: {len(places)} vertices, {len(triangles)} triangles"
        )
    return ObjMesh(
        np.array(places), np.array(triangles, dtype=np.int64), np.array(group, dtype=np.int64), tuple(groups)
    )
