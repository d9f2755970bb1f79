"""The default skeleton, and skeletons that must be refused."""

from __future__ import annotations

import numpy as np
import pytest

from fba.body import Skeleton
from fba.errors import ModelError


def test_default_body_stands_on_its_feet() -> None:
    body = Skeleton.default()
    assert len(body) == 87
    assert body.names[0] == "HumanoidRoot"
    assert body.parents[0] == -1
    assert (body.parents[1:] < np.arange(1, 87)).all()
    left, right = body.centres[body.number("l_wrist")], body.centres[body.number("r_wrist")]
    assert left[0] > 0  # +x is the subject's left
    np.testing.assert_allclose(left * [-1, 1, 1], right)
    toe, ankle = body.centres[body.number("l_metatarsal")], body.centres[body.number("l_ankle")]
    assert toe[2] > ankle[2]  # +z is forward
    assert toe[1] < ankle[1] < body.centres[body.number("l_knee")][1] < body.centres[body.number("l_hip")][1]


@pytest.mark.parametrize(
    ("joint", "parent"),
    [
        ("l_hip", "sacroiliac"),
        ("vl5", "HumanoidRoot"),
        ("l_sternoclavicular", "vt1"),
        ("l_index0", "l_wrist"),
    ],
)
def test_hierarchy(joint: str, parent: str) -> None:
    body = Skeleton.default()
    assert body.names[body.parents[body.number(joint)]] == parent


def test_from_parents_takes_any_order() -> None:
    body = Skeleton.from_parents(
        {"b": "a", "HumanoidRoot": None, "a": "HumanoidRoot"},
        {"HumanoidRoot": (0, 1, 0), "a": (0, 2, 0), "b": (0, 4, 0)},
    )
    assert body.names == ("HumanoidRoot", "a", "b")
    np.testing.assert_allclose(body.offsets, [[0, 1, 0], [0, 1, 0], [0, 2, 0]])


@pytest.mark.parametrize(
    ("parents", "text"),
    [
        ({"r": None, "a": "b", "b": "a"}, "cycle"),
        ({"r": None, "a": "gone"}, "'gone'"),
        ({"r": None, "s": None}, "one root"),
        ({}, "joints"),
    ],
)
def test_impossible_hierarchies(parents: dict[str, str | None], text: str) -> None:
    with pytest.raises(ModelError, match=text):
        Skeleton.from_parents(parents, dict.fromkeys(parents, (0.0, 0.0, 0.0)))


def test_centres_must_be_finite_and_names_unique() -> None:
    with pytest.raises(ModelError, match="finite"):
        Skeleton(("r",), np.array([-1]), np.array([[0.0, np.nan, 0.0]]))
    with pytest.raises(ModelError, match="unique"):
        Skeleton(("r", "r"), np.array([-1, 0]), np.zeros((2, 3)))
    with pytest.raises(ModelError, match="root"):
        Skeleton(("r", "s"), np.array([1, 0]), np.zeros((2, 3)))
