"""`fba model photos`: from pictures and points to a head, what is said, and what is refused."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from command_line import Run
from fba.face import FaceModel
from fba.face.fitting import FRONT_POINTS, _skin, write_photo_points
from fba.face.fitting._views import View
from fba.mesh import read_pixels
from fba.parameters import point_rows
from fba_player.scene._photo_scene import PhotoEditing
from fba_player.window import pages


@pytest.fixture
def photo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A picture of one colour, and the built-in head's points on it beside it."""
    monkeypatch.setattr(_skin, "SIZE", 256)
    view = View(np.eye(3), 1500.0, np.array([250.0, 260.0]), 1.5)
    points = FaceModel.default().points
    places = {name: tuple(view.project(points[point_rows()[name]]).tolist()) for name in FRONT_POINTS}
    write_photo_points(tmp_path / "ada.points.json", {"front": places})
    Image.new("RGB", (500, 600), (200, 140, 120)).save(tmp_path / "ada.png")
    return tmp_path / "ada.png"


def test_a_head_is_made_and_measured(run: Run, photo: Path) -> None:
    points, out_file = photo.with_name("ada.points.json"), photo.with_name("ada.glb")
    _, out, err = run("model", "photos", photo, "-o", out_file, "--points", points, "--eyes", "65mm")
    assert err == ""
    head = FaceModel.load(out_file)
    assert head.name == "ada"
    pupils = head.points[[point_rows()["3.5"], point_rows()["3.6"]]]
    assert np.linalg.norm(pupils[0] - pupils[1]) == pytest.approx(0.065, abs=0.0005)
    assert "front ada.png: 40 points, 0.0 mm off on average; camera 0 degrees" in out
    assert (out.count("    profile "), out.count("    front ")) == (6, 8)
    out = run("model", "photos", photo, "-o", out_file, "--points", points, "--json").out
    assert len(json.loads(out)["measures"]) == 14


def test_a_bald_head_has_no_hair(run: Run, photo: Path) -> None:
    points, dark = photo.with_name("ada.points.json"), {}
    for hair in ("keep", "none"):
        out_file = photo.with_name(f"{hair}.glb")
        run("model", "photos", photo, "-o", out_file, "--points", points, "--hair", hair)
        pixels = read_pixels(FaceModel.load(out_file).part("skin").material.texture or b"")
        dark[hair] = float((pixels[..., :3].mean(axis=2) < 70).mean())
    assert dark["none"] < 0.3 * dark["keep"]


def test_points_are_edited_before_the_head_is_made(
    run: Run, photo: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    points, edited = photo.with_name("ada.points.json"), photo.with_name("edited.json")
    saves = [False, True]

    def show(photographs: Any, places: Any, path: Path) -> PhotoEditing:
        editing = PhotoEditing(photographs, places, path)
        if saves.pop(0):
            editing.save()
        return editing

    monkeypatch.setattr(pages, "check_page", lambda subject: None)
    monkeypatch.setattr(pages, "place_photo_points", show)
    words = ("model", "photos", photo, "-o", photo.with_name("a.glb"), "--points", points, "--edit", edited)
    assert "closed without saving" in run(*words, code=1).out
    assert not photo.with_name("a.glb").exists()
    run(*words)
    assert edited.exists()
    assert photo.with_name("a.glb").exists()


def test_points_that_are_not_found_are_dragged_from_a_template(
    run: Run, photo: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[Any] = []

    def show(photographs: Any, places: Any, path: Path) -> PhotoEditing:
        shown.append(places)
        return PhotoEditing(photographs, places, path)

    monkeypatch.setattr(pages, "check_page", lambda subject: None)
    monkeypatch.setattr(pages, "place_photo_points", show)
    words = ("model", "photos", photo, photo, "-o", photo.with_name("a.glb"))
    run(*words, "--edit", photo.with_name("new.json"), code=1)
    assert set(shown[0]["front"]) == set(FRONT_POINTS)
    assert 0 < shown[0]["front"]["2.1"][1] < 600
    assert 0 < shown[0]["side"]["9.3"][0] < shown[0]["side"]["10.5"][0] < 500


def test_mistakes_are_told(run: Run, photo: Path) -> None:
    out_file = photo.with_name("a.glb")
    assert "no face was found" in run("model", "photos", photo, "-o", out_file, code=1).err
    err = run("model", "photos", photo, photo, "-o", out_file, code=1).err
    assert "give the photographs as FRONT SIDE if this is the profile" in err
    assert not out_file.exists()
    err = run("model", "photos", photo, "-o", out_file, "--edit", photo.with_name("p.csv"), code=2).err
    assert "name it .json" in err
    run("model", "photos", photo, "-o", photo, code=2)
    points = photo.with_name("ada.points.json")
    content = json.loads(points.read_text())
    content["side"] = {"points": {"9.3": [1, 2]}}
    points.write_text(json.dumps(content))
    err = run("model", "photos", photo, "-o", out_file, "--points", points, code=2).err
    assert "give the profile as SIDE" in err
