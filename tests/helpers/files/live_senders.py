"""Captures sent live: datagrams with the times at which they come, and what a `Capture` makes of them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64
from fba.live import Capture, Summary, find_kind
from fba.tracks import BodyTrack, FaceTrack

Sent = tuple[float, str, bytes]
"""When a datagram comes, from which address, and what it is."""


def at_rate(datagrams: Iterable[bytes], rate: float = 60.0, host: str = "10.0.0.2") -> list[Sent]:
    """Return datagrams that come at a steady rate."""
    return [(number / rate, host, one) for number, one in enumerate(datagrams)]


def captured(kind: str, sent: Sequence[Sent], **options: object) -> tuple[Animation | None, Summary]:
    """Return all frames that a capture makes of datagrams, None without any, and its summary."""
    parts: list[Animation] = []
    capture = Capture(find_kind(kind), parts.append, **options)  # type: ignore[arg-type]
    for now, host, data in sent:
        capture.receive(data, host, now)
    summary = capture.finish()
    return joined(parts), summary


def joined(parts: Sequence[Animation]) -> Animation | None:
    """Return consecutive parts of one animation as one, with the numbers that their frames have."""
    if not parts:
        return None
    index = np.concatenate([part.index for part in parts])
    face = FaceTrack.join([(part.face, len(part)) for part in parts])
    body = BodyTrack.join([(part.body, len(part)) for part in parts])
    return Animation(parts[0].rate, index, face, body)


def vtube_objects(weights: dict[str, Float64], head: Float64, *, start: float = 1.7e9) -> list[bytes]:
    """Return what VTube Studio sends; head (T, 3): degrees."""
    result = []
    for row, (x, y, z) in enumerate(head.tolist()):
        entries = [{"k": name, "v": float(values[row])} for name, values in weights.items()]
        content = {
            "Timestamp": round(1000 * start + 1000 * row / 60), "Hotkey": -1, "FaceFound": True,
            "Rotation": {"x": x, "y": y, "z": z}, "Position": {"x": 0.0, "y": 0.0, "z": 30.0},
            "EyeLeft": {"x": 0.0, "y": 0.0, "z": 0.0}, "EyeRight": {"x": 0.0, "y": 0.0, "z": 0.0},
            "BlendShapes": entries,
        }  # fmt: skip
        result.append(json.dumps(content).encode())
    return result
