"""Bit rates: streams at a mean rate within a bounded buffer, live and as files.

May use: all of `fba.planning`, the models of faces and bodies.
"""

from fba.planning.rate._encoder import LeakyBucket, RateEncoder, RateStatistics
from fba.planning.rate._errors import DistanceErrors, ParameterErrors, ShownErrors, measure_errors
from fba.planning.rate._search import RatedStream, encode_at_rate

__all__ = [
    "DistanceErrors", "LeakyBucket", "ParameterErrors", "RateEncoder", "RateStatistics", "RatedStream",
    "ShownErrors", "encode_at_rate", "measure_errors",
]  # fmt: skip
