"""Presets: what of an animation a stream has. docs/encode.md compares them."""

from __future__ import annotations

REFERENCE = "reference"
"""All that the animation sends."""
PLANNED = ("exact", "compact")
"""Not what never moves; of FAPs, only those that a player does not derive from others. See `fba.planning`."""
PRESETS = (REFERENCE, *PLANNED)
