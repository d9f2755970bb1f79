"""The figures that come with the library."""

from typing import get_args

import numpy as np
import pytest

from fba import figures
from fba.body import BodyModel
from fba.cli.options import Figure
from fba.errors import ModelError
from fba.face import Deformer, FaceModel
from fba.face.authoring.surface.landmarks import find_landmarks, weld_skin
from fba.face.checks import check_faps, check_neutral
from fba.face.model import DetailLevel
from fba.mesh.simplify import Level, place_on_level
from fba.parameters import FAP_COUNT, point_rows

OTHERS = [name for name in figures.FIGURES if name != "alex"]


def test_the_command_line_offers_them_all() -> None:
    assert get_args(Figure) == tuple(figures.FIGURES)


def test_the_first_is_the_built_in_person() -> None:
    assert figures.face() is FaceModel.default()
    assert figures.body("alex") is BodyModel.default()


def test_an_unknown_name_says_which_there_are() -> None:
    for read in (figures.face, figures.body):
        with pytest.raises(ModelError, match=r"'rut'.*alex, ruth"):
            read("rut")


@pytest.mark.parametrize("name", OTHERS)
def test_the_faces_keep_the_standard(name: str) -> None:
    face = figures.face(name)
    assert figures.face(name) is face
    assert not face.lost
    assert set(face.table_of) == set(FaceModel.default().table_of)
    findings = [*check_neutral(face), *check_faps(face)]
    assert not [finding for finding in findings if finding.severity == "error"]


@pytest.mark.parametrize("name", OTHERS)
def test_levels_of_detail_come_along(name: str) -> None:
    face, first = figures.face(name), FaceModel.default()
    assert len(face.levels) == len(first.levels) > 0
    for level, like in zip(face.levels, first.levels, strict=True):
        away, usual = _median_distance(face, level), _median_distance(first, like)
        assert away < 1.5 * usual < 0.0005
        assert level.model.part("skin").material.texture == face.part("skin").material.texture


def _median_distance(face: FaceModel, level: DetailLevel) -> float:
    """Return how far (m) vertices of a face are from the surface of its level."""
    coarse = level.model.vertices.astype(np.float64)
    gone = np.zeros(len(face.vertices), dtype=bool)
    mesh = Level(coarse, level.model.triangles, level.parents, *[np.zeros(0, np.int32)] * 3, gone)
    rows, weights = place_on_level(face.vertices, mesh)
    off = np.einsum("nk,nkd->nd", weights, coarse[rows]) - face.vertices
    return float(np.median(np.linalg.norm(off, axis=1)))


@pytest.mark.parametrize("name", OTHERS)
def test_the_head_fits_the_neck_of_its_body(name: str) -> None:
    face, body = figures.face(name), figures.body(name)
    default = FaceModel.default(), BodyModel.default()
    gaps = []
    for head, trunk in ((face, body), default):
        assert trunk.eyes is not None
        pupils = head.points[[point_rows()["3.5"], point_rows()["3.6"]]]
        placed = head.part("skin").vertices + (trunk.eyes - pupils).mean(axis=0)
        neck = next(part for part in trunk.parts if part.kind == "neck").vertices
        middle = neck[np.abs(neck[:, 1] - np.median(neck[:, 1])) < 0.01]
        gaps.append(np.linalg.norm(placed[None] - middle[:, None], axis=2).min(axis=1).max())
    assert gaps[0] < gaps[1] + 0.001
    assert len(body.skeleton) == len(default[1].skeleton)


@pytest.mark.parametrize("name", OTHERS)
def test_lids_meet_within_a_fifth_of_a_millimetre(name: str) -> None:
    face = figures.face(name)
    marks = find_landmarks(weld_skin(face.parts, face.bound), face.points, face.bound)
    values = np.zeros(FAP_COUNT, np.float32)
    values[[18, 19]], values[[20, 21]] = 600, 424
    places = np.empty((len(marks.surface), 3))
    places[marks.surface.number] = Deformer(face).local(values)[marks.surface.pool]
    for side in ("left", "right"):
        upper, lower = (places[marks.contour(f"{side} {lid} lid")] for lid in ("upper", "lower"))
        steps = np.linspace(0, 1, 20)[:, None, None]
        line = (lower[:-1] + steps * np.diff(lower, axis=0)).reshape(-1, 3)
        away = np.linalg.norm(upper[:, None] - line[None], axis=2).min(axis=1)
        assert away.max() < 0.0002, side
