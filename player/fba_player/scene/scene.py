"""A scene: an animation on a face and body, which gives the view at any time and a camera for it."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fba.animation import Animation
from fba.arrays import Float32, Float64
from fba.choices import Axes
from fba_player.playback._timeline import Timeline
from fba_player.scene._framing import Extent, body_extent
from fba_player.view._camera import FACE_PRESETS, Camera, Subject
from fba_player.view._view import Seen, View
from fba_player.view.protocols import Timed
from fba_player.view.switches import SWITCHES, Switches

if TYPE_CHECKING:
    from fba.body import BodyModel
    from fba.face import FaceModel
    from fba_player._figure.face import FaceFigure
    from fba_player._figure.person import Person
    from fba_player.scene._display_options import DisplayOptions
    from fba_player.scene._feature_points_view import PointView

__all__ = ["LOOKS", "SWITCHES", "Scene", "default_camera"]


EXTENT_SAMPLES = 48
"""Number of moments at which a body's extent is sampled to fit the camera."""
LOOKS = ("figure", "points")
"""How a scene may be shown: as a person, or as feature points and bones."""


class Scene(Timed[Timeline]):
    """An animation ready to be drawn: face alone as a head with shoulders, body with the head on it.

    animation: at least one frame, else ValueError. model: the face, by default the built-in head; one that is
    not in metres is scaled to a person's size, with an FbaWarning for that and for missing eyes, teeth or
    tables. body: the body that BAPs move, by default the built-in person; one without a place for a face
    keeps its own head. axes: name of the body's axis convention (`fba.body.convention_names()`). view:
    "figure" for a person, "points" for feature points with lines and bones; may be set at any time,
    ValueError for another value. timeline: by default `Timeline(animation, model)`; one that grows shows a
    stream as it arrives.

    `show` sets the `switches` at any time. Figures are built on first use. A `Showable`.
    """

    def __init__(
        self,
        animation: Animation,
        model: FaceModel | None = None,
        *,
        body: BodyModel | None = None,
        axes: Axes = "iso",
        view: str = "figure",
        timeline: Timeline | None = None,
    ) -> None:
        if not len(animation):
            raise ValueError("nothing to show: the animation has no frames")
        from fba.face import FaceModel
        from fba_player._figure.model_units import prepare_model

        self.animation = animation
        self.model = FaceModel.default() if model is None else prepare_model(model)
        self.timeline = timeline or Timeline(animation, self.model)
        self.switches = Switches()
        self.view = view
        self.axes = axes
        self._extent: tuple[str | None, Extent] | None = None
        self._sampled_frames = 0  # number of frames when the extent was sampled
        if animation.body is not None:
            from fba.body import BodyModel
            from fba_player._figure.posing import FigurePoser
            from fba_player.scene._bones import Bones

            self._body = body or BodyModel.default()
            self._skeleton = self._body.skeleton
            self._poser = FigurePoser(self._body, axes)
            self._bones = Bones.from_skeleton(self._skeleton)

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy in another process builds its figures anew."""
        body = replace(self._body) if self.has_body else None  # without what was made for drawing
        state = {"follow": self.follow, "orbit": self.orbit}
        switches = self.switches.changed
        return _rebuild, (self.animation, self.model, body, self.axes, self.view, switches, state)

    @property
    def view(self) -> str:
        """How the scene is shown: "figure" or "points"."""
        return self._view

    @view.setter
    def view(self, name: str) -> None:
        if name not in LOOKS:
            raise ValueError(f"no view {name!r}; there are {', '.join(LOOKS)}")
        self._view = name

    @property
    def title(self) -> str:
        """The animation's name."""
        return self.animation.name

    @cached_property
    def figure(self) -> FaceFigure:
        """The face that is shown; built on first use."""
        from fba_player._figure.face import build_figure

        return build_figure(self.model)

    @cached_property
    def person(self) -> Person:
        """The body that is shown, with the face on it; built on first use; only if there is a body."""
        from fba_player._figure.person import build_person

        return build_person(self._body, self.figure)

    @cached_property
    def _point_view(self) -> PointView:
        from fba_player.scene._feature_points_view import PointView

        return PointView(self.figure)

    @cached_property
    def _options(self) -> DisplayOptions:
        from fba_player.scene._display_options import DisplayOptions

        return DisplayOptions(self.figure, self._bones if self.has_body else None)

    @property
    def has_body(self) -> bool:
        """Whether a body is shown."""
        return self.animation.body is not None

    @property
    def subject(self) -> Subject:
        """What a camera should have in view over the whole performance."""
        return self._sampled_extent().subject if self.has_body else self.figure.subject

    @property
    def gesture_subject(self) -> Subject | None:
        """The body from the hips up if the legs stand still and the face is animated, else None."""
        if not self.has_body or self.animation.face is None or self._sampled_extent().legs_move:
            return None
        return self._sampled_extent().upper_half

    @property
    def face_subject(self) -> Subject:
        """The head alone, at the start of the performance."""
        return self._face_at(float(self.start))

    def _face_at(self, time: float) -> Subject:
        """Return the head alone at a time."""
        face = self.figure.subject
        if not self.has_body:
            return face
        faps, joints = self._pose_at(time)
        matrix = self._face_matrix(joints) @ self.figure.pose(faps).turn
        x, y, z = (matrix @ np.array([*face.centre, 1.0]))[:3].tolist()
        return Subject((x, y, z), face.half_height, face.half_width)

    def camera(self, preset: str | None = None, aspect: float = 16 / 9) -> Camera:
        """Return a camera that has everything in view, for the named preset or for what the content suggests.

        "body", "side", "back" and "top" fit the whole body; "front", "three-quarter", "profile" and "face"
        look at the face, also where there is a body. ValueError for another name.
        """
        if preset is None:
            return default_camera(self, aspect)
        subject = self.face_subject if preset in FACE_PRESETS or not self.has_body else self.subject
        return Camera.preset(preset, subject, aspect)

    def view_for(self, faps: Float32, baps: Float64, seen: Seen | None = None) -> View:
        """Return the view for FAPs (68,), as `fba.face.resolve` gives them, and BAPs (296,), if any.

        seen: see `view_at`.
        """
        return self._make_view(faps, self._joints(baps) if self.has_body else None, seen)

    def still(self, faps: Float32) -> View:
        """Return the view for FAPs (68,), in the body's pose at the start."""
        return self._make_view(faps, self._pose_at(float(self.start))[1])

    def view_at(self, time: float, seen: Seen | None = None) -> View:
        """Return the view at a time in seconds; before the start or after the end, the first or last frame.

        seen: where from; a distant figure is then moved in no more detail than it is drawn in from there.
        Raises ValueError if the time is not finite.
        """
        return self._make_view(*self._pose_at(time), seen)

    def _make_view(self, faps: Float32, joints: Float64 | None, seen: Seen | None = None) -> View:
        if self.switches.changed:
            seen = None  # they may show all vertices
        view = (
            self._points(faps, joints) if self._view == "points" else self._person_or_head(faps, joints, seen)
        )
        if not self.switches.changed:
            return view
        from fba_player.scene._display_options import Posture

        return self._options.apply(view, self.switches, Posture(faps, self._face_matrix(joints), joints))

    def _person_or_head(self, faps: Float32, joints: Float64 | None, seen: Seen | None) -> View:
        """Return the view of a person or a head."""
        if joints is None:
            world = np.eye(4)
            return View(eyes=self.figure.eyes(faps, world), faces=self.figure.meshes(faps, world))
        turned = self.person.joints(faps, joints)
        return View(
            eyes=self.person.eyes(faps, turned),
            faces=self.person.meshes(faps, turned, seen),
            blobs=self._bones.shadows(joints),
            ground=True,
        )

    def _points(self, faps: Float32, joints: Float64 | None) -> View:
        """Return the view of feature points and bones."""
        points, matrix = self._point_view, self._face_matrix(joints)
        view = View(
            meshes=points.meshes(faps, matrix),
            capsules=points.eyeballs(faps, matrix),
            marks=points.marks(faps, matrix),
            faces=points.dull_face(faps, matrix, on_body=joints is not None),
        )
        if joints is None:
            return view
        capsules = np.concatenate([view.capsules, self._bones.capsules(joints)])
        return replace(view, capsules=capsules, blobs=self._bones.shadows(joints), ground=True)

    def travel(self, time: float) -> tuple[float, float, float]:
        """Return the offset (x, y, z) of a following camera, metres; zeros if it does not follow."""
        if not self.has_body or not self._sampled_extent().follows:
            return (0.0, 0.0, 0.0)
        joints = self._pose_at(time)[1]
        assert joints is not None
        centre = self.subject.centre
        return (float(joints[0, 0, 3]) - centre[0], 0.0, float(joints[0, 2, 3]) - centre[2])

    def place(self, time: float) -> Float64:
        """Return where the body's root is at a time, (3,), metres; zeros without a body."""
        joints = self._pose_at(time)[1]
        return np.zeros(3) if joints is None else np.array(joints[0, :3, 3])

    def head_travel(self, time: float) -> tuple[float, float, float]:
        """Return the displacement (x, y, z) of the head from the start, metres; zeros without a body."""
        x, y, z = np.subtract(self._face_at(time).centre, self.face_subject.centre).tolist()
        return (x, y, z)

    def _pose_at(self, time: float) -> tuple[Float32, Float64 | None]:
        faps = self.timeline.faps(time)
        if not self.has_body:
            return faps, None
        return faps, self._joints(self.timeline.baps(time))

    def _joints(self, baps: Float64) -> Float64:
        """Return joint matrices (J, 4, 4) for BAPs (296,); as points they are shown as the BAPs say."""
        return (
            self._poser.plain.pose(baps) if self._view == "points" else self._poser.pose(baps, self.switches)
        )

    def _face_matrix(self, joints: Float64 | None) -> Float64:
        """Return (4, 4): from the face model's frame into the world, without the head's own turn."""
        return np.eye(4) if joints is None else self.person.frame(joints)

    def _sampled_extent(self) -> Extent:
        frames = self.timeline.frames
        grown = frames >= 2 * self._sampled_frames  # a stream, by much
        if self._extent is None or self._extent[0] != self.follow or grown:
            self._sampled_frames = frames
            sampled = np.unique(np.linspace(0, frames - 1, min(frames, EXTENT_SAMPLES)).astype(int))
            baps = np.stack([self.timeline.baps(float(self.timeline.time_of(int(t)))) for t in sampled])
            positions = self._poser.plain.pose(baps)[:, :, :3, 3]
            extent = body_extent(positions, self._skeleton.names, self.person.headroom, follow=self.follow)
            self._extent = (self.follow, extent)
        return self._extent[1]


def _rebuild(
    animation: Animation,
    model: FaceModel,
    body: BodyModel | None,
    axes: Axes,
    view: str,
    switches: dict[str, object],
    state: dict[str, Any],
) -> Scene:
    scene = Scene(animation, model, body=body, axes=axes, view=view)
    for name, value in switches.items():
        scene.show(name, value)
    vars(scene).update(state)
    return scene


def default_camera(scene: Scene, aspect: float = 16 / 9) -> Camera:
    """Return a camera that suits the content.

    It shows a whole body; a body from the hips up if its face moves and its legs stand still; a face alone
    slightly from the side.
    """
    if scene.has_body:
        return Camera.preset("body", scene.gesture_subject or scene.subject, aspect)
    return Camera(yaw=14.0, pitch=2.0).fit(scene.subject, aspect)
