"""What is shown at time t: an animation, its face, its body, and where a camera should look."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fba.animation import Animation
from player.camera import Camera, Subject
from player.shapes import View
from player.timeline import Timeline

if TYPE_CHECKING:
    from fba.body.model import BodyModel
    from fba.face.model import FaceModel
    from player.face import FaceFigure
    from player.person import Person
    from player.point_view import PointView

Float64 = npt.NDArray[np.float64]

BODY_SUBJECT = Subject((0.0, 0.88, 0.0), 0.98, 0.62)
SAMPLES = 48
"""Moments at which the extent of a moving body is looked up to fit the camera."""
HIPS = 0.78
STANDING = 0.12
"""Legs that move less than this (m) stand still."""
MOST_TRAVEL = 4.0
"""A performance that moves further than this (m) is followed by the camera instead of fitted whole."""
LOOKS = ("figure", "points")
"""What a scene may be shown as: a person, or feature points and bones."""


class Scene:
    """An animation ready to be drawn: face alone as a head with shoulders, body with the head on it.

    animation: at least one frame, else ValueError. model: the face, by default the built-in head. body:
    what BAPs move, by default the built-in person; ModelError where it has no place for a face. axes: name
    of the body's axis convention (`fba.body.convention_names()`). view: "figure", a person, or "points",
    the face as its feature points with lines through them and the body as its bones; it may be set at any
    time, ValueError where it is something else. What is drawn is worked out on first use.
    """

    def __init__(
        self,
        animation: Animation,
        model: FaceModel | None = None,
        *,
        body: BodyModel | None = None,
        axes: str = "iso",
        view: str = "figure",
    ) -> None:
        if not len(animation):
            raise ValueError("nothing to show: the animation has no frames")
        self.animation = animation
        self.model = model or _default_model()
        self.timeline = Timeline(animation, self.model)
        self.view = view
        self._figure: FaceFigure | None = None
        self._point_view: PointView | None = None
        self._person: Person | None = None
        self._subject: Subject | None = None
        self._follow = False
        self._legs_move = False
        if animation.body is not None:
            from fba.body import BapSolver
            from fba.body.model import BodyModel
            from player.bones import Bones

            self._body = body or BodyModel.default()
            self._skeleton = self._body.skeleton
            self._solver = BapSolver(self._skeleton, axes)
            self._bones = Bones(self._skeleton)

    @property
    def view(self) -> str:
        """What the scene is shown as: "figure" or "points"."""
        return self._view

    @view.setter
    def view(self, name: str) -> None:
        if name not in LOOKS:
            raise ValueError(f"no view {name!r}; there are {', '.join(LOOKS)}")
        self._view = name

    @property
    def figure(self) -> FaceFigure:
        """The face that is shown; built on first use."""
        if self._figure is None:
            from player.face import FaceFigure

            self._figure = FaceFigure(self.model)
        return self._figure

    @property
    def person(self) -> Person:
        """The body that is shown, with the face on it; built on first use. Only where there is a body."""
        if self._person is None:
            from player.person import Person

            self._person = Person(self._body, self.figure)
        return self._person

    @property
    def has_body(self) -> bool:
        """Whether a body is shown."""
        return self.animation.body is not None

    @property
    def rate(self) -> Fraction:
        """Frames a second of the animation."""
        return self.timeline.rate

    @property
    def start(self) -> Fraction:
        """Time of the first frame, seconds."""
        return self.timeline.start

    @property
    def duration(self) -> Fraction:
        """Seconds from the first frame to the end of the last."""
        return self.timeline.duration

    @property
    def subject(self) -> Subject:
        """What a camera is to have in view over the whole performance."""
        if self._subject is None:
            self._subject = self._extent() if self.has_body else self.figure.subject
        return self._subject

    @property
    def gesture_subject(self) -> Subject | None:
        """The body from the hips up, where the legs stand still and the face is animated; else None."""
        whole = self.subject
        if self._legs_move or self.animation.face is None:
            return None
        top = whole.centre[1] + whole.half_height
        bottom = min(HIPS, top - 0.8)
        x, _, z = whole.centre
        return Subject((x, (top + bottom) / 2, z), (top - bottom) / 2, min(whole.half_width, 0.55))

    @property
    def face_subject(self) -> Subject:
        """The head alone, where the performance begins."""
        face = self.figure.subject
        if not self.has_body:
            return face
        faps, joints = self._posed(float(self.start))
        matrix = self._face_matrix(joints) @ self.figure.pose(faps).turn
        x, y, z = (matrix @ np.array([*face.centre, 1.0]))[:3]
        return Subject((float(x), float(y), float(z)), face.half_height, face.half_width)

    def camera(self, preset: str | None = None, aspect: float = 16 / 9) -> Camera:
        """A camera that has everything in view: the named preset, or the one that suits the content.

        "body" fits the whole body; the other presets look at the face, from the front, at three quarters
        or in profile, also where there is a body. ValueError for another name.
        """
        if preset is None:
            return default_camera(self, aspect)
        whole = self.has_body and preset == "body"
        return Camera.preset(preset, self.subject if whole else self.face_subject, aspect)

    def still(self, faps: npt.NDArray[np.float32]) -> View:
        """The face for FAPs (68,) as they are shown, in the body's posture at the start."""
        return self._shown(faps, self._posed(float(self.start))[1])

    def at(self, time: float) -> View:
        """Everything to be drawn at a time in seconds; before the start or after the end, its frames.

        Raises ValueError for a time that is not finite.
        """
        return self._shown(*self._posed(time))

    def _shown(self, faps: npt.NDArray[np.float32], joints: Float64 | None) -> View:
        if self._view == "points":
            return self._points(faps, joints)
        if joints is None:
            world = np.eye(4)
            return View(eyes=self.figure.eyes(faps, world), faces=self.figure.meshes(faps, world))
        turned = self.person.joints(faps, joints)
        return View(
            eyes=self.person.eyes(faps, turned),
            faces=self.person.meshes(faps, turned),
            blobs=_shadows(joints, self._skeleton.names),
            ground=True,
        )

    def _points(self, faps: npt.NDArray[np.float32], joints: Float64 | None) -> View:
        """The view as feature points and bones."""
        if self._point_view is None:
            from player.point_view import PointView

            self._point_view = PointView(self.figure)
        shown, matrix = self._point_view, self._face_matrix(joints)
        capsules = shown.eyeballs(faps, matrix)
        if joints is not None:
            capsules = np.concatenate([capsules, self._bones.capsules(joints)])
        return View(
            meshes=shown.meshes(faps, matrix),
            capsules=capsules,
            marks=shown.marks(faps, matrix),
            faces=shown.ghost(faps, matrix, on_body=joints is not None),
            blobs=np.zeros((0, 4), np.float32) if joints is None else _shadows(joints, self._skeleton.names),
            ground=joints is not None,
        )

    def travel(self, time: float) -> tuple[float, float, float]:
        """How far a following camera has gone at a time: (x, y, z), metres; zeros where it stands still."""
        self.subject  # noqa: B018 - decides whether the camera follows
        if not self._follow:
            return (0.0, 0.0, 0.0)
        joints = self._posed(time)[1]
        assert joints is not None
        centre = self.subject.centre
        return (float(joints[0, 0, 3]) - centre[0], 0.0, float(joints[0, 2, 3]) - centre[2])

    def _posed(self, time: float) -> tuple[npt.NDArray[np.float32], Float64 | None]:
        faps = self.timeline.faps(time)
        if not self.has_body:
            return faps, None
        return faps, self._solver.pose(self.timeline.baps(time))

    def _face_matrix(self, joints: Float64 | None) -> Float64:
        """Frame of the face model, without the head's own turn, into the world."""
        return np.eye(4) if joints is None else self.person.frame(joints)

    def _extent(self) -> Subject:
        frames = self.timeline.frames
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        legs = [self._skeleton.names.index(name) for name in ("l_knee", "r_knee", "l_ankle", "r_ankle")]
        for frame in np.unique(np.linspace(0, frames - 1, min(frames, SAMPLES)).astype(int)):
            joints = self._posed(float(self.timeline.time_of(int(frame))))[1]
            assert joints is not None
            low, high = np.minimum(low, joints[:, :3, 3].min(0)), np.maximum(high, joints[:, :3, 3].max(0))
            if frame == 0:
                first, stand = joints[0, :3, 3], joints[legs, :3, 3]
            self._legs_move |= bool(np.abs(joints[legs, :3, 3] - stand).max() > STANDING)
        if not np.isfinite(high - low).all() or (high - low).max() > MOST_TRAVEL:
            self._follow = True
            x, y, z = (float(v) for v in first)
            return Subject((x, y - 0.09, z), BODY_SUBJECT.half_height, BODY_SUBJECT.half_width)
        low, high = low - np.array([0.10, 0.06, 0.10]), high + np.array([0.10, 0.14, 0.10])
        low = np.minimum(low, np.array(BODY_SUBJECT.centre) - (0.35, 0.95, 0.3) + _aside(low, high))
        x, y, z = (float(v) for v in (low + high) / 2)
        wide = float(np.hypot(high[0] - low[0], high[2] - low[2])) / 2
        return Subject(
            (x, y, z), max(float(high[1] - low[1]) / 2 * 1.06, 0.9), max(wide, BODY_SUBJECT.half_width)
        )


