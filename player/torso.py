"""The trunk of the mannequin: one smooth skin over rings along the spine, from `torso.csv`."""

from __future__ import annotations

import csv
from importlib.resources import files

import numpy as np
import numpy.typing as npt

from fba.body import Skeleton
from player.mannequin import MATERIALS
from player.primitives import tube_mesh
from player.shapes import Mesh, MeshShape, Normals

Float64 = npt.NDArray[np.float64]

AROUND = 40
FINER = 2
"""Rings drawn for each ring of the table, so that a bent spine bends the skin smoothly."""
SQUARENESS = 2.25
"""Exponent of the rings' outline; 2 is an ellipse."""


class Torso:
    """Trunk and neck of a body in any pose. skeleton: gives names and default centres of the joints."""

    def __init__(self, skeleton: Skeleton) -> None:
        with (files(__package__) / "torso.csv").open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        number = {name: i for i, name in enumerate(skeleton.names)}
        centres = np.asarray(skeleton.centres, dtype=np.float64)
        table = np.array([[float(row[name]) for name in ("y", "z", "width", "depth")] for row in rows])
        joints = np.array([number.get(row["joint"], 0) for row in rows])
        at = np.linspace(0, len(rows) - 1, (len(rows) - 1) * FINER + 1)
        low = np.minimum(at.astype(int), len(rows) - 2)
        self._share = at - low
        self._low, self._high = joints[low], joints[low + 1]
        places = _rings(table, at)
        self._from_low = places - centres[self._low][:, None]
        self._from_high = places - centres[self._high][:, None]
        colours = np.array([MATERIALS[row["material"]] for row in rows])[np.floor(at + 1e-9).astype(int)]
        triangles = tube_mesh(len(at), AROUND)[:, ::-1].copy()
        self._shape = MeshShape(
            triangles, np.repeat(colours, AROUND, axis=0).astype(np.float32), two_sided=True
        )
        self._normals = Normals(triangles, len(at) * AROUND)

    def mesh(self, matrices: Float64) -> Mesh:
        """The trunk for joint matrices (J, 4, 4)."""
        low = _moved(matrices[self._low], self._from_low)
        high = _moved(matrices[self._high], self._from_high)
        share = self._share[:, None, None]
        positions = (low * (1 - share) + high * share).reshape(-1, 3).astype(np.float32)
        return Mesh(self._shape, positions, self._normals(positions), np.eye(4))


def _rings(table: Float64, at: Float64) -> Float64:
    """(N, AROUND, 3) places in the default posture."""
    from scipy.interpolate import PchipInterpolator

    y, z, width, depth = PchipInterpolator(np.arange(len(table)), table)(at).T
    turn = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
    outline = [np.sign(f) * np.abs(f) ** (2 / SQUARENESS) for f in (np.sin(turn), np.cos(turn))]
    places = np.empty((len(at), AROUND, 3))
    places[..., 0] = width[:, None] * outline[0]
    places[..., 1] = y[:, None]
    places[..., 2] = z[:, None] + depth[:, None] * outline[1]
    return places


def _moved(matrices: Float64, places: Float64) -> Float64:
    turned: Float64 = np.einsum("nij,nkj->nki", matrices[:, :3, :3], places) + matrices[:, None, :3, 3]
    return turned
