"""Makes the picture of docs/virtual-markers.md: `python docs/make_marker_picture.py`.

Above, the built-in head as FAPs move it; below, as markers on its skin do, which know nothing of FAPs.
"""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
from PIL import Image

import fba
from fba.capture.markers.motion import MarkerMotion
from fba.capture.virtual_markers import head_of_model, propose_mapping
from fba.face import Deformer, FaceModel, resolve
from fba.face.feature_points import row_of
from fba_player.export.offscreen import Offscreen
from fba_player.scene.marker_editing import MarkerEditing
from fba_player.scene.markers_scene import MarkersScene
from fba_player.scene.scene import Scene
from fba_player.view.protocols import Showable

SAMPLES = Path(fba.__file__).resolve().with_name("samples")
TARGET = Path(__file__).with_name("images") / "virtual-markers.jpg"
MARKED = (
    "2.1", "2.10", "3.1", "3.2", "4.1", "4.2", "4.3", "4.4", "4.5", "4.6", "5.1", "5.2", "8.1", "8.2", "8.3",
    "8.4", "8.5", "8.6", "8.7", "8.8", "9.1", "9.2", "9.3", "9.12", "9.15", "10.9", "10.10", "11.1", "11.2",
    "11.3",
)  # fmt: skip
"""The markers of docs/virtual-markers.md."""
MOMENTS = (1.6, 3.1, 4.4, 6.2)
SIZE = (400, 460)


def capture(talk: fba.Animation) -> MarkerMotion:
    """Markers at feature points of the built-in head, while it says what the sample says."""
    assert talk.face is not None
    head = FaceModel.default()
    points = Deformer(head).feature_points(resolve(talk.face, head))
    positions = points[:, [row_of()[name] for name in MARKED]]
    times = talk.index / float(talk.rate)
    return MarkerMotion(MARKED, positions, times, Fraction(talk.rate), "m", "+y", "talk")


def draw(scene: Showable) -> Image.Image:
    """The scene at all moments, side by side."""
    with Offscreen(scene, SIZE, "front", samples=4) as offscreen:
        return Image.fromarray(np.hstack([offscreen.frame(time).copy() for time in MOMENTS])[..., :3])


def main() -> None:
    talk = fba.read(SAMPLES / "hello.fap")
    motion, head = capture(talk), head_of_model(FaceModel.default())
    editing = MarkerEditing(motion, head, propose_mapping(motion, head))
    editing.shows_weights = False
    moved = MarkersScene(editing)
    moved.place_cloud("over")
    moved.shows_current = False
    rows = [draw(Scene(talk)), draw(moved)]
    picture = Image.new("RGB", (rows[0].width, 2 * rows[0].height + 6), (34, 38, 44))
    for number, row in enumerate(rows):
        picture.paste(row, (0, number * (row.height + 6)))
    picture.save(TARGET, quality=84, optimize=True)


if __name__ == "__main__":
    main()
