"""A picture of the view at its best: several samples a pixel, before the studio or before nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from fba.arrays import UInt8
from fba_player.export.offscreen import cut_out
from fba_player.gl.framebuffer import Target
from fba_player.gl.renderer import Renderer
from fba_player.session.session import Session

SAMPLES = 4


def still(context: Any, renderer: Renderer, session: Session, *, transparent: bool = False) -> UInt8:
    """What the session shows now, without panels: uint8 (H, W, 4), top row first.

    transparent: opaque only where something is. Raises DisplayError where there is no room for it.
    """
    time, scene = session.transport.time, session.scene
    target = Target(context, session.size, SAMPLES)
    before = scene.switches["background"]
    try:
        if transparent:
            scene.show("background", "transparent")
        view, camera = session.view(time), session.viewpoint.whole(time)
        views = [replace(view, background=(shade,) * 3) for shade in (0.0, 1.0)] if transparent else [view]
        pictures = []
        for one in views:
            target.begin()
            within = renderer.draw(one, camera, session.size)
            pictures.append(pixels_of(target.finish(within=within), session.size))
    finally:
        scene.show("background", before)
        target.close()
    return cut_out(*pictures) if transparent else pictures[0]


def pixels_of(framebuffer: Any, size: tuple[int, int]) -> UInt8:
    """What a framebuffer holds: uint8 (H, W, 4), top row first."""
    width, height = size
    data = framebuffer.read((0, 0, width, height), components=4, alignment=1)
    return np.frombuffer(data, np.uint8).reshape(height, width, 4)[::-1]
