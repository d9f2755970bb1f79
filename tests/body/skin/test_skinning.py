"""Vertices carried by joints: against matrices and quaternions multiplied out one vertex at a time.

Rules by which dense weights become those of at most four joints.
"""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fba.body import BapSolver, BodyModel, BodyPart
from fba.body.skin import skin_weights
from fba.compiled import is_compiled
from fba.errors import ModelError
from fba.mesh._meshes import vertex_normals
from fba.parameters import baps
from small_bodies import Float64, random_pose, rod, tube

METHODS = ("dual", "linear")
both = pytest.mark.parametrize("method", METHODS)


def pose(**degrees: float) -> Float64:
    """BAPs (296,) by name."""
    number = {bap.name: bap.number for bap in baps()}
    values = np.zeros(296)
    for name, angle in degrees.items():
        values[number[name] - 1] = np.radians(angle) * 1e5
    return values


@both
def test_as_modelled_it_is_as_modelled(method: str) -> None:
    body = BodyModel.default()
    normals = np.empty_like(body.vertices)
    np.testing.assert_allclose(body.skin(body.bind, normals=normals, method=method), body.vertices, atol=1e-6)
    np.testing.assert_allclose(normals, body.normals, atol=2e-4)


@both
def test_moved_as_a_whole_it_keeps_its_shape(method: str) -> None:
    body = BodyModel.default()
    whole = np.eye(4)
    whole[:3, :3] = Rotation.from_rotvec((0.3, -2.5, 1.0)).as_matrix()
    whole[:3, 3] = (100.0, -20.0, 7.0)
    normals = np.empty_like(body.vertices)
    moved = body.skin(whole @ body.bind, normals=normals, method=method)
    expected = body.vertices.astype(np.float64) @ whole[:3, :3].T + whole[:3, 3]
    np.testing.assert_allclose(moved, expected, atol=1.5e-5)  # a step of float32 at 100 m is 8e-6
    np.testing.assert_allclose(normals, body.normals @ whole[:3, :3].T, atol=2e-4)


def linear_expected(body: BodyModel, matrices: Float64) -> Float64:
    places = np.zeros((len(body.vertices), 3))
    for i, vertex in enumerate(body.vertices.astype(np.float64)):
        for joint, share in zip(body.joints[i], body.weights[i], strict=True):
            motion = matrices[joint] @ np.linalg.inv(body.bind[joint])
            places[i] += share * (motion[:3, :3] @ vertex + motion[:3, 3])
    return places


def dual_expected(body: BodyModel, matrices: Float64) -> Float64:
    """Every motion as a rotation and a shift; quaternions summed by weight, then taken apart again."""
    motions = matrices @ np.linalg.inv(body.bind)
    turns = Rotation.from_matrix(motions[:, :3, :3]).as_quat()
    for joint, parent in enumerate(body.skeleton.parents):
        if parent >= 0 and turns[joint] @ turns[parent] < 0:
            turns[joint] *= -1
    shifts = np.concatenate([motions[:, :3, 3], np.zeros((len(motions), 1))], axis=1)
    duals = np.array([0.5 * product(shift, turn) for shift, turn in zip(shifts, turns, strict=True)])
    places = np.zeros((len(body.vertices), 3))
    for i, vertex in enumerate(body.vertices.astype(np.float64)):
        turn = (body.weights[i, :, None] * turns[body.joints[i]]).sum(axis=0)
        dual = (body.weights[i, :, None] * duals[body.joints[i]]).sum(axis=0)
        length = np.linalg.norm(turn)
        shift = 2 * product(dual / length, turn / length * (-1, -1, -1, 1))[:3]
        places[i] = Rotation.from_quat(turn).apply(vertex) + shift
    return places


def product(p: Float64, q: Float64) -> Float64:
    """Hamilton's product of quaternions x, y, z, w."""
    (a, b, c, d), (x, y, z, w) = p, q
    return np.array([
        d * x + a * w + b * z - c * y,
        d * y - a * z + b * w + c * x,
        d * z + a * y - b * x + c * w,
        d * w - a * x - b * y - c * z,
    ])  # fmt: skip


@pytest.mark.parametrize(("method", "expected"), [("linear", linear_expected), ("dual", dual_expected)])
@pytest.mark.parametrize("seed", range(4))
def test_numbers(method: str, expected: Callable[[BodyModel, Float64], Float64], seed: int) -> None:
    body = rod()
    matrices = random_pose(body, seed, most=1.6)
    np.testing.assert_allclose(body.skin(matrices, method=method), expected(body, matrices), atol=3e-6)


def test_a_vertex_of_one_joint_is_carried_alike() -> None:
    body = rod()
    parts = []
    for part in body.parts:
        joints = np.zeros_like(part.joints) + np.array([1, 0, 0, 0])
        weights = np.zeros_like(part.weights) + np.array([1, 0, 0, 0])
        parts.append(BodyPart(part.name, part.kind, part.vertices, part.triangles, joints, weights))
    stiff = BodyModel(tuple(parts), body.skeleton, body.bind)
    matrices = random_pose(stiff, 7, most=3.0)
    np.testing.assert_allclose(stiff.skin(matrices), stiff.skin(matrices, method="linear"), atol=2e-6)


