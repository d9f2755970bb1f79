"""The face: models, units, feature points, visemes and expressions, and how FAPs move them.

shown = fba.face.resolve(animation.face)       # float32 (T, 68): every FAP of every frame
points = fba.face.FeaturePointFace()(shown)    # float32 (T, 84, 3): feature points in metres
vertices = fba.face.Deformer(model)(shown)     # float32 (T, V, 3): all vertices of a face, metres
"""

from fba.face._expressions import EXPRESSION_NAMES, VISEME_NAMES, Definitions
from fba.face._resolve import FaceSettings, Resolver, fit_values, known_faps, resolve, shown_faps
from fba.face._tables import HEAD, FaceDefMesh, FaceDefTables, FaceDefTransform
from fba.face.deform._deformer import Deformer
from fba.face.fapu import Fapu
from fba.face.feature_points import names as feature_point_names
from fba.face.feature_points import neutral_points
from fba.face.interpolation._node import Function, Link, Term
from fba.face.interpolation.table import InterpolationTable
from fba.face.model import FaceModel, Material, Part, compact
from fba.face.points import Eyeballs, FeaturePointFace
from fba.face.shape_names import arkit_names, arkit_of

__all__ = [
    "EXPRESSION_NAMES", "HEAD", "VISEME_NAMES", "Definitions", "Deformer", "Eyeballs", "FaceDefMesh",
    "FaceDefTables", "FaceDefTransform", "FaceModel", "FaceSettings", "Fapu", "FeaturePointFace",
    "Function", "InterpolationTable", "Link", "Material", "Part", "Resolver", "Term", "arkit_names",
    "arkit_of", "compact", "feature_point_names", "fit_values", "known_faps", "neutral_points", "resolve",
    "shown_faps",
]  # fmt: skip
