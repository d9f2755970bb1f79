"""What a capture of markers holds, in numbers."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from fba.capture.markers.gaps import find_gaps
from fba.capture.markers.marker_maps import find_map
from fba.capture.markers.motion import MarkerMotion
from fba.errors import FbaWarning, ModelError


@dataclass(frozen=True)
class MarkerSummary:
    """What a capture holds.

    markers: names. frames, rate, seconds. unit, up: as the file says, "" if it does not. gaps: how many;
    missing: share of all positions; longest: seconds of the longest gap, and its marker. map: how the places
    on the face are found, a set's name or "shape"; "" if there is no face. placed: markers with a place.
    """

    markers: tuple[str, ...]
    frames: int
    rate: str
    seconds: float
    unit: str
    up: str
    gaps: int
    missing: float
    longest: float
    longest_marker: str
    map: str
    placed: int


def summarise(motion: MarkerMotion) -> MarkerSummary:
    """Return what a capture holds."""
    seen = motion.seen
    count, longest, whose = 0, 0.0, ""
    for marker in np.flatnonzero(~seen.all(axis=0)):
        for start, end in find_gaps(seen[:, marker]):
            count += 1
            length = float((end - start) / motion.rate)
            if length > longest:
                longest, whose = length, motion.names[marker]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FbaWarning)
            placed, found_by = find_map(motion) if len(motion) else ({}, "")
    except ModelError:
        placed, found_by = {}, ""
    return MarkerSummary(
        motion.names, len(motion), str(motion.rate), motion.duration, motion.unit, motion.up, count,
        float(1 - seen.mean()) if seen.size else 0.0, longest, whose, found_by, len(placed),
    )  # fmt: skip
