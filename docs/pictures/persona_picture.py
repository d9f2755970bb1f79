"""Picture of docs/persona.md."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from fba import player
from fba.animation import Animation
from fba.arrays import Float64
from fba.persona import ClassRecogniser, animate_as, learn
from fba.persona._observation import observe
from fba.persona.points.layout import TRACKED, flat_mask, standard_mask, triangles
from tools.persona.actors import Act, act, all_contents, named_styles

TARGET = Path(__file__).parents[1] / "images" / "persona.jpg"
SIZE, SCALE = (210, 240), 1.45
SCRIPT = (
    ("E_HAPPY", 1.1), ("viseme 10 (A:)", 1.0), ("LFAU_18", 1.0), ("E_SURPRISE", 0.9), ("E_ANGER", 1.0),
    ("E_SADNESS", 1.1),
)  # fmt: skip
ACTORS = ("asymmetry", "tragedian")


def main() -> None:
    """Draw a user's points and mask, the user's own way, and the ways of two actors."""
    user = act(SCRIPT, seed=99)
    shown = [animate_as(user.face, None, head=False)]
    for number, name in enumerate(ACTORS):
        script = all_contents(2, np.random.default_rng(number))
        actor = learn([act(script, named_styles()[name], seed=20 + number).face], name)
        shown.append(animate_as(user.face, actor, head=False))
    sheet = Image.new("RGB", (len(SCRIPT) * SIZE[0], (1 + len(shown)) * SIZE[1]), "white")
    for column, picture in enumerate(draw_masks(user)):
        sheet.paste(picture, (column * SIZE[0], 0))
    for row, animation in enumerate(shown, 1):
        for column, picture in enumerate(render(animation, user)):
            sheet.paste(picture, (column * SIZE[0], row * SIZE[1]))
    sheet.save(TARGET, quality=88, optimize=True)


def render(animation: Animation, user: Act) -> list[Image.Image]:
    """Return the built-in head at the strongest moment of each expression."""
    with player.Offscreen(animation, SIZE, camera="front", samples=4) as view:
        rate = float(user.face.rate)
        return [Image.fromarray(view.frame(frame / rate)[..., :3]) for _, frame in user.apex]


def draw_masks(user: Act) -> list[Image.Image]:
    """Return the user's mask over the tracked points at the strongest moment of each expression."""
    seen = observe(user.face, ClassRecogniser.default())
    pictures = []
    for _, frame in user.apex:
        points = seen.points[np.searchsorted(seen.rows, frame)]
        picture = Image.new("RGB", SIZE, "white")
        draw = ImageDraw.Draw(picture)
        mask = place(flat_mask(points)[:, :2])
        for one in triangles():
            draw.polygon([tuple(corner) for corner in mask[one].tolist()], outline="#bbb")
        for x, y in place(points[:TRACKED]).tolist():
            draw.ellipse((x - 1.5, y - 1.5, x + 1.5, y + 1.5), fill="#c22")
        pictures.append(picture)
    return pictures


def place(points: Float64) -> Float64:
    """Return where points of the mask, millimetres, are in a picture."""
    middle = (standard_mask()[:, :2].min(axis=0) + standard_mask()[:, :2].max(axis=0)) / 2
    return np.asarray((points - middle) * (SCALE * 0.85, -SCALE * 0.85) + np.array(SIZE) / 2)
