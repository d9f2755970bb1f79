"""The file of an index: arrays and a description in JSON, as a .npz file, which NumPy reads, too."""

from __future__ import annotations

import json
import os
import zipfile
import zlib
from dataclasses import dataclass
from fractions import Fraction
from tokenize import TokenError
from typing import Any, NamedTuple

import numpy as np

from fba.arrays import Bool, Float32, Int32, Int64, UInt8
from fba.atomic import atomic
from fba.errors import FormatError
from fba.limits import Limits
from fba.outlines._mask import SIDE
from fba.outlines._methods import SAMPLES
from fba.outlines._raster import View
from fba.parameters import BAP_COUNT, FAP_COUNT
from fba.source import open_source

DAMAGE = (zipfile.BadZipFile, zlib.error, EOFError, OSError, NotImplementedError, RuntimeError)
"""What a damaged file raises."""
REMEDY = "`fba find --build` makes one"
FORMAT, VERSION = "fba-outlines", 1
CANVAS = SIDE + 4
"""Pixels of the sides of a stored silhouette."""
MOST_ROWS = 1 << 22


class Stream(NamedTuple):
    """A performance: its name and frame rate, which FAPs (68) it shows and which BAPs (296) it sends."""

    name: str
    rate: Fraction
    face: tuple[bool, ...]
    body: tuple[bool, ...]


@dataclass(frozen=True, eq=False)
class Stored:
    """The content of an index: S streams, K poses, V views, and K V silhouettes.

    faps: int32 (K, 68). baps: int32 (K, 296). pose_frames: int64 (K,), positions in the animation.
    pose_indices: int64 (K,), times in frame periods. pose_streams: int32 (K,). masks: uint8 (K V, 1250), bits
    of 100 x 100 pixels. descriptions: float32 (K V, 64, 3), as `describe_points` returns them.
    """

    streams: tuple[Stream, ...]
    views: tuple[View, ...]
    faps: Int32
    baps: Int32
    pose_frames: Int64
    pose_indices: Int64
    pose_streams: Int32
    masks: UInt8
    descriptions: Float32


