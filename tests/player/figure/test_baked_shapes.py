"""What is stored of the figures that come with the library is what would be computed."""

from __future__ import annotations

import numpy as np
import pytest

from fba import figures
from fba.compiled import is_compiled
from fba_player._figure._face_parts import cast_coarsely
from fba_player._figure.baked_shapes import load_baked, pack, unpack
from fba_player._figure.body_light import build_body_light
from fba_player._figure.face import build_figure
from fba_player._figure.face_light import unpack_light
from fba_player._figure.far_head import find_collapses
from fba_player._figure.person import body_shape

pytestmark = pytest.mark.skipif(not is_compiled(), reason="without numba all vertices count as free")
STALE = "the figures have changed: run python -m tools.figure.make_baked"


@pytest.mark.parametrize("name", figures.FIGURES)
def test_every_figure_has_its_file(name: str) -> None:
    assert load_baked(figures.face(name).parts), STALE
    assert load_baked(figures.body(name).parts), STALE


def test_the_light_on_the_head_is_as_computed() -> None:
    figure = build_figure(figures.face())
    stored = load_baked(figure.model.parts)
    light, computed = unpack_light(stored), figure.light.bake()
    for one, other in ((light.shut, computed.shut), (light.wide, computed.wide)):
        for kept, made in zip(one, other, strict=True):
            np.testing.assert_allclose(kept, made, atol=np.abs(made).max() / 120, err_msg=STALE)
    np.testing.assert_array_equal(light.near, computed.near)
    np.testing.assert_allclose(light.gaps, computed.gaps, rtol=1e-5)
    skin = figure.shapes["skin"]
    outer = cast_coarsely(skin, figure.model.part("skin"), {}).outer
    assert outer is not None
    assert len(outer) < len(skin.triangles) / 10
    np.testing.assert_array_equal(outer, stored["skin/outer"], err_msg=STALE)


@pytest.mark.parametrize("name", figures.FIGURES)
def test_far_heads_are_as_computed(name: str) -> None:
    figure = build_figure(figures.face(name))
    stored = load_baked(figure.model.parts)
    for part, shape in figure.shapes.items():
        if shape.levels:
            far = find_collapses(figure, figure.model.part(part), shape.levels[-1])
            np.testing.assert_array_equal(far, stored[f"{part}/far"], err_msg=STALE)


def test_the_body_is_as_computed() -> None:
    body = figures.body()
    stored, light = load_baked(body.parts), build_body_light(body)
    np.testing.assert_allclose(light.bake(), unpack(stored["values"], stored["step"])[:, 0], atol=0.01)
    for part in body.parts:
        levels = body_shape(part, len(body.skeleton), {}).coarser
        known = body_shape(part, len(body.skeleton), stored).coarser
        assert levels is not None
        assert known is not None
        assert known.known is not None, STALE
        for made, kept in zip(levels.collapses, known.collapses, strict=True):
            np.testing.assert_array_equal(made, kept, err_msg=STALE)


def test_another_shape_has_none() -> None:
    part = figures.face().parts[0]
    assert load_baked((part,)) == {}


def test_numbers_in_a_byte_are_within_half_a_step() -> None:
    values = np.random.default_rng(5).normal(size=(50, 3)).astype(np.float32)
    found = pack(values)
    assert found["values"].dtype == np.int8
    assert (np.abs(unpack(found["values"], found["step"]) - values) <= found["step"] * 0.501).all()
    assert unpack(**pack(np.zeros((0, 3), np.float32))).shape == (0, 3)
