"""Blendshapes to FAPs, FAPs to blendshapes and back: sums, lips, lids, visemes, times, tables, errors."""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import lsq_linear

import fba
from fba.animation import Animation, FaceTrack
from fba.arrays import Float64
from fba.capture import (
    ActionUnitMotion,
    ShapeMotion,
    from_action_units,
    from_blendshapes,
    from_points,
    shape_faps,
    shown_weights,
    to_blendshapes,
)
from fba.capture.blendshapes._inversion import SHARED_WEIGHT, _metres, _shapes, find_weights
from fba.errors import FbaWarning, FormatError, ModelError
from fba.face import FaceModel, arkit_names, resolve
from fba.formats.face_tables._livelink_csv import read_face
from fba.parameters import fap_numbers
from live_senders import captured, vmc_frames
from tools.captures.tracked_actor import film

SAMPLES = Path(fba.__file__).parent / "samples"
COUNT = 40
ALIKE = ("mouthDimpleLeft", "mouthDimpleRight", "mouthShrugLower", "mouthPressLeft", "mouthPressRight")
"""Shapes of which others do a part: these come back with them."""
RAMP = 0.5 - 0.5 * np.cos(np.linspace(0, 2 * np.pi, COUNT))


def single(shape: str, size: float = 0.7) -> ShapeMotion:
    weights = np.zeros((COUNT, len(arkit_names())))
    weights[:, arkit_names().index(shape)] = size * RAMP
    if shape == "mouthClose":
        weights[:, arkit_names().index("jawOpen")] = size
    return ShapeMotion(arkit_names(), weights, np.arange(COUNT) / 25, Fraction(25))


def test_the_order_has_all_52() -> None:
    assert (arkit_names()[0], arkit_names()[-1]) == ("eyeBlinkLeft", "tongueOut")


@pytest.mark.parametrize("shape", arkit_names())
def test_each_shape_alone_comes_back(shape: str) -> None:
    motion = single(shape)
    back = to_blendshapes(from_blendshapes(motion))
    column = arkit_names().index(shape)
    off = np.abs(back.weights[:, column] - motion.weights[:, column]).max()
    assert off < (0.4 if shape in ALIKE else 0.15)
    assert np.corrcoef(back.weights[:, column], RAMP)[0, 1] > 0.98
    assert ((back.weights >= 0) & (back.weights <= 1)).all()
    again, first = from_blendshapes(back).face, from_blendshapes(motion).face
    difference = np.abs(again.values - first.values)[:, np.abs(first.values).max(axis=0) < 10_000]
    assert difference.max() <= 130  # 1.5 mm


def test_angles_come_back() -> None:
    motion = single("jawOpen")
    head = np.outer(RAMP, [0.1, -0.2, 0.3])
    eyes = np.outer(RAMP, [0.2, 0.18, -0.1, -0.12])
    turned = ShapeMotion(motion.names, motion.weights, motion.times, motion.rate, head=head, eyes=eyes)
    back = to_blendshapes(from_blendshapes(turned))
    assert back.head is not None
    assert back.eyes is not None
    np.testing.assert_allclose(back.head, head, atol=1e-5)
    np.testing.assert_allclose(back.eyes, eyes, atol=1e-5)
    out, into = (back.weights[:, arkit_names().index(f"eyeLookOut{side}")] for side in ("Left", "Right"))
    assert out.max() > 0.3  # both look to the left
    assert into.max() == 0


def test_lips_of_an_open_jaw_stay_where_they_are() -> None:
    """mouthClose does nothing beyond jawOpen, so weights of it must not count on that."""
    values = np.zeros((3, 68), dtype=np.int32)
    values[:, fap_numbers()["open_jaw"] - 1] = [100, 300, 500]
    back = to_blendshapes(Animation(25, np.arange(3), FaceTrack(values, np.ones(values.shape, bool))))
    opened, closed = (back.weights[:, arkit_names().index(name)] for name in ("jawOpen", "mouthClose"))
    assert (closed <= opened + 1e-9).all()
    assert (opened > [0.05, 0.2, 0.35]).all()
    again = from_blendshapes(back).face
    lips = [fap_numbers()[name] - 1 for name in ("raise_b_midlip", "raise_b_lip_lm", "lower_t_midlip")]
    assert np.abs(again.values[:, lips]).max() < 130


