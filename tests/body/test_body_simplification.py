"""Simplified bodies: skin weights are carried along, and joints move what is left."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fba.body import BapSolver, BodyModel
from fba.body.simplification import BENT, simplify_body
from fba.compiled import is_compiled
from fba.errors import ModelError
from fba.parameters import bap_numbers

pytestmark = pytest.mark.skipif(not is_compiled(), reason="too slow without numba")


@pytest.fixture(scope="module")
def small() -> BodyModel:
    body = BodyModel.default()
    return simplify_body(body, len(body.triangles) // 4)


def test_everything_is_carried(small: BodyModel) -> None:
    full = BodyModel.default()
    assert len(small.triangles) <= len(full.triangles) / 4
    assert [part.name for part in small.parts] == [part.name for part in full.parts]
    for before, after in zip(full.parts, small.parts, strict=True):
        np.testing.assert_allclose(after.weights.sum(axis=1), 1, atol=1e-6)
        assert set(np.unique(after.joints[after.weights > 0])) <= set(np.unique(before.joints))
        assert (after.normals is None) == (before.normals is None)
        assert after.material == before.material


def test_a_bent_body_stays_near_the_full_one(small: BodyModel) -> None:
    full = BodyModel.default()
    baps = np.zeros(296)
    for name, value in BENT.items():
        baps[bap_numbers()[name] - 1] = 0.8 * value
    joints = BapSolver(full.skeleton).pose(baps)
    bent = full.skin(joints)
    assert np.linalg.norm(bent - full.vertices, axis=1).max() > 0.3
    off = cKDTree(bent).query(small.skin(joints))[0]
    assert np.percentile(off, 99) < 0.015
    assert off.mean() < 0.005


def test_a_vertex_that_stays_keeps_its_weights() -> None:
    body = BodyModel.default()
    same = simplify_body(body, len(body.triangles) - 10)
    for before, after in zip(body.parts, same.parts, strict=True):
        away, near = cKDTree(before.vertices).query(after.vertices)
        dense = [np.zeros((len(after.vertices), len(body.skeleton))) for _ in range(2)]
        for array, joints, weights in (
            (dense[0], before.joints[near], before.weights[near]), (dense[1], after.joints, after.weights)
        ):  # fmt: skip
            np.add.at(array, (np.arange(len(array))[:, None], joints), weights)
        stays = away < 1e-7
        assert stays.mean() > 0.9
        assert np.percentile(np.abs(dense[0] - dense[1])[stays].max(axis=1), 99) < 1e-5


def test_what_cannot_be_simplified_is_refused() -> None:
    body = BodyModel.default()
    with pytest.raises(ModelError, match="too few for a body of"):
        simplify_body(body, 1)
    bare = replace(body.parts[0], triangles=np.zeros((0, 3), np.int32))
    with pytest.raises(ModelError, match="has no triangles"):
        simplify_body(replace(body, parts=(bare, *body.parts[1:])), 1000)
