"""Wrinkles: which motions bring them out, where they lie on a face, and that the picture shows them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from fba.animation import Animation
from fba.arrays import Float32
from fba.errors import ModelError
from fba.face.model import FaceModel
from fba.parameters import point_rows
from fba.player import Offscreen, Scene
from fba_player._figure.face import build_figure
from fba_player._figure.wrinkles import MAP_POINTS, MIRRORED, place_wrinkles, wrinkle_strengths
from fba_player._mesh.wrinkle_map import BOTTOM, PLAIN, SHAPE, TEXELS, TOP, WIDTH, WRINKLES, wrinkle_map
from player_tracks import face_track

JOY, ANGER, FEAR, SURPRISE = 1, 3, 4, 6


def strengths(faps: dict[int, float]) -> dict[str, tuple[float, float]]:
    """Left and right strength of each wrinkle."""
    values = np.zeros(68, dtype=np.float32)
    for number, value in faps.items():
        values[number - 1] = value
    return _named(values)


def expression(number: int, share: float) -> dict[str, tuple[float, float]]:
    full = FaceModel.default().definitions.expressions[number]
    return _named((full * share).astype(np.float32))


def _named(values: Float32) -> dict[str, tuple[float, float]]:
    left, right = wrinkle_strengths(values)
    return {name: (float(left[k]), float(right[k])) for k, name in enumerate(WRINKLES)}


class TestStrengths:
    def test_a_frown_wrinkles_above_half_anger_only(self) -> None:
        assert expression(ANGER, 0.5)["frown"] == (0.0, 0.0)
        assert min(expression(ANGER, 0.6)["frown"]) > 0.02
        assert min(expression(ANGER, 1.0)["frown"]) > 0.9
        assert expression(ANGER, 1.0)["forehead"] == (0.0, 0.0)

    def test_raised_brows_wrinkle_the_forehead(self) -> None:
        assert min(expression(SURPRISE, 1.0)["forehead"]) > 0.9
        assert min(expression(FEAR, 1.0)["forehead"]) > 0.9
        assert 0 < expression(FEAR, 1.0)["frown"][0] < 1  # drawn together as well

    def test_only_a_real_smile_wrinkles_the_corners_of_the_eyes(self) -> None:
        lips = {12: 400, 13: 400, 59: 400, 60: 400, 6: 130, 7: 130}
        assert strengths(lips)["eye corner"] == (0.0, 0.0)
        assert min(strengths(lips)["cheek"]) > 0
        assert min(expression(JOY, 1.0)["eye corner"]) > 0.9

    def test_sides_are_separate(self) -> None:
        one = strengths({31: 250, 33: 250, 35: 150})["forehead"]
        assert one[0] > 0.9
        assert one[1] == 0.0

    def test_rest_and_visemes_make_no_wrinkles(self) -> None:
        definitions = FaceModel.default().definitions
        for faps in (np.zeros(68), *definitions.visemes):
            assert wrinkle_strengths(faps.astype(np.float32)).max() < 0.3
        assert not wrinkle_strengths(np.zeros(68, dtype=np.float32)).any()

    @pytest.mark.parametrize("share", [-5.0, 1e6])
    def test_strengths_stay_within_0_to_1(self, share: float) -> None:
        values = wrinkle_strengths(np.full(68, share, dtype=np.float32))
        assert values.shape == (2, 4)
        assert (values >= 0).all()
        assert (values <= 1).all()


def _stretch(positions: npt.NDArray[Any]) -> Any:
    below = np.where(positions[:, 1] < 0, 1.4, 1.0)
    return (positions * np.column_stack([np.full(len(below), 1.5), below, np.ones(len(below))])).astype(
        positions.dtype
    )


class TestPlaces:
    def test_feature_points_lie_where_the_map_has_them(self) -> None:
        model = FaceModel.default()
        # A face half as wide again, and longer below the eyes: the map follows.
        parts = tuple(replace(part, vertices=_stretch(part.vertices)) for part in model.parts)
        wide = replace(model, points=_stretch(model.points), parts=parts)
        places = place_wrinkles(wide, wide.part("skin"))
        assert places is not None
        rows = slice(wide.starts["skin"], wide.starts["skin"] + len(places))
        checked = 0
        for name, (x, y) in MAP_POINTS.items():
            for side, point in ((1, name), (-1, MIRRORED.get(name, name))):
                vertex = int(wide.bound[point_rows()[point]])
                if rows.start <= vertex < rows.stop and (side > 0 or point != name):
                    np.testing.assert_allclose(places[vertex - rows.start], (side * x, y), atol=0.03)
                    checked += 1
        assert checked > 15

    def test_ears_and_the_back_of_the_head_lie_outside(self) -> None:
        model = FaceModel.default()
        skin = model.part("skin")
        places = place_wrinkles(model, skin)
        assert places is not None
        behind = skin.vertices[:, 2] < model.points[point_rows()["10.7"], 2]
        assert behind.any()
        assert (np.abs(places[behind, 0]) > WIDTH).all()

    def test_faces_without_the_wish_or_the_points_have_no_wrinkles(self) -> None:
        model = FaceModel.default()
        assert place_wrinkles(replace(model, wrinkles=False), model.part("skin")) is None
        assert place_wrinkles(model, model.part("teeth_upper")) is None
        points, bound = model.points.copy(), model.bound.copy()
        points[point_rows()["4.1"]], bound[point_rows()["4.1"]] = np.nan, -1
        assert place_wrinkles(replace(model, points=points, bound=bound), model.part("skin")) is None


class TestMap:
    def test_every_wrinkle_is_drawn_in_its_place(self) -> None:
        pixels = wrinkle_map()
        assert pixels.shape == (*SHAPE, 4)
        assert (round((TOP - BOTTOM) * TEXELS), round(WIDTH * TEXELS)) == SHAPE
        middles = {
            "forehead": (0.4, 0.75),
            "frown": (0.13, 0.28),
            "eye corner": (0.8, -0.1),
            "cheek": (0.45, -0.75),
        }
        for channel, name in enumerate(WRINKLES):
            dark = np.argwhere(pixels[..., channel] < PLAIN - 40)
            assert len(dark) > 500
            up, across = TOP - (dark[:, 0] + 0.5) / TEXELS, (dark[:, 1] + 0.5) / TEXELS
            np.testing.assert_allclose((across.mean(), up.mean()), middles[name], atol=0.14)

    def test_the_border_of_the_map_is_plain(self) -> None:
        pixels = wrinkle_map().astype(int)
        for edge in (pixels[0], pixels[-1], pixels[:, -1]):  # beyond it these repeat
            assert abs(edge - PLAIN).max() <= 1


def test_surprise_darkens_lines_on_the_forehead() -> None:
    model = FaceModel.default()
    faps = model.definitions.expressions[SURPRISE]
    track = face_track([{number: int(faps[number - 1]) for number in range(3, 69)}])
    scene = Scene(Animation(25, np.arange(1), track), model)
    with Offscreen(scene, (320, 320)) as view:
        wrinkled = view.frame(0.0).astype(int)
        scene.show("wrinkles", False)
        smooth = view.frame(0.0).astype(int)
    darker = (smooth - wrinkled)[..., 1]
    rows = np.flatnonzero((darker > 8).sum(axis=1) > 10)
    assert len(rows) >= 3
    assert rows.max() < 0.4 * 320  # above the eyes
    assert np.count_nonzero(darker) < 0.05 * darker.size


def test_a_file_keeps_whether_the_model_shows_wrinkles(tmp_path: Path) -> None:
    model = FaceModel.default()
    path = tmp_path / "head.glb"
    assert model.wrinkles
    replace(model, wrinkles=False, levels=()).save(path)
    loaded = FaceModel.load(path)
    assert not loaded.wrinkles
    assert build_figure(loaded).shapes["skin"].wrinkle_places is None
    assert b'"wrinkles"' not in path.read_bytes()
    model.save(path)
    assert FaceModel.load(path).wrinkles
    data = path.read_bytes()
    damaged = data.replace(b'"wrinkles":true', b'"wrinkles":7   ')
    assert damaged != data
    path.write_bytes(damaged)
    with pytest.raises(ModelError, match="wrinkles"):
        FaceModel.load(path)
