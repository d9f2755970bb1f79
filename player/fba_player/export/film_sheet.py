"""A sheet of frames of an animation at even distances in time, each with its time code."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from fba.animation import Animation
from fba.arrays import UInt8
from fba.errors import RangeError
from fba_player.export._offscreen import Offscreen
from fba_player.export._sheet_layout import FAINT, PAPER, TEXT, check_tile, lay_out
from fba_player.export.render import as_scene, check_inside
from fba_player.playback._timeline import timecode
from fba_player.view._camera import Camera
from fba_player.view._font import label_font, shortened
from fba_player.view.protocols import Showable

Progress = Callable[[int, int], None]

TILE = (320, 240)
"""Default width and height of one picture in pixels."""


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
    """Return a sheet of frames of an animation with their time codes: uint8 (H, W, 3), sRGB.

    count: number of frames, including the first and the last; at most all. tile: width and height of one
    picture in pixels, by default 320x240. camera: as in `Offscreen`. start, end: the part to show, in
    seconds. progress: called with (done, total) pictures.

    Raises ValueError for a count below 1, pictures below 16x16 or a sheet that would be too large, RangeError
    if no frame lies between start and end, DisplayError where there is no OpenGL.
    """
    from PIL import Image, ImageDraw

    scene = as_scene(subject)
    size = tile or TILE
    if count < 1:
        raise ValueError(f"a contact sheet has at least one picture, not {count}")
    check_tile(size)
    frames = choose_frames(scene, count, start, end)
    width, height = size
    letters = max(min(width // 20, 16), 7)
    layout = lay_out(len(frames), (width, height + round(letters * 1.6)))
    sheet = Image.new("RGB", layout.size, PAPER)
    draw = ImageDraw.Draw(sheet)
    font = label_font(letters)
    with Offscreen(scene, size, camera) as view:
        for number, (frame, (x, y)) in enumerate(zip(frames, layout.corners, strict=True)):
            time = scene.timeline.time_of(frame)
            sheet.paste(Image.fromarray(view.frame(float(time))[..., :3]), (x, y))
            code, where = timecode(float(time), scene.timeline.rate), f"frame {frame}"
            below = y + height + 1
            draw.text((x + 2, below), shortened(draw, code, font, width), font=font, fill=TEXT)
            room = width - draw.textlength(code, font=font) - draw.textlength(where, font=font)
            if room > 2 * letters:
                draw.text((x + width - 2, below), where, font=font, fill=FAINT, anchor="ra")
            if progress is not None:
                progress(number + 1, len(frames))
    return np.asarray(sheet)


def choose_frames(scene: Showable, count: int, start: float | None, end: float | None) -> list[int]:
    """Return frames at even distances in time: positions in the animation, ascending, without repeats."""
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
