"""Photographs are read upright and small; files of points on them, ours and those of landmark programs."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fba import Limits
from fba.errors import FbaError, FbaWarning, FormatError, LimitError, ModelError
from fba.face.fitting import read_photo_points, read_photograph, write_photo_points


def picture(width: int, height: int) -> Image.Image:
    across = np.linspace(0, 255, width)[None, :, None] * np.array([1.0, 0.3, 0.1])
    return Image.fromarray(np.broadcast_to(across, (height, width, 3)).astype(np.uint8))


def test_a_photograph_is_turned_upright_as_exif_says(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x0112] = 6  # to be turned clockwise by a quarter
    picture(200, 100).save(tmp_path / "a.jpg", exif=exif, quality=95)
    read = read_photograph(tmp_path / "a.jpg")
    assert (read.size, read.pixels.shape) == ((100, 200), (200, 100, 3))
    assert read.pixels[10, 50, 0] < 60  # what was left is up
    assert read.pixels[190, 50, 0] > 200


def test_large_photographs_are_kept_small(tmp_path: Path) -> None:
    """A picture of 50 megapixels is read, and no more of it kept than a skin needs."""
    Image.new("RGB", (8660, 5774), (200, 150, 120)).save(tmp_path / "a.jpg", quality=50)
    read = read_photograph(tmp_path / "a.jpg")
    assert read.size == (8660, 5774)
    assert max(read.pixels.shape) <= 2048
    assert read.scale == pytest.approx(8660 / read.pixels.shape[1])
    with pytest.raises(LimitError, match="pixels"):
        read_photograph(tmp_path / "a.jpg", limits=Limits(pixels=1_000_000))


def test_a_grey_photograph_is_told(tmp_path: Path) -> None:
    picture(100, 100).convert("L").save(tmp_path / "a.png")
    with pytest.warns(FbaWarning, match="no colours"):
        assert read_photograph(tmp_path / "a.png").pixels.shape == (100, 100, 3)


def test_alpha_and_palettes_are_read(tmp_path: Path) -> None:
    picture(100, 100).convert("RGBA").save(tmp_path / "a.png")
    picture(100, 100).convert("P").save(tmp_path / "b.png")
    with warnings.catch_warnings(action="error"):
        for name in ("a.png", "b.png"):
            assert read_photograph(tmp_path / name).pixels.shape == (100, 100, 3)


def test_what_is_no_photograph_is_refused(tmp_path: Path) -> None:
    picture(1, 1).save(tmp_path / "tiny.png")
    with pytest.raises(ModelError, match="1 x 1 pixels"):
        read_photograph(tmp_path / "tiny.png")
    picture(300, 300).save(tmp_path / "whole.png")
    (tmp_path / "half.png").write_bytes((tmp_path / "whole.png").read_bytes()[:200])
    (tmp_path / "text.jpg").write_text("no picture")
    Image.new("I;16", (100, 100)).save(tmp_path / "deep.png")
    for name in ("half.png", "text.jpg", "deep.png", "missing.jpg"):
        with pytest.raises(FormatError):
            read_photograph(tmp_path / name)


def test_points_survive_a_file(tmp_path: Path) -> None:
    points = {"front": {"3.5": (412.25, 300.0), "3.6": (300.0, 301.5)}, "side": {"9.3": (10.0, 20.0)}}
    write_photo_points(tmp_path / "p.json", points, {"front": "me.jpg"})
    assert read_photo_points(tmp_path / "p.json") == points
    assert json.loads((tmp_path / "p.json").read_text())["front"]["picture"] == "me.jpg"


def test_points_of_the_front_alone_may_be_plain(tmp_path: Path) -> None:
    (tmp_path / "p.json").write_text('{"3.5": [4, 5], "9.3": [1, 2]}')
    assert read_photo_points(tmp_path / "p.json") == {"front": {"3.5": (4.0, 5.0), "9.3": (1.0, 2.0)}}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"front": {"points": {"3.55": [1, 2]}}}', "no feature point '3.55'"),
        ('{"front": {"points": {"6.1": [1, 2]}}}', "no photograph shows point 6.1"),
        ('{"front": {"points": {"3.5": [1]}}}', r"point 3.5 must be \[x, y\]"),
        ('{"front": {"points": {"3.5": [1, true]}}}', r"point 3.5 must be \[x, y\]"),
        ('{"front": {"points": {"3.5": [1, 1e9]}}}', r"point 3.5 must be \[x, y\]"),
        ('{"front": {"points": {}}}', "contains no points"),
        ('{"side": 5}', "an object from names"),
    ],
)
def test_faults_of_a_file_are_named(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "p.json").write_text(text)
    with pytest.raises(ModelError, match=message):
        read_photo_points(tmp_path / "p.json")


def test_what_is_no_file_of_points_is_refused(tmp_path: Path) -> None:
    (tmp_path / "p.json").write_text('{"front": ')
    with pytest.raises(FbaError):
        read_photo_points(tmp_path / "p.json")
    with pytest.raises((FormatError, ModelError)):
        read_photo_points(tmp_path / "missing.json")


def landmarks(count: int) -> list[list[float]]:
    """Points of dlib or MediaPipe on a picture, each at a place of its own."""
    random = np.random.default_rng(3)
    return random.uniform(100, 500, (count, 2)).round(3).tolist()


def test_dlib_s_68_points_are_feature_points(tmp_path: Path) -> None:
    at = landmarks(68)
    (tmp_path / "dlib.json").write_text(json.dumps({"landmarks": at}))
    front = read_photo_points(tmp_path / "dlib.json")["front"]
    assert front["8.1"] == tuple(at[51])
    assert front["3.1"] == pytest.approx(np.mean([at[43], at[44]], axis=0))
    assert len(front) > 20


def test_mediapipe_s_shares_become_pixels(tmp_path: Path) -> None:
    at = (np.array(landmarks(478)) / 600).tolist()
    (tmp_path / "mediapipe.json").write_text(json.dumps([{"x": x, "y": y, "z": 0.0} for x, y in at]))
    front = read_photo_points(tmp_path / "mediapipe.json", (600, 800))["front"]
    assert front["3.5"] == pytest.approx((at[473][0] * 600, at[473][1] * 800))
    with pytest.raises(FbaError, match="shares of the picture"):
        read_photo_points(tmp_path / "mediapipe.json")


@pytest.mark.parametrize("metric", [False, True])
def test_openface_s_pixels_are_read(metric: bool, tmp_path: Path) -> None:
    at, space = np.array(landmarks(68)), np.ones((68, 3)) * np.arange(68)[:, None]
    titles = ["frame", "face_id", "timestamp", "confidence", "success"]
    titles += [f"x_{k}" for k in range(68)] + [f"y_{k}" for k in range(68)]
    row = [1, 0, 0.0, 0.98, 1, *at[:, 0], *at[:, 1]]
    if metric:
        titles += [f"{axis}_{k}" for axis in "XYZ" for k in range(68)]
        row += space.T.ravel().tolist()
    (tmp_path / "openface.csv").write_text(", ".join(titles) + "\n" + ", ".join(map(str, row)) + "\n")
    front = read_photo_points(tmp_path / "openface.csv", (600, 800))["front"]
    assert front["8.1"] == pytest.approx(at[51])
