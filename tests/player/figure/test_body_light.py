"""The light on a body: what folds leave of it, and the limbs that keep it off."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from fba.body import BapSolver, BodyModel
from fba_player._figure.body_light import UNOBSTRUCTED_LIGHT, build_body_light
from fba_player.view._view import MOST_LIMBS


@pytest.fixture(scope="module")
def standing() -> npt.NDArray[np.float64]:
    return BapSolver(BodyModel.default().skeleton).pose(np.zeros(296))


def test_folds_leave_a_share_of_the_light_and_limbs_are_those_of_the_pose(
    standing: npt.NDArray[np.float64],
) -> None:
    body = BodyModel.default()
    light = build_body_light(body)
    assert (light.light >= 0).all()
    assert (light.light <= np.array(UNOBSTRUCTED_LIGHT, dtype=np.float32) + 1e-6).all()
    limbs = light.limbs(standing).reshape(-1, 2, 4)
    assert len(limbs) == MOST_LIMBS
    names = list(body.skeleton.names)
    elbow = standing[names.index("l_elbow"), :3, 3]
    assert (np.abs(limbs[:, :, :3] - elbow).max(axis=2) < 1e-6).any(axis=1).sum() == 2  # both of its bones
    np.testing.assert_array_equal(limbs[:, 0, 3], limbs[:, 1, 3])
