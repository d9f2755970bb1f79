"""The comparison that the reference pictures are held to: what it passes, and what it does not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from picture_difference import ciede2000, difference, lab, laid_on_chequers
from reference_cases import Case, Drawer, cases

UInt8 = npt.NDArray[np.uint8]

# Sharma, Wu, Dalal: "The CIEDE2000 color-difference formula", 2005, table 1.
PAIRS = [
    ((50.0, 2.6772, -79.7751), (50.0, 0.0, -82.7485), 2.0425),
    ((50.0, 0.0, 0.0), (50.0, -1.0, 2.0), 2.3669),
    ((50.0, 2.49, -0.001), (50.0, -2.49, 0.0009), 7.1792),
    ((50.0, 2.5, 0.0), (73.0, 25.0, -18.0), 27.1492),
    ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644),
    ((2.0776, 0.0795, -1.1350), (0.9033, -0.0636, -0.5514), 0.9082),
]


@pytest.mark.parametrize(("one", "other", "expected"), PAIRS)
def test_published_colour_differences(one: Any, other: Any, expected: float) -> None:
    assert ciede2000(np.array(one), np.array(other)) == pytest.approx(expected, abs=1e-4)
    assert ciede2000(np.array(other), np.array(one)) == pytest.approx(expected, abs=1e-4)


def test_white_and_a_primary() -> None:
    np.testing.assert_allclose(lab(np.ones(3)), [100, 0, 0], atol=1e-3)
    np.testing.assert_allclose(lab(np.array([1.0, 0, 0])), [53.24, 80.09, 67.20], atol=0.01)  # sRGB red


def test_what_is_transparent_is_laid_on_a_board() -> None:
    clear = np.zeros((12, 12, 4), dtype=np.uint8)
    board = laid_on_chequers(clear)
    assert set(np.unique(board)) == {0.45, 0.75}
    clear[..., 3] = 255
    assert laid_on_chequers(clear).max() == 0


def test_sizes_must_agree() -> None:
    with pytest.raises(ValueError, match=r"\(4, 3\)"):
        difference(np.zeros((3, 4, 3), dtype=np.uint8), np.zeros((4, 3, 3), dtype=np.uint8))


@pytest.fixture(scope="module")
def draw(opengl: None) -> Iterator[Drawer]:
    with Drawer() as drawer:
        yield drawer


@pytest.mark.usefixtures("opengl")
class TestOfPictures:
    @pytest.mark.parametrize("name", ["neutral_front", "body_standing", "points_face", "switch_wireframe"])
    def test_another_driver_passes(self, draw: Drawer, name: str) -> None:
        case = cases()[name]
        drawn = draw(case)
        assert difference(drawn, drawn).mean == 0
        rng = np.random.default_rng(4)
        noisy = np.clip(drawn.astype(int) + rng.integers(-1, 2, drawn.shape), 0, 255).astype(np.uint8)
        assert difference(drawn, noisy).alike
        shifted = draw(case, moved=(0.05, 0.03))
        assert difference(drawn, shifted).mean > 0
        assert difference(drawn, shifted).alike

    @pytest.mark.parametrize(
        ("name", "other"),
        [
            ("neutral_front", {"switches": ("eyes=off",)}),
            ("fap_eyes", {"switches": ("hair=off",)}),
            ("neutral_front", {"switches": ("shadows=off",)}),
            ("neutral_front", {"faps": ("close_t_l_eyelid=420",)}),
            ("neutral_front", {"faps": ("head_yaw=2500",)}),
            ("neutral_front", {"faps": ("open_jaw=300",)}),
            ("fap_eyes", {"faps": ("yaw_l_eyeball=25000", "yaw_r_eyeball=15000")}),
            ("viseme_10", {"visemes": ("9",)}),
            ("expression_joy", {"expressions": ("sadness=63",)}),
            ("body_standing", {"baps": ("r_elbow_flexion=15000",)}),
            ("switch_influence", {"switches": ("influence=18",)}),
            ("points_face", {"faps": ()}),
        ],
    )
    def test_wrong_pictures_are_recognised(self, draw: Drawer, name: str, other: dict[str, Any]) -> None:
        case: Case = cases()[name]
        found = difference(draw(case), draw(replace(case, **other)))
        assert not found.alike, str(found)

    @pytest.mark.parametrize("name", ["neutral_front", "body_standing", "fap_eyes"])
    @pytest.mark.parametrize("factor", [0.97, 1.03])
    def test_light_that_is_off_is_seen(self, draw: Drawer, name: str, factor: float) -> None:
        drawn = draw(cases()[name])
        third = slice(drawn.shape[0] // 3, drawn.shape[0] * 2 // 3)
        light = (drawn[third, :, :3] / 255) ** 2.2 * factor
        brighter = drawn.copy()
        brighter[third, :, :3] = np.clip(np.round(255 * light ** (1 / 2.2)), 0, 255)
        found = difference(drawn, brighter)
        assert not found.alike, str(found)

    def test_one_missing_eye_is_seen(self, draw: Drawer) -> None:
        case = cases()["neutral_front"]
        scene = case.scene()
        whole = draw(case, scene)
        view = scene.view_at(0.0)
        scene.view_at = lambda time, seen=None: replace(view, eyes=view.eyes[:1])  # type: ignore[method-assign]
        found = difference(whole, draw(case, scene))
        assert not found.alike, str(found)
