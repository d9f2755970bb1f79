"""Picture of docs/capture-faces.md."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from fba import player
from fba.capture import ShapeMotion, from_blendshapes
from fba.face import arkit_names

TARGET = Path(__file__).parents[1] / "images" / "capture-faces.jpg"
SIZE = (200, 230)
COLUMNS = 6
POSES = (
    {"jawOpen": 0.6},
    {"jawOpen": 0.4, "mouthClose": 0.4},
    {"mouthSmileLeft": 0.8},
    {"mouthFrownLeft": 0.8, "mouthFrownRight": 0.8},
    {"mouthFunnel": 0.7},
    {"mouthPucker": 1.0},
    {"mouthUpperUpLeft": 0.8, "mouthUpperUpRight": 0.8},
    {"jawLeft": 1.0, "mouthLeft": 0.6},
    {"eyeBlinkRight": 1.0},
    {"eyeLookUpLeft": 0.6, "eyeLookUpRight": 0.6},
    {"browInnerUp": 1.0},
    {"browDownLeft": 1.0, "browDownRight": 1.0, "noseSneerLeft": 1.0, "noseSneerRight": 1.0},
)


def main() -> None:
    """Draw the built-in head with a few of ARKit's shapes, and their names."""
    weights = np.zeros((len(POSES), len(arkit_names())))
    for row, pose in enumerate(POSES):
        for name, weight in pose.items():
            weights[row, arkit_names().index(name)] = weight
    motion = ShapeMotion(arkit_names(), weights, np.arange(len(POSES)) / 25, Fraction(25))
    sheet = Image.new("RGB", (COLUMNS * SIZE[0], len(POSES) // COLUMNS * SIZE[1]))
    draw = ImageDraw.Draw(sheet)
    with player.Offscreen(from_blendshapes(motion), SIZE, camera="front", samples=4) as view:
        for number, pose in enumerate(POSES):
            place = (number % COLUMNS * SIZE[0], number // COLUMNS * SIZE[1])
            sheet.paste(Image.fromarray(view.frame(number / 25)[..., :3]), place)
            names = "\n".join(f"{name} {weight:g}" for name, weight in pose.items())
            draw.text((place[0] + 6, place[1] + 4), names, fill=(20, 20, 20))
    TARGET.parent.mkdir(exist_ok=True)
    sheet.save(TARGET, quality=88, optimize=True)