def _default_model() -> FaceModel:
    from fba.face.model import FaceModel

    return FaceModel.default()


def _aside(low: Float64, high: Float64) -> Float64:
    """Shift that keeps the floor below a body that stands elsewhere than at the origin."""
    middle = (low + high) / 2
    return np.array([middle[0], 0.0, middle[2]])


def default_camera(scene: Scene, aspect: float = 16 / 9) -> Camera:
    """The view that suits the content.

    A body whole; from the hips up where it has a face that moves and its legs stand still; a face alone
    from slightly aside.
    """
    if scene.has_body:
        return Camera.preset("body", scene.gesture_subject or scene.subject, aspect)
    return Camera(yaw=14.0, pitch=2.0).fit(scene.subject, aspect)


def _shadows(joints: Float64, names: tuple[str, ...]) -> npt.NDArray[np.float32]:
    """Soft blobs under the hips and both feet, fainter the higher these are."""
    found = []
    for name, radius, darkness, rest in (
        ("HumanoidRoot", 0.55, 0.42, 0.97),
        ("l_midtarsal", 0.20, 0.55, 0.03),
        ("r_midtarsal", 0.20, 0.55, 0.03),
        ("l_subtalar", 0.16, 0.40, 0.04),
        ("r_subtalar", 0.16, 0.40, 0.04),
    ):
        x, y, z = joints[list(names).index(name), :3, 3]
        height = max(float(y) - rest, 0.0)
        found.append((x, z, radius * (1 + height), darkness / (1 + 4 * height)))
    return np.array(found, dtype=np.float32)
