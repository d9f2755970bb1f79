"""A scene: an animation on a face and body, which gives the view at any time and a camera for it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fba.animation import Animation
from fba.arrays import Float32, Float64
from fba.choices import Axes
from fba_player.playback._timeline import Timeline
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

BODY_SUBJECT = Subject((0.0, 0.88, 0.0), 0.98, 0.62)
"""A body that stands at the origin."""
HIPS = 0.78
HEADROOM = 0.14
"""Metres above the highest joint that a head takes."""
MAX_STANDING_TRAVEL = 0.12
"""Legs that move by less than this (m) count as still."""
MAX_FIXED_TRAVEL = 4.0
"""The camera follows a performance that moves further than this (m)."""
MIN_APPROACH = 0.12
"""Movement (m) below which the camera's distance is not enlarged."""
ARM_REACH = 1.0
"""Half the width (m) of a person with stretched arms."""
LOWER = 0.09
"""Metres below the root of a person who walks away at which the middle of the picture is."""
HEAD_JOINT = "skullbase"
LEGS = ("l_knee", "r_knee", "l_ankle", "r_ankle")
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
        matrix = self._face_matrix(joints) @ self.figure.deformer.head_matrices(faps)
        x, y, z = (matrix @ np.array([*face.centre, 1.0]))[:3].tolist()
        return Subject((x, y, z), face.half_height, face.half_width)

    def camera(self, preset: str | None = None, aspect: float = 16 / 9) -> Camera:
        """Return a camera that has everything in view, for the named preset or for what the content suggests.

        "body", "side", "back" and "top" fit the whole body; "front", "three-quarter", "profile" and "face"
        look at the face, also where there is a body; "turn=35,tilt=5" is any other view of the whole figure.
        ValueError for another name.
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
        faces = self.person.meshes(faps, turned, seen)  # first: the eyes take the vertices moved for it
        return View(
            eyes=self.person.eyes(faps, turned),
            faces=faces,
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


@dataclass(frozen=True)
class Extent:
    """The space that a performance takes.

    follows: whether it goes too far for one fixed camera. legs_move: whether legs move by more than
    `MAX_STANDING_TRAVEL`.
    """

    subject: Subject
    follows: bool
    legs_move: bool

    @property
    def upper_half(self) -> Subject:
        subject = self.subject
        x, y, z = subject.centre
        top = y + subject.half_height
        bottom = min(HIPS, top - 0.8)
        half_width = min(subject.half_width, 0.55)
        return Subject((x, (top + bottom) / 2, z), (top - bottom) / 2, half_width, subject.half_depth)


def body_extent(
    positions: Float64, names: tuple[str, ...], headroom: float = HEADROOM, *, follow: str | None = None
) -> Extent:
    """Return the extent of joints at positions (T, J, 3), metres, the root first, over T moments.

    headroom: metres above the highest joint. follow: what the camera was told to follow, see `FOLLOWS`.
    """
    legs = positions[:, [names.index(name) for name in LEGS if name in names]]
    legs_move = bool(legs.size) and bool(np.abs(legs - legs[0]).max() > MAX_STANDING_TRAVEL)
    low, high = positions.min(axis=(0, 1)), positions.max(axis=(0, 1))
    finite = bool(np.isfinite(high - low).all())
    far = not finite or (high - low).max() > MAX_FIXED_TRAVEL
    if (far and (follow != "none" or not finite)) or follow in ("hips", "head"):
        x, y, z = positions[0, 0].tolist()
        more = _head_above(positions, names, headroom) / 2
        subject = Subject((x, y - LOWER + more, z), BODY_SUBJECT.half_height + more, _reach(positions))
        return Extent(subject, follows=True, legs_move=legs_move)
    low, high = low - np.array([0.10, 0.06, 0.10]), high + np.array([0.10, max(headroom, HEADROOM), 0.10])
    aside = (low + high) / 2 * (1.0, 0.0, 1.0)  # for a body that does not stand at the origin
    low = np.minimum(low, np.array(BODY_SUBJECT.centre) - (0.35, 0.95, 0.3) + aside)
    x, y, z = ((low + high) / 2).tolist()
    wide = float(np.hypot(high[0] - low[0], high[2] - low[2])) / 2
    tall = max(float(high[1] - low[1]) / 2 * 1.06, 0.9)
    path = positions[:, 0, [0, 2]]
    towards = float(np.linalg.norm(path - (x, z), axis=1).max())  # from any side
    subject = Subject((x, y, z), tall, max(wide, BODY_SUBJECT.half_width), max(towards - MIN_APPROACH, 0.0))
    return Extent(subject, follows=False, legs_move=legs_move)


def _reach(positions: Float64) -> float:
    """Return half the width that a walker takes, metres: more than usual with arms stretched out."""
    if not np.isfinite(positions).all():
        return BODY_SUBJECT.half_width
    away = np.linalg.norm((positions - positions[:, :1])[..., [0, 2]], axis=2)
    return min(max(float(away.max()), BODY_SUBJECT.half_width), ARM_REACH)


def _head_above(positions: Float64, names: tuple[str, ...], headroom: float) -> float:
    """Return metres by which a head rises above `BODY_SUBJECT` at the root at most; 0 for usual ones."""
    if HEAD_JOINT not in names or not np.isfinite(positions).all():
        return 0.0
    height = float((positions[:, names.index(HEAD_JOINT), 1] - positions[:, 0, 1]).max())
    return max(height + headroom - (BODY_SUBJECT.half_height - LOWER), 0.0)
