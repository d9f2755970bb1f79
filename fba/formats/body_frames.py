"""BAPs of an animation as they are shown: at even intervals, with unsent values held."""

from __future__ import annotations

import numpy as np

from fba.animation import Animation
from fba.arrays import Int32
from fba.errors import FormatError
from fba.parameters import BAP_COUNT
from fba.source import Path

MOST_FRAMES = 500_000
"""The limit of the readers of motion capture."""


def shown_baps(animation: Animation, path: Path, format: str) -> Int32:
    """Return int32 (T, 296): the BAPs shown at every frame from the first to the last, gaps filled in.

    format: its name, for errors. Raises FormatError without a body or a frame, and beyond `MOST_FRAMES`.
    """
    if animation.body is None:
        raise FormatError(
            f"{format} holds a body, and this animation has only a face; write .fap, .fba or .glb", path=path
        )
    check_frames(animation, path, format)
    even = animation.resample(animation.rate)
    assert even.body is not None
    return held_baps(even)


def check_frames(animation: Animation, path: Path, format: str) -> None:
    """Raise FormatError for no frame, or more than `MOST_FRAMES` from the first to the last."""
    if not len(animation):
        raise FormatError(f"{format} needs a frame at least, and this animation has none", path=path)
    count = int(animation.index[-1]) - int(animation.index[0]) + 1
    if count > MOST_FRAMES:
        raise FormatError(
            f"{count} frames from the first to the last are more than the {MOST_FRAMES} that {format} files "
            "are read with; write pieces of it, or resample",
            path=path,
        )


def held_baps(animation: Animation) -> Int32:
    """Return int32 (T, 296): the last value sent of each BAP at every frame of the animation, at first 0."""
    from fba.face.resolve import hold

    body = animation.body
    assert body is not None
    if body.mask.all():
        return body.values
    held: Int32 = hold(body.values, body.mask, np.zeros(BAP_COUNT, dtype=np.int32))
    return held
