"""Read C3D, the binary format of optical motion capture: markers, their units, gaps and rate.

Reads what Vicon, Qualisys, OptiTrack, BTS, Optotrak and others write: integers and floats of Intel, DEC and
MIPS processors, more markers than one list of labels holds, more frames than the header can count.
"""

from __future__ import annotations

from typing import get_args

import numpy as np

from fba.arrays import Array, Float64, to_float64
from fba.capture import MarkerMotion
from fba.choices import FileUpAxis
from fba.errors import FormatError, warn
from fba.formats.c3d._parameters import BLOCK_BYTES, KEY, Parameters, read_parameters
from fba.formats.markers._rows import METRES, file_rate, unique_names, without_subject
from fba.formats.text.frame_rates import Rate
from fba.limits import DEFAULT_LIMITS, Limits
from fba.sampling import regular_times
from fba.source import Path, naming_file, read_whole, stem_of

COMPUTED = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS", "MODELED_MARKERS")
"""Lists, in group POINT, of labels that are no markers: programs store computed values beside markers."""
LAST_IN_HEADER = 65535
"""The largest frame number that the header holds."""
UNIT_NAMES = {"millimeters": "mm", "millimetres": "mm", "meters": "m", "metres": "m", "centimeters": "cm",
         "inches": "in", "inch": "in", "feet": "ft"}  # fmt: skip
"""Short names of units that files write out."""


def sniff(head: bytes, suffix: str) -> bool:
    """Whether the first bytes of a file look like C3D."""
    return len(head) >= 24 and head[1] == KEY and 1 < head[0] < 128


def read_markers(
    path: Path, *, source_rate: Rate | None = None, limits: Limits = DEFAULT_LIMITS
) -> MarkerMotion:
    """Return the markers of a C3D file, without values computed from them (angles, forces).

    source_rate: the rate of a file that has none.

    Raises FormatError for a file that is damaged or holds no markers; LimitError. Warns (FbaWarning) of
    a file that is cut short.
    """
    data = read_whole(path)
    if not sniff(data[:BLOCK_BYTES], "") or len(data) < BLOCK_BYTES:
        raise FormatError(
            f"a C3D file has {KEY:#x} as its second byte, and a header of {BLOCK_BYTES} bytes", path=path
        )
    parameters = read_parameters(data, path)
    numbers = parameters.numbers
    header = numbers.words(data, 10).view(np.uint16 if numbers.order == "<" else ">u2").astype(np.int64)
    _, points, analogue, first, last, _, _, _, block, _ = (int(word) for word in header)
    scale = float(numbers.floats(data, 1, 12)[0])
    if not points:
        rotations = any(name.startswith("ROTATION:") for name in (*parameters.arrays, *parameters.texts))
        other = "rotations" if rotations else "analogue signals"
        raise FormatError(f"holds no markers{f', only {other}' if rotations or analogue else ''}", path=path)
    if not np.isfinite(scale) or not scale:
        raise FormatError(f"the scale in its header is {scale:g}, but must not be 0", path=path)
    frames = _count_frames(parameters, first, last)
    size = 4 if scale < 0 else 2
    row = (4 * points + analogue) * size
    start = (block - 1) * BLOCK_BYTES
    if block < 2 or start >= len(data):
        raise FormatError(
            f"its header says that data begin in block {block}, but the file has {len(data) // BLOCK_BYTES}",
            path=path,
        )
    there = (len(data) - start) // row
    cut = f"is cut short: it holds {there} of its {frames} frames ({points} markers, {len(data)} bytes)"
    if not there:
        raise FormatError(cut, path=path)
    if there < frames:
        warn(f"{path}: {cut}; these are read", stacklevel=2)
    frames = min(frames, there)
    limits.check_frames(frames, f"{path}: a capture")
    limits.check_bytes(frames * points * 3 * 8 * 2, f"{path}: a capture", source=len(data))
    if points > MarkerMotion.MAX_MARKERS:
        raise FormatError(
            f"has {points} markers, more than the {MarkerMotion.MAX_MARKERS} that are read", path=path
        )
    values = _positions(data, start, frames, points, analogue, scale, parameters)
    labels = unique_names(_labels(parameters, points), points)
    kept = _kept(parameters, labels)
    if not kept:
        raise FormatError(f"holds no markers, only {points} computed values, such as {labels[0]}", path=path)
    unit, factors = _units(parameters, points)
    rate = file_rate(
        float(numbers.floats(data, 1, 20)[0]) or parameters.number("POINT:RATE"), source_rate, path
    )
    values *= factors[:, None]
    names, times = tuple(labels[n] for n in kept), regular_times(frames, rate)
    with naming_file(path):
        return MarkerMotion(
            names, values[:, kept], times, rate, unit=unit, up=_up(parameters), name=stem_of(path)
        )


