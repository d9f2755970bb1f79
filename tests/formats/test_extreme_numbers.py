"""Cut and arbitrary texts, and numbers that no honest file has: refused with their place, or a result."""

import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import fba
from fba.errors import FbaError, FbaWarning, FormatError, LimitError, ModelError
from fba.face.importers.points.points_file import read_points
from fba.formats import read
from fba.formats.bvh._reader import read_motion
from fba.formats.c3d._reader import read_markers
from fba.formats.face_tables._points_arrays import read_points as read_film
from fba.formats.text.fap import read_fap, write_fap
from fba.mesh._ply import read_ply
from fba.mesh._vrml import read_vrml
from fba.mesh._wfm import read_wfm
from format_files import mask
from sound_clicks import write_wave

CORPUS = Path(__file__).parents[1] / "fuzz/corpus"
BVH = """HIERARCHY
ROOT Hips
{
OFFSET 0 0 0
CHANNELS 3 Zrotation Xrotation Yrotation
End Site
{
OFFSET 0 1 0
}
}
MOTION
Frames: 1
Frame Time: %s
0 0 0
"""


@pytest.mark.parametrize("digits", [20, 400])
def test_indices_beyond_int64(tmp_path: Path, digits: int) -> None:
    number = "1" * digits
    wfm = tmp_path / "a.wfm"
    wfm.write_text(f"3\n0 0 0\n1 0 0\n0 1 0\n1\n0 1 {number}\n")
    with pytest.raises(ModelError, match=r"a\.wfm:6: a vertex must be a whole number"):
        read_wfm(wfm)
    vrml = tmp_path / "a.wrl"
    vrml.write_text(
        "#VRML V2.0 utf8\n"
        "Shape { geometry IndexedFaceSet { coord Coordinate { point [0 0 0, 1 0 0, 0 1 0] }\n"
        f"coordIndex [0, 1, {number}, -1] }} }}\n"
    )
    with pytest.raises(ModelError, match=r"a\.wrl:3: an index must be a whole number"):
        read_vrml(vrml)


@pytest.mark.parametrize("count", ["inf", "-inf", "nan", "1e30", "3.5"])
def test_invalid_counts_of_corners(tmp_path: Path, count: str) -> None:
    ply = tmp_path / "a.ply"
    ply.write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list float int vertex_indices\nend_header\n"
        f"0 0 0\n1 0 0\n0 1 0\n{count} 0 1 2\n"
    )
    with pytest.raises(ModelError, match=r"a\.ply"):
        read_ply(ply)


def test_a_point_of_four_hundred_digits(tmp_path: Path) -> None:
    path = tmp_path / "points.json"
    path.write_text(f'{{"2.1": [0, 1{"0" * 400}, 0]}}')
    with pytest.raises(ModelError, match=r"feature point 2\.1 must be \[x, y, z\]"):
        read_points(path)


@pytest.mark.parametrize("time", ["1e-" + "0" * 5000, "1e-" + "0" * 5000 + "1", "0.04" + "0" * 5000])
def test_frame_times_of_many_digits_are_numbers(tmp_path: Path, time: str) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(BVH % time)
    assert read_motion(path).rate > 0


@pytest.mark.parametrize("time", ["1e-99999", "1e99999", "1e-" + "9" * 5000, "nan", "0." + "0" * 5000 + "1"])
def test_invalid_frame_times(tmp_path: Path, time: str) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(BVH % time)
    with pytest.raises(FormatError, match=r"a\.bvh:13"):
        read_motion(path)


@pytest.mark.parametrize("value", [-1e308, 1e308, 1e307, 1e200, 3e38])
def test_translations_that_overflow(tmp_path: Path, value: float) -> None:
    node = {"name": "Hips", "translation": [value, value, 0], "scale": [1e10, 1, 1], "children": [1]}
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps({
        "asset": {"version": "2.0"},
        "nodes": [node, {"name": "Spine", "translation": [value, 0, 0]}],
        "scenes": [{"nodes": [0]}],
    }))  # fmt: skip
    with pytest.raises(FbaError, match=r"a\.gltf"):
        fba.read(path)


def test_joints_without_channels_in_many_frames(tmp_path: Path) -> None:
    """Each would take 32 bytes a frame, of which the file has none."""
    joints = "".join(f"JOINT j{number}\n{{\nOFFSET 0 0 0\nCHANNELS 0\n" for number in range(900))
    path = tmp_path / "a.bvh"
    head, rest = (BVH % 0.01).split("End Site")
    end, rest = rest.split("MOTION")
    closing = "}\n" * 900
    frames = rest.replace("Frames: 1", "Frames: 20000").replace("\n0 0 0\n", "\n" + "0 0 0\n" * 20_000)
    path.write_text(f"{head}{joints}End Site{end[:-3]}{closing}}}\nMOTION{frames}")
    with pytest.raises(LimitError, match=r"a\.bvh: a motion of 901 joints, .* and 20000 frames takes"):
        read_motion(path)


