"""A face on a body: one skin with it, the head turned on its skull base."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from fba.body import AttachedHead, BapSolver, BodyModel, attach_head
from fba.body.head_attachment import placement
from fba.body.skin.skin_weights import strongest_weights
from fba.errors import ModelError
from fba.face.deform._deformer import Deformer
from fba.face.model import FaceModel
from fba.parameters import baps, point_rows
from small_bodies import Float64, rod

FREE = ("skin", "mouth", "hair", "other")


def pupils(model: FaceModel) -> Float64:
    return model.points[[point_rows()["3.5"], point_rows()["3.6"]]]


@pytest.fixture(scope="module")
def head() -> AttachedHead:
    model = FaceModel.default()
    skull = np.concatenate([np.full(len(part.vertices), part.kind not in FREE) for part in model.parts])
    return attach_head(BodyModel.default(), model.vertices, pupils(model), skull)


def posed(**degrees: float) -> Float64:
    number = {bap.name: bap.number for bap in baps()}
    values = np.zeros(296)
    for name, angle in degrees.items():
        values[number[name] - 1] = np.radians(angle) * 1e5
    return BapSolver(BodyModel.default().skeleton).pose(values)


NOD = {"skullbase_tilt": 30, "vc4_roll": 10, "vc6_torsion": 25, "vt3_tilt": 10}


def test_the_built_in_head_fits_as_it_is(head: AttachedHead) -> None:
    assert head.brings_neck
    np.testing.assert_array_equal(head.place[:3, :3], np.eye(3))
    model = FaceModel.default()
    placed = head.skin(model.vertices, BodyModel.default().bind)
    np.testing.assert_allclose(placed, model.vertices + head.place[:3, 3], atol=2e-6)


def test_head_neck_and_bust_are_one_skin(head: AttachedHead) -> None:
    """Where the figure's own neck and the face have a vertex in one place, they stay together."""
    body, model = BodyModel.default(), FaceModel.default()
    neck = body.part("neck")
    rows = np.arange(len(neck.vertices)) + body.starts["neck"]
    away, nearest = cKDTree(model.vertices + head.place[:3, 3]).query(neck.vertices)
    shared = away < 1e-4
    assert shared.sum() > 500
    matrices = posed(**NOD)
    moved = head.skin(model.vertices, matrices)
    apart = np.linalg.norm(moved[nearest[shared]] - body.skin(matrices)[rows[shared]], axis=1)
    assert apart.max() < 2e-4


def test_triangles_of_the_neck_are_not_torn(head: AttachedHead) -> None:
    part = FaceModel.default().part("skin")
    model = FaceModel.default()
    still, moved = (head.skin(model.vertices, m)[: len(part.vertices)] for m in (posed(), posed(**NOD)))
    sides = np.concatenate([part.triangles[:, [0, 1]], part.triangles[:, [1, 2]]])
    sides = sides[~head.hidden[sides].any(axis=1)]
    before, after = (np.linalg.norm(at[sides[:, 0]] - at[sides[:, 1]], axis=1) for at in (still, moved))
    longer = after[before > 2e-3] / before[before > 2e-3]
    assert longer.max() < 3.0  # where the throat unfolds
    assert np.quantile(longer, 0.99) < 2.0
    assert longer.min() > 0.3


def test_the_face_itself_is_stiff(head: AttachedHead) -> None:
    """Everything above the mouth moves with the skull alone."""
    model = FaceModel.default()
    matrices = posed(**NOD)
    moved = head.skin(model.vertices, matrices)
    frame = head.frame(matrices)
    upper = model.vertices[:, 1] > model.points[point_rows()["8.1"]][1]
    upper &= model.vertices[:, 2] > model.points[point_rows()["10.7"]][2]
    expected = model.vertices[upper] @ frame[:3, :3].T + frame[:3, 3]
    np.testing.assert_allclose(moved[upper], expected, atol=3e-4)


def test_faps_turn_the_head_on_the_skull_base(head: AttachedHead) -> None:
    """FAP 48 to 50 are relative to the skull base: they come after (inside) what BAPs do to it."""
    model = FaceModel.default()
    deformer = Deformer(model)
    faps = np.zeros(68)
    faps[[47, 48, 49]] = [20000, -30000, 15000]
    turn = deformer.head_matrices(faps)
    matrices = posed(skullbase_torsion=35, vc5_tilt=15)
    turned = head.matrices(matrices, turn)
    skull = BodyModel.default().skeleton.number("skullbase")
    np.testing.assert_allclose(turned[skull, :3, :3], matrices[skull, :3, :3] @ turn[:3, :3], atol=1e-12)
    np.testing.assert_array_equal(np.delete(turned, skull, axis=0), np.delete(matrices, skull, axis=0))
    # the crown: first the FAPs, as the deformer does them, then the body
    frame = head.frame(matrices)
    crown = int(model.vertices[:, 1].argmax())
    expected = frame[:3, :3] @ deformer(faps)[crown] + frame[:3, 3]
    np.testing.assert_allclose(head.skin(deformer.local(faps), turned)[crown], expected, atol=1e-5)


