"""Presets: which parameters of an animation a stream sends. docs/encode.md compares them."""

from __future__ import annotations

from typing import Final, Literal

PlannedPreset = Literal["exact", "compact"]
"""Without parameters that never move, and FAPs that players derive from others. See `fba.planning`."""
Preset = Literal["reference", PlannedPreset]
"""`REFERENCE`, or a planned preset."""

REFERENCE: Final = "reference"
"""All that the animation sends."""
PLANNED: tuple[PlannedPreset, ...] = ("exact", "compact")
PRESETS: tuple[Preset, ...] = (REFERENCE, *PLANNED)
