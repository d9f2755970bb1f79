"""Fitting a face model to a person's feature points.

model = fba.face.calibration.fit(FaceModel.default(), read_fdp_points("person.fdp"))
"""

from fba.face.calibration._align import UNITS
from fba.face.calibration._fitting import FAPU_DISTANCES, fit, points_of_distances
from fba.face.calibration._reshape import reshape
from fba.face.calibration._shape import rebuild_part

__all__ = ["FAPU_DISTANCES", "UNITS", "fit", "points_of_distances", "rebuild_part", "reshape"]
