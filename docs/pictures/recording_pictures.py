"""Sheets of frames of real recordings, read from the shared material, for docs/play.md and the README."""

from __future__ import annotations

import fba
from fba import player
from fba.arrays import UInt8
from fba_player.export.film_sheet import film_sheet
from pictures.body_pictures import SHARED


def expressions_sheet() -> UInt8:
    """An old FAP file that shows all expressions."""
    return _sheet("data/ist/ALLEXPS.FAP", "three-quarter")


def angry_sheet() -> UInt8:
    """A stream of somebody angry."""
    return _sheet("vectors/real/angry_1.fba", "three-quarter")


def dance_sheet() -> UInt8:
    """Motion capture of a dancer."""
    return _sheet("data/greta/Dance.bvh", "body")


def _sheet(name: str, camera: str) -> UInt8:
    return film_sheet(player.Scene(fba.read(SHARED / name)), 8, camera=camera)
