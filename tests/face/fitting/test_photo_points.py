"""Files of points on photographs: our JSON, and what landmark programs write."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fba.errors import FbaError, FormatError, ModelError
from fba.face.fitting import read_photo_points, write_photo_points


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
