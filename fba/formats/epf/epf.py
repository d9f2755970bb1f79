"""EPF, the encoder parameter file of the reference encoder: which frames to code, and how.

It holds no animation: `read_epf` and `write_epf` turn it into plane settings and back, for
`fba encode --epf` and `fba decode --epf`.
"""

from __future__ import annotations

from fba.animation import Animation
from fba.errors import UnsupportedError
from fba.formats.epf._reader import read_epf
from fba.formats.epf._tags import TAGS
from fba.formats.epf._writer import write_epf
from fba.formats.text.lines import UTF8_MARK, content, decoded
from fba.source import Path, read_head

__all__ = ["read_animation", "read_epf", "sniff_epf", "write_epf"]


def sniff_epf(head: bytes, suffix: str) -> bool:
    """Whether a file that begins so is an EPF file: the first thing in it is a tag."""
    first = next((words[0] for line in head.splitlines() if (words := content(line).split())), b"")
    return decoded(first.removeprefix(UTF8_MARK)) in TAGS


def read_animation(path: Path) -> Animation:
    """Says what an EPF file is for: it holds no animation.

    Always raises: UnsupportedError, or FormatError for a file of another kind.
    """
    if not sniff_epf(read_head(path), ""):
        read_epf(path)  # says what is wrong with it
    raise UnsupportedError(
        f"{path}: is an encoder parameter file (EPF): it says how to code an animation and holds none; "
        "use it with `fba encode IN.fap -o OUT.fba --epf FILE`, or fba.formats.epf.epf.read_epf",
        what="EPF as an animation",
    )