def _count_frames(parameters: Parameters, first: int, last: int) -> int:
    """Return the number of frames: the header's, or where that does not fit 16 bits, the parameters'."""
    fields = [parameters.unsigned(f"TRIAL:ACTUAL_{end}_FIELD") for end in ("START", "END")]
    if all(len(field) == 2 for field in fields):
        begin, end = (int(field[0] + 65536 * field[1]) for field in fields)
        if end >= begin > 0:
            return end - begin + 1
    count = last - first + 1
    if last < LAST_IN_HEADER and count > 0:
        return count
    for name in ("POINT:LONG_FRAMES", "POINT:FRAMES"):
        stored = parameters.unsigned(name)
        if len(stored) and np.isfinite(stored[0]) and stored[0] > 0:
            return int(stored[0])
    return max(count, 0)


def _positions(
    data: bytes, start: int, frames: int, points: int, analogue: int, scale: float, parameters: Parameters
) -> Float64:
    """Return positions in the file's units: float64 (T, M, 3), NaN where a marker is missing."""
    numbers = parameters.numbers
    columns = 4 * points + analogue
    read = numbers.floats if scale < 0 else numbers.words
    table: Array = read(data, frames * columns, start).reshape(frames, columns)[:, : 4 * points]
    quads = table.reshape(frames, points, 4)
    positions = to_float64(quads[..., :3])
    if scale > 0:
        positions *= scale
    with np.errstate(invalid="ignore"):
        positions[~(quads[..., 3] >= 0)] = np.nan
    return positions


def _labels(parameters: Parameters, points: int) -> list[str]:
    """Return a label for each marker, without the subject that all of them share."""
    labels = [*parameters.numbered_texts("POINT:LABELS")[:points]]
    labels += [""] * (points - len(labels))
    return without_subject(labels)


def _kept(parameters: Parameters, labels: list[str]) -> list[int]:
    """Return the numbers of the labels that are markers."""
    computed = {
        text.rpartition(":")[2] for name in COMPUTED for text in parameters.numbered_texts(f"POINT:{name}")
    }
    return [n for n, label in enumerate(labels) if label.rpartition(":")[2] not in computed]


def _units(parameters: Parameters, points: int) -> tuple[str, Float64]:
    """Return the unit of most markers, and metres per unit of each marker, float64 (M,)."""
    stored = [text.lower() for text in parameters.numbered_texts("POINT:UNITS")] or [""]
    words = [UNIT_NAMES.get(text, text) for text in stored]
    words = words[:points] + [words[-1] if len(words) == 1 else ""] * (points - len(words))
    known = [word for word in words if word in METRES]
    usual = max(set(known), key=known.count) if known else ""
    # nearly all files that do not say it are in millimetres
    return usual, np.array([METRES.get(word, METRES.get(usual, 0.001)) for word in words])


def _up(parameters: Parameters) -> FileUpAxis:
    """Return the axis that points up on the screen, "" if the file does not say."""
    stored = parameters.texts.get("POINT:Y_SCREEN", ("",))
    text = stored[0].lower() if stored else ""
    axes: tuple[FileUpAxis, ...] = get_args(FileUpAxis)
    return next((axis for axis in axes if axis == text), "")
