"""Moves a face of feature points alone by FAPs.

Every low-level FAP moves its own points by value x FAPU in the standard's direction. The jaw turns about a
hinge below the ears, eyeballs and head about their centres, and points without a FAP of their own follow
their neighbours (`followers.csv`), so that curves drawn through the points stay smooth.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Float64
from fba.errors import ModelError
from fba.face.fapu import PER_DISTANCE, Fapu
from fba.face.feature_points import MIRRORED, names, neutral_points
from fba.parameters import FAP_COUNT, faps, point_rows
from fba.rotations import axis_matrices
from fba.text_files import packaged_rows

DIRECTIONS = {
    "left": (1.0, 0.0, 0.0),
    "right": (-1.0, 0.0, 0.0),
    "up": (0.0, 1.0, 0.0),
    "down": (0.0, -1.0, 0.0),
    "forward": (0.0, 0.0, 1.0),
}
"""The standard's words for a positive motion, as vectors."""

OPEN_JAW = 3
THRUST_JAW = 14
SHIFT_JAW = 15
YAW_EYE = (23, 24)
PITCH_EYE = (25, 26)
DILATE_PUPIL = (29, 30)
THRUST_EYE = {27: "3.5", 28: "3.6"}
"""Feature point of each eyeball, by the FAP that moves it forward."""
TONGUE_ROLL = 47
HEAD_PITCH = 48
HEAD_YAW = 49
HEAD_ROLL = 50
ROTATING = {OPEN_JAW, *YAW_EYE, *PITCH_EYE, *DILATE_PUPIL, TONGUE_ROLL, HEAD_PITCH, HEAD_YAW, HEAD_ROLL}
"""FAPs that rotate or scale; `shift_table` leaves them out."""

MANDIBLE = ("2.1", "2.10", "2.11", "2.12", "2.13", "2.14", "9.9", "9.11", "6.1", "6.2", "6.3", "6.4")
"""Points that move with the lower jaw. The lips have FAPs of their own and stay."""
EYEBALL_PER_IRIS = 1.03
"""Ratio of an eyeball's radius to the diameter of its iris: 12 mm to 11.7 mm in adults."""


@cache
def _followers() -> tuple[tuple[int, int, Float64], ...]:
    """Return each follower's row, the row that it follows, and its (3,) share of each coordinate."""
    followers = []
    for row in packaged_rows(__package__, "followers.csv"):
        weight = np.array([float(row[axis]) for axis in "xyz"])
        point, source = row["point"], row["source"]
        followers.append((point_rows()[point], point_rows()[source], weight))
        if point in MIRRORED:
            followers.append(
                (point_rows()[MIRRORED[point]], point_rows()[MIRRORED.get(source, source)], weight)
            )
    return tuple(followers)


def shift_table(fapu: Fapu) -> Float64:
    """Return (68, 84, 3) shifts of feature points by one step of each FAP; 0 for those that turn or scale."""
    table = np.zeros((FAP_COUNT, len(names()), 3))
    for fap in faps():
        if fap.positive not in DIRECTIONS or fap.number in ROTATING:
            continue
        step = np.array(DIRECTIONS[fap.positive]) * fapu[fap.unit]
        points = MANDIBLE if fap.number in (THRUST_JAW, SHIFT_JAW) else fap.feature_points
        if fap.number in THRUST_EYE:
            points = (THRUST_EYE[fap.number],)
        for name in points:
            table[fap.number - 1, point_rows()[name]] += step
    own = table.copy()
    for point, source, weight in _followers():
        table[:, point] += own[:, source] * weight
    return table


@dataclass(frozen=True, eq=False)
class Eyeballs:
    """Centres (T, 2, 3), gaze (unit) and pupils (T, 2) of the eyeballs, left first, in the head's frame."""

    centres: Float64
    gaze: Float64
    pupils: Float64


