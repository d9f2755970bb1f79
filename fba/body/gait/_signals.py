"""Curves of a motion from which steps are detected: feet ahead of the pelvis, knees, thighs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.body.gait._anatomy import Anatomy
from fba.body.gait._measure import sole_points

STEP_SECONDS = (0.2, 1.8)
"""Shortest and longest time from the contact of one foot to that of the other."""
SHORTEST_SWING = 0.12
"""Share of the leg's length by which a foot must come forward, against the pelvis, to have made a step."""
SHORTEST_STEP = 0.08
"""Share of the leg's length by which a foot must be ahead of the other as it comes to the ground."""
SINKING, LEAVING = 0.06, 0.08
"""Seconds after a foot's foremost position, and about its hindmost, in which its height shows when it meets
or leaves the ground."""
TOUCH = 0.008
"""Share of the leg's length that a foot on the ground may be above its lowest place."""
SMOOTH = 0.02
"""Seconds over which curves are smoothed before their extrema are looked for."""
FACING = 0.2
"""Seconds over which the direction is smoothed."""


@dataclass(frozen=True, eq=False)
class Curves:
    """times: (T,). By side: heel and toes ahead of the pelvis (T,), metres; knee bent (T,), thigh raised
    (T,), radians; heel in the world (T, 3), height of the foot's lowest point (T,).
    heading: (T,), radians about y. reach: metres, of a leg."""

    times: Float64
    heel: dict[str, Float64]
    toes: dict[str, Float64]
    knee: dict[str, Float64]
    thigh: dict[str, Float64]
    heel_position: dict[str, Float64]
    lowest: dict[str, Float64]
    heading: Float64
    reach: float

    @classmethod
    def measure(cls, anatomy: Anatomy, matrices: Float64, times: Float64) -> Curves:
        number = anatomy.skeleton.number
        rate = (len(times) - 1) / max(float(times[-1] - times[0]), 1e-9)
        pelvis = matrices[:, number("sacroiliac")]
        facing = _smooth(pelvis[:, :3, 2], FACING * rate)
        facing[:, 1] = 0.0
        facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-9)
        points = sole_points(anatomy, matrices).points
        heel, toes, knee, thigh, place, lowest = {}, {}, {}, {}, {}, {}
        for row, letter in enumerate("lr"):
            hip, knee_at, ankle = (
                matrices[:, number(f"{letter}_{j}"), :3, 3] for j in ("hip", "knee", "ankle")
            )

            def ahead(point: Float64) -> Float64:
                return _smooth(np.sum((point - pelvis[:, :3, 3]) * facing, axis=1), SMOOTH * rate)

            upper, lower = knee_at - hip, ankle - knee_at
            cosine = np.sum(upper * lower, axis=1)
            cosine /= np.linalg.norm(upper, axis=1) * np.linalg.norm(lower, axis=1)
            heel[letter], toes[letter] = ahead(points[row, 0]), ahead(points[row, 1])
            knee[letter] = _smooth(np.arccos(np.clip(cosine, -1.0, 1.0)), SMOOTH * rate)
            raised = np.arctan2(np.sum(upper * facing, axis=1), -upper[:, 1])
            thigh[letter] = _smooth(raised, SMOOTH * rate)
            place[letter] = points[row, 0]
            lowest[letter] = points[row, ..., 1].min(axis=0)
        heading = np.unwrap(np.arctan2(facing[:, 0], facing[:, 2]))
        return cls(times, heel, toes, knee, thigh, place, lowest, heading, anatomy.sides["l"].leg.reach)

    def contacts(self, letter: str) -> list[int]:
        """Return frames in which a foot meets the ground, ahead of the other."""
        height, other = self.lowest[letter], self.heel["l" if letter == "r" else "r"]
        frames = []
        for peak in self._peaks(self.heel[letter]):
            if self.heel[letter][peak] - other[peak] < SHORTEST_STEP * self.reach:
                continue
            coming = height[peak : peak + self._frames(SINKING) + 1]
            frames.append(peak + int(np.argmax(coming <= coming.min() + TOUCH * self.reach)))
        return frames

    def departures(self, letter: str) -> list[int]:
        """Return frames in which a foot has just left the ground."""
        height = self.lowest[letter]
        frames = []
        for peak in self._peaks(-self.toes[letter]):
            near = self._frames(LEAVING)
            first = max(0, peak - near)
            low = height[max(0, first - near) : peak + 1].min()
            down = np.flatnonzero(height[first : peak + near // 2 + 1] <= low + TOUCH * self.reach)
            frames.append(first + int(down[-1]) + 1 if len(down) else peak)
        return frames

    def _frames(self, seconds: float) -> int:
        """Return number of frames in some seconds, at least one."""
        return max(1, round(seconds / max(float(np.median(np.diff(self.times))), 1e-9)))

    def _peaks(self, curve: Float64) -> list[int]:
        """Return maxima that stand out; also of a curve that begins or ends at one, as loops do."""
        from scipy.signal import find_peaks

        edge = [float(curve.min()) - 1.0]
        padded = np.concatenate([edge, curve, edge])
        found, _ = find_peaks(
            padded, prominence=SHORTEST_SWING * self.reach, distance=self._frames(STEP_SECONDS[0])
        )
        return [int(frame) - 1 for frame in found]


def _smooth(curve: Float64, width: float) -> Float64:
    """Return the curve smoothed by a Gaussian of `width` frames, the ends extended by their values."""
    if width < 0.3:
        return curve.copy()
    from scipy.ndimage import gaussian_filter1d

    result: Float64 = gaussian_filter1d(curve, width, axis=0, mode="nearest")
    return result
