"""A head from photographs: it is valid, talks, and has the shape and the skin that they show."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from fba.errors import FbaWarning, ModelError
from fba.face import FaceModel
from fba.face.checks import check_faps, check_neutral
from fba.face.fitting import FRONT_POINTS, SIDE_POINTS, Photo, Photograph, PhotoHead, _skin, head_from_photos
from fba.face.fitting._views import View
from fba.mesh import read_pixels
from fba.parameters import point_rows
from fba.rotations import turn

pytestmark = pytest.mark.slow

SIZE = (600, 700)
BASE = FaceModel.default()


def photo(yaw: float, names: tuple[str, ...], colour: tuple[int, int, int], wide: float = 1.0) -> Photo:
    """A picture of one colour, with the points of the built-in head, made wider, on it."""
    around = turn(np.array([0.0, 1.0, 0.0]), np.radians(-yaw))
    view = View(around, 1800.0, np.array([300.0, 300.0]), 1.5)
    rows = [point_rows()[name] for name in names]
    places = view.project(BASE.points[rows] * (wide, 1.0, 1.0))
    pixels = np.broadcast_to(np.array(colour, dtype=np.uint8), (SIZE[1], SIZE[0], 3)).copy()
    points = {name: (float(x), float(y)) for name, (x, y) in zip(names, places, strict=True)}
    return Photo(Photograph(pixels, SIZE, f"{yaw:g}.jpg"), points)


class Made(NamedTuple):
    head: PhotoHead
    pixels: np.ndarray


@pytest.fixture(scope="module")
def made() -> Made:
    """A head made of a reddish frontal picture, of a face a twentieth wider, and a bluish profile."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_skin, "SIZE", 512)
        front, side = photo(0, FRONT_POINTS, (200, 120, 100), 1.05), photo(90, SIDE_POINTS, (100, 120, 200))
        head = head_from_photos(front, side, name="ada")
    pixels = read_pixels(head.model.part("skin").material.texture or b"")
    assert pixels is not None
    return Made(head, pixels)


def test_it_is_valid_and_every_fap_moves_it(made: Made) -> None:
    model = made.head.model
    findings = [*check_neutral(model), *check_faps(model)]
    assert [one for one in findings if one.severity == "error"] == []
    assert {table.fap for table in model.tables} == {table.fap for table in BASE.tables}
    assert model.name == "ada"


def test_its_shape_is_that_of_the_points(made: Made) -> None:
    for errors in made.head.errors:
        assert max(errors.values()) < 0.001
    rows = point_rows()

    def ratio(points: np.ndarray) -> float:
        wide = np.linalg.norm(points[rows["8.3"]] - points[rows["8.4"]])
        return float(wide / np.linalg.norm(points[rows["9.15"]] - points[rows["2.1"]]))

    assert ratio(made.head.model.points) == pytest.approx(1.05 * ratio(BASE.points), rel=0.02)
    assert [round(view.degrees[0] / 10) for view in made.head.views] == [0, 9]


def colour_at(made: Made, name: str) -> np.ndarray:
    """The mean colour of the skin around a feature point."""
    part = made.head.model.part("skin")
    vertex = int(made.head.model.bound[point_rows()[name]]) - made.head.model.starts["skin"]
    x, y = (part.texcoords[vertex] * 512).astype(int)
    return np.asarray(made.pixels[y - 3 : y + 4, x - 3 : x + 4, :3].reshape(-1, 3).mean(axis=0))


def test_its_skin_is_that_of_the_photographs(made: Made) -> None:
    for name in ("9.3", "8.1", "2.10"):
        assert colour_at(made, name) == pytest.approx(
            [172, 103, 85], abs=12
        )  # the photograph's 200, 120, 100 without the light
    # The profile serves both sides, in the tone of the front.
    left, right = colour_at(made, "10.7"), colour_at(made, "10.8")
    assert left == pytest.approx(right, abs=12)
    assert made.head.seen > 0.7


def test_what_is_beside_the_head_is_no_skin(monkeypatch: pytest.MonkeyPatch) -> None:
    """The person's head is narrower than the fitted one, before an even green."""
    monkeypatch.setattr(_skin, "SIZE", 512)
    shot = photo(0, FRONT_POINTS, (30, 160, 40))
    places = np.array(list(shot.points.values()))
    left, right = (round(float(x)) for x in (places[:, 0].min() + 2, places[:, 0].max() - 2))
    shot.photograph.pixels[40:, left:right] = (200, 120, 100)
    pixels = read_pixels(head_from_photos(shot).model.part("skin").material.texture or b"")
    assert pixels is not None
    assert not (pixels[..., 1] > pixels[..., 0].astype(int) + 5).any()


def test_measures_are_14_and_beside_the_built_in_head_s(made: Made) -> None:
    measures = made.head.measures
    assert [one.view for one in measures] == ["profile"] * 6 + ["front"] * 8
    assert all(np.isfinite([one.value, one.usual]).all() for one in measures)
    mouth = next(one for one in measures if one.name.startswith("width of the mouth"))
    assert mouth.value == pytest.approx(mouth.usual, rel=0.02)  # the whole face is wider


def test_photographs_that_cannot_be_a_face_s_are_refused() -> None:
    front = photo(0, FRONT_POINTS, (200, 120, 100))
    side = photo(90, SIDE_POINTS, (200, 120, 100))
    few = replace(front, points={name: front.points[name] for name in ("3.5", "3.6", "9.3")})
    with pytest.raises(ModelError, match="too few"):
        head_from_photos(few)
    blind = replace(front, points={k: v for k, v in front.points.items() if k != "3.6"})
    with pytest.raises(ModelError, match=r"3\.6 is missing"):
        head_from_photos(blind)
    with pytest.raises(ModelError, match="left pupil"):
        head_from_photos(replace(front, points={k: (600 - x, y) for k, (x, y) in front.points.items()}))
    with pytest.raises(ModelError, match=r"pupils 3\.5 and 3\.6|is this the profile"):
        head_from_photos(side, front)
    with pytest.raises(ModelError, match="is this the frontal picture"):
        head_from_photos(front, front)
    with pytest.raises(ModelError, match="far outside"):
        head_from_photos(replace(front, points={k: (x + 2000, y) for k, (x, y) in front.points.items()}))
    with pytest.raises(ModelError, match="not those of a person"):
        head_from_photos(front, eyes=0.2)


def test_a_view_from_elsewhere_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_skin, "SIZE", 256)
    names = tuple(name for name in FRONT_POINTS if not name.startswith("10."))
    with pytest.warns(FbaWarning, match="4. degrees beside"):
        head_from_photos(photo(42, names, (200, 120, 100)))
