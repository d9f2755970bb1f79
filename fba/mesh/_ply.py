"""PLY meshes, ASCII and binary of either byte order, read by what their header says."""

from __future__ import annotations

import os
from array import array
from dataclasses import dataclass, field

import numpy as np

from fba.arrays import Float32, Float64, Int64, to_float64
from fba.errors import ModelError
from fba.mesh._polygons import Polygons, strip_triangles
from fba.text_files import MAX_CORNERS, MAX_FACES, MAX_VERTICES, parse_integer, read_bytes

TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
MAX_HEADER = 1 << 16
"""Longest header, in bytes."""
MAX_BYTES = 1 << 30
"""Largest file."""
MAX_ASCII = 1 << 27
"""Largest file of ASCII numbers."""
MAX_PROPERTIES = 200
AT_ONCE = 65536
"""Lists that are joined at once."""
FACE_LISTS = ("vertex_indices", "vertex_index")
S_NAMES = ("s", "u", "texture_u")
T_NAMES = ("t", "v", "texture_v")
"""Names of the properties that are texture coordinates."""


@dataclass
class _Element:
    name: str
    count: int
    properties: list[tuple[str, str, str]] = field(default_factory=list)
    """(name, type, type of the list's length or "")."""


def read_ply(path: str | os.PathLike[str]) -> Polygons:
    """Return vertices, texture coordinates, colours and polygons of a PLY file, in its own units.

    Raises ModelError naming the file and the place of what is wrong, and for more than
    `MAX_VERTICES` vertices.
    """
    name = os.fspath(path)
    data = read_bytes(name, MAX_BYTES)
    order, elements, start = _read_header(name, data)
    if not order and len(data) > MAX_ASCII:
        raise ModelError(f"{name}: is {len(data)} bytes of ASCII, more than {MAX_ASCII}; save it as binary")
    words = [] if order else data[start:].split()
    return _Reader(name, data, order, elements, words, start).read()


def _read_header(path: str, data: bytes) -> tuple[str, list[_Element], int]:
    """Return the order of bytes ("" for ASCII), the elements, and where the data begins."""
    end = data.find(b"end_header", 0, MAX_HEADER)
    if not data.startswith(b"ply") or end < 0:
        raise ModelError(f"{path}: a PLY file begins with 'ply' and a header up to 'end_header'")
    start = data.find(b"\n", end, end + 16) + 1
    if not start:
        raise ModelError(f"{path}: nothing follows its header")
    order: str | None = None
    elements: list[_Element] = []
    for line, text in enumerate(data[:end].decode("latin-1").splitlines(), start=1):
        where, tokens = f"{path}:{line}", text.split()
        if not tokens or tokens[0] in ("ply", "comment", "obj_info"):
            continue
        if tokens[0] == "format" and len(tokens) > 1 and tokens[1] in ORDERS:
            order = ORDERS[tokens[1]]
        elif tokens[0] == "element" and len(tokens) == 3:
            count = parse_integer(tokens[2], where, f"the number of {tokens[1][:20]}")
            most = {"vertex": MAX_VERTICES, "face": MAX_FACES}.get(tokens[1], MAX_FACES)
            if not 0 <= count <= most:
                raise ModelError(f"{where}: {count} of element {tokens[1][:20]}; at most {most} are read")
            elements.append(_Element(tokens[1], count))
        elif tokens[0] == "property" and elements:
            elements[-1].properties.append(_read_property(tokens, where))
            if len(elements[-1].properties) > MAX_PROPERTIES:
                raise ModelError(f"{where}: more than {MAX_PROPERTIES} properties")
        else:
            raise ModelError(f"{where}: {text.strip()[:60]!r} is no line of a PLY header")
    if order is None:
        raise ModelError(f"{path}: the header has no line 'format', ascii or binary")
    return order, elements, start


def _read_property(tokens: list[str], where: str) -> tuple[str, str, str]:
    if len(tokens) == 3 and tokens[1] in TYPES:
        return tokens[2], TYPES[tokens[1]], ""
    if len(tokens) == 5 and tokens[1] == "list" and tokens[2] in TYPES and tokens[3] in TYPES:
        if TYPES[tokens[2]].startswith("f"):
            raise ModelError(f"{where}: the length of a list cannot be a fraction")
        return tokens[4], TYPES[tokens[3]], TYPES[tokens[2]]
    raise ModelError(f"{where}: {' '.join(tokens)[:60]!r} is no property that is known")


