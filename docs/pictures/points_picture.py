"""Picture of docs/capture-points.md."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from PIL import Image, ImageDraw

import fba
from fba import player
from fba.arrays import Float64
from fba.capture import from_points
from tools.captures.heads import other_head
from tools.captures.performances import perform_track
from tools.captures.tracked_actor import film

TARGET = Path(__file__).parents[1] / "images" / "capture-points.jpg"
SIZE = (200, 230)
SCALE = 2
TIMES = (0.2, 2.0, 3.5, 5.2, 7.2, 9.0)
LINES = (
    (17, 19, 21), (22, 24, 26), range(27, 31), (31, 33, 35), (*range(36, 42), 36), (*range(42, 48), 42),
    (*range(48, 60), 48), (*range(60, 68), 60),
)  # fmt: skip
"""Points that are drawn as one line: brows, nose, eyes, lips."""
CHIN, PUPILS = 8, (68, 69)
MIDDLE = (27, 33)
"""Points in whose middle the picture has its own."""
ACROSS = 0.52
"""Share of the picture's width between the outer corners of the eyes, where the face looks ahead."""


def main() -> None:
    """Draw the points of a film, and below it the built-in head that the stream moves."""
    talk = perform_track(fba.read(files("fba") / "samples" / "hello.fap"), 30)
    take = film(other_head(), 70, flat=True, performed=talk, turn=0.7)
    found = from_points(take.motion, neutral="first")
    eyes = take.motion.positions[0, [36, 45], 0]
    scale = SCALE * SIZE[0] * ACROSS / float(eyes[1] - eyes[0])
    sheet = Image.new("RGB", (len(TIMES) * SIZE[0], 2 * SIZE[1]))
    with player.Offscreen(found, SIZE, camera="front", samples=4) as view:
        for column, time in enumerate(TIMES):
            left = column * SIZE[0]
            points = take.motion.positions[round(time * float(take.motion.rate))]
            sheet.paste(draw(points, scale), (left, 0))
            sheet.paste(Image.fromarray(view.frame(time)[..., :3]), (left, SIZE[1]))
    sheet.save(TARGET, quality=88, optimize=True)


def draw(points: Float64, scale: float) -> Image.Image:
    """Return a picture of 70 points, (70, 2) pixels of a film, times a scale."""
    picture = Image.new("RGB", (SCALE * SIZE[0], SCALE * SIZE[1]), (24, 26, 30))
    pen = ImageDraw.Draw(picture)
    at = (points - points[list(MIDDLE)].mean(axis=0)) * scale + (SCALE * SIZE[0] / 2, SCALE * SIZE[1] * 0.48)
    for line in LINES:
        pen.line([tuple(at[number].tolist()) for number in line], fill=(120, 230, 140), width=3)
    for number in {number for line in LINES for number in line} | {CHIN}:
        x, y = at[number].tolist()
        pen.ellipse((x - 3, y - 3, x + 3, y + 3), fill=(240, 250, 240))
    for number in PUPILS:
        x, y = at[number].tolist()
        pen.ellipse((x - 6, y - 6, x + 6, y + 6), fill=(110, 180, 250))
    return picture.resize(SIZE, Image.Resampling.LANCZOS)
