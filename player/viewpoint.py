"""Where the camera is now: moved by hand at once, brought to a preset smoothly, following who walks away."""

from __future__ import annotations

import math
import time as wall
from collections.abc import Callable
from dataclasses import replace

from player.camera import Camera
from player.showable import Showable

GLIDE = 0.35
"""Seconds that a change of view takes."""


class Viewpoint:
    """The camera of a scene over time.

    scene: gives presets and how far a performance has travelled. aspect: width / height of the picture,
    which presets fit. camera: the first view, or the name of one; by default the one that suits the
    content. clock: seconds, for tests.

    covered: share of the picture's height that is hidden at the bottom; named views fit above it.
    """

    def __init__(
        self,
        scene: Showable,
        aspect: float,
        camera: Camera | str | None = None,
        *,
        clock: Callable[[], float] = wall.monotonic,
    ) -> None:
        self.scene = scene
        self.aspect = aspect
        self.covered = 0.0
        self.follow = True
        self._chosen = camera
        self._clock = clock
        self._from = self._to = self.beginning
        self._until = -math.inf

    @property
    def camera(self) -> Camera:
        """The camera now; setting it cuts to the new one."""
        left = (self._until - self._clock()) / GLIDE
        if left <= 0.0:
            return self._to
        share = max(1.0 - left, 0.0)
        return self._from.between(self._to, share * share * (3 - 2 * share))

    @camera.setter
    def camera(self, camera: Camera) -> None:
        self._from = self._to = camera
        self._until = -math.inf

    @property
    def gliding(self) -> bool:
        """Whether it is on its way to another view."""
        return self._clock() < self._until

    @property
    def beginning(self) -> Camera:
        """The first view, for the picture as it is now."""
        return self._chosen if isinstance(self._chosen, Camera) else self.fitted(self._chosen)

    def fitted(self, preset: str | None) -> Camera:
        """A named view, or None for the one that suits the content, above what is covered."""
        free = 1.0 - min(max(self.covered, 0.0), 0.5)
        camera = self.scene.camera(preset, self.aspect / free)
        return camera.zoom(1 / free).pan(0.0, (free - 1) / 2)

    def glide(self, camera: Camera) -> None:
        """Go to another view smoothly."""
        self._from, self._to, self._until = self.camera, camera, self._clock() + GLIDE

    def preset(self, name: str) -> None:
        """Go to a named view; ValueError for a name that does not exist."""
        self.glide(self.fitted(name))

    def reset(self) -> None:
        """Go back to the view of the beginning."""
        self.follow = True
        self.glide(self.beginning)

    def at(self, time: float) -> Camera:
        """The camera that shows the scene at a time in seconds."""
        return self._moved(self.camera, time, 1.0) if self.follow else self.camera

    def toggle_follow(self, time: float) -> None:
        """Follow a performance that walks away, or stay; the picture at `time` does not jump."""
        self.camera = self._moved(self.camera, time, 1.0 if self.follow else -1.0)
        self.follow = not self.follow

    def _moved(self, camera: Camera, time: float, way: float) -> Camera:
        travel = self.scene.travel(time)
        if not any(travel):
            return camera
        x, y, z = (a + way * b for a, b in zip(camera.target, travel, strict=True))
        return replace(camera, target=(x, y, z))
