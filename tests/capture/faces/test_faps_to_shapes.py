"""FAPs to blendshapes and back: weights that come out as they went in, visemes, tables that are written."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import lsq_linear

import fba
from fba.animation import Animation, FaceTrack
from fba.arrays import Float64
from fba.capture import ShapeMotion, from_blendshapes, shown_weights, to_blendshapes
from fba.capture.blendshapes._inversion import SHARED_WEIGHT, _metres, _shapes, find_weights
from fba.errors import FbaWarning, FormatError, ModelError
from fba.face import arkit_names, resolve
from fba.formats.face_tables._livelink_csv import read_face
from fba.parameters import fap_numbers

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
