"""FAPs that move together where people want one thing, not the standard's many."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np

from fba.arrays import Float32
from fba.parameters import FAP_COUNT, fap_numbers

__all__ = ["OPEN_MOUTH", "open_mouth"]

OPEN_MOUTH = MappingProxyType(
    {
        "open_jaw": 590,
        "lower_t_midlip": -140,
        "raise_b_midlip": -960,
        "lower_t_lip_lm": -125,
        "lower_t_lip_rm": -125,
        "raise_b_lip_lm": -820,
        "raise_b_lip_rm": -820,
        "raise_l_cornerlip": -330,
        "raise_r_cornerlip": -330,
        "stretch_l_cornerlip": -80,
        "stretch_r_cornerlip": -80,
        "lower_t_midlip_o": -140,
        "raise_b_midlip_o": -960,
        "lower_t_lip_lm_o": -125,
        "lower_t_lip_rm_o": -125,
        "raise_b_lip_lm_o": -820,
        "raise_b_lip_rm_o": -820,
        "raise_l_cornerlip_o": -330,
        "raise_r_cornerlip_o": -330,
        "stretch_l_cornerlip_o": -80,
        "stretch_r_cornerlip_o": -80,
    }
)
"""FAPs, by name, of a mouth that is wide open: the jaw does not part the lips by itself (FAP 3)."""


def open_mouth(percent: float) -> Float32:
    """Return FAPs (68,), float32, of a mouth that is open by a share of `OPEN_MOUTH`, 0 to 100."""
    values = np.zeros(FAP_COUNT, np.float32)
    for name, value in OPEN_MOUTH.items():
        values[fap_numbers()[name] - 1] = value * percent / 100
    return values
