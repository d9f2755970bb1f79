"""The camera: an orbit about a target, with the standard views of a face and a body."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fba.arrays import Float64

PRESETS = {"front": (0.0, 0.0), "three-quarter": (35.0, 5.0), "profile": (90.0, 0.0), "body": (25.0, 8.0)}
"""Yaw (to the subject's left) and pitch (from above) of the named views, degrees."""
PITCH_LIMIT = 89.0
DISTANCES = (0.05, 100.0)


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

    @classmethod
    def preset(cls, name: str, subject: Subject, aspect: float = 16 / 9) -> Camera:
        """Return a named view ("front", "three-quarter", "profile", "body") that fits the subject.

        aspect: width / height of the picture. Raises ValueError on another name.
        """
        if name not in PRESETS:
            raise ValueError(f"no camera preset {name!r}; there are {', '.join(PRESETS)}")
        yaw, pitch = PRESETS[name]
        return cls(yaw=yaw, pitch=pitch).fit(subject, aspect)

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

    def _axes(self) -> Float64:
        """Rows: right, up and backward of the camera, in the world."""
        yaw, pitch = math.radians(self.yaw), math.radians(self.pitch)
        right_x, right_z = math.cos(yaw), -math.sin(yaw)
        x, y, z = math.sin(yaw) * math.cos(pitch), math.sin(pitch), math.cos(yaw) * math.cos(pitch)
        up = (y * right_z, z * right_x - x * right_z, -y * right_x)
        return np.array([(right_x, 0.0, right_z), up, (x, y, z)])


def _clamped(value: float, limits: tuple[float, float]) -> float:
    return min(max(value, limits[0]), limits[1])
