"""Several performances side by side, each with its name below: as a film or a picture."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from fba.animation import Animation
from fba.arrays import UInt8
from fba.atomic import PathLike
from fba.errors import UnsupportedError
from fba_player.export._offscreen import Offscreen
from fba_player.export._recorder import FILMS, Recorder
from fba_player.export._sheet_layout import PAPER, TEXT, check_tile, lay_out
from fba_player.export.image_files import PICTURES, write_picture
from fba_player.export.render import as_scene, film_rate
from fba_player.view._camera import Camera
from fba_player.view._font import label_font, shortened
from fba_player.view.protocols import Showable

Progress = Callable[[int, int], None]

TILE = (320, 320)
"""Default width and height of one performance in pixels."""


def draw_side_by_side(
    performances: Mapping[str, Animation | Showable],
    path: PathLike,
    *,
    tile: tuple[int, int] | None = None,
    camera: Camera | str | None = None,
    progress: Progress | None = None,
) -> Path:
    """Draw performances in a grid, each from its own beginning; return the path.

    performances: by the name that is written below. path: .mp4 or .gif for a film, as long as the longest
    performance and at the rate of the first; .png or .jpg for a picture of their middles. tile: width and
    height of each in pixels, by default 320x320. camera: as in `Offscreen`. progress: called with
    (done, total) pictures.

    Raises UnsupportedError for another suffix, ValueError where there are no performances or the picture
    would be too large or too small, DisplayError without OpenGL or video encoder, FormatError if the file
    cannot be written.
    """
    suffix = os.path.splitext(os.fspath(path))[1].lower()
    if suffix not in FILMS + PICTURES:
        text = f"{path}: write {', '.join(FILMS + PICTURES)}"
        raise UnsupportedError(text, what=f"{suffix or 'no'} suffix")
    if not performances:
        raise ValueError("there is no performance to draw")
    scenes = {name: as_scene(performance) for name, performance in performances.items()}
    size = tile or TILE
    check_tile(size)
    with ExitStack() as stack:
        grid = _Grid(list(scenes), size)
        drawn = (Offscreen(scene, size, camera) for scene in scenes.values())
        views = [stack.enter_context(view) for view in drawn]
        if suffix in PICTURES:
            middles = [scene.timeline.time_of(scene.timeline.frames // 2) for scene in scenes.values()]
            pixels = grid.draw([v.frame(float(time)) for v, time in zip(views, middles, strict=True)])
            write_picture(path, pixels)
            return Path(path)
        rate = film_rate(next(iter(scenes.values())).timeline.rate)
        timelines = [scene.timeline for scene in scenes.values()]
        count = max(round((t.end - t.start) * rate) for t in timelines) or 1
        recorder = stack.enter_context(Recorder(path, grid.size, rate=rate))
        for number in range(count):
            times = [min(t.start + number / rate, t.end) for t in timelines]
            pictures = [view.draw(float(time)) for view, time in zip(views, times, strict=True)]
            recorder.add(grid.draw(pictures))
            if progress is not None:
                progress(number + 1, count)
        result = recorder.close()
    assert result is not None
    return result


class _Grid:
    """Cells with names below them. size: width and height of the whole."""

    def __init__(self, names: list[str], tile: tuple[int, int]) -> None:
        from PIL import Image, ImageDraw

        letters = max(min(tile[0] // 18, 22), 7)
        layout = lay_out(len(names), (tile[0], tile[1] + round(letters * 1.6)))
        wide, high = layout.size
        self.size = (wide + wide % 2, high + high % 2)  # films need even sizes
        self._corners = layout.corners
        paper = Image.new("RGB", self.size, PAPER)
        draw = ImageDraw.Draw(paper)
        font = label_font(letters)
        for name, (x, y) in zip(names, self._corners, strict=True):
            text = shortened(draw, name, font, tile[0])
            draw.text((x + tile[0] / 2, y + tile[1] + 1), text, font=font, fill=TEXT, anchor="ma")
        self._paper = np.asarray(paper)

    def draw(self, pictures: list[UInt8]) -> UInt8:
        """Return the whole, uint8 (H, W, 3), with a picture in every cell."""
        pixels = self._paper.copy()
        for picture, (x, y) in zip(pictures, self._corners, strict=True):
            pixels[y : y + picture.shape[0], x : x + picture.shape[1]] = picture[..., :3]
        return pixels
