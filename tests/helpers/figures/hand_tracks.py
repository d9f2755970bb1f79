"""Face tracks written out by hand."""

import numpy as np

from fba.animation import FaceTrack


def track(
    frames: list[dict[int, int]],
    viseme: list[tuple[int, ...] | None] | None = None,
    expression: list[tuple[int, ...] | None] | None = None,
) -> FaceTrack:
    """Frames as {FAP: value}; viseme and expression fields, None where not sent."""
    count = len(frames)
    values, mask = np.zeros((count, 68), dtype=int), np.zeros((count, 68), dtype=bool)
    fields = [np.zeros((count, n), dtype=int) for n in (4, 6)]
    for t, frame in enumerate(frames):
        for number, value in frame.items():
            values[t, number - 1], mask[t, number - 1] = value, True
    for column, (given, into) in enumerate(zip((viseme, expression), fields, strict=True)):
        for t, entry in enumerate(given or []):
            if entry is not None:
                into[t], mask[t, column] = entry, True
    return FaceTrack(values, mask, *fields)
