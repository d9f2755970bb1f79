"""A sheet of frames of an animation at even distances in time, each with its time code."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from fba.animation import Animation
from fba.arrays import UInt8
from fba.errors import RangeError
from fba_player.export.offscreen import Offscreen
from fba_player.export.render import as_scene, check_inside
from fba_player.playback.timeline import timecode
from fba_player.view.camera import Camera
from fba_player.view.font import label_font, shortened
from fba_player.view.protocols import Showable

Progress = Callable[[int, int], None]

TILE = (320, 240)
"""Default width and height of one picture in pixels."""
SHAPE = 16 / 10
"""Width / height that a sheet should have."""
MOST_PIXELS = 200_000_000
SMALLEST = 16
SAMPLES = 4
TEXT, FAINT, PAPER = (232, 235, 240), (158, 165, 175), (34, 37, 43)
SPACE = 4
"""Pixels between pictures."""


def film_sheet(
    subject: Animation | Showable,
    count: int,
    *,
    tile: tuple[int, int] | None = None,
    camera: Camera | str | None = None,
    start: float | None = None,
    end: float | None = None,
    progress: Progress | None = None,
) -> UInt8:
    """Draw a sheet of frames of an animation with their time codes: uint8 (H, W, 3), sRGB.

    count: number of frames, including the first and the last; at most all. tile: width and height of one
    picture in pixels, by default 320x240. camera: as in `Offscreen`. start, end: the part to show, in
    seconds. progress: called with (done, total) pictures.

    Raises ValueError for a count below 1, pictures below 16x16 or a sheet that would be too large, RangeError
    if no frame lies between start and end, DisplayError where there is no OpenGL.
    """
    scene = as_scene(subject)
    size = tile or TILE
    if count < 1:
        raise ValueError(f"a contact sheet has at least one picture, not {count}")
    if min(size) < SMALLEST:
        raise ValueError(f"a picture of a contact sheet must have at least 16x16 pixels, not {size}")
    frames = choose_frames(scene, count, start, end)
    width, height = size
    letters = max(min(width // 20, 16), 7)
    step = (width + SPACE, height + round(letters * 1.6) + SPACE)
    columns = choose_columns(len(frames), step)
    rows = -(-len(frames) // columns)
    sheet_size = (columns * step[0] + SPACE, rows * step[1] + SPACE)
    if sheet_size[0] * sheet_size[1] > MOST_PIXELS:
        raise ValueError(
            f"{len(frames)} pictures of {width}x{height} make a sheet of {sheet_size[0]}x{sheet_size[1]} "
            "pixels, too large to be one: choose fewer, or a smaller size"
        )
    return _draw_sheet(scene, frames, size, camera, (columns, *sheet_size, letters), progress)


def choose_frames(scene: Showable, count: int, start: float | None, end: float | None) -> list[int]:
    """Choose frames at even distances in time: positions in the animation, ascending, without repeats."""
    timeline = scene.timeline
    times = np.array([float(timeline.time_of(frame)) for frame in range(timeline.frames)])
    for name, value in (("start", start), ("end", end)):
        if value is not None and math.isfinite(value):
            check_inside(scene, name, value)
    low = -math.inf if start is None else start
    high = math.inf if end is None else end
    if math.isnan(low) or math.isnan(high):
        raise ValueError("start and end must be numbers of seconds")
    inside = np.flatnonzero((times >= low - 1e-9) & (times <= high + 1e-9))
    if not len(inside):
        raise RangeError(
            f"no frame lies between {low:g} s and {high:g} s; the animation goes from {times[0]:g} s to "
            f"{times[-1]:g} s"
        )
    wanted = np.linspace(times[inside[0]], times[inside[-1]], count)
    after = np.clip(np.searchsorted(times, wanted), inside[0], inside[-1])
    before = np.maximum(after - 1, inside[0])
    nearer = np.where(wanted - times[before] < times[after] - wanted, before, after)
    return [int(frame) for frame in np.unique(nearer)]


def choose_columns(count: int, step: tuple[int, int]) -> int:
    """Number of columns for a sheet a little wider than high, with few empty cells. step: size of a cell."""
    ideal = math.sqrt(count * SHAPE * step[1] / step[0])
    candidates = range(max(math.floor(ideal * 0.8), 1), min(math.ceil(ideal * 1.3), count) + 1)
    return min(candidates or (count,), key=lambda columns: (-count % columns / count, abs(columns - ideal)))


def _draw_sheet(
    scene: Showable,
    frames: list[int],
    size: tuple[int, int],
    camera: Camera | str | None,
    layout: tuple[int, int, int, int],
    progress: Progress | None,
) -> UInt8:
    from PIL import Image, ImageDraw

    columns, wide, high, letters = layout
    sheet = Image.new("RGB", (wide, high), PAPER)
    draw = ImageDraw.Draw(sheet)
    font = label_font(letters)
    line = round(letters * 1.6)
    with Offscreen(scene, size, camera, samples=SAMPLES) as view:
        for number, frame in enumerate(frames):
            x = SPACE + number % columns * (size[0] + SPACE)
            y = SPACE + number // columns * (size[1] + line + SPACE)
            time = scene.timeline.time_of(frame)
            sheet.paste(Image.fromarray(view.frame(float(time))[..., :3]), (x, y))
            code, where = timecode(float(time), scene.timeline.rate), f"frame {frame}"
            below = y + size[1] + 1
            draw.text((x + 2, below), shortened(draw, code, font, size[0]), font=font, fill=TEXT)
            room = size[0] - draw.textlength(code, font=font) - draw.textlength(where, font=font)
            if room > 2 * letters:
                draw.text((x + size[0] - 2, below), where, font=font, fill=FAINT, anchor="ra")
            if progress is not None:
                progress(number + 1, len(frames))
    return np.asarray(sheet)
