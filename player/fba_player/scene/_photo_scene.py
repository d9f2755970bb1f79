"""Photographs side by side with the feature points that the user places on them."""

from __future__ import annotations

import io
import math
from collections.abc import Collection, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from pathlib import Path

import numpy as np
from PIL import Image

from fba.animation import Animation
from fba.arrays import Float32, Float64
from fba.face.feature_points import MIRRORED
from fba.face.fitting import FRONT_POINTS, SIDE_POINTS, Photograph, write_photo_points
from fba.tracks import FaceTrack
from fba_player._mesh.textures import load_picture
from fba_player.playback._timeline import Timeline
from fba_player.scene._hand_editing import HandEditing
from fba_player.scene._placement_scene import CURRENT, MATE, PLACED, RADII, fit_box, make_dots, plain_mesh
from fba_player.view._camera import Camera
from fba_player.view._geometry import project, ray_through
from fba_player.view._view import Colour, Dots, Extras, FaceMesh, FaceShape, Seen, View
from fba_player.view.protocols import Timed
from fba_player.view.switches import Switches

VIEWS = ("front", "side")
SHOWN = {"front": FRONT_POINTS, "side": SIDE_POINTS}
"""The points that are asked for in each photograph."""

Spot = tuple[float, float]
"""A position in a photograph: pixels to the right and down from its top left corner."""


class PhotoEditing(HandEditing[dict[str, Spot]]):
    """The feature points on a frontal photograph and a profile while they are placed by hand.

    photographs: the frontal one, and the profile if there is one. The items are named "front 3.5".
    """

    item, subject = "point", "the points"
    path: Path

    def __init__(
        self, photographs: Sequence[Photograph], places: Mapping[str, Mapping[str, Spot]], path: Path
    ) -> None:
        self.photographs = tuple(photographs)
        views = VIEWS[: len(photographs)]
        spots = {f"{view} {name}": spot for view in views for name, spot in places.get(view, {}).items()}
        asked = [f"{view} {name}" for view in views for name in SHOWN[view]]
        self._names = (*asked, *(name for name in spots if name not in asked))
        super().__init__(spots, self._names[0], path)

    @property
    def names(self) -> tuple[str, ...]:
        """The points of the frontal photograph, then those of the profile."""
        return self._names

    @property
    def placed(self) -> Collection[str]:
        return self.state

    def move(self, spot: Spot, gesture: str = "") -> None:
        """Put the current point on a position in its photograph. gesture: as for `HandEditing._change`."""
        self._change({**self.state, self.current: spot}, gesture)

    def end_gesture(self) -> None:
        """Let the next change be a step of its own to undo, as when a point is dropped."""
        self._last_gesture = None

    def remove(self) -> None:
        self._change({name: spot for name, spot in self.state.items() if name != self.current})

    def by_view(self) -> dict[str, dict[str, Spot]]:
        """Return the points by view and name."""
        result: dict[str, dict[str, Spot]] = {view: {} for view in VIEWS[: len(self.photographs)]}
        for item, spot in self.state.items():
            view, name = item.split()
            result[view][name] = spot
        return result

    def _write(self, path: Path) -> None:
        pictures = dict(zip(VIEWS, (one.name for one in self.photographs), strict=False))
        write_photo_points(path, self.by_view(), pictures)


HEIGHT = 0.3
"""Height of a photograph in the world, metres."""
GAP = 0.015
LIFT = 0.001
MAX_DISTANCE = 12.0
"""A press this close to a point, in pixels of a picture 720 high, takes hold of it."""
MATES = {**MIRRORED, **{right: left for left, right in MIRRORED.items()}}


