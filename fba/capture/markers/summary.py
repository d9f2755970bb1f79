"""Whether there is a face in a capture of markers."""

from __future__ import annotations

import warnings
from typing import Any

from fba.capture.markers.marker_maps import find_map
from fba.capture.markers.motion import MarkerMotion
from fba.errors import FbaWarning, ModelError


def summarise(motion: MarkerMotion) -> dict[str, Any]:
    """Return what a capture holds, as it describes itself, and what of that is on a face.

    map: how the places on the face are found, a set's name or "shape"; "" if there is no face. placed: number
    of markers with a place.
    """
    placed: dict[str, str] = {}
    found_by = ""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FbaWarning)
            if len(motion):
                placed, found_by = find_map(motion)
    except ModelError:
        pass
    return {**motion.describe(), "map": found_by, "placed": len(placed)}
