"""`photo_sheet`: how points were found on photographs, the points, and the head that was made of them."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from PIL import Image, ImageDraw

from fba.animation import Animation
from fba.arrays import UInt8
from fba.errors import FbaWarning
from fba.face.fitting import Photo, PhotoHead, Step
from fba.parameters import FAP_COUNT
from fba.tracks import FaceTrack
from fba_player.export._offscreen import Offscreen
from fba_player.export._sheet_layout import PAPER, TEXT, lay_out
from fba_player.scene.scene import Scene
from fba_player.view._camera import Camera

CELL = (360, 440)
LABEL = 18
DOT = (40, 220, 90)
SPEAKING: dict[int, float] = {3: 420, 4: -90, 5: -320, 8: -60, 9: -60, 10: -220, 11: -220}
VIEWS: tuple[tuple[str, float, dict[int, float]], ...] = (
    ("from the front", 0.0, {}), ("three-quarter", 40.0, {}), ("profile", 90.0, {}),
    ("speaking", -15.0, SPEAKING),
)  # fmt: skip
"""Titles, degrees around the head and FAPs of the pictures of the finished head."""


def photo_sheet(photos: Sequence[Photo], head: PhotoHead, steps: Sequence[Step] = ()) -> UInt8:
    """Return a picture, uint8 (H, W, 3): the steps, the photographs with their points, the head.

    Raises DisplayError without OpenGL.
    """
    cells = [(step.title, Image.fromarray(step.pixels)) for step in steps]
    cells += [(photo.photograph.name, _with_points(photo)) for photo in photos]
    scene = Scene(Animation(Fraction(25), np.arange(1), FaceTrack.empty(1)), model=head.model)
    with warnings.catch_warnings(action="ignore", category=FbaWarning), Offscreen(scene, CELL) as view:
        for title, yaw, values in VIEWS:
            faps = np.zeros(FAP_COUNT)
            for number, value in values.items():
                faps[number - 1] = value
            view.camera = Camera(yaw=yaw).fit(scene.face_subject, CELL[0] / CELL[1])
            cells.append((title, Image.fromarray(view.still(faps)[..., :3])))
    layout = lay_out(len(cells), (CELL[0], CELL[1] + LABEL), min(len(cells), 5))
    sheet = Image.new("RGB", layout.size, PAPER)
    pen = ImageDraw.Draw(sheet)
    for (title, picture), (x, y) in zip(cells, layout.corners, strict=True):
        factor = min(CELL[0] / picture.width, CELL[1] / picture.height)
        fitted = (max(round(picture.width * factor), 1), max(round(picture.height * factor), 1))
        small = picture.convert("RGB").resize(fitted)
        sheet.paste(small, (x + (CELL[0] - small.width) // 2, y + LABEL))
        pen.text((x + 4, y + 3), title[:58], fill=TEXT)
    return np.asarray(sheet)


def _with_points(photo: Photo) -> Image.Image:
    """Return the photograph, small, with its points."""
    picture = Image.fromarray(photo.photograph.pixels)
    picture.thumbnail(CELL)
    pen = ImageDraw.Draw(picture)
    factor = picture.width / photo.photograph.size[0]
    for x, y in photo.points.values():
        pen.ellipse([x * factor - 2, y * factor - 2, x * factor + 2, y * factor + 2], fill=DOT)
    return picture
