"""Learning an interpolation table (FIT) from streams of a performer."""

from fba.face.learning.learn import FapError, FitError, LearntFit, Spread, learn_fit
from fba.face.learning.reduction import send_sources

__all__ = ["FapError", "FitError", "LearntFit", "Spread", "learn_fit", "send_sources"]