@both
def test_a_skinner_of_some_vertices_moves_them_alike(method: str) -> None:
    body = BodyModel.default()
    matrices = random_pose(body, 3)
    rows = np.random.default_rng(4).choice(len(body.vertices), 900, replace=False)
    every, some = (np.empty((2, *body.vertices.shape), dtype=np.float32) for _ in range(2))
    skinner = body.skinner.restrict(rows)
    assert 900 <= len(skinner.rows) < len(body.vertices)
    body.skinner.skin(matrices, *every, method)
    skinner.skin(matrices, *some, method)
    np.testing.assert_array_equal(every[:, rows], some[:, rows])
    with pytest.raises(IndexError):
        body.skinner.restrict([len(body.vertices)])


@both
def test_many_frames_are_many_single_ones(method: str) -> None:
    body = rod()
    frames = np.stack([random_pose(body, seed) for seed in range(70)])
    normals = np.empty((70, len(body.vertices), 3), dtype=np.float32)
    found = body.skin(frames, normals=normals, method=method)
    assert (found.shape, found.dtype) == (normals.shape, np.float32)
    upright = np.empty_like(normals[0])
    for frame in (0, 63, 64, 69):
        np.testing.assert_array_equal(found[frame], body.skin(frames[frame], normals=upright, method=method))
        np.testing.assert_array_equal(normals[frame], upright)


def test_the_short_way_round() -> None:
    """A joint that turns by 100 degrees both ways, and a whole body that turns round and round."""
    body = rod()
    for whole in np.linspace(0, 4 * np.pi, 9):
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_euler("y", whole).as_matrix()
        moved = body.skin(turn @ body.bind)
        girth, expected = (np.linalg.norm(places[:, [0, 2]], axis=1) for places in (moved, body.vertices))
        np.testing.assert_allclose(girth, expected, atol=1e-6)


@pytest.mark.parametrize("angle", [-150, -90, 90, 150])
@pytest.mark.parametrize("joint", ["l_elbow_twisting", "r_wrist_twisting"])
def test_a_twisted_arm_keeps_its_girth(joint: str, angle: float) -> None:
    """No candy wrapper: slices across the forearm are as wide as without the twist."""
    body = BodyModel.default()
    solver = BapSolver(body.skeleton)
    side = joint[0]
    start, end = (body.bind[body.skeleton.number(f"{side}_{name}"), :3, 3] for name in ("elbow", "wrist"))
    skin = slice(body.starts["skin"], body.starts["skin"] + len(body.part("skin").vertices))
    modelled = body.vertices[skin].astype(np.float64)
    along = (modelled - start) @ (end - start) / ((end - start) @ (end - start))
    near = np.linalg.norm(modelled - start, axis=1) < 0.4
    plain, twisted = (body.skin(solver.pose(baps_))[skin] for baps_ in (pose(), pose(**{joint: angle})))
    for level in np.arange(-0.1, 1.1, 0.1):
        ring = near & (np.abs(along - level) < 0.05)
        assert ring.sum() >= 8
        before, after = (np.linalg.svd(at[ring] - at[ring].mean(axis=0))[1] for at in (plain, twisted))
        assert after[1] > 0.8 * before[1], level


def test_the_twist_of_a_forearm_grows_along_it() -> None:
    body = BodyModel.default()
    solver = BapSolver(body.skeleton)
    plain, twisted = (body.skin(solver.pose(p)) for p in (pose(), pose(l_elbow_twisting=90)))
    joints = solver.pose(pose())
    start, end = (joints[body.skeleton.number(name), :3, 3] for name in ("l_elbow", "l_wrist"))
    axis = (end - start) / np.linalg.norm(end - start)
    along = (plain - start) @ axis / np.linalg.norm(end - start)
    away = plain - start - ((plain - start) @ axis)[:, None] * axis
    forearm = (np.linalg.norm(away, axis=1) < 0.06) & (plain[:, 0] > 0.1)
    forearm[body.starts["neck"] :] = False  # skin alone: trousers are near
    turned = []
    for level in (0.1, 0.3, 0.5, 0.7, 0.9):
        ring = forearm & (np.abs(along - level) < 0.06)
        after = twisted[ring] - start - ((twisted[ring] - start) @ axis)[:, None] * axis
        sine = (np.cross(away[ring], after) @ axis).sum()
        turned.append(np.degrees(np.arctan2(sine, (away[ring] * after).sum())))
    sign = np.sign(turned[-1])
    np.testing.assert_allclose(np.array(turned) * sign, [9, 27, 45, 63, 81], atol=8)


def test_normals_are_those_of_the_moved_surface() -> None:
    body = BodyModel.default()
    solver = BapSolver(body.skeleton)
    normals = np.empty_like(body.vertices)
    moved = body.skin(
        solver.pose(pose(l_elbow_flexion=110, l_hip_flexion=80, l_knee_flexion=-100)), normals=normals
    )
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)
    skin = body.part("skin")
    rows = slice(body.starts["skin"], body.starts["skin"] + len(skin.vertices))
    cosine = (normals[rows] * vertex_normals(moved[rows], skin.triangles)).sum(axis=1)
    assert np.quantile(cosine, 0.01) > 0.9


