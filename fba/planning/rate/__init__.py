"""Bit rates: streams that hold a mean rate within a bounded buffer, live and as files.

May use: all of `fba.planning`, the models of faces and bodies.
"""

from fba.planning.rate.bucket import LeakyBucket
from fba.planning.rate.encoder import RateEncoder, RateStatistics
from fba.planning.rate.errors import DistanceErrors, ParameterErrors, ShownErrors, measure_errors
from fba.planning.rate.search import RatedStream, encode_at_rate

__all__ = [
    "DistanceErrors",
    "LeakyBucket",
    "ParameterErrors",
    "RateEncoder",
    "RateStatistics",
    "RatedStream",
    "ShownErrors",
    "encode_at_rate",
    "measure_errors",
]
