"""Wire frame models (.wfm) of Candide: a low-polygon face, its action units and shape units."""

from __future__ import annotations

import os
from array import array
from collections.abc import Iterator

import numpy as np

from fba.errors import ModelError
from fba.mesh._polygons import Polygons
from fba.text_files import MAX_FACES, MAX_VERTICES, parse_integer, parse_number, read_words


def read_wfm(path: str | os.PathLike[str]) -> Polygons:
    """Return vertices and triangles of a .wfm file, in its own unit (Candide: a face is about 2 high).

    The lists of animation and shape units after the faces are not read. Raises ModelError naming the
    line.
    """
    name = os.fspath(path)
    rows = read_words(name)
    numbers = array("d")
    for where, tokens in _table(rows, name, "vertices", MAX_VERTICES):
        numbers.extend(parse_number(token, where, "a coordinate") for token in tokens)
    positions = np.array(numbers).reshape(-1, 3)
    indices = array("q")
    for where, tokens in _table(rows, name, "faces", MAX_FACES):
        triangle = [parse_integer(token, where, "a vertex") for token in tokens]
        wrong = next((vertex for vertex in triangle if not 0 <= vertex < len(positions)), None)
        if wrong is not None:
            raise ModelError(f"{where}: vertex {wrong} does not exist; there are {len(positions)}")
        indices.extend(triangle)
    corners = np.array(indices).reshape(-1, 3)
    return Polygons(
        positions,
        np.arange(len(corners) + 1, dtype=np.int32) * 3,
        corners.reshape(-1).astype(np.int32),
        np.full(corners.size, -1, dtype=np.int32),
        np.zeros(len(corners), dtype=np.int32),
        (("", ""),),
    )


def _table(
    rows: Iterator[tuple[str, list[str]]], path: str, what: str, most: int
) -> Iterator[tuple[str, list[str]]]:
    """Read a count, then yield as many rows of three words, with their places."""
    where, tokens = next(rows, (path, []))
    if len(tokens) != 1:
        raise ModelError(f"{where}: the number of {what} is expected here, alone on its line")
    count = parse_integer(tokens[0], where, f"the number of {what}")
    if not 1 <= count <= most:
        raise ModelError(f"{where}: {count} {what}; a face has 1 to {most}")
    for number in range(count):
        where, tokens = next(rows, (path, []))
        if not tokens:
            raise ModelError(f"{path}: ends after {number} of {count} {what}")
        if len(tokens) != 3:
            raise ModelError(f"{where}: three numbers are expected of each of the {what}, not {len(tokens)}")
        yield where, tokens
