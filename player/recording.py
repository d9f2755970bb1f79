"""Pictures and films as files: PNG through Pillow, MP4 (H.264) through PyAV."""

from __future__ import annotations

import contextlib
import math
import os
import tempfile
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from fba.animation import Animation
from fba.errors import DisplayError, FbaError, RangeError, UnsupportedError
from player.camera import Camera
from player.offscreen import Offscreen
from player.scene import Scene

Progress = Callable[[int, int], None]
PathLike = str | os.PathLike[str]

PICTURES = (".png", ".jpg", ".jpeg")
SUFFIXES = (".mp4", *PICTURES)
SMOOTH_RATES = (Fraction(10), Fraction(120))
"""A film's own rate lies between these where none is asked for."""
MOST_FRAMES = 1_000_000
"""A longer film is refused: its times are damaged, or a part of it was meant."""
PICTURE_SAMPLES = 4
"""Samples a pixel of a single picture, which may take its time."""
JPEG_QUALITY = 90
QUALITY = "18"
"""H.264 constant rate factor."""


def render(
    animation: Animation | Scene,
    path: PathLike,
    *,
    size: tuple[int, int] = (1280, 720),
    fps: Fraction | int | str | None = None,
    camera: Camera | str | None = None,
    frame: int | None = None,
    time: float | None = None,
    start: float | None = None,
    end: float | None = None,
    progress: Progress | None = None,
) -> Path:
    """Draw an animation into a file without a window; the suffix decides: .png or .jpg one picture, .mp4 a
    film.

    size: width and height in pixels. camera: a `Camera`, "front", "three-quarter", "profile", "body", or
    None for the one that suits the content. For a picture: frame, its position in the animation
    (negative from the end), or time in seconds; by default the first frame. For a film: fps (by default
    the animation's own rate), and start and end in seconds. progress: called with (done, total) frames.

    Returns the path. The file appears whole or not at all. Raises UnsupportedError for another suffix,
    DisplayError without OpenGL or video encoder, RangeError for a frame or a stretch that is not in the
    animation, ValueError for a size or preset that does not exist, OSError where it cannot be written.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    _check_suffix(target, SUFFIXES)
    scene = animation if isinstance(animation, Scene) else Scene(animation)
    if suffix == ".mp4":
        if frame is not None or time is not None:
            raise ValueError(
                "frame and time choose a single picture; write it to a .png, or give start and end"
            )
        return record(
            scene, target, fps=fps, size=size, camera=camera, start=start, end=end, progress=progress
        )
    if fps is not None or end is not None or (start is not None and time is not None):
        raise ValueError("fps, start and end belong to a film; give frame or time for a .png")
    at = _moment(scene, frame, time if time is not None else start)
    with Offscreen(scene, size, camera, samples=PICTURE_SAMPLES) as offscreen:
        write_picture(target, offscreen.frame(at))
    if progress is not None:
        progress(1, 1)
    return target


def write_picture(path: PathLike, pixels: npt.NDArray[np.uint8]) -> Path:
    """Write pixels, uint8 (H, W, 3 or 4), as .png or .jpg, whole or not at all; returns the path.

    Raises UnsupportedError for another suffix, OSError where it cannot be written.
    """
    from PIL import Image

    target = Path(path)
    _check_suffix(target, PICTURES)
    with written(target) as temporary:
        picture = Image.fromarray(pixels).convert("RGB")
        if target.suffix.lower() == ".png":
            picture.save(temporary, format="PNG")
        else:
            picture.save(temporary, format="JPEG", quality=JPEG_QUALITY)
    return target


def _check_suffix(target: Path, suffixes: tuple[str, ...]) -> None:
    suffix = target.suffix.lower()
    if suffix not in suffixes:
        films = " and films as .mp4" if ".mp4" in suffixes else ""
        raise UnsupportedError(
            f"{target}: pictures are written as .png or .jpg{films}, not as {suffix or 'a bare name'}",
            what=f"rendering to {suffix or 'no suffix'}",
        )


def record(
    scene: Scene | Animation,
    path: PathLike,
    *,
    fps: Fraction | int | str | None = None,
    size: tuple[int, int] = (1280, 720),
    camera: Camera | str | None = None,
    start: float | None = None,
    end: float | None = None,
    progress: Progress | None = None,
) -> Path:
    """Write a film: MP4, H.264, yuv420p, at an exact frame rate. See `render`.

    H.264 needs even sizes: odd ones lose their last column or row.
    """
    try:
        import av
    except ImportError as error:
        raise DisplayError(
            f"films need the Python package av (PyAV), which cannot be imported: {error}. "
            "Install it with: pip install av"
        ) from error
    shown = scene if isinstance(scene, Scene) else Scene(scene)
    rate = film_rate(shown.rate) if fps is None else Fraction(fps)
    if not 0 < rate <= 1000:
        raise ValueError(f"a film's frame rate must lie above 0 and at most at 1000, not {rate}")
    rate = rate.limit_denominator(1001) if rate.denominator > 100_000 else rate
    first, count = _stretch(shown, rate, start, end)
    width, height = size[0] // 2 * 2, size[1] // 2 * 2
    if width < 2 or height < 2:
        raise ValueError(f"a film must have at least 2x2 pixels, not {size[0]}x{size[1]}")
    target = Path(path)
    with Offscreen(shown, (width, height), camera) as offscreen, written(target) as temporary:
        try:
            container = av.open(str(temporary), "w", format="mp4", options={"movflags": "+faststart"})
            with container:
                stream = _video_stream(container, rate, width, height)
                for number in range(count):
                    pixels = offscreen.draw(float(first + number / rate))
                    picture = av.VideoFrame.from_ndarray(pixels[..., :3], format="rgb24")
                    picture.pts = number
                    picture.time_base = 1 / rate
                    container.mux(stream.encode(picture))
                    if progress is not None:
                        progress(number + 1, count)
                container.mux(stream.encode(None))
        except av.error.FFmpegError as error:
            raise DisplayError(
                f"{target}: the video encoder failed at {width}x{height}, {rate} frames/s: {error}"
            ) from error
    return target


def film_rate(rate: Fraction) -> Fraction:
    """The rate itself where people see it as motion, else the nearest multiple or fraction that is."""
    low, high = SMOOTH_RATES
    if rate < low:
        return rate * math.ceil(low / rate)
    return rate / math.ceil(rate / high)


@contextlib.contextmanager
def written(target: Path) -> Iterator[Path]:
    """A temporary path beside the target, renamed to it if all goes well, and removed if not."""
    if target.is_dir():
        raise IsADirectoryError(f"{target} is a directory; give the name of a file")
    try:
        handle, name = tempfile.mkstemp(
            prefix=f".{target.name[:40]}.", suffix=target.suffix, dir=target.parent
        )
    except FileNotFoundError as error:
        raise FileNotFoundError(f"{target}: there is no directory {target.parent}") from error
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def _video_stream(container: Any, rate: Fraction, width: int, height: int) -> Any:
    import av

    codecs = av.codec.codecs_available
    name = next((n for n in ("libx264", "libopenh264", "h264") if n in codecs), None)
    if name is None:
        raise DisplayError(
            "this build of PyAV has no H.264 encoder; install av from its own wheels (pip install av)"
        )
    options = {"crf": QUALITY, "preset": "veryfast"} if name == "libx264" else {}
    stream = container.add_stream(name, rate=rate, options=options)
    stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
    stream.codec_context.time_base = 1 / rate
    return stream


def _moment(scene: Scene, frame: int | None, time: float | None) -> float:
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
    return float(scene.start) if time is None else float(time)


def _stretch(scene: Scene, rate: Fraction, start: float | None, end: float | None) -> tuple[Fraction, int]:
    """Time of the first picture and how many there are."""
    for name, value in (("start", start), ("end", end)):
        if value is not None and not math.isfinite(value):
            raise ValueError(f"{name} must be a finite number of seconds, not {value}")
    begin, stop = scene.start, scene.timeline.end
    first = begin if start is None else max(Fraction(start).limit_denominator(10**6), begin)
    last = stop if end is None else min(Fraction(end).limit_denominator(10**6), stop)
    if last <= first:
        raise RangeError(
            f"nothing lies between {float(first):g} s and {float(last):g} s; the animation goes from "
            f"{float(begin):g} s to {float(stop):g} s"
        )
    count = max(math.ceil((last - first) * rate), 1)
    if count > MOST_FRAMES:
        raise FbaError(
            f"this film would have {count} frames ({float(last - first):g} s at {rate} frames/s, at most "
            f"{MOST_FRAMES}): choose a part with start and end, or a lower rate"
        )
    return first, count
