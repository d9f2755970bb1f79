"""Captures of faces with numbers or shapes that none can have, as mutated files had them."""

from pathlib import Path

import numpy as np
import pytest

import fba
from fba.capture.points.poses import fit_poses
from fba.errors import FormatError, ModelError

RECORD = "|".join(
    f"{name}-5" for name in ("eyeBlinkL", "eyeLookOutL", "eyeLookUpL", "jawForward", "mouthClose")
)


def numpy_file(kind: str, shape: str) -> bytes:
    """Return a file of NumPy that says this of its array, with no numbers in it."""
    head = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return b"\x93NUMPY\1\0" + len(head).to_bytes(2, "little") + head.encode()


@pytest.mark.parametrize(
    ("name", "content", "finding"),
    [
        (
            "a.txt",
            f"{RECORD}|head#0,0,0,0,0,0|rightEye#0,0,0|leftEye-|jawOpen-1",
            "this is no turn|no weight",
        ),
        ("a.txt", f"{RECORD}|rightEye#0,0,0|leftEye-12", "no weight"),
        ("a.txt", f"{RECORD}|head#1e308,5,5,5,5,5|rightEye#5,5,5|leftEye#0,0,0", "head has an angle of"),
        ("a.csv", "Timecode,JawOpen\n4:9:9.0,\n8:9:0,", "no times in seconds"),
        ("a.npy", numpy_file("4f4", "(3, 68, 2)"), "no array|no format|holds"),
        ("a.npy", numpy_file("<f4", "(-248, 68)"), "an array that cannot be read"),
    ],
)
def test_what_no_capture_has(tmp_path: Path, name: str, content: str | bytes, finding: str) -> None:
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(FormatError, match=finding) as error:
        fba.read(path)
    assert name in str(error.value)


def test_points_in_one_place_show_no_pose() -> None:
    shape = np.random.default_rng(0).normal(size=(20, 3))
    with pytest.raises(ModelError, match="all in one place"):
        fit_poses(shape, np.zeros((2, 20, 2)))


def test_times_beyond_numbers(tmp_path: Path) -> None:
    rows = "".join(f"{10.0**308 * row / 2}," + ",".join(["1"] * 136) + "\n" for row in range(3))
    columns = ",".join([f" x_{point}" for point in range(68)] + [f" y_{point}" for point in range(68)])
    path = tmp_path / "a.csv"
    path.write_text(f"timestamp,{columns}\n{rows}")
    with pytest.raises(FormatError, match=r"a\.csv"):
        fba.read(path)
