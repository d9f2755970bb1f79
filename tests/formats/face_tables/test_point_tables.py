"""Files of tracked points: every layout gives the points, and what is none of a known tracker is refused."""

import csv
import json
from dataclasses import replace
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import fba
from fba.capture.points import PointMotion
from fba.errors import FbaWarning, FormatError
from fba.face import FaceModel
from fba.formats import format_of
from fba.formats.face_tables import _pyfeat as pyfeat
from fba.formats.face_tables._tracked_points import read_points
from tools.captures.face_files import openface_csv, pyfeat_csv
from tools.captures.point_files import (
    LAYOUTS,
    array,
    arrays,
    lines,
    long,
    mediapipe_frames,
    openface,
    openpose_frames,
    wide,
)
from tools.captures.tracked_actor import film

FRAMES = 12


@cache
def deep() -> PointMotion:
    return film(FaceModel.default(), 478, frames=FRAMES, share=True).motion


@cache
def flat(count: int = 68) -> PointMotion:
    return film(FaceModel.default(), count, frames=FRAMES, flat=True).motion


def saved(folder: Path, name: str, data: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return path


@pytest.mark.parametrize("name", LAYOUTS)
def test_every_layout(name: str, tmp_path: Path) -> None:
    for motion in (deep(), flat()):
        if motion.flat and "mediapipe" in name:
            continue
        path = saved(tmp_path, name, LAYOUTS[name](motion))
        assert format_of(path).name == "points"
        found = read_points(path, source_rate=30)
        np.testing.assert_allclose(found.positions, motion.positions, rtol=1e-5)
        np.testing.assert_allclose(found.times, motion.times, atol=1e-5)
        assert (found.flat, found.share, found.rate) == (motion.flat, motion.share, 30)


def test_openpose(tmp_path: Path) -> None:
    motion = flat(70)
    found = read_points(saved(tmp_path, "film.jsonl", lines(openpose_frames(motion))), source_rate=30)
    np.testing.assert_allclose(found.positions, motion.positions)
    lost = [*openpose_frames(motion)[:5], {"version": 1.3, "people": []}, *openpose_frames(motion, 0.0)[6:]]
    found = read_points(saved(tmp_path, "film.jsonl", lines(lost)), source_rate=30)
    assert found.seen.tolist() == [True] * 5 + [False] * 7


def test_openface_has_points_in_metres(tmp_path: Path) -> None:
    motion = film(FaceModel.default(), 68, frames=FRAMES, metric=True).motion
    found = read_points(saved(tmp_path, "face.csv", openface(motion)))
    assert found.metric
    np.testing.assert_allclose(found.positions, motion.positions, atol=1e-6)
    both = openface(motion, {"AU01_r": np.zeros(FRAMES)})
    path = saved(tmp_path, "both.csv", both)
    assert format_of(path).name == "openface"  # action units, unless --from points asks for the others
    assert 53 in np.flatnonzero(fba.read(path, format="points").face.mask[0]) + 1  # type: ignore[union-attr]


@pytest.mark.parametrize("count", [51, 98, 106])
def test_points_of_other_trackers_are_refused_by_name(count: int, tmp_path: Path) -> None:
    whose = {51: "iBUG's 68 without the outline", 98: "WFLW", 106: "JD-landmark, InsightFace"}[count]
    names = ",".join(f"x_{n},y_{n}" for n in range(count))
    table = f"frame,{names}\n0,{','.join(['5'] * 2 * count)}\n"
    for path in (
        saved(tmp_path, "a.csv", table),
        saved(tmp_path, "a.json", json.dumps([{"landmarks": [[1.0, 2.0]] * count}])),
    ):
        with pytest.raises(FormatError, match=f"{count} points on a face, as those of {whose}"):
            read_points(path, source_rate=30)


def test_errors_name_the_fault_of_a_table(tmp_path: Path) -> None:
    table = wide(flat()).decode()
    with pytest.raises(FormatError, match=r"columns are missing: y_7"):
        read_points(saved(tmp_path, "a.csv", table.replace("y_7,", "gap,")))
    rows = table.splitlines()
    back = "\n".join([*rows[:5], rows[3], *rows[5:]])
    with pytest.raises(FormatError, match=r":6: the row is 0\.033 s before the one before it"):
        read_points(saved(tmp_path, "a.csv", back))
    for data in (array(flat()), json.dumps(flat().positions.tolist()), wide(flat(), header=False)):
        with pytest.raises(FormatError, match=r"source_rate"):
            read_points(saved(tmp_path, "none", data))
    twice = [{"faceLandmarks": 2 * frame["faceLandmarks"]} for frame in mediapipe_frames(deep())]
    path = saved(tmp_path, "two.json", json.dumps(twice))
    with pytest.raises(FormatError, match=r"frame 0 has 2 faces"):
        read_points(path, source_rate=30)
    assert len(read_points(path, source_rate=30, face="1")) == FRAMES
    with pytest.raises(FormatError, match=r"no frame with points"):
        read_points(saved(tmp_path, "a.json", json.dumps([{"faceLandmarks": []}] * 3)), source_rate=30)
    with pytest.raises(FormatError, match=r"no face is seen in any of the 12 frames"):
        fba.read(saved(tmp_path, "a.npz", arrays(replace(flat(), positions=0 * flat().positions), fps=30)))
    cut = long(flat()).decode().replace(",3,", ",x,", 1)
    with pytest.raises(FormatError, match=r"holds no number"):
        read_points(saved(tmp_path, "a.csv", cut))


def test_numbers_that_are_no_face(tmp_path: Path) -> None:
    random = np.random.default_rng(1).uniform(0, 500, flat().positions.shape)
    path = saved(tmp_path, "a.npy", array(replace(flat(), positions=random)))
    with pytest.raises(FormatError, match=r"the points do not lie as those of a face"):
        fba.read(path, source_rate=30)


def test_arrays_of_objects_are_not_run(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.array([{}, 1], dtype=object))
    with pytest.raises(FormatError, match=r"holds Python objects"):
        read_points(tmp_path / "a.npy")
    data = array(flat())
    with pytest.raises(FormatError, match=r"is cut off"):
        read_points(saved(tmp_path, "a.npy", data[:-100]))
    with pytest.raises(FormatError):
        read_points(saved(tmp_path, "a.npy", data.replace(b"}", b"{", 1)))
    with pytest.raises(FormatError):
        read_points(saved(tmp_path, "a.npz", arrays(flat())[:-300]))


@pytest.mark.filterwarnings("ignore:brows rest as:fba.errors.FbaWarning")
def test_real_tracks(shared: Path) -> None:
    found = read_points(shared / "data/capture/mediapipe_single_face.csv")
    assert (len(found), found.count, found.share, found.flat) == (72, 478, True, False)
    with pytest.warns(FbaWarning, match="size: 16:9 makes"):
        smile = fba.read(shared / "data/capture/mediapipe_single_face.csv")
    assert smile.face.values[10, [52, 58]].max() < 50  # before the smile
    assert smile.face.values[50, [52, 53, 58, 59]].min() > 150
    with pytest.warns(FbaWarning, match="pictures"):
        read = fba.read(shared / "data/capture/OpenFace_Test.csv", format="points")
    assert len(read) == 100


def test_openface_without_points(tmp_path: Path) -> None:
    table = openface_csv({1: np.ones(3)}, np.zeros((3, 3)), np.ones((3, 6)))
    with pytest.raises(FormatError, match=r"no columns of points"):
        read_points(saved(tmp_path, "a.csv", table))


EXAMPLE = Path(__file__).parents[3] / "examples" / "track_a_film" / "track_a_film.py"


@pytest.mark.skipif(not EXAMPLE.is_file(), reason="the examples come with a checkout")
def test_the_table_of_the_example_that_tracks_films(tmp_path: Path) -> None:
    spec = spec_from_file_location("track_a_film", EXAMPLE)
    tracking = module_from_spec(spec)
    spec.loader.exec_module(tracking)
    motion = deep()
    frames = []
    for number, points in enumerate(motion.positions.tolist()):
        faces = [] if number == 4 else [[SimpleNamespace(x=x, y=y, z=z) for x, y, z in points]]
        frames.append(tracking.Frame(number, number / 30, faces))
    path = tmp_path / "points.csv"
    with path.open("w", newline="") as file:
        assert tracking.write_points(csv.writer(file), 1920, 1080, frames) == (FRAMES - 1, FRAMES)
    found = read_points(path)
    assert found.aspect == pytest.approx(16 / 9)
    assert np.flatnonzero(~found.seen).tolist() == [4]
    np.testing.assert_allclose(found.positions[5:], motion.positions[5:], atol=1e-6)


def test_depth_in_another_unit_is_left_out(tmp_path: Path) -> None:
    mixed = replace(deep(), positions=deep().positions * (1280, 720, 1))
    found = read_points(saved(tmp_path, "a.csv", wide(mixed)))
    assert found.flat
    assert found.findings == ("depth is in another unit than x and y, and left out",)


def test_heads_of_py_feat_are_found_from_points(tmp_path: Path) -> None:
    take = film(FaceModel.default(), 68, frames=90, flat=True)
    units = {unit: np.zeros(90) for unit in (1, 2, 4, 6, 12)}
    table = pyfeat_csv(units, frames=np.arange(90.0)).splitlines()
    names = ",".join(f"{axis}_{point}" for axis in "xy" for point in range(68))
    rows = [",".join(map(str, points.T.ravel().tolist())) for points in take.motion.positions]
    lines = [f"{line},{more},approx_time" for line, more in zip(table[:1], [names], strict=True)]
    lines += [f"{line},{more},00:01" for line, more in zip(table[1:], rows, strict=True)]
    found = pyfeat.read_face(saved(tmp_path, "face.csv", "\n".join(lines)), source_rate=30)
    np.testing.assert_allclose(found.head[:, 0], take.faps[:, 47] * 1e-5, atol=0.06)
    np.testing.assert_allclose(found.head[:, 1], take.faps[:, 48] * 1e-5, atol=0.06)
    np.testing.assert_allclose(found.head[:, 2], take.faps[:, 49] * 1e-5, atol=0.02)
    assert "found from the face's points instead" in found.findings[-1]


@pytest.mark.parametrize("number", ["1e19", "inf", "-1e300"])
def test_numbers_of_points_that_no_table_has(tmp_path: Path, number: str) -> None:
    path = tmp_path / "points.csv"
    path.write_text("frame,landmark,x,y\n" + f"0,0,1,2\n0,{number},3,4\n", encoding="utf-8")
    with pytest.raises(FormatError):
        read_points(path, source_rate=30)
