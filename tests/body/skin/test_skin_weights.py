"""Rules by which dense weights become those of at most four joints."""

from __future__ import annotations

import numpy as np
import pytest

from fba.body.skin import skin_weights
from fba.errors import ModelError


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
