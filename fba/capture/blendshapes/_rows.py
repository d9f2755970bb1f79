"""What captures of faces have in common: rows at times, turns of head and eyes; checks and a description."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any, Protocol

import numpy as np

from fba.arrays import Bool, Float64
from fba.capture.sampling import find_gaps
from fba.errors import ModelError


class FaceRows(Protocol):
    """A captured face: its fields are those of `ShapeMotion`."""

    @property
    def times(self) -> Float64:
        """Seconds from the first row on, (T,)."""

    @property
    def rate(self) -> Fraction:
        """Frames per second that the source counts in."""

    @property
    def head(self) -> Float64 | None:
        """Turns (T, 3)."""

    @property
    def eyes(self) -> Float64 | None:
        """Turns (T, 4)."""

    @property
    def start(self) -> float | None:
        """Time of day of the first row."""

    @property
    def findings(self) -> tuple[str, ...]:
        """What a reader repaired or found odd."""


def freeze_rows(rows: FaceRows, amounts: Mapping[str, int]) -> None:
    """Make the arrays of a frozen dataclass float64 and read-only, and its rate a fraction.

    amounts: names of the arrays (T, n) with what was recorded, and n of each. Raises ModelError if arrays
    have other shapes or are infinite, times do not increase, or the rate is not positive.
    """
    kind, count = type(rows).__name__, len(rows.times)
    shapes = {"times": (count,), "head": (count, 3), "eyes": (count, 4)}
    for name, shape in {**{name: (count, width) for name, width in amounts.items()}, **shapes}.items():
        value = getattr(rows, name)
        if value is None:
            continue
        array = np.array(value, dtype=np.float64)
        if array.shape != shape:
            raise ModelError(f"{kind}: {name} has shape {array.shape}, not {shape}")
        if np.isinf(array).any():
            raise ModelError(f"{kind}: {name} must be finite, or NaN where no face was seen")
        array.flags.writeable = False
        object.__setattr__(rows, name, array)
    object.__setattr__(rows, "rate", Fraction(rows.rate))
    if rows.rate <= 0:
        raise ModelError(f"{kind}: the rate must be positive, not {rows.rate}")
    if count and not (np.isfinite(rows.times).all() and (np.diff(rows.times) > 0).all()):
        raise ModelError(f"{kind}: times must be finite, and each later than the one before")


def find_seen(rows: FaceRows, amounts: Float64) -> Bool:
    """Return the rows (T,) in which a face was seen: all numbers are there. amounts: (T, n)."""
    numbers = [one for one in (amounts, rows.head, rows.eyes) if one is not None]
    seen: Bool = np.isnan(np.concatenate(numbers, axis=1)).sum(axis=1) == 0
    return seen


def describe_rows(rows: FaceRows, kind: str, names: Sequence[str], amounts: Float64) -> dict[str, Any]:
    """Return what is in a capture, for `fba info`: plain numbers, texts and lists of them.

    kind: "blendshapes" or the like. names: N, of what amounts (T, N) are of.
    """
    seen = find_seen(rows, amounts)
    gaps = find_gaps(rows.times[seen], rows.rate)
    angles = {"head": rows.head, "eyes": rows.eyes}
    still = [
        name for name, column in zip(names, amounts[seen].T, strict=True) if not (column != column[:1]).any()
    ]
    return {
        "kind": kind,
        "rows": len(rows.times),
        "unseen": int((~seen).sum()),
        "seconds": round(float(rows.times[-1] - rows.times[0]), 6) if len(rows.times) else 0.0,
        "rate": str(rows.rate),
        "start": rows.start,
        "shapes": list(names),
        "still": still,
        "angles": {
            what: value is not None and bool(np.nanmax(np.abs(value), initial=0.0) > 0)
            for what, value in angles.items()
        },
        "gaps": [[round(start, 3), round(length, 3)] for start, length in gaps],
        "findings": list(rows.findings),
    }
