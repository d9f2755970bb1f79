"""Read motion of SMPL's family of body models as AMASS saves it (.npz): SMPL, SMPL-H, SMPL-X.

Poses are turns of joints as rotation vectors. The places of the joints depend on a body model that may not
be passed on, so a skeleton of average proportions stands in for it (`joints.csv`). In AMASS z points up, in
other files y: upright people tell.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from fba.animation import FaceTrack
from fba.arrays import Float64
from fba.capture import SkeletonMotion
from fba.capture.blendshapes.combination import JAW_OPEN
from fba.capture.blendshapes.conversion import convert_rows
from fba.errors import FormatError, Remedy
from fba.formats.text.frame_rates import Rate
from fba.formats.zip_files import ZIP, read_arrays
from fba.limits import DEFAULT_LIMITS, Limits
from fba.sampling import find_rate, interpolate
from fba.source import Path, naming_file, stem_of
from fba.text_files import packaged_rows

RATES = ("mocap_frame_rate", "mocap_framerate", "fps")
PARTS = ("poses", "root_orient", "pose_body")
NAMES = (*PARTS, "mocap_framerate", "mocap_frame_rate", "surface_model_type")
BODY = 22
"""Joints of the body itself, which come first."""
FINGERS = 30
"""Joints of the fingers."""
SMPL, SMPL_H, SMPL_X = 72, 156, 165
"""Numbers of a pose: 24 joints, 52 with fingers, 55 with jaw and eyes as well."""
MIN_FRAME_RATE = 0.1
"""Lowest rate, in frames per second; a lower rate is damage."""
MAX_FRAME_RATE = 10_000
"""Highest rate, in frames per second; a higher rate is damage."""
MAX_TURN = 1000.0
"""Largest number of a rotation vector, radians; more is damage."""
MAX_COORDINATE = 1e6
"""Largest coordinate of the root's path, metres; more is damage."""
MIN_UPRIGHT = 0.6
"""Smallest share of the mean direction of heads along an axis for that axis to be up."""


class _Motion(NamedTuple):
    """Turns of joints (T, J, 3), path (T, 3), turns of the jaw (T, 3) and of the eyes (T, 2, 3); the rate."""

    turns: Float64
    path: Float64
    jaw: Float64 | None
    eyes: Float64 | None
    rate: Fraction


def sniff(head: bytes, suffix: str) -> bool:
    """Whether a file with this beginning is an archive with arrays as AMASS names them."""
    return head.startswith(ZIP) and any(f"{name}.npy".encode() in head for name in NAMES)


def read_motion(
    path: Path, *, source_rate: Rate | None = None, limits: Limits = DEFAULT_LIMITS
) -> SkeletonMotion:
    """Return the joints as they turn in the file, y up, and jaw and eyes as a face if they move.

    source_rate: of a file without a rate. Raises FormatError, LimitError.
    """
    with naming_file(path):
        return _skeleton(_read(path, source_rate, limits), path, limits)


def _read(path: Path, source_rate: Rate | None, limits: Limits) -> _Motion:
    arrays = read_arrays(path, limits, single="poses", objects=True)
    poses, jaw, eyes = _poses(arrays, path)
    count = len(poses)
    limits.check_frames(count, f"{path}: the motion")
    path_of_root = arrays.get("trans", np.zeros((count, 3)))
    if path_of_root.shape != (count, 3):
        raise FormatError(f"trans has the shape {path_of_root.shape}, not ({count}, 3)", path=path)
    _check_sizes(path, MAX_TURN, "rad", {"poses": poses, "pose_jaw": jaw, "pose_eye": eyes})
    _check_sizes(path, MAX_COORDINATE, "m", {"trans": path_of_root})
    rate = _rate(arrays, source_rate, path)
    turns = poses.reshape(count, -1, 3)
    return _Motion(turns, path_of_root, jaw, None if eyes is None else eyes.reshape(count, 2, 3), rate)


def _check_sizes(path: Path, most: float, unit: str, arrays: Mapping[str, Float64 | None]) -> None:
    """Raise FormatError unless all numbers of arrays (T, N) lie within -most..most."""
    for name, values in arrays.items():
        if values is not None and not (within := np.abs(values) <= most).all():
            frame, column = np.argwhere(~within)[0].tolist()
            raise FormatError(
                f"frame {frame}: {name} must be finite numbers of at most {most:g} {unit}",
                path=path, token=f"{values[frame, column]:g}",
            )  # fmt: skip


def _rate(arrays: dict[str, Any], source_rate: Rate | None, path: Path) -> Fraction:
    """Return the frame rate of a file, or `source_rate` if it has none."""
    stored = next((arrays[name] for name in RATES if name in arrays and arrays[name].size == 1), None)
    if stored is None:
        if source_rate is None:
            raise FormatError("has no frame rate", path=path).with_remedies(
                Remedy("source_rate", "give one with {}", "120")
            )
        return Fraction(source_rate)
    if not MIN_FRAME_RATE <= (rate := float(stored.ravel()[0])) <= MAX_FRAME_RATE:
        what = f"its frame rate must be {MIN_FRAME_RATE} to {MAX_FRAME_RATE:g}"
        raise FormatError(what, path=path, token=f"{rate:g}")
    return find_rate(np.array([0.0, 1.0 / rate]))


