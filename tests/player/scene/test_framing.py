"""Where a moving body takes place: what a camera has to have in view, and when it follows."""

import numpy as np
import numpy.typing as npt
import pytest

from fba_player.scene.scene import body_extent
from fba_player.view._camera import Camera

NAMES = ("HumanoidRoot", "l_knee", "r_knee", "l_ankle", "r_ankle", "skullbase", "l_wrist")
STANDING = np.array([
    [0.0, 0.97, 0.0], [0.1, 0.5, 0.0], [-0.1, 0.5, 0.0], [0.1, 0.08, 0.0], [-0.1, 0.08, 0.0],
    [0.0, 1.6, 0.0], [0.6, 1.0, 0.1],
])  # fmt: skip


def moved(*changes: dict[str, tuple[float, float, float]]) -> npt.NDArray[np.float64]:
    """(T, J, 3): by how much joints have moved in each moment; "all" for all."""
    found = []
    for change in changes:
        places = STANDING.copy()
        for name, by in change.items():
            places[slice(None) if name == "all" else NAMES.index(name)] += by
        found.append(places)
    return np.array(found)


def test_all_joints_are_in_view_with_room_around() -> None:
    places = moved({}, {"l_wrist": (0.2, 0.9, 0.0)})
    extent = body_extent(places, NAMES)
    subject = extent.subject
    assert not extent.follows
    assert not extent.legs_move
    top, bottom = (subject.centre[1] + sign * subject.half_height for sign in (1, -1))
    assert top > places[..., 1].max() + 0.1  # a head above its joint
    assert bottom < 0.0  # the floor
    assert subject.half_width > 0.4


def test_the_camera_stands_before_who_stands_elsewhere() -> None:
    extent = body_extent(moved({"all": (3.0, 0.0, -2.0)}), NAMES)
    assert extent.subject.centre[0] == pytest.approx(3.0, abs=0.3)
    assert extent.subject.centre[2] == pytest.approx(-2.0, abs=0.3)
    assert extent.subject.centre[1] - extent.subject.half_height < 0.0


def test_legs_that_step_move() -> None:
    assert body_extent(moved({}, {"l_ankle": (0.0, 0.1, 0.2)}), NAMES).legs_move
    assert not body_extent(moved({}, {"l_ankle": (0.0, 0.02, 0.05)}), NAMES).legs_move
    assert not body_extent(moved({}, {"l_wrist": (0.0, 0.5, 0.0)}), NAMES).legs_move
    without = [NAMES.index(name) for name in ("HumanoidRoot", "skullbase", "l_wrist")]
    some = body_extent(
        moved({}, {"all": (0.5, 0.0, 0.0)})[:, without], ("HumanoidRoot", "skullbase", "l_wrist")
    )
    assert not some.legs_move


@pytest.mark.parametrize("away", [(5.0, 0.0, 0.0), (0.0, 0.0, -40.0), (0.0, np.nan, 0.0), (0.0, np.inf, 0.0)])
def test_a_far_walk_is_followed_from_its_start(away: tuple[float, float, float]) -> None:
    extent = body_extent(moved({}, {"all": away}), NAMES)
    assert extent.follows
    np.testing.assert_allclose(extent.subject.centre, (0.0, 0.88, 0.0))
    assert extent.subject.half_height == pytest.approx(0.98)


def test_a_walker_with_a_large_head_is_fully_in_view() -> None:
    """A head that reaches 0.9 m over its joint, which rises by 0.1 m: 2.6 m, and the floor as ever."""
    places = moved({}, {"all": (5.0, 0.0, 0.0)}, {"skullbase": (0.0, 0.1, 0.0)})
    subject = body_extent(places, NAMES, headroom=0.9).subject
    assert subject.centre[1] + subject.half_height == pytest.approx(2.6)
    assert subject.centre[1] - subject.half_height == pytest.approx(-0.1)


def test_the_upper_half_ends_at_the_hips() -> None:
    extent = body_extent(moved({}), NAMES)
    upper = extent.upper_half
    assert upper.centre[1] + upper.half_height == pytest.approx(
        extent.subject.centre[1] + extent.subject.half_height
    )
    assert upper.centre[1] - upper.half_height == pytest.approx(0.78)
    assert upper.half_width <= 0.55


@pytest.mark.parametrize(("preset", "towards"), [("front", (0.0, 0.0, 1.6)), ("profile", (1.6, 0.0, 0.0))])
def test_a_figure_that_comes_nearer_stays_in_view(preset: str, towards: tuple[float, float, float]) -> None:
    """Worked out by rays: joints seen from the camera lie within its opening."""
    places = moved({}, {"all": towards})
    camera = Camera.preset(preset, body_extent(places, NAMES).subject, aspect=16 / 9)
    direction = np.array([0.0, 0.0, 1.0] if preset == "front" else [1.0, 0.0, 0.0])
    eye = np.array(camera.target) + camera.distance * direction
    seen = places.reshape(-1, 3) - eye
    steep = np.abs(seen[:, 1]) / (seen @ -direction)
    assert steep.max() < np.tan(np.radians(camera.field_of_view) / 2)
