"""How far an actor's eyes are open, from blinks, and where they look, from points on their pupils."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.capture.markers._targets import LOWER_LIDS, PUPILS
from fba.face.eyeball import LARGEST_GAZE
from fba.parameters import point_rows


@dataclass(frozen=True)
class Tuning:
    """Constants of lids and blinks."""

    max_blink: float = 0.5  # longest duration of a blink at half its depth, in seconds
    min_blink_depth: float = 0.5  # depth of a blink, as a share of the usual opening of the eye
    # share of the opening by which the upper lid sinks in a blink. The lower lid rises to meet it on four
    # heads with ARKit's shapes (0.90 there, fba/capture/blendshapes/shape_faps.csv), and hardly in streams of
    # old encoders; as it is not sent, a blink must nearly close the eye without it.
    upper_lid_share: float = 0.95
    opening_range: tuple[float, float] = (0.7, 1.3)  # accepted openings, relative to the usual
    smoothing_seconds: float = 0.02  # length of the moving average that removes noise, in seconds
    depth_percentile: int = 75  # of the depths of blinks: while people talk, many stop half-way
    eyeball_radius: float = 0.01205  # metres from an eyeball's centre to its front; adults hardly differ
    min_opening: float = 0.3  # share of its neutral opening that an eye must exceed for its pupil to be seen


TUNING = Tuning()


def opening_by_blinks(sunk: Float64, times: Float64, usual: float) -> float | None:
    """Return the opening of the eyes in the neutral face, metres; None if the take has no blinks.

    For faces with markers on the upper lids only. sunk: float64 (T, E), metres by which the upper lid of each
    eye is below its neutral place, at the times (T,). usual: the opening of an eye of average proportions.
    """
    from scipy.ndimage import uniform_filter1d
    from scipy.signal import find_peaks

    if len(times) < 3:
        return None
    rate = (len(times) - 1) / float(times[-1] - times[0])
    depths: list[float] = []
    for lid in uniform_filter1d(sunk, max(1, round(TUNING.smoothing_seconds * rate)), axis=0).T:
        peaks, _ = find_peaks(
            lid, prominence=TUNING.min_blink_depth * usual, width=(None, TUNING.max_blink * rate)
        )
        depths += lid[peaks].tolist()
    if not depths:
        return None
    opening = float(np.percentile(depths, TUNING.depth_percentile)) / TUNING.upper_lid_share
    return float(np.clip(opening, TUNING.opening_range[0] * usual, TUNING.opening_range[1] * usual))


def find_gaze(moved: Float64, points: Float64, places: Collection[str], size: float) -> Float64 | None:
    """Return the turns of the eyes to the left and down, float64 (T, 2), radians; None without a pupil.

    moved: (T, 84, 3), displacements of feature points from the neutral face, in which eyes look ahead,
    relative to the head, metres. points: (84, 3), the neutral face. places: feature points with markers.
    size: of the face, relative to an adult's. Both eyes look in the same direction, so that their noise is
    halved; a shut eye does not count, and while both are shut, the gaze is interpolated.
    """
    pupils = [name for name in PUPILS if name in places]
    if not pupils:
        return None
    total, weight = np.zeros((len(moved), 2)), np.zeros(len(moved))
    for name in pupils:
        shift = moved[:, point_rows()[name]] / (TUNING.eyeball_radius * size)
        most = np.sin(LARGEST_GAZE)
        pitch = -np.arcsin(np.clip(shift[:, 1], -most, most))
        yaw = np.arcsin(np.clip(shift[:, 0] / np.cos(pitch), -most, most))
        counts = _open(moved, points, name, places)
        total += np.stack([yaw, pitch], axis=1) * counts[:, None]
        weight += counts
    rows = np.flatnonzero(weight > 0)
    if not len(rows):
        return np.zeros((len(moved), 2))
    seen = total[rows] / weight[rows, None]
    every = np.arange(len(moved))
    return np.stack([np.interp(every, rows, seen[:, axis]) for axis in range(2)], axis=1)


def _open(moved: Float64, points: Float64, pupil: str, places: Collection[str]) -> Float64:
    """Return 1 where an eye is open and 0 where it is shut, float64 (T,); 1 if its lids have no markers."""
    upper, lower = list(LOWER_LIDS.items())[PUPILS.index(pupil)]
    if not {upper, lower} <= set(places):
        return np.ones(len(moved))
    above, below = point_rows()[upper], point_rows()[lower]
    neutral = points[above, 1] - points[below, 1]
    opening = neutral + moved[:, above, 1] - moved[:, below, 1]
    return np.asarray((opening > TUNING.min_opening * neutral).astype(np.float64))
