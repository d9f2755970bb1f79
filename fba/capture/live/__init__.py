"""Captures that arrive moment by moment: the conversions of whole captures, a frame at a time.

May use: all of `fba.capture`.
"""

from fba.capture.live._blendshapes import LiveBlendshapes, widest_faces
from fba.capture.live._skeleton import LiveSkeleton

__all__ = ["LiveBlendshapes", "LiveSkeleton", "widest_faces"]
