"""Pictures of docs/emotion.md: expressions, their measures, and one performance in six moods."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import fba
from fba import Animation, FaceTrack, emotion
from fba.arrays import Float32, UInt8
from fba.emotion import Mood, emote
from fba_player.export._offscreen import Offscreen
from fba_player.export._sheet_layout import FAINT, PAPER, TEXT, lay_out
from fba_player.export.contact_sheet import close_up
from fba_player.scene.scene import Scene
from fba_player.view._camera import Camera
from fba_player.view._font import label_font

SAMPLE = Path(fba.__file__).with_name("samples") / "hello.fap"
MOODS = {"neutral": 0, "angry": 90, "surprised": 80, "sad": 90, "sleepy": 90, "happy": 80}
MOMENTS = (1.0, 2.8, 4.0, 7.6)
"""Seconds of the sample that are shown, one below the other."""
MOOD_TILE = 210
YAW = 10.0
"""Degrees: a head turned a little shows brows and cheeks better, and what is one-sided."""
COLUMNS, TILE = 7, 240
MIXTURES = (
    "fear=60 joy=30",
    "anger=70 sadness=60",
    "surprise=80 anger=60",
    "disgust=80 joy=50",
    "fear=60 terror=60",
)

TOLD = (
    "joy", "smile", "delight", "anger", "sternness", "sadness", "worry", "fear", "guilt", "disgust", "sneer",
    "contempt", "surprise", "unease", "anticipation",
)  # fmt: skip
"""Words whose faces are near each other."""
ORDER = 11
"""Seed of the order in which they are shown without names."""


def sheet(tiles: Sequence[tuple[str, str, Float32]], columns: int, size: int = TILE) -> Image.Image:
    """Faces with a name and a note below each."""
    letters = 15
    layout = lay_out(len(tiles), (size, size + 2 * letters + 14), columns)
    page = Image.new("RGB", layout.size, PAPER)
    draw = ImageDraw.Draw(page)
    font, small = label_font(letters), label_font(letters * 0.85)
    scene = Scene(Animation(25, np.arange(1), FaceTrack.empty(1)))
    with Offscreen(scene, (size, size), samples=4) as view:
        view.camera = Camera(yaw=YAW).fit(close_up("face", scene), 1.0)
        for (name, note, faps), (x, y) in zip(tiles, layout.corners, strict=True):
            page.paste(Image.fromarray(view.still(faps)[..., :3]), (x, y))
            draw.text((x + 3, y + size + 2), name, font=font, fill=TEXT)
            draw.text((x + 3, y + size + letters + 7), note, font=small, fill=FAINT)
    return page


def named() -> Image.Image:
    tiles = []
    for one in emotion.expressions():
        known = "" if one.point is None else f"{one.point[0]:g}, {one.point[1]:g}"
        tiles.append((one.name, "  ".join(filter(None, (one.family, known))), one.faps))
    return sheet(tiles, COLUMNS)


def told_apart() -> Image.Image:
    """Faces near each other, numbered, in an order of chance."""
    order = np.random.default_rng(ORDER).permutation(len(TOLD))
    return sheet([(str(k + 1), "", emotion.expression(TOLD[n]).faps) for k, n in enumerate(order)], 5, 300)


def told_apart_named() -> Image.Image:
    """The same faces with their names, in the order of `TOLD`; the number is that of the sheet without."""
    order = np.random.default_rng(ORDER).permutation(len(TOLD)).tolist()
    return sheet(
        [(word, str(order.index(n) + 1), emotion.expression(word).faps) for n, word in enumerate(TOLD)],
        5,
        300,
    )


def measured() -> Image.Image:
    shown = [(family, "shown: FAP 2", emotion.expression(family).faps) for family in emotion.FAMILIES]
    profiles = [(family, "measured: Table 8-4", emotion.measured_faps(family)) for family in emotion.FAMILIES]
    return sheet([*shown, *profiles], len(emotion.FAMILIES))


def mixtures() -> Image.Image:
    tiles = [(text, "", emotion.combine(emotion.parse_weights(text)).faps) for text in MIXTURES]
    point = emotion.expression_at(5.0, 4.4)
    tiles.append(("--at 5.0,4.4", str(point).replace("_", " "), point.faps))
    return sheet(tiles, len(tiles))


def moods() -> UInt8:
    animation = fba.read(SAMPLE)
    columns = []
    for name, intensity in MOODS.items():
        scene = Scene(emote(animation, [Mood(name, intensity)]))
        with Offscreen(scene, (MOOD_TILE, MOOD_TILE), samples=4) as view:
            columns.append(np.concatenate([view.frame(time)[..., :3] for time in MOMENTS]))
    return np.concatenate(columns, axis=1)
