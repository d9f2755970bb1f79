"""Two short performances whose outlines are looked for: an arm that rises, a head that turns."""

import numpy as np

from fba import Animation, BodyTrack, FaceTrack
from fba.parameters import BAP_COUNT, FAP_COUNT, bap_numbers

ARMS = ("r_shoulder_abduct", "l_shoulder_abduct", "r_elbow_flexion")


def raising() -> Animation:
    """Six frames at 5 frames/s in which the right arm rises to the side."""
    values = np.zeros((6, BAP_COUNT), dtype=np.int32)
    mask = np.zeros((6, BAP_COUNT), dtype=bool)
    columns = [bap_numbers()[name] - 1 for name in ARMS]
    values[:, columns[0]] = np.linspace(0, -160_000, 6)
    mask[:, columns] = True
    return Animation(5, np.arange(6) * 2, None, BodyTrack(values, mask), "raising")


def nodding() -> Animation:
    """Four frames in which a head turns aside."""
    values = np.zeros((4, FAP_COUNT), dtype=np.int32)
    values[:, 48] = [0, 20_000, 40_000, 60_000]
    mask = np.broadcast_to(np.arange(FAP_COUNT) == 48, values.shape)
    return Animation(25, np.arange(4), FaceTrack(values, mask), name="nodding")
