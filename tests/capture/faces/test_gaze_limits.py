"""Eyes that turn further than eyes do, from every kind of source."""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import fba
from fba.capture import ActionUnitMotion, ShapeMotion, from_action_units, from_blendshapes, from_points
from fba.errors import FbaWarning
from fba.face import FaceModel
from fba.parameters import fap_numbers
from live_senders import captured, vmc_frames
from tools.captures.tracked_actor import film

COUNT = 40
RAMP = np.linspace(0, 1, COUNT)
LIMIT = 60_000
"""34 degrees, hundred thousandths of a radian."""
EYES = [[fap_numbers()[f"{angle}_{side}_eyeball"] - 1 for angle in ("yaw", "pitch")] for side in ("l", "r")]


def looking(yaw: float, pitch: float) -> np.ndarray:
    """Angles (T, 4) of both eyes, radians, as captures of faces have them."""
    return RAMP[:, None] * [yaw, yaw, pitch, pitch]


def shapes(_: Path) -> fba.Animation:
    weights = np.zeros((COUNT, 1))
    return from_blendshapes(
        ShapeMotion(("jawOpen",), weights, np.arange(COUNT) / 30, Fraction(30), eyes=looking(2.9, -1.0))
    )


def units(_: Path) -> fba.Animation:
    return from_action_units(
        ActionUnitMotion((26,), np.zeros((COUNT, 1)), np.arange(COUNT) / 30, Fraction(30),
                         eyes=looking(-1.2, 1.2))
    )  # fmt: skip


def points(_: Path) -> fba.Animation:
    take = film(FaceModel.default(), 478, share=True, performed=np.zeros((COUNT, 68)), turn=0.0)
    positions = take.motion.positions.copy()
    for axis in (0, 1):  # pupils wander to a corner, further than eyeballs go
        positions[:, [468, 473], axis] += 0.02 * RAMP[:, None]
    return from_points(replace(take.motion, positions=positions, aspect=16 / 9), neutral="first")


def smpl(folder: Path) -> fba.Animation:
    turns = np.zeros((COUNT, 22, 3))
    turns[:, 0, 0] = np.pi / 2  # stands, z up
    poses = turns.reshape(COUNT, -1)
    eyes = np.tile(np.outer(RAMP, [0.0, 2.6, 0.0]), 2)
    path = folder / "a.npz"
    np.savez(path, mocap_framerate=30.0, trans=np.zeros((COUNT, 3)), root_orient=poses[:, :3],
             pose_body=poses[:, 3:], pose_eye=eyes)  # fmt: skip
    return fba.read(path)


def vmc(_: Path) -> fba.Animation:
    turn = np.zeros((COUNT, 4))
    turn[:, 1], turn[:, 3] = np.sin(1.3 * RAMP), np.cos(1.3 * RAMP)  # 149 degrees about y
    sent = vmc_frames({"LeftEye": turn, "RightEye": turn}, {"A": RAMP}, COUNT)
    animation, _summary = captured("vmc", sent)
    assert animation is not None
    return animation


@pytest.mark.parametrize("make", [shapes, units, points, smpl, vmc])
def test_eyes_stop_where_eyes_do(make: Callable[[Path], fba.Animation], tmp_path: Path) -> None:
    with pytest.warns(FbaWarning, match="eyes that turn further than 34 degrees"):
        face = make(tmp_path).face
    turns = np.stack([np.hypot(*face.values[:, eye].T) for eye in EYES])
    assert turns.max() == pytest.approx(LIMIT, abs=2)
    assert (np.diff(turns[:, 3:], axis=1) > -600).all()  # they go there, and stay
