"""`ShapeMotion` and `ActionUnitMotion`: a captured face in rows at times, from a tracker of any kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from fba.arrays import Bool, Float64
from fba.errors import ModelError
from fba.sampling import find_gaps
from fba.tracks import freeze

MAX_ANGLE = 1000.0
"""Largest angle of heads and eyes, in radians: many turns, as trackers count on."""


@dataclass(frozen=True, eq=False)
class ShapeMotion:
    """A captured face: weights of shapes, and how head and eyes turn, at the source's own times.

    names: N names of shapes; ARKit's where a shape is one of its 52. weights: float64 (T, N), 0 to 1; NaN in
    rows without a face. times: float64 (T,), seconds from the first row on, increasing. rate: frames per
    second that the source counts in. Left and right are the performer's.

    head: float64 (T, 3), radians, as FAPs 48 to 50 count them: pitch (down), yaw (left), roll (right); None
    where the source has none. eyes: float64 (T, 4), radians, as FAPs 23 to 26: yaw of the left and the right
    eye (left), then their pitch (down); None likewise. start: time of day of the first row, in seconds; None
    where unknown. findings: what a reader repaired or found odd, a sentence each.

    Raises ModelError if the parts contradict each other.
    """

    names: tuple[str, ...]
    weights: Float64
    times: Float64
    rate: Fraction
    head: Float64 | None = None
    eyes: Float64 | None = None
    start: float | None = None
    name: str = ""
    findings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _freeze(self, "weights", len(self.names))
        if len(set(self.names)) != len(self.names):
            raise ModelError("ShapeMotion: a name occurs twice")

    def __len__(self) -> int:
        return len(self.times)

    @property
    def seen(self) -> Bool:
        """Rows (T,) in which a face was seen: all numbers are there."""
        return _find_seen(self, self.weights)

    def describe(self) -> dict[str, Any]:
        """Return what is in the capture, for `fba info`: plain numbers, texts and lists of them."""
        return _describe(self, "blendshapes", self.names, self.weights)


@dataclass(frozen=True, eq=False)
class ActionUnitMotion:
    """A captured face: intensities of action units (FACS), turns of head and eyes, at the source's times.

    units: N numbers of action units. intensities: float64 (T, N), 0 to 1, the strongest; NaN in rows without
    a face. times, rate, head, eyes, name, findings: as in `fba.capture.ShapeMotion`. Immutable.

    Raises ModelError if the parts contradict each other.
    """

    units: tuple[int, ...]
    intensities: Float64
    times: Float64
    rate: Fraction
    head: Float64 | None = None
    eyes: Float64 | None = None
    name: str = ""
    findings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _freeze(self, "intensities", len(self.units))
        if len(set(self.units)) != len(self.units):
            raise ModelError("ActionUnitMotion: a unit occurs twice")

    def __len__(self) -> int:
        return len(self.times)

    @property
    def start(self) -> None:
        """No tracker of action units says at what time of day a film was made."""
        return None

    def describe(self) -> dict[str, Any]:
        """Return what is in the capture, for `fba info`: plain numbers, texts and lists of them."""
        return _describe(self, "action units", [f"AU{unit:02}" for unit in self.units], self.intensities)


def _freeze(motion: ShapeMotion | ActionUnitMotion, amounts: str, count: int) -> None:
    """Make the arrays float64 and read-only, and the rate a fraction.

    amounts: name of the array (T, count) of what was recorded. Raises ModelError if arrays have other shapes
    or are infinite, angles are beyond `MAX_ANGLE`, times do not increase, or the rate is not positive.
    """
    kind, rows = type(motion).__name__, len(motion.times)
    shapes = {amounts: (rows, count), "times": (rows,), "head": (rows, 3), "eyes": (rows, 4)}
    for name, shape in shapes.items():
        value = getattr(motion, name)
        if value is None:
            continue
        array = np.array(value, dtype=np.float64)
        if array.shape != shape:
            raise ModelError(f"{kind}: {name} has shape {array.shape}, not {shape}")
        if np.isinf(array).any():
            raise ModelError(f"{kind}: {name} must be finite, or NaN where no face was seen")
        if name in ("head", "eyes") and (far := np.abs(array) > MAX_ANGLE).any():
            raise ModelError(f"{kind}: {name} has an angle of {array[far][0]:g} rad; {MAX_ANGLE:g} at most")
        freeze(motion, **{name: array})
    freeze(motion, rate=Fraction(motion.rate))
    if motion.rate <= 0:
        raise ModelError(f"{kind}: the rate must be positive, not {motion.rate}")
    if rows and not (np.isfinite(motion.times).all() and (np.diff(motion.times) > 0).all()):
        raise ModelError(f"{kind}: times must be finite, and each later than the one before")


def _find_seen(motion: ShapeMotion | ActionUnitMotion, amounts: Float64) -> Bool:
    """Return the rows (T,) in which a face was seen: no number is missing. amounts: (T, n)."""
    numbers = [array for array in (amounts, motion.head, motion.eyes) if array is not None]
    seen: Bool = np.isnan(np.concatenate(numbers, axis=1)).sum(axis=1) == 0
    return seen


def _describe(
    motion: ShapeMotion | ActionUnitMotion, kind: str, names: Sequence[str], amounts: Float64
) -> dict[str, Any]:
    """Return what `describe` does. names: N, of what amounts (T, N) are of."""
    seen = _find_seen(motion, amounts)
    gaps = find_gaps(motion.times[seen], motion.rate)
    still = [
        name for name, column in zip(names, amounts[seen].T, strict=True) if not (column != column[:1]).any()
    ]
    return {
        "kind": kind,
        "rows": len(motion),
        "unseen": int((~seen).sum()),
        "seconds": round(float(motion.times[-1] - motion.times[0]), 6) if len(motion) else 0.0,
        "rate": str(motion.rate),
        "start": motion.start,
        "shapes": list(names),
        "still": still,
        "angles": {
            what: angles is not None and bool(np.nanmax(np.abs(angles), initial=0.0) > 0)
            for what, angles in (("head", motion.head), ("eyes", motion.eyes))
        },
        "gaps": [[round(start, 3), round(length, 3)] for start, length in gaps],
        "findings": list(motion.findings),
    }
