"""Lids on which lashes or a liner are painted: only bare skin is drawn out over the eye."""

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fba.face.authoring import author
from fba.face.authoring.surface.landmarks import find_landmarks, weld_skin
from fba.face.checks import check_faps
from fba.face.checks._posing import Poser
from fba.face.importers import import_model
from fba.face.model import FaceModel
from fba.mesh._materials import read_pixels
from fba.parameters import point_rows
from small_head import small_head

BAND = 0.0045
"""Width of the painted band, metres."""
WIDE = 0.02
"""Distance from the lids' margins that the width of the texture shows, metres."""
CLOSED = {19: 1024.0, 20: 1024.0}


@pytest.fixture(scope="module")
def head() -> FaceModel:
    return small_head(cell=0.003)


@pytest.fixture(scope="module")
def distance(head: FaceModel) -> np.ndarray:
    """(V,) distance of the skin's vertices from the margins of the upper lids, metres."""
    surface = weld_skin(head.parts, head.bound)
    marks = find_landmarks(surface, head.points.astype(np.float64), head.bound)
    margins = [marks.contour(f"{side} upper lid") for side in ("left", "right")]
    away = surface.distances(np.concatenate(margins), WIDE)
    return np.minimum(away[surface.number[: len(head.parts[0].vertices)]], WIDE)


def picture(kind: str = "PNG") -> bytes:
    """A texture that is dark in the band beside the margin and the colour of skin beyond."""
    pixels = np.full((4, 200, 3), (220, 170, 150), dtype=np.uint8)
    pixels[:, : round(200 * BAND / WIDE)] = 12
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, kind)
    return stream.getvalue()


def painted(head: FaceModel, distance: np.ndarray, how: str) -> FaceModel:
    skin, *others = head.parts
    if how == "texture":
        places = np.stack([distance / WIDE * 0.999, np.full(len(distance), 0.5)], axis=1)
        material = replace(skin.material, texture=picture())
        skin = replace(skin, texcoords=places.astype(np.float32), material=material)
    elif how == "colours":
        light = np.where(distance[:, None] < BAND, 0.01, (0.7, 0.4, 0.3))
        skin = replace(skin, colours=np.column_stack([light, np.ones(len(light))]).astype(np.float32))
    elif how == "damaged":
        skin = replace(
            skin,
            texcoords=np.zeros((len(distance), 2), dtype=np.float32),
            material=replace(skin.material, texture=picture()[:60]),
        )
    return author([skin, *others], head.points, bound=head.bound)


def follows(model: FaceModel, distance: np.ndarray) -> float:
    """How far the outer half of the band goes when the lids close, as a share of the margin's way."""
    poser = Poser(model)
    way = np.linalg.norm(poser.pose(CLOSED) - poser.neutral, axis=1)
    skin = model.parts[0].vertices
    middle, margin = model.points[point_rows()["3.5"]], int(model.bound[point_rows()["3.1"]])
    outer = (distance > BAND / 2) & (distance < BAND) & (abs(skin[:, 0] - middle[0]) < 0.006)
    outer &= (skin[:, 1] > skin[margin, 1]) & (skin[:, 2] > skin[margin, 2] - 0.001)
    assert outer.sum() >= 2
    return float(np.median(way[: len(skin)][outer]) / way[margin])


def errors(model: FaceModel) -> set[str]:
    found = check_faps(model, [19, 20])
    return {f"{each.subject}: {each.rule}" for each in found if each.severity == "error"}


@pytest.mark.parametrize(
    ("how", "least", "most"),
    [("plain", 0.5, 0.85), ("damaged", 0.5, 0.85), ("texture", 0.95, 1.25), ("colours", 0.95, 1.25)],
)
def test_what_is_painted_on_a_lid_goes_with_its_margin(
    head: FaceModel, distance: np.ndarray, how: str, least: float, most: float
) -> None:
    model = painted(head, distance, how)
    assert least < follows(model, distance) < most
    assert errors(model) <= errors(painted(head, distance, "plain"))


def dark_area(model: FaceModel, values: dict[int, float]) -> float:
    """Area of the dark skin about the eyes as seen from the front, mm²."""
    skin = model.parts[0]
    assert skin.material.texture is not None
    assert skin.texcoords is not None
    pixels = read_pixels(skin.material.texture)
    assert pixels is not None
    posed = Poser(model).pose(values)[: len(skin.vertices)]
    eyes = model.points[[point_rows()["3.5"], point_rows()["3.6"]]]
    near = np.min([np.linalg.norm(skin.vertices - eye, axis=1) for eye in eyes], axis=0) < 0.025
    triangles = skin.triangles[near[skin.triangles].all(axis=1)]
    a, b, c = (posed[triangles[:, corner]] for corner in range(3))
    seen = np.maximum(np.cross(b - a, c - a)[:, 2] / 2, 0.0)
    weights = np.random.default_rng(0).dirichlet((1, 1, 1), 64)
    places = np.einsum("sc,fcx->fsx", weights, skin.texcoords[triangles]) % 1.0
    size = np.array(pixels.shape[1::-1])
    columns, rows = np.moveaxis((places * size).astype(int).clip(0, size - 1), 2, 0)
    dark = pixels[rows, columns, :3].mean(axis=2) < 50
    return float((seen * dark.mean(axis=1)).sum() * 1e6)


def test_a_head_without_blink_shapes_closes_its_eyes_with_skin(shared: Path) -> None:
    """Its lashes are painted on: the band was drawn out over the whole eye."""
    path = shared / "data/foreign/heads/rpm646d.glb"
    if not path.exists():
        pytest.skip("without the foreign heads")
    model = import_model(path)
    assert dark_area(model, CLOSED) < 1.3 * dark_area(model, {})
