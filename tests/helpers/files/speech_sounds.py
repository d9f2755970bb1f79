"""Sounds like speech, for which no program must be installed."""

import numpy as np

from fba.arrays import Int16
from fba.speech import RATE


def babble(seconds: float = 3.0) -> Int16:
    """Return tones that come and go, in soft noise."""
    rng = np.random.default_rng(2)
    times = np.arange(round(seconds * RATE)) / RATE
    tones = np.sum([np.sin(2 * np.pi * hertz * times) for hertz in (140, 560, 1680)], axis=0)
    loud = np.clip(np.sin(2 * np.pi * 3 * times), 0, 1)
    return np.asarray(3000 * loud * tones + rng.normal(0, 40, len(times)), dtype=np.int16)
