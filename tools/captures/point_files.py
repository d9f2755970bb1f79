"""Files of tracked points in the layouts that programs write, from known points."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from typing import Any

import numpy as np

from fba.arrays import Float64
from fba.capture import PointMotion


def _row(values: Float64) -> str:
    return ",".join("" if np.isnan(value) else f"{value:.9g}" for value in values.ravel().tolist())


def wide(motion: PointMotion, *, name: str = "{axis}_{number}", header: bool = True) -> bytes:
    """Return a table with a column for each coordinate. name: of columns; header: whether it has names."""
    axes = "xyz"[: motion.positions.shape[2]]
    names = [name.format(axis=axis, number=number) for number in range(motion.count) for axis in axes]
    lines = [",".join(["frame", "timestamp", *names])] if header else []
    for number, (time, points) in enumerate(zip(motion.times.tolist(), motion.positions, strict=True)):
        start = f"{number},{time:.6f}," if header else ""
        lines.append(start + _row(points))
    return ("\n".join(lines) + "\n").encode()


def numbered(motion: PointMotion) -> bytes:
    """Return a table whose columns are numbers, as pandas writes it."""
    body = [f"{number},{_row(points)}" for number, points in enumerate(motion.positions)]
    return ("\n".join(["," + ",".join(map(str, range(motion.positions[0].size))), *body]) + "\n").encode()


def long(motion: PointMotion) -> bytes:
    """Return a table with a row for each point."""
    axes = "xyz"[: motion.positions.shape[2]]
    lines = [",".join(["frame", "timestamp", "landmark", *axes])]
    for number, (time, points) in enumerate(zip(motion.times.tolist(), motion.positions, strict=True)):
        lines += [f"{number},{time:.6f},{point},{_row(place)}" for point, place in enumerate(points)]
    return ("\n".join(lines) + "\n").encode()


def openface(motion: PointMotion, extra: dict[str, Float64] | None = None) -> bytes:
    """Return a table as OpenFace writes it, of points in metres: millimetres, blanks before names."""
    names = [f"{axis}_{number}" for axis in "XYZ" for number in range(motion.count)]
    extra = extra or {}
    lines = [", ".join(["frame", "face_id", "timestamp", "confidence", "success", *names, *extra])]
    for number, (time, points) in enumerate(zip(motion.times.tolist(), motion.positions, strict=True)):
        cells = _row(1000 * points.T).split(",") + [f"{values[number]:.6g}" for values in extra.values()]
        lines.append(", ".join([str(number + 1), "0", f"{time:.3f}", "0.98", "1", *cells]))
    return ("\n".join(lines) + "\n").encode()


def mediapipe_frames(motion: PointMotion) -> list[dict[str, Any]]:
    """Return frames as the JavaScript of MediaPipe gives them."""
    frames = []
    for time, points in zip(motion.times.tolist(), motion.positions, strict=True):
        face = [dict(zip("xyz", place, strict=True)) for place in points.tolist()]
        frames.append({"timestampMs": 1000 * time, "faceLandmarks": [face]})
    return frames


def openpose_frames(motion: PointMotion, confidence: float = 0.9) -> list[dict[str, Any]]:
    """Return frames as OpenPose writes them, one in a file: x, y, confidence, one after another."""
    sure = np.full((motion.count, 1), confidence)
    return [
        {"version": 1.3, "people": [
            {"person_id": [-1], "pose_keypoints_2d": [0.0] * 75,
             "face_keypoints_2d": np.concatenate([points[:, :2], sure], axis=1).ravel().tolist()},
        ]}
        for points in motion.positions
    ]  # fmt: skip


def lines(frames: list[Any]) -> bytes:
    """Return frames as JSON, one on each line."""
    return "\n".join(json.dumps(frame) for frame in frames).encode()


def arrays(motion: PointMotion, **others: Any) -> bytes:
    """Return an archive of arrays: `landmarks`, and others by name."""
    return archive({"landmarks": motion.positions, **others})


def archive(arrays: dict[str, Any]) -> bytes:
    """Return an .npz of arrays whose bytes depend on nothing else.

    Those of `np.savez` depend on Python: since 3.11.4 `zipfile` leaves out a field that is asked for in vain.
    """
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as members:
        for name, values in arrays.items():
            member = io.BytesIO()
            np.save(member, values)
            info = zipfile.ZipInfo(f"{name}.npy", (1980, 1, 1, 0, 0, 0))
            info.create_system = 3  # Unix, everywhere
            members.writestr(info, member.getvalue())
    return file.getvalue()


def array(motion: PointMotion) -> bytes:
    """Return the points as one array, float32."""
    file = io.BytesIO()
    np.save(file, motion.positions.astype(np.float32))
    return file.getvalue()


LAYOUTS: dict[str, Callable[[PointMotion], bytes]] = {
    "wide.csv": wide,
    "axis-last.csv": lambda motion: wide(motion, name="landmark_{number}_{axis}"),
    "face-first.csv": lambda motion: wide(motion, name="face_{number}_{axis}"),
    "tight.csv": lambda motion: wide(motion, name="{axis}{number}"),
    "headless.csv": lambda motion: wide(motion, header=False),
    "numbered.csv": numbered,
    "long.csv": long,
    "mediapipe.json": lambda motion: json.dumps(mediapipe_frames(motion)).encode(),
    "mediapipe.jsonl": lambda motion: lines(mediapipe_frames(motion)),
    "lists.json": lambda motion: json.dumps(motion.positions.tolist()).encode(),
    "object.json": lambda motion: json.dumps(
        {"fps": float(motion.rate), "frames": [{"landmarks": one} for one in motion.positions.tolist()]}
    ).encode(),
    "by-frame.json": lambda motion: json.dumps(
        {str(number): one for number, one in enumerate(motion.positions.tolist())}
    ).encode(),
    "points.npz": lambda motion: arrays(motion, fps=float(motion.rate)),
    "points.npy": array,
}
"""Layouts of points with and without depth, by the name of a file."""
