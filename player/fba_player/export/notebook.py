"""Animations in notebooks, shown as a page to play, or as small films.

`fba.player` calls `show_animations` when it is imported in a notebook; `fba` itself knows nothing of it.
"""

from __future__ import annotations

import base64
import html
import io
import math
import tempfile
from fractions import Fraction
from pathlib import Path
from typing import Any

from fba.animation import Animation
from fba.atomic import PathLike
from fba.errors import DisplayError, FbaError
from fba_player.playback._timeline import clock_text
from fba_player.view._camera import Camera
from fba_player.view.protocols import Showable

WIDTH = 480
"""Default width of the film in pixels."""
ASPECT = 4 / 3
"""Width / height of the film."""
MAX_FILM_SECONDS = Fraction(15)
"""Longest film: longer ones would make the page large, and the reader wait."""
MAX_PREVIEW_RATE = Fraction(30)
"""Most frames per second."""
MAX_FILM_BYTES = 4 << 20
"""Size of a film above which the page gets a still picture instead."""
PAGE_WIDTH, PAGE_HEIGHT = 800, 520
"""Size of the page of an animation, pixels."""
BAR_HEIGHT = 86
"""Height of the controls below the picture, pixels."""
MAX_PAGE_BYTES = 8 << 20
"""Size of a page above which the notebook gets a film instead."""
MIN_WIDTH = 16
"""Least width of a preview in pixels."""