class PhotoScene(Timed[Timeline]):
    """Shows the photographs of a `PhotoEditing` with its points, and finds what a mouse points at.

    The current point is blue, its mate on the other side green, all others are orange.
    """

    def __init__(self, editing: PhotoEditing) -> None:
        self.editing = editing
        self.timeline = Timeline(Animation(Fraction(25), np.zeros(1, np.int64), FaceTrack.empty(1)))
        self.switches = Switches()
        self.title = editing.photographs[0].name
        self.has_body = False

    def view_at(self, time: float, seen: Seen | None = None) -> View:
        """Return the photographs and their points; at any time the same."""
        if not math.isfinite(time):
            raise ValueError(f"a time must be finite, not {time}")
        return View(faces=self._meshes, extras=Extras(dots=self._dots()))

    def camera(self, preset: str | None = None, aspect: float = 16 / 9) -> Camera:
        """Return the camera that shows all photographs; the presets are all the same."""
        low = np.array([self._left[0], -HEIGHT / 2, 0.0])
        high = np.array([self._left[-1] + self._widths[-1], HEIGHT / 2, 0.0])
        return Camera().fit(fit_box(low, high), aspect)

    def to_world(self, item: str, spot: Spot) -> Float64:
        """Return (3,) where a position in the photograph of an item is in the world."""
        number = VIEWS.index(item.split(maxsplit=1)[0])
        width, height = self.editing.photographs[number].size
        x, y = spot
        return np.array(
            [self._left[number] + x / width * self._widths[number], HEIGHT * (0.5 - y / height), 0.0]
        )

    def spot_under(self, camera: Camera, x: float, y: float, size: tuple[int, int], item: str) -> Spot:
        """Return the position in the photograph of an item at a pixel, at most at the photograph's edge."""
        number = VIEWS.index(item.split(maxsplit=1)[0])
        origin, direction = ray_through(camera, x, y, size)
        place = origin - direction * (origin[2] / min(direction[2], -1e-9))
        width, height = self.editing.photographs[number].size
        right = (place[0] - self._left[number]) / self._widths[number]
        down = 0.5 - place[1] / HEIGHT
        return float(np.clip(right, 0, 1) * width), float(np.clip(down, 0, 1) * height)

    def item_under(self, camera: Camera, x: float, y: float, size: tuple[int, int]) -> str | None:
        """Return the point nearest to a pixel of a picture, None if none is near."""
        items = list(self.editing.state)
        if not items:
            return None
        places = np.array([self.to_world(item, self.editing.state[item]) for item in items])
        away = np.linalg.norm(project(places, camera.clip_matrix(size), size)[0] - (x, y), axis=1)
        nearest = int(away.argmin())
        return items[nearest] if away[nearest] <= MAX_DISTANCE * max(size[1] / 720, 1.0) else None

    @cached_property
    def _widths(self) -> list[float]:
        return [HEIGHT * one.size[0] / one.size[1] for one in self.editing.photographs]

    @cached_property
    def _left(self) -> list[float]:
        """x of the left edge of each photograph in the world."""
        left = -(sum(self._widths) + GAP * (len(self._widths) - 1)) / 2
        result = []
        for width in self._widths:
            result.append(left)
            left += width + GAP
        return result

    @cached_property
    def _meshes(self) -> list[FaceMesh]:
        meshes = []
        for number, photograph in enumerate(self.editing.photographs):
            left, right = self._left[number], self._left[number] + self._widths[number]
            corners = [(left, HEIGHT / 2), (right, HEIGHT / 2), (right, -HEIGHT / 2), (left, -HEIGHT / 2)]
            positions: Float32 = np.array([(x, y, 0) for x, y in corners], dtype=np.float32)
            file = io.BytesIO()
            Image.fromarray(photograph.pixels).save(file, "PNG", compress_level=1)
            colours = np.tile(np.array([1, 1, 1, 0], dtype=np.float32), (4, 1))
            shape = FaceShape(
                np.array([[0, 3, 2], [0, 2, 1]], dtype=np.int32), colours, np.zeros(4, dtype=np.float32),
                np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32), load_picture(file.getvalue()),
                two_sided=True, name=photograph.name, smooth=False,
            )  # fmt: skip
            normals = np.tile(np.array([0, 0, 1], dtype=np.float32), (4, 1))
            meshes.append(plain_mesh(shape, positions, normals))
        return meshes

    def _dots(self) -> tuple[Dots, ...]:
        state, current = self.editing.state, self.editing.current
        view, name = current.split()
        mate = f"{view} {MATES[name]}" if name in MATES else ""
        groups: list[tuple[list[str], Colour, str]] = [
            ([item for item in state if item not in (current, mate)], PLACED, "placed"),
            ([mate] if mate in state else [], MATE, "mate"),
            ([current] if current in state else [], CURRENT, "current"),
        ]
        return tuple(
            make_dots(
                np.array([self.to_world(item, state[item]) for item in items]),
                tuple(item.split()[1] for item in items), colour, RADII[kind], LIFT,
            )
            for items, colour, kind in groups if items
        )  # fmt: skip
