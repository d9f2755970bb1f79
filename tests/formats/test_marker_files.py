"""Captures of markers in every format: what is written comes back, damage is an error."""

import contextlib
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import fba
from fba.capture.markers._motion import MarkerMotion
from fba.errors import FbaError, FbaWarning, FormatError, LimitError
from fba.formats import format_of
from fba.limits import Limits
from tools.captures import marker_files

RATE = Fraction(50)


def cloud(markers: int = 5, frames: int = 12) -> MarkerMotion:
    """Markers with gaps, coordinates of both signs."""
    random = np.random.default_rng(3)
    positions = random.uniform(-0.9, 0.9, (frames, markers, 3)).round(4)
    positions[3:5, 1] = positions[-1, 0] = np.nan
    names = tuple(f"M{n}a" for n in range(markers))
    return MarkerMotion(names, positions, np.arange(frames) / 50, RATE)


def read(path: Path, **options: object) -> MarkerMotion:
    reader = format_of(path).read_face
    return reader(path, **options)


@pytest.mark.parametrize("name", marker_files.MAKERS)
@pytest.mark.filterwarnings("ignore:.*without a label are left out")
def test_positions_gaps_and_rate_come_back(tmp_path: Path, name: str) -> None:
    motion = cloud()
    got = read(marker_files.write(tmp_path, name, motion))
    assert got.names == motion.names
    assert got.rate == RATE
    np.testing.assert_array_equal(got.seen, motion.seen)
    off = 0.05e-3 / 2 + 1e-9 if "integers" in name else 2e-7
    np.testing.assert_allclose(got.positions, motion.positions, atol=off)
    np.testing.assert_allclose(got.times - got.times[0], motion.times, atol=1e-9)


def test_the_content_decides_the_format(tmp_path: Path) -> None:
    kinds = {"usual.trc": "trc", "motive.csv": "motive", "nexus.csv": "nexus", "qualisys.tsv": "qualisys",
             "long.csv": "markers", "float.c3d": "c3d"}  # fmt: skip
    for name, kind in kinds.items():
        path = marker_files.write(tmp_path, name, cloud()).rename(tmp_path / f"{kind}.dat")
        assert format_of(path).name == kind


def test_units_of_each_marker_and_computed_values(tmp_path: Path) -> None:
    motion = cloud(4)
    path = tmp_path / "a.c3d"
    path.write_bytes(marker_files.c3d(motion, units=("mm", "m", "cm", "mm"), computed=("M2a",)))
    got = read(path)
    assert got.names == ("M0a", "M1a", "M3a")
    np.testing.assert_allclose(got.positions, motion.positions[:, [0, 1, 3]], atol=2e-7)
    assert got.up == "+z"


def test_more_markers_than_a_list_of_labels_holds(tmp_path: Path) -> None:
    motion = cloud(300, 2)
    path = tmp_path / "a.c3d"
    path.write_bytes(marker_files.c3d(motion))
    assert read(path).names == motion.names


def test_a_rate_that_is_missing(tmp_path: Path) -> None:
    path = tmp_path / "a.c3d"
    path.write_bytes(marker_files.c3d(cloud(), rate=0.0))
    with pytest.raises(FormatError, match="no frame rate; give one with source_rate=100"):
        read(path)
    assert read(path, source_rate=Fraction(120)).rate == 120


def test_times_that_are_not_regular_are_kept(tmp_path: Path) -> None:
    motion = cloud()
    times = motion.times.copy()
    times[6:] += 0.5
    path = tmp_path / "a.csv"
    path.write_bytes(marker_files.wide(replace(motion, times=times)))
    np.testing.assert_allclose(read(path).times, times, atol=1e-9)


def test_time_that_runs_backwards(tmp_path: Path) -> None:
    text = marker_files.trc(cloud()).replace(b"\r\n4\t0.060", b"\r\n4\t0.010")
    path = tmp_path / "a.trc"
    path.write_bytes(text)
    with pytest.raises(FormatError, match=r"a\.trc:10: time runs backwards: 0\.01 s after 0\.04 s"):
        read(path)


