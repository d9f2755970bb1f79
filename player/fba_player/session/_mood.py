"""The mood that the user gives a face: named expressions with intensities, and a point of the plane."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float32, Float64
from fba.emotion import Blend, Damping, combine, expression, expression_at, modify
from fba.emotion.blending import MAX_INTENSITY
from fba.emotion.plane import SCALE_MAX, SCALE_MIN

COMMON = ("anger", "surprise", "sadness", "sleepiness", "joy", "fear", "disgust")
"""The expressions that have a slider from the beginning."""


class PuppetMood:
    """Expressions that move the rest shape of a face, as `fba.emotion.emote` does.

    What is played is added to it, less where a feature is near its limit. Where both the point and an
    intensity name an expression, the larger counts.
    """

    def __init__(self) -> None:
        self._weights: dict[str, float] = {}
        self._point: tuple[float, float] | None = None
        self._blend = combine({})
        self._damping = Damping()

    @property
    def weights(self) -> dict[str, float]:
        """Intensities that were set, 0 to 100 by name, those of `COMMON` first."""
        return {name: self._weights.get(name, 0.0) for name in (*COMMON, *self._weights)}

    @property
    def point(self) -> tuple[float, float] | None:
        """Activation and evaluation, 1 to 7 each, None if no point was set."""
        return self._point

    @property
    def blend(self) -> Blend:
        """All of it mixed."""
        return self._blend

    @property
    def active(self) -> bool:
        """Whether the face has any mood."""
        return bool(self._blend.parts)

    def set_weight(self, name: str, intensity: float) -> None:
        """Set the intensity of an expression; limited to 0 to 100. OptionError for an unknown name."""
        self._weights[expression(name).name] = float(np.clip(intensity, 0.0, MAX_INTENSITY))
        self._mix()

    def move_point(self, activation: float, evaluation: float) -> None:
        """Set the point of the plane; limited to 1 to 7 each."""
        self._point = (
            float(np.clip(activation, SCALE_MIN, SCALE_MAX)),
            float(np.clip(evaluation, SCALE_MIN, SCALE_MAX)),
        )
        self._mix()

    def release(self) -> None:
        """Remove all expressions and the point; sliders that were added stay, at 0."""
        self._weights = dict.fromkeys(self._weights, 0.0)
        self._point = None
        self._mix()

    def apply(self, faps: Float32) -> None:
        """Change FAPs (68,) in place."""
        if not self.active:
            return
        shown = faps[None].astype(np.float64)
        offsets: Float64 = self._blend.faps[None].astype(np.float64)
        faps[:] = modify(shown, offsets, self._damping)[0]

    def _mix(self) -> None:
        weights = {name: intensity for name, intensity in self._weights.items() if intensity > 0}
        if self._point is not None:
            for part, intensity in expression_at(*self._point).parts:
                weights[part.name] = max(weights.get(part.name, 0.0), intensity)
        self._blend = combine(weights)
