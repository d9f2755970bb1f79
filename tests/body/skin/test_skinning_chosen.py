"""Some vertices of a body, or of a face on it, carried alone are carried as all of them are."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from fba.body import BapSolver
from fba.body.head_attachment import HeadOnBody
from fba.body.model import BodyModel
from fba.face.model import FaceModel, point_row


def joints(seed: int) -> npt.NDArray[np.float64]:
    baps = np.random.default_rng(seed).normal(0.0, 40000.0, 296)
    found: npt.NDArray[np.float64] = BapSolver(BodyModel.default().skeleton).pose(baps)
    return found


@pytest.mark.parametrize("method", ["dual", "linear"])
def test_places_in_any_order(method: str) -> None:
    body = BodyModel.default()
    rows = np.random.default_rng(1).permutation(len(body.vertices))[:700]
    some = body.skinner.chosen(rows)
    assert len(some._twists.rows) > 10  # some are wrung
    for seed in range(3):
        found = some.skin(joints(seed), method=method)
        np.testing.assert_array_equal(found, body.skin(joints(seed), method=method)[rows])


def test_normals_where_neighbours_are_among_them() -> None:
    body = BodyModel.default()
    wanted = np.random.default_rng(2).choice(len(body.vertices), 300, replace=False)
    rows = body.skinner.with_neighbours(wanted)
    assert np.isin(wanted, rows).all()
    assert (np.diff(rows) > 0).all()
    some = body.skinner.chosen(rows)
    whole, normals = np.empty_like(body.vertices), np.empty_like(body.vertices)
    found, upright = (np.empty((len(rows), 3), dtype=np.float32) for _ in range(2))
    body.skin(joints(4), whole, normals)
    some.skin(joints(4), found, upright)
    np.testing.assert_array_equal(found, whole[rows])
    np.testing.assert_array_equal(upright[np.searchsorted(rows, wanted)], normals[wanted])


def test_a_face() -> None:
    body, model = BodyModel.default(), FaceModel.default()
    head = HeadOnBody(body, model.vertices, model.points[[point_row("3.5"), point_row("3.6")]])
    rows = np.arange(3, len(model.vertices), 17)
    found = head.chosen(rows).skin(model.vertices[rows], joints(5))
    np.testing.assert_array_equal(found, head.skin(model.vertices, joints(5))[rows])
    assert len(head.skin(model.vertices, joints(5))) == len(model.vertices)  # as before


def test_motion_of_joints_at_rest_is_none() -> None:
    body = BodyModel.default()
    motion = body.skinner.motion(body.bind)
    still = np.tile([1.0, 0, 0, 0], (len(body.bind), 1))
    np.testing.assert_allclose(motion.duals[:, :4], still, atol=1e-6)
    shift = -0.5 * body.bind[0, :3, 3]  # of the root's own place
    np.testing.assert_allclose(motion.duals[:, 5:], np.tile(shift, (len(body.bind), 1)), atol=1e-6)
    np.testing.assert_allclose(motion.angles, 0, atol=1e-6)
    np.testing.assert_array_equal(motion.root, body.bind[0, :3, 3])


def test_tables_say_what_carries_each_vertex() -> None:
    body = BodyModel.default()
    tables = body.skinner.tables()
    np.testing.assert_allclose(tables.weights.sum(axis=1), 1, atol=1e-5)
    dense, given = (np.zeros((len(body.vertices), len(body.bind))) for _ in range(2))
    rows = np.arange(len(body.vertices))[:, None]
    np.add.at(dense, (rows, tables.joints), tables.weights)
    np.add.at(given, (rows, body.joints), body.weights)
    np.testing.assert_array_equal(dense, given)
    arms = np.flatnonzero(tables.wring[:, 0] >= 0)
    assert set(tables.wring[:, 0]) <= {-1.0, 0.0, 1.0, 2.0, 3.0}
    names = body.skeleton.names
    shoulders = np.abs(body.bind[[names.index("l_shoulder"), names.index("r_shoulder")], 0, 3]).min()
    assert (np.abs(body.vertices[arms, 0]) > 0.5 * shoulders).all()
