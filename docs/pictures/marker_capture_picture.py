"""Picture of docs/capture-markers.md.

Above, the head that performs talk.c3d; below it, the built-in head as the stream of its markers moves it;
then curves of some FAPs, as performed (grey) and as they come from the markers.
"""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import fba
from fba import player
from fba.animation import Animation
from fba.face import FaceModel
from tools.captures.heads import other_head
from tools.captures.marked_actor import as_face
from tools.captures.performances import HEAD, head_motion, perform_track

TARGET = Path(__file__).parents[1] / "images" / "capture-markers.jpg"
SAMPLES = Path(fba.__file__).parent / "samples"
RATE = 50
SIZE = (240, 250)
SECONDS = (0.2, 1.96, 2.6, 3.4, 4.5, 5.5)
CURVES = {3: "open_jaw", 51: "lower_t_midlip_o", 59: "raise_l_cornerlip_o", 31: "raise_l_i_eyebrow",
          19: "close_t_l_eyelid", 49: "head_yaw"}  # fmt: skip
HEIGHT = 46
GREY, RED, INK = (150, 150, 150), (190, 30, 40), (20, 20, 20)


def main() -> None:
    """Draw the picture."""
    performed = perform_track(fba.read(SAMPLES / "hello.fap"), RATE)[: RATE * 6]
    performed[:, HEAD] = head_motion(len(performed), RATE)[0] / 1e-5
    found = fba.read(SAMPLES / "talk.c3d", neutral="first", head_path=False)
    width = len(SECONDS) * SIZE[0]
    sheet = Image.new("RGB", (width, 2 * SIZE[1] + len(CURVES) * HEIGHT), (255, 255, 255))
    for row, (animation, head) in enumerate(
        ((as_face(performed, Fraction(RATE)), other_head()), (found, FaceModel.default()))
    ):
        draw_heads(sheet, row * SIZE[1], animation, head)
    assert found.face is not None
    draw_curves(sheet, 2 * SIZE[1], performed, found.face.values)
    sheet.save(TARGET, quality=88, optimize=True)


def draw_heads(sheet: Image.Image, top: int, animation: Animation, head: FaceModel) -> None:
    """Draw a row of pictures of a head."""
    scene = player.Scene(animation, head)
    with player.Offscreen(scene, SIZE, camera="front", samples=4) as view:
        for column, second in enumerate(SECONDS):
            picture = Image.fromarray(view.frame(second)[..., :3])
            sheet.paste(picture, (column * SIZE[0], top))


def draw_curves(sheet: Image.Image, top: int, performed: np.ndarray, found: np.ndarray) -> None:
    """Draw a row of curves for each FAP of `CURVES`, and lines where the pictures are."""
    draw = ImageDraw.Draw(sheet)
    across = np.linspace(0, sheet.width - 1, len(performed))
    for second in SECONDS:
        x = second * RATE / (len(performed) - 1) * (sheet.width - 1)
        draw.line([(x, top), (x, sheet.height)], fill=(225, 225, 225))
    for row, (fap, name) in enumerate(CURVES.items()):
        both = [values[:, fap - 1].astype(float) for values in (performed, found)]
        low, high = min(each.min() for each in both), max(each.max() for each in both)
        for values, colour, thick in zip(both, (GREY, RED), (5, 1), strict=True):
            y = top + (row + 1) * HEIGHT - 6 - (values - low) / max(high - low, 1.0) * (HEIGHT - 18)
            draw.line(list(zip(across.tolist(), y.tolist(), strict=True)), fill=colour, width=thick)
        draw.text((4, top + row * HEIGHT + 1), f"{fap} {name}", fill=INK)