def test_visemes_and_expressions_become_shapes() -> None:
    viseme = np.zeros((2, 4), dtype=np.int16)
    viseme[:, 0], viseme[:, 2] = 10, 63  # A:
    expression = np.zeros((2, 6), dtype=np.int16)
    expression[:, 0], expression[:, 1] = 1, 63  # joy
    mask = np.zeros((2, 68), dtype=bool)
    for column, shapes in ((0, ["jawOpen"]), (1, ["mouthSmileLeft", "mouthSmileRight"])):
        sent = mask.copy()
        sent[:, column] = True
        face = FaceTrack(np.zeros((2, 68), dtype=np.int32), sent, viseme, expression)
        back = to_blendshapes(Animation(25, np.arange(2), face))
        for shape in shapes:
            assert back.weights[:, arkit_names().index(shape)].min() > 0.1


def test_a_table_that_is_written_reads_back(tmp_path: Path) -> None:
    weights = np.zeros((COUNT, len(arkit_names())))
    sizes = {"jawOpen": 0.5, "mouthSmileLeft": 0.6, "mouthLeft": 0.3, "eyeBlinkRight": 1.0}
    for shape, size in sizes.items():
        weights[:, arkit_names().index(shape)] = size * RAMP
    head = np.outer(RAMP, [0.1, -0.2, 0.3])
    for rate in (25, 30, 60, 29.97, 12):
        exact = Fraction(30000, 1001) if rate == 29.97 else Fraction(rate)
        motion = ShapeMotion(arkit_names(), weights, np.arange(COUNT) / float(exact), exact, head=head)
        animation = from_blendshapes(motion)
        fba.write(tmp_path / "a.csv", animation)
        written, read = to_blendshapes(animation), read_face(tmp_path / "a.csv", swap="no")
        assert (len(read), read.rate, read.names) == (COUNT, exact, arkit_names())
        np.testing.assert_allclose(read.weights, written.weights, atol=1e-6)
        np.testing.assert_allclose(read.head, written.head, atol=1e-6)
        np.testing.assert_allclose(read.times, np.arange(COUNT) / float(exact), atol=2e-5)


def test_animations_that_no_table_can_hold_are_refused(tmp_path: Path) -> None:
    body = Animation(25, np.arange(2), None, fba.BodyTrack(np.zeros((2, 296), int), np.ones((2, 296), bool)))
    with pytest.raises(ModelError, match="has no face"):
        to_blendshapes(body)
    with pytest.raises(FormatError, match=r"a\.csv: the animation has no face"):
        fba.write(tmp_path / "a.csv", body)
    both = Animation(25, np.arange(2), FaceTrack.empty(2), body.body)
    with pytest.warns(FbaWarning, match="LIVELINK holds no body"):
        fba.write(tmp_path / "a.csv", both)


@pytest.mark.filterwarnings("ignore:.*all angles of")
def test_slow_animations_are_resampled(tmp_path: Path) -> None:
    values = np.zeros((3, 68), dtype=np.int32)
    values[:, fap_numbers()["thrust_jaw"] - 1] = [0, 200, 400]
    slow = Animation(2, np.arange(3), FaceTrack(values, values != -1))
    fba.write(tmp_path / "a.csv", slow)
    assert (tmp_path / "a.csv").read_text().count("\n") == 32
    assert fba.read(tmp_path / "a.csv").duration == pytest.approx(31 / 30)


