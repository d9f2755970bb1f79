"""Captures of faces in all formats that are read, written from known weights."""

from __future__ import annotations

import re
import struct
from collections.abc import Sequence

import numpy as np

from fba.arrays import Float64

UDP_ORDER = """
EyeBlinkLeft EyeLookDownLeft EyeLookInLeft EyeLookOutLeft EyeLookUpLeft EyeSquintLeft EyeWideLeft
EyeBlinkRight EyeLookDownRight EyeLookInRight EyeLookOutRight EyeLookUpRight EyeSquintRight EyeWideRight
JawForward JawLeft JawRight JawOpen MouthClose MouthFunnel MouthPucker MouthLeft MouthRight
MouthSmileLeft MouthSmileRight MouthFrownLeft MouthFrownRight MouthDimpleLeft MouthDimpleRight
MouthStretchLeft MouthStretchRight MouthRollLower MouthRollUpper MouthShrugLower MouthShrugUpper
MouthPressLeft MouthPressRight MouthLowerDownLeft MouthLowerDownRight MouthUpperUpLeft MouthUpperUpRight
BrowDownLeft BrowDownRight BrowInnerUp BrowOuterUpLeft BrowOuterUpRight CheekPuff CheekSquintLeft
CheekSquintRight NoseSneerLeft NoseSneerRight TongueOut
""".split()  # noqa: SIM905 - fifty lines otherwise
ANGLES = """
HeadYaw HeadPitch HeadRoll LeftEyeYaw LeftEyePitch LeftEyeRoll RightEyeYaw RightEyePitch RightEyeRoll
""".split()  # noqa: SIM905
STEP = 1.0016 / 60
"""Seconds between frames of Live Link Face."""


def camel(name: str) -> str:
    """Return ARKit's own spelling: "eyeBlinkLeft"."""
    return name[0].lower() + name[1:]


def face_weights(count: int, seed: int = 5) -> dict[str, Float64]:
    """Return smooth weights (T,) of all 52 shapes, by their names in Live Link Face, 0 to 0.9."""
    random = np.random.default_rng(seed)
    rows = np.arange(count)
    return {
        name: 0.45 * (1 + np.sin(rows * random.uniform(0.02, 0.2) + random.uniform(0, 6)))
        for name in UDP_ORDER
    }


def face_angles(count: int) -> dict[str, Float64]:
    """Return angles (T,) of head and eyes in radians, as Live Link Face names and counts them."""
    rows = np.arange(count)
    return {name: 0.2 * np.sin(0.05 * rows + number) for number, name in enumerate(ANGLES)}


def time_code(seconds: float, rate: int = 60) -> str:
    """Return a time of day as HH:MM:SS:FF.fff."""
    frames = round(seconds * rate * 1000)
    whole, part = divmod(frames, 1000)
    clock, frame = divmod(whole, rate)
    return f"{clock // 3600 % 24:02}:{clock // 60 % 60:02}:{clock % 60:02}:{frame:02}.{part:03}"


def livelink_csv(
    columns: dict[str, Float64], *, start: float = 67_739.66, rate: int = 60, step: float = STEP,
    separator: str = ",", code: str = "Timecode",
) -> str:  # fmt: skip
    """Return a table as Live Link Face writes it, with these columns in this order."""
    count = len(next(iter(columns.values())))
    lines = [separator.join([code, "BlendShapeCount", *columns])]
    for row in range(count):
        cells = [f"{values[row]:.10f}" for values in columns.values()]
        if separator != ",":
            cells = [cell.replace(".", ",") for cell in cells]
        lines.append(separator.join([time_code(start + row * step, rate), str(len(columns)), *cells]))
    return "\n".join(lines) + "\n"


def datagram(
    values: Sequence[float] | None, seconds: float, *, name: str = "iPhone", device: str = "D" * 36,
    rate: int = 60,
) -> bytes:  # fmt: skip
    """Return what Live Link Face sends for a frame; values: 61, or None where no face is seen."""
    texts = b"".join(struct.pack(">i", len(one)) + one.encode() for one in (device, name))
    frame, part = divmod(seconds * rate, 1)
    time = struct.pack(">ifii", int(frame), part, rate, 1)
    numbers = b"" if values is None else struct.pack(">B61f", 61, *values)
    return b"\x06" + texts + time + numbers


def livelink_udp(columns: dict[str, Float64], *, start: float = 18_000.0, **options: object) -> list[bytes]:
    """Return the datagrams of a capture with all 61 columns."""
    rows = np.stack([columns[name] for name in [*UDP_ORDER, *ANGLES]], axis=1)
    return [datagram(row.tolist(), start + number * STEP, **options) for number, row in enumerate(rows)]  # type: ignore[arg-type]


