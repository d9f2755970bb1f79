"""Write joints as nodes of a glTF file, and their motion as animation channels."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fba.arrays import Float32, Float64, Int64
from fba.errors import FormatError
from fba.gltf import Builder
from fba.rotations import quaternions
from fba.source import Path

MAX_STILL_CHANGE = 1e-7
"""Largest change of a number that counts as still: 32-bit floats are no more exact."""


@dataclass(eq=False)
class Clip:
    """The animation of a file, whose channels share their key times; see `start_clip`.

    key_times: the accessor of these times.
    """

    builder: Builder
    key_times: int
    samplers: list[dict[str, Any]] = field(default_factory=list)
    channels: list[dict[str, Any]] = field(default_factory=list)

    def animate(self, node: int, path: str, values: Float64 | Float32) -> None:
        """Add a channel of a node. path: "rotation", "translation" or "weights". values: (T, width)."""
        flat = np.ascontiguousarray(values, dtype=np.float32)
        output = self.builder.data(flat.reshape(-1, 1) if path == "weights" else flat)
        self.samplers.append({"input": self.key_times, "output": output, "interpolation": "LINEAR"})
        target = {"node": node, "path": path}
        self.channels.append({"sampler": len(self.samplers) - 1, "target": target})

    def add_to_file(self, name: str, **members: Any) -> None:
        """Add the animation to the file. members: further members of its object."""
        entry = {"name": name, "samplers": self.samplers, "channels": self.channels}
        self.builder.add("animations", entry | members)


def start_clip(builder: Builder, times: Float64, path: Path) -> Clip:
    """Return a clip without channels. times: float64 (T,), seconds from the first key.

    Raises FormatError if the keys are too close to be distinct as 32-bit floats.
    """
    keys = times.astype(np.float32)
    if len(keys) > 1 and not (np.diff(keys) > np.diff(times).min() / 2).all():
        raise FormatError(
            f"the animation is {times[-1]:.0f} s long; glTF stores times as 32-bit floats, which "
            "cannot tell its frames apart; write shorter pieces",
            path=path,
        )
    return Clip(builder, builder.data(keys, bounds=True))


def move(
    builder: Builder, clip: Clip, node: int, turns: Float64, shifts: Float64, *, always: bool = False
) -> None:
    """Pose a node as in the first frame, and animate it if it moves.

    turns: (T, 3, 3), rotations relative to the parent. shifts: (T, 3), metres. always: add channels even if
    it does not move.
    """
    entry = builder.root["nodes"][node]
    turned = continuous(quaternions(turns))
    if not np.array_equal(np.round(turned[0], 9), (0, 0, 0, 1)):
        entry["rotation"] = turned[0].tolist()
    entry["translation"] = (shifts[0] + 0.0).tolist()
    if always or float(np.ptp(turned, axis=0).max()) > MAX_STILL_CHANGE:
        clip.animate(node, "rotation", turned)
    if always or float(np.ptp(shifts, axis=0).max()) > MAX_STILL_CHANGE:
        clip.animate(node, "translation", shifts)


def continuous(turned: Float64) -> Float64:
    """Return quaternions w, x, y, z (T, 4) as x, y, z, w, with the signs that bring neighbours close."""
    values = np.roll(turned, -1, axis=-1)
    flips = np.where((values[1:] * values[:-1]).sum(axis=-1) < 0, -1.0, 1.0)
    signs = np.concatenate([[1.0 if values[0, 3] >= 0 else -1.0], flips])
    result: Float64 = values * np.cumprod(signs)[:, None]
    return result


def nest(builder: Builder, names: tuple[str, ...], parents: Int64) -> list[int]:
    """Add a node for each joint, children below their parents; return the nodes' numbers."""
    nodes = [builder.add("nodes", {"name": name}) for name in names]
    for joint, parent in enumerate(parents.tolist()):
        if parent >= 0:
            adopt(builder, nodes[parent], nodes[joint])
    return nodes


def adopt(builder: Builder, parent: int, child: int) -> None:
    """Make a node the child of another."""
    builder.root["nodes"][parent].setdefault("children", []).append(child)