def test_weights_are_the_least_squares_between_0_and_1() -> None:
    """In plain Python as in machine code, against another solver."""
    random = np.random.default_rng(3)
    matrix, wanted = random.normal(size=(9, 5)), random.normal(size=(4, 9))
    expected = [lsq_linear(matrix, one, (0, 1), method="bvls", tol=1e-14).x for one in wanted]
    loops = {find_weights, getattr(find_weights, "py_func", find_weights)}
    for loop in loops:
        np.testing.assert_allclose(loop(matrix.T @ matrix, wanted @ matrix), expected, atol=1e-9)
    assert (np.array(expected) < 1e-9).any()
    assert (np.array(expected) > 1 - 1e-9).any()
    with pytest.raises(IndexError):
        find_weights(np.eye(3), np.zeros((2, 4)))


def distance_from_best(weights: Float64, shown: Float64) -> float:
    """Return by how much a weight could be set better, the others as they are; 0 only at the optimum."""
    shapes = _shapes(arkit_names())
    products = shapes @ shapes.T + SHARED_WEIGHT**2 * np.eye(len(shapes))
    rest = (shown * _metres(arkit_names())) @ shapes.T - weights @ products
    better = np.clip(weights + rest / np.diag(products), 0, 1)
    return float(np.abs(better - weights).max())


@pytest.mark.parametrize("source", ["sample", "small", "large", "jumps"])
def test_weights_of_shapes_are_the_optimum(source: str) -> None:
    """The problem is strictly convex: where no single weight can be set better, all are the best."""
    random = np.random.default_rng(5)
    shown = resolve(fba.read(SAMPLES / "hello.fap").face)[:200].astype(np.float64)
    if source != "sample":
        shown = random.normal(0, {"small": 3, "large": 2000, "jumps": 300}[source], (200, 68))
    if source == "jumps":
        shown[::2] = 0
    weights = shown_weights(shown)
    opened, closed = (arkit_names().index(name) for name in ("jawOpen", "mouthClose"))
    full = weights[:, opened] >= 1  # there, what jawOpen has of mouthClose is not to be seen
    weights[:, opened] -= weights[:, closed]
    assert (~full).sum() > 20
    assert distance_from_best(weights[~full], shown[~full]) < 1e-8
    assert distance_from_best(np.clip(weights[~full] + 1e-5, 0, 1), shown[~full]) > 1e-6
    np.testing.assert_allclose(shown_weights(shown[::-1])[::-1], shown_weights(shown), atol=1e-8)


@pytest.mark.parametrize("shape", [(1, 52), (0, 52), (5, 1)])
def test_few_frames_and_shapes(shape: tuple[int, int]) -> None:
    found = find_weights(np.eye(shape[1]), np.full(shape, 0.5))
    np.testing.assert_array_equal(found, np.full(shape, 0.5))


RISE = np.linspace(0, 1, COUNT)
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
    return RISE[:, None] * [yaw, yaw, pitch, pitch]


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
        positions[:, [468, 473], axis] += 0.02 * RISE[:, None]
    return from_points(replace(take.motion, positions=positions, aspect=16 / 9), neutral="first")


def smpl(folder: Path) -> fba.Animation:
    turns = np.zeros((COUNT, 22, 3))
    turns[:, 0, 0] = np.pi / 2  # stands, z up
    poses = turns.reshape(COUNT, -1)
    eyes = np.tile(np.outer(RISE, [0.0, 2.6, 0.0]), 2)
    path = folder / "a.npz"
    np.savez(path, mocap_framerate=30.0, trans=np.zeros((COUNT, 3)), root_orient=poses[:, :3],
             pose_body=poses[:, 3:], pose_eye=eyes)  # fmt: skip
    return fba.read(path)


def vmc(_: Path) -> fba.Animation:
    turn = np.zeros((COUNT, 4))
    turn[:, 1], turn[:, 3] = np.sin(1.3 * RISE), np.cos(1.3 * RISE)  # 149 degrees about y
    sent = vmc_frames({"LeftEye": turn, "RightEye": turn}, {"A": RISE}, COUNT)
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