class FeaturePointFace:
    """A face of 84 feature points; calling it with FAPs gives the moved points.

    points: (84, 3) neutral feature points, +x the subject's left, +y up, +z forward, any unit of
    length; by default those of an adult head in metres. Raises ModelError where they are not finite or
    give no FAPU.
    """

    def __init__(self, points: npt.ArrayLike | None = None) -> None:
        self.points: Float64 = np.array(neutral_points() if points is None else points, dtype=np.float64)
        self.fapu = Fapu.measure(self.points)
        if not np.isfinite(self.points).all():
            unknown = [n for n, p in zip(names(), self.points, strict=True) if not np.isfinite(p).all()]
            raise ModelError(f"feature points without a finite position: {', '.join(unknown)}")

    @cached_property
    def eyeball_radius(self) -> float:
        """Radius of each eyeball, from the diameter of its iris."""
        return EYEBALL_PER_IRIS * self.fapu.IRISD * PER_DISTANCE

    @cached_property
    def eyeball_centres(self) -> Float64:
        """(2, 3) centres of the eyeballs in the neutral face, the left one first."""
        pupils: Float64 = self.points[[point_rows()["3.5"], point_rows()["3.6"]]]
        return pupils - (0.0, 0.0, self.eyeball_radius)

    @cached_property
    def head_centre(self) -> Float64:
        """(3,) centre of the head's rotations."""
        return np.asarray(self.points[point_rows()["7.1"]])

    @cached_property
    def jaw_hinge(self) -> Float64:
        """(3,) a point on the axis of the jaw, below the ears."""
        top, bottom = (
            self.points[[point_rows()["10.7"], point_rows()["10.8"]]],
            self.points[point_rows()["10.9"]],
        )
        ear = (top[0] + top[1] + bottom * 2) / 4
        return np.array([0.0, ear[1], ear[2]])

    @cached_property
    def _shift(self) -> Float64:
        return shift_table(self.fapu).reshape(FAP_COUNT, -1)

    def __call__(self, faps: npt.ArrayLike) -> Float32:
        """Return the moved feature points: (68,) -> (84, 3), or (T, 68) -> (T, 84, 3), float32.

        Values as `resolve` gives them, in the units of the standard; columns 0 and 1 are ignored.
        Raises ValueError on another shape.
        """
        values, single = _as_frames(faps)
        moved = self._local(values)
        rotated = (moved - self.head_centre) @ _head_matrices(values).swapaxes(1, 2) + self.head_centre
        return (rotated[0] if single else rotated).astype(np.float32)

    def local(self, faps: npt.ArrayLike) -> Float32:
        """Return what calling gives, but in the frame of the head: without head pitch, yaw and roll."""
        values, single = _as_frames(faps)
        moved = self._local(values)
        return (moved[0] if single else moved).astype(np.float32)

    def head_rotation(self, faps: npt.ArrayLike) -> Float64:
        """Return the rotation of the head about its centre (point 7.1): (3, 3), or (T, 3, 3), float64."""
        values, single = _as_frames(faps)
        matrices = _head_matrices(values)
        return matrices[0] if single else matrices

    def eyeballs(self, faps: npt.ArrayLike) -> Eyeballs:
        """Return the centres, gaze and pupils of the two eyes, (T, 2, ...)."""
        values, _ = _as_frames(faps)
        yaw, pitch, dilation = (
            values[:, [n - 1 for n in pair]] for pair in (YAW_EYE, PITCH_EYE, DILATE_PUPIL)
        )
        yaw, pitch = yaw * self.fapu.AU, pitch * self.fapu.AU
        gaze = np.stack([np.sin(yaw) * np.cos(pitch), -np.sin(pitch), np.cos(yaw) * np.cos(pitch)], axis=-1)
        centres = np.repeat(self.eyeball_centres[None], len(values), axis=0)
        centres[..., 2] += values[:, 26:28] * self.fapu.ES
        pupils = self.fapu.IRISD * (PER_DISTANCE / 3 + dilation)
        return Eyeballs(centres, gaze, np.maximum(pupils, 0.0))

    def _local(self, values: Float64) -> Float64:
        shift = (values @ self._shift).reshape(len(values), -1, 3)
        moved = self.points + shift
        row = point_rows()
        mandible = [row[name] for name in MANDIBLE]
        moved[:, mandible] = _rotate_x(self.points[mandible], self.jaw_hinge, self._jaw_angle(values))
        moved[:, mandible] += shift[:, mandible]
        eyes = self.eyeballs(values)
        pupils = [row["3.5"], row["3.6"]]
        moved[:, pupils] = eyes.centres + eyes.gaze * self.eyeball_radius
        roll = values[:, TONGUE_ROLL - 1] * self.fapu.AU
        for name, side in (("6.3", 1.0), ("6.4", -1.0)):
            arm = moved[:, row[name]] - moved[:, row["6.2"]]
            x, y = arm[:, 0].copy(), arm[:, 1].copy()
            cos, sin = np.cos(roll), side * np.sin(roll)
            moved[:, row[name], 0] += x * cos - y * sin - x
            moved[:, row[name], 1] += x * sin + y * cos - y
        return moved

    def _jaw_angle(self, values: Float64) -> Float64:
        """Return the angle that lowers the chin (2.1) by exactly value x MNS, as far as the hinge allows."""
        chin = self.points[point_rows()["2.1"]] - self.jaw_hinge
        radius, rest = np.hypot(chin[1], chin[2]), np.arctan2(chin[1], chin[2])
        height = chin[1] - values[:, OPEN_JAW - 1] * self.fapu.MNS
        return np.asarray(rest - np.arcsin(np.clip(height / radius, -1.0, 1.0)))


def _as_frames(faps: npt.ArrayLike) -> tuple[Float64, bool]:
    values = np.asarray(faps, dtype=np.float64)
    single = values.ndim == 1
    if single:
        values = values[None]
    if values.ndim != 2 or values.shape[1] != FAP_COUNT:
        raise ValueError(f"FAPs must have shape ({FAP_COUNT},) or (T, {FAP_COUNT}), not {np.shape(faps)}")
    return values, single


def _rotate_x(points: Float64, centre: Float64, angle: Float64) -> Float64:
    """Return (T, N, 3): points (N, 3) turned about an axis along x by angles (T,); positive lowers +z."""
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    y, z = points[:, 1] - centre[1], points[:, 2] - centre[2]
    x = np.broadcast_to(points[:, 0], (len(angle), len(points)))
    return np.stack([x, centre[1] + y * cos - z * sin, centre[2] + y * sin + z * cos], axis=-1)


def _head_matrices(values: Float64) -> Float64:
    """Return (T, 3, 3): yaw . roll . pitch, the order of the spine's joints; each angle FAP x 1e-5 rad."""
    pitch, yaw, roll = (values[:, n - 1] * 1e-5 for n in (HEAD_PITCH, HEAD_YAW, HEAD_ROLL))
    return axis_matrices(1, yaw) @ axis_matrices(2, roll) @ axis_matrices(0, pitch)
