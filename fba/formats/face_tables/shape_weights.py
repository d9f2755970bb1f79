"""What readers of blendshapes share: names and weights of shapes, missing rows, labels of left and right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import get_args

import numpy as np

from fba.arrays import Bool, Float64
from fba.capture import ShapeMotion
from fba.choices import Swap
from fba.errors import FormatError, OptionError
from fba.face import arkit_names, arkit_of
from fba.formats.face_tables._tables import named
from fba.name_maps import key_of
from fba.sampling import find_gaps
from fba.source import Path

MAX_WEIGHT = 4.0
"""Largest weight; more is no share of a shape."""
SWAPS: tuple[Swap, ...] = get_args(Swap)
SWAPPED = (("mouthLeft", "mouthRight"), ("jawLeft", "jawRight"))
"""Labels that Live Link Face's tables exchange."""
MIN_CORRELATION = 0.3
"""Correlation of sideways mouths with smiles above which it decides."""
NAMED_GAPS = 3
"""Most gaps that a message names."""
MIN_DEVIATION = 0.01
"""Standard deviation above which a difference of weights is evidence."""


@cache
def shape_of(name: str) -> str | None:
    """Return ARKit's name of a shape, from a name in any case; None if it is not one of the 52."""
    return _shapes().get(key_of(name)) or arkit_of(name)


@cache
def _shapes() -> dict[str, str]:
    return {key_of(name): name for name in arkit_names()}


def check_weights(
    weights: Float64, names: Sequence[str], path: Path, lines: Sequence[int] | None = None
) -> None:
    """Raise FormatError for weights (T, N) that are no shares of 1. lines: of rows (T,), if there are any."""
    far = np.abs(weights) > MAX_WEIGHT
    if not far.any():
        return
    row, column = np.argwhere(far)[0]
    value = float(weights[row, column])
    hint = "; are these percent?" if np.nanmax(np.abs(weights)) <= 100 else ""
    place = f"frame {row}: " if lines is None else ""
    raise FormatError(
        f"{place}{names[column]} has the weight {value:g}; expected 0 to 1{hint}",
        path=path,
        line=None if lines is None else lines[row],
    )


def find_lacks(names: Sequence[str], weights: Float64, times: Float64, rate: Fraction) -> list[str]:
    """Return what a capture lacks, a sentence for each: shapes, rows with a face, frames.

    weights: (T, N). times: (T,), seconds from the first row.
    """
    seen: Bool = np.isnan(weights).sum(axis=1) == 0
    findings = []
    lacking = [name for name in sorted(arkit_names()) if name not in names]
    if lacking and lacking != ["tongueOut"]:  # MediaPipe has none
        findings.append(f"lacks {len(lacking)} of ARKit's 52 shapes: {named(lacking)}")
    if not seen.all():
        findings.append(f"{int((~seen).sum())} of {len(seen)} rows have no face; they are bridged")
    gaps = find_gaps(times[seen], rate)
    if gaps:
        texts = ", ".join(f"{length:.2f} s after {start:.2f} s" for start, length in gaps[:NAMED_GAPS])
        more = f" and {len(gaps) - NAMED_GAPS} more" if len(gaps) > NAMED_GAPS else ""
        findings.append(f"frames are missing: {texts}{more}")
    return findings


def find_swap(motion: ShapeMotion, swap: Swap, *, expected: bool) -> ShapeMotion:
    """Return a capture with the labels of `SWAPPED` put right; its findings say what was done.

    swap: "yes" exchanges them, "no" does not, "auto" does where mouths go to the side that does not smile.
    Without a lop-sided smile, `expected` decides: whether the program usually writes them exchanged.
    """
    if swap not in SWAPS:
        raise OptionError(f"swap must be one of {', '.join(SWAPS)}, not {swap!r}")
    present = [pair for pair in SWAPPED if set(pair) <= set(motion.names)]
    if swap == "no" or not present:
        return motion
    why = "as you asked"
    if swap == "auto":
        correlation = _smiles_beside(motion)
        wrong = expected if correlation is None else correlation < 0
        if not wrong:
            return motion
        why = (
            "Live Link Face's tables have them so, and no lop-sided smile contradicts"
            if correlation is None
            else f"mouths go to the side on which nobody smiles (correlation {correlation:.2f})"
        )
    order = list(motion.names)
    for first, second in present:
        one, two = order.index(first), order.index(second)
        order[one], order[two] = order[two], order[one]
    pairs = " and ".join("/".join(pair) for pair in present)
    finding = f"{pairs} are taken the other way round: {why}"
    return replace(motion, names=tuple(order), findings=(*motion.findings, finding))


def _smiles_beside(motion: ShapeMotion) -> float | None:
    """Return how mouths that go left correlate with smiles on the left; None if that is unclear."""
    wanted = ("mouthLeft", "mouthRight", "mouthSmileLeft", "mouthSmileRight")
    if not set(wanted) <= set(motion.names):
        return None
    left, right, smile_left, smile_right = (
        motion.weights[motion.seen][:, motion.names.index(name)] for name in wanted
    )
    aside, smiles = left - right, smile_left - smile_right
    if len(aside) < 2 or min(aside.std(), smiles.std()) < MIN_DEVIATION:
        return None
    correlation = float(np.corrcoef(aside, smiles)[0, 1])
    return correlation if abs(correlation) >= MIN_CORRELATION else None
