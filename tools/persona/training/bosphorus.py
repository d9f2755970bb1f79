"""Reads a database of scanned faces in the layout of Bosphorus: names, landmarks, clouds, and points of a
tracker.

A folder a person, `bs042`, with files of one name a scan, `bs042_LFAU_9_0`: person, type, expression,
counter.

- `.bnt`: rows, columns (uint16), depth of the background (float64), name of the picture (uint16 length,
text), number of values (uint32), then columns x, y, z, u, v (float64), all little endian; millimetres, z to
the camera. - `.lm2`, `.lm3`: landmarks by name, in the picture and in the cloud: a name on a line, its
numbers on the next. - `.npz`: `points` (64, 2), what a tracker found in the picture. The database has none:
run a tracker on each.

The data are under a licence of their own, and nothing of them is here.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fba.arrays import Float64
from fba.errors import FormatError
from fba.formats.zip_files import read_arrays
from fba.limits import DEFAULT_LIMITS, Limits
from fba.persona.points import fit_face_points
from fba.persona.points.layout import OUTLINE, REGISTERED, SAME, TRACKED, compute_vertices, standard_points
from fba.source import read_whole
from tools.persona.training.classes import NEUTRAL, face_classes
from tools.persona.training.depth_maps import DepthMap, fill_holes, find_outline, make_depth_map
from tools.persona.training.examples import Examples

NAME = re.compile(r"(bs\d{3})_(N|E|LFAU|UFAU|CAU|YR|PR|CR|O|IGN)_(\w+?)_(\d{1,3})", re.ASCII)
EXPRESSIVE = ("N", "E", "LFAU", "UFAU", "CAU")
"""Types that are used: heads of the others are turned, covered, or show something else."""
SLIGHT = {"LFAU_12LW": "LFAU_12"}
"""Expressions that are a slighter form of a class."""
MOST_SIDE = 4096
"""Rows and columns of a cloud at most."""
LANDMARKS = 22
TIP, BROW = 57, 9
"""Points by whose depth the face is cut out."""


@dataclass(frozen=True)
class ScanName:
    """What the name of a file says. kind: its type, such as "LFAU"; counter: of repetitions."""

    person: str
    kind: str
    expression: str
    counter: int

    @property
    def label(self) -> str:
        """The name of its class: "NEUTRAL", or type and expression; "" for scans that are not used."""
        if self.kind not in EXPRESSIVE:
            return ""
        name = NEUTRAL if self.kind == "N" else f"{self.kind}_{self.expression}"
        return SLIGHT.get(name, name)


def parse_name(stem: str) -> ScanName:
    """Return what a name like "bs042_LFAU_9_0" says. Raises FormatError for another one."""
    match = NAME.fullmatch(stem)
    if match is None:
        raise FormatError("is no name of a scan; expected person_type_expression_counter", token=stem)
    person, kind, expression, counter = match.groups()
    return ScanName(person, kind, expression, int(counter))


@dataclass(frozen=True, eq=False)
class Cloud:
    """Points of a scan: float64 (N, 3), millimetres; their places in the picture (N, 2); depth where
    nothing is."""

    points: Float64
    picture: Float64
    background: float


def read_cloud(path: Path, limits: Limits = DEFAULT_LIMITS) -> Cloud:
    """Return the cloud in a .bnt file. Raises FormatError, LimitError."""
    data = read_whole(path)
    try:
        rows, columns, background, length = struct.unpack_from("<HHdH", data)
        (count,) = struct.unpack_from("<I", data, 14 + length)
    except struct.error as error:
        raise FormatError("is cut off in its header", path=path) from error
    if not (0 < rows <= MOST_SIDE and 0 < columns <= MOST_SIDE and count == 5 * rows * columns):
        raise FormatError(f"has {rows} rows, {columns} columns and {count} values: not 5 a point", path=path)
    start = 18 + length
    if len(data) - start < 8 * count:
        raise FormatError(f"is cut off: {len(data) - start} bytes of {8 * count}", path=path)
    limits.check_bytes(8 * count, f"{path}: the cloud", source=len(data))
    values = np.frombuffer(data, "<f8", count, start).reshape(5, -1).T
    seen = np.isfinite(values).all(axis=1) & (values[:, 2] > background) & np.isfinite(background)
    if not seen.any():
        raise FormatError("has no point in front of its background", path=path)
    return Cloud(values[seen, :3].copy(), values[seen, 3:].copy(), float(background))


def read_landmarks(path: Path) -> dict[str, Float64]:
    """Return landmarks by name, of a .lm2 or .lm3 file: (2,) or (3,) each. Raises FormatError."""
    width = 3 if path.suffix.lower() == ".lm3" else 2
    text = read_whole(path).decode("utf-8", "replace").splitlines()
    lines = [(number, line.strip()) for number, line in enumerate(text, 1)]
    lines = [(n, line) for n, line in lines if line and not line.startswith("#") and "landmarks:" not in line]
    found: dict[str, Float64] = {}
    for (_, name), (number, numbers) in zip(lines[::2], lines[1::2], strict=False):
        try:
            place = np.array([float(one) for one in numbers.split()])
        except ValueError as error:
            raise FormatError(
                "no coordinates of a landmark", path=path, line=number, token=numbers
            ) from error
        if place.shape != (width,) or not np.isfinite(place).all():
            raise FormatError(f"a landmark has {width} coordinates", path=path, line=number, token=numbers)
        if name in found or len(found) == LANDMARKS:
            raise FormatError(
                f"landmarks have different names, {LANDMARKS} at most", path=path, line=number, token=name
            )
        found[name] = place
    if len(found) < 3:
        raise FormatError(f"has {len(found)} landmarks; three at least are needed", path=path)
    return found


def read_scan(path: Path, limits: Limits = DEFAULT_LIMITS) -> Float64:
    """Return the points of tracker and outline of a scan, in the cloud's axes: float64 (80, 3), millimetres.

    path: of its .bnt file; the others lie beside it. Raises FormatError, LimitError.
    """
    cloud = read_cloud(path, limits)
    here, there = (read_landmarks(path.with_suffix(suffix)) for suffix in (".lm2", ".lm3"))
    both = [name for name in here if name in there]
    if len(both) < 3:
        raise FormatError(f"picture and cloud have {len(both)} landmarks in common, not three", path=path)
    arrays = read_arrays(path.with_suffix(".npz"), limits, single="points")
    points = arrays.get("points")
    if points is None or points.shape != (TRACKED, 2) or not np.isfinite(points).all():
        raise FormatError(f"needs `points` ({TRACKED}, 2) of a tracker", path=path.with_suffix(".npz"))
    to_cloud = fit_face_points(
        np.array([here[name] for name in both]), np.array([there[name][:2] for name in both])
    )
    across = to_cloud.apply(points)
    depth = fill_holes(make_depth_map(cloud.points), across)
    deep = _look_up(depth, across, path)
    outline = find_outline(depth, float(deep[TIP - 1]), float(deep[BROW - 1]), OUTLINE)
    deep_outline = _look_up(fill_holes(depth, outline), outline, path)
    return np.concatenate([np.column_stack([across, deep]), np.column_stack([outline, deep_outline])])


def _look_up(depth: DepthMap, places: Float64, path: Path) -> Float64:
    deep = depth.look_up(places)
    if np.isnan(deep).any():
        missing = np.flatnonzero(np.isnan(deep)) + 1
        raise FormatError(f"points {missing.tolist()[:8]} lie beside the cloud", path=path)
    return deep


def read_database(folder: Path, limits: Limits = DEFAULT_LIMITS) -> Examples:
    """Return examples of all scans below a folder whose type is used, of persons with a neutral one.

    Raises FormatError for a scan that cannot be read or is missing.
    """
    known = [one.name for one in face_classes()]
    people: dict[str, list[tuple[int, Float64, Float64]]] = {}
    for path, name in _scans(folder):
        if name.label in known:
            points, mask = _register(read_scan(path, limits))
            people.setdefault(name.person, []).append((known.index(name.label), points, mask))
    rows = []
    for number, scans in enumerate(people.values()):
        rest = [(points, mask) for one, points, mask in scans if one == 0]
        if rest:
            points, mask = rest[0]
            rows += [(own, points, one, number, (moved - mask)[:, 2]) for one, own, moved in scans]
    if not rows:
        raise FormatError("has no scans of a person with a neutral one", path=folder)
    own, still, classes, person, depth = (np.array([row[n] for row in rows]) for n in range(5))
    return Examples(own, still, classes, person, np.ones(len(rows)), depth, np.zeros(len(rows)))


def _scans(folder: Path) -> Iterator[tuple[Path, ScanName]]:
    for path in sorted(folder.rglob("*.bnt")):
        try:
            yield path, parse_name(path.stem)
        except FormatError as error:
            raise FormatError(error.finding, path=path) from error


def _register(points: Float64) -> tuple[Float64, Float64]:
    """Return tracked points (64, 2) and the mask (86, 3) of a scan on the standard mask (equation 4.2)."""
    across = compute_vertices(points[:, :2])
    deep = np.concatenate([points[:SAME, 2], np.zeros(len(across) - SAME)])
    # computed vertices are as deep as the tracked or outline point that they are nearest to
    apart = np.linalg.norm(across[SAME:, None] - points[None, :, :2], axis=2)
    deep[SAME:] = points[apart.argmin(axis=1), 2]
    rows = [number - 1 for number in REGISTERED]
    similarity = fit_face_points(points[rows], standard_points()[rows], mirror=False)
    mask = similarity.apply(np.column_stack([across, deep]))
    return similarity.apply(points[:TRACKED])[:, :2], mask