LAYOUT: dict[str, tuple[str, tuple[int, ...], bool]] = {
    "faps": ("<i4", (FAP_COUNT,), False),
    "baps": ("<i4", (BAP_COUNT,), False),
    "pose_frames": ("<i8", (), False),
    "pose_indices": ("<i8", (), False),
    "pose_streams": ("<i4", (), False),
    "masks": ("|u1", (CANVAS * CANVAS // 8,), True),
    "descriptions": ("<f4", (SAMPLES, 3), True),
}
"""Arrays by name: dtype, shape of a row, and whether there is a row for each silhouette, not each pose."""


def pack_mask(mask: Bool) -> UInt8:
    """Return the bits (1250,) of a silhouette of at most 100 x 100 pixels, in the middle of such a square."""
    canvas = np.zeros((CANVAS, CANVAS), dtype=bool)
    top, left = ((CANVAS - side) // 2 for side in mask.shape)
    canvas[top : top + mask.shape[0], left : left + mask.shape[1]] = mask
    return np.packbits(canvas)


def unpack_mask(bits: UInt8) -> Bool:
    """Return the silhouette (100, 100) of bits (1250,)."""
    return np.unpackbits(bits, count=CANVAS * CANVAS).astype(bool).reshape(CANVAS, CANVAS)


def write_index(path: str | os.PathLike[str], stored: Stored) -> None:
    """Write an index, whole or not at all. Raises FormatError where that fails."""
    about = {
        "format": FORMAT,
        "version": VERSION,
        "views": [[view.yaw, view.pitch] for view in stored.views],
        "streams": [
            {
                "name": stream.name,
                "rate": str(stream.rate),
                "faps": (np.flatnonzero(stream.face) + 1).tolist(),
                "baps": (np.flatnonzero(stream.body) + 1).tolist(),
            }
            for stream in stored.streams
        ],
    }
    arrays: dict[str, Any] = {name: getattr(stored, name) for name in LAYOUT}
    with atomic(path) as file:
        np.savez_compressed(file, about=np.frombuffer(json.dumps(about).encode(), dtype=np.uint8), **arrays)


def read_index(path: str | os.PathLike[str], limits: Limits) -> Stored:
    """Return an index. Raises FormatError for another kind of file, a damaged or a contradictory one;
    LimitError for arrays that take too much memory for the size of the file."""
    file, size = open_source(path)
    with file:
        try:
            with zipfile.ZipFile(file) as archive:
                count = sum(entry.file_size for entry in archive.infolist())
                limits.check_bytes(count, f"{path}: an index", source=size)
                about = _read_about(_read_array(archive, "about", path).tobytes(), path)
                arrays = {name: _read_array(archive, name, path) for name in LAYOUT}
        except DAMAGE as error:
            if isinstance(error, FormatError):
                raise
            raise FormatError(
                f"is not an index of outlines, or is damaged ({error}); {REMEDY}", path=path
            ) from error
    streams, views = about
    _check(arrays, len(streams), len(views), path)
    return Stored(streams, views, **arrays)


def _read_array(archive: zipfile.ZipFile, name: str, path: str | os.PathLike[str]) -> Any:
    """Return an array of the file, which takes the memory that the archive's list says."""
    try:
        entry = archive.getinfo(f"{name}.npy")
    except KeyError:
        raise FormatError(
            f"is not an index of outlines: it has no array {name!r}; {REMEDY}", path=path
        ) from None
    with archive.open(entry) as member:
        try:
            if np.lib.format.read_magic(member) != (1, 0):
                raise ValueError("its header has another version")
            shape, fortran, dtype = np.lib.format.read_array_header_1_0(member)
            if fortran or dtype.hasobject or not all(0 <= side <= MOST_ROWS for side in shape):
                raise ValueError(f"its header says {shape}, {dtype}")
            data = member.read()
            if len(data) != dtype.itemsize * int(np.prod(shape, dtype=object)):
                raise ValueError(f"it has {len(data)} bytes, but its header says {shape}, {dtype}")
            return np.frombuffer(data, dtype=dtype).reshape(shape)
        except (ValueError, TypeError, SyntaxError, TokenError) as error:
            raise FormatError(f"its array {name!r} is damaged: {error}", path=path) from error


def _read_about(data: bytes, path: str | os.PathLike[str]) -> tuple[tuple[Stream, ...], tuple[View, ...]]:
    try:
        about = json.loads(data)
        if about["format"] != FORMAT:
            raise ValueError(f"its format is {about['format']!r}")
        if about["version"] != VERSION:
            raise FormatError(
                f"is an index of version {about['version']!r}, and {VERSION} is read; build it again",
                path=path,
            )
        views = tuple(View(float(yaw), float(pitch)) for yaw, pitch in about["views"])
        streams = tuple(
            Stream(
                str(each["name"]), Fraction(each["rate"]), _sent(each["faps"], FAP_COUNT),
                _sent(each["baps"], BAP_COUNT),
            )
            for each in about["streams"]
        )  # fmt: skip
        if not views or not np.isfinite([(view.yaw, view.pitch) for view in views]).all():
            raise ValueError("its views are no angles")
        if not streams or min(stream.rate for stream in streams) <= 0:
            raise ValueError("its streams have no frame rate")
    except FormatError:
        raise
    except (ValueError, TypeError, KeyError, IndexError, ArithmeticError, RecursionError) as error:
        raise FormatError(
            f"is not an index of outlines, or is damaged ({type(error).__name__}: {error}); {REMEDY}",
            path=path,
        ) from error
    return streams, views


def _sent(numbers: Any, count: int) -> tuple[bool, ...]:
    """Return which of `count` parameters are among these numbers, from 1."""
    mask = np.zeros(count, dtype=bool)
    for number in numbers:
        if not isinstance(number, int) or not 1 <= number <= count:
            raise ValueError(f"there is no parameter {number!r}")
        mask[number - 1] = True
    return tuple(mask.tolist())


def _check(arrays: dict[str, Any], streams: int, views: int, path: str | os.PathLike[str]) -> None:
    """Raise FormatError for arrays that contradict each other or the description."""
    poses = len(arrays["pose_streams"]) if arrays["pose_streams"].ndim else 0
    if not poses:
        raise FormatError("is an index of outlines without any", path=path)
    for name, (kind, row, drawn) in LAYOUT.items():
        expected = (poses * views if drawn else poses, *row)
        if arrays[name].shape != expected or arrays[name].dtype != np.dtype(kind):
            raise FormatError(
                f"its array {name!r} has {arrays[name].dtype} {arrays[name].shape}, and {np.dtype(kind)} "
                f"{expected} belong to {poses} poses and {views} views; build it again",
                path=path,
            )
    of_stream = arrays["pose_streams"]
    if of_stream.min() < 0 or of_stream.max() >= streams:
        raise FormatError(f"its poses belong to streams beyond the {streams} that it lists", path=path)
    if not np.isfinite(arrays["descriptions"]).all():
        raise FormatError("its outlines have coordinates that are not finite; build it again", path=path)
