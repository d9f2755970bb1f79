"""MakeHuman's head: cropped, with feature points that keep the standard's rules, moved by FAPs."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from fba.errors import ModelError, OptionError
from fba.face.checks import check_neutral
from fba.face.deform._deformer import Deformer
from fba.face.feature_points import MIRRORED
from fba.face.importers import import_model
from fba.face.importers.makehuman.makehuman import read_makehuman
from fba.face.model import FaceModel
from fba.parameters import fap_numbers, point_rows


@pytest.fixture(scope="module")
def folder(shared: Path) -> Path:
    place = shared / "models/makehuman"
    if not (place / "base.obj").is_file():
        pytest.skip("no MakeHuman base mesh")
    return place


@pytest.fixture(scope="module")
def model(folder: Path) -> FaceModel:
    return import_model(folder)


def test_head_and_neck_with_parts_of_their_kinds(model: FaceModel) -> None:
    assert [(part.name, part.kind) for part in model.parts] == [
        ("skin", "skin"),
        ("left eye", "eye"),
        ("right eye", "eye"),
        ("upper teeth", "teeth"),
        ("lower teeth", "teeth"),
        ("tongue", "tongue"),
        ("left lashes", "lash"),
        ("right lashes", "lash"),
    ]
    low, high = model.part("skin").vertices.min(axis=0), model.part("skin").vertices.max(axis=0)
    # an adult's head with its neck, in metres, nothing of the shoulders
    assert 0.24 < high[1] - low[1] < 0.30
    assert 0.14 < high[0] - low[0] < 0.20
    np.testing.assert_allclose(low[0], -high[0], atol=1e-6)
    assert model.part("left eye").vertices[:, 0].min() > 0.01
    assert model.part("left eye").material.texture is not None


def test_feature_points_are_symmetric_and_on_their_vertices(model: FaceModel) -> None:
    assert model.missing == ()
    row = point_rows()
    for left, right in MIRRORED.items():
        np.testing.assert_allclose(
            model.points[row[left]], model.points[row[right]] * (-1, 1, 1), atol=2e-5, err_msg=left
        )
    held = model.bound >= 0
    assert held.sum() == 82  # all but the centre of the head and the thickness of hair
    np.testing.assert_array_equal(model.points[held], model.vertices[model.bound[held]].astype(np.float64))


def test_fapu_are_those_of_an_adult(model: FaceModel) -> None:
    distances = {unit: model.fapu[unit] * 1024 * 1000 for unit in ("IRISD", "ES", "ENS", "MNS", "MW")}
    # from vertices in base.obj, decimetres: 7.3315 - 7.2395, 2 x 0.3077, 6.7894 - 6.6081, 2 x 0.2668
    np.testing.assert_allclose(distances["IRISD"], 9.2, atol=0.01)
    np.testing.assert_allclose(distances["ES"], 61.55, atol=0.02)
    np.testing.assert_allclose(distances["MNS"], 18.13, atol=0.01)
    np.testing.assert_allclose(distances["MW"], 53.36, atol=0.01)


def test_what_is_not_neutral_is_reported_not_bent(model: FaceModel) -> None:
    findings = check_neutral(model)
    assert not [finding for finding in findings if finding.severity == "error"]
    assert any("iris" in finding.rule or "lips" in finding.rule for finding in findings)


@pytest.mark.parametrize(
    ("fap", "value", "point", "unit", "way"),
    [
        ("raise_l_i_eyebrow", 100, "4.1", "ENS", (0, 1, 0)),
        ("raise_r_o_eyebrow", -60, "4.6", "ENS", (0, 1, 0)),
        ("squeeze_l_eyebrow", 60, "4.1", "ES", (-1, 0, 0)),
        ("lower_t_midlip_o", -100, "8.1", "MNS", (0, -1, 0)),
        ("raise_b_midlip", -100, "2.3", "MNS", (0, 1, 0)),
        ("raise_nose", 100, "9.3", "ENS", (0, 1, 0)),
        ("stretch_l_nose", 100, "9.1", "ENS", (1, 0, 0)),
        ("puff_l_cheek", 60, "5.1", "ES", (1, 0, 0)),
        ("pull_r_ear", 60, "10.4", "ENS", (-1, 0, 0)),
        ("thrust_tongue_tip", 100, "6.1", "MW", (0, 0, 1)),
    ],
)
def test_faps_by_the_standard(
    model: FaceModel, fap: str, value: float, point: str, unit: str, way: tuple[float, float, float]
) -> None:
    deform = Deformer(model)
    faps = np.zeros(68)
    rest = deform.feature_points(faps)
    faps[fap_numbers()[fap] - 1] = value
    moved = (deform.feature_points(faps) - rest)[point_rows()[point]]
    expected = value * model.fapu[unit] * np.array(way)
    np.testing.assert_allclose(moved, expected, atol=0.05 * np.linalg.norm(expected))


def test_the_file_itself_and_a_folder_without_fitted_eyes(folder: Path, tmp_path: Path) -> None:
    shutil.copy(folder / "base.obj", tmp_path / "base.obj")
    head = read_makehuman(tmp_path / "base.obj")
    eye = next(part for part in head.parts if part.name == "left eye")
    assert eye.material.texture is None
    assert len(np.unique(eye.vertices, axis=0)) == 72  # vertices 14598 to 14669 of the base mesh
    assert head.bound[point_rows()["3.5"]] >= 0
    assert np.isfinite(head.points).all()
    with pytest.raises(OptionError, match="has its own"):
        import_model(tmp_path, points={"9.3": 1})


def test_damaged_base_meshes_are_refused(folder: Path, tmp_path: Path) -> None:
    text = (folder / "base.obj").read_text()
    (tmp_path / "base.obj").write_text(text[: text.index("g helper-tongue")])
    with pytest.raises(ModelError, match=r"not MakeHuman's base mesh hm08.*no group"):
        import_model(tmp_path)
    (tmp_path / "base.obj").write_text(text.replace("g body", "g bodice"))
    with pytest.raises(ModelError, match="no group 'body'"):
        import_model(tmp_path)


def test_broken_fitted_eyes_are_named(folder: Path, tmp_path: Path) -> None:
    for name in ("base.obj", "high-poly.obj"):
        shutil.copy(folder / name, tmp_path / name)
    text = (folder / "high-poly.mhclo").read_text()
    for old, new, words in (
        ("14598 14599 14662", "14598 14599 99999", "vertex 99999 of the base mesh does not exist"),
        ("0.64546", "many", "a weight must be a finite number"),
        ("1.6482", "0", "must be positive"),
        ("obj_file high-poly.obj", "obj_file ../../none.obj", "is not in its folder"),
        (
            "14598 14599 14662 0.64546 0.02023 0.33431 -0.00208 -0.00037 0.00667\n",
            "",
            "gives positions for 1063 vertices",
        ),
    ):
        assert old in text
        (tmp_path / "high-poly.mhclo").write_text(text.replace(old, new, 1))
        with pytest.raises(ModelError, match=words):
            read_makehuman(tmp_path)
