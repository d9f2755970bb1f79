"""Pictures of docs/body-models.md, and sheets of frames of recordings, for docs/play.md and the README.

The clips are real recordings, read from the shared material (FBA_SHARED, else ../shared beside the checkout).
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from PIL import Image

import fba
from fba import Animation, BodyTrack, player
from fba.arrays import UInt8
from fba.body import gait
from fba.parameters import baps
from fba_player.export.film_sheet import film_sheet

SHARED = Path(os.environ.get("FBA_SHARED") or Path(__file__).parents[3] / "shared")
CLIPS = (
    ("greta/Dance.bvh", 25.0, (0.12, 0.23, 0.45, 0.66, 0.77)),
    ("greta/c-Walkaround.bvh", 30.0, (0.35, 0.45, 0.55, 0.75, 0.85)),
    ("greta/c-ladder.bvh", 50.0, (0.23, 0.28, 0.34, 0.77, 0.88)),
    ("vreng/clap.bap", 25.0, (0.40, 0.56, 0.66, 0.77, 0.98)),
)
"""Clip, the camera's yaw, and the moments shown, as shares of the clip."""
SIZE = (240, 340)
LINES = (360, 720, 1080)
POSTURES = (
    ({"?_shoulder_abduct": 165}, 20.0, (0.0, 1.45, 0.0), 2.1),
    ({"?_shoulder_flexion": 90, "?_elbow_flexion": 30}, 140.0, (0.0, 1.25, 0.1), 2.1),
    ({"?_elbow_flexion": 140, "?_shoulder_abduct": 25}, 40.0, (0.15, 1.2, 0.0), 1.9),
    ({"skullbase_tilt": 15, "vc2_tilt": 10, "vc4_tilt": 10, "vc6_tilt": 10}, 60.0, (0.0, 1.5, 0.0), 1.2),
    ({"?_hip_flexion": 90, "?_knee_flexion": -90, "?_elbow_flexion": 55}, 50.0, (0.0, 0.75, 0.2), 3.2),
    ({"?_hip_flexion": 120, "?_knee_flexion": -140, "?_hip_abduct": 20, "?_shoulder_flexion": 70,
      "vl3_tilt": -12, "vl1_tilt": -12, "?_ankle_flexion": 20}, 35.0, (0.1, 0.8, 0.1), 2.9),
    ({"l_hip_flexion": 90, "l_knee_flexion": -75, "r_hip_flexion": -12, "r_elbow_flexion": 80,
      "r_shoulder_flexion": 35, "l_shoulder_flexion": -40, "l_elbow_flexion": 60}, 60.0, (0, 0.85, 0.1), 3.6),
    ({"vl1_tilt": -12, "vl3_tilt": -12, "vl5_tilt": -12, "vt11_tilt": -8, "?_hip_flexion": 35,
      "?_shoulder_flexion": 60}, 60.0, (0.0, 0.95, 0.2), 3.4),
)  # fmt: skip
"""Degrees of BAPs by name (of both sides where it begins with ?), the camera's yaw, target and distance."""
TWISTS = ({}, {"l_elbow_twisting": 90}, {"l_elbow_twisting": -150}, {"l_wrist_twisting": 90},
          {"l_wrist_twisting": -150})  # fmt: skip
"""Degrees of BAPs by name."""


def bodies() -> Image.Image:
    """Somebody dancing, walking and sitting, at 360 lines, and a part of each at 720 and at 1080 lines."""
    dance, walk = fba.read(SHARED / "data" / "greta/Dance.bvh"), gait.walk(cycles=1, in_place=True)
    rows = ((dance, 660, 25.0), (walk, 4, 60.0), (_posed([POSTURES[4][0]]), 0, 50.0))
    wide, high = SIZE[0], LINES[0]
    sheet = Image.new("RGB", (wide * len(LINES), high * len(rows)))
    for row, (animation, frame, yaw) in enumerate(rows):
        scene = player.Scene(animation)
        time = float(scene.start) + frame / float(animation.rate)
        places = np.concatenate([mesh.positions for mesh in scene.view_at(time).faces])
        middle = (places.min(axis=0) + places.max(axis=0)) / 2 - np.array(scene.travel(time))
        x, y, z = middle.tolist()
        camera = player.Camera((x, y, z), yaw=yaw, pitch=6.0, distance=4.3)
        for column, lines in enumerate(LINES):
            with player.Offscreen(scene, (lines * wide // high, lines), camera, samples=4) as view:
                picture = Image.fromarray(view.frame(time)).convert("RGB")
            left, top = (picture.width - wide) // 2, (picture.height - high) // 2
            sheet.paste(picture.crop((left, top, left + wide, top + high)), (column * wide, row * high))
    return sheet


def clips() -> Image.Image:
    """Somebody dancing, walking about, climbing and clapping."""
    sheet = Image.new("RGB", (SIZE[0] * 5, SIZE[1] * len(CLIPS)))
    for row, (name, yaw, moments) in enumerate(CLIPS):
        scene = player.Scene(fba.read(SHARED / "data" / name))
        with player.Offscreen(scene, SIZE, samples=4) as view:
            for column, share in enumerate(moments):
                time = float(scene.start) + share * float(scene.duration)
                places = np.concatenate([mesh.positions for mesh in scene.view_at(time).faces])
                middle = (places.min(axis=0) + places.max(axis=0)) / 2
                gone = np.array(scene.travel(time))  # the camera adds this
                target = tuple(float(v) for v in (middle[0], max(middle[1], 0.9), middle[2]) - gone)
                view.camera = player.Camera(target, yaw=yaw, pitch=8.0, distance=5.4)
                picture = Image.fromarray(view.frame(time)).convert("RGB")
                sheet.paste(picture, (column * SIZE[0], row * SIZE[1]))
    return sheet


def postures() -> Image.Image:
    """Raised arms, bent elbows, the head thrown back, sitting, squatting, striding, bowing."""
    scene = player.Scene(_posed([degrees for degrees, *_ in POSTURES]))
    sheet = Image.new("RGB", (SIZE[0] * 4, SIZE[1] * 2))
    with player.Offscreen(scene, SIZE, samples=4) as view:
        for frame, (_, yaw, target, distance) in enumerate(POSTURES):
            view.camera = player.Camera(target, yaw=yaw, pitch=8.0, distance=distance)
            picture = Image.fromarray(view.frame(float(frame))).convert("RGB")
            sheet.paste(picture, (frame % 4 * SIZE[0], frame // 4 * SIZE[1]))
    return sheet


def _posed(postures: list[dict[str, int]]) -> Animation:
    """An animation of a frame for each posture, degrees of BAPs by name."""
    number = {bap.name: bap.number for bap in baps()}
    values = np.zeros((len(postures), 296), dtype=np.int32)
    for frame, degrees in enumerate(postures):
        for name, angle in degrees.items():
            for side in "lr" if name.startswith("?") else " ":
                # limbs of the right side open to the other side
                sign = -1 if side == "r" and name.endswith("_abduct") else 1
                values[frame, number[name.replace("?", side)] - 1] = round(np.radians(sign * angle) * 1e5)
    return Animation(1, np.arange(len(values)), body=BodyTrack(values, np.ones(values.shape, dtype=bool)))


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
