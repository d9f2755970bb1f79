"""ASCII BAP files (.bap): the text form of a body track, versions 3.1 (186 BAPs) and 3.2 (296)."""

from __future__ import annotations

from fractions import Fraction

from fba.animation import Animation, BodyTrack
from fba.choices import Axes
from fba.errors import FormatError
from fba.formats.text._frame_reader import read_frames
from fba.formats.text._frame_writer import write_frames
from fba.formats.text._layout import bap_layout
from fba.formats.text._lines import sniff_layout
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path


def sniff_bap(head: bytes, suffix: str) -> bool:
    """Whether a file with this beginning is a BAP file: by its mask width, else by its version."""
    return sniff_layout(head, bap_layout())


def read_bap(
    path: Path,
    *,
    source_rate: str | float | Fraction | None = None,
    name: str | None = None,
    salvage: bool = False,
    angle_scale: Fraction | float = 1,
    limits: Limits = DEFAULT_LIMITS,
) -> Animation:
    """Read a BAP file; its frame numbers become the animation's index.

    The arguments are those of `fba.formats.text.fap.read_fap`; angle_scale is a factor on all angles (BAPs
    1..186 but the three translations). Raises and warns as it does.
    """
    frames = read_frames(
        path, bap_layout(), source_rate=source_rate, name=name, salvage=salvage, angle_scale=angle_scale,
        limits=limits,
    )  # fmt: skip
    body = BodyTrack(frames.slots, frames.mask)
    return Animation(frames.header.rate, frames.index, None, body, frames.header.name)


def write_bap(path: Path, animation: Animation, *, axes: Axes = "iso") -> None:
    """Write the body track as BAP version 3.2. FormatError without a body track, or if writing fails.

    axes: the convention by which the BAPs turn now (`fba.body.convention_names()`); they are written by the
    standard's, "iso". ValueError for one that differs in more than signs.
    """
    from fba.body.turned_legs import by_the_standard

    body = animation.body
    if body is None:
        raise FormatError(
            "a BAP file holds a body, and this animation has only a face; write .fap or .fba", path=path
        )
    write_frames(path, bap_layout(), animation, body, lambda batch: by_the_standard(batch, axes).values)
