"""Small bodies with known answers, for the tests of models and skinning."""

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from fba.body import BodyModel, BodyPart, Skeleton
from fba.mesh._meshes import Material

Float64 = npt.NDArray[np.float64]


def tube(
    rings: int = 9, around: int = 8, length: float = 1.0, radius: float = 0.1
) -> tuple[Float64, npt.NDArray[np.int64]]:
    """Places and triangles of an open tube along +y from the origin."""
    turn = np.arange(around) * 2 * np.pi / around
    height = np.linspace(0, length, rings)
    circle = np.stack([radius * np.sin(turn), np.zeros(around), radius * np.cos(turn)], axis=1)
    places = (circle[None] + height[:, None, None] * np.array([0.0, 1.0, 0.0])).reshape(-1, 3)
    k, after = np.arange(around), np.roll(np.arange(around), -1)
    rows = [
        corners
        for a in range(0, (rings - 1) * around, around)
        for corners in (
            np.stack([a + k, a + after, a + around + after], axis=1),
            np.stack([a + k, a + around + after, a + around + k], axis=1),
        )
    ]
    return places, np.concatenate(rows)


def rod() -> BodyModel:
    """A tube of 1 m on three joints at 0, 0.4 and 0.8 m, modelled bent: its weights go over evenly."""
    places, triangles = tube()
    skeleton = Skeleton(
        ("root", "middle", "tip"), np.array([-1, 0, 1]), np.array([[0, 0, 0], [0, 0.4, 0], [0, 0.8, 0.0]])
    )
    bind = np.tile(np.eye(4), (3, 1, 1))
    bind[1, :3, :3] = Rotation.from_euler("z", 20, degrees=True).as_matrix()
    bind[2, :3, :3] = Rotation.from_euler("zy", [20, 30], degrees=True).as_matrix()
    bind[1, :3, 3] = (0, 0.4, 0)
    bind[2, :3, 3] = bind[1, :3, 3] + bind[1, :3, :3] @ (0, 0.4, 0)
    share = np.clip((places[:, 1] - 0.2) / 0.5, 0, 1)
    tip = np.clip((places[:, 1] - 0.6) / 0.4, 0, 1) * share
    weights = np.stack([1 - share, share - tip, tip, np.zeros(len(places))], axis=1)
    joints = np.tile([0, 1, 2, 0], (len(places), 1))
    colours = np.round(np.random.default_rng(3).random((len(places), 4)) * 255) / 255
    half = len(triangles) // 2
    used = np.unique(triangles[half:])
    return BodyModel(
        parts=(
            BodyPart("rod", "skin", places, triangles, joints, weights, colours=colours),
            BodyPart(
                "sleeve", "cloth", places[used] * (1.2, 1, 1.2), triangles[half:] - used[0], joints[used],
                weights[used], material=Material("wool", (0.1, 0.2, 0.3), 0.9),
            ),
        ),
        skeleton=skeleton,
        bind=bind,
        eyes=np.array([[0.03, 0.9, 0.1], [-0.03, 0.9, 0.1]]),
        name="rod",
        notes={"licence": "none"},
    )  # fmt: skip


def random_pose(body: BodyModel, seed: int = 0, most: float = 1.0) -> Float64:
    """Joint matrices (J, 4, 4) of a pose with turns of up to `most` radians about each axis, and a shift."""
    random = np.random.default_rng(seed)
    skeleton = body.skeleton
    matrices = np.tile(np.eye(4), (len(skeleton), 1, 1))
    turns = Rotation.from_rotvec(random.uniform(-most, most, (len(skeleton), 3))).as_matrix()
    for number, parent in enumerate(skeleton.parents):
        local = np.eye(4)
        local[:3, :3] = turns[number]
        local[:3, 3] = skeleton.offsets[number] + (random.normal(size=3) if parent < 0 else 0)
        matrices[number] = local if parent < 0 else matrices[parent] @ local
    return matrices
