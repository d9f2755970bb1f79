"""Markers on a face to FAPs: gaps filled, head motion removed, displacements solved for FAPs.

May use: parameters, the face, and the modules of `fba` itself.
"""

from fba.capture.markers._faces import find_face, from_markers
from fba.capture.markers._motion import MarkerMotion

__all__ = ["MarkerMotion", "find_face", "from_markers"]
