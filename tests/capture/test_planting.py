"""Feet on the ground: heights, slip, slopes, and what that costs the legs.

Limbs that are almost straight do not spin about themselves: no jumps that the source does not make.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_from_skeleton import NAMES, REAL

from capture_bodies import bone_errors, limb_bones, motion
from fba.body import BapSolver, BodyModel, Skeleton, ground
from fba.body.footing import lowest_sole
from fba.capture import SkeletonMotion, from_skeleton, retarget_report
from fba.capture._limbs import foot_planting, soles
from fba.capture.bones import match
from fba.formats.bvh import _reader as reader
from fba.parameters import bap_numbers

HINGED = ("shoulder", "elbow", "hip", "knee")
THIGH, SHANK = 0.36, 0.54
"""Metres: a body of quite other proportions than the default's, whose thigh and shank are of one length."""


def squats(slide: bool = False) -> SkeletonMotion:
    """Someone with short thighs bends both knees by up to 70 degrees, three times, feet flat on the ground.

    The hips are placed such that the ankles stay where they are, so the source's feet do not move at all.
    With slide, she meanwhile moves forward by 30 cm, feet and all.
    """
    count = 240
    bend = np.radians(35) * (1 - np.cos(np.linspace(0, 6 * np.pi, count)))
    # the ankle stays below the hips where sin(lean) thigh = sin(bend - lean) shank
    lean = np.arctan2(SHANK * np.sin(bend), THIGH + SHANK * np.cos(bend))
    across = np.array([1.0, 0.0, 0.0])
    turns = {}
    for side in ("Left", "Right"):
        turns[f"{side}UpLeg"] = Rotation.from_rotvec(np.outer(-lean, across))
        turns[f"{side}Leg"] = Rotation.from_rotvec(np.outer(bend, across))
        turns[f"{side}Foot"] = Rotation.from_rotvec(np.outer(lean - bend, across))
    captured = motion("standing", count, turns=turns)
    offsets = np.array(captured.offsets)
    for side in ("Left", "Right"):
        offsets[captured.names.index(f"{side}Leg")] = [0.0, -THIGH, 0.0]
        offsets[captured.names.index(f"{side}Foot")] = [0.0, -SHANK, 0.0]
    high = THIGH * np.cos(lean) + SHANK * np.cos(bend - lean)
    places = np.array(captured.positions)
    places[:, 1] = high + 0.05
    if slide:
        places[:, 2] += np.linspace(0, 0.3, count)
    return replace(captured, offsets=offsets, positions=places)


def walk(rise: float = 0.0) -> SkeletonMotion:
    """Strides on stiff legs over 4 m of ground that rises by a share of the way; the lower foot stands."""
    count = 480
    time = np.linspace(0, 4, count)
    swing = np.radians(18) * np.sin(np.pi * time)
    lift = np.radians(30) * np.maximum(0, np.cos(np.pi * time)) ** 2
    other = np.radians(30) * np.maximum(0, -np.cos(np.pi * time)) ** 2
    across = np.array([1.0, 0.0, 0.0])

    def turn(angle: np.ndarray) -> Rotation:
        return Rotation.from_rotvec(np.outer(angle, across))

    turns = {
        "LeftUpLeg": turn(-swing - lift), "LeftLeg": turn(2 * lift), "LeftFoot": turn(swing - lift),
        "RightUpLeg": turn(swing - other), "RightLeg": turn(2 * other), "RightFoot": turn(-swing - other),
    }  # fmt: skip
    captured = motion("standing", count, turns=turns)
    places = np.array(captured.positions)
    places[:, 2] = time
    _, joints = replace(captured, positions=places).world()
    toes = [captured.names.index(f"{side}ToeBase") for side in ("Left", "Right")]
    places[:, 1] -= (joints[:, toes, 1] - rise * joints[:, toes, 2]).min(axis=1)
    return replace(captured, positions=places)


def posed(captured: SkeletonMotion, **options: object) -> dict[str, np.ndarray]:
    """(T, 3): places of the body's joints."""
    matrices = BapSolver().pose(from_skeleton(captured, **options).body.values)  # type: ignore[arg-type]
    return {name: matrices[:, number, :3, 3] for number, name in enumerate(Skeleton.default().names)}


