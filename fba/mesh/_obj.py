"""Wavefront OBJ: polygons with groups, objects and materials, read line by line."""

from __future__ import annotations

import os
from array import array

import numpy as np

from fba.arrays import Float32
from fba.errors import ModelError
from fba.mesh._polygons import Polygons
from fba.text_files import MAX_CORNERS, MAX_FACES, MAX_VERTICES, parse_integer, parse_number, read_lines


def read_obj(path: str | os.PathLike[str]) -> Polygons:
    """Return all polygons of an OBJ file, in the file's own units and axes.

    Negative indices count from the end, polygons may have any number of corners from three on, lines
    end with a backslash to go on; curves, smoothing groups and normals are skipped. Texture coordinates
    are turned over: OBJ has its origin at the bottom left. Six numbers after `v` are a position and a
    colour. Raises ModelError naming file and line.
    """
    return _Reader(os.fspath(path)).read()


class _Reader:
    def __init__(self, path: str) -> None:
        self.path = path
        self.positions = array("d")
        self.colours = array("f")
        self.texcoords = array("d")
        self.starts = array("i", [0])
        self.corners = array("i")
        self.coords = array("i")
        self.group = array("i")
        self.groups: dict[tuple[str, str], int] = {}
        self.names = ["", ""]
        self.line = 0

    def read(self) -> Polygons:
        handlers = {"v": self._vertex, "vt": self._texcoord, "f": self._face}
        pending = ""
        for line, text in read_lines(self.path):
            if text.endswith("\\"):
                pending += text[:-1] + " "
                if len(pending) > MAX_CORNERS:
                    raise ModelError(f"{self.path}:{line}: a line goes on beyond {MAX_CORNERS} characters")
                continue
            tokens = (pending + text).split("#", 1)[0].split()
            pending = ""
            if not tokens:
                continue
            key = tokens[0]
            if key in handlers:
                self.line = line
                handlers[key](tokens)
            elif key in ("g", "o"):
                self.names[0] = " ".join(tokens[1:])
            elif key == "usemtl":
                self.names[1] = " ".join(tokens[1:])
        count = len(self.positions) // 3
        if not count or len(self.starts) < 2:
            raise ModelError(
                f"{self.path}: {count} vertices (lines 'v x y z') and {len(self.starts) - 1} faces "
                "(lines 'f i j k'); a face needs both"
            )
        texcoords = np.array(self.texcoords, dtype=np.float64).reshape(-1, 2)
        texcoords[:, 1] = 1.0 - texcoords[:, 1]
        colours = np.array(self.colours, dtype=np.float32).reshape(-1, 3)
        return Polygons(
            np.array(self.positions, dtype=np.float64).reshape(-1, 3),
            np.array(self.starts, dtype=np.int32),
            np.array(self.corners, dtype=np.int32),
            np.array(self.coords, dtype=np.int32),
            np.array(self.group, dtype=np.int32),
            tuple(self.groups),
            texcoords if len(texcoords) else None,
            np.concatenate([_linear(colours), np.full((count, 1), 0.3, np.float32)], axis=1)
            if len(colours) == count
            else None,
        )

    @property
    def where(self) -> str:
        """File and line being read, for error messages."""
        return f"{self.path}:{self.line}"

    def _numbers(self, tokens: list[str], what: str) -> list[float]:
        try:
            numbers = [float(token) for token in tokens]
            if sum(map(abs, numbers)) < 1e30:
                return numbers
        except ValueError:
            pass
        return [parse_number(token, self.where, what) for token in tokens]

    def _vertex(self, tokens: list[str]) -> None:
        if len(self.positions) >= 3 * MAX_VERTICES:
            raise ModelError(f"{self.where}: more than {MAX_VERTICES} vertices; reduce the mesh to its head")
        if len(tokens) < 4:
            raise ModelError(f"{self.where}: a vertex needs three numbers, not {len(tokens) - 1}")
        self.positions.extend(self._numbers(tokens[1:4], "a coordinate"))
        if len(tokens) >= 7:
            self.colours.extend(min(max(c, 0.0), 1.0) for c in self._numbers(tokens[4:7], "a colour"))

    def _texcoord(self, tokens: list[str]) -> None:
        if len(self.texcoords) >= 8 * MAX_VERTICES:
            raise ModelError(f"{self.where}: more than {4 * MAX_VERTICES} texture coordinates")
        if len(tokens) < 3:
            raise ModelError(f"{self.where}: a texture coordinate needs two numbers, not {len(tokens) - 1}")
        self.texcoords.extend(self._numbers(tokens[1:3], "a texture coordinate"))

    def _face(self, tokens: list[str]) -> None:
        if len(tokens) < 4:
            raise ModelError(f"{self.where}: a face needs at least three corners, not {len(tokens) - 1}")
        if len(self.group) >= MAX_FACES or len(self.corners) + len(tokens) > MAX_CORNERS:
            raise ModelError(f"{self.where}: more than {MAX_FACES} faces or {MAX_CORNERS} corners")
        vertices, coords = len(self.positions) // 3, len(self.texcoords) // 2
        for token in tokens[1:]:
            vertex, _, rest = token.partition("/")
            self.corners.append(self._index(vertex, vertices, "vertex"))
            coord = rest.partition("/")[0]
            self.coords.append(self._index(coord, coords, "texture coordinate") if coord else -1)
        self.starts.append(len(self.corners))
        self.group.append(self.groups.setdefault((self.names[0], self.names[1]), len(self.groups)))

    def _index(self, token: str, count: int, what: str) -> int:
        plain = token.isdecimal() and len(token) < 9
        index = int(token) if plain else parse_integer(token, self.where, f"the number of a {what}")
        position = index - 1 if index > 0 else count + index
        if index == 0 or not 0 <= position < count:
            raise ModelError(
                f"{self.where}: {what} {index} does not exist; {count} were defined before this line, "
                "counted from 1, or from -1 backwards"
            )
        return position


def _linear(colour: Float32) -> Float32:
    """Return linear light from the sRGB values that OBJ files hold."""
    return np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4).astype(np.float32)
