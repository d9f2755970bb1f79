"""Makes the picture of styles of motion in docs/persona.md."""

from __future__ import annotations

from pathlib import Path

from PIL import Image, ImageDraw

from fba.animation import Animation
from fba.persona import animate_as, learn
from tools.persona import blind_test as blind
from tools.persona.actors import act

TARGET = Path(__file__).parents[1] / "images" / "persona-styles.jpg"
SCRIPT = (("E_SURPRISE", 0.9), ("E_HAPPY", 0.9), ("viseme 10 (A:)", 0.9), ("E_SADNESS", 1.0))
LONGER = 3
"""Times that the user performs the script, so that it is known how he moves."""
SIZE, MARGIN = (210, 240), 64


def main() -> None:
    """Draw a user's own way and three moods at the strongest moment of each expression."""
    user = act(SCRIPT * LONGER, seed=99)
    shown = {"the user": animate_as(user.face, None, head=False)}
    for number, (mood, style) in enumerate(blind.MOODS.items()):
        takes = [
            act(blind.script([number, take]), style, seed=blind.ACTOR, take=100 * number + take).face
            for take in range(blind.LEARNT)
        ]
        shown[mood] = animate_as(user.face, learn(takes, mood), head=False)
    peaks = [frame for _, frame in user.apex[-len(SCRIPT) :]]
    sheet = Image.new("RGB", (MARGIN + len(peaks) * SIZE[0], len(shown) * SIZE[1]), "white")
    draw = ImageDraw.Draw(sheet)
    for row, (name, animation) in enumerate(shown.items()):
        draw.text((6, row * SIZE[1] + SIZE[1] // 2), name, fill="black")
        for column, picture in enumerate(pictures(animation, peaks)):
            sheet.paste(picture, (MARGIN + column * SIZE[0], row * SIZE[1]))
    sheet.save(TARGET, quality=85, optimize=True)


def pictures(animation: Animation, frames: list[int]) -> list[Image.Image]:
    """Return the built-in head at some frames."""
    from fba import player

    with player.Offscreen(animation, SIZE, camera="front", samples=4) as view:
        return [Image.fromarray(view.frame(frame / float(animation.rate))[..., :3]) for frame in frames]
