"""Heads of actors: not the one whose tables tell FAPs apart."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64
from fba.face import FaceModel
from fba.face.authoring import author
from fba.face.importers import import_model
from fba.parameters import point_rows

SIZE = (1.05, 1.0, 0.95)
"""The other head is wider and flatter than the built-in one."""
CHIN = (0.14, 0.06)
"""Share by which it is longer below the mouth, and how far below that holds, metres."""
LIP = (0.08, 0.03)
"""Share by which its upper lip is shorter, up to this height above the mouth."""
EYES = (0.16, 0.015)
"""Share by which its eyes are less open, and the radius around them within which skin follows."""


@cache
def other_head() -> FaceModel:
    """Return a head with other proportions than the built-in one's, moved by its own geometry.

    It is 5 % wider and less deep, with a longer chin, a shorter upper lip and narrower eyes (IRISD0 9.3 mm
    for 10.8). It takes some seconds.
    """
    model = FaceModel.default()
    rows, points = point_rows(), model.points
    eyes = [
        points[[rows[upper], rows[lower]]].mean(axis=0) for upper, lower in (("3.1", "3.3"), ("3.2", "3.4"))
    ]
    mouth = float(points[rows["2.2"], 1])

    def reshape(place: npt.ArrayLike, skin: bool) -> Float64:
        place = np.asarray(place, dtype=np.float64)
        result = place.copy()
        for eye in eyes if skin else ():
            near = np.exp(-((place - eye) ** 2).sum(axis=-1) / EYES[1] ** 2)
            result[..., 1] -= EYES[0] * near * (place[..., 1] - eye[1])
        result[..., 1] -= CHIN[0] * np.clip(mouth - place[..., 1], 0, CHIN[1])
        result[..., 1] -= LIP[0] * np.clip(place[..., 1] - mouth, 0, LIP[1])
        return np.asarray(result * SIZE)

    parts = [
        replace(part, vertices=reshape(part.vertices, part.kind != "eye").astype(np.float32))
        for part in model.parts
    ]
    return author(parts, reshape(points, True), bound=model.bound)


def load_head(path: Path) -> FaceModel:
    """Return a face model of this project, or MakeHuman's head from its folder. Raises FbaError."""
    return import_model(path) if path.is_dir() else FaceModel.load(path)
