"""Makes the pictures of the documentation from the sample performance: `python docs/make_pictures.py`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

import fba
import player
from fba import Animation, FaceTrack
from fba.formats import merge
from fba.parameters import EXPRESSIONS

IMAGES = Path(__file__).with_name("images")
SAMPLES = Path(fba.__file__).with_name("samples")
MOMENTS = (1.9, 2.6, 4.4, 6.6)
"""Seconds of the sample performance that the first picture shows."""


def performance() -> Animation:
    """The sample, after a trip through the codec."""
    face, body = fba.read(SAMPLES / "hello.fap"), fba.read(SAMPLES / "hello.bvh")
    data = fba.encode(merge(face, body.resample(face.rate)), fba.EncoderOptions(bap_steps="visage"))
    return fba.decode(data, bap_steps="visage")


def strip(pictures: list[np.ndarray], columns: int) -> Image.Image:
    """Pictures of one size, side by side in rows."""
    height, width = pictures[0].shape[:2]
    rows = -(-len(pictures) // columns)
    sheet = Image.new("RGB", (columns * width, rows * height))
    for number, pixels in enumerate(pictures):
        place = (number % columns * width, number // columns * height)
        sheet.paste(Image.fromarray(pixels).convert("RGB"), place)
    return sheet


def hello() -> Image.Image:
    scene = player.Scene(performance())
    with player.Offscreen(scene, (320, 400), samples=4) as view:
        return strip([view.frame(time).copy() for time in MOMENTS], len(MOMENTS))


def expressions() -> Image.Image:
    """The six expressions of FAP 2 at full intensity."""
    count = len(EXPRESSIONS) - 1
    mask = np.zeros((count, 68), dtype=bool)
    mask[:, 1] = True
    fields = np.zeros((count, 6), dtype=np.int16)
    fields[:, 0] = range(1, count + 1)
    fields[:, 1] = 63
    track = FaceTrack(np.zeros((count, 68), dtype=np.int32), mask, None, fields)
    scene = player.Scene(Animation(1, np.arange(count), track))
    with player.Offscreen(scene, (320, 320), scene.camera("front", 1.0), samples=4) as view:
        return strip([view.frame(float(time)).copy() for time in range(count)], 3)


def main() -> None:
    IMAGES.mkdir(exist_ok=True)
    hello().save(IMAGES / "hello.png", optimize=True)
    expressions().save(IMAGES / "expressions.png", optimize=True)


if __name__ == "__main__":
    main()
