"""`PersonConversion`: ordered bones and expressions of a sender to frames of a body and a face."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import pairwise
from math import ceil, floor

import numpy as np

from fba import rotations
from fba.animation import Animation
from fba.arrays import Float64, Intp
from fba.body import Skeleton
from fba.capture import SkeletonMotion, shape_faps
from fba.capture.live import LiveBlendshapes, LiveSkeleton
from fba.errors import ModelError
from fba.face import arkit_of
from fba.live._order import Timed
from fba.live._protocols import unity_bones
from fba.live._protocols.sample import BoneTurn, Sample
from fba.live._summary import Summary
from fba.live.recording import stream_rate
from fba.sampling import GAP, TIME_TOLERANCE, find_rate
from fba.tracks import BodyTrack, FaceTrack

START_SECONDS = 1.0
"""Seconds at the start in which the bones, the expressions and the frame rate are determined."""
CHUNK_FRAMES = 256
"""Number of frames that are computed at once."""
MIN_SHAPES = 5
"""Smallest number of shapes with ARKit's names that replace other expressions, which only repeat them."""
OLD_NAMES = {
    "a": "aa", "i": "ih", "u": "ou", "e": "ee", "o": "oh", "joy": "happy", "sorrow": "sad", "fun": "relaxed",
    "blink_l": "blinkLeft", "blink_r": "blinkRight",
}  # fmt: skip
"""VRM 1's names of VRM 0's expressions, in lower case."""
MIN_OFFSET = 1e-3
"""Smallest length of a bone, metres."""
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
EYE_BONES = ("LeftEye", "RightEye")


class PersonConversion:
    """Converts samples with bones, expressions or both to frames.

    rate: frames per second; by default that of the first second. t_pose: whether the person stands in a
    T-pose in the first sample; otherwise unturned bones form a T-pose. summary: counts events.

    No frame comes out before the first second is over.
    """

    def __init__(self, rate: Fraction | None, *, t_pose: bool, summary: Summary) -> None:
        self._rate = rate
        self._t_pose = t_pose
        self._summary = summary
        self._beginning: list[Timed] | None = []
        self._pending: list[Timed] = []
        self._before: Timed | None = None
        self._next = 0
        self._body: _Body | None = None
        self._face: _Face | None = None
        self._newest: tuple[FaceTrack | None, BodyTrack | None] = (None, None)

    def push(self, timed: Timed) -> Iterator[Animation]:
        """Add a sample; frames come out of `settle`."""
        self._summary.used += 1
        (self._pending if self._beginning is None else self._beginning).append(timed)
        if self._beginning is not None and timed[0] - self._beginning[0][0] >= START_SECONDS:
            self._begin(self._beginning)
        yield from ()

    def settle(self) -> Iterator[Animation]:
        """Yield the frames that are complete with all samples so far."""
        pending, self._pending = self._pending, []
        if self._rate is None or self._beginning is not None:
            return
        rate = float(self._rate)
        if self._before is None and pending:
            self._next = ceil(pending[0][0] * rate - TIME_TOLERANCE)
        rows = [*([] if self._before is None else [self._before]), *pending]
        for (earlier, _), (later, _) in pairwise(rows):
            if (later - earlier) * rate >= GAP:
                self._summary.gaps += 1
                self._summary.longest_gap = max(self._summary.longest_gap, later - earlier)
        if pending:
            yield from self._frames(rows, floor(rows[-1][0] * rate + TIME_TOLERANCE))
            self._before = rows[-1]

    def finish(self) -> Iterator[Animation]:
        """Yield the remaining frames."""
        if self._beginning:
            self._begin(self._beginning)
        yield from self.settle()

    def show(self, sample: Sample) -> tuple[FaceTrack | None, BodyTrack | None]:
        """Return the newest face, and the body of the last frame: tracks of one frame, or None."""
        face = None if self._face is None else self._face.show(sample)
        return face, self._newest[1]

    def _begin(self, samples: list[Timed]) -> None:
        """Determine rate, bones and expressions from the samples of the first second."""
        self._beginning, self._pending = None, samples
        if self._rate is None:
            try:
                self._rate = stream_rate(find_rate(np.array([time for time, _ in samples])))
            except ModelError:
                self._rate = Fraction(30)
            self._summary.notes.append(f"{float(self._rate):g} frames a second, as in the first one")
        bones = {name: turn for _, sample in samples for name, turn in sample.bones.items()}
        try:
            self._body = _Body(bones, samples[0][1], t_pose=self._t_pose, summary=self._summary)
        except ModelError as error:
            self._summary.notes.append(f"there is no body: {error.finding}")
        names = list(dict.fromkeys(name for _, sample in samples for name in sample.names))
        self._face = _Face.of(names, bones, self._rate, with_head=self._body is None, summary=self._summary)
        if self._face is None and self._body is None:
            self._rate = None

    def _frames(self, rows: list[Timed], last: int) -> Iterator[Animation]:
        """Yield the frames up to number `last`, between rows."""
        assert self._rate is not None
        times = np.array([time for time, _ in rows])
        while self._next <= last:
            index = np.arange(self._next, min(last + 1, self._next + CHUNK_FRAMES))
            self._next += len(index)
            at = index / float(self._rate)
            after = np.clip(np.searchsorted(times, at), 0, len(times) - 1)
            before = np.maximum(after - 1, 0)
            length = times[after] - times[before]
            weight = np.clip((at - times[before]) / np.where(length > 0, length, 1.0), 0.0, 1.0)
            samples = [sample for _, sample in rows]
            face = None if self._face is None else self._face.convert(samples, before, after, weight)
            body = (
                None if self._body is None else self._body.convert(samples, before, after, weight, self._rate)
            )
            self._newest = face, None if body is None else body[-1:]
            yield Animation(self._rate, index, face, body)


