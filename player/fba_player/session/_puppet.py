"""FAPs, BAPs, visemes and expressions set by hand, in place of what is played."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float32, Float64
from fba.emotion import Blend, Damping, combine, expression, expression_at, modify
from fba.emotion.blending import MAX_INTENSITY
from fba.emotion.plane import SCALE_MAX, SCALE_MIN
from fba.face import Definitions
from fba.face.macros import open_mouth
from fba.parameters import (
    BAP_COUNT,
    EXPRESSION_SELECT_MAX,
    FAP_COUNT,
    FIRST_LOW_LEVEL_FAP,
    INTENSITY_MAX,
    VISEME_SELECT_MAX,
)

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


@dataclass(frozen=True, slots=True)
class Viseme:
    """Two visemes, 0 (none) to 14, and the share of the first, 0 to 63. Raises ValueError for others."""

    select1: int = 0
    select2: int = 0
    blend: int = INTENSITY_MAX

    def __post_init__(self) -> None:
        _check("viseme", (self.select1, self.select2), VISEME_SELECT_MAX)
        _check("viseme_blend", (self.blend,), INTENSITY_MAX)


@dataclass(frozen=True, slots=True)
class Expression:
    """Two expressions, 0 (none) to 6, each with an intensity, 0 to 63. Raises ValueError for others."""

    select1: int = 0
    intensity1: int = INTENSITY_MAX
    select2: int = 0
    intensity2: int = 0

    def __post_init__(self) -> None:
        _check("expression", (self.select1, self.select2), EXPRESSION_SELECT_MAX)
        _check("expression_intensity", (self.intensity1, self.intensity2), INTENSITY_MAX)


class Puppet:
    """Values set by the user over those that are played; a hook for `Session.before_frame`.

    A FAP or BAP that was moved has that value until it is released; all others have the value that is played.
    A viseme replaces all FAPs that visemes move; an opening of the mouth, 0 to 100, and an expression are
    added to what is played, as with init_face of the standard. A mood moves the rest shape, and all of this
    is added to it. FAPs moved by hand replace all.

    mood: see `PuppetMood`. definitions: of visemes and expressions, by default the built-in ones. motion:
    FAPs (68,) and BAPs (296,) of the last picture before they were changed; shown: the same afterwards.
    """

    def __init__(self, definitions: Definitions | None = None) -> None:
        self._definitions = definitions or Definitions.default()
        self._mouth = self._definitions.visemes.any(axis=0)
        self._fap_values = np.zeros(FAP_COUNT, np.float32)
        self._bap_values = np.zeros(BAP_COUNT)
        self.mood = PuppetMood()
        self.mouth_opening = 0
        self.fap_moved = np.zeros(FAP_COUNT, bool)
        self.bap_moved = np.zeros(BAP_COUNT, bool)
        self._viseme, self._expression = Viseme(), Expression()
        self._spoken = np.zeros(FAP_COUNT, np.float32)
        self._felt = np.zeros(FAP_COUNT, np.float32)
        self.motion: tuple[Float32, Float64] = (np.zeros(FAP_COUNT, np.float32), np.zeros(BAP_COUNT))
        self.shown: tuple[Float32, Float64] = (np.zeros(FAP_COUNT, np.float32), np.zeros(BAP_COUNT))

    def __call__(self, faps: Float32, baps: Float64) -> None:
        """Change FAPs (68,) and BAPs (296,) in place."""
        self.motion = (faps.copy(), baps.copy())
        if self.speaks:
            np.copyto(faps, self._spoken, where=self._mouth)
        if self.feels:
            faps += self._felt
        if self.mouth_opening:
            faps += open_mouth(self.mouth_opening)
        self.mood.apply(faps)
        np.copyto(faps, self._fap_values, where=self.fap_moved)
        np.copyto(baps, self._bap_values, where=self.bap_moved)
        self.shown = (faps.copy(), baps.copy())

    @property
    def idle(self) -> bool:
        """Whether it changes nothing."""
        moved = self.fap_moved.any() or self.bap_moved.any()
        return not (self.speaks or self.feels or self.mouth_opening or self.mood.active or moved)

    @property
    def speaks(self) -> bool:
        """Whether a viseme is set."""
        return bool(self._viseme.select1 or self._viseme.select2)

    @property
    def feels(self) -> bool:
        """Whether an expression is set."""
        return bool(self._expression.select1 or self._expression.select2)

    @property
    def viseme(self) -> Viseme:
        """The visemes that are set; `Viseme()` for none."""
        return self._viseme

    @viseme.setter
    def viseme(self, viseme: Viseme) -> None:
        self._viseme = viseme
        table, share = self._definitions.visemes, np.float32(viseme.blend / INTENSITY_MAX)
        self._spoken = table[viseme.select1] * share + table[viseme.select2] * (1 - share)

    @property
    def expression(self) -> Expression:
        """The expressions that are set; `Expression()` for none."""
        return self._expression

    @expression.setter
    def expression(self, expression: Expression) -> None:
        self._expression = expression
        first, second = expression.intensity1 / INTENSITY_MAX, expression.intensity2 / INTENSITY_MAX
        if expression.select1 == expression.select2:
            second = min(second, 1 - first)  # the same expression twice has at most full intensity
        table = self._definitions.expressions
        self._felt = table[expression.select1] * np.float32(first)
        self._felt += table[expression.select2] * np.float32(second)

    def move_fap(self, number: int, value: float) -> None:
        """Set a FAP, 3 to 68, in its unit. ValueError for another number or a value that is not finite."""
        if not FIRST_LOW_LEVEL_FAP <= number <= FAP_COUNT or not np.isfinite(value):
            raise ValueError(
                f"FAP {number} cannot be set to {value}: expected a FAP from {FIRST_LOW_LEVEL_FAP} to "
                f"{FAP_COUNT} and a finite value"
            )
        self._fap_values[number - 1], self.fap_moved[number - 1] = value, True

    def move_bap(self, number: int, value: float) -> None:
        """Set a BAP, 1 to 296, in 1e-5 rad or mm. ValueError as for `move_fap`."""
        if not 1 <= number <= BAP_COUNT or not np.isfinite(value):
            raise ValueError(
                f"BAP {number} cannot be set to {value}: expected a BAP from 1 to {BAP_COUNT} and a "
                "finite value"
            )
        self._bap_values[number - 1], self.bap_moved[number - 1] = value, True

    def release(self, faps: tuple[int, ...] = (), baps: tuple[int, ...] = ()) -> None:
        """Let FAPs and BAPs, by number, follow what is played again."""
        for moved, numbers in ((self.fap_moved, faps), (self.bap_moved, baps)):
            for number in numbers:
                moved[number - 1] = False

    def release_all(self) -> None:
        """Release everything, including visemes, expressions, the opening of the mouth and the mood."""
        self.mouth_opening = 0
        self.mood.release()
        self.fap_moved[:] = False
        self.bap_moved[:] = False
        self.viseme, self.expression = Viseme(), Expression()


def _check(what: str, values: tuple[int, ...], most: int) -> None:
    for value in values:
        if not 0 <= value <= most:
            raise ValueError(f"{what} must be a whole number from 0 to {most}, not {value}")