def test_no_turn_leaves_the_joints(head: AttachedHead) -> None:
    matrices = posed(**NOD)
    np.testing.assert_array_equal(head.matrices(matrices, np.eye(4)), matrices)


def test_normals_turn_along(head: AttachedHead) -> None:
    model = FaceModel.default()
    normals = np.empty_like(model.vertices)
    head.skin(model.vertices, posed(**NOD), local_normals=model.normals, normals=normals)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-4)
    with pytest.raises(ValueError, match="normals need rest_normals"):
        head.skin(model.vertices, posed(), normals=normals)


def test_what_lies_under_the_clothes(head: AttachedHead) -> None:
    model = FaceModel.default()
    chin = model.points[point_rows()["2.1"]][1]
    hidden = head.hidden[: len(model.part("skin").vertices)]
    assert hidden.any()
    assert model.vertices[: len(hidden)][hidden][:, 1].max() < chin - 0.02


def test_another_face_is_sized_by_its_pupils() -> None:
    """In centimetres, and elsewhere."""
    model, body = FaceModel.default(), BodyModel.default()
    shift = np.array([5.0, -2.0, 1.0])
    other = attach_head(body, model.vertices * 100 + shift, pupils(model) * 100 + shift)
    assert other.place[0, 0] == pytest.approx(0.01, rel=1e-6)
    assert other.brings_neck
    found = other.place[:3, :3] @ (pupils(model)[0] * 100 + shift) + other.place[:3, 3]
    np.testing.assert_allclose(found, body.eyes[0], atol=1e-6)
    matrices = posed(**NOD)
    own = attach_head(body, model.vertices, pupils(model)).skin(model.vertices, matrices)
    scaled = (model.vertices * 100 + shift).astype(np.float32)
    np.testing.assert_allclose(other.skin(scaled, matrices), own, atol=1e-4)


def test_a_mask_brings_no_neck_and_is_stiff() -> None:
    model, body = FaceModel.default(), BodyModel.default()
    rows = np.flatnonzero(model.vertices[:, 1] > 0.0)
    mask = attach_head(body, model.vertices[rows], pupils(model))
    assert not mask.brings_neck
    assert not mask.hidden.any()
    np.testing.assert_array_equal(
        np.unique(mask.joints[mask.weights > 0]), [body.skeleton.number("skullbase")]
    )


def test_a_body_without_a_skull_base_or_neck() -> None:
    body = rod()
    model = FaceModel.default()
    head = attach_head(body, model.vertices, pupils(model))
    assert head.brings_neck
    assert set(np.unique(head.joints[head.weights > 0]).tolist()) == {2}  # the highest joint
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_euler("y", 20, degrees=True).as_matrix()
    assert head.skin(model.vertices, head.matrices(body.bind, turn)).shape == model.vertices.shape


def test_where_a_face_cannot_be_put() -> None:
    body = BodyModel.default()
    with pytest.raises(ModelError, match="has no pupils"):
        placement(replace(body, eyes=None), np.eye(3)[:2])
    for bad in (np.full((2, 3), np.nan), np.zeros((1, 3))):
        with pytest.raises(ModelError, match="needs the positions of both pupils"):
            placement(body, bad)
    with pytest.raises(ModelError, match="the same position"):
        placement(body, np.zeros((2, 3)))


def test_four_joints_of_many_fade_in_without_a_step() -> None:
    """As a fifth joint overtakes the fourth, neither jumps."""
    shares = np.linspace(0.10, 0.16, 61)
    dense = np.stack(
        [np.full(61, 0.3), np.full(61, 0.25), np.full(61, 0.2), np.full(61, 0.13), shares], axis=1
    )
    joints, weights = strongest_weights(dense / dense.sum(axis=1, keepdims=True))
    found = np.zeros((61, 5))
    for slot in range(4):
        np.add.at(found, (np.arange(61), joints[:, slot]), weights[:, slot])
    np.testing.assert_allclose(found.sum(axis=1), 1, atol=1e-6)
    assert np.abs(np.diff(found, axis=0)).max() < 0.01
