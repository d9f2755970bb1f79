"""Files to `Animation` and back: one module a format, one registry over them."""

from __future__ import annotations

from fba.errors import OptionError
from fba.formats._registry import (
    Format,
    format_of,
    formats,
    probe,
    read,
    read_face,
    read_motion,
    write,
    writer_for,
)
from fba.formats.synchronisation import merge

__all__ = [
    "Format", "OptionError", "format_of", "formats", "merge", "probe", "read", "read_face", "read_motion",
    "write", "writer_for",
]  # fmt: skip
