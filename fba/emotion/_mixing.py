"""FAPs of several expressions at once: of one family by the first rule, then families by the second."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fba.arrays import Float32, Float64
from fba.emotion._rules import Part, Rules, limited, mix_families, mix_within_family, part
from fba.emotion._whissel import family_point
from fba.emotion.expression import NEUTRAL_POINT, Expression
from fba.face import Definitions
from fba.parameters import EXPRESSIONS, FAP_COUNT


def mix(weights: Sequence[tuple[Expression, float]], rules: Rules) -> Float32:
    """Return the FAPs of expressions at intensities of 0 to 100: float32 (68,), within the standard's limits.

    Those of a family first, two at a time, then the families.
    """
    families: dict[str, Part] = {}
    for expression, intensity in weights:
        if not intensity:
            continue
        one = part(expression, intensity / 100, activation_of(expression), rules.presence)
        key = expression.family or expression.name
        families[key] = (
            one if key not in families else mix_within_family(families[key], one, _centre(expression), rules)
        )
    if not families:
        return np.zeros(FAP_COUNT, dtype=np.float32)
    return limited(mix_families(list(families.values()), rules))


def activation_of(expression: Expression) -> float | None:
    """Return the activation of an expression, else that of its family; None if it has neither."""
    if expression.activation is not None:
        return expression.activation
    return family_point(expression.family)[0] if expression.family else None


def point_of(expression: Expression) -> tuple[float, float]:
    """Return activation and evaluation of an expression, else of its family, else of neutral."""
    if expression.point is not None:
        return expression.point
    return family_point(expression.family) if expression.family else NEUTRAL_POINT


def _centre(expression: Expression) -> Float64:
    select = EXPRESSIONS.index(expression.family)
    centre: Float64 = Definitions.default().expressions[select].astype(np.float64)
    return centre
