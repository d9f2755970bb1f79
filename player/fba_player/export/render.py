"""Rendering of animations to files: pictures, films, numbered pictures."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any

from fba.animation import Animation
from fba.atomic import PathLike
from fba.errors import FbaError, RangeError, UnsupportedError
from fba_player.export._offscreen import Offscreen
from fba_player.export._recorder import FILMS, Recorder, exact_rate
from fba_player.export.image_files import (
    PICTURES,
    Numbered,
    Sequence,
    check_picture,
    is_film,
    is_sequence,
    write_picture,
)
from fba_player.scene.scene import Scene
from fba_player.view._camera import Camera
from fba_player.view.protocols import Showable

Progress = Callable[[int, int], None]

__all__ = ["film_rate", "record", "render", "write_picture"]

SMOOTH_RATES = (Fraction(10), Fraction(60))
"""Frames per second, least and most, of a film for which no rate is given: screens show no more than 60."""
MAX_FILM_FRAMES = 1_000_000
"""Most frames of a film: a longer one comes from damaged times, or a part of it was meant."""
SLACK = 0.001
"""Seconds that a given time may lie outside the animation: people round times."""
SIZE = (1280, 720)
GIF_SIZE = (480, 270)
"""Default sizes in pixels; a GIF of full size would be huge."""


def render(
    animation: Animation | Showable,
    path: PathLike,
    *,
    size: tuple[int, int] | None = None,
    rate: Fraction | int | str | None = None,
    camera: Camera | str | None = None,
    frame: int | None = None,
    time: float | None = None,
    start: float | None = None,
    end: float | None = None,
    audio: PathLike | None = None,
    audio_offset: float = 0.0,
    transparent: bool = False,
    replace: bool = False,
    progress: Progress | None = None,
) -> Path:
    """Render an animation to a file, without a window; the name decides the format. Returns the path.

    .png or .jpg: one picture. .mp4 or .gif: a film. frames/%05d.png, or a folder with a slash at its end:
    numbered pictures, from 0.

    size: width and height in pixels; by default 1280x720, of a GIF 480x270. camera: a `Camera`, one of
    `Camera.presets`, or None for the one that suits the content. For a picture: frame,
    its position in the animation (negative from the end), or time in seconds; by default the first frame.
    For a film: rate (by default the rate of the animation), and start and end in seconds. audio: a sound file
    for an MP4; it begins with the first frame of the animation, or audio_offset seconds later (earlier if
    negative). transparent: PNG without a background. replace: numbered pictures that exist may be
    overwritten. progress: called with (done, total) frames.

    Of numbered pictures, the path is their folder. A file appears only when it is complete. Raises
    UnsupportedError for another suffix, DisplayError without OpenGL or video encoder, RangeError for a frame
    or a time outside of the animation, ValueError for an impossible size or an unknown preset, FormatError if
    a file cannot be written or read.
    """
    target, suffix = Path(path), _suffix(path)
    if suffix not in (*FILMS, *PICTURES) and not is_sequence(path):
        raise UnsupportedError(
            f"{path}: pictures are written as .png or .jpg, films as .mp4 or .gif, numbered pictures as "
            f"folder/%05d.png, but not {suffix or 'a bare name'}",
            what=f"rendering to {suffix or 'no suffix'}",
        )
    scene = as_scene(animation)
    if is_film(path):
        if frame is not None or time is not None:
            raise ValueError(
                "frame and time choose a single picture; write it to a .png, or give start and end"
            )
        return record(
            scene, path, rate=rate, size=size, camera=camera, start=start, end=end, audio=audio,
            audio_offset=audio_offset, transparent=transparent, replace=replace, progress=progress,
        )  # fmt: skip
    transparent = transparent or _is_transparent(scene)
    check_picture(target, transparent=transparent)
    if rate is not None or end is not None or (start is not None and time is not None):
        raise ValueError("rate, start and end belong to a film; give frame or time for a .png")
    if audio is not None:
        raise ValueError("a picture has no sound; leave the audio out, or write an .mp4")
    if start is not None:
        check_inside(scene, "start", start)
    at = _picture_time(scene, frame, time if time is not None else start)
    with (
        _background(scene, clear=transparent),
        Offscreen(scene, size or SIZE, camera) as offscreen,
    ):
        write_picture(target, offscreen.frame(at), transparent=transparent)
    if progress is not None:
        progress(1, 1)
    return target


def record(
    scene: Showable | Animation,
    path: PathLike,
    *,
    rate: Fraction | int | str | None = None,
    size: tuple[int, int] | None = None,
    camera: Camera | str | None = None,
    start: float | None = None,
    end: float | None = None,
    audio: PathLike | None = None,
    audio_offset: float = 0.0,
    transparent: bool = False,
    replace: bool = False,
    progress: Progress | None = None,
) -> Path:
    """Write a film, or numbered pictures, at an exact frame rate; return the path. See `render`.

    MP4: H.264, yuv420p, and AAC. It needs even sizes: the last column or row of odd ones is cut.
    """
    shown = as_scene(scene)
    if not math.isfinite(audio_offset):
        raise ValueError(f"audio_offset must be a finite number of seconds, not {audio_offset}")
    numbered = is_sequence(path)
    transparent = transparent or _is_transparent(shown)
    if transparent and not numbered:
        raise UnsupportedError(
            f"{path}: a film cannot be transparent; write numbered pictures, frames/%05d.png",
            what=f"transparency in {_suffix(path)}",
        )
    if numbered and audio is not None:
        raise ValueError("pictures have no sound; leave the audio out, or write an .mp4")
    film = exact_rate(film_rate(shown.timeline.rate, path) if rate is None else Fraction(rate))
    first, count = _frame_range(shown, film, start, end)
    width, height = picture_size(size, path)
    if size is not None and min(width, height) < 1:
        raise ValueError(f"a film must have at least 2x2 pixels, not {size[0]}x{size[1]}")
    with ExitStack() as stack:
        # Opened before the first picture is drawn, so that a missing encoder or folder is reported at once.
        if numbered:
            sink = Sequence(Numbered(path), count, transparent=transparent, replace=replace)
            recorder = Recorder(path, (width, height), rate=film, sink=sink)
        else:
            into = first - shown.timeline.start - Fraction(audio_offset).limit_denominator(10**6)
            recorder = Recorder(path, (width, height), rate=film, audio=audio, audio_start=into)
        stack.enter_context(recorder)
        stack.enter_context(_background(shown, clear=transparent))
        offscreen = stack.enter_context(Offscreen(shown, (width, height), camera))
        for number in range(count):
            recorder.add(offscreen.draw(float(first + number / film)))
            if progress is not None:
                progress(number + 1, count)
        result = recorder.close()
    assert result is not None
    return result


def picture_size(size: tuple[int, int] | None, path: PathLike) -> tuple[int, int]:
    """Return the width and height of a picture or film of that name. size: as given by the user, or None."""
    width, height = size or (GIF_SIZE if _suffix(path) == ".gif" else SIZE)
    return (width // 2 * 2, height // 2 * 2) if _suffix(path) == ".mp4" else (width, height)


def as_scene(subject: Animation | Showable) -> Showable:
    """Return a scene of an animation; a scene is returned as it is."""
    return Scene(subject) if isinstance(subject, Animation) else subject


def film_rate(rate: Fraction, path: PathLike | None = None) -> Fraction:
    """Return the frame rate of a film: that of the animation, or a multiple or fraction of it from 10 to 60.

    path: of the film; a GIF has at most 25.
    """
    low, high = SMOOTH_RATES
    rate = rate * math.ceil(low / rate) if rate < low else rate / math.ceil(rate / high)
    if path is not None and _suffix(path) == ".gif":
        from fba_player.export._gif import gif_rate

        return gif_rate(rate)
    return rate


def _suffix(path: PathLike) -> str:
    return os.path.splitext(os.fspath(path))[1].lower()


def _is_transparent(scene: Showable) -> bool:
    """Return whether the scene's background is switched to transparent."""
    return scene.switches["background"] == "transparent"


