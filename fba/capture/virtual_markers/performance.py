"""`MarkerPerformance`: a capture of markers played on a head by its virtual markers."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np

from fba import rotations
from fba.arrays import Float64
from fba.capture.markers._gaps import fill_gaps, often_seen, warn_of_gaps
from fba.capture.markers._motion import MarkerMotion
from fba.capture.markers._neutral import neutral_frames
from fba.capture.markers._stabilisation import follow_head, relate_poses, remove_poses
from fba.capture.virtual_markers._heads import MarkedHead
from fba.capture.virtual_markers.lids import Eye, find_eyes, narrow, turn_to_camera
from fba.capture.virtual_markers.mapping import MarkerMapping, MarkerWeights, find_weights
from fba.capture.virtual_markers.proposal import lay_onto
from fba.choices import Gaze
from fba.errors import ModelError, warn

MIN_FIXED = 3
"""Smallest number of fixed markers that show the head's motion."""
MIN_DISTANCE = 1e-3
"""Smallest distance between the two fixed markers of the scale, as a share of the size of the cloud."""
MAX_SCALE_RATIO = 1.5
"""Largest ratio of the scales by two fixed markers and by all markers that raises no doubt."""
Neutral = str | int | tuple[float, float]


@dataclass(frozen=True, eq=False)
class SteadyMarkers:
    """Captured markers without the head's motion.

    names: of the markers. local: float64 (T, K, 3), metres, in the capture's axes, as if the head stayed
    where it is in the neutral face. rotation (T, 3, 3), shift (T, 3): the head's motion from there. neutral:
    float64 (K, 3), the markers of the neutral face. rest: its first frame, and the frame after its last.
    """

    names: tuple[str, ...]
    local: Float64
    rotation: Float64
    shift: Float64
    neutral: Float64
    rest: tuple[int, int]


@dataclass(frozen=True, eq=False)
class MarkerPerformance:
    """A head that moves as captured markers do.

    rate, times: the capture's. names: of the K virtual markers with a vertex. displacements: float64
    (T, K, 3), how far each marker moves from the neutral face, in the head's axes and unit; 0 where it is
    fixed. rotation (T, 3, 3), shift (T, 3): the head's motion. scale: the head's units per metre of the
    capture. cloud: float64 (T, M, 3), all markers of the capture in the head's axes, NaN where a marker was
    not seen. weights: which vertices go with which markers. rest: float64 (N, 3), the vertices from which
    they move: the head's, or with narrowed eyes. eyes: those that look at the camera. looks: float64
    (T, 3, 3), how they turn in the head.
    """

    head: MarkedHead
    mapping: MarkerMapping
    rate: Fraction
    times: Float64
    displacements: Float64
    rotation: Float64
    shift: Float64
    scale: float
    cloud: Float64
    weights: MarkerWeights
    rest: Float64
    eyes: tuple[Eye, ...]
    looks: Float64

    def __len__(self) -> int:
        return len(self.times)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the virtual markers with a vertex."""
        return self.weights.names

    @cached_property
    def moves(self) -> Float64:
        """float64 (T, K, 3): the factors of the shares of `weights` in each frame."""
        moves: Float64 = np.matmul(self.weights.solve, self.displacements)
        return moves

    def vertices(self, frame: int) -> Float64:
        """Return the head's vertices in a frame, float64 (N, 3), without the head's motion."""
        return self.vertices_between(frame, frame, 0.0)

    def vertices_between(self, frame: int, after: int, share: float) -> Float64:
        """Return the vertices between two frames. share: of the later frame, 0..1."""
        moves = self.moves[frame] + share * (self.moves[after] - self.moves[frame])
        result: Float64 = self.rest + self.weights.shares @ moves
        if self.eyes:
            turn = rotations.part(self.looks[frame], self.looks[after], share)
            for eye in self.eyes:
                result[eye.rows] = (result[eye.rows] - eye.centre) @ turn.T + eye.centre
        return result

    def pose_between(self, frame: int, after: int, share: float) -> Float64:
        """Return the head's motion between two frames as a matrix (4, 4), in its unit."""
        matrix = np.eye(4)
        matrix[:3, :3] = rotations.part(self.rotation[frame], self.rotation[after], share)
        matrix[:3, 3] = self.shift[frame] + share * (self.shift[after] - self.shift[frame])
        return matrix


def steady(motion: MarkerMotion, mapping: MarkerMapping, neutral: Neutral = "auto") -> SteadyMarkers:
    """Return the mapped markers of a capture without the head's motion and without gaps.

    neutral: as of `fba.capture.from_markers`. Raises ModelError where the head's motion cannot be found;
    OptionError for frames that the capture has not. Warns (FbaWarning) of markers that are hardly ever seen,
    which are left out, and of long gaps.
    """
    if not len(motion):
        raise ModelError("the capture has no frames")
    mapping.check_names(motion.names)
    captured = mapping.captured
    names = often_seen(captured, motion.seen[:, [motion.names.index(name) for name in captured]])
    positions = motion.positions[:, [motion.names.index(name) for name in names]]
    fixed = [n for n, name in enumerate(names) if name in mapping.fixed]
    if len(fixed) < MIN_FIXED:
        raise ModelError(
            f"the head's motion needs {MIN_FIXED} fixed markers (hairline, ears, bridge of the nose, a "
            f"cap); the mapping has {len(fixed)}: mark more of them as fixed"
        )
    if len(fixed) == len(names):
        raise ModelError("all markers of the mapping are fixed: nothing would move")
    rotation, shift = follow_head(positions[:, fixed], motion.times)
    rest = neutral_frames(remove_poses(rotation, shift, positions), motion.times, neutral)
    rotation, shift = relate_poses(rotation, shift, rest)
    local, filled = fill_gaps(names, remove_poses(rotation, shift, positions), motion.times)
    warn_of_gaps(filled)
    still = np.median(local[rest], axis=0)
    return SteadyMarkers(names, local, rotation, shift, still, (rest.start, rest.stop))


