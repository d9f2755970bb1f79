"""Datagrams of VTube Studio on a phone: a JSON object for each frame.

`Rotation` is taken as the face's in ARKit's axes (x to its left, y up, z ahead), in degrees, as other
programs do; no recording has confirmed it. The eyes are turned by their shapes.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from fba.arrays import Float64
from fba.errors import FormatError
from fba.formats.face_tables.shape_weights import check_weights, shape_of
from fba.live._protocols.sample import DatagramError, Sample

MIN_SHAPES = 5
"""Smallest number of shapes with ARKit's names in an object with a face."""
NOT_OBJECTS = "not objects of VTube Studio"
MAX_ANGLE = 360.0
MAX_TIME = 1e15


class VTubeReader:
    """Reads objects with `Timestamp`, `FaceFound`, `BlendShapes` and `Rotation`."""

    def __init__(self) -> None:
        self._names: tuple[str, ...] | None = None
        self._newest: Sample | None = None

    def read(self, data: bytes, now: float) -> list[Sample]:
        """Return the sample of a datagram; see `DatagramReader`."""
        try:
            content = json.loads(data)
        except (ValueError, RecursionError) as error:
            raise DatagramError(NOT_OBJECTS) from error
        if not isinstance(content, dict) or not isinstance(content.get("FaceFound"), bool):
            raise DatagramError(NOT_OBJECTS)
        stamp = _number(content.get("Timestamp"))
        if not 0 <= stamp <= MAX_TIME:
            raise DatagramError("without a time")
        weights = _weights(content.get("BlendShapes")) if content["FaceFound"] else {}
        if content["FaceFound"] and self._names is None:
            self._names = tuple(weights)
        names = self._names or ()
        row = np.array([weights.get(name, np.nan) for name in names])
        head = _angles(content.get("Rotation"))
        seen = content["FaceFound"] and not np.isnan(row).any() and head is not None
        self._newest = Sample(stamp / 1000, names, row if seen else None, head)
        return [self._newest]

    def newest(self) -> Sample | None:
        """Return the last sample."""
        return self._newest


def _number(value: Any) -> float:
    """Return a number of a JSON object; NaN for everything else."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e300:
        return float("nan")
    return float(value)


def _weights(entries: Any) -> dict[str, float]:
    """Return weights by ARKit's names, from a list of {"k": name, "v": weight}."""
    weights = {}
    for entry in entries if isinstance(entries, list) else []:
        name = entry.get("k") if isinstance(entry, dict) else None
        shape = shape_of(name) if isinstance(name, str) and len(name) < 100 else None
        if shape is not None:
            weights[shape] = _number(entry.get("v"))
    if len(weights) < MIN_SHAPES:
        raise DatagramError(NOT_OBJECTS)
    try:
        check_weights(np.array([list(weights.values())]), list(weights), "the object")
    except FormatError as error:
        raise DatagramError("with weights outside 0 to 1") from error
    return weights


def _angles(value: Any) -> Float64 | None:
    """Return pitch, yaw and roll (3,), radians, of an object with x, y and z in degrees."""
    numbers = np.array([_number(value.get(axis)) if isinstance(value, dict) else np.nan for axis in "xyz"])
    if not (np.abs(numbers) <= MAX_ANGLE).all():
        return None
    angles: Float64 = np.radians((numbers + 180) % 360 - 180)
    return angles
