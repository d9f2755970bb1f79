"""The body as a mannequin: rounded cones along the bones, from `mannequin.csv`.

A stand-in for a skinned body: joint matrices in, capsules out.
"""

from __future__ import annotations

import csv
import re
from functools import cache
from importlib.resources import files

import numpy as np
import numpy.typing as npt

from fba.body import Skeleton
from player.shapes import CAPSULE_FLOATS, srgb

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]

MATERIALS = {
    "skin": (*srgb("#d6a48a"), 0.30),
    "shirt": (*srgb("#3f6276"), 0.05),
    "trousers": (*srgb("#3b3f49"), 0.04),
    "shoe": (*srgb("#2b2523"), 0.12),
}


class Mannequin:
    """Capsules of a body in any pose.

    skeleton: gives names and default centres of the joints; parts of joints that it lacks are left out.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        number = {name: i for i, name in enumerate(skeleton.names)}
        rows = [row for row in _rows() if row["joint"] in number and row["end_joint"] in number]
        centres = np.asarray(skeleton.centres, dtype=np.float64)
        self._joint = np.array([number[row["joint"]] for row in rows], dtype=np.intp)
        self._end_joint = np.array([number[row["end_joint"]] for row in rows], dtype=np.intp)
        start, finish = ([[float(row[f"{axis}{end}"]) for axis in "xyz"] for row in rows] for end in (0, 1))
        self._start = np.array(start) - centres[self._joint]
        self._finish = np.array(finish) - centres[self._end_joint]
        self._fixed = np.zeros((len(rows), CAPSULE_FLOATS), dtype=np.float32)
        self._fixed[:, 3] = [float(row["r0"]) for row in rows]
        self._fixed[:, 7] = [float(row["r1"]) for row in rows]
        self._fixed[:, 11] = [float(row["depth"]) for row in rows]
        self._fixed[:, 12:16] = [MATERIALS[row["material"]] for row in rows]

    def capsules(self, matrices: Float64) -> Float32:
        """(N, 16) capsules, as `View` takes them, for joint matrices (J, 4, 4)."""
        first, last = matrices[self._joint], matrices[self._end_joint]
        result = self._fixed.copy()
        result[:, 0:3] = np.einsum("nij,nj->ni", first[:, :3, :3], self._start) + first[:, :3, 3]
        result[:, 4:7] = np.einsum("nij,nj->ni", last[:, :3, :3], self._finish) + last[:, :3, 3]
        result[:, 8:11] = first[:, :3, 2]
        return result


@cache
def _rows() -> list[dict[str, str]]:
    with (files(__package__) / "mannequin.csv").open(encoding="utf-8") as file:
        left = list(csv.DictReader(file))
    rows = []
    for row in left:
        rows.append(row)
        if row["end_joint"].startswith("l_"):
            other = dict(row, joint=re.sub("^l_", "r_", row["joint"]))
            other["end_joint"] = re.sub("^l_", "r_", row["end_joint"])
            for column in ("x0", "x1"):
                other[column] = str(-float(row[column]))
            rows.append(other)
    return rows
