"""Several performances in one picture, side by side or over each other.

`DifferenceColours` colours figures by how far they are from another one that makes the same performance.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from fba.arrays import Float32, Float64
from fba_player._mesh.textures import linear_light
from fba_player.scene._compare_timeline import CompareTimeline, Differences, differences
from fba_player.scene._display_options import HAIRS
from fba_player.scene._fap_heatmap import GLOSS, heat_colours, heat_legend, plain_colours
from fba_player.scene._layout import Drawing, join_views, make_captions, move_view
from fba_player.scene.scene import Scene
from fba_player.view._camera import FACE_PRESETS, Camera, Subject
from fba_player.view._geometry import transform, turn_partly
from fba_player.view._view import Extras, FaceMesh, FaceShape, Seen, View, Wipe
from fba_player.view.protocols import Timed

if TYPE_CHECKING:
    from concurrent.futures import ThreadPoolExecutor

    from fba.animation import Animation
    from fba.face import FaceModel
    from fba_player._figure.face import FaceFigure

LEAST = 1e-5
"""The last colour stands for at least this distance (m)."""
ARRANGEMENTS = ("side", "over", "colour", "wipe")
"""Side by side; over the first, as coloured drawings of feature points and bones; side by side, coloured by
how far they are from the first; two in the same place, one on each side of a line."""
ROOTS = ("own", "common")
"""Bodies move as they were recorded; or all where the first one's root is."""
SCALE_SAMPLES = 24
"""Number of moments from which the scale of the colours is taken."""
COLOURS = ("#2f9bff", "#ff5a36", "#39c26b", "#c266ff", "#f2b500")
"""Colours (sRGB) of the drawings over the first, in turn."""
FIGURE_DISTANCE = 1.12
"""Distance between figures side by side, in their widths."""
FIELD_OF_VIEW = 14.0
"""Field of view (degrees): narrow, from further away, so that all figures are seen from the same side."""
SHOULDER_HALF_WIDTH = 0.25
"""Half the width (m) of a body that is seen from the hips up."""
CAPTION_ROOM = {"side": 1.05, "over": 1.0, "colour": 1.42, "wipe": 1.15}
"""Height that figures get with their captions, and with the legend of colours over them, in their own."""
CAPTION_HEIGHT = 0.96
"""Height of a caption above the middle of a head, in half heads."""


def _rebuild(
    scenes: Sequence[Scene], arrangement: str, names: Sequence[str], state: dict[str, Any]
) -> CompareScene:
    scene = CompareScene(scenes, arrangement=arrangement, names=names)
    vars(scene).update(state)
    return scene


