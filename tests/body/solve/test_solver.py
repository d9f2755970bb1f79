"""Poses against rotations composed by hand, and solving against known BAPs."""

import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fba.body import BapSolver, Skeleton, wrapped
from fba.errors import ModelError
from fba.parameters import bap_numbers, baps

NUMBERS = bap_numbers()
HALF = 157080  # half pi in 1e-5 rad


def posed(axes: str = "iso", **values: int) -> dict[str, np.ndarray]:
    solver = BapSolver(axes=axes)
    row = np.zeros(296, dtype=np.int32)
    for name, value in values.items():
        row[NUMBERS[name] - 1] = value
    return dict(zip(solver.skeleton.names, solver.pose(row), strict=True))


def place(joints: dict[str, np.ndarray], name: str) -> np.ndarray:
    return joints[name][:3, 3]


def default(name: str) -> np.ndarray:
    return Skeleton.default().centres[Skeleton.default().number(name)]


def human() -> np.ndarray:
    """(296, 2): the standard's ranges, but at most a quarter turn less a little, and 1 m."""
    limits = np.zeros((296, 2))
    for bap in baps():
        if bap.i_limits is not None:
            most = 1000 if bap.unit == "mm" else HALF - 2000
            limits[bap.number - 1] = np.clip(np.array(bap.i_limits) * bap.step_iso, -most, most)
    return limits


def random_baps(count: int, seed: int) -> np.ndarray:
    limits = human()
    return np.random.default_rng(seed).integers(limits[:, 0], limits[:, 1] + 1, (count, 296)).astype(np.int32)


def test_default_posture() -> None:
    solver = BapSolver()
    matrices = solver.pose(np.zeros(296, dtype=np.int32))
    assert matrices.shape == (87, 4, 4)
    assert matrices.dtype == np.float64
    np.testing.assert_allclose(matrices[:, :3, :3], np.broadcast_to(np.eye(3), (87, 3, 3)))
    np.testing.assert_allclose(matrices[:, :3, 3], solver.skeleton.centres)


def test_root_translation_is_millimetres_up_left_forward() -> None:
    joints = posed(HumanoidRoot_tr_vertical=100, HumanoidRoot_tr_lateral=20, HumanoidRoot_tr_frontal=-3)
    for name in ("HumanoidRoot", "l_ankle", "r_index3"):
        np.testing.assert_allclose(place(joints, name) - default(name), [0.02, 0.1, -0.003], atol=1e-12)


def test_limbs_move_as_the_standard_says() -> None:
    def moved(bap: str, value: int, joint: str) -> np.ndarray:
        return place(posed(**{bap: value}), joint) - default(joint)

    assert moved("l_knee_flexion", -HALF, "l_ankle")[2] < -0.4  # a knee bends backward
    assert moved("r_knee_flexion", -HALF, "r_ankle")[2] < -0.4
    assert moved("l_elbow_flexion", HALF, "l_wrist")[2] > 0.25
    assert moved("l_shoulder_flexion", HALF, "l_elbow")[2] > 0.25
    assert moved("l_shoulder_abduct", HALF, "l_elbow")[0] > 0.25  # outward: positive left,
    assert moved("r_shoulder_abduct", -HALF, "r_elbow")[0] < -0.25  # negative right
    assert moved("l_hip_flexion", HALF, "l_knee")[2] > 0.4
    assert moved("HumanoidRoot_rt_body_turn", HALF, "l_elbow")[2] < -0.1  # to the left, seen from above


def test_fingers_curl_into_the_palm_on_both_sides() -> None:
    for side, inward in (("l", -1), ("r", 1)):
        tip = f"{side}_middle3"
        shift = place(posed(**{f"{side}_middle1_flexion": -HALF}), tip) - default(tip)
        assert shift[0] * inward > 0.05
        assert abs(shift[2]) < 0.005


def test_vreng_legs_turn_the_other_way() -> None:
    ankle = place(posed("vreng", l_knee_flexion=HALF), "l_ankle") - default("l_ankle")
    assert ankle[2] < -0.4
    wrist = place(posed("vreng", l_elbow_flexion=HALF), "l_wrist") - default("l_wrist")
    assert wrist[2] > 0.25


