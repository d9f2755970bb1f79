"""Which way is up, of people in all postures, in files of all axes; nobody is stood up who lies."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from fba.body import BapSolver, Skeleton
from fba.capture import from_skeleton
from fba.capture.comparison import find_up
from fba.capture.preparation import prepare
from fba.errors import FbaWarning
from postures import POSTURES, UPS, along_x, turned, turned_by_the_root

SKELETON = Skeleton.default()
UPRIGHT = {"walks", "climbs", "sits", "dances"}
TRUNKS = {"walks": 1.0, "lies": 0.0, "lies_on_a_side": 0.0, "rolls": 0.0, "crawls": 0.0, "swims": 0.0,
          "flies": 0.0, "walks_on_hands": -1.0, "stands_on_hands": -1.0, "climbs": 1.0, "sits": 1.0,
          "spins_on_the_back": 0.17}  # fmt: skip
"""Sine of the trunk's angle above the ground, in all frames: as the generator turns the hips."""


@pytest.mark.parametrize("up", UPS)
@pytest.mark.parametrize("posture", POSTURES)
def test_a_file_with_other_axes_is_trusted(posture: str, up: str) -> None:
    """Its rest pose stands along them. Somebody who stands, crawls or turns leaves no doubt."""
    made = turned(POSTURES[posture](), UPS[up])
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert prepare(made, SKELETON).up == up
    assert posture not in UPRIGHT or not caught
    assert all("if another axis points up, say which with up=" in str(each.message) for each in caught)


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
@pytest.mark.parametrize("posture", TRUNKS)
def test_people_are_shown_as_they_lie(posture: str) -> None:
    """The trunk of the person shown leans as the source's."""
    animation = from_skeleton(turned(POSTURES[posture](), UPS["+z"]), plant=False)
    matrices = BapSolver().pose(animation.body.values)
    number = SKELETON.number
    trunk = matrices[:, number("vt1"), :3, 3] - matrices[:, number("vl5"), :3, 3]
    height = trunk[:, 1] / np.linalg.norm(trunk, axis=1)
    assert np.abs(height - TRUNKS[posture]).max() < 0.17  # the spine of the person shown is bent


@pytest.mark.parametrize("posture", POSTURES)
def test_the_axis_of_the_format_needs_no_warning(posture: str) -> None:
    """As in glTF, where up is +y."""
    for up, world in UPS.items():
        made = replace(turned(POSTURES[posture](), world), up=up)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            ready = prepare(made, SKELETON)
        assert ready.up == up
        np.testing.assert_allclose(find_up(made, ready.mapped)[1], world.apply([0, 1, 0]), atol=1e-9)


@pytest.mark.parametrize("up", [up for up in UPS if up != "+y"])
def test_a_floor_overrules_the_rest_pose_with_a_warning(up: str) -> None:
    """The rest pose stands along y, but the root turns whoever walks upright along another axis."""
    made = turned_by_the_root(POSTURES["walks"](), UPS[up])
    with pytest.warns(FbaWarning, match=rf"up is taken to be \{up}: people stand along it.*up='\+y'"):
        assert prepare(made, SKELETON).up == up
    assert prepare(made, SKELETON, up="+y").up == "+y"


@pytest.mark.parametrize("up", ["+z", "+x", "-y", "-z"])
@pytest.mark.parametrize("posture", ["sits", "dances"])
def test_a_rest_pose_that_may_be_wrong_is_doubted(posture: str, up: str) -> None:
    """The root alone turns people up, and somebody may lie along the axis of the rest pose."""
    made = turned_by_the_root(POSTURES[posture](), UPS[up])
    with pytest.warns(FbaWarning, match="up is taken to be"):
        prepare(made, SKELETON)


@pytest.mark.parametrize(
    ("posture", "up", "said"),
    [
        ("walks", "+y", False), ("walks", "+z", False), ("walks", "-y", False), ("walks", "-z", False),
        ("sits", "+y", False), ("sits", "+z", False), ("dances", "+y", False), ("climbs", "+y", False),
        ("crawls", "+y", True), ("crawls", "+z", True), ("walks_on_hands", "+y", True),
        ("walks_on_hands", "+z", True), ("falls", "+y", True), ("lies_on_a_side", "+y", True),
    ],
)  # fmt: skip
def test_without_a_rest_pose_the_floor_decides(posture: str, up: str, said: bool) -> None:
    """All bones lie along x at rest."""
    made = along_x(turned(POSTURES[posture](), UPS[up]))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert prepare(made, SKELETON).up == up
    assert bool(caught) == said