def steady(places: np.ndarray) -> float:
    """Metres between the farthest places."""
    return float(np.linalg.norm(np.ptp(places, axis=0)))


def test_feet_do_not_slip_in_squats() -> None:
    captured = squats()
    free, planted = (posed(captured, plant=plant) for plant in (False, True))
    for side in "lr":
        ball = f"{side}_metatarsal"
        assert steady(free[ball]) > 0.02  # other proportions carry the feet along
        assert steady(planted[ball]) < 0.006
        heights = planted[ball][:, 1]
        assert np.ptp(heights) < 0.006
    errors = bone_errors(captured, from_skeleton(captured).body.values, limb_bones(NAMES))
    assert max(float(e.max()) for e in errors.values()) < 5.0
    assert max(float(e.mean()) for e in errors.values()) < 1.0


def test_feet_that_slide_still_slide() -> None:
    scale = (0.42695 + 0.43398) / (THIGH + SHANK)
    ball = posed(squats(slide=True))["l_metatarsal"]
    assert ball[-1, 2] - ball[0, 2] == pytest.approx(0.3 * scale, abs=0.01)


def test_one_foot_on_a_step() -> None:
    """Feet in the air are left alone: the right one, held 10 cm up, keeps all its bones."""
    bent = {
        "RightUpLeg": Rotation.from_euler("x", -40, degrees=True),
        "RightLeg": Rotation.from_euler("x", 55, degrees=True),
        "RightFoot": Rotation.from_euler("x", -15, degrees=True),
    }
    captured = motion("standing", 30, turns=bent)
    for plant in (False, True):
        errors = bone_errors(captured, from_skeleton(captured, plant=plant).body.values, limb_bones(NAMES))
        assert float(errors["r_hip", "r_knee"].max()) < 0.01
        assert float(errors["r_knee", "r_ankle"].max()) < 0.01


@pytest.mark.parametrize("rise", [0.0, 0.03, -0.05])
def test_sloping_ground_is_levelled(rise: float) -> None:
    captured = walk(rise)
    places = posed(captured)
    low = np.minimum(places["l_metatarsal"][:, 1], places["r_metatarsal"][:, 1])
    assert np.percentile(low, 95) - np.percentile(low, 5) < 0.01
    assert np.median(low) == pytest.approx(0.0092, abs=0.008)
    kept = posed(captured, ground="source")
    low = np.minimum(kept["l_metatarsal"], kept["r_metatarsal"])[:, 1]
    assert low[-60:].mean() - low[:60].mean() == pytest.approx(rise * 3.5 * 0.9566, abs=0.015)
    report = retarget_report(captured, from_skeleton(captured))
    assert report.feet.within > 0.99


def test_ground_from_points() -> None:
    """A plane under feet that hang above it in part of the frames, stairs, and feet that do not walk."""
    generator = np.random.default_rng(5)
    x, z = generator.uniform(-0.3, 0.3, 400), np.linspace(-2, 2, 400)
    points = np.stack([x, 0.05 + 0.02 * z, z], axis=1)
    points[::3, 1] += generator.uniform(0, 0.1, len(points[::3]))
    feet = np.stack([points, points + np.array([0.0, 0.2, 0.0])])
    found = ground.find(feet[..., 1], feet)
    assert found.slope[1] == pytest.approx(0.02, abs=0.003)
    assert found.under(np.array([0.0, 9.0, 1.0])) == pytest.approx(0.07, abs=0.006)
    stairs = feet.copy()
    stairs[..., 1] = 0.5 * stairs[..., 2]
    assert ground.find(stairs[..., 1], stairs).slope == (0.0, 0.0)
    still = feet * [0.1, 1.0, 0.1]
    assert ground.find(still[..., 1], still).slope == (0.0, 0.0)