def move_head(
    motion: MarkerMotion, head: MarkedHead, mapping: MarkerMapping, neutral: Neutral = "auto"
) -> MarkerPerformance:
    """Return a head moved by a capture.

    The capture is laid onto the head: turned so that its neutral markers are where the virtual ones are, and
    scaled by the distance of two fixed ones. neutral: the frames in which the head looks as its file has it.

    Raises ModelError for a mapping that fits neither head nor capture, and where the head's motion or the
    scale cannot be found. Warns (FbaWarning) of what is odd or repaired.
    """
    mapping.check(head)
    return perform_steady(motion, head, mapping, steady(motion, mapping, neutral))


def perform_steady(
    motion: MarkerMotion, head: MarkedHead, mapping: MarkerMapping, markers: SteadyMarkers
) -> MarkerPerformance:
    """Return a head moved by a capture with steady markers. mapping: checked for the head."""
    kept = mapping.centres
    placed = [n for n, name in enumerate(markers.names) if name in kept]
    vertices = [kept[markers.names[n]].vertex for n in placed]
    centres = head.vertices[np.array(vertices, dtype=np.intp)]
    fit = lay_onto(markers.neutral[placed], centres)
    if np.linalg.det(fit.rotation) < 0:
        warn("the capture is mirrored: x is turned round", stacklevel=3)
    scale = _measure_scale(head, mapping, markers, float(fit.scale))
    turn = fit.rotation  # from the capture's axes to the head's
    local = np.einsum("ij,tkj->tki", scale * turn, markers.local - markers.neutral)
    columns = {name: n for n, name in enumerate(markers.names)}
    displacements = np.zeros((len(motion), len(kept), 3))
    for n, (name, marker) in enumerate(kept.items()):
        source = marker.follows or name
        if not marker.fixed and source in columns:  # a marker that was left out stays in place
            opening = 1 - mapping.squint if marker.lid else 1.0
            displacements[:, n] = opening * marker.share * local[:, columns[source]]
    # the head moves about the point onto which the middle of the neutral markers is laid
    middle, there = markers.neutral[placed].mean(axis=0), centres.mean(axis=0)
    rotation = turn @ markers.rotation @ turn.T
    from_middle = np.einsum("tij,j->ti", markers.rotation, middle) + markers.shift - middle
    shift = there - np.einsum("tij,j->ti", rotation, there) + scale * from_middle @ turn.T
    cloud = np.einsum("ij,tkj->tki", scale * turn, motion.positions - middle) + there
    return MarkerPerformance(
        head, mapping, motion.rate, motion.times, displacements, rotation, shift, scale, cloud,
        find_weights(head, mapping), _find_rest(head, mapping.squint), _find_looking(head, mapping.gaze),
        turn_to_camera(rotation),
    )  # fmt: skip


def _find_rest(head: MarkedHead, squint: float) -> Float64:
    return head.vertices + narrow(head, squint) if squint else head.vertices


def _find_looking(head: MarkedHead, gaze: Gaze) -> tuple[Eye, ...]:
    """Return the eyes that look at the camera; none if they stay in the head."""
    eyes = find_eyes(head) if gaze == "camera" else ()
    if gaze == "camera" and not eyes:
        raise ModelError(
            f"{head.name} has no eyes that could look at the camera: none of its parts is of the kind eye. "
            "Give a face model, or leave out the gaze"
        )
    return eyes


def _measure_scale(head: MarkedHead, mapping: MarkerMapping, markers: SteadyMarkers, usual: float) -> float:
    """Return the head's units per metre of the capture, by two fixed markers. usual: that by all markers."""
    pair = [name for name in mapping.scale if name in markers.names]
    if len(pair) < 2:
        pair = list(_farthest_fixed(head, mapping, markers))
    captured = [markers.neutral[markers.names.index(name)] for name in pair]
    placed = [head.vertices[mapping.markers[name].vertex or 0] for name in pair]
    apart, wanted = (float(np.linalg.norm(a - b)) for a, b in (captured, placed))
    for length, points, what, unit in (
        (apart, markers.neutral, "markers", " m in the capture"),
        (wanted, head.vertices, "vertices", f" on {head.name}"),
    ):
        if not length > MIN_DISTANCE * float(np.ptp(points, axis=0).max()):
            raise ModelError(
                f"the {what} of {pair[0]!r} and {pair[1]!r}, which tell the scale, are at one place "
                f"({length:.3g}{unit} apart): choose two fixed markers far from each other"
            )
    scale = wanted / apart
    if not 1 / MAX_SCALE_RATIO < scale / usual < MAX_SCALE_RATIO:
        warn(
            f"by {pair[0]} and {pair[1]} the head is {scale:.3g} times as large as the actor's, by all "
            f"markers {usual:.3g} times: are they where the mapping says?",
            stacklevel=4,
        )
    return scale


def _farthest_fixed(head: MarkedHead, mapping: MarkerMapping, markers: SteadyMarkers) -> tuple[str, str]:
    """Return the two fixed markers whose vertices are farthest apart."""
    names = [name for name in mapping.fixed if name in markers.names and name in mapping.centres]
    if len(names) < 2:
        raise ModelError(
            f"the scale needs two fixed markers with a vertex; the mapping has {len(names)}: give a fixed "
            "one a vertex"
        )
    places = head.vertices[[mapping.markers[name].vertex or 0 for name in names]]
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    one, other = divmod(int(apart.argmax()), len(names))
    return names[one], names[other]
