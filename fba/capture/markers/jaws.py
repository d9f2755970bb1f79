"""The actor's jaw: the arcs of the chin's points, from where chin and ears are.

A jaw turns about its joint, in front of the ears, which slides forward as it does. How far the chin goes back
for each millimetre that it sinks differs by a third between faces, and follows from where chin and ears are.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.capture.markers.responses import JAW_VALUES
from fba.face import Fapu
from fba.face.authoring.regions.jaw import CHIN, EARS, Jaw, opening_angles, opening_shifts
from fba.face.feature_points import row_of


def jaw_curves(points: Float64, fapu: Fapu) -> dict[int, Float64]:
    """Return shifts (J, 3) in MNS at `JAW_VALUES` of each feature point on the chin, by its row.

    points: float64 (84, 3), the actor's neutral feature points, metres, along the standard's axes.
    """
    rows = [row_of()[name] for name in CHIN]
    hinge = points[[row_of()[name] for name in EARS]].mean(axis=0)[1:]
    none = np.zeros(0)
    jaw = Jaw(none, none, hinge, points[row_of()["2.1"]], fapu.ES * 1024)
    values, angles = opening_angles(jaw, fapu.MNS)
    shifts = opening_shifts(points[rows], jaw, np.interp(JAW_VALUES, values, angles)) / fapu.MNS
    return {row: shifts[:, n] for n, row in enumerate(rows)}
