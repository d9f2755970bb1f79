"""Picture of docs/find.md: a picture of a figure, and the silhouettes of an index that are nearest to it.

The figure is the sample person in a frame and from a side that the index does not hold.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from PIL import Image

import fba
from fba.outlines import Choice, build_index, draw_sheet, read_mask
from fba_player.export._offscreen import Offscreen
from fba_player.scene.scene import Scene

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "fba/samples/hello.bvh"
SIZE = 600
FRAMES = (110, 250)
COUNT = 6
"""Silhouettes beside each picture."""


def main() -> Image.Image:
    animation = fba.read(SOURCE)
    scene = Scene(animation)
    scene.show("background", "transparent")
    index = build_index([(SOURCE.name, animation)], Choice(views=24, every=20))
    masks, photographs = [], []
    with tempfile.TemporaryDirectory() as folder, Offscreen(scene, (SIZE, SIZE), samples=4) as view:
        for frame in FRAMES:
            pixels = view.frame(frame / float(animation.rate))
            path = Path(folder) / "picture.png"
            Image.fromarray(pixels).save(path)
            masks.append(read_mask(path))
            photographs.append(Image.fromarray(pixels))
    sheet = Image.fromarray(draw_sheet(index, masks, [index.search(mask, COUNT) for mask in masks]))
    height = sheet.height // len(FRAMES)
    page = Image.new("RGB", (sheet.width + height, sheet.height), sheet.getpixel((0, 0)))
    page.paste(sheet, (height, 0))
    for row, photograph in enumerate(photographs):
        small = photograph.resize((height, height), Image.Resampling.LANCZOS)
        page.paste(small, (0, row * height), small)
    return page
