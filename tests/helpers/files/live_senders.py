"""Captures sent live: datagrams with the times at which they come, and what a `Capture` makes of them."""

import json
import struct
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


def captured(
    kind: str, sent: Sequence[Sent], *, settle: bool = True, **options: object
) -> tuple[Animation | None, Summary]:
    """Return all frames that a capture makes of datagrams, None without any, and its summary.

    settle: after each datagram; otherwise only at the end.
    """
    parts: list[Animation] = []
    capture = Capture(find_kind(kind), parts.append, **options)  # type: ignore[arg-type]
    for now, host, data in sent:
        capture.receive(data, host, now)
        if settle:
            capture.settle()
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


def osc(address: str, *arguments: str | float) -> bytes:
    """Return an OSC message with texts and numbers."""
    tags = "," + "".join("s" if isinstance(one, str) else "f" for one in arguments)
    parts = [_padded(address), _padded(tags)]
    parts += [_padded(one) if isinstance(one, str) else struct.pack(">f", one) for one in arguments]
    return b"".join(parts)


def bundle(*messages: bytes) -> bytes:
    """Return an OSC bundle."""
    parts = [len(one).to_bytes(4, "big") + one for one in messages]
    return b"#bundle\0" + b"\0\0\0\0\0\0\0\1" + b"".join(parts)


def _padded(text: str) -> bytes:
    data = text.encode()
    return data + b"\0" * (4 - len(data) % 4)


UNITY_BONES: dict[str, tuple[float, float, float]] = {
    "Hips": (0, 0.95, 0), "Spine": (0, 0.08, 0), "Chest": (0, 0.12, 0), "Neck": (0, 0.25, 0),
    "Head": (0, 0.09, 0.01),
    **{
        f"{side}{bone}": (way * x, y, z)
        for side, way in (("Left", -1), ("Right", 1))  # the left hand is at -x there
        for bone, (x, y, z) in {
            "Shoulder": (0.03, 0.2, 0), "UpperArm": (0.12, 0, 0), "LowerArm": (0.27, 0, 0),
            "Hand": (0.25, 0, 0), "UpperLeg": (0.09, -0.03, 0), "LowerLeg": (0, -0.42, 0),
            "Foot": (0, -0.41, 0), "Toes": (0, -0.07, 0.13),
        }.items()
    },
}  # fmt: skip
"""Where bones of a small person in a T-pose are, from the bone above, in Unity's axes: x to the right."""


def vmc_frames(
    turns: dict[str, Float64], expressions: dict[str, Float64], count: int, *, rate: float = 30.0,
    path: Float64 | None = None, lengths: bool = True, timed: bool = True, split: int = 6,
) -> list[Sent]:  # fmt: skip
    """Return datagrams of a VMC performer.

    turns: Unity's quaternions (T, 4), x y z w, of bones, such as eyes; others do not turn. path: (T, 3),
    of the hips. lengths: whether positions of bones are sent. timed: whether `/VMC/Ext/T` is. split: messages
    in a datagram.
    """
    result = []
    for row in range(count):
        messages = [osc("/VMC/Ext/OK", 1.0), *([osc("/VMC/Ext/T", row / rate)] if timed else [])]
        messages.append(osc("/VMC/Ext/Root/Pos", "root", *(0.0,) * 6, 1.0))
        bones = {**UNITY_BONES, **dict.fromkeys(turns.keys() - UNITY_BONES.keys(), (0, 0.06, 0.08))}
        for name, place in bones.items():
            at = path[row] if name == "Hips" and path is not None else place if lengths else (0.0, 0.0, 0.0)
            turn = turns[name][row] if name in turns else (0.0, 0.0, 0.0, 1.0)
            messages.append(osc("/VMC/Ext/Bone/Pos", name, *map(float, (*at, *turn))))
        messages += [osc("/VMC/Ext/Blend/Val", name, float(rows[row])) for name, rows in expressions.items()]
        messages.append(osc("/VMC/Ext/Blend/Apply"))
        parts = [messages[start : start + split] for start in range(0, len(messages), split)]
        result += [(row / rate, "10.0.0.5", bundle(*part)) for part in parts]
    return result
