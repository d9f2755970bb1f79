"""Read records of iFacialMocap and Facemotion3d as text: `jawOpen-12|...|=head#rx,ry,rz,tx,ty,tz|...`.

A record is what the app sends for a frame, in version 1 (name-number) or 2 (name&number). A record ends at
the end of a line, at `___iFacialMocap`, or before a name that it has already. Weights are percent. Angles are
degrees about the face's own axes: x to its left, y up, z ahead.
"""

from __future__ import annotations

import re
from fractions import Fraction

import numpy as np

from fba.arrays import Float64
from fba.capture import ShapeMotion
from fba.errors import FormatError
from fba.formats.face_tables._tables import named
from fba.formats.face_tables.shape_weights import find_lacks, shape_of
from fba.formats.text.frame_rates import Rate
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path, read_whole, stem_of

RATE = 60
"""Records that the app sends per second; they hold no times."""
BREAK = re.compile(r"[\r\n\0]+|___iFacialMocap")
PAIR = re.compile(r"([A-Za-z][A-Za-z0-9_]*?)[-&](-?[0-9]+(?:\.[0-9]*)?(?:[eE][-+]?[0-9]+)?)")
MIN_SHAPES = 5
MAX_NUMBER = 400.0
"""Largest weight, in percent."""
TURNS = {"head": 6, "rightEye": 3, "leftEye": 3}
"""Count of numbers of each part that turns."""
STATUS = "trackingStatus"
RECORD_BYTES = 100
"""Memory of a value while it is read."""

Record = dict[str, list[float]]


def sniff(head: bytes, suffix: str) -> bool:
    """Whether a file begins with a record: several of ARKit's names, with numbers, between bars."""
    words = head[:4000].decode("utf-8", errors="replace").split("|")
    found = [PAIR.fullmatch(word.strip().lstrip("=")) for word in words]
    return sum(pair is not None and shape_of(pair[1]) is not None for pair in found) >= MIN_SHAPES


def read_face(path: Path, *, source_rate: Rate | None = None, limits: Limits = DEFAULT_LIMITS) -> ShapeMotion:
    """Return weights, head and eyes as they are in the records.

    source_rate: records per second; None for the app's 60, with a finding. Raises FormatError, LimitError.
    """
    data = read_whole(path)
    text = data.decode("utf-8-sig", errors="replace")
    limits.check_bytes(RECORD_BYTES * text.count("|"), f"{path}: the records", source=len(data))
    records, strange = read_records(text, path)
    limits.check_frames(len(records), f"{path}: the recording")
    shapes = find_shapes(records, path)
    weights, head, eyes = convert_records(records, shapes)
    rate = Fraction(source_rate or RATE)
    times = np.arange(len(records)) / float(rate)
    findings = [] if source_rate is not None else [f"the records have no times; taken as {RATE} in a second"]
    if strange:
        findings.append(f"names that mean nothing here are left out: {named(sorted(strange))}")
    findings += find_lacks(shapes, weights, times, rate)
    return ShapeMotion(
        tuple(shapes), weights, times, rate, head=head, eyes=eyes, name=stem_of(path),
        findings=tuple(findings),
    )  # fmt: skip


def find_shapes(records: list[Record], path: Path) -> list[str]:
    """Return the names of the shapes in records. Raises FormatError for too few."""
    names = dict.fromkeys(name for record in records for name in record if name not in TURNS)
    shapes = [name for name in names if name != STATUS]
    if len(shapes) < MIN_SHAPES:
        raise FormatError(
            f"{len(shapes)} blendshapes in the records; expected at least {MIN_SHAPES} of ARKit's", path=path
        )
    return shapes


def convert_records(
    records: list[Record], shapes: list[str]
) -> tuple[Float64, Float64 | None, Float64 | None]:
    """Return weights (T, N) of shapes, angles of the head (T, 3) and of the eyes (T, 4), as in `ShapeMotion`.

    Weights of rows without a face, and missing weights, are NaN. Angles are None if no record has them.
    """
    weights = np.array([[record.get(name, [np.nan])[0] for name in shapes] for record in records]) / 100
    lost = np.array([record.get(STATUS, [1.0])[0] == 0 for record in records])
    weights[lost] = np.nan
    return weights, _angles(records, "head", [0, 1, 2]), _eyes(records)


def _eyes(records: list[Record]) -> Float64 | None:
    """Return turns (T, 4) of both eyes: yaw of the left and the right eye, then their pitch."""
    left, right = _angles(records, "leftEye", [1, 0]), _angles(records, "rightEye", [1, 0])
    if left is None or right is None:
        return None
    return np.stack([left[:, 0], right[:, 0], left[:, 1], right[:, 1]], axis=1)


def _angles(records: list[Record], part: str, columns: list[int]) -> Float64 | None:
    """Return angles (T, n) of a part in radians, NaN in records without it; None if no record has it."""
    if not any(part in record for record in records):
        return None
    rows = [record.get(part, [np.nan] * TURNS[part]) for record in records]
    angles: Float64 = np.radians(np.array(rows)[:, columns])
    return angles


def read_records(text: str, path: Path) -> tuple[list[Record], set[str]]:
    """Return all records, and names without a meaning. Raises FormatError for other words."""
    records: list[Record] = []
    strange: set[str] = set()
    line = 1
    start = 0
    for found in [*BREAK.finditer(text), None]:
        end = found.start() if found is not None else len(text)
        record: Record = {}
        for word in text[start:end].split("|"):
            name, numbers = _read_word(word.strip().lstrip("=").strip(), line, path)
            if not name:
                continue
            key = name if name in TURNS or name == STATUS else shape_of(name)
            if key is None:
                strange.add(name)
                continue
            if key in record:
                records.append(record)
                record = {}
            record[key] = numbers
        if record:
            records.append(record)
        if found is not None:
            line += found[0].count("\n")
            start = found.end()
    if not records:
        raise FormatError("holds no record such as jawOpen-12|...|=head#0,0,0,0,0,0|", path=path)
    return records, strange


def _read_word(word: str, line: int, path: Path) -> tuple[str, list[float]]:
    """Return the name and the numbers of a word between bars; "" for an empty word."""
    if not word:
        return "", []
    name, mark, rest = word.partition("#")
    if mark:
        try:
            numbers = [float(number) for number in rest.split(",")]
        except ValueError:
            numbers = []
        if name not in TURNS or len(numbers) != TURNS[name] or not np.isfinite(numbers).all():
            raise FormatError(
                "this is no turn; expected head#rx,ry,rz,tx,ty,tz, leftEye#rx,ry,rz or rightEye#rx,ry,rz",
                path=path, line=line, token=word,
            )  # fmt: skip
        return name, numbers
    pair = PAIR.fullmatch(word)
    if pair is None or pair[1] in TURNS:
        known = re.match(r"([A-Za-z][A-Za-z0-9_]*)[-&]", word)
        if known is not None and shape_of(known[1]) is None and known[1] not in (*TURNS, STATUS):
            return known[1], []  # a word of the app's own, such as a time code
        raise FormatError(
            "this is no weight; expected jawOpen-12 or jawOpen&12", path=path, line=line, token=word
        )
    if not abs(float(pair[2])) <= MAX_NUMBER and shape_of(pair[1]) is not None:
        raise FormatError("the weight is beyond 100 percent by far", path=path, line=line, token=word)
    return pair[1], [float(pair[2])]
