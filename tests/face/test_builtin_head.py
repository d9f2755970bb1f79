"""The built-in head: an adult's proportions, the standard's neutral face, made by the scripts beside it."""

import csv
import io
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fba.face import FaceModel
from fba.parameters import faps, point_rows

HERE = Path(__file__).parent
FIGURE = HERE.parents[1] / "tools" / "figure"


@pytest.fixture(scope="module")
def head() -> FaceModel:
    return FaceModel.default()


def place(head: FaceModel, point: str) -> np.ndarray:
    return head.points[point_rows()[point]]


def test_one_shared_instance_with_everything(head: FaceModel) -> None:
    assert FaceModel.default() is head
    assert 6_000 <= len(head.vertices) <= 25_000
    kinds = [part.kind for part in head.parts]
    assert {"skin", "eye", "teeth", "tongue", "lash"} <= set(kinds)
    assert kinds.count("eye") == kinds.count("teeth") == 2
    assert head.missing == ()
    assert not head.lost
    assert set(head.table_of) == {fap.number for fap in faps()[2:]}


def test_its_origin_and_licence_are_told(head: FaceModel) -> None:
    assert "SOMA-X" in head.notes["origin"]
    assert head.notes["licence"] == "Apache-2.0"
    folder = Path(sys.modules["fba.face.builtin"].__file__ or "").parent
    assert "Apache License" in (folder / "LICENSE-APACHE.txt").read_text(encoding="utf-8")
    assert "SOMA-X" in (folder / "NOTICE.txt").read_text(encoding="utf-8")
    assert (folder / "head.glb").stat().st_size < 5_000_000


def test_the_built_in_head_is_symmetric(head: FaceModel) -> None:
    for part in head.parts:
        if part.kind == "hair":  # combed from a parting on one side
            continue
        name = part.name.replace("left", "#").replace("right", "left").replace("#", "right")
        other = head.part(name).vertices
        away, _ = cKDTree(other).query(part.vertices * np.array([-1, 1, 1], dtype=np.float32))
        # cloth hangs on quads cut into triangles one way
        assert away.max() < (1e-6 if part.kind != "other" else 0.01), part.name


def test_textured_with_a_picture_that_opens(head: FaceModel) -> None:
    from PIL import Image

    skin = head.part("skin")
    assert skin.material.texture is not None
    assert float(skin.texcoords.min()) >= 0
    assert float(skin.texcoords.max()) <= 1
    with Image.open(io.BytesIO(skin.material.texture)) as picture:
        assert picture.size == (2048, 2048)
        pixels = np.asarray(picture.convert("RGB")).astype(int)
    lips = pixels[1240:1300, 940:1110].reshape(-1, 3).mean(axis=0)
    forehead = pixels[500:560, 940:1110].reshape(-1, 3).mean(axis=0)
    assert lips[0] - lips[1] > forehead[0] - forehead[1] + 20  # redder


@pytest.mark.parametrize(
    "row", list(csv.DictReader((HERE / "farkas.csv").read_text(encoding="utf-8").splitlines()))
)
def test_proportions_of_an_adult(head: FaceModel, row: dict[str, str]) -> None:
    """Between three standard deviations below women's and above men's means."""
    offset = place(head, row["to"]) - place(head, row["from"])
    found = 1000 * float(np.linalg.norm(offset[["xyz".index(axis) for axis in row["axis"]]]))
    low = float(row["women"]) - 3 * float(row["women_sd"])
    high = float(row["men"]) + 3 * float(row["men_sd"])
    assert low <= found <= high, row["distance"]


def test_height_of_face_and_head(head: FaceModel) -> None:
    # skull top to chin 199..244 mm: three standard deviations about women's and men's means
    assert 0.199 < place(head, "11.4")[1] - place(head, "2.1")[1] < 0.244
    # between the pupils 52..74 mm
    assert 0.052 < place(head, "3.5")[0] - place(head, "3.6")[0] < 0.074


def test_gaze_iris_and_lids(head: FaceModel) -> None:
    for side, pupil, upper, lower in (("left", "3.5", "3.1", "3.3"), ("right", "3.6", "3.2", "3.4")):
        eye = head.part(f"eye_{side}").vertices.astype(np.float64)
        centre = (eye.min(axis=0) + eye.max(axis=0)) / 2
        radius = float(np.linalg.norm(eye - centre, axis=1).mean())
        np.testing.assert_allclose(np.linalg.norm(eye - centre, axis=1), radius, atol=1e-5)
        gaze = (place(head, pupil) - centre) / radius
        np.testing.assert_allclose(gaze, (0, 0, 1), atol=1e-3)
        # lids touch the iris above and below, and it fills IRISD0
        iris = head.fapu.IRISD * 1024
        assert place(head, upper)[1] - place(head, pupil)[1] == pytest.approx(iris / 2, rel=0.02)
        assert place(head, pupil)[1] - place(head, lower)[1] == pytest.approx(iris / 2, rel=0.02)
        # no skin within the eyeball
        skin = head.part("skin").vertices
        assert np.linalg.norm(skin - centre, axis=1).min() > radius


def test_lips_and_teeth_touch_and_the_tongue_lies_at_them(head: FaceModel) -> None:
    lips = place(head, "2.2") - place(head, "2.3")
    assert np.abs(lips).max() < 2e-4
    corners = [place(head, name)[1] for name in ("2.2", "2.4", "2.5")]
    assert np.ptp(corners) < 2e-4  # a level line
    teeth = place(head, "9.10")[1] - place(head, "9.11")[1]
    assert 0 <= teeth < 5e-4
    assert abs(place(head, "6.1")[1] - place(head, "9.11")[1]) < 1e-3
    assert 0 < place(head, "9.11")[2] - place(head, "6.1")[2] < 3e-3
    upper, lower = head.part("teeth_upper").vertices, head.part("teeth_lower").vertices
    assert upper[:, 1].min() > lower[:, 1].max() - 1e-4


@pytest.mark.slow
@pytest.mark.skipif(not FIGURE.is_dir(), reason="the scripts come with a checkout")
def test_the_scripts_make_it(tmp_path: Path, head: FaceModel, programs: Path) -> None:
    out = tmp_path / "made.npz"
    code = (
        "import numpy, make_head\n"
        "parts, points, bound = make_head.parts_and_points(painted=False)\n"
        f"numpy.savez({str(out)!r}, points=points, bound=bound, "
        "**{part.name: part.vertices for part in parts})\n"
    )
    subprocess.run([str(programs / "python"), "-c", code], cwd=FIGURE, check=True, timeout=300)
    made = np.load(out)
    for part in head.parts:
        np.testing.assert_allclose(made[part.name], part.vertices, atol=2e-6, err_msg=part.name)
    np.testing.assert_array_equal(made["bound"], head.bound)
    np.testing.assert_allclose(made["points"], head.points, atol=2e-6)