@pytest.mark.parametrize("rate", [1, 999, 1_000_001, 537_000_000])
def test_a_sound_of_a_rate_that_no_device_has(tmp_path: Path, rate: int) -> None:
    pytest.importorskip("av")
    from fba.audio import SoundFile

    path = write_wave(tmp_path / "a.wav", bytes(1000), rate, width=1)
    with pytest.raises(FormatError, match=f"claims {rate} samples a second; 1000 to 1000000 can be read"):
        SoundFile(path)


@pytest.mark.parametrize("channels", [64, 4095])
def test_more_channels_than_can_be_mixed(tmp_path: Path, channels: int) -> None:
    pytest.importorskip("av")
    from fba.audio import SoundFile

    path = write_wave(tmp_path / "a.wav", [1000] * channels * 100, 8000, channels)
    with pytest.warns(UserWarning, match="left out"), pytest.raises(FormatError, match="no sound"):
        SoundFile(path).read(0, np.iinfo(np.int16).max)


SIGNALS = {"<": b"\1\0\x80\x7f", ">": b"\x7f\x80\0\1", "vax": b"\x80\x7f\1\0"}
"""A NaN that signals, of 32 bits. NumPy warns when it is converted."""


@pytest.mark.parametrize(("name", "signal"), [("float", "<"), ("dec", "vax")])
def test_markers_whose_places_signal_are_missing(name: str, signal: str, tmp_path: Path) -> None:
    data = bytearray((CORPUS / f"capture/markers_{name}_c3d.bin").read_bytes())
    start = 512 * (int.from_bytes(data[16:18], "little") - 1)
    data[start : start + 4] = SIGNALS[signal]
    path = tmp_path / "a.c3d"
    path.write_bytes(data)
    assert np.isnan(read_markers(path).positions[0, 0, 0])


def test_points_that_signal_are_not_seen(tmp_path: Path) -> None:
    points = np.load(CORPUS / "capture/points-points.npy.bin").astype(np.float32)
    points.ravel()[:1] = np.frombuffer(SIGNALS["<"], np.float32)
    np.save(tmp_path / "a.npy", points)
    assert np.isnan(read_film(tmp_path / "a.npy", source_rate=25).positions[0, 0]).all()


WORDS = (
    b"", b" ", b"\n", b"\r", b"#", b"0", b"1", b"-1", b"2", b"1e308", b"-1e999", b"inf", b"nan", b".5",
    b"99999999999999999999",
    b"\0", b"\xff", b"1" * 70_000, b"2.1 a 25 1\n", b"3.2", b"1/0",
    b"29.97", b"FBM 3\n", b"ISI 0\n", b"FIX", b"x", b"+", b"\t", b"1 " * 68,
)  # fmt: skip

FAP = "\n".join(
    [
        "# c",
        "2.1 a b 25 3",
        mask(1, 2, 3, 50),
        "0 1 2 3 1 1 2 3 4 1 0 77 -5",
        mask(3),
        "1 5.5",
        mask(3, 68),
        "3 5 6",
        "",
    ]
).encode()


def test_cut_at_every_byte(tmp_path: Path) -> None:
    path = tmp_path / "a.fap"
    frames = []
    for end in range(1, len(FAP)):
        path.write_bytes(FAP[:end])
        with warnings.catch_warnings(action="error"):
            warnings.simplefilter("ignore", FbaWarning)
            try:
                frames.append(len(read_fap(path, salvage=True)))
            except FbaError:
                assert not frames or frames[-1] == 0, "once there is a frame, salvage keeps it"
    assert frames == sorted(frames)
    assert frames[-1] == 3


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.binary(max_size=300)
    | st.text(max_size=300).map(str.encode)
    | st.lists(st.sampled_from(WORDS)).map(b" ".join)
)
@example(b"\xef\xbb\xbf")  # a byte order mark and nothing else
def test_anything_at_all(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "a.fap"
    path.write_bytes(data)
    with warnings.catch_warnings(action="error"):
        warnings.simplefilter("ignore", FbaWarning)
        try:
            animation = read(path, source_rate=25) if data[:4] not in (b"\0\0\1\xba", b"\0\0\1\1") else None
            if animation is not None:
                write_fap(tmp_path / "b.fap", animation)
        except FbaError:
            pass
