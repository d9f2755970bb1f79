"""The camera: an orbit about a target, with the standard views of a face and a body."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from fba.arrays import Float64
from fba_player.view._view import Seen

PITCH_LIMIT = 89.0
DISTANCES = (0.05, 100.0)
PRESETS = {
    "front": (0.0, 0.0), "three-quarter": (35.0, 5.0), "profile": (90.0, 0.0), "face": (0.0, 0.0),
    "body": (25.0, 8.0), "side": (90.0, 0.0), "back": (180.0, 0.0), "top": (0.0, PITCH_LIMIT),
}  # fmt: skip
"""Yaw (to the subject's left) and pitch (from above) of the named views, degrees."""
FACE_PRESETS = ("front", "three-quarter", "profile", "face")
"""Views of the face, also where there is a body; the others show the whole figure."""
CLOSE = (0.74, 0.1)
"""Of the view "face": its height, and how far its middle lies higher, in those of the other views."""
FOLLOWS = ("hips", "head", "none")
"""What a camera may be told to follow."""


@dataclass(frozen=True, slots=True)
class Subject:
    """The box that a camera is fitted to: centre (x, y, z), half its height and width, metres.

    half_depth: how far from the centre this may come towards the camera.
    """

    centre: tuple[float, float, float]
    half_height: float
    half_width: float
    half_depth: float = 0.0


@dataclass(frozen=True, slots=True)
class Camera:
    """An orbiting camera.

    target: the point looked at. yaw, pitch: degrees; 0, 0 looks at the subject's face from the front, a
    positive yaw goes to the subject's left, a positive pitch above. distance: metres from the target.
    field_of_view: vertical, degrees. Immutable; `orbit`, `zoom`, `pan` give the moved one.
    """

    target: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw: float = 0.0
    pitch: float = 0.0
    distance: float = 1.0
    field_of_view: float = 24.0
    presets: ClassVar[tuple[str, ...]] = tuple(PRESETS)
    """Names of the views."""

    @classmethod
    def preset(cls, name: str, subject: Subject, aspect: float = 16 / 9) -> Camera:
        """Return a view that fits the subject, by a name of `PRESETS`, or directions as `parse` reads them.

        aspect: width / height of the picture. Raises ValueError on another name, and where a text gives a
        place of its own, which would be lost.
        """
        if "=" in name:
            if cls.has_place(name):
                raise ValueError(f"{name!r} gives a place: Camera.parse returns its camera")
            return cls.parse(name).fit(subject, aspect)
        if name not in PRESETS:
            raise ValueError(f"no camera preset {name!r}; there are {', '.join(PRESETS)}")
        yaw, pitch = PRESETS[name]
        if name == "face":
            x, y, z = subject.centre
            centre = (x, y + CLOSE[1] * subject.half_height, z)
            subject = Subject(centre, CLOSE[0] * subject.half_height, CLOSE[0] * subject.half_width)
        elif name == "top":
            wide, high = subject.half_width, subject.half_height
            subject = replace(subject, half_height=wide, half_depth=high)
        return cls(yaw=yaw, pitch=pitch).fit(subject, aspect)

    @classmethod
    def parse(cls, text: str) -> Camera:
        """Return the camera of a text as `text` gives it; ValueError for another."""
        fields = {"turn": "yaw", "tilt": "pitch", "distance": "distance", "angle": "field_of_view"}
        values: dict[str, Any] = {}
        for part in text.split(","):
            name, _, value = part.partition("=")
            try:
                numbers = tuple(float(number) for number in value.split(":"))
                if name == "at" and len(numbers) == 3:
                    values["target"] = numbers
                elif len(numbers) == 1:
                    values[fields[name]] = numbers[0]
                else:
                    raise KeyError
                if not all(map(math.isfinite, numbers)):
                    raise ValueError
            except (KeyError, ValueError):
                what = f"{part!r} of {text!r} has no meaning" if "=" in text else f"no view {text!r}"
                raise ValueError(
                    f"{what}: there are {', '.join(PRESETS)}; or give any of turn=DEGREES, tilt=DEGREES, "
                    "distance=METRES, at=X:Y:Z and angle=DEGREES, with commas between them"
                ) from None
        camera = cls(**values)
        for name, number, (low, high) in (
            ("tilt", camera.pitch, (-PITCH_LIMIT, PITCH_LIMIT)),
            ("distance", camera.distance, DISTANCES),
            ("angle", camera.field_of_view, (1.0, 120.0)),
        ):
            if not low <= number <= high:
                raise ValueError(f"{name}={number:g} of the camera lies outside of {low:g} to {high:g}")
        return camera

    @staticmethod
    def has_place(text: str) -> bool:
        """Return whether a text of `parse` says where the camera is, and not only how it looks."""
        return "distance=" in text or "at=" in text

    @property
    def text(self) -> str:
        """The camera as text: "turn=35,tilt=5,distance=1.2,at=0:1.6:0,angle=24"."""
        x, y, z = (f"{value:.4g}" for value in self.target)
        return (
            f"turn={self.yaw:.4g},tilt={self.pitch:.4g},distance={self.distance:.4g},at={x}:{y}:{z},"
            f"angle={self.field_of_view:.4g}"
        )

    def move(self, offset: tuple[float, float, float], sign: float = 1.0) -> Camera:
        """Return the camera with its target moved by an offset (x, y, z), metres, times `sign`."""
        if not any(offset):
            return self
        x, y, z = (a + sign * b for a, b in zip(self.target, offset, strict=True))
        return replace(self, target=(x, y, z))

    def fit(self, subject: Subject, aspect: float) -> Camera:
        """Return the camera, moved along its direction so that the subject fills the picture."""
        half = max(subject.half_height, subject.half_width / max(aspect, 1e-3))
        distance = half / math.tan(math.radians(self.field_of_view) / 2) + subject.half_depth
        return replace(self, target=subject.centre, distance=_clamped(distance, DISTANCES))

    def orbit(self, yaw: float, pitch: float) -> Camera:
        """Return the camera, turned about its target by degrees."""
        turned = (self.yaw + yaw + 180.0) % 360.0 - 180.0
        return replace(self, yaw=turned, pitch=_clamped(self.pitch + pitch, (-PITCH_LIMIT, PITCH_LIMIT)))

    def zoom(self, factor: float) -> Camera:
        """Return the camera, its distance multiplied by `factor`: below 1 comes nearer."""
        return replace(self, distance=_clamped(self.distance * factor, DISTANCES))

    def pan(self, right: float, up: float) -> Camera:
        """Return the camera with its target, moved across the view by fractions of the picture's height."""
        size = 2 * self.distance * math.tan(math.radians(self.field_of_view) / 2)
        axes = self._axes()
        moved = np.array(self.target) + (axes[0] * right + axes[1] * up) * size
        return replace(self, target=(float(moved[0]), float(moved[1]), float(moved[2])))

    def between(self, other: Camera, share: float) -> Camera:
        """Return a camera between this one (share 0) and another (share 1), the shorter way round."""
        turn = (other.yaw - self.yaw + 180.0) % 360.0 - 180.0
        x, y, z = (a + (b - a) * share for a, b in zip(self.target, other.target, strict=True))
        return Camera(
            target=(x, y, z),
            yaw=(self.yaw + turn * share + 180.0) % 360.0 - 180.0,
            pitch=self.pitch + (other.pitch - self.pitch) * share,
            distance=self.distance * (other.distance / self.distance) ** share,
            field_of_view=self.field_of_view + (other.field_of_view - self.field_of_view) * share,
        )

    @property
    def eye(self) -> Float64:
        """(3,) position of the camera."""
        return np.asarray(self.target + self._axes()[2] * self.distance)

    def view_matrix(self) -> Float64:
        """Return (4, 4) matrix from world to camera space."""
        axes = self._axes()
        matrix = np.eye(4)
        matrix[:3, :3] = axes
        matrix[:3, 3] = -axes @ self.eye
        return matrix

    def projection_matrix(self, aspect: float) -> Float64:
        """Return (4, 4) matrix from camera to clip space, in OpenGL's convention."""
        near, far = self.distance * 0.05, self.distance * 4 + 60.0
        scale = 1 / math.tan(math.radians(self.field_of_view) / 2)
        matrix = np.zeros((4, 4))
        matrix[0, 0], matrix[1, 1] = scale / max(aspect, 1e-3), scale
        matrix[2, 2], matrix[2, 3] = (far + near) / (near - far), 2 * far * near / (near - far)
        matrix[3, 2] = -1.0
        return matrix

    def clip_matrix(self, size: tuple[int, int]) -> Float64:
        """Return (4, 4) matrix from world to clip space, for a picture of this size in pixels."""
        return np.asarray(self.projection_matrix(size[0] / max(size[1], 1)) @ self.view_matrix())

    def seen(self, height: int) -> Seen:
        """Return where a picture of this height in pixels is seen from."""
        return Seen(self.eye, 2 * math.tan(math.radians(self.field_of_view) / 2) / max(height, 1))

    def _axes(self) -> Float64:
        """Rows: right, up and backward of the camera, in the world."""
        yaw, pitch = math.radians(self.yaw), math.radians(self.pitch)
        right_x, right_z = math.cos(yaw), -math.sin(yaw)
        x, y, z = math.sin(yaw) * math.cos(pitch), math.sin(pitch), math.cos(yaw) * math.cos(pitch)
        up = (y * right_z, z * right_x - x * right_z, -y * right_x)
        return np.array([(right_x, 0.0, right_z), up, (x, y, z)])


def _clamped(value: float, limits: tuple[float, float]) -> float:
    return min(max(value, limits[0]), limits[1])