def _poses(arrays: dict[str, Any], path: Path) -> tuple[Float64, Float64 | None, Float64 | None]:
    """Return turns of the body and its fingers (T, 3 J), of the jaw (T, 3), and of the eyes (T, 6)."""
    if "root_orient" in arrays and "pose_body" in arrays:
        parts = [arrays[name] for name in ("root_orient", "pose_body", "pose_hand") if name in arrays]
        if any(part.ndim != 2 or len(part) != len(parts[0]) for part in parts):
            raise FormatError("root_orient, pose_body and pose_hand differ in their frames", path=path)
        poses = np.concatenate(parts, axis=1)
        jaw, eyes = (arrays.get(name) for name in ("pose_jaw", "pose_eye"))
        widths = [one.shape for one in (jaw, eyes) if one is not None]
        if widths not in ([], [(len(poses), 3)], [(len(poses), 3), (len(poses), 6)], [(len(poses), 6)]):
            raise FormatError(f"pose_jaw, pose_eye: shapes {widths}, not (T, 3) and (T, 6)", path=path)
        if poses.shape[1] in (3 * BODY, 3 * (BODY + FINGERS)) and len(poses):
            return poses, jaw, eyes
        raise FormatError(f"its body has {poses.shape[1] / 3:g} joints; expected {BODY} or 52", path=path)
    poses = arrays.get("poses", np.zeros((0, 0)))
    if poses.ndim != 2 or not len(poses) or poses.shape[1] not in (3 * BODY, SMPL, SMPL_H, SMPL_X):
        raise FormatError(
            f"poses has the shape {poses.shape}; expected frames of {3 * BODY}, {SMPL}, {SMPL_H} or {SMPL_X} "
            "numbers, as in AMASS",
            path=path,
        )
    if poses.shape[1] == SMPL_X:
        body, jaw, eyes, hands = np.split(poses, [66, 69, 75], axis=1)
        return np.concatenate([body, hands], axis=1), jaw, eyes
    return (poses[:, : 3 * BODY] if poses.shape[1] == SMPL else poses), None, None


def _skeleton(read_in: _Motion, path: Path, limits: Limits) -> SkeletonMotion:
    """Return the motion of a skeleton of average proportions, y up."""
    count, joints = read_in.turns.shape[:2]
    table = _joints()[:joints]
    names = tuple(row[0] for row in table)
    SkeletonMotion.check_memory(limits, count, joints, f"{path}: a motion", read_in.turns.nbytes)
    turns = Rotation.from_rotvec(read_in.turns.reshape(-1, 3)).as_quat().reshape(count, joints, 4)
    turns = np.roll(turns, 1, axis=2)
    upright = _to_y_up(turns[:, 0])
    root = upright * Rotation.from_quat(np.roll(turns[:, 0], -1, axis=1))
    turns[:, 0] = np.roll(root.as_quat(), 1, axis=1)
    return SkeletonMotion(
        names, np.array([names.index(row[1]) if row[1] else -1 for row in table]),
        np.array([row[2] for row in table]), turns, upright.apply(read_in.path), read_in.rate,
        name=stem_of(path), up="+y", face=lambda times: _face(read_in, times, limits),
    )  # fmt: skip


def _to_y_up(root: Float64) -> Rotation:
    """Return the rotation that brings up to +y. root: quaternions (T, 4) of the pelvis, whose y points up."""
    heads = Rotation.from_quat(np.roll(root, -1, axis=1)).apply([0.0, 1.0, 0.0]).mean(axis=0)
    axis = int(np.abs(heads).argmax())
    if axis == 1 and heads[1] > MIN_UPRIGHT:
        return Rotation.identity()
    if axis == 1 and heads[1] < -MIN_UPRIGHT:  # the axes of a camera: y down, z away
        return Rotation.from_rotvec([np.pi, 0.0, 0.0])
    return Rotation.from_rotvec([-np.pi / 2, 0.0, 0.0])  # AMASS


def _face(read_in: _Motion, at: Float64, limits: Limits) -> FaceTrack | None:
    """Return the FAPs of jaw and eyes at times (F,), seconds; None if they do not move."""
    jaw = read_in.jaw if read_in.jaw is not None and read_in.jaw.any() else None
    eyes = read_in.eyes if read_in.eyes is not None and read_in.eyes.any() else None
    if jaw is None and eyes is None:
        return None
    times = np.arange(len(read_in.turns)) / float(read_in.rate)
    opened = np.zeros((len(times), 1)) if jaw is None else jaw[:, :1] / JAW_OPEN
    looks = None
    if eyes is not None:
        ahead = Rotation.from_rotvec(eyes.reshape(-1, 3)).apply([0.0, 0.0, 1.0]).reshape(-1, 2, 3)
        yaw = np.arctan2(ahead[..., 0], ahead[..., 2])
        pitch = np.arctan2(-ahead[..., 1], np.hypot(ahead[..., 0], ahead[..., 2]))
        looks = np.concatenate([yaw, pitch], axis=1)
    sampled = interpolate(times, [opened, *([] if looks is None else [looks])], at, limits)
    names = () if jaw is None else ("jawOpen",)
    return convert_rows(names, sampled[0][:, : len(names)], None, sampled[1] if looks is not None else None)


@cache
def _joints() -> tuple[tuple[str, str, tuple[float, float, float]], ...]:
    """Return name, parent ("" for none) and place in metres of each joint, in the order of a pose."""
    return tuple(
        (row["joint"], row["parent"], (float(row["x"]), float(row["y"]), float(row["z"])))
        for row in packaged_rows(__package__, "joints.csv")
    )
