"""Learning an interpolation table (FIT) from streams of a performer.

May use: models, their deformation, and the rules by which a face fills in what was not sent.
"""

from fba.face.learning._errors import FapError, FitError, Spread
from fba.face.learning.learn import LearntFit, learn_fit
from fba.face.learning.reduction import send_sources

__all__ = ["FapError", "FitError", "LearntFit", "Spread", "learn_fit", "send_sources"]
