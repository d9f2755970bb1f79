"""Joints as nodes of a glTF file, and their turns as animation samplers."""

from __future__ import annotations

from typing import Any

import numpy as np

from fba.arrays import Float32, Float64, Int64
from fba.errors import FormatError
from fba.gltf.writer import Builder
from fba.rotations import quaternions
from fba.source import Path

STILL = 1e-7
"""Numbers that change by no more do not move: less than 32-bit floats tell."""


class Clip:
    """The one animation of a file: its channels share one row of key times.

    times: float64 (T,), seconds from the first key. Raises FormatError where 32-bit floats cannot tell the
    keys apart.
    """

    def __init__(self, builder: Builder, times: Float64, path: Path) -> None:
        keys = times.astype(np.float32)
        if len(keys) > 1 and not (np.diff(keys) > np.diff(times).min() / 2).all():
            raise FormatError(
                f"the animation is {times[-1]:.0f} s long; glTF's times, 32-bit floats, do not tell its "
                "frames apart; write pieces of it",
                path=path,
            )
        self._builder = builder
        self._input = builder.data(keys, bounds=True)
        self.samplers: list[dict[str, Any]] = []
        self.channels: list[dict[str, Any]] = []

    def animate(self, node: int, path: str, values: Float64 | Float32) -> None:
        """A channel of a node; values: (T, width)."""
        flat = np.ascontiguousarray(values, dtype=np.float32)
        output = self._builder.data(flat.reshape(-1, 1) if path == "weights" else flat)
        self.samplers.append({"input": self._input, "output": output, "interpolation": "LINEAR"})
        target = {"node": node, "path": path}
        self.channels.append({"sampler": len(self.samplers) - 1, "target": target})


def move(
    builder: Builder, clip: Clip, node: int, turns: Float64, shifts: Float64, *, always: bool = False
) -> None:
    """Turn and shift a node; where it stands still, it just stands so.

    turns: (T, 3, 3), rotations relative to the parent. shifts: (T, 3), metres. always: with channels even
    where it does not move.
    """
    entry = builder.root["nodes"][node]
    turned = smooth(quaternions(turns))
    if not np.array_equal(np.round(turned[0], 9), (0, 0, 0, 1)):
        entry["rotation"] = turned[0].tolist()
    entry["translation"] = (shifts[0] + 0.0).tolist()
    if always or float(np.ptp(turned, axis=0).max()) > STILL:
        clip.animate(node, "rotation", turned)
    if always or float(np.ptp(shifts, axis=0).max()) > STILL:
        clip.animate(node, "translation", shifts)


def smooth(turned: Float64) -> Float64:
    """(T, 4) x, y, z, w of (T, 4) w, x, y, z: of the two signs of each, the one close to the frame before."""
    values = np.roll(turned, -1, axis=-1)
    flips = np.where((values[1:] * values[:-1]).sum(axis=-1) < 0, -1.0, 1.0)
    signs = np.concatenate([[1.0 if values[0, 3] >= 0 else -1.0], flips])
    result: Float64 = values * np.cumprod(signs)[:, None]
    return result


def nest(builder: Builder, names: tuple[str, ...], parents: Int64) -> list[int]:
    """Nodes of joints, children under their parents; their numbers."""
    nodes = [builder.add("nodes", {"name": name}) for name in names]
    for joint, parent in enumerate(parents.tolist()):
        if parent >= 0:
            adopt(builder, nodes[parent], nodes[joint])
    return nodes


def adopt(builder: Builder, parent: int, child: int) -> None:
    """Hang a node on another."""
    builder.root["nodes"][parent].setdefault("children", []).append(child)
