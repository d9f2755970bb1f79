"""An actor in front of a camera, and the points of the face as trackers see them in the pictures.

A face model is moved by known FAPs and a moving head: 68 (iBUG), 70 (with pupils), 468 and 478 (MediaPipe).

`film` makes a take. Points that a tracker has between feature points lie on curves through these, and those
that nothing is measured from are somewhere on the head. A camera far away (`distance=None`) sees heads
without perspective, as trackers take them to be.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fba.arrays import Float64
from fba.capture import PointMotion
from fba.face import Deformer, FaceModel
from fba.parameters import point_rows
from tools.captures.performances import head_motion, speech

Spot = tuple[tuple[str, float], ...]
"""Feature points, and their shares in a point."""
TO_CAMERA = np.array([1.0, -1.0, -1.0])
"""From left, up, front of a face that looks into the camera to right, down, away in the picture."""
GAZE = (23, 24, 25, 26)
FOCAL = 1.2
"""Focal length of the camera in widths of its picture."""
FAR = 0.9
"""Metres from the camera at which a face is as large as it is in the pictures."""


def _between(first: str, middle: str, last: str) -> tuple[Spot, Spot]:
    """Points a third and two thirds of the way on a curve through three feature points."""
    near, far = 2 / 9, -1 / 9
    return (((first, near), (middle, 8 / 9), (last, far)), ((first, far), (middle, 8 / 9), (last, near)))


def _spots_68() -> dict[int, Spot]:
    names = {
        36: "3.12", 39: "3.8", 42: "3.11", 45: "3.7", 33: "9.15", 30: "9.3", 35: "9.1", 31: "9.2",
        22: "4.1", 24: "4.3", 26: "4.5", 21: "4.2", 19: "4.4", 17: "4.6",
        48: "8.4", 51: "8.1", 54: "8.3", 57: "8.2",
        60: "2.5", 61: "2.7", 62: "2.2", 63: "2.6", 64: "2.4", 65: "2.8", 66: "2.3", 67: "2.9", 8: "2.1",
    }  # fmt: skip
    spots: dict[int, Spot] = {number: ((name, 1.0),) for number, name in names.items()}
    spots[27] = (("3.8", 0.3), ("3.11", 0.3), ("9.12", 0.4))
    spots[28] = (("3.8", 0.1), ("3.11", 0.1), ("9.12", 0.8))
    spots[29] = (("9.12", 0.6), ("9.3", 0.4))
    for pair, through in {
        (37, 38): ("3.12", "3.2", "3.8"), (41, 40): ("3.12", "3.4", "3.8"),
        (43, 44): ("3.11", "3.1", "3.7"), (47, 46): ("3.11", "3.3", "3.7"),
        (49, 50): ("8.4", "8.6", "8.1"), (52, 53): ("8.1", "8.5", "8.3"),
        (59, 58): ("8.4", "8.8", "8.2"), (56, 55): ("8.2", "8.7", "8.3"),
    }.items():  # fmt: skip
        spots |= dict(zip(pair, _between(*through), strict=True))
    return spots


def _spots_478() -> dict[int, Spot]:
    names = {
        33: "3.12", 133: "3.8", 362: "3.11", 263: "3.7", 4: "9.3", 2: "9.15", 358: "9.1", 129: "9.2",
        386: "3.1", 374: "3.3", 159: "3.2", 145: "3.4", 10: "11.1", 127: "10.10", 356: "10.9",
        0: "8.1", 17: "8.2", 291: "8.3", 61: "8.4", 269: "8.5", 39: "8.6", 405: "8.7", 181: "8.8",
        13: "2.2", 14: "2.3", 308: "2.4", 78: "2.5", 311: "2.6", 81: "2.7", 402: "2.8", 178: "2.9",
        152: "2.1", 199: "2.10", 280: "5.3", 50: "5.4", 473: "3.5", 468: "3.6",
        336: "4.1", 285: "4.1", 334: "4.3", 282: "4.3", 300: "4.5", 276: "4.5",
        107: "4.2", 55: "4.2", 105: "4.4", 52: "4.4", 70: "4.6", 46: "4.6",
    }  # fmt: skip
    spots: dict[int, Spot] = {number: ((name, 1.0),) for number, name in names.items()}
    spots[168] = (("3.8", 0.4), ("3.11", 0.4), ("9.12", 0.2))
    spots[6] = (("3.8", 0.2), ("3.11", 0.2), ("9.12", 0.6))
    spots[195] = (("9.12", 0.8), ("9.3", 0.2))
    spots[197] = (("3.8", 0.1), ("3.11", 0.1), ("9.12", 0.8))
    spots[234], spots[454] = (("10.8", 0.5), ("10.10", 0.5)), (("10.7", 0.5), ("10.9", 0.5))
    return spots


def spots(count: int) -> dict[int, Spot]:
    """Return what each point of a tracker is, for those that are anything."""
    if count in (68, 70):
        pupils: dict[int, Spot] = {68: (("3.6", 1.0),), 69: (("3.5", 1.0),)}
        return _spots_68() | (pupils if count == 70 else {})
    return {number: spot for number, spot in _spots_478().items() if number < count}


@dataclass(frozen=True, eq=False)
class PointTake:
    """A take whose truth is known. faps: float64 (T, 68). motion: what the tracker saw."""

    motion: PointMotion
    faps: Float64


def film(
    model: FaceModel,
    count: int,
    *,
    frames: int = 240,
    rate: int = 30,
    seed: int = 1,
    flat: bool = False,
    share: bool = False,
    metric: bool = False,
    aspect: float = 16 / 9,
    distance: float | None = None,
    without: tuple[int, ...] = (),
    turn: float = 1.0,
    performed: Float64 | None = None,
) -> PointTake:
    """Return a take of an actor with this face.

    performed: FAPs (T, 68) at `rate`; None for `frames` of a face that talks. Head and eyes turn in any case.
    flat: without depth. share: in shares of a picture of this aspect, otherwise in its pixels (1280 to its
    width); metric: in metres before the camera. distance: of the camera with perspective, metres; None for
    one far away. without: FAPs that stay 0. turn: how far the head turns, 1 for 26 degrees to a side.
    performed: (T, 68), FAPs that the actor performs; None for what `speech` makes up.
    """
    faps = speech(frames, rate, seed) if performed is None else performed.copy()
    frames = len(faps)
    angles, path = head_motion(frames, rate, seed + 1)
    faps[:, 47:50] = turn * angles / 1e-5
    times = np.arange(frames) / rate
    start = np.clip((times - 0.3) / 0.5, 0, 1)
    faps[:, [fap - 1 for fap in GAZE[:2]]] = (25_000 * start * np.sin(1.7 * times))[:, None]
    faps[:, [fap - 1 for fap in GAZE[2:]]] = (12_000 * start * np.sin(2.9 * times))[:, None]
    faps[:, [fap - 1 for fap in without]] = 0.0
    points = Deformer(model).feature_points(faps).astype(np.float64) + path[:, None]
    rows = point_rows()
    world = np.repeat(points[:, None, rows["7.1"]], count, axis=1)
    for number, spot in spots(count).items():
        world[:, number] = sum(points[:, rows[name]] * part for name, part in spot)
    world *= TO_CAMERA
    if metric:
        world[..., 2] += FAR
        motion = PointMotion(world, times, Fraction(rate), metric=True, name="talk")
        return PointTake(motion, faps)
    away = FAR if distance is None else world[..., 2:] + distance
    picture = FOCAL * world / away + (0.5, 0.5 / aspect, 0.0)
    picture *= (1.0, aspect, 1.0) if share else 1280.0
    picture = picture[..., :2] if flat else picture
    return PointTake(PointMotion(picture, times, Fraction(rate), share=share, name="talk"), faps)
