"""Picture of docs/gait.md."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from fba import player
from fba.body import gait
from fba_player.view._camera import Camera

TARGET = Path(__file__).parents[1] / "images" / "gait.jpg"
PHASES = 8
SIZE = (160, 270)
CAMERA = Camera(target=(0.0, 0.87, 0.03), yaw=78.0, pitch=2.0, distance=5.2)


def row(character: str) -> np.ndarray:
    """One cycle of a character, side by side: the four poses, then those of the other half."""
    walk = gait.walk(character=character, cycles=1, in_place=True, rate=60)
    with player.Offscreen(player.Scene(walk), SIZE, CAMERA, samples=4) as view:
        cycle = float((len(walk) - 1) / walk.rate)
        return np.hstack([view.frame(cycle * n / PHASES)[..., :3].copy() for n in range(PHASES)])


def main() -> None:
    TARGET.parent.mkdir(exist_ok=True)
    rows = np.vstack([row(character) for character in gait.characters()])
    Image.fromarray(rows).save(TARGET, quality=88, optimize=True)
