"""The picture of docs/simplify.md: levels of the built-in head at rest and in motion, beside the full one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from fba import Animation, FaceTrack, player
from fba.face import FaceModel
from fba.face.simplification import simplify_face

SIZE = (250, 300)
FACES = (11651, 3728, 1193)
POSES: tuple[dict[int, float], ...] = (
    {},
    {3: 900},
    {19: 1024, 20: 1024},
    {1: 4},
)
"""FAPs of each column; 1 stands for a viseme."""


def levels() -> npt.NDArray[np.uint8]:
    """The full head and three levels in four poses: at rest, jaw open, lids closed, a viseme."""
    head = FaceModel.default()
    made = simplify_face(head, FACES)
    models = [head, *(made.build(made.mesh.level(faces)).model for faces in FACES)]
    return np.concatenate([np.concatenate(list(_row(model)), axis=1) for model in models])


def _row(model: FaceModel) -> Iterator[npt.NDArray[np.uint8]]:
    scene = player.Scene(Animation(25, np.arange(1), FaceTrack.empty(1)), model)
    with player.Offscreen(scene, SIZE, samples=4) as view:
        view.camera = player.Camera(yaw=18, pitch=3).fit(scene.face_subject, SIZE[0] / SIZE[1]).zoom(0.8)
        for pose in POSES:
            faps = np.zeros(68, dtype=np.float32)
            for number, value in pose.items():
                if number == 1:
                    faps += model.definitions.visemes[int(value)]
                else:
                    faps[number - 1] = value
            yield view.still(faps)[..., :3]
