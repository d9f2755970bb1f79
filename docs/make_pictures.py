"""Makes the pictures of the documentation from the sample performance: `python docs/make_pictures.py`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

import fba
import player
from fba import Animation, FaceTrack
from fba.face import FaceModel, feature_point_names
from fba.face.calibration import fit
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


def fitted() -> Image.Image:
    """The built-in head, fitted to a broad person, to a child, and to the points of docs/calibrate.md."""
    head = FaceModel.default()
    row = {name: number for number, name in enumerate(feature_point_names())}
    child = head.points * 0.82
    down = np.clip(-child[:, 1] / 0.06, 0, 2)
    child *= 1 - 0.06 * down[:, None] * (1, 2, 0)
    child[:, 2] -= 0.003 * down
    for pupil, lids in (("3.5", "3.1 3.3 3.7 3.9 3.11 3.13"), ("3.6", "3.2 3.4 3.8 3.10 3.12 3.14")):
        rows = [row[name] for name in lids.split()]
        child[rows] += (child[rows] - child[row[pupil]]) * (0.1, 0.16, 0.1)
    page = IMAGES.with_name("calibrate.md").read_text(encoding="utf-8")
    given = np.full((len(row), 3), np.nan)
    for name, *place in filter(None, map(str.split, page.split("\nEND\n")[0].splitlines())):
        if name in row and len(place) == 3:
            given[row[name]] = [float(number) for number in place]
    people = [
        head,
        *(fit(head, points, tables="carry") for points in (head.points * (1.12, 0.96, 1.0), child, given)),
    ]
    pictures = []
    for camera in ("front", "three-quarter"):
        for person in people:
            scene = player.Scene(Animation(25, np.arange(1), FaceTrack.empty(1)), person)
            with player.Offscreen(scene, (300, 360), scene.camera(camera, 300 / 360), samples=4) as view:
                pictures.append(view.frame(0.0).copy())
    return strip(pictures, len(people))


def main() -> None:
    IMAGES.mkdir(exist_ok=True)
    hello().save(IMAGES / "hello.png", optimize=True)
    expressions().save(IMAGES / "expressions.png", optimize=True)
    fitted().save(IMAGES / "fitted.jpg", quality=88)


if __name__ == "__main__":
    main()