def test_a_file_that_is_cut_short(tmp_path: Path) -> None:
    path = tmp_path / "a.c3d"
    whole = marker_files.c3d(cloud(40, 100))
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.warns(FbaWarning, match="is cut short: it holds 4. of its 100 frames"):
        assert 40 < len(read(path)) < 50
    path.write_bytes(whole[: 3 * 512 + 600])
    with pytest.raises(FormatError, match="cut short: it holds 0 of its 100 frames"):
        read(path)
    path.write_bytes(whole[:700])
    with pytest.raises(FormatError, match=r"cut off in its parameters|more than the file holds"):
        read(path)


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("usual.trc", b"M1a", b"M0a", None),  # the second becomes "M0a (2)"
        ("usual.trc", b"\n50\t", b"\nx\t", r"frame rate must be 0\.001 to"),
        ("usual.trc", b"Frame#", b"Bild", "no line of names"),
        ("motive.csv", b"Position", b"Rotation", "which columns are the positions"),
        ("motive.csv", b"Frame,", b"Nr,", "no line of columns that begins with Frame"),
        ("nexus.csv", b"Trajectories", b"Joints", "no section Trajectories"),
        ("qualisys.tsv", b"NO_OF_MARKERS\t5", b"NO_OF_MARKERS\t6", "has 6 markers, but names 5"),
        ("qualisys.tsv", b"MARKER_NAMES", b"BODY_NAMES", "has no line MARKER_NAMES"),
        ("wide.csv", b",0.0200,", b",zwei,", r"wide\.csv:3: expected a number.*found 'zwei'"),
        ("long.csv", b"frame,time", b"a,b", "no column time or frame"),
    ],
)
def test_errors_name_the_fault_of_a_file(
    tmp_path: Path, name: str, old: bytes, new: bytes, message: str | None
) -> None:
    path = marker_files.write(tmp_path, name, cloud())
    reader = format_of(path).read_face
    data = path.read_bytes()
    assert old in data
    path.write_bytes(data.replace(old, new))
    if message is None:
        assert reader(path).names[:2] == ("M0a", "M0a (2)")
        return
    with pytest.raises(FormatError, match=message):
        reader(path)


@pytest.mark.parametrize("name", marker_files.MAKERS)
@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_damage_is_an_error_of_ours(tmp_path: Path, name: str) -> None:
    path = marker_files.write(tmp_path, name, cloud(4, 5))
    reader = format_of(path).read_face
    data = bytearray(path.read_bytes())
    random = np.random.default_rng(len(name))
    for _ in range(60):
        broken = bytearray(data)
        for place in random.integers(0, min(len(data), 1500), 3):
            broken[place] = random.integers(0, 256)
        path.write_bytes(broken[: random.integers(1, len(data) + 1)])
        with contextlib.suppress(FbaError):
            assert len(reader(path).names) > 0


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_motion_beyond_all_faps_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "far.tsv"
    path.write_bytes(
        b"NO_OF_FRAMES\t\nMARKER_NAMES\t1\t2.1\t1\t8.2\t8.3\t8.4\t1\t2\t3\t9.12\t9.15\t11.1\t11.2\r"
        b"\t\t\t\t\t\t\t\t\t0\t65000005\t0\n\t\t\t\t\t\t\t\t\t0\t0\t8\n\t\t\t\t\t\t\t\t\t0\t0\t1\t0\t-5\t0"
        b"\t\t\t\t\t\t\t\t\t\t\t\t\t0\t0\t1000\t0\t0\t5\t0\t600\t5\t0\t0\t8"
    )
    with pytest.raises(FbaError, match="further than FAPs can say"):
        fba.read(path, source_rate=30)


def test_limits_apply_to_markers(tmp_path: Path) -> None:
    path = marker_files.write(tmp_path, "wide.csv", cloud())
    with pytest.raises(LimitError):
        read(path, limits=Limits(frames=11))


def test_tables_of_something_else_are_not_taken(tmp_path: Path) -> None:
    for text in ("frame,x_0,x_1,y_0,y_1,z_0,z_1\n1,1,2,3,4,5,6\n", "a,b,c\n1,2,3\n"):
        path = tmp_path / "a.dat"
        path.write_text(text)
        with pytest.raises(FormatError, match="in no format known here"):
            format_of(path)


def test_headers_that_fuzzing_found(tmp_path: Path) -> None:
    """A line break within a cell, a frame in a century, a capture that lasts for years."""
    path = tmp_path / "a.csv"
    path.write_bytes(b"a\r,")
    with pytest.raises(FormatError):
        fba.read(path)
    path = tmp_path / "a.trc"
    path.write_bytes(marker_files.trc(cloud()).replace(b"\n50\t", b"\n1e-320\t"))
    with pytest.raises(FormatError, match=r"frame rate must be 0\.001 to"):
        read(path)
    path = tmp_path / "b.csv"
    path.write_bytes(marker_files.wide(cloud()).replace(b"\n11,0.2200", b"\n11,99999999.0"))
    with pytest.raises(LimitError, match=r"b\.csv: the capture at 50 frames/s has"):
        fba.read(path)
