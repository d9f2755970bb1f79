"""EPF, the encoder parameter file of the reference encoder: the frames to code, and their coding.

It contains no animation, but plane settings, for `fba encode --epf` and `fba decode --epf`.
"""

from __future__ import annotations

from fba.animation import Animation
from fba.errors import UnsupportedError
from fba.formats.epf._reader import read_epf
from fba.formats.epf._tags import TAGS
from fba.formats.epf._writer import write_epf
from fba.formats.text._lines import UTF8_MARK, content, decoded
from fba.source import Path, read_head

__all__ = ["read_animation", "read_epf", "sniff_epf", "write_epf"]


def sniff_epf(head: bytes, suffix: str) -> bool:
    """Whether a file with this beginning is an EPF file: its first word is a tag."""
    first = next((words[0] for line in head.splitlines() if (words := content(line).split())), b"")
    return decoded(first.removeprefix(UTF8_MARK)) in TAGS


def read_animation(path: Path) -> Animation:
    """Raise UnsupportedError, which explains the use of EPF files; FormatError for other files."""
    if not sniff_epf(read_head(path), ""):
        read_epf(path)  # raises an error that says what is wrong
    raise UnsupportedError(
        f"{path}: is an encoder parameter file (EPF): it says how to encode an animation, but contains none; "
        "use it with `fba encode IN.fap -o OUT.fba --epf FILE`, or fba.formats.epf.epf.read_epf",
        what="EPF as an animation",
    )
