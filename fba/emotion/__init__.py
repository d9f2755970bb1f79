"""Emotions as FAPs: named expressions, measured profiles, mixtures by rules, the plane of emotions.

After chapter 8 of the thesis in docs/emotion.md. `expression` returns an expression by name, `combine` mixes
several, `expression_at` returns the expression at an activation and evaluation, and `animate` makes an
`Animation`.
"""

from fba.emotion._expression import FAMILIES, NEUTRAL_POINT, Expression
from fba.emotion._expressions import expression, expressions
from fba.emotion._modification import Damping, emote, modify
from fba.emotion._moods import Mood, MoodCurve
from fba.emotion._performance import animate
from fba.emotion._profiles import Measurement, Movement, measured_faps, measurements, vocabulary
from fba.emotion._reading import Readings, read_expressions
from fba.emotion._rules import Rules
from fba.emotion.blending import Blend, combine, parse_weights
from fba.emotion.plane import expression_at, known_points
from fba.emotion.recogniser import ExpressionRecogniser, Nearest, Reading

__all__ = [
    "FAMILIES", "NEUTRAL_POINT", "Blend", "Damping", "Expression", "ExpressionRecogniser", "Measurement",
    "Mood", "MoodCurve", "Movement", "Nearest", "Reading", "Readings", "Rules", "animate", "combine",
    "emote", "expression", "expression_at", "expressions", "known_points", "measured_faps", "measurements",
    "modify", "parse_weights", "read_expressions", "vocabulary",
]  # fmt: skip
