"""VRML 97 (.wrl): the indexed face sets of a world, as Xface keeps its meshes."""

from __future__ import annotations

import os
import re

import numpy as np

from fba.errors import ModelError
from fba.mesh._polygons import Polygons
from fba.text_files import MAX_CORNERS, MAX_FACES, MAX_VERTICES, parse_integer, parse_number, read_lines

# Possessive (*+): a pattern that may take characters back remembers a place for each.
TOKEN = re.compile(r'"(?:[^"\\]|\\.)*+"?|[\[\]{}]|[^\s,\[\]{}"]++')
STRING = re.compile(r'"(?:[^"\\]|\\.)*+"')
LISTS = ("point", "coordIndex", "texCoordIndex")


def read_vrml(path: str | os.PathLike[str]) -> list[Polygons]:
    """Return a file's IndexedFaceSets in its unit, transforms not applied. ModelError without any."""
    return _Reader(os.fspath(path)).read()


class _Reader:
    """Reads names, brackets and lists of numbers; skips all other nodes and fields."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.line = 0
        self.vertices = 0
        self._within_string = False

    def read(self) -> list[Polygons]:
        meshes: list[Polygons] = []
        depth, start, node = 0, -1, ""
        fields: dict[str, list[float]] = {}
        inner = ""  # "Coordinate" or "TextureCoordinate", whichever was named last
        key: str | None = None  # the number list being read
        last = ""
        for number_, text in read_lines(self.path):
            self.line = number_
            if number_ == 1 and not text.startswith("#VRML"):
                raise ModelError(f"{self.path}:1: a VRML file begins with '#VRML', not {text[:20]!r}")
            for token in self._tokens(text):
                if key is not None:
                    if token == "]":
                        key = None
                    else:
                        self._number(fields[key], token, key)
                elif token == "{":
                    depth += 1
                    if last == "IndexedFaceSet" and start < 0:
                        start, fields = depth, {}
                    node = last
                    if node in ("Coordinate", "TextureCoordinate"):
                        inner = node
                elif token == "}":
                    if depth == start:
                        meshes.append(self._shape(fields))
                        start = -1
                    depth -= 1
                    if depth < 0:
                        raise ModelError(f"{self.path}:{self.line}: a bracket is closed that is not open")
                elif token == "[" and start >= 0 and last in LISTS:
                    key = "texcoord" if last == "point" and inner == "TextureCoordinate" else last
                    fields[key] = []
                last = token
        if depth or key is not None:
            raise ModelError(f"{self.path}: ends with open brackets; was it fully copied?")
        if not meshes:
            raise ModelError(f"{self.path}: there is no IndexedFaceSet in it")
        return meshes

    def _tokens(self, text: str) -> list[str]:
        """Return the tokens of a line, without comments; a string may go on over several lines."""
        if self._within_string:
            text = '"' + text
        elif "#" in text and '"' not in text:
            text = text.split("#", 1)[0]
        tokens: list[str] = TOKEN.findall(text)
        self._within_string = bool(tokens) and tokens[-1][0] == '"' and not STRING.fullmatch(tokens[-1])
        return tokens

    def _number(self, values: list[float], token: str, key: str) -> None:
        where = f"{self.path}:{self.line}"
        if key in ("point", "texcoord"):
            values.append(parse_number(token, where, "a coordinate"))
        else:
            values.append(parse_integer(token, where, "an index"))
        if len(values) > MAX_CORNERS:
            raise ModelError(f"{where}: more than {MAX_CORNERS} numbers in one list")

    def _shape(self, fields: dict[str, list[float]]) -> Polygons:
        where = f"{self.path}:{self.line}"
        points = fields.get("point", [])
        if len(points) % 3 or not points:
            raise ModelError(
                f"{where}: the face set that ends here has {len(points)} coordinates, not 3 each"
            )
        self.vertices += len(points) // 3
        if self.vertices > MAX_VERTICES:
            raise ModelError(f"{where}: more than {MAX_VERTICES} vertices")
        index = np.array(fields.get("coordIndex", []), dtype=np.int64)
        if len(index) and index[-1] != -1:
            index = np.append(index, -1)
        ends = np.flatnonzero(index == -1)
        corners = index[index != -1]
        if len(corners) and (corners.min() < 0 or corners.max() >= len(points) // 3):
            raise ModelError(
                f"{where}: coordIndex {corners[(corners < 0) | (corners >= len(points) // 3)][0]} "
                f"does not exist; there are {len(points) // 3} vertices"
            )
        starts = np.concatenate([[0], ends - np.arange(len(ends))]) if len(ends) else np.zeros(1)
        if len(starts) - 1 > MAX_FACES:
            raise ModelError(f"{where}: more than {MAX_FACES} faces")
        return Polygons(
            np.array(points, dtype=np.float64).reshape(-1, 3),
            starts.astype(np.int32),
            corners.astype(np.int32),
            np.full(len(corners), -1, dtype=np.int32),
            np.zeros(len(starts) - 1, dtype=np.int32),
            (("", ""),),
        )
