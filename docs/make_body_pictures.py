"""Makes the pictures of docs/body-models.md: `python docs/make_body_pictures.py`.

The clips are real recordings, read from the shared material (FBA_SHARED, else ../shared beside the checkout).
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from PIL import Image

import fba
import player
from fba import Animation, BodyTrack
from fba.parameters import baps

IMAGES = Path(__file__).with_name("images")
SHARED = Path(os.environ.get("FBA_SHARED") or Path(__file__).parents[2] / "shared")
CLIPS = (
    ("greta/Dance.bvh", 25.0, (0.12, 0.23, 0.45, 0.66, 0.77)),
    ("greta/sad_walk_rd.bvh", 35.0, (0.02, 0.23, 0.34, 0.45, 0.98)),
    ("greta/c-ladder.bvh", 50.0, (0.23, 0.34, 0.45, 0.77, 0.88)),
    ("vreng/clap.bap", 25.0, (0.40, 0.56, 0.66, 0.77, 0.98)),
)
"""Clip, the camera's yaw, and the moments shown, as shares of the clip."""
SIZE = (240, 340)
TWISTS = ({}, {"l_elbow_twisting": 90}, {"l_elbow_twisting": -150}, {"l_wrist_twisting": 90},
          {"l_wrist_twisting": -150})  # fmt: skip
"""Degrees of BAPs by name."""


def clips() -> Image.Image:
    """Somebody dancing, walking sadly, climbing and clapping."""
    sheet = Image.new("RGB", (SIZE[0] * 5, SIZE[1] * len(CLIPS)))
    for row, (name, yaw, moments) in enumerate(CLIPS):
        scene = player.Scene(fba.read(SHARED / "data" / name))
        with player.Offscreen(scene, SIZE, samples=4) as view:
            for column, share in enumerate(moments):
                time = float(scene.start) + share * float(scene.duration)
                places = np.concatenate([mesh.positions for mesh in scene.at(time).faces])
                middle = (places.min(axis=0) + places.max(axis=0)) / 2
                gone = np.array(scene.travel(time))  # the camera adds this
                target = tuple(float(v) for v in (middle[0], max(middle[1], 0.9), middle[2]) - gone)
                view.camera = player.Camera(target, yaw=yaw, pitch=8.0, distance=5.0)
                picture = Image.fromarray(view.frame(time)).convert("RGB")
                sheet.paste(picture, (column * SIZE[0], row * SIZE[1]))
    return sheet


def twists() -> Image.Image:
    """A stretched arm whose forearm and hand are twisted."""
    number = {bap.name: bap.number for bap in baps()}
    values = np.zeros((len(TWISTS), 296), dtype=np.int32)
    for frame, degrees in enumerate(TWISTS):
        for name, angle in {"l_shoulder_abduct": 75, **degrees}.items():
            values[frame, number[name] - 1] = round(float(np.radians(angle)) * 1e5)
    scene = player.Scene(
        Animation(1, np.arange(len(values)), body=BodyTrack(values, np.ones(values.shape, dtype=bool)))
    )
    sheet = Image.new("RGB", (600, 170 * len(values)))
    with player.Offscreen(scene, (600, 170), samples=4) as view:
        view.camera = player.Camera((0.48, 1.33, 0.0), yaw=10.0, pitch=5.0, distance=0.9)
        for frame in range(len(values)):
            picture = Image.fromarray(view.frame(float(frame))).convert("RGB")
            sheet.paste(picture, (0, 170 * frame))
    return sheet


def main() -> None:
    IMAGES.mkdir(exist_ok=True)
    clips().save(IMAGES / "clips.jpg", quality=88)
    twists().save(IMAGES / "twists.jpg", quality=88)


if __name__ == "__main__":
    main()