def test_leg_reaches_by_the_law_of_cosines() -> None:
    """A leg bent by 80 degrees goes where it is asked to, and keeps the lengths of its bones."""
    bend = np.radians(80)
    hip, knee = np.zeros((1, 3)), np.array([[0.0, -0.43, 0.0]])
    ankle = knee + 0.42 * np.array([[0.0, -np.cos(bend), -np.sin(bend)]])
    leg = foot_planting.Leg(hip, knee, ankle, np.array([[1.0, 0.0, 0.0]]))
    move = np.array([[0.01, 0.015, -0.02]])
    thigh, shank = foot_planting.move_ankle(leg, move)
    reached = (thigh @ knee[0]) + (shank @ (ankle - knee)[0])
    np.testing.assert_allclose(reached[0], (ankle + move)[0], atol=5e-4)


def tiptoe(toes: bool) -> SkeletonMotion:
    """Somebody who rises on the balls of both feet by 50 degrees. toes: whether the file has them."""
    count = 60
    rise = Rotation.from_rotvec(np.outer(np.radians(50) * np.sin(np.linspace(0, np.pi, count)), [1.0, 0, 0]))
    turns = {f"{side}{joint}": rise if joint == "Foot" else rise.inv() for side in ("Left", "Right")
             for joint in ("Foot", "ToeBase")}  # fmt: skip
    captured = motion("standing", count, turns=turns)
    places = np.array(captured.positions)
    balls = captured.world()[1][:, [captured.names.index(f"{side}ToeBase") for side in ("Left", "Right")], 1]
    places[:, 1] += balls[0, 0] - balls[:, 0]
    captured = replace(captured, positions=places)
    if toes:
        return captured
    names = tuple(name.replace("ToeBase", "Marker") for name in captured.names)
    return replace(captured, names=names)


@pytest.mark.parametrize("toes", [True, False])
def test_toes_stay_on_the_ground_while_somebody_rises_over_the_balls(toes: bool) -> None:
    """Stiff toes would be 5 cm under it. A file without joints of toes has its feet end at the balls."""
    values = from_skeleton(tiptoe(toes)).body.values  # type: ignore[union-attr]
    skeleton = Skeleton.default()
    matrices = BapSolver().pose(values)
    lowest = lowest_sole(skeleton, matrices)
    assert lowest is not None
    assert np.abs(lowest).max() < 0.005
    heel = matrices[30, skeleton.number("l_ankle"), 1, 3] - matrices[0, skeleton.number("l_ankle"), 1, 3]
    assert heel > 0.06
    bend = values[:, bap_numbers()["l_metatarsal_flexion"] - 1] / 1e5
    assert np.degrees(bend[30]) == pytest.approx(50, abs=8)


def test_a_foot_in_the_air_is_never_under_the_ground() -> None:
    """Somebody swings a leg whose foot points down: toes would be 3.5 cm under the ground."""
    count = 60
    down = Rotation.from_rotvec([np.radians(20), 0.0, 0.0])
    swing = Rotation.from_rotvec(
        np.outer(np.radians(20) * np.sin(np.linspace(0, 2 * np.pi, count)), [1.0, 0, 0])
    )
    captured = motion("standing", count, turns={"RightUpLeg": swing, "RightFoot": down})
    values = from_skeleton(captured).body.values  # type: ignore[union-attr]
    lowest = lowest_sole(Skeleton.default(), BapSolver().pose(values))
    assert lowest.min() > -0.004


def test_straight_leg_is_not_broken_for_a_millimetre() -> None:
    """A leg that is straight within a degree would bend by 12 degrees to be 5 mm shorter: it does not."""
    bend = np.radians(np.array([1.0, 0.5, 0.0, -0.5, -1.0]))
    hip, knee = np.zeros((5, 3)), np.tile([0.0, -0.43, 0.0], (5, 1))
    ankle = knee + 0.42 * np.stack([0 * bend, -np.cos(bend), -np.sin(bend)], axis=1)
    leg = foot_planting.Leg(hip, knee, ankle, np.tile([1.0, 0.0, 0.0], (5, 1)))
    thigh, shank = foot_planting.move_ankle(leg, np.tile([0.0, 0.005, 0.0], (5, 1)))
    turned = np.degrees(Rotation.from_matrix(shank).magnitude())
    assert turned.max() < 2.0
    assert np.degrees(Rotation.from_matrix(thigh).magnitude()).max() < 1.0
    assert foot_planting.length_share(leg).max() < 0.05


