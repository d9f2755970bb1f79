"""C3D files of six makers, and made ones, read as ezc3d and c3d read them."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from test_marker_files import cloud

from fba.errors import FbaWarning, FormatError
from fba.formats.c3d._reader import read_markers
from tools.captures import marker_files

METRES = {"mm": 1e-3, "m": 1.0, "": 1e-3}
SAMPLES = ("BTS", "C3DRotationExample", "FP_Type1", "Optotrak", "Qualisys", "Vicon", "read_NOTworking2")


def by_ezc3d(path: Path) -> tuple[list[str], np.ndarray]:
    """Labels and positions (T, M, 3) in the file's units, NaN for what is missing."""
    ezc3d = pytest.importorskip("ezc3d", reason="ezc3d is not installed: pip install ezc3d")
    content = ezc3d.c3d(str(path))
    labels = [label.strip() for label in content["parameters"]["POINT"]["LABELS"]["value"]]
    return labels, content["data"]["points"][:3].transpose(2, 1, 0)


def by_c3d(path: Path) -> tuple[list[str], np.ndarray]:
    """The same as another library reads it."""
    c3d = pytest.importorskip("c3d", reason="c3d is not installed: pip install c3d")
    with path.open("rb") as file, warnings.catch_warnings(action="ignore"):
        reader = c3d.Reader(file)
        frames = np.array([points[:, :4] for _, points, _ in reader.read_frames(copy=True)], dtype=np.float64)
        labels = [label.strip() for label in reader.point_labels]
    positions = frames[..., :3]
    positions[frames[..., 3] < 0] = np.nan
    return labels, positions


@pytest.mark.parametrize("second", [by_ezc3d, by_c3d])
@pytest.mark.parametrize("name", SAMPLES)
@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_samples(shared: Path, name: str, second: object) -> None:
    path = shared / "data/capture/c3d" / f"{name}.c3d"
    if not path.is_file():
        pytest.skip("no C3D samples")
    assert callable(second)
    if name == "C3DRotationExample":  # no markers at all
        with pytest.raises(FormatError, match="holds no markers, only rotations"):
            read_markers(path)
        return
    motion = read_markers(path)
    labels, positions = second(path)
    bare = [label.rpartition(":")[2] if label not in motion.names else label for label in labels]
    rows = [bare.index(marker) for marker in motion.names]
    assert len(rows) == len(labels)  # nothing is left out of these
    expected = positions[:, rows] * METRES[motion.unit]
    np.testing.assert_array_equal(np.isnan(expected[..., 0]), ~motion.seen)
    np.testing.assert_allclose(motion.positions, expected, rtol=3e-7, atol=1e-9)


@pytest.mark.parametrize(
    "name", [name for name in marker_files.MAKERS if name.endswith(".c3d") and "many" not in name]
)
def test_made_files(tmp_path: Path, name: str) -> None:
    path = marker_files.write(tmp_path, name, cloud())
    motion = read_markers(path)
    _, positions = (by_c3d if "dec" in name or "mips" in name else by_ezc3d)(path)
    np.testing.assert_allclose(motion.positions, positions * METRES[motion.unit], rtol=3e-7, atol=1e-9)


def test_the_sample_that_is_cut_short(shared: Path) -> None:
    path = shared / "data/capture/c3d/Optotrak.c3d"
    if not path.is_file():
        pytest.skip("no C3D samples")
    with pytest.warns(FbaWarning, match="is cut short: it holds 29 of its 1149 frames"):
        assert len(read_markers(path)) == 29