@pytest.mark.parametrize(
    ("axes", "expected"),
    [("iso", ("flexion", "abduct", "twisting")), ("abduct_first", ("abduct", "flexion", "twisting")),
     ("parent_twist", ("twisting", "abduct", "flexion"))],
)  # fmt: skip
def test_order_of_rotations_at_the_shoulder(axes: str, expected: tuple[str, ...]) -> None:
    angles = {"flexion": 0.7, "abduct": 0.4, "twisting": -0.5}
    vectors = {"flexion": [-1, 0, 0], "abduct": [0, 0, 1], "twisting": [0, -1, 0]}
    joints = posed(axes, **{f"l_shoulder_{k}": round(v * 1e5) for k, v in angles.items()})
    turn = Rotation.identity()
    for name in expected:  # outermost first
        turn = turn * Rotation.from_rotvec(np.array(vectors[name]) * angles[name])
    np.testing.assert_allclose(joints["l_shoulder"][:3, :3], turn.as_matrix(), atol=1e-12)
    elbow = default("l_shoulder") + turn.apply(default("l_elbow") - default("l_shoulder"))
    np.testing.assert_allclose(place(joints, "l_elbow"), elbow, atol=1e-12)


def test_chain_of_joints_composes_from_the_root_down() -> None:
    joints = posed(
        HumanoidRoot_rt_body_turn=40000, HumanoidRoot_rt_body_tilt=10000, HumanoidRoot_rt_body_roll=-5000,
        sacroiliac_torsion=-20000, r_hip_flexion=60000, r_knee_flexion=-90000, r_ankle_twisting=7000,
    )  # fmt: skip
    root = Rotation.from_euler("YZX", [0.4, -0.05, 0.1])
    pelvis = root * Rotation.from_euler("Y", -0.2)
    thigh = pelvis * Rotation.from_euler("X", -0.6)
    shank = thigh * Rotation.from_euler("X", 0.9)
    foot = shank * Rotation.from_euler("Y", -0.07)
    at = default("HumanoidRoot")
    chain = [
        ("sacroiliac", root),
        ("r_hip", pelvis),
        ("r_knee", thigh),
        ("r_ankle", shank),
        ("r_subtalar", foot),
    ]
    before = "HumanoidRoot"
    for name, frame in chain:
        at = at + frame.apply(default(name) - default(before))
        np.testing.assert_allclose(place(joints, name), at, atol=1e-12)
        before = name
    np.testing.assert_allclose(joints["r_ankle"][:3, :3], foot.as_matrix(), atol=1e-12)


@pytest.mark.parametrize("axes", ["iso", "vreng", "abduct_first", "parent_twist", "fixed_axes"])
def test_solve_gives_back_what_was_posed(axes: str) -> None:
    solver = BapSolver(axes=axes)
    wanted = random_baps(200, seed=7)
    for row in wanted:
        found = solver.solve(solver.pose(row))
        assert found.dtype == np.int32
        assert np.abs(found - row).max() <= 1


def test_solve_near_gimbal_lock_keeps_the_rotation() -> None:
    solver = BapSolver()
    rows = random_baps(300, seed=3)
    middle = [b.number - 1 for b in baps() if b.freedom in ("abduct", "roll") or b.name.endswith("_flexion")]
    generator = np.random.default_rng(4)
    offsets = generator.choice([0, 1, -1, 3, -10, 100], (300, len(middle)))
    rows[:, middle] = HALF * generator.choice([-1, 1], (300, len(middle))) + offsets
    posed_rows = solver.pose(rows)
    again = solver.pose(np.stack([solver.solve(row) for row in posed_rows]))
    assert np.abs(again - posed_rows).max() < 1e-4


def test_solve_follows_several_whole_turns_without_a_jump() -> None:
    solver = BapSolver()
    rows = np.zeros((400, 296), dtype=np.int32)
    rows[:, NUMBERS["HumanoidRoot_rt_body_turn"] - 1] = np.arange(400) * 5000
    rows[:, NUMBERS["l_shoulder_flexion"] - 1] = -np.arange(400) * 2000
    np.testing.assert_allclose(solver.solve(solver.pose(rows)), rows, atol=1)


def test_solve_continues_from_previous() -> None:
    solver = BapSolver()
    rows = np.zeros((10, 296), dtype=np.int32)
    rows[:, NUMBERS["HumanoidRoot_rt_body_turn"] - 1] = 700_000 + np.arange(10) * 3000
    matrices = solver.pose(rows)
    np.testing.assert_allclose(solver.solve(matrices[5:], previous=rows[4]), rows[5:], atol=1)
    assert np.abs(solver.solve(matrices[5])).max() < 314_160


def test_children_make_up_for_what_a_joint_lacks() -> None:
    """A knee cannot abduct: the foot's rotation is reached by the joints below it."""
    solver = BapSolver()
    matrices = solver.pose(np.zeros(296))
    for name in ("l_knee", "l_ankle", "l_subtalar", "l_midtarsal", "l_metatarsal"):
        matrices[solver.skeleton.number(name), :3, :3] = Rotation.from_euler("Z", 0.3).as_matrix()
    again = solver.pose(solver.solve(matrices))
    foot = again[solver.skeleton.number("l_subtalar"), :3, :3]
    np.testing.assert_allclose(foot, Rotation.from_euler("Z", 0.3).as_matrix(), atol=1e-4)


