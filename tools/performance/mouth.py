"""The mouth in speech: what `fba.speech` makes of the phones that the sample's voice says."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from fba.parameters import fap_numbers
from fba.speech import Phone, find_shapes
from fba.speech._coarticulation import coarticulate
from performance.curves import RATE, Float, read_table, sample_times, smooth

PARTS = {
    "jaw": (1, "open_jaw"),
    "top": (-1, "lower_t_midlip"),
    "bottom": (-1, "raise_b_midlip"),
    "width": (1, "stretch_l_cornerlip"),
    "push": (1, "push_b_lip"),
    "tip": (1, "raise_tongue_tip"),
    "tongue": (1, "raise_tongue"),
}
"""Opening of the jaw, rise of the top lip, fall of the bottom lip, spread of the corners, protrusion of the
lips, rise of the tongue's tip and body: sign and name of the FAPs in whose units they are."""
AHEAD, BEHIND = 0.10, 0.12
"""Seconds by which speech is visible before it begins and after it ends."""


def speech() -> tuple[dict[str, Float], Float]:
    """(curves (T,) by PARTS, share (T,) of the mouth that speech controls, 0..1)."""
    time = sample_times()
    phones = [Phone(row["phone"], float(row["start"]), float(row["end"])) for row in read_table("phones.csv")]
    values = coarticulate(find_shapes(phones), Fraction(RATE), len(time)).values
    held = np.zeros(len(time))
    for phone in phones:
        held[(time >= phone.start - AHEAD) & (time <= phone.end + BEHIND)] = 1.0
    parts = {
        part: sign * values[:, fap_numbers()[name] - 1].astype(float) for part, (sign, name) in PARTS.items()
    }
    return parts, smooth(held, 0.04)
