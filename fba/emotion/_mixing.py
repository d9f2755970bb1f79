"""FAPs of several expressions: each family is mixed by the first rule, then the families by the second."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fba.arrays import Float32, Float64
from fba.emotion._expression import NEUTRAL_POINT, Expression, whissel_points
from fba.emotion._rules import Part, Rules, limited, mix_families, mix_within_family, part
from fba.face import Definitions
from fba.parameters import EXPRESSIONS, FAP_COUNT


def mix(weights: Sequence[tuple[Expression, float]], rules: Rules) -> Float32:
    """Return the FAPs of expressions at intensities of 0 to 100, within the limits of the standard: (68,)."""
    families: dict[str, Part] = {}
    for expression, intensity in weights:
        if not intensity:
            continue
        new = part(expression, intensity / 100, activation_of(expression), rules.presence)
        key = expression.family or expression.name
        if key in families:
            new = mix_within_family(families[key], new, _centre(expression), rules)
        families[key] = new
    if not families:
        return np.zeros(FAP_COUNT, dtype=np.float32)
    return limited(mix_families(list(families.values()), rules))


def activation_of(expression: Expression) -> float | None:
    """Return the activation of an expression, or else of its family; None without either."""
    if expression.activation is not None:
        return expression.activation
    return whissel_points()[expression.family][0] if expression.family else None


def point_of(expression: Expression) -> tuple[float, float]:
    """Return activation and evaluation of an expression, or else of its family, or of neutral."""
    if expression.point is not None:
        return expression.point
    return whissel_points()[expression.family] if expression.family else NEUTRAL_POINT


def _centre(expression: Expression) -> Float64:
    select = EXPRESSIONS.index(expression.family)
    centre: Float64 = Definitions.default().expressions[select].astype(np.float64)
    return centre
