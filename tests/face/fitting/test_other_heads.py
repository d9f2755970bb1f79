"""Points are found on other heads and on a small face in a large picture, and not where there is no face."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter

from fba.errors import FbaWarning, ModelError
from fba.face import FaceModel
from fba.face.fitting import FRONT_POINTS, Photograph, find_front_points
from tools.photos.measure_points import errors, group_errors
from tools.photos.measure_surface import photographed, surface_error
from tools.photos.other_heads import Picture, other_heads, pictures

BOUNDS = {"all": 4.2, "pupils": 3.0}
"""Largest mean errors, in % of the distance between the pupils; docs/photos.md has those of more pictures."""
SURFACE = {"rpm646d": (1.3, 3.0), "MakeHuman": (1.8, 5.1)}
"""Largest errors of the surface between the points, mm: mean, and that of 95 % of the face; as measured, and
some more."""
NO_FACES = ("coffee", "coins", "chelsea", "rocket", "page", "brick")


@pytest.fixture(scope="module")
def heads(shared: Path) -> dict[str, FaceModel]:
    """A few heads that are no variation of the built-in one."""
    heads = other_heads(shared, SURFACE)
    if not heads:
        pytest.skip("no heads in the shared folder")
    return heads


@pytest.fixture(scope="module")
def shown(heads: dict[str, FaceModel], opengl: None) -> list[Picture]:
    """A small picture of each head."""
    return [
        one for k, (name, head) in enumerate(heads.items())
        for one in pictures(name, head, k + 1, (250, 300), 1)
    ]  # fmt: skip


@pytest.mark.filterwarnings("ignore::fba.errors.FbaWarning")
def test_points_are_found_on_other_heads(shown: list[Picture]) -> None:
    off = group_errors(np.array([errors(find_front_points(one.photograph), one) for one in shown]))
    assert {name: off[name] for name in BOUNDS if off[name] > BOUNDS[name]} == {}


def test_the_surface_between_the_points_is_that_of_other_heads(heads: dict[str, FaceModel]) -> None:
    for number, (name, head) in enumerate(heads.items(), 2):
        error = surface_error(photographed(head, number, side=True), head)
        mean, most = SURFACE[name]
        assert error.mean < mean
        assert error.most < most


@pytest.mark.filterwarnings("ignore::fba.errors.FbaWarning")
def test_a_small_face_is_found_in_a_large_picture(shown: list[Picture]) -> None:
    random = np.random.default_rng(3)
    coarse = random.integers(0, 255, (12, 16, 3)).astype(np.uint8)
    pixels = np.array(Image.fromarray(coarse).resize((1200, 900), Image.Resampling.BICUBIC))
    face = shown[-1]
    pixels[500:800, 700:950] = face.photograph.pixels
    found = find_front_points(Photograph(pixels, (1200, 900), "far.png"))
    moved = Picture("far", face.photograph, face.places + np.array([700, 500]))
    assert group_errors(errors(found, moved)[None])["all"] < 7


def test_a_covered_mouth_is_doubtful(shown: list[Picture]) -> None:
    picture = next((one for one in shown if one.head == "rpm646d"), shown[-1])
    mouth = [FRONT_POINTS.index(name) for name in ("8.3", "8.4", "8.1", "8.2")]
    x, y = picture.places[mouth].mean(axis=0).astype(int)
    wide, high = int(0.6 * picture.eyes), int(0.3 * picture.eyes)
    pixels = picture.photograph.pixels.copy()
    block = pixels[y - high : y + high, x - wide : x + wide]
    block[:] = gaussian_filter(block.astype(float), (8, 8, 0))
    with pytest.warns(FbaWarning, match="mouth.*doubtful"):
        find_front_points(Photograph(pixels, picture.photograph.size, "covered.png"))


def example(name: str) -> Photograph:
    """A picture of scikit-image."""
    data = pytest.importorskip("skimage.data", reason="scikit-image is not installed")
    pixels = np.asarray(getattr(data, name)())
    pixels = np.repeat(pixels[..., None], 3, axis=2) if pixels.ndim == 2 else pixels[..., :3]
    return Photograph(np.ascontiguousarray(pixels), pixels.shape[1::-1], name)


def test_the_astronaut_is_found_and_her_mouth_is_doubtful() -> None:
    with pytest.warns(FbaWarning, match="mouth.*doubtful"):  # she laughs
        found = find_front_points(example("astronaut"))
    true = {"3.5": (247, 103), "3.6": (203, 101), "9.3": (224, 126), "8.3": (244, 142)}
    off = [np.hypot(*(np.array(found.points[name]) - place)) for name, place in true.items()]
    assert max(off) < 7


@pytest.mark.parametrize("name", NO_FACES)
def test_pictures_without_a_face_are_refused(name: str) -> None:
    with pytest.raises(ModelError, match=f"{name}: .*no face was found"):
        find_front_points(example(name))
