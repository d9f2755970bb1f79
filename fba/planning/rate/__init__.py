"""Bit rates: streams that hold a mean rate within a bounded buffer, live and as files.

May use: all of `fba.planning`, the models of faces and bodies.
"""

from fba.planning.rate.bucket import LeakyBucket
from fba.planning.rate.encoder import RateEncoder, RateStatistics
from fba.planning.rate.errors import ParameterErrors, measure_errors
from fba.planning.rate.search import RatedStream, encode_at_rate

__all__ = [
    "LeakyBucket",
    "ParameterErrors",
    "RateEncoder",
    "RateStatistics",
    "RatedStream",
    "encode_at_rate",
    "measure_errors",
]
