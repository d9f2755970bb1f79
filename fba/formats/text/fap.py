"""ASCII FAP files (.fap): the text form of a face track, versions 2.0 to 2.2."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from fba.animation import Animation, FaceTrack
from fba.arrays import Int32
from fba.errors import FormatError
from fba.formats.text._frame_reader import read_frames
from fba.formats.text._frame_writer import write_frames
from fba.formats.text._layout import fap_layout
from fba.formats.text._lines import sniff_layout
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import EXPRESSION_FIELDS, FAP_COUNT, VISEME_FIELDS
from fba.source import Path

_VISEME = len(VISEME_FIELDS)
_FIELDS = _VISEME + len(EXPRESSION_FIELDS)


def sniff_fap(head: bytes, suffix: str) -> bool:
    """Whether a file with this beginning is a FAP file: by its mask width, else by its version."""
    return sniff_layout(head, fap_layout())


def read_fap(
    path: Path,
    *,
    source_rate: str | float | Fraction | None = None,
    name: str | None = None,
    salvage: bool = False,
    angle_scale: Fraction | float = 1,
    limits: Limits = DEFAULT_LIMITS,
) -> Animation:
    """Read a FAP file; its frame numbers become the animation's index.

    source_rate, name: replace those of the header, or a missing header. salvage: keep the frames before
    damage instead of raising. angle_scale: factor on the eight FAPs in angle units, for files in another unit
    than 1e-5 rad (50 for 5e-4). Raises FormatError with line and token, LimitError for more frames than
    `limits` allow. Warns (FbaWarning) of rounded values, a wrong frame count, frame numbers that do not
    increase, and an unknown version.
    """
    frames = read_frames(
        path, fap_layout(), source_rate=source_rate, name=name, salvage=salvage, angle_scale=angle_scale,
        limits=limits,
    )  # fmt: skip
    values = np.zeros((len(frames.index), FAP_COUNT), dtype=np.int32)
    values[:, 2:] = frames.slots[:, _FIELDS:]
    face = FaceTrack(
        values,
        frames.mask,
        frames.slots[:, :_VISEME].astype(np.int16),
        frames.slots[:, _VISEME:_FIELDS].astype(np.int16),
    )
    return Animation(frames.header.rate, frames.index, face, None, frames.header.name)


def write_fap(path: Path, animation: Animation) -> None:
    """Write the face track as FAP version 2.2. FormatError without a face track, or if writing fails."""
    face = animation.face
    if face is None:
        raise FormatError(
            "a FAP file holds a face, and this animation has only a body; write .bap or .fba", path=path
        )
    write_frames(path, fap_layout(), animation, face, _slots)


def _slots(face: FaceTrack) -> Int32:
    """Return the fields of FAP 1 and 2, and the FAPs from 3 on, int32 (T, slots)."""
    return np.concatenate([face.viseme, face.expression, face.values[:, 2:]], axis=1, dtype=np.int32)