class Preview:
    """A film of an animation, shown by a notebook where this is the value of a cell.

    subject: an animation or a scene. width: pixels, at least 16; the height is three quarters of it. camera:
    as in `Offscreen`. start, end: the part to show, in seconds; at most 15 s are shown. audio: a sound file
    that begins audio_offset seconds after the first frame.

    Without a video encoder it is a still picture, without OpenGL a line of text, with the reason.
    """

    def __init__(
        self,
        subject: Animation | Showable,
        *,
        width: int = WIDTH,
        camera: Camera | str | None = None,
        start: float | None = None,
        end: float | None = None,
        audio: PathLike | None = None,
        audio_offset: float = 0.0,
    ) -> None:
        if width < MIN_WIDTH:
            raise ValueError(f"a preview is at least {MIN_WIDTH} pixels wide, not {width}")
        for name, value in (("start", start), ("end", end)):
            if value is not None and not math.isfinite(value):
                raise ValueError(f"{name} must be a finite number of seconds, not {value}")
        self._subject = subject
        shown: Any = subject
        self._animation: Animation = subject if isinstance(subject, Animation) else shown.animation
        self._size = (width // 2 * 2, round(width / ASPECT) // 2 * 2)
        self._camera, self._start, self._end = camera, start, end
        self._audio, self._audio_offset = audio, audio_offset
        self._html: str | None = None

    def __repr__(self) -> str:
        return f"<preview of {describe(self._animation)}>"

    def _repr_html_(self) -> str:
        """Return the film as self-contained HTML; made once."""
        if self._html is None:
            self._html = self._make_html()
        return self._html

    def _make_html(self) -> str:
        caption = describe(self._animation)
        if not len(self._animation):
            return _figure("", caption)
        from fba_player.export.render import as_scene

        try:
            scene = as_scene(self._subject)
            try:
                shown, note = self._film(scene)
            except DisplayError as error:
                shown, note = self._still(scene), f"A still picture only: {error}"
        except FbaError as error:
            shown, note = "", f"No picture: {error}"
        return _figure(shown, caption, note)

    def _film(self, scene: Showable) -> tuple[str, str]:
        from fba_player.export.render import film_rate, record

        rate = film_rate(scene.timeline.rate)
        rate /= -(-rate // MAX_PREVIEW_RATE)  # an integer fraction: frames are left out evenly
        begin, end = scene.timeline.start, scene.timeline.end
        begin = begin if self._start is None else max(Fraction(self._start), begin)
        end = end if self._end is None else min(Fraction(self._end), end)
        last = min(end, begin + MAX_FILM_SECONDS)
        note = ""
        if last < end:
            note = (
                f"Shown are {float(MAX_FILM_SECONDS):g} s from {clock_text(begin)} on. "
                "player.Preview(clip, start=...) shows others, player.render(clip, 'clip.mp4') all."
            )
        with tempfile.TemporaryDirectory(prefix="fba-") as folder:
            path = Path(folder) / "preview.mp4"
            record(
                scene, path, rate=rate, size=self._size, camera=self._camera,
                start=float(begin), end=float(last), audio=self._audio, audio_offset=self._audio_offset,
            )  # fmt: skip
            data = path.read_bytes()
        if len(data) > MAX_FILM_BYTES:
            added = f"the film would add {len(data) / 2**20:.1f} MB to the page"
            return self._still(scene), f"A still picture only: {added}; show less of it, or smaller."
        width, height = self._size
        sound = "muted " if self._audio is None else ""
        return (
            f'<video controls loop {sound}playsinline width="{width}" height="{height}" '
            f'src="data:video/mp4;base64,{base64.b64encode(data).decode()}"></video>'
        ), note

    def _still(self, scene: Showable) -> str:
        from fba_player.export._offscreen import Offscreen
        from fba_player.export.image_files import put_picture

        width, height = self._size
        with Offscreen(scene, self._size, self._camera) as view:
            pixels = view.frame(float(scene.timeline.start) if self._start is None else self._start)
        file = io.BytesIO()
        put_picture(file, pixels, ".png")
        data = base64.b64encode(file.getvalue()).decode()
        return f'<img width="{width}" height="{height}" src="data:image/png;base64,{data}">'


def show_animations(shell: Any) -> None:
    """Make cells that end in an `Animation` show a page to play. shell: the InteractiveShell of IPython."""
    formatter = shell.display_formatter.formatters["text/html"]
    formatter.for_type_by_name("fba.animation", "Animation", show_page)


def show_page(animation: Animation) -> str:
    """Return a frame with the page of `fba export` that plays an animation, as self-contained HTML.

    Below the frame lies a picture: it shows until the page does, and wherever frames are left out, as in
    notebooks that are not trusted, and on GitHub. What no stream can carry, and what would make a large page,
    becomes a `Preview` instead.
    """
    from fba_player.export.page import animation_page

    caption = describe(animation)
    if not len(animation):
        return _figure("", caption)
    try:
        page = animation_page(animation)
    except FbaError as error:
        return _figure(Preview(animation)._repr_html_(), f"A film only: {error}")
    if len(page) > MAX_PAGE_BYTES:
        return Preview(animation)._repr_html_()
    try:
        picture = _first_picture(animation)
    except FbaError:
        picture = ""  # without OpenGL: the page draws by itself
    over = "position: absolute; inset: 0; width: 100%; height: 100%; border: 0"
    frame = (
        f'<iframe srcdoc="{html.escape(page, quote=True)}" title="{html.escape(caption, quote=True)}" '
        f'style="{over}" sandbox="allow-scripts allow-downloads" allow="fullscreen" loading="lazy"></iframe>'
    )
    place = f"position: relative; max-width: {PAGE_WIDTH}px; height: {PAGE_HEIGHT}px; overflow: hidden"
    return _figure(f'<div style="{place}">{picture}{frame}</div>', caption)


def _first_picture(animation: Animation) -> str:
    """Return an image of the first frame where the page draws it."""
    from fba_player.export._offscreen import Offscreen
    from fba_player.export.image_files import put_picture
    from fba_player.export.render import as_scene

    scene, size = as_scene(animation), (PAGE_WIDTH, PAGE_HEIGHT - BAR_HEIGHT)
    with Offscreen(scene, size) as view:
        pixels = view.frame(float(scene.timeline.start))
    file = io.BytesIO()
    put_picture(file, pixels, ".jpg")
    data = base64.b64encode(file.getvalue()).decode()
    return f'<img alt="" style="width: 100%; display: block" src="data:image/jpeg;base64,{data}">'


def describe(animation: Animation) -> str:
    """Return one line about an animation: its name, frames, duration, rate, and parts."""
    parts = [name for name in ("face", "body") if getattr(animation, name) is not None]
    frames = len(animation)
    rate = f"{float(animation.rate):.3f}".rstrip("0").rstrip(".")
    name = f"{animation.name}: " if animation.name else ""
    return (
        f"{name}{frames} frame{'s' * (frames != 1)}, {clock_text(animation.duration)} at {rate} frames/s, "
        f"{' and '.join(parts)}"
    )


def _figure(shown: str, *lines: str) -> str:
    text = "<br>".join(html.escape(line) for line in lines if line)
    return (
        f'<figure style="margin: 0">{shown}'
        f'<figcaption style="font-size: 90%; color: gray">{text}</figcaption></figure>'
    )
