"""Faces that lack something, or are in other units, are shown all the same, and it is told."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fba.animation import Animation
from fba.errors import FbaWarning
from fba.face.deform._deformer import Deformer
from fba.face.feature_points import names
from fba.face.model import FaceModel, Part
from fba.parameters import point_rows
from fba.player import Offscreen, Scene
from fba_player._figure.model_units import prepare_model, resize
from fba_player.scene.scene import SWITCHES
from player_tracks import body_track, face_track
from small_face import small_face

NEEDED = ("3.1", "3.2", "3.3", "3.4", "3.5", "3.6", "9.15", "2.2", "8.3", "8.4")
"""Feature points without which a face has no units."""
ON = {"wireframe": True, "points": True, "influence": 3, "grid": True, "normals": True}


def animation(body: bool) -> Animation:
    faps = face_track([{3: 300, 23: 10000, 49: 20000}])
    return Animation(25, np.arange(1), faps, body_track([{32: 40000}]) if body else None)  # type: ignore[arg-type]


def few_points() -> FaceModel:
    model = small_face()
    points, bound = model.points.copy(), model.bound.copy()
    for row, name in enumerate(names()):
        if name not in NEEDED:
            points[row], bound[row] = np.nan, -1
    return replace(model, points=points, bound=bound)


def with_an_empty_part() -> FaceModel:
    model = small_face()
    empty = Part("nothing", "other", np.zeros((3, 3), np.float32), np.zeros((0, 3), np.int32))
    return replace(model, parts=(*model.parts, empty))


FACES = {
    "one part": (lambda: small_face("skin"), "no eyes and no teeth"),
    "few points": (few_points, "no teeth"),
    "an empty part": (with_an_empty_part, "no teeth"),
    "no tables": (lambda: replace(small_face(), tables=()), "no FaceDefTables"),
    "millimetres": (lambda: small_face(scale=1000.0), "other units than metres: 62.4"),
    "kilometres": (lambda: small_face(scale=1e-3), "other units than metres: 6.24e-05"),
}


@pytest.mark.usefixtures("opengl")
@pytest.mark.parametrize("body", [False, True], ids=["alone", "on a body"])
@pytest.mark.parametrize("name", list(FACES))
def test_odd_faces_are_shown_with_a_warning(name: str, body: bool) -> None:
    make, said = FACES[name]
    with pytest.warns(FbaWarning) as told:
        scene = Scene(animation(body), make())
    assert any(said in str(one.message) for one in told), [str(one.message) for one in told]
    assert {one.filename for one in told} == {__file__}
    with Offscreen(scene, (64, 48), "front") as offscreen:
        plain = offscreen.frame(0.0).astype(int)
        assert np.ptp(plain[20:28, 28:36, :3]) > 0
        assert np.abs(plain[24, 32, :3] - plain[2, 2, :3]).max() > 20  # something stands in the middle
        for view in ("figure", "points"):
            scene.view = view
            for switch, value in ON.items():
                scene.show(switch, value)
            full = offscreen.frame(0.0)
            for skeleton in ("through", "only"):
                scene.show("skeleton", skeleton)
                assert offscreen.frame(0.0).shape == full.shape
            for switch in scene.switches.changed:
                scene.show(switch, SWITCHES[switch].default)
        with offscreen._gl:
            assert offscreen._gl.error == "GL_NO_ERROR"


def test_a_whole_face_is_taken_as_it_is() -> None:
    model = FaceModel.default()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert prepare_model(model) is model


def test_a_face_of_skin_alone_from_a_file(tmp_path: Path) -> None:
    small_face("skin").save(tmp_path / "egg.glb")
    with pytest.warns(FbaWarning, match="no eyes and no teeth"):
        scene = Scene(animation(False), FaceModel.load(tmp_path / "egg.glb"))
    view = scene.view_at(0.0)
    assert (len(view.faces), view.eyes) == (1, [])


@pytest.mark.parametrize("factor", [1000.0, 1e-3])
def test_sizes_change_nothing_that_faps_do(factor: float) -> None:
    model = FaceModel.default()
    vector = np.zeros(68, dtype=np.float32)
    for number, value in {3: 300, 23: 20000, 29: 100, 31: 200, 47: 20000, 48: 10000, 49: 20000}.items():
        vector[number - 1] = value
    other = resize(resize(model, factor), 1 / factor)
    grown = resize(model, factor)
    assert pytest.approx(model.fapu.ES * factor) == grown.fapu.ES
    expected = Deformer(model)(vector)
    np.testing.assert_allclose(Deformer(grown)(vector) / factor, expected, atol=2e-6)
    np.testing.assert_allclose(Deformer(other)(vector), expected, atol=2e-6)
    np.testing.assert_allclose(grown.points[point_rows()["2.1"]], model.points[point_rows()["2.1"]] * factor)
