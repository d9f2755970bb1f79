"""Emotions as FAPs: named expressions, measured profiles, mixtures by rules, the plane of emotions.

After chapter 8 of the thesis in docs/emotion.md. `expression` gives one by name, `combine` mixes them,
`expression_at` finds one for an activation and an evaluation, `animate` makes an `Animation` of them.
"""

from fba.emotion.blending import Blend, combine, parse_weights
from fba.emotion.expression import FAMILIES, NEUTRAL_POINT, Expression
from fba.emotion.expressions import expression, expressions
from fba.emotion.modification import Damping, emote, modify
from fba.emotion.moods import Mood, MoodCurve
from fba.emotion.performance import animate
from fba.emotion.plane import expression_at, known_points
from fba.emotion.profiles import Measurement, Movement, measured_faps, measurements, vocabulary
from fba.emotion.reading import Readings, read_expressions
from fba.emotion.recogniser import ExpressionRecogniser, Nearest, Reading
from fba.emotion.rules import Rules

__all__ = [
    "FAMILIES",
    "NEUTRAL_POINT",
    "Blend",
    "Damping",
    "Expression",
    "ExpressionRecogniser",
    "Measurement",
    "Mood",
    "MoodCurve",
    "Movement",
    "Nearest",
    "Reading",
    "Readings",
    "Rules",
    "animate",
    "combine",
    "emote",
    "expression",
    "expression_at",
    "expressions",
    "known_points",
    "measured_faps",
    "measurements",
    "modify",
    "parse_weights",
    "read_expressions",
    "vocabulary",
]
