"""Rotations over time, as `scipy.spatial.transform.Rotation`: +x the subject's left, +y up, +z forward."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation, Slerp

from performance.curves import parse_schedule, sample_times, smooth

Float = npt.NDArray[np.float64]


def from_yaw_roll_pitch(yaw: Float, roll: Float, pitch: Float) -> Rotation:
    """Rotations (T,) from degrees (T,): yaw to the left, roll to the right, pitch forward (innermost)."""
    return Rotation.from_euler("YZX", np.stack(np.broadcast_arrays(yaw, roll, pitch), axis=-1), degrees=True)


def rotation_about(axis: tuple[float, float, float], degrees: Float) -> Rotation:
    """Rotations (T,) about one axis by degrees (T,)."""
    unit = np.array(axis) / np.linalg.norm(axis)
    return Rotation.from_rotvec(unit * np.asarray(degrees)[..., None], degrees=True)


def orthonormal_frame(bone: Float, second: Float) -> Float:
    """(..., 3, 3) with columns along the bone, along `second` made perpendicular to it, and across both."""
    along = bone / np.linalg.norm(bone, axis=-1, keepdims=True)
    across = second - along * np.sum(second * along, axis=-1, keepdims=True)
    across = across / np.linalg.norm(across, axis=-1, keepdims=True)
    return np.stack([along, across, np.cross(along, across)], axis=-1)


def rotation_between_directions(rest: tuple[Float, Float], wanted: tuple[Float, Float]) -> Rotation:
    """Rotations that take a bone and a second direction at rest to those wanted (..., 3)."""
    return Rotation.from_matrix(orthonormal_frame(*wanted) @ orthonormal_frame(*rest).T)


def interpolate(first: Rotation, second: Rotation, share: float) -> Rotation:
    """Rotations (T,) a share of the way from the first to the second."""
    return first * Rotation.from_rotvec((first.inv() * second).as_rotvec() * share)


def follow_poses(schedule: str, poses: dict[str, Rotation], softness: float) -> Rotation:
    """Rotations (T,) through a schedule of poses like "0:rest 1:wave": evenly, then smoothed in time."""
    times, names = parse_schedule(schedule)
    stops = Rotation.concatenate([poses[name] for name in names])
    path = Slerp(times, stops)(np.clip(sample_times(), times[0], times[-1])).as_quat()
    flips = np.cumprod(np.where(np.sum(path[1:] * path[:-1], axis=1) < 0, -1.0, 1.0))
    path[1:] *= flips[:, None]
    return Rotation.from_quat(smooth(path, softness))


def follow_values(schedule: str, names: dict[str, Float], softness: float) -> Float:
    """(T, ...) values of named settings along a schedule, smoothed in time."""
    times, stops = parse_schedule(schedule)
    table = np.stack([names[name] for name in stops])
    flat = table.reshape(len(times), -1)
    curves = np.stack([np.interp(sample_times(), times, column) for column in flat.T], axis=-1)
    return smooth(curves, softness).reshape(-1, *table.shape[1:])