class _Face:
    """Conversion of expressions and eyes, and of the head where there is no body, to FAPs."""

    def __init__(self, names: dict[str, str], rate: Fraction, *, with_head: bool) -> None:
        self._names = names  # the sender's name of each shape
        self._with_head = with_head
        self._frames = LiveBlendshapes(tuple(names), rate, with_head=with_head)

    @classmethod
    def of(
        cls, sent: list[str], bones: dict[str, BoneTurn], rate: Fraction, *, with_head: bool, summary: Summary
    ) -> _Face | None:
        """Return the conversion for these expressions and bones; None without expressions or a head."""
        expressions = {*OLD_NAMES, *(name.lower() for name in OLD_NAMES.values())}  # "aa" opens a jaw, too
        shapes = {
            shape: name
            for name in sent
            if name.lower() not in expressions and (shape := arkit_of(name)) is not None
        }
        others = {
            plain: name
            for name in sent
            if name not in shapes.values()
            and shape_faps(plain := OLD_NAMES.get(name.lower(), name)) is not None
        }
        if len(shapes) >= MIN_SHAPES and others:
            summary.notes.append(
                f"{len(shapes)} shapes have ARKit's names; {len(others)} other expressions are left out"
            )
        names = shapes if len(shapes) >= MIN_SHAPES else others | shapes
        if not names and not (with_head and "Head" in bones):
            return None
        return cls(names, rate, with_head=with_head and "Head" in bones)

    def convert(self, samples: list[Sample], before: Intp, after: Intp, weight: Float64) -> FaceTrack:
        """Return FAPs of frames between samples."""
        rows = [np.stack(parts) for parts in zip(*map(self._row, samples), strict=True)]
        weight = weight[:, None]
        return self._frames.convert(*(row[before] * (1 - weight) + row[after] * weight for row in rows))

    def show(self, sample: Sample) -> FaceTrack:
        """Return the FAPs of a sample."""
        return self._frames.show(*self._row(sample))

    def _row(self, sample: Sample) -> tuple[Float64, Float64, Float64]:
        """Return weights (N,), angles of the head (3,) and of the eyes (4,)."""
        sent = {} if sample.weights is None else dict(zip(sample.names, sample.weights.tolist(), strict=True))
        weights = np.array([sent.get(name, 0.0) for name in self._names.values()])
        head = np.zeros(3)
        if self._with_head:
            turn = rotations.matrices(_world(sample, ("Neck", "Head")))
            head = np.array(_angles(turn))
        (left_pitch, left_yaw, _), (right_pitch, right_yaw, _) = (
            _angles(rotations.matrices(_world(sample, (eye,)))) for eye in EYE_BONES
        )
        return weights, head, np.array([left_yaw, right_yaw, left_pitch, right_pitch])