def test_heights_of_no_person_have_a_level_ground() -> None:
    """Least squares have no solution where one frame is 1e29 m away: found by fuzzing."""
    lowest = np.array([[7.2e28, -0.97, -0.98], [7.2e28, -0.966, -0.97]])
    across = np.array([[1.2e27, 0.09, 0.09], [1.2e27, -0.15, -0.09]])
    points = np.stack([across, lowest, np.full((2, 3), 0.0225)], axis=-1)
    assert ground.find(lowest, points).slope == (0.0, 0.0)


def settled(left: object, right: object, *, slide: float = 0.0, ends: float = 1.0) -> np.ndarray:
    """(2, T): heights of soles that were captured at these heights (T,), after the ground was found.

    slide: metres a second by which both feet are carried backwards. ends: seconds after which the right
    foot moves off, sideways, at a metre a second.
    """
    heights = np.array(np.broadcast_arrays(left, right), dtype=float)
    seconds = np.arange(heights.shape[1]) / 60
    points = np.zeros((2, 2, len(seconds), 3))
    points[..., 1] = heights[:, None]
    points[..., 2] = -slide * seconds
    points[1, :, :, 0] = np.maximum(0.0, seconds - ends)
    return soles.settle(heights, points, 60.0)


def test_both_feet_that_are_still_stand_on_the_ground() -> None:
    """Captures of feet are off by 2 cm; somebody on one leg holds the other foot higher."""
    level = np.full(60, 0.01)
    np.testing.assert_allclose(settled(level, 0.03), 0.0, atol=1e-12)
    np.testing.assert_allclose(settled(level, 0.0345), 0.0, atol=1e-12)
    np.testing.assert_allclose(settled(level, 0.036)[1], 0.026, atol=1e-12)


def test_a_foot_that_comes_and_goes_is_not_pulled_down() -> None:
    """It is still for 0.6 s, or for 0.4 s only."""
    level = np.zeros(60)
    np.testing.assert_allclose(settled(level, 0.02, ends=0.6)[1, :12], 0.0, atol=1e-12)
    np.testing.assert_allclose(settled(np.zeros(40), 0.02, ends=0.2)[1], 0.02, atol=1e-12)


def test_a_foot_that_slides_stands_where_the_other_one_is_lifted() -> None:
    """As on a treadmill: at 1.2 m/s, 1 cm above the ground, while the other foot swings."""
    np.testing.assert_allclose(settled(np.full(60, 0.01), 0.1, slide=1.2)[0], 0.0, atol=1e-12)
    rising = np.linspace(0.0, 0.07, 60)
    np.testing.assert_allclose(settled(rising, 0.1, slide=1.2)[0, 25:35], 0.0, atol=1e-12)  # 7 cm/s
    np.testing.assert_allclose(settled(2.3 * rising, 0.4, slide=1.2)[0], 2.3 * rising, atol=1e-12)  # 16 cm/s
    np.testing.assert_allclose(settled(np.full(60, 0.01), 0.02, slide=1.2)[0], 0.01, atol=1e-12)  # a leap


def test_nobody_stands_on_a_step_above_the_ground() -> None:
    np.testing.assert_allclose(settled(np.full(60, 0.079), 0.3), [[0.0] * 60, [0.3 - 0.079] * 60], atol=1e-12)
    np.testing.assert_allclose(settled(np.full(60, 0.081), 0.3)[0], 0.081, atol=1e-12)


def test_soles_are_those_of_the_person_that_is_shown() -> None:
    """Who has shorter shanks: on a bent leg, the foot of the shown person is lower against the other one."""
    skeleton, shown = Skeleton.default(), BodyModel.default().skeleton
    bent = Rotation.from_rotvec([[np.radians(50), 0.0, 0.0]]).as_matrix()
    turned = {"l_hip": bent.swapaxes(1, 2), "l_knee": np.eye(3)[None], "l_ankle": np.eye(3)[None]}
    root = skeleton.centres[:1]
    found = soles.body_soles(skeleton, turned, root)
    apart = []
    for body in (skeleton, shown):
        thigh = body.centres[body.number("l_knee")] - body.centres[body.number("l_hip")]
        apart.append(float((bent[0].T @ thigh - thigh)[1]))
    assert found.lowest[1, 0] == pytest.approx(0.0, abs=1e-6)
    assert found.lowest[0, 0] == pytest.approx(apart[1], abs=0.001)
    assert abs(apart[1] - apart[0]) > 0.002


