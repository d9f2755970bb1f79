"""Bodies within a tolerance: what is sent is measured here, on the decoded stream, by the joints' points."""

from dataclasses import replace

import numpy as np
import pytest

import fba
from fba.body import BapSolver, Skeleton, find_stance
from fba.codec import EncoderOptions, decode
from fba.errors import RangeError
from fba.parameters import BAP_COUNT, baps
from fba.planning import NearLossless, Tolerance, encode_within_tolerance
from fba.planning._body_rows import BodyRows, BodyTarget, MovedPoints, add_error, free_room
from fba.planning._body_tolerance import reduce_joints

VISAGE = EncoderOptions(bap_steps="visage")
NUMBERS = {bap.name: bap.number - 1 for bap in baps()}
SPINE = [bap.number - 1 for bap in baps() if bap.joint.startswith("vl") and bap.freedom == "tilt"]


def motion(count: int = 40, **amplitudes: float) -> np.ndarray:
    """BAPs (count, 296), each a wave of this amplitude, in 1e-5 rad or mm, no two of the same length."""
    values = np.zeros((count, BAP_COUNT), dtype=np.int32)
    for place, (name, amplitude) in enumerate(amplitudes.items()):
        values[:, NUMBERS[name]] = np.rint(amplitude * np.sin(np.arange(count) / (6 + place)))
    return values


GESTURE = motion(
    l_shoulder_flexion=60_000, l_shoulder_abduct=30_000, l_elbow_flexion=-50_000, l_wrist_flexion=20_000,
    HumanoidRoot_tr_lateral=40, HumanoidRoot_rt_body_turn=20_000, skullbase_tilt=15_000,
)  # fmt: skip


def body(values: np.ndarray, rate: int = 25) -> fba.Animation:
    """An animation that sends every BAP that moves."""
    mask = np.broadcast_to(values.any(axis=0), values.shape)
    return fba.Animation(rate, np.arange(len(values)), None, fba.BodyTrack(values, mask))


def off(source: np.ndarray, data: bytes) -> np.ndarray:
    """Millimetres (T, J, 3) by which points 3 cm along each joint's axes are off, between frames in lines."""
    decoded = decode(data, bap_steps="visage")
    frames = np.arange(len(source))
    assert decoded.index[-1] == frames[-1]
    shown = np.stack([np.interp(frames, decoded.index, column) for column in decoded.body.values.T], axis=1)
    apart = BapSolver().pose(shown) - BapSolver().pose(source.astype(float))
    points = [apart[..., :3, 3] + 0.03 * apart[..., :3, axis] for axis in range(3)]
    return np.linalg.norm(np.stack(points, axis=2), axis=-1) * 1000


@pytest.fixture(scope="module")
def gesture() -> tuple[bytes, NearLossless]:
    return encode_within_tolerance(body(GESTURE), Tolerance(), VISAGE)


def test_a_body_stays_within_a_centimetre_in_far_fewer_bytes(gesture: tuple[bytes, NearLossless]) -> None:
    data, near = gesture
    measured = off(GESTURE, data)
    assert measured.max() <= 10.0
    assert near.body.largest * 1000 == pytest.approx(measured.max(), abs=1e-6)
    assert near.body.percentile_99 * 1000 == pytest.approx(np.percentile(measured.max(axis=2), 99), abs=1e-6)
    assert len(data) < 0.7 * min(
        len(fba.encode(body(GESTURE), replace(VISAGE, bap_quant=quant)))
        for quant in range(1, 6)
        if off(GESTURE, fba.encode(body(GESTURE), replace(VISAGE, bap_quant=quant))).max() <= 10.0
    )


def test_frames_that_a_player_can_interpolate_are_left_out(gesture: tuple[bytes, NearLossless]) -> None:
    data, near = gesture
    sent = len(decode(data, bap_steps="visage"))
    assert sent == len(GESTURE) - near.left_out
    assert sent <= 30


def test_feet_that_stand_stay_within_their_own_tolerance() -> None:
    """The root sways over feet that hips keep in their place; hands may be off by more."""
    sway = motion(l_shoulder_flexion=60_000, r_shoulder_abduct=-40_000)
    wave = np.sin(np.arange(len(sway)) / 6)
    sway[:, NUMBERS["HumanoidRoot_tr_lateral"]] = np.rint(20 * wave)
    for hip, ankle in ((NUMBERS["l_hip_abduct"], NUMBERS["l_subtalar_flexion"]),
                       (NUMBERS["r_hip_abduct"], NUMBERS["r_subtalar_flexion"])):  # fmt: skip
        sway[:, hip], sway[:, ankle] = np.rint(-2_300 * wave), np.rint(2_300 * wave)
    skeleton = Skeleton.default()
    stands = find_stance(skeleton, BapSolver().pose(sway.astype(float)), 25.0)
    assert stands.mean() > 0.9
    data, near = encode_within_tolerance(body(sway), Tolerance(foot=0.002), VISAGE)
    measured = off(sway, data).max(axis=2)
    assert 0 < near.body.foot <= 0.002
    for side, foot in zip("lr", stands, strict=True):  # above the heel, and turned against it
        assert measured[foot, skeleton.number(f"{side}_subtalar")].max() < 4.0
    assert 5.0 < measured.max() <= 10.0


