"""Decision constants and rules of capture: each has a test here that dies with it (see tools/mutate.py)."""

from __future__ import annotations

import pytest

from fba.capture import matching
from fba.errors import ModelError

NAMES = ["HumanoidRoot", "l_hip", "l_knee", "r_hip", "r_knee"]


def test_five_names_make_a_family() -> None:
    family, mapped = matching.match(NAMES)
    assert family == "h-anim"
    assert mapped == {name: number for number, name in enumerate(NAMES)}
    with pytest.raises(ModelError, match="no known skeleton family"):
        matching.match(NAMES[:4])


def test_of_two_joints_with_one_name_the_first_counts() -> None:
    assert matching.match([*NAMES, "l_hip"])[1]["l_hip"] == 1


def test_a_prefix_of_half_of_the_names_is_left_out() -> None:
    others = [f"zz{letter}" for letter in "abcde"]
    _, mapped = matching.match([*(f"Bob_{name}" for name in NAMES), *others])
    assert mapped == {name: number for number, name in enumerate(NAMES)}
