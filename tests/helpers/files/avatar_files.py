"""Avatar animation units and their containers as other programs write them, put together by hand."""

import json
import struct
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from fba.capture import SkeletonMotion


def unit(kind: int, content: bytes, ticks: int = 0) -> bytes:
    """Return a unit as the standard lays it out, put together by hand."""
    return bytes([kind * 2]) + struct.pack(">II", 4 + len(content), ticks) + content


def configuration(profile: str = "arf-face-v1", timescale: float = 30.0) -> bytes:
    return unit(0, bytes([len(profile)]) + profile.encode() + struct.pack(">f", timescale))


def weights(ticks: int, listed: Mapping[int, float], *, flags: int = 0, set_number: int = 0) -> bytes:
    """Return a unit of weights; with the flag 128, with confidences."""
    content = struct.pack(">HBH", set_number, flags, len(listed) - 1)
    for number, weight in listed.items():
        content += struct.pack(">Hf", number, weight) + (struct.pack(">f", 0.5) if flags & 128 else b"")
    return unit(1, content, ticks)


def joints(ticks: int, matrices: np.ndarray, *, velocities: bool = False) -> bytes:
    """Return a unit of matrices (N, 4, 4)."""
    content = struct.pack(">HBH", 0, 128 if velocities else 0, len(matrices) - 1)
    for number, matrix in enumerate(matrices):
        content += struct.pack(">H16f", number, *matrix.ravel()) + bytes(64 if velocities else 0)
    return unit(2, content, ticks)


def container(
    path: Path,
    motion: SkeletonMotion,
    *,
    seed: int,
    bind: bool = True,
    faces: bool = False,
    change: Callable[[Any], None] | None = None,
) -> Path:
    """Write a motion as others do: centimetres, joints with axes of their own, children before parents at
    times, matrices that are scaled, and names in arf.json."""
    random = np.random.default_rng(seed)
    count = len(motion.names)
    axes = Rotation.from_quat(random.normal(size=(count, 4))).as_matrix()
    turned, placed = motion.world()
    world = np.zeros((len(motion), count, 4, 4))
    world[..., 3, 3] = 1
    world[..., :3, :3] = (
        Rotation.from_quat(np.roll(turned, -1, axis=2).reshape(-1, 4)).as_matrix().reshape(-1, count, 3, 3)
        @ axes
    )
    world[..., :3, 3] = placed * 100
    rest = np.zeros((count, 4, 4))
    rest[:, 3, 3] = 1
    rest[:, :3, :3] = axes
    rest[:, :3, 3] = motion.rest() * 100
    local = world.copy()
    resting = rest.copy()
    for joint, parent in enumerate(motion.parents):
        if parent >= 0:
            local[:, joint] = np.linalg.inv(world[:, parent]) @ world[:, joint]
            resting[joint] = np.linalg.inv(rest[parent]) @ rest[joint]
    order = np.concatenate([[0], 1 + random.permutation(count - 1)])
    place = np.argsort(order)
    nodes = []
    for number, joint in enumerate(order):
        node: dict[str, Any] = {"id": number, "name": motion.names[joint], "mapping": motion.names[joint]}
        if motion.parents[joint] >= 0:
            node["parent"] = int(place[motion.parents[joint]])
        node["translation"] = resting[joint, :3, 3].round(6).tolist()
        node["rotation"] = (
            Rotation.from_matrix(resting[joint, :3, :3]).as_quat(canonical=True).round(6).tolist()
        )
        nodes.append(node)
    document: dict[str, Any] = {
        "preamble": {"signature": "ARF", "version": "1.0", "supportedAnimations": ["arf-body-v1"]},
        "metadata": {"name": "somebody", "id": "1"},
        "structure": {"assets": []},
        "components": {
            "nodes": nodes,
            "skeletons": [{"id": 0, "name": "s", "root": 0, "joints": list(range(count))}],
            "blendshapeSets": [{"id": 0, "name": "f", "shapes": [1, 2]}] if faces else [],
        },
        "data": [
            {"id": 0, "name": "inverse", "uri": "data/inverse.bin", "type": "application/mpeg.arf.dense"},
            {"id": 1, "name": "JawOpen", "uri": "data/1.glb"},
            {"id": 2, "name": "", "uri": "data/mouthSmile_L.glb"},
        ],
    }
    if bind:
        document["components"]["skeletons"][0]["inverseBindMatrix"] = 0
    if change is not None:
        change(document)
    inverse = np.linalg.inv(rest[order]).round(6).astype("<f4")
    stream = configuration("arf-body-v1", float(motion.rate)) + b"".join(
        joints(frame, local[frame, order].round(6), velocities=frame % 3 == 0) for frame in range(len(motion))
    )
    members: dict[str, str | bytes] = {
        "arf.json": json.dumps(document),
        "data/inverse.bin": struct.pack("<4i", 2, count, 16, 5126) + inverse.tobytes(),
        "animations/joints.bin": stream,
    }
    if faces:
        rows = (weights(frame, {0: frame / len(motion), 1: 0.5}) for frame in range(len(motion)))
        members["animations/face.bin"] = configuration("arf-face-v1", float(motion.rate)) + b"".join(rows)
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(zipfile.ZipInfo(name, (2026, 1, 1, 0, 0, 0)), content)
    return path
