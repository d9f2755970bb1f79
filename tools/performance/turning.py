"""Rotations over time, as `scipy.spatial.transform.Rotation`: +x the subject's left, +y up, +z forward."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation, Slerp

from performance.curves import moments, pairs, smooth

Float = npt.NDArray[np.float64]


def oriented(yaw: Float, roll: Float, pitch: Float) -> Rotation:
    """Degrees (T,): yaw to the left, roll to the right, pitch forward; pitch innermost."""
    return Rotation.from_euler("YZX", np.stack(np.broadcast_arrays(yaw, roll, pitch), axis=-1), degrees=True)


def about(axis: tuple[float, float, float], degrees: Float) -> Rotation:
    """Turns (T,) about one axis."""
    unit = np.array(axis) / np.linalg.norm(axis)
    return Rotation.from_rotvec(unit * np.asarray(degrees)[..., None], degrees=True)


def frame(bone: Float, second: Float) -> Float:
    """(..., 3, 3): columns along the bone, along what is left of `second` across it, and across both."""
    along = bone / np.linalg.norm(bone, axis=-1, keepdims=True)
    across = second - along * np.sum(second * along, axis=-1, keepdims=True)
    across = across / np.linalg.norm(across, axis=-1, keepdims=True)
    return np.stack([along, across, np.cross(along, across)], axis=-1)


def pointing(rest: tuple[Float, Float], wanted: tuple[Float, Float]) -> Rotation:
    """What takes a bone and a second direction at rest to those wanted (..., 3)."""
    return Rotation.from_matrix(frame(*wanted) @ frame(*rest).T)


def between(first: Rotation, second: Rotation, share: float) -> Rotation:
    """Part of the way, at each moment."""
    return first * Rotation.from_rotvec((first.inv() * second).as_rotvec() * share)


def passing(schedule: str, poses: dict[str, Rotation], softness: float) -> Rotation:
    """Through poses like "0:rest 1:wave": evenly from one to the next, then rounded to arcs in time."""
    times, names = pairs(schedule)
    stops = Rotation.concatenate([poses[name] for name in names])
    path = Slerp(times, stops)(np.clip(moments(), times[0], times[-1])).as_quat()
    flips = np.cumprod(np.where(np.sum(path[1:] * path[:-1], axis=1) < 0, -1.0, 1.0))
    path[1:] *= flips[:, None]
    return Rotation.from_quat(smooth(path, softness))


def weights(schedule: str, names: dict[str, Float], softness: float) -> Float:
    """(T, ...) values of named settings along a schedule, rounded in time."""
    times, stops = pairs(schedule)
    table = np.stack([names[name] for name in stops])
    flat = table.reshape(len(times), -1)
    curves = np.stack([np.interp(moments(), times, column) for column in flat.T], axis=-1)
    return smooth(curves, softness).reshape(-1, *table.shape[1:])
