"""`LiveSkeleton`: what `from_skeleton` does with bones, for poses that come a few at a time."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np

from fba.arrays import Float64, Int32
from fba.body import BapSolver
from fba.capture import _retarget as retarget
from fba.capture.motion import SkeletonMotion
from fba.capture.preparation import prepare, rest_on_frame
from fba.capture.skeleton import solve_targets
from fba.tracks import BodyTrack

CONTEXT = 8
"""Frames before the new ones that are looked at again, so that joints go on as they went."""
FOLLOWING = retarget.SkeletonOptions(ground="none", plant=False)
"""Poses that come one after the other: nothing is known of the ground."""


class LiveSkeleton:
    """Turns poses of a skeleton into BAPs as they come.

    motion: of one frame at least, y up; its joints are the skeleton. Its rest pose counts, or, with t_pose,
    its first frame. Bones point in the directions of the source's, as `from_skeleton` with ground "none" has
    it: feet are not planted, since that needs what comes later.

    Raises ModelError where it is not clear which joint is which, or which side is left.
    """

    def __init__(self, motion: SkeletonMotion, *, t_pose: bool = False) -> None:
        self._source = motion
        self._t_pose = t_pose
        self._solver = BapSolver()
        ready = prepare(self._at_rest(motion), self._solver.skeleton, rest="file", up="+y")
        self._mapped = ready.mapped
        self._context: tuple[Float64, Float64] | None = None
        self._previous: Int32 | None = None
        self.convert(motion.rotations[:1], motion.positions[:1], motion.rate)  # or it fails now
        self._context = self._previous = None

    def convert(self, rotations: Float64, positions: Float64, rate: Fraction) -> BodyTrack:
        """Return the BAPs of the next poses.

        rotations: (T, J, 4), quaternions relative to the parents, positions: (T, 3), of the root, as in the
        motion that this was made from. A few poses at once take hardly longer than one.
        """
        new = len(positions)
        if self._context is not None:
            rotations = np.concatenate([self._context[0], rotations])
            positions = np.concatenate([self._context[1], positions])
        self._context = rotations[-CONTEXT:], positions[-CONTEXT:]
        poses = replace(self._source, rotations=rotations, positions=positions, rate=rate)
        turned, root = retarget.find_targets(self._at_rest(poses), self._mapped, self._solver, FOLLOWING)
        last = {joint: rows[-new:] for joint, rows in turned.items()}
        track = solve_targets(last, root[-new:], self._solver, self._previous)
        self._previous = track.values[-1]
        return track

    def _at_rest(self, poses: SkeletonMotion) -> SkeletonMotion:
        return rest_on_frame(poses, self._source, 0) if self._t_pose else poses