class _Lists:
    """Lists of numbers, joined now and then: an array takes far more memory than the few numbers in it."""

    def __init__(self) -> None:
        self._starts = array("q", [0])
        self._blocks: list[Float64] = []
        self._last: list[Float64] = []

    def append(self, numbers: Float64) -> None:
        """Add a list."""
        self._starts.append(self._starts[-1] + len(numbers))
        self._last.append(numbers)
        if len(self._last) == AT_ONCE:
            self._blocks.append(np.concatenate(self._last))
            self._last = []

    def joined(self) -> tuple[Int64, Float64]:
        """Return where each list starts, int64 (lists + 1,), and all numbers."""
        return np.array(self._starts), np.concatenate([np.zeros(0), *self._blocks, *self._last])


@dataclass
class _Reader:
    """Reads the elements of a file. order: of bytes, "" for ASCII, whose words are read instead."""

    path: str
    data: bytes
    order: str
    elements: list[_Element]
    words: list[bytes]
    at: int
    word: int = 0

    def read(self) -> Polygons:
        columns: dict[str, Float64] = {}
        starts, corners = np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int64)
        for element in self.elements:
            scalars, lists = self._element(element)
            if element.name == "vertex":
                columns = scalars
            elif element.name == "face":
                lists_of_faces = [lists[key] for key in FACE_LISTS if key in lists]
                if not lists_of_faces:
                    raise ModelError(f"{self.path}: element face has no list vertex_indices")
                starts, corners = lists_of_faces[0]
            elif element.name == "tristrips":
                for strip_starts, strips in lists.values():
                    strip_corners = strip_triangles(strip_starts, strips)
                    corners = np.concatenate([corners, strip_corners])
                    starts = np.append(starts, starts[-1] + 3 * np.arange(1, len(strip_corners) // 3 + 1))
        if not {"x", "y", "z"} <= set(columns):
            raise ModelError(f"{self.path}: element vertex with properties x, y and z is expected")
        vertices = np.stack([columns[axis] for axis in "xyz"], axis=1)
        if not (np.abs(vertices) < 1e30).all():
            bad = int(np.argwhere(~(np.abs(vertices) < 1e30))[0, 0])
            raise ModelError(f"{self.path}: vertex {bad} is at {vertices[bad].tolist()}, which is not finite")
        if not len(vertices) or len(starts) < 2:
            raise ModelError(
                f"{self.path}: {len(vertices)} vertices and {len(starts) - 1} faces; a face needs both "
                "(a cloud of points has no surface to deform)"
            )
        if len(corners) and (corners.min() < 0 or corners.max() >= len(vertices)):
            position = int(np.flatnonzero((corners < 0) | (corners >= len(vertices)))[0])
            raise ModelError(
                f"{self.path}: face {int(np.searchsorted(starts, position, side='right')) - 1} names vertex "
                f"{corners[position]}, but there are {len(vertices)}"
            )
        texcoords = self._texcoords(columns)
        return Polygons(
            vertices,
            starts.astype(np.int32),
            corners.astype(np.int32),
            np.full(len(corners), -1, dtype=np.int32) if texcoords is None else corners.astype(np.int32),
            np.zeros(len(starts) - 1, dtype=np.int32),
            (("", ""),),
            texcoords,
            self._colours(columns),
        )

    def _element(self, element: _Element) -> tuple[dict[str, Float64], dict[str, tuple[Int64, Int64]]]:
        if not element.properties and element.count:
            raise ModelError(f"{self.path}: element {element.name[:20]} has no properties")
        if any(length for _, _, length in element.properties):
            return self._with_lists(element)
        names = [name for name, _, _ in element.properties]
        if self.order:
            # names of properties may repeat in broken files; places do not
            row = np.dtype([(str(i), self.order + t) for i, (_, t, _) in enumerate(element.properties)])
            need = row.itemsize * element.count
            if len(self.data) - self.at < need:
                raise self._short(element)
            table = np.frombuffer(self.data, row, element.count, self.at)
            self.at += need
            return {name: to_float64(table[str(i)]) for i, name in enumerate(names)}, {}
        need = len(names) * element.count
        if len(self.words) - self.word < need:
            raise self._short(element)
        flat = self._floats(self.word, need, element)
        self.word += need
        return {name: flat[i :: len(names)] for i, name in enumerate(names)}, {}

    def _with_lists(self, element: _Element) -> tuple[dict[str, Float64], dict[str, tuple[Int64, Int64]]]:
        """Return rows of different lengths; only the lists are kept."""
        even = self._even_lists(element) if self.order and element.count else None
        if even is not None:
            return {}, even
        lists_of = {name: _Lists() for name, _, length in element.properties if length}
        total = 0
        for number in range(element.count):
            for name, kind, length in element.properties:
                if not length:
                    self._take(kind, 1, element, number)
                    continue
                given = self._take(length, 1, element, number)[0]
                if not 0 <= given <= MAX_CORNERS - total:  # in text it may be infinite, or no number
                    raise ModelError(
                        f"{self.path}: {element.name[:20]} {number}: a list of {given:.0f}; all together may "
                        f"have {MAX_CORNERS}"
                    )
                count = int(given)
                if count != given:
                    raise ModelError(
                        f"{self.path}: {element.name[:20]} {number}: a list of {given:g}; "
                        "expected a whole number"
                    )
                total += count
                lists_of[name].append(self._take(kind, count, element, number))
        lists = {}
        for name, rows in lists_of.items():
            starts, values = rows.joined()
            if name in FACE_LISTS and not ((np.abs(values) < 2**53) & (values == np.rint(values))).all():
                raise ModelError(f"{self.path}: {element.name[:20]}: an index is not a whole number")
            lists[name] = (starts, np.nan_to_num(values).astype(np.int64))
        return {}, lists

    def _even_lists(self, element: _Element) -> dict[str, tuple[Int64, Int64]] | None:
        """Return all rows at once, if every list is as long as the first, as in a mesh of triangles."""
        lengths = [(name, length) for name, _, length in element.properties if length]
        at, row = self.at, []
        for place, (_, kind, length) in enumerate(element.properties):
            if length:
                size = np.dtype(self.order + length).itemsize
                if len(self.data) - at < size:
                    return None
                count = int(np.frombuffer(self.data, self.order + length, 1, at)[0])
                if not 0 <= count <= 1000:
                    return None
                row += [(f"n{place}", self.order + length), (f"{place}", self.order + kind, (count,))]
                at += size + count * np.dtype(kind).itemsize
            else:
                row.append((f"{place}", self.order + kind))
                at += np.dtype(kind).itemsize
        dtype = np.dtype(row)
        if len(lengths) != 1 or len(self.data) - self.at < dtype.itemsize * element.count:
            return None
        table = np.frombuffer(self.data, dtype, element.count, self.at)
        place = [bool(length) for _, _, length in element.properties].index(True)
        values = table[f"{place}"]
        if (table[f"n{place}"] != values.shape[1]).any() or values.size > MAX_CORNERS:
            return None
        self.at += dtype.itemsize * element.count
        starts = np.arange(element.count + 1, dtype=np.int64) * values.shape[1]
        flat = np.nan_to_num(to_float64(values.reshape(-1)))
        return {lengths[0][0]: (starts, np.clip(flat, -1, 2**53).astype(np.int64))}

    def _take(self, kind: str, count: int, element: _Element, number: int) -> Float64:
        if self.order:
            row = np.dtype(self.order + kind)
            if len(self.data) - self.at < row.itemsize * count:
                raise self._short(element, number)
            taken = np.frombuffer(self.data, row, count, self.at)
            self.at += row.itemsize * count
            return to_float64(taken)
        if len(self.words) - self.word < count:
            raise self._short(element, number)
        taken_words = self._floats(self.word, count, element)
        self.word += count
        return taken_words

    def _floats(self, start: int, count: int, element: _Element) -> Float64:
        try:
            return np.array([float(word) for word in self.words[start : start + count]], dtype=np.float64)
        except (ValueError, OverflowError) as error:
            raise ModelError(f"{self.path}: element {element.name[:20]}: {error}") from error

    def _short(self, element: _Element, number: int | None = None) -> ModelError:
        place = "" if number is None else f", in {number}"
        return ModelError(
            f"{self.path}: ends within {element.count} of element {element.name[:20]}{place}; is it whole?"
        )

    def _texcoords(self, columns: dict[str, Float64]) -> Float64 | None:
        for s, t in zip(S_NAMES, T_NAMES, strict=True):
            if s in columns and t in columns:
                pair = np.stack([columns[s], 1.0 - columns[t]], axis=1)
                return pair if (np.abs(pair) < 1e6).all() else None
        return None

    @staticmethod
    def _colours(columns: dict[str, Float64]) -> Float32 | None:
        if not {"red", "green", "blue"} <= set(columns):
            return None
        rgb = np.stack([columns[name] for name in ("red", "green", "blue")], axis=1)
        if not np.isfinite(rgb).all():
            return None
        scale = 255.0 if rgb.max() > 1.0 else 1.0
        linear = np.clip(rgb / scale, 0.0, 1.0) ** 2.2
        return np.concatenate([linear, np.full((len(rgb), 1), 0.3)], axis=1).astype(np.float32)