class CompareScene(Timed[CompareTimeline]):
    """Several scenes shown together on one timeline; a `Showable` like `Scene`.

    scenes: at least one. arrangement: one of `ARRANGEMENTS`; may be set at any time. names: captions of the
    figures side by side, by default the animations' names; "" for none. A head without a body is shown at
    the height of the heads on bodies. Figures stand side by side as seen by the last `camera`.

    May be set at any time: root, one of `ROOTS`; wipe, where the line is, 0..1 of the picture's width;
    second, the number of the scene that is seen on its right.
    """

    root = "own"
    wipe = 0.5
    second = 1

    def __init__(
        self, scenes: Sequence[Scene], *, arrangement: str = "side", names: Sequence[str] | None = None
    ) -> None:
        if not scenes:
            raise ValueError("nothing to show: there is no scene")
        self.scenes = tuple(scenes)
        self.names = tuple(names) if names is not None else tuple(scene.title for scene in scenes)
        if len(self.names) != len(self.scenes):
            raise ValueError(f"{len(self.scenes)} scenes, but {len(self.names)} names")
        self.switches = scenes[0].switches  # `show` sets those of all
        self.timeline = CompareTimeline([scene.timeline for scene in scenes])
        self.arrangement = arrangement
        self._yaw = 0.0
        self._stands = [np.array(scene.subject.centre) for scene in scenes]
        self._drawings = [Drawing(COLOURS[number % len(COLOURS)]) for number in range(len(scenes))]
        self._apart: float | None = None
        self._differences: dict[tuple[int, int], Differences] = {}
        self._colours = DifferenceColours()
        self._scale: tuple[tuple[int, str], float] | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy in another process builds its figures anew."""
        state = {name: getattr(self, name) for name in ("orbit", "root", "wipe", "second")}
        return _rebuild, (self.scenes, self.arrangement, self.names, state)

    @property
    def arrangement(self) -> str:
        """One of `ARRANGEMENTS`."""
        return self._arrangement

    @arrangement.setter
    def arrangement(self, name: str) -> None:
        if name not in ARRANGEMENTS:
            raise ValueError(f"no arrangement {name!r}; there are {', '.join(ARRANGEMENTS)}")
        self._arrangement = name

    @property
    def animation(self) -> Animation:
        """The first scene's animation."""
        return self.scenes[0].animation

    @property
    def model(self) -> FaceModel:
        """The first scene's face model."""
        return self.scenes[0].model

    @property
    def figure(self) -> FaceFigure:
        """The first scene's face as it is shown."""
        return self.scenes[0].figure

    @property
    def title(self) -> str:
        """The scenes' names."""
        return " | ".join(name for name in self.names if name)

    @property
    def follow(self) -> str | None:
        """What the camera follows; of all scenes."""
        return self.scenes[0].follow

    @follow.setter
    def follow(self, what: str | None) -> None:
        for scene in self.scenes:
            scene.follow = what

    def show(self, name: str, on: object = True) -> None:
        """Set a switch of all scenes; ValueError for an unknown name or value."""
        for scene in self.scenes:
            scene.show(name, on)

    @property
    def view(self) -> str:
        """How the scenes are shown: "figure" or "points"."""
        return self.scenes[0].view

    @view.setter
    def view(self, name: str) -> None:
        for scene in self.scenes:
            scene.view = name

    @property
    def has_body(self) -> bool:
        """Whether a scene has a body."""
        return any(scene.has_body for scene in self.scenes)

    def camera(self, preset: str | None = None, aspect: float = 16 / 9) -> Camera:
        """Return a camera that has all figures in view; from now on they stand side by side as it sees them.

        preset: see `Scene.camera`.
        """
        camera = self.scenes[0].camera(preset, aspect)
        if self._in_a_row and len(self.scenes) > 1:
            camera = replace(camera, field_of_view=FIELD_OF_VIEW)
        self._yaw = camera.yaw
        upper = [scene.gesture_subject or scene.face_subject for scene in self.scenes if scene.has_body]
        still = all(scene.gesture_subject for scene in self.scenes if scene.has_body)
        whole = preset is not None and preset not in FACE_PRESETS
        if not self.has_body or whole or (preset is None and not still):
            subjects = [scene.subject for scene in self.scenes]
            self._apart = None
        elif preset is None:
            subjects = [scene.gesture_subject or scene.subject for scene in self.scenes]
            self._apart = max(SHOULDER_HALF_WIDTH * 1.3, max(subject.half_width for subject in upper) * 0.8)
        else:
            subjects = [scene.face_subject for scene in self.scenes]
            self._apart = SHOULDER_HALF_WIDTH
        self._stands = [np.array(subject.centre) for subject in subjects]
        return camera.fit(self._all(subjects), aspect)

    def travel(self, time: float) -> tuple[float, float, float]:
        """Return the offset of a following camera at a time, metres: the first scene's."""
        return self.scenes[0].travel(self.timeline.own_time(0, time))

    def head_travel(self, time: float) -> tuple[float, float, float]:
        """Return the displacement of the first scene's head from the start to a time, metres."""
        return self.scenes[0].head_travel(self.timeline.own_time(0, time))

    def view_at(self, time: float, seen: Seen | None = None) -> View:
        """Return everything to be drawn at a time in seconds; see `Scene.view_at`."""
        times = [self.timeline.own_time(number, time) for number in range(len(self.scenes))]
        if self._arrangement == "over":
            return self._over(times)
        if self._arrangement == "wipe":
            return self._wiped(times)
        offsets = [self._placed(number, times) for number in range(len(self.scenes))]
        alone: list[Seen | None] = [None] * len(offsets)
        if seen is not None and self._arrangement == "side":
            alone = [seen.move(offset) for offset in offsets]
        views = list(self._threads.map(lambda scene, *at: scene.view_at(*at), self.scenes, times, alone))
        most = 0.0
        if self._arrangement == "colour" and len(views) > 1:
            most = self._most()
            for number in range(1, len(views)):
                faces = [mesh for mesh in views[number].faces if mesh.shape.kind not in HAIRS]
                offset = self._compared_at(number, times)
                faces = self._colours.paint(faces, views[0].faces, offset, most)
                views[number] = replace(views[number], faces=faces)
        views = [move_view(view, offset) for view, offset in zip(views, offsets, strict=True)]
        joined = self._captioned(join_views(views), range(len(views)), times)
        if not most:
            return joined
        legend = heat_legend("Difference", "mm from the first", most * 1000)
        return replace(joined, extras=replace(joined.extras or Extras(), legend=legend))

    @cached_property
    def _threads(self) -> ThreadPoolExecutor:
        """What poses the figures, on all processors: compiled loops run beside each other."""
        from concurrent.futures import ThreadPoolExecutor

        again = len(set(self.scenes)) < len(self.scenes)  # a scene has only one pose at a time
        return ThreadPoolExecutor(1 if again else os.cpu_count(), thread_name_prefix="fba pose")

    @property
    def _in_a_row(self) -> bool:
        return self._arrangement in ("side", "colour")

    def _captioned(self, view: View, numbers: Iterable[int], times: list[float]) -> View:
        """Return the view of moved scenes with their names above the heads."""
        named = [number for number in numbers if self.names[number]]
        if not named or len(self.scenes) < 2:
            return view
        places = np.empty((len(named), 3))
        for row, number in enumerate(named):
            head = self._heads[number]
            places[row] = self._shift(number) + head.centre
            places[row, 1] += head.half_height * CAPTION_HEIGHT
            if self._arrangement == "wipe":
                aside = SHOULDER_HALF_WIDTH if self.scenes[number].has_body else head.half_width
                places[row] += self._right() * aside * (1.0 if number else -1.0)
        names = tuple(self.names[number] for number in named)
        captions = make_captions(names, places + self.scenes[0].travel(times[0]))
        extras = view.extras or Extras()
        return replace(view, extras=replace(extras, dots=(*extras.dots, captions)))

    def _wiped(self, times: list[float]) -> View:
        """Return the first scene, and the second one in its place on the right of the line."""
        views = []
        for number in (0, min(self.second, len(self.scenes) - 1)):
            view = move_view(self.scenes[number].view_at(times[number]), self._placed(number, times))
            views.append(self._captioned(view, [number], times))
        return replace(views[0], wipe=Wipe(views[1], min(max(self.wipe, 0.0), 1.0)))

    def _placed(self, number: int, times: list[float]) -> Float64:
        """Return (3,): how far a scene is moved at its own time; a following camera follows the first."""
        if self.root == "common":
            apart = self._apart_now(number, times) - self._apart_at_start(number)
            return np.asarray(self._shift(number) - apart)
        own = np.array(self.scenes[number].travel(times[number]))
        first = np.array(self.scenes[0].travel(times[0]))
        return np.asarray(self._shift(number) + first - own)

    def _apart_at_start(self, number: int) -> Float64:
        """Return (3,): from the first body's root to that of another at the start; zeros without bodies."""
        return self._apart_now(number, [float(scene.start) for scene in self.scenes])

    def _apart_now(self, number: int, times: list[float]) -> Float64:
        if not (self.scenes[0].has_body and self.scenes[number].has_body):
            return np.zeros(3)
        return self.scenes[number].place(times[number]) - self.scenes[0].place(times[0])

    def _compared_at(self, number: int, times: list[float]) -> Float64:
        """Return (3,): from where the first body is to where another would be without any difference."""
        if self.root == "common":
            return self._apart_now(number, times)
        return self._apart_at_start(number)

    def _most(self) -> float:
        """Return the largest distance of any vertex from the first scene's, rounded up, metres."""
        key = (self.timeline.arrived, self.root)
        if self._scale is None or self._scale[0] != key:
            most = 0.0
            for time in np.linspace(
                float(self.timeline.start), float(self.timeline.end), SCALE_SAMPLES
            ).tolist():
                times = [self.timeline.own_time(number, time) for number in range(len(self.scenes))]
                first = self.scenes[0].view_at(times[0]).faces
                for number in range(1, len(self.scenes)):
                    faces = self.scenes[number].view_at(times[number]).faces
                    for away in distances(faces, first, self._compared_at(number, times)):
                        most = max(most, float(away.max(initial=0.0)))
            self._scale = (key, round_up(most))
        return self._scale[1]

    @cached_property
    def _heads(self) -> list[Subject]:
        """The head of each scene at the start."""
        return [scene.face_subject for scene in self.scenes]

    def still(self, faps: Float32) -> View:
        """Return the first scene alone for FAPs (68,)."""
        return self.scenes[0].still(faps)

    def differences(self, second: int = 1) -> Differences:
        """Return the performance `second` minus the first; cached until more of a performance arrives.

        Raises ValueError if there is no such performance.
        """
        key = (second, self.timeline.arrived)
        if key not in self._differences:
            current = {old: value for old, value in self._differences.items() if old[1] == key[1]}
            self._differences = current | {key: differences(self.timeline, second)}
        return self._differences[key]

    def _over(self, times: list[float]) -> View:
        views = [self.scenes[0].view_at(times[0])]
        for number in range(1, len(self.scenes)):
            scene, own_time = self.scenes[number], times[number]
            before, scene.view = scene.view, "points"
            try:
                drawn = self._drawings[number - 1](scene.view_at(own_time), len(scene.figure.eyeballs))
            finally:
                scene.view = before
            views.append(move_view(drawn, self._placed(number, times)))
        return join_views(views)

    def _right(self) -> Float64:
        """Return (3,): the picture's right, on the ground."""
        yaw = math.radians(self._yaw)
        return np.array([math.cos(yaw), 0.0, -math.sin(yaw)])

    def _shift(self, number: int) -> Float64:
        """Return (3,): the shift of a figure in the arrangement."""
        # Recordings begin anywhere: each figure is brought to where the first one is.
        to_first = (self._stands[0] - self._stands[number]) * (1.0, 0.0, 1.0)
        if not self._in_a_row:
            return self._height(number) + (to_first if self._arrangement == "wipe" else 0.0)
        widths = [self._half_width(scene) for scene in self.scenes]
        along = sum(widths[:number]) - sum(widths[number + 1 :])
        height = self._height(number) * (0.0, 1.0, 0.0)
        return np.asarray(self._right() * along * FIGURE_DISTANCE + to_first + height)

    def _half_width(self, scene: Scene) -> float:
        """Return half the width that a figure takes: of a body its own, of heads that of the widest."""
        if self._apart is not None:
            return self._apart
        if scene.has_body:
            return max(scene.subject.half_width, SHOULDER_HALF_WIDTH)
        heads = max(scene.subject.half_width for scene in self.scenes if not scene.has_body)
        return max(heads, SHOULDER_HALF_WIDTH) if self.has_body else heads

    def _height(self, number: int) -> Float64:
        """Return (3,): the shift that brings a head alone to the height of heads on bodies."""
        scene = self.scenes[number]
        with_body = next((other for other in self.scenes if other.has_body), None)
        if scene.has_body or with_body is None:
            return np.zeros(3)
        return np.subtract(with_body.face_subject.centre, scene.face_subject.centre)

    def _all(self, subjects: list[Subject]) -> Subject:
        """Return one subject around all subjects in their places."""
        right = self._right()
        centres = [np.array(subject.centre) + self._shift(n) for n, subject in enumerate(subjects)]
        along = [float(centre @ right) for centre in centres]
        widths = [
            max(subject.half_width, (self._apart or 0.0) * 0.7, SHOULDER_HALF_WIDTH if self.has_body else 0.0)
            for subject in subjects
        ]
        low = min(a - width for a, width in zip(along, widths, strict=True))
        high = max(a + width for a, width in zip(along, widths, strict=True))
        bottom = min(float(p[1]) - s.half_height for p, s in zip(centres, subjects, strict=True))
        room = CAPTION_ROOM[self._arrangement] if any(self.names) else 1.0
        top = max(float(p[1]) + s.half_height * room for p, s in zip(centres, subjects, strict=True))
        middle = np.mean(centres, axis=0)
        middle = middle + right * ((low + high) / 2 - float(middle @ right))
        centre = (float(middle[0]), (bottom + top) / 2, float(middle[2]))
        return Subject(centre, (top - bottom) / 2, (high - low) / 2)