def _short(name: str) -> str:
    """Return the app's spelling: eyeBlink_L, but mouthLeft and jawLeft, whose left is no side of a pair."""
    if name in ("MouthLeft", "MouthRight", "JawLeft", "JawRight"):
        return camel(name)
    return re.sub("Left$", "_L", re.sub("Right$", "_R", camel(name)))


def ifacialmocap_records(
    weights: dict[str, Float64], head: Float64, eyes: Float64, *, version: int = 1
) -> list[str]:
    """Return records; head (T, 6): degrees and metres; eyes (T, 6): degrees, the right eye's first."""
    mark = "-" if version == 1 else "&"
    records = []
    for row in range(len(head)):
        words = [f"{_short(name)}{mark}{round(100 * values[row])}" for name, values in weights.items()]
        turns = ",".join(f"{one:.6f}" for one in head[row])
        right, left = (",".join(f"{one:.6f}" for one in eyes[row, part]) for part in (slice(3), slice(3, 6)))
        records.append("|".join([*words, f"=head#{turns}", f"rightEye#{right}", f"leftEye#{left}|"]))
    return records


def mediapipe_frames(weights: dict[str, Float64], rate: float = 30.0) -> list[dict[str, object]]:
    """Return frames as the JavaScript of MediaPipe gives them: its own order, "_neutral" first, no tongue."""
    names = sorted(camel(name) for name in weights if name != "TongueOut")
    count = len(next(iter(weights.values())))
    frames: list[dict[str, object]] = []
    for row in range(count):
        categories = [{"index": 0, "score": 1e-6, "categoryName": "_neutral", "displayName": ""}]
        categories += [
            {"index": number + 1, "score": float(weights[name[0].upper() + name[1:]][row]),
             "categoryName": name, "displayName": ""}
            for number, name in enumerate(names)
        ]  # fmt: skip
        shapes = {"categories": categories, "headIndex": -1, "headName": ""}
        frames.append({"timestampMs": 1000 * row / rate, "faceBlendshapes": [shapes]})
    return frames


def beat(weights: dict[str, Float64], rate: float = 60.0) -> dict[str, object]:
    """Return a recording as BEAT has it."""
    names = [camel(name) for name in weights if name != "TongueOut"]
    rows = np.stack([values for name, values in weights.items() if name != "TongueOut"], axis=1)
    frames = [
        {"weights": row.tolist(), "time": number / rate, "rotation": [0.0, 0.0, 0.0]}
        for number, row in enumerate(rows)
    ]
    return {"names": names, "frames": frames}


def openface_csv(
    units: dict[int, Float64], pose: Float64, gaze: Float64, *, rate: float = 30.0, blank: str = " ",
    extra: dict[str, Float64] | None = None,
) -> str:  # fmt: skip
    """Return a table as OpenFace 2 writes it; units: 0 to 5. pose (T, 3): radians; gaze (T, 6): both eyes."""
    count = len(pose)
    columns: dict[str, Float64] = {
        "frame": np.arange(1.0, count + 1), "face_id": np.zeros(count), "timestamp": np.arange(count) / rate,
        "confidence": np.full(count, 0.98), "success": np.ones(count),
    }  # fmt: skip
    columns |= {f"gaze_{eye}_{axis}": gaze[:, 3 * eye + n] for eye in (0, 1) for n, axis in enumerate("xyz")}
    columns |= {f"pose_R{axis}": pose[:, n] for n, axis in enumerate("xyz")}
    columns |= {f"AU{unit:02}_r": values for unit, values in units.items()}
    columns |= {f"AU{unit:02}_c": (values > 1).astype(float) for unit, values in units.items()}
    columns |= extra or {}
    lines = [f",{blank}".join(columns)]
    rows = zip(*(np.asarray(values, dtype=float).tolist() for values in columns.values()), strict=True)
    lines += [f",{blank}".join(f"{one:.6g}" for one in row) for row in rows]
    return "\n".join(lines) + "\n"


def pyfeat_csv(units: dict[int, Float64], *, frames: Float64, identity: Sequence[str] | None = None) -> str:
    """Return a table as py-feat writes it; units: 0 to 1."""
    count = len(frames)
    names = [*(f"AU{unit:02}" for unit in units), "Pitch", "input"]
    names = ["frame", "FaceRectX", "FaceRectY", "FaceScore", *names]
    lines = [",".join([*names, *(["Identity"] if identity else [])])]
    for row in range(count):
        cells = [f"{frames[row]:g}", "10", "20", "0.99", *(f"{values[row]:.6f}" for values in units.values())]
        lines.append(",".join([*cells, "1.5", "a.mp4", *([identity[row]] if identity else [])]))
    return "\n".join(lines) + "\n"