def test_normals_across_a_seam_of_colours() -> None:
    """A tube cut lengthwise, its edges in one place: bent, its normals agree there."""
    places, triangles = tube()
    body = rod()
    part = body.parts[0]
    doubled = np.arange(len(places))
    parts = BodyPart("cut", "skin", np.concatenate([places, places]),
                     np.concatenate([triangles[::2], triangles[1::2] + len(places)]),
                     np.tile(part.joints, (2, 1)), np.tile(part.weights, (2, 1)),
                     normals=np.tile(vertex_normals(places, triangles), (2, 1)))  # fmt: skip
    cut = BodyModel((parts,), body.skeleton, body.bind)
    normals = np.empty_like(cut.vertices)
    cut.skin(random_pose(cut, 5), normals=normals)
    np.testing.assert_allclose(normals[doubled], normals[doubled + len(places)], atol=1e-5)


@pytest.mark.skipif(not is_compiled(), reason="plain Python makes objects")
@both
def test_nothing_is_allocated(method: str) -> None:
    body = BodyModel.default()
    matrices = body.bind.copy()
    out, normals = np.empty_like(body.vertices), np.empty_like(body.vertices)
    body.skin(matrices, out, normals, method)
    tracemalloc.start()
    try:
        body.skin(matrices, out, normals, method)
        assert tracemalloc.get_traced_memory()[1] < out.nbytes / 4
    finally:
        tracemalloc.stop()


def test_where_it_is_written() -> None:
    body = rod()
    out = np.empty_like(body.vertices)
    assert body.skin(body.bind, out) is out
    for bad in (out[:-1], out.astype(np.float64), np.empty((3, len(out)), np.float32).T):
        with pytest.raises(ValueError, match="out must be"):
            body.skin(body.bind, bad)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="share memory"):
        body.skin(body.bind, out, out)
    out.flags.writeable = False
    with pytest.raises(ValueError, match="writable"):
        body.skin(body.bind, out)


def test_wrong_matrices() -> None:
    body = rod()
    for bad in (np.eye(4), np.zeros((2, 4, 4)), np.zeros((1, 1, 3, 4, 4))):
        with pytest.raises(ValueError, match=r"must have shape \(3, 4, 4\)"):
            body.skin(bad)
    matrices = body.bind.copy()
    matrices[2, 0, 0] = np.nan
    with pytest.raises(ValueError, match="joint matrix 2 of frame 0 is not finite"):
        body.skin(matrices)
    with pytest.raises(ValueError, match="real numbers"):
        body.skin(np.tile(np.eye(4), (3, 1, 1)).astype(complex))
    with pytest.raises(ValueError, match="there are dual, linear"):
        body.skin(body.bind, method="cubic")


@both
def test_absurd_matrices_do_no_harm(method: str) -> None:
    body = rod()
    for matrices in (np.zeros((3, 4, 4)), np.full((3, 4, 4), 1e200), np.full((3, 4, 4), -1e-300)):
        assert (
            body.skin(matrices, normals=np.empty_like(body.vertices), method=method).shape
            == body.vertices.shape
        )


def test_a_weight_below_the_least_takes_no_place_from_a_chain() -> None:
    # A limb with 0.01 and four vertebrae: the vertebrae keep all four places.
    alike = [False, True, True, True, True]
    dense = np.array([[0.010, 0.40, 0.30, 0.20, 0.09]])
    joints, weights = skin_weights.strongest_weights(dense, alike)
    assert sorted(joints[0].tolist()) == [1, 2, 3, 4]
    lessened = dense[0, 1:] - 0.012
    assert weights[0, np.argsort(joints[0])] == pytest.approx(lessened / lessened.sum(), abs=1e-4)


def test_a_weight_above_the_least_takes_a_place_from_a_chain() -> None:
    alike = [False, True, True, True, True]
    dense = np.array([[0.015, 0.40, 0.30, 0.20, 0.085]])
    joints, weights = skin_weights.strongest_weights(dense, alike)
    assert {0, 1, 2, 3} == set(joints[0].tolist())
    assert weights[0, joints[0] == 0] == pytest.approx(0.003 / (1 - 5 * 0.012), abs=1e-4)


@pytest.mark.parametrize(
    ("total", "fine"), [(1.0009, True), (1.0012, False), (0.9991, True), (0.9985, False)]
)
def test_sums_of_weights_may_miss_one_by_a_thousandth(total: float, fine: bool) -> None:
    weights = np.array([[total - 0.25, 0.25, 0.0, 0.0]])
    joints = np.array([[0, 1, 2, 3]])
    if not fine:
        with pytest.raises(ModelError, match="sum of 1"):
            skin_weights.checked_weights("skin", joints, weights, 1)
        return
    _, share = skin_weights.checked_weights("skin", joints, weights, 1)
    assert float(share.sum()) == pytest.approx(1.0, abs=1e-6)
