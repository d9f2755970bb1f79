"""Write tables of blendshapes as Live Link Face does: time codes, ARKit's 52 shapes, nine angles."""

from __future__ import annotations

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64
from fba.atomic import atomic
from fba.capture import to_blendshapes
from fba.errors import FormatError, ModelError
from fba.formats.face_tables.livelink_udp import join_values
from fba.formats.time_codes import DAY
from fba.source import Path

ANGLES = (
    "HeadYaw", "HeadPitch", "HeadRoll", "LeftEyeYaw", "LeftEyePitch", "LeftEyeRoll", "RightEyeYaw",
    "RightEyePitch", "RightEyeRoll",
)  # fmt: skip
COUNTED = (24, 25, 30, 48, 50, 60, 120)
"""Rates that time codes count in; for others they count 60 frames a second, and parts of these."""
MIN_RATE = 10
"""Lowest rate, in frames per second, that is written: the time codes of slower animations are ambiguous."""
DEFAULT_RATE = 30
"""Rate, in frames per second, to which slower animations are resampled."""
BATCH_FRAMES = 1024


def write(path: Path, animation: Animation) -> None:
    """Write the face as a table of blendshapes; `fba.capture.to_blendshapes` says how they are found.

    Columns have ARKit's order, and left is the performer's left everywhere. Time codes are those of the
    animation, with midnight as its time 0. Raises FormatError without a face.
    """
    if animation.rate < MIN_RATE:
        animation = animation.resample(DEFAULT_RATE)
    try:
        motion = to_blendshapes(animation)
    except ModelError as error:
        raise FormatError(error.finding, path=path) from error
    rows = join_values(motion)
    names = [name[0].upper() + name[1:] for name in motion.names]
    rate = int(animation.rate) if animation.rate in COUNTED else 60
    codes = _time_codes(motion.times + (motion.start or 0.0), rate)
    pattern = f",{rows.shape[1]}" + ",%.6f" * rows.shape[1] + "\n"
    with atomic(path) as file:
        file.write(("Timecode,BlendShapeCount," + ",".join([*names, *ANGLES]) + "\n").encode())
        for start in range(0, len(rows), BATCH_FRAMES):
            part = rows[start : start + BATCH_FRAMES].tolist()
            lines = [code + pattern % tuple(row) for code, row in zip(codes[start:], part, strict=False)]
            file.write("".join(lines).encode())


def _time_codes(times: Float64, rate: int) -> list[str]:
    """Return times, seconds, as HH:MM:SS:FF.fff in frames of a rate."""
    codes = []
    for thousandths in np.rint((times % DAY) * rate * 1000).astype(np.int64).tolist():
        frames, part = divmod(thousandths, 1000)
        seconds, frame = divmod(frames, rate)
        minutes, second = divmod(seconds, 60)
        codes.append(f"{minutes // 60 % 24:02}:{minutes % 60:02}:{second:02}:{frame:02}.{part:03}")
    return codes