def test_a_tolerance_that_no_quantiser_meets_is_an_error() -> None:
    with pytest.raises(RangeError, match=r"no quantiser keeps the body within 0\.1 mm, and feet .* mm off"):
        encode_within_tolerance(body(GESTURE), Tolerance(joint=1e-4, foot=1e-4), VISAGE)
    with pytest.raises(RangeError, match="allow that much"):  # steps of 64 mm for the root
        encode_within_tolerance(body(GESTURE), Tolerance(), EncoderOptions(bap_steps="iso"))


def test_a_body_too_far_from_its_origin_is_an_error_that_says_so() -> None:
    far = GESTURE.copy()
    far[:, NUMBERS["HumanoidRoot_tr_frontal"]] += 5_900
    with pytest.raises(
        RangeError, match=r"BAP 183 HumanoidRoot_tr_frontal is .* in frame 0.*bap_steps='iso'"
    ):
        encode_within_tolerance(body(far), Tolerance(), VISAGE)


def test_short_and_still_bodies() -> None:
    one = body(GESTURE[5:6])
    data, near = encode_within_tolerance(one, Tolerance(), VISAGE)
    assert near.left_out == 0
    assert off(GESTURE[5:6], data).max() <= 10.0
    still = body(np.zeros((10, BAP_COUNT), dtype=np.int32))
    assert len(decode(encode_within_tolerance(still, Tolerance(), VISAGE)[0])) == 10
    with pytest.raises(ValueError, match="no frame"):
        encode_within_tolerance(body(GESTURE[:0]), Tolerance(), VISAGE)


def test_a_body_that_turns_round_and_round() -> None:
    values = motion(60, l_elbow_flexion=-30_000)
    turn = np.rint(np.linspace(0, 4 * np.pi, 60) * 1e5).astype(np.int32)
    values[:, NUMBERS["HumanoidRoot_rt_body_turn"]] = turn - 628319 * np.rint(turn / 628319).astype(np.int32)
    data, near = encode_within_tolerance(body(values), Tolerance(), VISAGE)
    assert off(values, data).max() <= 10.0
    assert near.body is not None
    assert len(data) < 250


def test_a_face_beside_a_body_keeps_every_frame() -> None:
    faps = np.zeros((len(GESTURE), 68), dtype=np.int32)
    faps[:, 2] = np.rint(200 * np.sin(np.arange(len(GESTURE)) / 5)) + 200
    both = replace(body(GESTURE), face=fba.FaceTrack(faps, np.broadcast_to(faps.any(axis=0), faps.shape)))
    data, near = encode_within_tolerance(both, Tolerance(), VISAGE)
    assert near.left_out == 0
    assert off(GESTURE, data).max() <= 10.0
    assert near.face.largest <= 0.0005


def test_user_defined_baps_are_kept() -> None:
    values = GESTURE.copy()
    values[:, 200] = np.arange(len(values)) * 7
    decoded = decode(encode_within_tolerance(body(values), Tolerance(), VISAGE)[0], bap_steps="visage").body
    np.testing.assert_array_equal(decoded.values[:, 200], values[:, 200])


def test_a_bend_of_the_spine_needs_few_vertebrae() -> None:
    values = np.zeros((30, BAP_COUNT))
    values[:, SPINE] = np.rint(4_000 * np.sin(np.arange(30) / 6))[:, None]
    target = BodyTarget(values, 25.0, Tolerance())
    reduced = reduce_joints(target, 0.5)
    assert np.count_nonzero(reduced.any(axis=0)) < len(SPINE) == 5
    source, shown = (BapSolver().pose(one)[..., :3, 3] for one in (values, reduced))
    assert np.linalg.norm(source - shown, axis=-1).max() <= 0.005
    np.testing.assert_array_equal(reduce_joints(target, 1e-9), values)


def test_the_room_of_a_bap_reaches_to_the_tolerance_and_no_further() -> None:
    """A turn about z through the origin, of points at 1 and 2 along x: the farther one has least room."""
    points = np.array([[[1.0, 0, 0], [2.0, 0, 0]]], dtype=np.float32)
    errors = np.zeros_like(points)
    axis, centre = np.array([[0, 0, 0.001]], dtype=np.float32), np.zeros((1, 3), dtype=np.float32)
    weights = np.full((1, 2), 100, dtype=np.float32)  # tolerances of 1 cm
    moved = MovedPoints(points, weights, np.arange(2), centre, axis, True)
    low, high, steepest = free_room(errors, moved, np.ones(1))[:, 0]
    assert (low, high) == pytest.approx((-5.0, 5.0))
    assert steepest == pytest.approx(0.2)
    add_error(errors, moved, np.array([3.0]))
    assert errors[0, :, 1] == pytest.approx([0.3, 0.6])
    assert free_room(errors, moved, np.ones(1))[:2, 0] == pytest.approx([-8.0, 2.0])
    errors[0, 0, 0] = 1.5  # too far off across, whatever this BAP does: it makes the longest shortest
    low, high, _ = free_room(errors, moved, np.ones(1))[:, 0]
    assert low == high == pytest.approx(-3.0, abs=1e-3)


def test_rows_represent_all_points_of_rigid_parts() -> None:
    skeleton = Skeleton.default()
    whole = BodyRows(skeleton, set())
    assert len(whole.joints) < 60  # of 261
    poses = BapSolver().pose(np.zeros((1, BAP_COUNT)))
    height = max(poses[0, :, 1, 3]) + 0.03
    assert whole.points(poses)[0, :, 1].max() == pytest.approx(height)
