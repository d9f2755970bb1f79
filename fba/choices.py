"""Words by which options of several rooms choose, as types."""

from __future__ import annotations

from typing import Literal

from fba.parameters import BapTable

Axes = Literal["iso", "vreng", "abduct_first", "parent_twist", "fixed_axes"]
"""About which axes, and in which sense, BAPs turn: as the standard says, as in old files, or otherwise."""
BapTableOrAuto = Literal["auto", BapTable]
"""A table of BAP steps, or the table that the stream's mark names, or else that its motion suggests."""
UpAxis = Literal["y", "z"]
"""The axis of a mesh that points up."""
SignedUpAxis = Literal["auto", "+x", "-x", "+y", "-y", "+z", "-z"]
"""The axis of a motion that points up; "auto": detected."""
FileUpAxis = Literal["", "+x", "-x", "+y", "-y", "+z", "-z"]
"""The axis that a file says is up; "" where it says none."""
Swap = Literal["auto", "yes", "no"]
"""Whether MouthLeft and MouthRight, JawLeft and JawRight of a table change places."""
Gaze = Literal["none", "camera"]
"""What eyes do while the head turns: turn with it, or keep looking at the camera."""
Origin = Literal["source", "start", "middle"]
"""What of a captured motion is at the body's default position."""
Ground = Literal["floor", "source", "none"]
"""The height at which the feet of a captured motion stand."""
Spine = Literal["spread", "full", "simple", "joints"]
"""How the turns of a captured spine are divided between vertebrae."""
Baseline = Literal["none", "start", "median"]
"""The face at rest, from which expressions are read."""
Sending = Literal["auto", "expression", "faps"]
"""How an expression is sent: by FAP 2 if that can express it, by FAP 2, by low-level FAPs."""
Sync = Literal["timecode", "offset"]
"""How two recordings are aligned: by their times of day, or at their starts."""
Unsent = Literal["keep", "interpolate"]
"""What a player shows for a FAP that is not sent: its last value, or a value interpolated from others."""
Assignment = Literal["shared", "exclusive"]
"""Which markers move a vertex within the reach of several: all of them, or the nearest."""
Overlap = Literal["match", "add"]
"""How markers move a vertex that they share: so that centres meet their markers, or by their sum."""
Means = Literal["motion", "curves", "masks"]
"""How a face gets an actor's manner: by maps and the motion's pace, by maps alone, or by masks."""
Adaptation = Literal["auto", "carry", "author"]
"""How the motions of FAPs are fitted to a face: the better of the two, carried over, or computed again."""
SkinMethod = Literal["dual", "linear"]
"""How skin follows joints: by dual quaternions, or by linear blending."""
