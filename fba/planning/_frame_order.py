"""The order of frames that come one by one."""

from __future__ import annotations

from fba.animation import Animation


def check_order(before: Animation, frame: Animation) -> None:
    """Raise ValueError for a frame that cannot come after another: of another rate, or no later."""
    if frame.rate != before.rate:
        raise ValueError(f"the stream has {before.rate} frames/s, this frame {frame.rate}; resample it first")
    if frame.index[0] <= before.index[0]:
        raise ValueError(f"frame index {frame.index[0]} comes after {before.index[0]}; they must increase")