def _world(sample: Sample, bones: tuple[str, ...]) -> Float64:
    """Return the quaternion (4,) of a chain of bones; bones that are not sent do not turn."""
    result = IDENTITY
    for bone in bones:
        if bone in sample.bones:
            result = rotations.multiply(result, sample.bones[bone].rotation)
    return result


def _angles(turn: Float64) -> tuple[float, float, float]:
    """Return pitch (down), yaw (left) and roll (right) of a rotation (3, 3); ahead is +z, left is +x."""
    pitch = float(np.arctan2(-turn[1, 2], np.hypot(turn[0, 2], turn[2, 2])))
    yaw = float(np.arctan2(turn[0, 2], turn[2, 2]))
    roll = float(np.arctan2(turn[1, 0], turn[1, 1]))
    return pitch, yaw, roll


class _Body:
    """Conversion of bones to BAPs."""

    def __init__(self, bones: dict[str, BoneTurn], first: Sample, *, t_pose: bool, summary: Summary) -> None:
        self._names = [name for name in unity_bones.parents() if name in bones and unity_bones.joint_of(name)]
        if "Hips" not in self._names:
            raise ModelError("no bone is called Hips")
        parents = [self._above(name) for name in self._names]
        offsets = np.array([bones[name].position for name in self._names])
        offsets[0] = 0.0
        if (np.linalg.norm(offsets[1:], axis=1) < MIN_OFFSET).sum() * 2 > len(offsets):
            offsets = standard_offsets(self._names, parents)
            summary.notes.append("the bones come without lengths; those of the standard's body are used")
        turns, root = self._pose(first)
        joints = {name: unity_bones.joint_of(name) or "" for name in self._names}
        motion = SkeletonMotion(
            tuple(self._names), np.array(parents), offsets, turns[None], root[None], Fraction(30),
            declared=joints, up="+y",
        )  # fmt: skip
        self._skeleton = LiveSkeleton(motion, t_pose=t_pose)

    def _above(self, name: str) -> int:
        """Return the number of the nearest bone above that is sent; -1 for the hips."""
        return next((self._names.index(bone) for bone in unity_bones.above(name) if bone in self._names), -1)

    def convert(
        self, samples: list[Sample], before: Intp, after: Intp, weight: Float64, rate: Fraction
    ) -> BodyTrack:
        """Return BAPs of frames between samples."""
        poses = [self._pose(sample) for sample in samples]
        turns, roots = np.stack([turn for turn, _ in poses]), np.stack([root for _, root in poses])
        positions = roots[before] * (1 - weight[:, None]) + roots[after] * weight[:, None]
        return self._skeleton.convert(rotations.interpolate(turns, before, after, weight), positions, rate)

    def _pose(self, sample: Sample) -> tuple[Float64, Float64]:
        """Return rotations (J, 4) of the bones, the first in the world, and the position (3,) of the hips."""
        still = BoneTurn(np.zeros(3), IDENTITY)
        turns = np.stack([sample.bones.get(name, still).rotation for name in self._names])
        root, hips = sample.bones.get("", still), sample.bones.get("Hips", still)
        turns[0] = rotations.multiply(root.rotation, hips.rotation)
        return turns, root.position + rotations.matrices(root.rotation) @ hips.position


def standard_offsets(names: Sequence[str], parents: Sequence[int]) -> Float64:
    """Return offsets (J, 3) of bones from their parents in the standard skeleton, metres, in a T-pose, y up.

    names: of Unity's bones, the hips first. parents: numbers of the bones above, -1 for the hips.
    """
    skeleton = Skeleton.default()

    def centre(bone: str) -> Float64:
        joint = unity_bones.joint_of(bone)
        assert joint is not None  # the caller passes bones of a body only
        result: Float64 = skeleton.centres[skeleton.number(joint)]
        return result

    raised = {
        side: rotations.between(
            centre(f"{side}LowerArm") - centre(f"{side}UpperArm"), np.array([outwards, 0.0, 0.0])
        )
        for side, outwards in (("Left", 1.0), ("Right", -1.0))
    }
    offsets = np.zeros((len(names), 3))
    for number, (name, parent) in enumerate(zip(names, parents, strict=True)):
        if parent < 0:
            continue
        offsets[number] = centre(name) - centre(names[parent])
        side = "Left" if name.startswith("Left") else "Right"
        if f"{side}UpperArm" in (names[parent], *unity_bones.above(names[parent])):
            offsets[number] = raised[side] @ offsets[number]
    return offsets
