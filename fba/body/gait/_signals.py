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
"""Share of the leg's length by which a foot must come forward, relative to the pelvis, to make a step."""
SHORTEST_STEP = 0.08
"""Share of the leg's length by which a foot must be ahead of the other one when it meets the ground."""
SINKING, LEAVING = 0.06, 0.08
"""Seconds after a foot's foremost position in which it may meet the ground, and before its hindmost position
(half as many after it) in which it may leave the ground; its height decides when."""
TOUCH = 0.008
"""Share of the leg's length that a foot on the ground may be above its lowest height."""
SMOOTH = 0.02
"""Seconds over which curves are smoothed before their extrema are located."""
FACING = 0.2
"""Seconds over which the direction of the pelvis is smoothed."""


@dataclass(frozen=True, eq=False)
class Curves:
    """Curves of a motion of T frames; `heel` to `lowest` by side, "l" and "r".

    times: (T,), seconds. heel, toes: (T,), metres ahead of the pelvis. knee: (T,), its bend, radians.
    thigh: (T,), radians that it is raised. heel_position: (T, 3), in the world, metres. lowest: (T,), height
    of the foot's lowest point, metres. heading: (T,), direction of the pelvis, radians about y. reach: length
    of a straight leg, metres.
    """

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
        """Return the curves of joint matrices (T, J, 4, 4) at times (T,), seconds."""
        number = anatomy.skeleton.number
        rate = (len(times) - 1) / max(float(times[-1] - times[0]), 1e-9)
        pelvis = matrices[:, number("sacroiliac")]
        facing = _smooth(pelvis[:, :3, 2], FACING * rate)
        facing[:, 1] = 0.0
        facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-9)
        points = sole_points(anatomy, matrices).points
        heel, toes, knee, thigh, heel_position, lowest = {}, {}, {}, {}, {}, {}
        for row, letter in enumerate("lr"):
            hip, knee_joint, ankle = (
                matrices[:, number(f"{letter}_{j}"), :3, 3] for j in ("hip", "knee", "ankle")
            )

            def ahead(point: Float64) -> Float64:
                return _smooth(np.sum((point - pelvis[:, :3, 3]) * facing, axis=1), SMOOTH * rate)

            upper, lower = knee_joint - hip, ankle - knee_joint
            cosine = np.sum(upper * lower, axis=1)
            cosine /= np.linalg.norm(upper, axis=1) * np.linalg.norm(lower, axis=1)
            heel[letter], toes[letter] = ahead(points[row, 0]), ahead(points[row, 1])
            knee[letter] = _smooth(np.arccos(np.clip(cosine, -1.0, 1.0)), SMOOTH * rate)
            raised = np.arctan2(np.sum(upper * facing, axis=1), -upper[:, 1])
            thigh[letter] = _smooth(raised, SMOOTH * rate)
            heel_position[letter] = points[row, 0]
            lowest[letter] = points[row, ..., 1].min(axis=0)
        heading = np.unwrap(np.arctan2(facing[:, 0], facing[:, 2]))
        return cls(
            times, heel, toes, knee, thigh, heel_position, lowest, heading, anatomy.sides["l"].leg.reach
        )

    def contacts(self, letter: str) -> list[int]:
        """Return the frames in which a foot meets the ground, ahead of the other."""
        height, other = self.lowest[letter], self.heel["l" if letter == "r" else "r"]
        frames = []
        for peak in self._peaks(self.heel[letter]):
            if self.heel[letter][peak] - other[peak] < SHORTEST_STEP * self.reach:
                continue
            heights = height[peak : peak + self._frames(SINKING) + 1]
            frames.append(peak + int(np.argmax(heights <= heights.min() + TOUCH * self.reach)))
        return frames

    def departures(self, letter: str) -> list[int]:
        """Return the frames in which a foot has just left the ground.

        A foot that is dragged along stays low while it swings, so little of the time after it was furthest
        behind counts.
        """
        height = self.lowest[letter]
        frames = []
        for peak in self._peaks(-self.toes[letter]):
            near = self._frames(LEAVING)
            first = max(0, peak - near)
            low = height[max(0, first - near) : peak + 1].min()
            down = np.flatnonzero(height[first : peak + near // 4 + 1] <= low + TOUCH * self.reach)
            frames.append(first + int(down[-1]) + 1 if len(down) else peak)
        return frames

    def _frames(self, seconds: float) -> int:
        """Return the number of frames in a time, at least 1."""
        return max(1, round(seconds / max(float(np.median(np.diff(self.times))), 1e-9)))

    def _peaks(self, curve: Float64) -> list[int]:
        """Return the frames of prominent maxima, also of one at either end, as in loops."""
        from scipy.signal import find_peaks

        edge = [float(curve.min()) - 1.0]
        padded = np.concatenate([edge, curve, edge])
        peaks, _ = find_peaks(
            padded, prominence=SHORTEST_SWING * self.reach, distance=self._frames(STEP_SECONDS[0])
        )
        return [int(frame) - 1 for frame in peaks]


def _smooth(curve: Float64, width: float) -> Float64:
    """Return the curve smoothed by a Gaussian of `width` frames, the ends extended by their values."""
    if width < 0.3:
        return curve.copy()
    from scipy.ndimage import gaussian_filter1d

    result: Float64 = gaussian_filter1d(curve, width, axis=0, mode="nearest")
    return result