@contextmanager
def _background(scene: Any, *, clear: bool) -> Iterator[None]:
    """Switch the scene's background to transparent for the block, if `clear` is True."""
    before = scene.switches["background"]
    scene.show("background", "transparent" if clear else before)
    try:
        yield
    finally:
        scene.show("background", before)


def _picture_time(scene: Showable, frame: int | None, time: float | None) -> float:
    if frame is not None and time is not None:
        raise ValueError("give frame or time, not both")
    if frame is not None:
        frames = scene.timeline.frames
        if not -frames <= frame < frames:
            raise RangeError(
                f"there is no frame {frame}: the animation has {frames} (0 to {frames - 1})",
                value=frame,
                limits=(0, frames - 1),
            )
        return float(scene.timeline.time_of(range(frames)[frame]))
    if time is None:
        return float(scene.timeline.start)
    check_inside(scene, "time", time)
    return float(time)


def check_inside(scene: Showable, name: str, time: float) -> None:
    """Raise RangeError for a time outside of the animation, ValueError for one that is not finite.

    name: of the time, for the message.
    """
    if not math.isfinite(time):
        raise ValueError(f"{name} must be a finite number of seconds, not {time}")
    begin, stop = float(scene.timeline.start), float(scene.timeline.end)
    if not begin - SLACK <= time <= stop + SLACK:
        raise RangeError(
            f"{name} {time:g} s is outside the animation, which goes from {begin:g} s to {stop:g} s"
        )


def _frame_range(
    scene: Showable, rate: Fraction, start: float | None, end: float | None
) -> tuple[Fraction, int]:
    """Return the time of the first picture in seconds, exact, and the number of pictures."""
    for name, value in (("start", start), ("end", end)):
        if value is not None:
            check_inside(scene, name, value)
    begin, stop = scene.timeline.start, scene.timeline.end
    first = begin if start is None else max(Fraction(start).limit_denominator(10**6), begin)
    last = stop if end is None else min(Fraction(end).limit_denominator(10**6), stop)
    if last <= first:
        raise RangeError(
            f"nothing lies between {float(first):g} s and {float(last):g} s; the animation goes from "
            f"{float(begin):g} s to {float(stop):g} s"
        )
    count = max(math.ceil((last - first) * rate), 1)
    if count > MAX_FILM_FRAMES:
        raise FbaError(
            f"this film would have {count} frames ({float(last - first):g} s at {rate} frames/s, at most "
            f"{MAX_FILM_FRAMES}): choose a part with start and end, or a lower rate"
        )
    return first, count