class DifferenceColours:
    """Paints the parts of a figure by their distance from the same parts of another.

    Parts that the other does not have, by name and number of vertices, have the colour of 0.
    """

    def __init__(self) -> None:
        self._shapes: WeakKeyDictionary[FaceShape, FaceShape] = WeakKeyDictionary()

    def paint(
        self, meshes: Sequence[FaceMesh], others: Sequence[FaceMesh], offset: Float64, most: float
    ) -> list[FaceMesh]:
        """Return the meshes in colours.

        offset: (3,), added to the others' places, metres. most: the distance of the last colour, metres.
        """
        painted = []
        for mesh, away in zip(meshes, distances(meshes, others, offset), strict=True):
            if mesh.shape not in self._shapes:
                grey = np.full((len(mesh.positions), 4), GLOSS, dtype=np.float32)
                self._shapes[mesh.shape] = plain_colours(mesh.shape, grey)
            shape = self._shapes[mesh.shape]
            looks = shape.looks.copy()
            looks[:, :3] = linear_light(heat_colours(np.minimum(away / most, 1.0)))
            painted.append(mesh._replace(shape=shape, looks=looks))
        return painted


def distances(meshes: Sequence[FaceMesh], others: Sequence[FaceMesh], offset: Float64) -> list[Float32]:
    """Return how far the vertices (V,) of each mesh are from those of the same part, metres; 0 without."""
    parts = {(mesh.shape.name, mesh.shape.kind, len(mesh.positions)): mesh for mesh in others}
    result = []
    for mesh in meshes:
        other = parts.get((mesh.shape.name, mesh.shape.kind, len(mesh.positions)))
        away = np.zeros(len(mesh.positions))
        if other is not None:
            away = np.linalg.norm(_places(mesh) - _places(other) - offset, axis=1)
        result.append(away.astype(np.float32))
    return result


def round_up(distance: float) -> float:
    """Return the next of 1, 2, 5, 10... times a power of ten, metres."""
    power = 10.0 ** math.floor(math.log10(max(distance, LEAST)))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= max(distance, LEAST) * 0.999)


def _places(mesh: FaceMesh) -> Float64:
    turned = turn_partly(mesh.positions, mesh.shape.sway, mesh.turn, mesh.centre)
    return transform(turned, mesh.matrix)
