"""`fba.Limits`: what is beyond them is refused with the limit, what was found, and the option that helps.

Files that grow: reading takes time in proportion to their length, and 20 times their length and 200 MB of
memory at most, whatever they repeat. What is refused, is refused with an error of ours.
"""

import json
import os
import subprocess
import sys
import tracemalloc
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import fba
from fba import Animation, FaceTrack, Limits
from fba.cli.main import main
from fba.errors import LimitError, ModelError
from gltf_edits import with_keys
from hostile_files import bvh, capture, encode_capture, hostile_files, png, skeleton, surface

SMALL, LARGE = (200_000, 800_000) if os.environ.get("FBA_FUZZ") == "long" else (15_000, 60_000)
HELPERS = Path(__file__).parent / "helpers" / "files"


def face(*index: int, rate: int = 25) -> Animation:
    values, mask = np.zeros((len(index), 68), dtype=np.int32), np.zeros((len(index), 68), dtype=bool)
    mask[:, 2] = True
    return Animation(Fraction(rate), np.array(index), FaceTrack(values, mask))


@pytest.mark.parametrize("name", ["frames", "bytes", "pixels", "seconds"])
@pytest.mark.parametrize("value", [0, -1, 1.5, "7"])
def test_a_limit_is_a_positive_integer(name: str, value: object) -> None:
    with pytest.raises(ValueError, match=f"{name} must be a positive integer"):
        Limits(**{name: value})  # type: ignore[arg-type]


def test_the_last_that_is_allowed_and_the_first_that_is_not() -> None:
    limits = Limits(frames=10, bytes=100, pixels=12, seconds=60)
    limits.check_frames(10, "it")
    limits.check_bytes(100 + 20 * 7, "it", source=7)
    limits.check_pixels(3, 4, "it")
    limits.check_seconds(60, "it")
    for check, name, found, allowed in (
        (lambda: limits.check_frames(11, "it"), "frames", 11, 10),
        (lambda: limits.check_bytes(241, "it", source=7), "bytes", 241, 240),
        (lambda: limits.check_pixels(13, 1, "it"), "pixels", 13, 12),
        (lambda: limits.check_seconds(61, "it"), "seconds", 61, 60),
    ):
        with pytest.raises(LimitError, match=f"more than the {allowed} that the limit `{name}`") as caught:
            check()
        assert (caught.value.limit, caught.value.found, caught.value.allowed) == (name, found, allowed)


def test_the_limit_that_the_error_asks_for_is_enough() -> None:
    far = face(0, 1000, rate=1)
    with pytest.raises(LimitError, match=r"raise it with limits=fba.Limits\(bytes=\d+\)") as caught:
        far.resample(25, limits=Limits(bytes=1_000_000))
    argument = caught.value.remedies[0].value
    assert far.resample(25, limits=eval(argument)).index[-1] == 25 * 1000


def test_two_frames_a_day_apart_are_not_filled_up_by_default() -> None:
    with pytest.raises(LimitError, match="of memory"):
        face(0, 31 * 3600, rate=1).resample(25)


def test_time_codes_far_apart(tmp_path: Path) -> None:
    with pytest.raises(LimitError, match="lasts 700000 s, more than the 604800"):
        face(0, 699_999, rate=1).resample(2)


def test_a_stream_of_too_many_frames() -> None:
    data = fba.encode(face(*range(50)))
    assert len(fba.decode(data, limits=Limits(frames=50))) == 50
    with pytest.raises(LimitError, match="the stream has 50 frames, more than the 49"):
        fba.decode(data, limits=Limits(frames=49))


def test_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def run(*arguments: str) -> tuple[int, str]:
        with pytest.raises(SystemExit) as stop:
            main(list(arguments))
        return int(stop.value.code or 0), capsys.readouterr().err

    source, target = tmp_path / "long.fba", tmp_path / "long.fap"
    fba.write(source, face(*range(50)))
    convert = ("convert", str(source), str(target))
    code, text = run(*convert, "--limit", "frames=49")
    assert code == 1
    assert f"{source}: the stream has 50 frames, more than the 49" in text
    assert "raise it with --limit frames=50" in text
    assert not target.exists()
    assert run(*convert, "--limit", "frames=5e1", "--limit", "bytes=1000000")[0] == 0
    for value, message in (
        (
            "frame=1",
            "there is no limit 'frame' (did you mean 'frames'?); they are frames, bytes, pixels, seconds",
        ),
        ("frames", "'' is not a number; write e.g. frames=6000000"),
        ("frames=0", "a limit is a whole number from 1 to"),
    ):
        code, text = run(*convert, "--limit", value)
        assert code == 2
        assert message in " ".join(text.split())


@pytest.mark.parametrize(
    "command", ["bench", "convert", "decode", "encode", "gait", "info", "play", "render", "stats"]
)
def test_commands_that_read_files_take_limits(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main([command, "--help"])
    assert "--limit NAME=VALUE" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="memory is measured through /proc")