def test_solve_only_the_joints_asked_for() -> None:
    solver = BapSolver()
    matrices = solver.pose(random_baps(1, seed=1)[0])
    found = solver.solve(matrices, joints=["l_hip"])
    turned = {baps()[column].joint for column in np.flatnonzero(found)}
    assert turned <= {"l_hip", "HumanoidRoot"}
    assert not found[183:186].any()
    with pytest.raises(KeyError):
        solver.solve(matrices, joints=["tail"])


def test_186_columns_and_one_frame() -> None:
    solver = BapSolver()
    rows = random_baps(3, seed=9)
    np.testing.assert_array_equal(solver.pose(rows[:, :186]), solver.pose(rows))
    np.testing.assert_array_equal(solver.pose(rows[1]), solver.pose(rows)[1])
    assert solver.pose(rows[:0]).shape == (0, 87, 4, 4)
    assert solver.solve(solver.pose(rows[:0])).shape == (0, 296)


def test_wrong_input() -> None:
    solver = BapSolver()
    for bad in (np.zeros(100), np.zeros((2, 3, 296)), np.full(296, np.nan), ["x"] * 296):
        with pytest.raises(ValueError, match="baps must"):
            solver.pose(bad)
    with pytest.raises(ValueError, match="shape"):
        solver.solve(np.zeros((86, 4, 4)))
    with pytest.raises(ValueError, match="finite"):
        solver.solve(np.full((87, 4, 4), np.inf))
    far = solver.pose(np.zeros(296))
    far[0, 0, 3] = 1e9
    with pytest.raises(ModelError, match="32 bits"):
        solver.solve(far)
    with pytest.raises(ValueError, match="iso, vreng"):
        BapSolver(axes="nonsense")


def test_skeleton_without_some_joints() -> None:
    body = Skeleton.from_parents(
        {"HumanoidRoot": None, "l_hip": "HumanoidRoot"}, {"HumanoidRoot": (0, 1, 0), "l_hip": (0.1, 0.9, 0)}
    )
    solver = BapSolver(body)
    assert "r_hip" in solver.missing
    assert "l_hip" not in solver.missing
    row = random_baps(1, seed=2)[0]
    found = solver.solve(solver.pose(row))
    used = found != 0
    assert np.abs(found - row)[used].max() <= 1
    assert {baps()[c].joint for c in np.flatnonzero(used)} == {"HumanoidRoot", "l_hip"}


def test_wrapped() -> None:
    turn = NUMBERS["HumanoidRoot_rt_body_turn"] - 1
    rows = np.zeros((4, 296), dtype=np.int32)
    rows[:, turn] = [600_000, 610_000, 640_000, 650_000]  # around one whole turn
    rows[:, 180] = [5_000_000, 0, 0, 0]  # millimetres stay
    found = wrapped(rows)
    np.testing.assert_array_equal(found[:, turn], [-28319, -18319, 11681, 21681])
    np.testing.assert_array_equal(found[:, 180], rows[:, 180])
    rows[:, turn] = [0, 250_000, 400_000, 700_000]  # more than a turn: no way without a jump
    assert np.abs(wrapped(rows)[:, turn]).max() <= 314_160
    solver = BapSolver()
    assert np.abs(solver.pose(wrapped(rows)) - solver.pose(rows)).max() < 2e-5
    rows[:, turn] = [-314_000, 0, 0, 314_000]
    np.testing.assert_array_equal(wrapped(rows), rows)


def test_same_results_without_compilation() -> None:
    program = (
        "import numpy as np; from fba.body import BapSolver; from fba.compiled import is_compiled;"
        "assert not is_compiled(); s = BapSolver();"
        "x = np.random.default_rng(5).integers(-90000, 90000, (2, 296)); m = s.pose(x);"
        "print(repr(float(m.sum())), int(np.abs(s.solve(m)[:, :186]).sum()))"
    )
    found = subprocess.run(
        [sys.executable, "-c", program], env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    solver = BapSolver()
    values = np.random.default_rng(5).integers(-90000, 90000, (2, 296))
    matrices = solver.pose(values)
    assert float(found[0]) == pytest.approx(float(matrices.sum()), rel=1e-12)
    assert int(found[1]) == int(np.abs(solver.solve(matrices)[:, :186]).sum())
