"""Weights of several shapes to FAPs: their sum, and what cannot simply be added."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fba.arrays import Bool, Float64
from fba.capture.blendshapes.shape_table import shape_faps, with_mates
from fba.face import arkit_of
from fba.face.eyeball import limit_gaze
from fba.name_maps import key_of
from fba.parameters import FAP_COUNT, fap_numbers
from fba.tracks import FaceTrack

LID_GAP = 1024.0
"""Sum of the closings of both lids of an eye at which they meet."""
JAW = "jawOpen"
"""Shape that opens the jaw."""
CLOSED = "mouthClose"
"""Shape that brings the lips of an open jaw together."""
JAW_OPEN = np.radians(20.0)
"""Angle of a jaw, in radians, at which the mouth is as open as by a shape "jawOpen" of weight 1."""
RADIAN = 1e5
"""Units of the FAPs that are angles in one radian."""
MAX_FAP = 1 << 30
"""Largest magnitude of a FAP value."""


def combine(weights: Mapping[str, Float64], count: int, *, but: Bool | None = None) -> tuple[Float64, Bool]:
    """Return FAPs (T, 68) of shapes with weights (T,), and a mask (68,) of those that the shapes move.

    count: T. Unknown names are left out. but: mask (68,) of FAPs that something else moves. "mouthClose"
    brings the lips of an open jaw together: it counts up to the weight of "jawOpen", and not without it.
    """
    known = {name: amounts for name in weights if (amounts := shape_faps(name)) is not None}
    if not known:
        return np.zeros((count, FAP_COUNT)), np.zeros(FAP_COUNT, dtype=bool)
    columns = [weights[name] for name in known]
    by_shape = {arkit_of(name) or key_of(name): number for number, name in enumerate(known)}
    if CLOSED in by_shape:
        closed = by_shape[CLOSED]
        opened = columns[by_shape[JAW]] if JAW in by_shape else np.zeros(count)
        columns[closed] = np.minimum(columns[closed], np.maximum(opened, 0.0))
    amounts = np.array(list(known.values()))
    if but is not None:
        amounts[:, but] = 0.0
    return np.stack(columns, axis=1) @ amounts, (amounts != 0).any(axis=0)


def part_lids(values: Float64) -> None:
    """Keep lids of FAPs (T, 68) from passing each other, as blinks and squints add up."""
    for side in "lr":  # lower lids give way
        upper = fap_numbers()[f"close_t_{side}_eyelid"] - 1
        lower = fap_numbers()[f"close_b_{side}_eyelid"] - 1
        np.minimum(values[:, upper], LID_GAP, out=values[:, upper])
        np.minimum(values[:, lower], LID_GAP - values[:, upper], out=values[:, lower])


def to_face_track(values: Float64, moved: Bool) -> FaceTrack:
    """Return FAPs (T, 68) as a track: lids kept apart, the gaze limited, values rounded.

    values: changed in place. moved: mask (68,) of the FAPs that are sent, together with their mates.
    """
    part_lids(values)
    limit_gaze(values)
    rounded = np.rint(np.clip(values, -MAX_FAP, MAX_FAP)).astype(np.int32)
    return FaceTrack(rounded, np.broadcast_to(with_mates(moved), rounded.shape))
