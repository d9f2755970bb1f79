"""Picture of docs/virtual-markers.md.

A sample capture on the built-in head: above by FAPs, below by virtual markers, which know nothing of FAPs.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

import fba
from fba.capture import MarkerMotion, from_markers
from fba.capture.virtual_markers import propose_mapping, read_head
from fba.formats import read_face
from fba_player.export._offscreen import Offscreen
from fba_player.scene.marker_editing import MarkerEditing
from fba_player.scene.markers_scene import MarkersScene
from fba_player.scene.scene import Scene
from fba_player.view.protocols import Showable

SAMPLE = Path(fba.__file__).resolve().with_name("samples") / "talk.c3d"
TARGET = Path(__file__).parents[1] / "images" / "virtual-markers.jpg"
MOMENTS = (1.6, 2.6, 3.7, 4.9)
SIZE = (400, 460)


def edit(motion: MarkerMotion) -> MarkerEditing:
    """The capture on the built-in head, with the proposed mapping."""
    head = read_head()
    return MarkerEditing(motion, head, propose_mapping(motion, head), Path("mapping.toml"))


def draw(scene: Showable) -> Image.Image:
    """The scene at all moments, side by side."""
    with Offscreen(scene, SIZE, "front", samples=4) as offscreen:
        return Image.fromarray(np.hstack([offscreen.frame(time).copy() for time in MOMENTS])[..., :3])


def main() -> None:
    motion = read_face(SAMPLE)
    moved = MarkersScene(edit(motion))
    moved.editing.shows_weights = False
    moved.place_cloud("over")
    moved.shows_current = False
    rows = [draw(Scene(from_markers(motion, head_path=False))), draw(moved)]
    picture = Image.new("RGB", (rows[0].width, 2 * rows[0].height + 6), (34, 38, 44))
    for number, row in enumerate(rows):
        picture.paste(row, (0, number * (row.height + 6)))
    picture.save(TARGET, quality=84, optimize=True)
