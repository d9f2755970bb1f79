"""Skin beside the mouth slides over the teeth where the corners of the mouth move inwards."""

from dataclasses import replace

import numpy as np
import pytest

from fba.face.authoring import author
from fba.face.checks._fap_checks import check_posed
from fba.face.checks._posing import Poser
from fba.face.importers.assembly._teeth_clearance import STRETCH, clear_teeth
from fba.face.model import FaceModel, Part
from small_head import small_head


def rows(shift: float) -> Part:
    """A half round row of teeth, 4.6 cm wide and 3 cm high, as far behind the lips as a shift."""
    turn = np.linspace(0, np.pi, 25)
    line = np.stack([0.023 * np.cos(turn), np.zeros(25), 0.035 * np.sin(turn)], axis=1)
    low, high = line + np.array((0, -0.085, shift)), line + np.array((0, -0.055, shift))
    k = np.arange(24)
    triangles = np.concatenate([np.c_[k, k + 25, k + 1], np.c_[k + 1, k + 25, k + 26]])
    return Part("upper teeth", "teeth", np.concatenate([low, high]), triangles)


def depth_of_row(x: np.ndarray, shift: float) -> np.ndarray:
    return 0.035 * np.sqrt(np.maximum(1 - (x / 0.023) ** 2, 0)) + shift


@pytest.fixture(scope="module")
def heads() -> tuple[FaceModel, FaceModel, float]:
    """A head before and after, and where its teeth are: 1 mm behind the skin in front of them."""
    head = small_head(cell=0.005)
    parts = tuple(part for part in head.parts if part.kind not in ("teeth", "tongue"))
    skin = head.part("skin").vertices
    near = (np.abs(skin[:, 0]) < 0.0225) & (skin[:, 1] > -0.085) & (skin[:, 1] < -0.055)
    shift = float((skin[near, 2] - depth_of_row(skin[near, 0], 0.0)).min()) - 0.001
    bound = np.where(head.bound < sum(len(part.vertices) for part in parts), head.bound, -1)
    base = author((*parts, rows(shift)), head.points, bound=bound)
    return base, clear_teeth(base), shift


def through_the_teeth(model: FaceModel, shift: float, value: float) -> float:
    """Metres by which skin is behind the front of the teeth, at the vertices and between them."""
    moved = Poser(model).pose(dict.fromkeys(STRETCH, value))
    skin = moved[model.starts["skin"] :][: len(model.part("skin").vertices)]
    triangles = model.part("skin").triangles
    points = np.concatenate([skin, skin[triangles].mean(axis=1)])
    beside = (points[:, 1] > -0.083) & (points[:, 1] < -0.057) & (np.abs(points[:, 0]) < 0.0225)
    return float((depth_of_row(points[beside, 0], shift) - points[beside, 2]).max())


def test_skin_stays_in_front_of_the_teeth(heads: tuple[FaceModel, FaceModel, float]) -> None:
    base, cleared, shift = heads
    assert through_the_teeth(base, shift, 0.0) < -0.0005
    for value in (-140.0, -250.0):
        assert through_the_teeth(base, shift, value) > 0.0015
        assert through_the_teeth(cleared, shift, value) < 0.0006, value


def test_corners_move_as_far_sideways_as_before(heads: tuple[FaceModel, FaceModel, float]) -> None:
    base, cleared, _ = heads
    for value in (-300.0, -100.0, -10.0, 200.0):
        before, after = (Poser(model).shift(dict.fromkeys(STRETCH, value)) for model in (base, cleared))
        np.testing.assert_allclose(after[:, :2], before[:, :2], atol=2e-7)
        if value > -20:
            np.testing.assert_allclose(after, before, atol=2e-7)
        else:
            assert (after[:, 2] > before[:, 2] - 1e-7).all()


def test_both_sides_come_forward_alike(heads: tuple[FaceModel, FaceModel, float]) -> None:
    _, cleared, _ = heads
    poser = Poser(cleared)
    left = poser.shift({6: -200, 53: -200})[poser.vertex("2.4")]
    right = poser.shift({7: -200, 54: -200})[poser.vertex("2.5")]
    np.testing.assert_allclose(left * (-1, 1, 1), right, atol=1.5e-3)
    assert left[2] > 0.002


def test_no_triangle_turns_over(heads: tuple[FaceModel, FaceModel, float]) -> None:
    base, cleared, _ = heads
    found = [
        sum(finding.severity == "error" for finding in check_posed(Poser(model), STRETCH))
        for model in (base, cleared)
    ]
    assert found[1] <= found[0]


def test_heads_without_teeth_stay_as_they_are(heads: tuple[FaceModel, FaceModel, float]) -> None:
    base, _, _ = heads
    parts = tuple(replace(part, kind="mouth") if part.kind == "teeth" else part for part in base.parts)
    without = replace(base, parts=parts)
    assert clear_teeth(without) is without
