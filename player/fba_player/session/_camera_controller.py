"""The camera of a window: moved by hand, gliding to presets, following a figure that walks away."""

from __future__ import annotations

import math
import time as wall
from collections.abc import Callable

from fba.sampling import smoothstep
from fba_player.scene.compare import CompareScene
from fba_player.view._camera import FACE_PRESETS, Camera
from fba_player.view.protocols import Showable

ORBIT_SECONDS = 20.0
"""Seconds in which the camera turns once around the subject, if nothing else is said."""
GLIDE_SECONDS = 0.35
"""Seconds that a glide to another view takes."""
FACE_SECONDS = 3.5
"""Seconds for which a window that begins with the face shows it."""
LEAVING_SECONDS = 1.8
"""Seconds of the glide from there to the whole."""
NOT_SHIFTED = (0.0, 1.0)
"""Shift of the middle as a share of the width, and factor on the distance, where no panels are open."""
MIN_FREE_WIDTH = 0.2
"""Least share of the width between the panels for which a view is fitted."""


class Viewpoint:
    """The camera of a scene over time.

    scene: gives presets, and the distance that a figure has walked. aspect: width / height of the picture,
    which presets fit. camera: the first view, or the name of a preset; by default the one that suits the
    content. clock: returns seconds, for tests.

    covered, covered_above: shares of the picture's height that are hidden at the bottom and at the top;
    presets fit between them. For what is hidden at the sides see `uncover`: the picture is shifted between
    the panels, whatever the view.
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
        self.covered = self.covered_above = 0.0
        self._first_view = camera
        self._clock = clock
        self._from = self._to = self.beginning
        self._until = -math.inf
        self._glide_seconds = GLIDE_SECONDS
        self._face_until: float | None = None
        self._preset = camera if not isinstance(camera, Camera) else ""
        self._of_head = self._preset in FACE_PRESETS
        self._time = 0.0
        self._turns_since = clock()
        self._fitted_to = (self._shape, self._to)
        self._sides = (0.0, 0.0)
        self._shift_before = self._shift = NOT_SHIFTED
        self._shift_until = -math.inf

    @property
    def camera(self) -> Camera:
        """The camera now; setting it cuts to the new one."""
        share = self._progress(self._until, self._glide_seconds)
        return self._to if share >= 1.0 else self._from.between(self._to, share)

    @camera.setter
    def camera(self, camera: Camera) -> None:
        self._from = self._to = camera
        self._until = -math.inf

    @property
    def gliding(self) -> bool:
        """Whether it moves by itself."""
        return self.scene.orbit is not None or self._clock() < max(self._until, self._shift_until)

    @property
    def beginning(self) -> Camera:
        """The first view, fitted to the current shape of the picture."""
        return self._first_view if isinstance(self._first_view, Camera) else self.fit(self._first_view)

    def fit(self, preset: str | None) -> Camera:
        """Return the camera of a preset, or, for None, of what suits the content, above what is covered."""
        free, up = self._free
        camera = self.scene.camera(preset, self.aspect / free)
        camera = camera.zoom(1 / free).pan(0.0, up)
        self._fitted_to = (self._shape, camera)
        return camera

    @property
    def _shape(self) -> tuple[float, float, float]:
        """What views are fitted to."""
        return self.aspect, self.covered, self.covered_above

    @property
    def _free(self) -> tuple[float, float]:
        """The share of the height that is not hidden, and how far its middle is below the picture's."""
        below, above = (min(max(share, 0.0), 0.5) for share in (self.covered, self.covered_above))
        return max(1.0 - below - above, 0.5), (above - below) / 2

    def refit(self) -> None:
        """Fit the view to a picture of another shape, if it is a preset that was not moved since."""
        shape, camera = self._fitted_to
        if shape == self._shape:
            return
        if self._preset != "" and self._to == camera:
            if self.aspect == shape[0]:  # the bar has gone, or is back
                self.glide(self.fit(self._preset))
            else:
                self.camera = self.fit(self._preset)
            self._shift = self._shift_between(*self._sides)
        self._fitted_to = (self._shape, self._fitted_to[1])

    def glide(self, camera: Camera, seconds: float = GLIDE_SECONDS) -> None:
        self._from, self._to, self._until = self.camera, camera, self._clock() + seconds
        self._glide_seconds = seconds

    def begin_with_face(self) -> None:
        """Show the face for some seconds from the first picture on, then what the first view is."""
        self._preset, self._of_head = "face", True
        self.camera = self.fit("face")
        self._face_until = math.inf

    def _leave_face(self) -> None:
        """Go back to the first view when it is time, unless somebody has moved the camera."""
        if self._face_until is None:
            return
        if self._preset != "face" or self._to != self._fitted_to[1]:
            self._face_until = None
        elif self._face_until == math.inf:
            self._face_until = self._clock() + FACE_SECONDS
        elif self._clock() >= self._face_until:
            self._face_until = None
            self.reset(LEAVING_SECONDS)

    @property
    def view(self) -> Camera | str | None:
        """The name of the view, None for the first one, or the camera where somebody has moved it."""
        return self._preset if self._preset != "" and self._to == self._fitted_to[1] else self.camera

    def restore(self, view: Camera | str | None) -> None:
        """Cut to a view of `view`."""
        self._preset = "" if isinstance(view, Camera) else view
        self._of_head = self._preset in FACE_PRESETS
        self.camera = view if isinstance(view, Camera) else self.fit(view)

    def preset(self, name: str) -> None:
        """Glide to a preset. Raises ValueError for an unknown name."""
        to = self.fit(name)
        self._stay(lambda: setattr(self, "_of_head", name in FACE_PRESETS))
        self.glide(to)
        self._preset = name

    def uncover(self, left: float, right: float, *, smoothly: bool = True) -> None:
        """Shift the figure into the space between panels that hide these shares of the picture's width."""
        if (left, right) == self._sides:
            return
        self._shift_before, before = self._shift_now(), self._shift[0]
        self._sides = (left, right)
        self._shift = self._shift_between(left, right)
        if isinstance(self.scene, CompareScene):  # the line stays at the figures
            self.scene.wipe = min(max(self.scene.wipe + self._shift[0] - before, 0.0), 1.0)
        self._shift_until = self._clock() + GLIDE_SECONDS if smoothly else -math.inf

    def reset(self, seconds: float = GLIDE_SECONDS) -> None:
        """Glide to the first view."""
        self._preset = self._first_view if not isinstance(self._first_view, Camera) else ""
        self._stay(lambda: setattr(self, "_of_head", self._preset in FACE_PRESETS))
        self.glide(self.beginning, seconds)

    def camera_without_panels(self, time: float) -> Camera:
        """Return the camera at a time in seconds, for a picture without panels at the sides."""
        self._time = time
        self._leave_face()
        return self.camera.move(self._followed()).orbit(self._turned(), 0.0)

    def camera_at(self, time: float) -> Camera:
        """Return the camera at a time in seconds, with the figure between the panels at the sides."""
        shift, further = self._shift_now()
        if (shift, further) == NOT_SHIFTED:
            return self.camera_without_panels(time)
        up = self._free[1] * (1 - 1 / further)  # the middle of what is free stays where it is
        return self.camera_without_panels(time).zoom(further).pan(-shift * self.aspect, up)

    @property
    def follow(self) -> str | None:
        """What it follows, see `Timed.follow`; setting it does not let the picture jump."""
        return self.scene.follow

    @follow.setter
    def follow(self, what: str | None) -> None:
        self._stay(lambda: setattr(self.scene, "follow", what))
        if self._preset != "":
            self.glide(self.fit(self._preset))

    def toggle_orbit(self) -> None:
        """Let the camera turn slowly around the subject, from where it is, or stay where it is."""
        turned = self._turned()
        self._turns_since = self._clock()
        self._from, self._to = self._from.orbit(turned, 0.0), self._to.orbit(turned, 0.0)
        self.scene.orbit = ORBIT_SECONDS if self.scene.orbit is None else None

    @property
    def following(self) -> str | None:
        """What a camera without the name of its view has to follow to do as this one does."""
        return "head" if self.follow is None and self._of_head else self.follow

    def options(self) -> dict[str, str]:
        """Return the options of `fba play` and `fba render` that give this view, by their names."""
        orbit = f"{self.scene.orbit:g}" if self.scene.orbit else ""
        given = {
            "camera": self.camera.orbit(self._turned(), 0.0).text,
            "follow": self.following or "",
            "orbit": orbit,
        }
        return {name: value for name, value in given.items() if value}

    def camera_for_export(self, aspect: float) -> Camera:
        """Return the camera for pictures of another shape: a view that was not moved is fitted."""
        if self._preset != "" and self._to == self._fitted_to[1]:
            return self.scene.camera(self._preset, aspect)
        return self.camera.orbit(self._turned(), 0.0)

    def _turned(self) -> float:
        """Return the degrees that it has turned by itself."""
        orbit = self.scene.orbit
        return 0.0 if orbit is None else 360.0 * (self._clock() - self._turns_since) / orbit

    def _followed(self) -> tuple[float, float, float]:
        return self.scene.followed(self._time, of_head=self._of_head)

    def _stay(self, change: Callable[[], None]) -> None:
        """Change what is followed, and let the camera be where it was."""
        before, camera = self._followed(), self.camera
        change()
        self.camera = camera.move(before).move(self._followed(), -1.0)

    def _progress(self, until: float, seconds: float = GLIDE_SECONDS) -> float:
        """Return the progress, 0 to 1, of a glide that ends at a reading of the clock, slow at both ends."""
        return float(smoothstep(1.0 - (until - self._clock()) / seconds))

    def _shift_now(self) -> tuple[float, float]:
        share = self._progress(self._shift_until)
        if share >= 1.0:
            return self._shift
        pairs = zip(self._shift_before, self._shift, strict=True)
        shift, factor = (before + (after - before) * share for before, after in pairs)
        return shift, factor

    def _shift_between(self, left: float, right: float) -> tuple[float, float]:
        """Return the shift of the middle as a share of the width, and factor on the camera's distance."""
        free = max(1.0 - left - right, MIN_FREE_WIDTH)
        if self._preset == "" or free >= 1.0:
            return (left - right) / 2, 1.0
        aspect = self.aspect / self._free[0]
        narrow = self.scene.camera(self._preset, aspect * free).distance
        # Last: a scene arranges its figures for the camera asked for last.
        full = self.scene.camera(self._preset, aspect).distance
        return (left - right) / 2, max(narrow / full, 1.0)
