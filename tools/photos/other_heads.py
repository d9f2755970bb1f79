"""Pictures of heads that are no variation of the built-in one, with known feature points."""

from __future__ import annotations

import csv
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np

from fba import Animation, FaceTrack, player
from fba.arrays import Float64
from fba.errors import FbaWarning
from fba.face import Deformer, FaceModel
from fba.face.fitting import FRONT_POINTS, Photograph
from fba.face.importers import import_model
from fba.parameters import fap_numbers, point_rows

SHARED = {
    "facecap": "data/foreign/heads/facecap_plain.glb",
    "rpm64f1": "data/foreign/heads/rpm64f1.glb",
    "rpm646d": "data/foreign/heads/rpm646d.glb",
    "MakeHuman": "models/makehuman",
}
"""Heads of the shared folder, by name."""
BROWS = ("4.1", "4.2", "4.3", "4.4", "4.5", "4.6")
DISTANCE = 1.5
TABLE = Path(__file__).with_name("placed.csv")
"""Points placed by hand on large rendered pictures of imported heads: metres in the axes of these."""
LIGHTS = (0.0, -60.0, 60.0, 25.0, -25.0)
"""Degrees beside the camera from which the light comes, by picture."""


@dataclass(frozen=True, eq=False)
class Picture:
    """A rendered photograph, and where (P, 2) the `FRONT_POINTS` are on it; NaN where nobody could tell."""

    head: str
    photograph: Photograph
    places: Float64

    @property
    def eyes(self) -> float:
        """Pixels between the pupils."""
        return float(np.linalg.norm(self.places[0] - self.places[1]))


def other_heads(shared: Path, names: Iterable[str] = tuple(SHARED)) -> dict[str, FaceModel]:
    """Return heads of the shared folder by name, those that are there."""
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        heads = {n: import_model(shared / SHARED[n]) for n in names if (shared / SHARED[n]).exists()}
    return {name: with_placed(head, name) for name, head in heads.items()}


def with_placed(head: FaceModel, name: str, table: Path = TABLE) -> FaceModel:
    """Return a head whose points are where they were placed by hand; those of the brows NaN if nowhere.

    Importers guess these from the bones, not from what the picture shows: brows, the outline of the lips.
    """
    points, bound, row = head.points.copy(), head.bound.copy(), point_rows()
    rows = [row[one] for one in BROWS]
    points[rows], bound[rows] = np.nan, -1
    with table.open(encoding="utf-8", newline="") as file:
        for line in csv.DictReader(file):
            if line["head"] == name:
                points[row[line["point"]]] = [float(line[axis]) for axis in "xyz"]
                bound[row[line["point"]]] = -1
    return replace(head, points=points, bound=bound)


def pictures(
    name: str, head: FaceModel, seed: int = 1, size: tuple[int, int] = (420, 500), count: int = 5
) -> Iterator[Picture]:
    """Yield pictures of a head from up to 10 degrees beside and above the front, in varied light."""
    random = np.random.default_rng(seed)
    row, numbers = point_rows(), fap_numbers()
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        scene = player.Scene(Animation(Fraction(25), np.arange(1), FaceTrack.empty(1)), model=head)
    deform = Deformer(head)
    with player.Offscreen(scene, size, samples=2) as view:
        for k in range(count):
            faps = np.zeros(68)
            faps[numbers["head_yaw"] - 1] = np.radians(LIGHTS[k]) * 1e5
            yaw, pitch = random.uniform(-10, 10, 2)
            points = deform.feature_points(faps)
            x, y, z = points[[row[one] for one in ("3.5", "3.6", "9.3")]].mean(axis=0)
            shift = random.uniform(-0.02, 0.02, 2)
            view.camera = player.Camera(
                target=(float(x), float(y + shift[1]), float(z)), yaw=LIGHTS[k] + yaw, pitch=float(pitch),
                distance=DISTANCE, field_of_view=2 * float(np.degrees(np.arctan(0.17 / DISTANCE))),
            )  # fmt: skip
            pixels = np.ascontiguousarray(view.still(faps)[..., :3])
            clip = np.column_stack([points, np.ones(len(points))]) @ view.camera.clip_matrix(size).T
            places = (clip[:, :2] / clip[:, 3:] * (0.5, -0.5) + 0.5) * size
            yield Picture(
                name,
                Photograph(pixels, size, f"{name} {k + 1}"),
                np.array([places[row[one]] for one in FRONT_POINTS]),
            )
