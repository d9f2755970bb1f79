"""The coarsest level of detail of heads on bodies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fba.compiled import is_compiled
from fba.face import FaceModel
from fba_player._figure.baked_shapes import load_baked
from fba_player._figure.face import FaceFigure, build_figure
from fba_player._figure.far_head import ERROR, add_far_level

pytestmark = pytest.mark.skipif(not is_compiled(), reason="no levels of detail without numba")


@pytest.fixture(scope="module")
def figure() -> FaceFigure:
    return build_figure(FaceModel.default())


@pytest.mark.parametrize("stored", [True, False])
def test_it_has_half_the_triangles_of_the_one_before(figure: FaceFigure, stored: bool) -> None:
    baked = load_baked(figure.model.parts) if stored else {}
    part, shape = figure.model.part("skin"), figure.shapes["skin"]
    *before, last, far = add_far_level(figure, part, shape, baked).levels
    assert [*before, last] == list(shape.levels)
    assert len(far.shape.triangles) < 0.6 * len(last.shape.triangles)
    assert far.shape.triangles.max() + 1 == len(far.rows) == len(far.shape.sway) == len(far.shape.colours)
    assert far.parents.shape == last.parents.shape
    np.testing.assert_array_equal(np.unique(far.parents), np.arange(len(far.rows)))
    kept = last.parents[far.first]  # the vertices that are left are some of those before
    np.testing.assert_array_equal(far.shape.sway[far.parents[far.first]], far.shape.sway)
    assert len(np.unique(kept)) == len(far.rows)
    assert last.error < far.error == ERROR


def test_what_is_stored_for_another_level_is_not_used(figure: FaceFigure) -> None:
    part, shape = figure.model.part("skin"), figure.shapes["skin"]
    good = add_far_level(figure, part, shape, {}).levels[-1]
    for wrong in (np.zeros(3, dtype=np.uint16), np.full(len(shape.levels[-1].rows), 60000, dtype=np.uint16)):
        found = add_far_level(figure, part, shape, {"skin/far": wrong}).levels[-1]
        np.testing.assert_array_equal(found.shape.triangles, good.shape.triangles)


def test_coarser_levels_and_none_stay(figure: FaceFigure) -> None:
    part, shape = figure.model.part("skin"), figure.shapes["skin"]
    coarse = replace(shape, levels=(replace(shape.levels[0], error=0.01),))
    plain = replace(shape, levels=())
    assert add_far_level(figure, part, coarse, {}) is coarse
    assert add_far_level(figure, part, plain, {}) is plain
