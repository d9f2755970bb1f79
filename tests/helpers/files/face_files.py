"""Captures of faces in all formats that are read, written from known weights."""

from __future__ import annotations

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