def steps(matrices: np.ndarray, parent: np.ndarray | None = None) -> np.ndarray:
    """Degrees (T - 1,) that rotations (T, 3, 3) turn by from frame to frame, relative to a parent's."""
    own = Rotation.from_matrix(matrices)
    if parent is not None:
        own = Rotation.from_matrix(parent).inv() * own
    result: np.ndarray = np.degrees((own[:-1].inv() * own[1:]).magnitude())
    return result


def joint_steps(captured: SkeletonMotion) -> dict[str, np.ndarray]:
    skeleton = Skeleton.default()
    matrices = BapSolver().pose(from_skeleton(captured).body.values)[:, :, :3, :3]
    return {
        name: steps(matrices[:, number], matrices[:, skeleton.parents[number]] if number else None)
        for number, name in enumerate(skeleton.names)
    }


def test_shank_that_circles_about_straight() -> None:
    """The shank points 3 degrees off the thigh's line, to all sides in turn, twice a second: the plane of the
    knee turns twice round a second, 12 degrees a frame, but nobody would see it, and the thigh does not."""
    count, tilt = 120, np.radians(3.0)
    round_ = np.linspace(0, 8 * np.pi, count)
    leg = Rotation.from_rotvec(tilt * np.stack([np.cos(round_), 0 * round_, np.sin(round_)], axis=1))
    captured = motion("standing", count, turns={"LeftLeg": leg}, rate=60)
    found = joint_steps(captured)
    assert steps(leg.as_matrix()).max() == pytest.approx(0.63, abs=0.02)
    for name in ("l_hip", "l_knee", "l_ankle"):
        assert found[name].max() < 2.0, name
    errors = bone_errors(captured, from_skeleton(captured).body.values, limb_bones(NAMES))
    assert max(float(e.max()) for e in errors.values()) < 4.0


def test_elbow_beyond_straight_and_back() -> None:
    """An arm swings 8 degrees beyond straight, leaning to the side meanwhile, and bends again."""
    count = 180
    time = np.linspace(0, 1, count)
    bend = -(np.radians(40) * np.cos(2 * np.pi * time) + np.radians(32))  # 72 .. -8 degrees
    lean = np.radians(5) * np.sin(4 * np.pi * time)
    arm = Rotation.from_rotvec(np.stack([bend, 0 * time, lean], axis=1))
    captured = motion("standing", count, turns={"RightForeArm": arm}, rate=60)
    found = joint_steps(captured)
    assert steps(arm.as_matrix()).max() < 1.5
    for name in ("r_shoulder", "r_elbow", "r_wrist"):
        assert found[name].max() < 8.0, name
    errors = bone_errors(captured, from_skeleton(captured).body.values, limb_bones(NAMES))
    assert max(float(e.max()) for e in errors.values()) < 5.0


@pytest.mark.parametrize("name", REAL)
@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_real_limbs_do_not_jump(shared: Path, name: str) -> None:
    captured = reader.read_motion(shared / "data" / name)
    _, mapped = match(captured.names)
    found = joint_steps(captured)
    for side in "lr":
        for joint in HINGED:
            number = mapped[f"{side}_{joint}"]
            quaternions = np.array(captured.rotations[:, number])[:, [1, 2, 3, 0]]
            own = steps(Rotation.from_quat(quaternions).as_matrix())
            # as much as source or its arm does in a frame, and at most 500 degrees a second of its own
            child = mapped[f"{side}_{ {'shoulder': 'elbow', 'hip': 'knee'}.get(joint, joint) }"]
            lower = steps(
                Rotation.from_quat(np.array(captured.rotations[:, child])[:, [1, 2, 3, 0]]).as_matrix()
            )
            excess = found[f"{side}_{joint}"] - np.maximum(own, lower)
            assert excess.max() < max(5.0, 600.0 / float(captured.rate)), (side, joint, int(excess.argmax()))
