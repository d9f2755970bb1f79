"""How well points are found on other heads: python -m tools.photos.measure_points SHARED [HEAD.glb...]

SHARED: the folder of shared data. Further heads are files of faces; where points were placed by hand, a
file with the head's name and the ending .points.csv beside them says, like placed.csv.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from fba.arrays import Float64
from fba.errors import FbaWarning, ModelError
from fba.face import FaceModel
from fba.face.fitting import FRONT_POINTS, FoundPoints, find_front_points
from tools.photos.other_heads import Picture, other_heads, pictures, with_placed

GROUPS = {
    "pupils": ("3.5", "3.6"),
    "lids": ("3.1", "3.2", "3.3", "3.4"),
    "corners of the eyes": ("3.7", "3.8", "3.11", "3.12"),
    "nose": ("9.1", "9.2", "9.3", "9.15"),
    "lips": ("8.1", "8.2", "2.2", "8.5", "8.6", "8.7", "8.8", "8.9", "8.10"),
    "corners of the mouth": ("8.3", "8.4"),
    "chin": ("2.1", "2.10"),
    "brows": ("4.1", "4.2", "4.3", "4.4", "4.5", "4.6"),
}


def errors(found: FoundPoints, picture: Picture) -> Float64:
    """Return how far each of `FRONT_POINTS` is off, in distances between the pupils; NaN where unknown."""
    at = np.array([found.points.get(name, (np.nan, np.nan)) for name in FRONT_POINTS])
    return np.asarray(np.linalg.norm(at - picture.places, axis=1) / picture.eyes)


def measure(shown: Iterable[Picture]) -> dict[str, Float64]:
    """Return the errors (pictures, P) by head; all NaN where no face was found."""
    result: dict[str, list[Float64]] = {}
    for picture in shown:
        with warnings.catch_warnings(action="ignore", category=FbaWarning):
            try:
                off = errors(find_front_points(picture.photograph), picture)
            except ModelError:
                off = np.full(len(FRONT_POINTS), np.nan)
        result.setdefault(picture.head, []).append(off)
    return {name: np.array(rows) for name, rows in result.items()}


def group_errors(off: Float64) -> dict[str, float]:
    """Return the mean errors of groups of points and of all, in % of the distance between the pupils."""
    result = {}
    for name, members in GROUPS.items():
        values = off[:, [FRONT_POINTS.index(one) for one in members]]
        result[name] = 100 * float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")
    return result | {"all": 100 * float(np.nanmean(off))}


def main(shared: str, *more: str) -> None:
    heads = other_heads(Path(shared))
    for path in map(Path, more):
        heads[path.stem] = with_placed(FaceModel.load(path), path.stem, path.with_suffix(".points.csv"))
    shown = (one for k, (name, head) in enumerate(heads.items()) for one in pictures(name, head, k + 1))
    off = measure(shown)
    print(f"{'':18}" + " ".join(f"{name[-9:]:>9}" for name in [*GROUPS, "all"]) + "   not found")
    for name, rows in [*off.items(), ("all", np.concatenate(list(off.values())))]:
        missed = int(np.isnan(rows).all(axis=1).sum())
        print(f"{name:18}" + " ".join(f"{one:9.1f}" for one in group_errors(rows).values()) + f"{missed:9}")


if __name__ == "__main__":
    main(*sys.argv[1:])