def test_time_and_memory_grow_no_faster_than_files(tmp_path: Path) -> None:
    pytest.importorskip("av")
    from measured_reading import SLOWER, SPARE_SECONDS

    done = subprocess.run(
        [sys.executable, str(HELPERS / "measured_reading.py"), str(tmp_path), str(SMALL), str(LARGE)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "FBA_CACHE": str(tmp_path / "cache")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    results = json.loads(done.stdout)
    assert len(results) == len(hostile_files())
    findings = []
    for result in results:
        small, large = result["small"], result["large"]
        if large["seconds"] > SLOWER * small["seconds"] + SPARE_SECONDS:
            findings.append(f"{result['name']}: {small['seconds']:.2f} s, then {large['seconds']:.2f} s")
        if large["memory"] > 20 * large["bytes"] + 200e6:
            findings.append(f"{result['name']}: {large['bytes']} bytes take {large['memory'] / 1e6:.0f} MB")
        findings += [f"{result['name']}: {one['outcome']}" for one in (small, large) if one["outcome"]]
    assert not findings, "\n".join(findings)


def _growth(read: Callable[[Path], object], paths: list[Path]) -> float:
    """Return bytes of memory for each byte that the second file is longer than the first."""
    peaks = []
    for path in paths:
        tracemalloc.start()
        try:
            read(path)
            peaks.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
    lengths = [path.stat().st_size for path in paths]
    return (peaks[1] - peaks[0]) / (lengths[1] - lengths[0])


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_a_capture_of_short_lines_and_many_frames(tmp_path: Path) -> None:
    """150 bytes a frame become 296 BAPs: 1480 bytes, if those that are not sent were stored as well."""
    paths = [tmp_path / "short.bvh", tmp_path / "long.bvh"]
    for path, frames in zip(paths, (600, 2400), strict=True):
        path.write_bytes(capture(148 * frames))
    encode_capture(paths[0])
    assert _growth(encode_capture, paths) < 20


def test_many_keys_in_one_channel_of_our_own_file(tmp_path: Path) -> None:
    """20 bytes a key turn into all BAPs that the file sends."""
    mask = np.zeros((2, 296), dtype=bool)
    mask[:, :186] = True
    body = fba.BodyTrack(np.zeros(mask.shape, dtype=np.int32), mask)
    fba.write(tmp_path / "a.glb", fba.Animation(25, np.arange(2), None, body))
    paths = [tmp_path / "short.glb", tmp_path / "long.glb"]
    for path, keys in zip(paths, (1000, 4000), strict=True):
        path.write_bytes(with_keys((tmp_path / "a.glb").read_bytes(), keys))
    assert len(fba.read(paths[0])) == 1000
    assert _growth(fba.read, paths) < 50  # 37 of them the 186 values of a key


def test_two_keys_hours_apart(tmp_path: Path) -> None:
    path = tmp_path / "a.glb"
    path.write_bytes(skeleton(last=16_000.0))
    with pytest.raises(
        LimitError, match=r"a\.glb: animation 'animation 0', 16000 s at .* raise it with limits"
    ):
        fba.read(path)
    path.write_bytes(skeleton(last=1e6))
    with pytest.raises(LimitError, match="lasts 1000000 s, more than the 604800"):
        fba.read(path)


def test_a_limit_can_be_raised(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(bvh(channels=1, motion="Frames: 300\nFrame Time: 0.04\n" + "1\n" * 300))
    with pytest.raises(LimitError, match="`bytes`"):
        fba.read(path, limits=fba.Limits(bytes=100_000))
    with pytest.raises(LimitError, match="`frames`"):
        fba.read(path, limits=fba.Limits(frames=299))
    assert len(fba.read(path, limits=fba.Limits(frames=300))) == 300


def test_a_picture_of_169_million_pixels() -> None:
    pytest.importorskip("PIL")
    from fba_player._mesh.textures import load_picture

    with pytest.raises(
        LimitError, match="13000 x 13000 pixels, more than the 67108864 that the limit `pixels`"
    ):
        load_picture(_wide(png(8, 8), 13_000))
    with pytest.raises(LimitError, match=r"6000 x 6000 pixels, takes 288000000 bytes of memory"):
        load_picture(_wide(png(8, 8), 6_000))
    assert load_picture(png(4096, 16)).size == (4096, 16)


def _wide(picture: bytes, side: int) -> bytes:
    """Return a PNG that claims other measures: what they are is checked before anything is decoded."""
    import struct
    import zlib

    header = struct.pack(">4sII", b"IHDR", side, side) + picture[24:29]
    return picture[:12] + header + struct.pack(">I", zlib.crc32(header)) + picture[33:]


def test_a_thousand_planes_that_skip_a_million_frames(tmp_path: Path) -> None:
    file = hostile_files()["epf skips"]
    path, size = file.write(tmp_path, 24_000)
    assert size < 25_000
    with pytest.raises(LimitError, match=r"a\.epf:\d+: what is to be coded, with the frames skipped, has"):
        file.read(path)


def test_more_parts_than_a_face_has(tmp_path: Path) -> None:
    file = hostile_files()["obj groups"]
    path, _ = file.write(tmp_path, 40_000)
    with pytest.raises(ModelError, match="groups and materials have polygons; at most 1000 are read"):
        file.read(path)


def test_a_skeleton_of_more_joints_than_are_read(tmp_path: Path) -> None:
    path = tmp_path / "a.glb"
    path.write_bytes(skeleton(nodes=4100))
    with pytest.raises(fba.FormatError, match=r"the skeleton has \d+ joints, more than 4096"):
        fba.read(path)


def test_many_surfaces_of_one_name_have_different_names(tmp_path: Path) -> None:
    from fba.gltf import read_gltf, surfaces

    path = tmp_path / "a.glb"
    path.write_bytes(surface(meshes=3, name="head"))
    assert [one.name for one in surfaces(read_gltf(path))] == ["head", "head 2", "head 3"]


def test_a_text_of_more_frames_than_allowed(tmp_path: Path) -> None:
    file = hostile_files()["fap masks"]
    path, _ = file.write(tmp_path, 200)  # one frame
    assert len(fba.read(path, limits=fba.Limits(frames=1))) == 1
    path, _ = file.write(tmp_path, 2000)
    with pytest.raises(LimitError, match=r"a\.fap: the file has 13 frames, more than the 12"):
        fba.read(path, limits=fba.Limits(frames=12))
