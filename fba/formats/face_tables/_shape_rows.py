"""What readers of blendshapes share: names of shapes, and labels of left and right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import get_args

import numpy as np

from fba.arrays import Bool, Float64
from fba.capture import ShapeMotion
from fba.capture.sampling import find_gaps
from fba.choices import Swap
from fba.errors import OptionError
from fba.face.shape_names import arkit_names
from fba.formats.face_tables._tables import named
from fba.formats.face_tables.shape_weights import check_weights, shape_of

__all__ = ["check_weights", "find_lacks", "find_swap", "shape_of"]

SWAPS: tuple[Swap, ...] = get_args(Swap)
SWAPPED = (("mouthLeft", "mouthRight"), ("jawLeft", "jawRight"))
"""Labels that Live Link Face's tables have the wrong way round."""
TELLING = 0.3
"""Correlation of sideways mouths with smiles above which it decides."""
MOST_GAPS = 3
"""Gaps that a warning names."""
MOVES = 0.01
"""Standard deviation above which a difference of weights is evidence."""


def find_lacks(names: Sequence[str], weights: Float64, times: Float64, rate: Fraction) -> list[str]:
    """Return what a capture lacks, a sentence each: shapes, rows with a face, frames.

    weights: (T, N), times: (T,), seconds from the first row.
    """
    seen: Bool = np.isnan(weights).sum(axis=1) == 0
    findings = []
    lacking = [name for name in arkit_names() if name not in names]
    if lacking and lacking != ["tongueOut"]:  # MediaPipe has none
        findings.append(f"lacks {len(lacking)} of ARKit's 52 shapes: {named(lacking)}")
    if not seen.all():
        findings.append(f"{int((~seen).sum())} of {len(seen)} rows have no face; they are bridged")
    gaps = find_gaps(times[seen], rate)
    if gaps:
        texts = ", ".join(f"{length:.2f} s after {start:.2f} s" for start, length in gaps[:MOST_GAPS])
        more = f" and {len(gaps) - MOST_GAPS} more" if len(gaps) > MOST_GAPS else ""
        findings.append(f"frames are missing: {texts}{more}")
    return findings


def find_swap(motion: ShapeMotion, swap: Swap, *, expected: bool) -> ShapeMotion:
    """Return a capture with the labels of `SWAPPED` the right way round; its findings say what was done.

    swap: "yes", "no", or "auto": they are changed where mouths go to the side on which nobody smiles. Where
    no lop-sided smile tells, `expected` does: whether the program is known to write them the wrong way round.
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
    """Return how mouths that go left correlate with smiles more on the left; None if that is unclear."""
    wanted = ("mouthLeft", "mouthRight", "mouthSmileLeft", "mouthSmileRight")
    if not set(wanted) <= set(motion.names):
        return None
    left, right, smile_left, smile_right = (
        motion.weights[motion.seen][:, motion.names.index(name)] for name in wanted
    )
    aside, smiles = left - right, smile_left - smile_right
    if len(aside) < 2 or min(aside.std(), smiles.std()) < MOVES:
        return None
    correlation = float(np.corrcoef(aside, smiles)[0, 1])
    return correlation if abs(correlation) >= TELLING else None
