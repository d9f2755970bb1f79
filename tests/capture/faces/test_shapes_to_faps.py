"""Blendshapes to FAPs: sums of shapes, lips brought together, lids that meet, times and errors.

Eyes that turn further than eyes do, from every kind of source.
"""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import fba
from fba.animation import Animation
from fba.arrays import Float64
from fba.capture import (
    ActionUnitMotion,
    ShapeMotion,
    from_action_units,
    from_blendshapes,
    from_points,
    shape_faps,
)
from fba.errors import FbaWarning, ModelError
from fba.face import FaceModel
from fba.parameters import fap_numbers
from live_senders import captured, vmc_frames
from tools.captures.tracked_actor import film

COUNT = 40
RAMP = np.linspace(0, 1, COUNT)
LIMIT = 60_000
"""34 degrees, hundred thousandths of a radian."""
EYES = [[fap_numbers()[f"{angle}_{side}_eyeball"] - 1 for angle in ("yaw", "pitch")] for side in ("l", "r")]


def motion(times: Float64 | None = None, rate: int = 10, **weights: float | list[float]) -> ShapeMotion:
    count = max(np.size(one) for one in weights.values())
    columns = [np.broadcast_to(np.asarray(one, dtype=float), count) for one in weights.values()]
    rows = np.arange(count) / rate if times is None else times
    return ShapeMotion(tuple(weights), np.stack(columns, axis=1), rows, Fraction(rate))


def shown(animation: Animation, name: str) -> list[int]:
    found: list[int] = animation.face.values[:, fap_numbers()[name] - 1].tolist()
    return found


def test_shapes_add_up_and_only_their_faps_are_sent() -> None:
    animation = from_blendshapes(motion(jawForward=[0.0, 0.5, 1.0], noseSneerLeft=0.5))
    assert shown(animation, "thrust_jaw") == [0, 200, 400]
    sneer = shape_faps("noseSneerLeft")
    column = fap_numbers()["stretch_l_nose"] - 1
    assert shown(animation, "stretch_l_nose") == [round(sneer[column] / 2)] * 3
    sent = {number for name, number in fap_numbers().items() if animation.face.mask[0, number - 1]}
    assert fap_numbers()["stretch_r_nose"] in sent  # or a decoder would copy the left side
    assert shown(animation, "stretch_r_nose") == [0, 0, 0]
    assert fap_numbers()["raise_l_ear"] not in sent


def test_mouth_close_is_a_correction_of_jaw_open() -> None:
    both = from_blendshapes(motion(jawOpen=0.5, mouthClose=[0.0, 0.25, 0.5, 0.9]))
    lip = shown(both, "raise_b_midlip")
    jaw, close = shape_faps("jawOpen"), shape_faps("mouthClose")
    column = fap_numbers()["raise_b_midlip"] - 1
    assert lip == [round(0.5 * jaw[column] + share * close[column]) for share in (0, 0.25, 0.5, 0.5)]
    assert shown(both, "open_jaw") == [round(0.5 * jaw[2])] * 4
    assert shown(from_blendshapes(motion(jawOpen=0.0, mouthClose=0.6)), "raise_b_midlip") == [0]


def test_lids_meet_and_do_not_pass_each_other() -> None:
    for blink, squint in ((1.0, 0.0), (1.0, 1.0), (0.9, 0.6)):
        animation = from_blendshapes(motion(eyeBlinkLeft=blink, eyeSquintLeft=squint))
        upper, lower = shown(animation, "close_t_l_eyelid")[0], shown(animation, "close_b_l_eyelid")[0]
        assert 1015 <= upper + lower <= 1024


def test_values_between_rows_and_rates() -> None:
    uneven = motion(np.array([0.0, 0.1, 0.4, 0.5]), jawForward=[0.0, 0.1, 0.4, 0.5])
    assert shown(from_blendshapes(uneven), "thrust_jaw") == [0, 40, 80, 120, 160, 200]
    fast = from_blendshapes(uneven, 20)
    assert shown(fast, "thrust_jaw") == list(range(0, 201, 20))
    late = motion(np.array([0.0, 0.1, 0.2, 0.3]), jawForward=[np.nan, np.nan, 0.2, 0.3])
    animation = from_blendshapes(late)
    assert animation.index.tolist() == [2, 3]
    assert shown(animation, "thrust_jaw") == [80, 120]


def test_captures_without_faces_or_shapes_are_refused() -> None:
    with pytest.raises(ModelError, match="no face is seen in any of the 2 rows"):
        from_blendshapes(motion(jawOpen=[np.nan, np.nan]))
    with pytest.raises(ModelError, match=r"no name of a shape is known here: 'Wobble', 'Wiggle'; expected"):
        from_blendshapes(motion(Wobble=0.5, Wiggle=0.5))
    with pytest.raises(ModelError, match="times must be finite, and each later than the one before"):
        motion(np.array([0.0, 0.2, 0.1]), jawOpen=[0.0, 0.0, 0.0])
    with pytest.raises(ModelError, match="weights must be finite, or NaN"):
        motion(jawOpen=[np.inf])
    with pytest.raises(ModelError, match="the frame rate must be positive, not -5"):
        from_blendshapes(motion(jawOpen=0.5), -5)


def test_wrong_motions_are_refused() -> None:
    times = np.arange(2.0)
    with pytest.raises(ModelError, match=r"weights has shape \(2, 3\), not \(2, 1\)"):
        ShapeMotion(("jawOpen",), np.zeros((2, 3)), times, Fraction(1))
    with pytest.raises(ModelError, match="the rate must be positive, not 0"):
        ShapeMotion(("jawOpen",), np.zeros((2, 1)), times, Fraction(0))
    with pytest.raises(ModelError, match="a name occurs twice"):
        ShapeMotion(("jawOpen", "jawOpen"), np.zeros((2, 2)), times, Fraction(1))
    with pytest.raises(ModelError, match=r"^ActionUnitMotion: .*\(2, 3\), not \(2, 1\)"):
        ActionUnitMotion((12,), np.zeros((2, 3)), times, Fraction(1))


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
