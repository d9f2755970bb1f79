"""Rendering without a window: pictures of an animation as arrays."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from fba.animation import Animation
from fba.arrays import UInt8
from fba.parameters import FAP_COUNT
from fba_player.gl._context import offscreen_context
from fba_player.gl._framebuffer import Target
from fba_player.gl._renderer import Renderer
from fba_player.scene.scene import Scene
from fba_player.view._camera import FACE_PRESETS, Camera
from fba_player.view._view import View
from fba_player.view.protocols import Closing, Showable
from fba_player.view.switches import Quality, samples_of


class Offscreen(Closing):
    """Renders a scene into memory; needs no display.

    subject: an animation or a scene. size: width and height in pixels, at least 1 each. camera: a `Camera`,
    the name of a preset, or None for the one that suits the content. samples: samples per pixel, unless the
    scene's switch "quality" says otherwise; 0 is one, followed by a pass that smooths edges. Use it as a
    context manager, or `close` it; in one thread.

    Raises DisplayError if OpenGL is missing or cannot draw this size, saying what to install; ValueError for
    a size below 1 or an unknown preset.
    """

    def __init__(
        self,
        subject: Animation | Showable,
        size: tuple[int, int] = (1280, 720),
        camera: Camera | str | None = None,
        *,
        samples: int = Quality.FINE.samples,
    ) -> None:
        width, height = (int(v) for v in size)
        if width < 1 or height < 1:
            raise ValueError(f"a picture must have at least 1x1 pixels, not {width}x{height}")
        self.scene: Any = Scene(subject) if isinstance(subject, Animation) else subject
        self.size = (width, height)
        aspect = width / height
        self.camera = camera if isinstance(camera, Camera) else self.scene.camera(camera, aspect)
        self._of_head = looks_at_head(camera)
        self._gl: Any = offscreen_context()
        self._targets: dict[int, Target] = {}
        self._renderer: Renderer | None = None
        self._samples = samples
        try:
            with self._gl:  # current only while it is used: other contexts of this thread keep working
                self._target(samples)
                self._renderer = Renderer(self._gl)
        except Exception:
            self.close()
            raise
        self._buffer = bytearray(width * height * 4)

    def frame(self, time: float) -> UInt8:
        """Return the picture at a time in seconds: uint8 (H, W, 4), sRGB, top row first.

        It is opaque, unless the scene's background is transparent. The same time gives the same picture.
        Raises ValueError for a time that is not finite, or after `close`.
        """
        return self.draw(time).copy()

    def draw(self, time: float) -> UInt8:
        """Return the picture at a time, as `frame` returns it, in memory that the next call overwrites."""
        camera = follow_camera(self.camera, self.scene, time, of_head=self._of_head)
        return self._draw_view(self.scene.view_at(time, camera.seen(self.size[1])), camera)

    def still(self, faps: npt.ArrayLike) -> UInt8:
        """Return a picture of the face for FAPs (68,) as `fba.face.resolve` returns them: uint8 (H, W, 4).

        It uses `camera`, which may be set before each call. Raises ValueError for another shape, or after
        `close`.
        """
        values = np.asarray(faps, dtype=np.float32)
        if values.shape != (FAP_COUNT,):
            raise ValueError(f"FAPs must have shape ({FAP_COUNT},), not {values.shape}")
        return self._draw_view(self.scene.still(values), self.camera).copy()

    def _draw_view(self, view: View, camera: Camera) -> UInt8:
        if self._renderer is None:
            raise ValueError("this Offscreen is closed")
        if self.scene.switches["background"] == "transparent":
            return cut_out(*self._draw_over_black_and_white(view, camera))
        return self._read(view, camera, samples_of(self.scene.switches, self._samples))

    def _draw_over_black_and_white(self, view: View, camera: Camera) -> list[UInt8]:
        """Return both pictures, multisampled: smoothing would miss dark edges before black."""
        samples = max(self._samples, Quality.FINE.samples)
        views = [replace(view, background=(shade,) * 3) for shade in (0.0, 1.0)]
        return [self._read(other, camera, samples).copy() for other in views]

    def _target(self, samples: int) -> Target:
        """Return the framebuffer with this number of samples a pixel."""
        if samples not in self._targets:
            self._targets[samples] = Target(self._gl, self.size, samples)
        return self._targets[samples]

    def _read(self, view: View, camera: Camera, samples: int) -> UInt8:
        assert self._renderer is not None
        with self._gl:
            target = self._target(samples)
            target.begin()
            within = self._renderer.draw(view, camera, self.size, smoothed=target.smoothed)
            target.finish(within=within).read_into(self._buffer, components=4)
        width, height = self.size
        pixels = np.frombuffer(self._buffer, dtype=np.uint8).reshape(height, width, 4)
        if view.extras is not None:
            pixels[..., 3] = 255  # annotations mark their pixels there for the target
        return pixels[::-1]

    def close(self) -> None:
        """Release its resources; safe to call twice."""
        if self._gl is None:
            return
        with self._gl:
            for part in (self._renderer, *self._targets.values()):
                if part is not None:
                    part.close()
        self._renderer = None
        self._targets.clear()
        self._gl.release()
        self._gl = None


def cut_out(black: UInt8, white: UInt8) -> UInt8:
    """Return the foreground with alpha, uint8 (H, W, 4), of the same picture before black and white."""
    dark, light = (picture[..., :3].astype(np.float32) for picture in (black, white))
    opaque = np.clip(1 - (light - dark).mean(axis=2) / 255, 0.0, 1.0)
    foreground = np.empty_like(black)
    foreground[..., :3] = np.clip(np.round(dark / np.maximum(opaque, 1 / 255)[..., None]), 0, 255)
    foreground[..., 3] = np.round(opaque * 255)
    return foreground


def looks_at_head(camera: Camera | str | None) -> bool:
    """Return whether this is the name of a camera that looks at the face alone."""
    return camera in FACE_PRESETS


def follow_camera(camera: Camera, scene: Showable, time: float, *, of_head: bool = False) -> Camera:
    """Return the camera at a time, moved along with the figure and turned around it as the scene says.

    of_head: whether it looks at the face alone.
    """
    moved = camera.move(scene.followed(time, of_head=of_head))
    if scene.orbit is None:
        return moved
    return moved.orbit(360.0 * (time - float(scene.timeline.start)) / scene.orbit, 0.0)
