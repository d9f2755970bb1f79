"""BAP files: both widths, scales, round trips, the real ones."""

import tempfile
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from fba.animation import Animation, FaceTrack
from fba.errors import FbaWarning, FormatError
from fba.formats.text.bap import read_bap, write_bap
from format_files import animations, file, mask


def test_a_face_is_not_written_as_a_body(tmp_path: Path) -> None:
    face = FaceTrack(np.zeros((1, 68), np.int32), np.ones((1, 68), bool))
    with pytest.raises(FormatError, match="a BAP file holds a body, and this animation has only a face"):
        write_bap(tmp_path / "a.bap", Animation(25, np.arange(1), face, None))
    assert not (tmp_path / "a.bap").exists()


@pytest.mark.parametrize("width", [186, 187, 296, 297])
def test_both_widths_and_one_column_more(tmp_path: Path, width: int) -> None:
    path = file(tmp_path, "a.bap", "3.2 walk 30 1", mask(1, 186, width=width), "3 -5 6")
    animation = read_bap(path)
    assert animation.index.tolist() == [3]
    assert animation.body.values[0, [0, 185]].tolist() == [-5, 6]
    assert animation.body.mask.sum() == 2
    write_bap(tmp_path / "b.bap", animation)
    assert (tmp_path / "b.bap").read_text() == f"3.2 walk 30 1\n{mask(1, 186, width=296)}\n3 -5 6\n"


def test_a_file_may_change_its_width(tmp_path: Path) -> None:
    path = file(tmp_path, "a.bap", "3.1 a 30 2", mask(186, width=186), "0 1", mask(296, width=296), "1 2")
    body = read_bap(path).body
    assert (body.values[0, 185], body.values[1, 295]) == (1, 2)


def test_angle_scale_leaves_millimetres_alone(tmp_path: Path) -> None:
    path = file(tmp_path, "a.bap", "3.1 a 30 1", mask(1, 181, 184, width=186), "0 3 1000 -3")
    assert read_bap(path, angle_scale=1.5).body.values[0, [0, 180, 183]].tolist() == [5, 1000, -5]
    with pytest.raises(FormatError, match=r"must lie in .* after angle_scale 1e\+10"):
        read_bap(path, angle_scale=1e10)
    for scale in (0, float("nan"), "x"):
        with pytest.raises(FormatError, match="angle_scale must be a number other than 0"):
            read_bap(path, angle_scale=scale)  # type: ignore[arg-type]


def test_errors_name_the_bap(tmp_path: Path) -> None:
    path = file(tmp_path, "a.bap", "3.1 a 30 1", mask(1, width=186), "0 1e30")
    with pytest.raises(FormatError, match=r"a\.bap:3: BAP 1 sacroiliac_tilt must lie in .*'1e30'"):
        read_bap(path)
    path = file(tmp_path, "a.bap", "3.1 a 30 1", mask(1, width=180), "0 1", mask(1, width=186))
    with pytest.raises(FormatError, match="mask of 186 or 296 bits, found 180"):
        read_bap(path)


@settings(max_examples=40)
@given(animations(face=False, body=True))
def test_written_bap_files_read_back_unchanged(animation) -> None:  # type: ignore[no-untyped-def]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.bap"
        write_bap(path, animation)
        assert read_bap(path) == animation


def test_every_real_bap_file_reads_and_writes_back(shared: Path, tmp_path: Path) -> None:
    paths = [path for path in shared.rglob("*") if path.suffix.lower() == ".bap"]
    assert len(paths) >= 100
    for path in paths:
        with warnings.catch_warnings():
            warnings.simplefilter("error", FbaWarning)
            animation = read_bap(path)
        write_bap(tmp_path / "b.bap", animation)
        assert read_bap(tmp_path / "b.bap") == animation


def test_known_numbers_of_a_real_file(shared: Path) -> None:
    body = read_bap(shared / "data" / "vreng" / "clap.bap").body
    assert len(body) == 59
    assert body.values[0][body.mask[0]].tolist() == [-8726, -8726, 8726, 8726]
    assert body.values[58][body.mask[58]].tolist() == [49109, -36678, 164853, -131197, 23565, 28441]
