"""Points in NumPy's arrays and in JSON: shapes and names that programs use, and what is none of them."""

import json
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fba.arrays import Float64
from fba.capture.points import PointMotion
from fba.errors import FormatError
from fba.face import FaceModel
from fba.formats.face_tables._tracked_points import read_points
from tools.captures.tracked_actor import film

FRAMES = 6


@cache
def points() -> Float64:
    """Return 68 points of a face in 6 pictures: (6, 68, 2)."""
    motion: PointMotion = film(FaceModel.default(), 68, frames=FRAMES, flat=True).motion
    return motion.positions


def archive(folder: Path, **arrays: Any) -> Path:
    data = BytesIO()
    np.savez(data, **arrays)
    path = folder / "a.npz"
    path.write_bytes(data.getvalue())
    return path


def document(folder: Path, content: object) -> Path:
    path = folder / "a.json"
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize(
    "change",
    [
        lambda p: p,
        lambda p: p[:, None],
        lambda p: p.swapaxes(1, 2),
        lambda p: p.reshape(len(p), -1),
        lambda p: p.astype(np.float32),
    ],
)
def test_shapes_of_arrays(change: Any, tmp_path: Path) -> None:
    found = read_points(archive(tmp_path, other=np.zeros(3), landmarks=change(points()), fps=25))
    np.testing.assert_allclose(found.positions, points(), rtol=1e-6)
    assert found.rate == 25


def test_times_and_size_of_the_picture(tmp_path: Path) -> None:
    times = 7 + np.arange(FRAMES) / 50
    path = archive(tmp_path, points=points(), timestamps=times, width=1280, height=720)
    found = read_points(path)
    np.testing.assert_allclose(found.times, times - 7, atol=1e-9)
    assert (found.rate, found.aspect) == (50, pytest.approx(16 / 9))
    back = times.copy()
    back[3] = 0
    with pytest.raises(FormatError, match="before the one before it"):
        read_points(archive(tmp_path, points=points(), times=back))


def test_faces_in_arrays(tmp_path: Path) -> None:
    two = archive(tmp_path, faces=np.stack([points(), points() + 400], axis=1), fps=30)
    with pytest.raises(FormatError, match="has 2 faces; choose one with face='0'"):
        read_points(two)
    np.testing.assert_allclose(read_points(two, face="1").positions, points() + 400)
    for wrong in ("2", "left"):
        with pytest.raises(FormatError, match=f"has no face '{wrong}'; there are 0 to 1"):
            read_points(two, face=wrong)


def test_a_single_picture(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", points()[0])
    assert read_points(tmp_path / "a.npy").positions.shape == (1, 68, 2)
    assert len(read_points(document(tmp_path, {"points": points()[0].tolist()}))) == 1


def test_arrays_without_a_face(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="98 points on a face, as those of WFLW"):
        read_points(archive(tmp_path, landmarks=np.ones((5, 98, 2)), fps=30))
    with pytest.raises(FormatError, match=r"no array has points of a face, .* but data \(5, 7\)"):
        read_points(archive(tmp_path, data=np.ones((5, 7)), fps=30))


@pytest.mark.parametrize(
    "content",
    [
        lambda frames: {"fps": 25, "frames": [{"landmarks": one} for one in frames]},
        lambda frames: {"fps": 25, "anything": [{"points": one} for one in frames]},
        lambda frames: [
            {"time": n / 25, "landmarks": np.ravel(one).tolist()} for n, one in enumerate(frames)
        ],
        lambda frames: [
            {"timestamp": n / 25, "landmarks": [{"x": x, "y": y} for x, y in one]}
            for n, one in enumerate(frames)
        ],
    ],
)
def test_documents(content: Any, tmp_path: Path) -> None:
    found = read_points(document(tmp_path, content(points().tolist())))
    np.testing.assert_allclose(found.positions, points(), rtol=1e-9)
    assert found.rate == 25


def test_documents_by_numbers_of_frames(tmp_path: Path) -> None:
    frames = {str(n): {"landmarks": one} for n, one in enumerate(points().tolist())}
    found = read_points(document(tmp_path, dict(reversed(frames.items()))), source_rate=30)
    np.testing.assert_allclose(found.positions, points())


def test_documents_that_say_the_size_of_the_picture(tmp_path: Path) -> None:
    frames = [{"landmarks": one} for one in points().tolist()]
    found = read_points(
        document(tmp_path, {"fps": 30, "image_width": 640, "image_height": 480, "frames": frames})
    )
    assert found.aspect == pytest.approx(4 / 3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: [*f[:4], {"landmarks": [[1, 2]] * 478}], "frame 4 has 478 points, and others 68"),
        (lambda f: [{"landmarks": [[1, 2]] * 106}] * 5, "106 points on a face, as those of"),
        (lambda f: [{"landmarks": []}] * 5, "no frame with points"),
    ],
)
def test_documents_without_a_face(change: Any, message: str, tmp_path: Path) -> None:
    frames = [{"landmarks": one} for one in points().tolist()]
    with pytest.raises(FormatError, match=message):
        read_points(document(tmp_path, change(frames)), source_rate=30)


def test_points_without_numbers_are_missing(tmp_path: Path) -> None:
    frames: list[Any] = points().tolist()
    frames[2] = [["?", None], *frames[2][1:]]
    frames[3][5] = [1e301, True]
    found = read_points(document(tmp_path, frames), source_rate=30)
    assert np.argwhere(np.isnan(found.positions[..., 0])).tolist()[-1] == [3, 5]


def test_lines_of_which_one_is_broken(tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    lines = [json.dumps({"landmarks": one}) for one in points().tolist()]
    path.write_text("\n".join([*lines[:2], lines[2][:-40], *lines[3:]]))
    with pytest.raises(FormatError, match=r"a\.jsonl:3: is no complete JSON"):
        read_points(path, source_rate=30)


def test_faces_of_documents_are_numbered(tmp_path: Path) -> None:
    frames = [{"landmarks": one} for one in points().tolist()]
    with pytest.raises(FormatError, match="has no face 'Anna'; faces are numbered from 0"):
        read_points(document(tmp_path, frames), source_rate=30, face="Anna")
