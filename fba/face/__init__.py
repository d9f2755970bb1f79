"""The face: units, feature points, visemes and expressions, and what a face shows for given FAPs.

shown = fba.face.resolve(animation.face)       # float32 (T, 68): every FAP of every frame
points = fba.face.FeaturePointFace()(shown)    # float32 (T, 84, 3): feature points in metres
"""

from fba.face.expressions import EXPRESSION_NAMES, VISEME_NAMES, Definitions
from fba.face.fapu import Fapu
from fba.face.feature_points import names as feature_point_names
from fba.face.feature_points import neutral_points
from fba.face.points import Eyeballs, FeaturePointFace
from fba.face.resolve import Resolver, resolve

__all__ = [
    "EXPRESSION_NAMES",
    "VISEME_NAMES",
    "Definitions",
    "Eyeballs",
    "Fapu",
    "FeaturePointFace",
    "Resolver",
    "feature_point_names",
    "neutral_points",
    "resolve",
]
