"""How near a Persona brings a user to the actor: made-up actors of known styles, and Tables 5.1 and 5.2 by
relation.

May use: all of a Persona, and its training.
"""

from fba.persona.evaluation.actors import Style, act, named_styles
from fba.persona.evaluation.evaluation import WAYS, Evaluation, Row, evaluate, mean_reduction

__all__ = ["WAYS", "Evaluation", "Row", "Style", "act", "evaluate", "mean_reduction", "named_styles"]
