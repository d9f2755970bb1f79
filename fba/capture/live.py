"""Captures that arrive moment by moment: the conversions of whole captures, a frame at a time.

May use: all of `fba.capture`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from math import ceil, floor

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64, Int32
from fba.body import BapSolver
from fba.capture._skeleton import SkeletonOptions, find_targets, solve_targets
from fba.capture.blendshapes.combination import RADIAN
from fba.capture.blendshapes.conversion import EYE_FAPS, HEAD_FAPS, convert_rows
from fba.capture.blendshapes.shape_table import largest_amounts, shape_faps
from fba.capture.motion import MappedMotion, SkeletonMotion
from fba.capture.preparation import prepare
from fba.face import arkit_names
from fba.limits import DEFAULT_LIMITS
from fba.parameters import FAP_COUNT, fap_numbers
from fba.sampling import TIME_TOLERANCE, interpolate
from fba.tracks import BodyTrack, FaceTrack

__all__ = ["LiveBlendshapes", "LiveSkeleton", "widest_faces"]

CHUNK_FRAMES = 4096
"""Number of frames that are made at once, which limits the memory for those of a long gap."""
CONTEXT_FRAMES = 8
"""Number of earlier frames that are converted again with the new ones, so that joints move on smoothly."""
LIVE_OPTIONS = SkeletonOptions(ground="none", plant=False)
"""Options of poses that come one after another: where the ground is, only later poses show."""

Row = tuple[float, list[Float64]]
"""A time, and what is there then: weights (N,), angles of the head (3,) and of the eyes (4,)."""


def widest_faces() -> Animation:
    """Return frames in which each FAP goes to the most and to the least that shapes make of it, and back.

    Heads and eyes turn by a radian each way. For `fba.codec.Encoder.expect`.
    """
    shapes = np.array([amounts for name in arkit_names() if (amounts := shape_faps(name)) is not None])
    most = np.maximum(np.maximum(shapes, 0.0).sum(axis=0), largest_amounts())
    least = np.minimum(np.minimum(shapes, 0.0).sum(axis=0), -largest_amounts())
    turns = [fap_numbers()[name] - 1 for name in (*HEAD_FAPS, *EYE_FAPS)]
    most[turns], least[turns] = RADIAN, -RADIAN
    still = np.zeros(FAP_COUNT)
    values = np.rint([still, most, still, least, still]).astype(np.int32)
    sent = np.broadcast_to((values != 0).any(axis=0), values.shape)
    return Animation(Fraction(1), np.arange(len(values)), FaceTrack(values, sent))


class LiveBlendshapes:
    """Turns rows of weights into frames as they come.

    names: of the N shapes, as in `ShapeMotion`. rate: frames per second. Frames are those that
    `from_blendshapes` makes of all rows in which a face is seen: each is complete once a row at its time, or
    a later one, has come. Angles of the head and of the eyes turn them from the first row on in which they
    are not all 0; with_head: the head from the beginning.
    """

    def __init__(self, names: Sequence[str], rate: Fraction, *, with_head: bool = False) -> None:
        self.names = tuple(names)
        self.rate = Fraction(rate)
        self._before: Row | None = None
        self._next = 0  # number of the next frame
        self._frames_made = False
        self._recorded = [with_head, False]  # head, eyes

    def push(self, time: float, weights: Float64, head: Float64, eyes: Float64) -> Iterator[Animation]:
        """Add a row, later than the one before; yield the frames that are now complete.

        time: seconds from the first row of the capture, also one without a face. weights (N,), head (3,) and
        eyes (4,) as in `ShapeMotion`; 0 for angles that the source does not have. The row counts once all
        frames have been taken.
        """
        row = (float(time), [weights, head, eyes])
        self._note_angles(head, eyes)
        frames = float(self.rate)
        if self._before is None:
            self._next = ceil(time * frames - TIME_TOLERANCE)
        last = floor(time * frames) + 1
        while last / frames > time:
            last -= 1
        yield from self._frames(row, last)
        self._before = row

    def finish(self) -> Iterator[Animation]:
        """Yield the frames at the end that are only complete when no other row comes: one at most."""
        if self._before is not None:
            last = floor(self._before[0] * float(self.rate) + TIME_TOLERANCE)
            yield from self._frames(self._before, last if self._frames_made else max(last, self._next))

    def show(self, weights: Float64, head: Float64, eyes: Float64) -> FaceTrack:
        """Return the FAPs of a row as it is, between frames: a track of one frame."""
        return self.convert(weights[None], head[None], eyes[None])

    def convert(self, weights: Float64, head: Float64, eyes: Float64) -> FaceTrack:
        """Return the FAPs of rows (T, N), (T, 3) and (T, 4) as they are, for who makes frames himself."""
        self._note_angles(head, eyes)
        return self._convert([weights, head, eyes])

    def _note_angles(self, head: Float64, eyes: Float64) -> None:
        for number, angles in enumerate((head, eyes)):
            self._recorded[number] |= bool(angles.any())

    def _frames(self, row: Row, last: int) -> Iterator[Animation]:
        """Yield the frames up to number `last`, between the row before and this one."""
        rows = [row] if self._before is None else [self._before, row]
        times = np.array([time for time, _ in rows])
        values = [np.stack(parts) for parts in zip(*(parts for _, parts in rows), strict=True)]
        while self._next <= last:
            index = np.arange(self._next, min(last + 1, self._next + CHUNK_FRAMES))
            self._next += len(index)
            self._frames_made = True
            track = self._convert(interpolate(times, values, index / float(self.rate), DEFAULT_LIMITS))
            yield Animation(self.rate, index, track)

    def _convert(self, values: list[Float64]) -> FaceTrack:
        weights, head, eyes = values
        with_head, with_eyes = self._recorded
        return convert_rows(self.names, weights, head if with_head else None, eyes if with_eyes else None)


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
        self._context = rotations[-CONTEXT_FRAMES:], positions[-CONTEXT_FRAMES:]
        poses = replace(self._source, rotations=rotations, positions=positions, rate=rate)
        source = MappedMotion(self._at_rest(poses), self._mapped)
        turns, root = find_targets(source, self._solver, LIVE_OPTIONS)
        last = {joint: rows[-new:] for joint, rows in turns.items()}
        track = solve_targets(last, root[-new:], self._solver, self._previous)
        self._previous = track.values[-1]
        return track

    def _at_rest(self, poses: SkeletonMotion) -> SkeletonMotion:
        return poses.with_rest_of(self._source, 0) if self._t_pose else poses
