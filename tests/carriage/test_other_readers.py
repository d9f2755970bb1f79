"""What other programs find in an MP4 file: PyAV, ffprobe, `ffmpeg -c copy`, MediaInfo and mp4box.js.

In each, samples have the same bytes and the same sync flags. Those that are not installed are skipped: ffmpeg
is a system package (`./dev system ffmpeg`), mp4box.js comes with `./dev web`, the others with `./dev setup`.
"""

import json
import shutil
import subprocess
from fractions import Fraction
from hashlib import sha256
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fba
from fba import Animation, EncoderOptions, FaceTrack
from fba.carriage.mp4 import PlaneSamples, SoundTrack, list_tracks, read_mp4, split_samples, write_mp4
from fba.codec import encode_animation
from fba_player.sound.coded_sound import read_coded_sound
from joinable_streams import JOINABLE, performance
from sound_clicks import write_wave

ROOT = Path(__file__).parents[2]
MP4BOX = ROOT / "player/fba_player/web/node_modules/mp4box/dist/mp4box.all.mjs"
needs_ffmpeg = pytest.mark.skipif(
    shutil.which("ffmpeg") is None or shutil.which("ffprobe") is None, reason="no ffmpeg here"
)
needs_mp4box = pytest.mark.skipif(
    shutil.which("node") is None or not MP4BOX.is_file(), reason="no mp4box.js here: ./dev web installs it"
)
av = pytest.importorskip("av")
KINDS = ("whole", "fragments", "sound", "sound in fragments", "skips", "one frame", "face alone")


def skipping() -> Animation:
    values, mask = np.zeros((60, 68), dtype=np.int32), np.zeros((60, 68), dtype=bool)
    values[:, 2], mask[:, 2] = np.arange(60) * 7 % 200, True
    index = np.cumsum(np.arange(60) % 5 + 1)
    return Animation(Fraction(30_000, 1001), index - index[0], FaceTrack(values, mask))


def voice(folder: Path) -> SoundTrack:
    """A second of a tone as AAC."""
    return read_coded_sound(write_wave(folder / "tone.wav", 8000 * np.sin(np.arange(48_000) / 20), 48_000))


@pytest.fixture(scope="module", params=KINDS)
def made(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, bytes, PlaneSamples]:
    """A file, its stream, and the samples that must be in it."""
    kind: str = request.param
    animation = {
        "skips": skipping(),
        "one frame": performance()[:1],
        "face alone": performance(body=False),
    }.get(kind, performance())
    options = EncoderOptions(intra_period=Fraction(1)) if kind == "skips" else JOINABLE
    stream = encode_animation(animation, options)[0]
    path = tmp_path_factory.mktemp("made") / f"{kind.replace(' ', '_')}.fba.mp4"
    sound = voice(path.parent) if "sound" in kind else None
    path.write_bytes(write_mp4(stream, sound=sound, fragment=1 if "fragments" in kind else None))
    return path, stream, split_samples(stream)


def durations(samples: PlaneSamples) -> list[Fraction]:
    index = [*samples.index.tolist(), int(samples.index[-1]) + 1]
    return [Fraction(after - before) / samples.rate for before, after in pairwise(index)]


def test_pyav(made: tuple[Path, bytes, PlaneSamples]) -> None:
    path, _, samples = made
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        packets = [packet for packet in container.demux(stream) if packet.size]
        assert bytes(stream.codec_context.extradata) == samples.configuration
        assert stream.codec_context.name == "mpeg4"
    assert tuple(bytes(packet) for packet in packets) == samples.planes
    assert [packet.is_keyframe for packet in packets] == samples.sync.tolist()
    first = int(samples.index[0])
    times = [packet.pts * packet.time_base for packet in packets]
    assert times == [Fraction(int(index) - first) / samples.rate for index in samples.index]


@needs_ffmpeg
def test_ffprobe(made: tuple[Path, bytes, PlaneSamples]) -> None:
    path, _, samples = made
    asked = [
        "-show_packets", "-show_streams", "-show_data_hash", "sha256", "-select_streams", "v", "-of",
        "json",
    ]  # fmt: skip
    done = subprocess.run(["ffprobe", "-v", "fatal", *asked, str(path)], capture_output=True, check=True)
    found = json.loads(done.stdout)
    (stream,) = found["streams"]
    assert (stream["codec_name"], stream["codec_tag_string"]) == ("mpeg4", "mp4v")
    assert stream["extradata_size"] == len(samples.configuration)
    if samples.configuration[4] == 0x61:
        assert stream["profile"] == "Simple Face Animation Profile"
    digests = [packet["data_hash"].removeprefix("SHA256:") for packet in found["packets"]]
    assert digests == [sha256(plane).hexdigest() for plane in samples.planes]
    assert ["K" in packet["flags"] for packet in found["packets"]] == samples.sync.tolist()


@needs_ffmpeg
def test_ffmpeg_copies_samples(made: tuple[Path, bytes, PlaneSamples], tmp_path: Path) -> None:
    """Each to a file of its own. To another MP4 file ffmpeg copies no video without a picture size."""
    path, _, samples = made
    copy = ["-map", "0:v", "-c", "copy", "-f", "image2", str(tmp_path / "%06d.bin")]
    subprocess.run(["ffmpeg", "-v", "fatal", "-nostdin", "-i", str(path), *copy], check=True)
    copied = [file.read_bytes() for file in sorted(tmp_path.glob("*.bin"))]
    assert tuple(copied) == samples.planes


@needs_ffmpeg
def test_ffmpeg_copies_and_decodes_the_sound(made: tuple[Path, bytes, PlaneSamples], tmp_path: Path) -> None:
    path, _, _ = made
    if len(list_tracks(path.read_bytes())) == 1:
        pytest.skip("a file without sound")
    for coding, name in (("copy", "a.m4a"), ("pcm_s16le", "a.wav")):
        target = tmp_path / name
        command = [
            "ffmpeg",
            "-v",
            "error",
            "-nostdin",
            "-i",
            str(path),
            "-map",
            "0:a",
            "-c:a",
            coding,
            str(target),
        ]
        subprocess.run(command, check=True, stderr=subprocess.PIPE)
        with av.open(str(target)) as container:
            length = sum(frame.samples for frame in container.decode(audio=0))
        assert 48_000 <= length <= 48_000 + 2048  # the last frame of AAC, and the run-up in fragments


def test_mediainfo(made: tuple[Path, bytes, PlaneSamples]) -> None:
    media = pytest.importorskip("pymediainfo").MediaInfo
    if not media.can_parse():
        pytest.skip("pymediainfo has no library here")
    path, _, samples = made
    found = {track.track_type: track for track in media.parse(str(path)).tracks}
    general, video = found["General"], found["Video"]
    assert general.format == "MPEG-4"
    assert (video.format, video.codec_id) == ("MPEG-4 Visual", "mp4v-20")
    assert int(video.frame_count) == len(samples.planes)
    assert abs(int(video.duration) - 1000 * float(sum(durations(samples)))) <= 1
    assert ("Audio" in found) == ("sound" in path.name)
    if "Audio" in found:
        assert (found["Audio"].format, found["Audio"].sampling_rate) == ("AAC", 48_000)


@needs_mp4box
def test_mp4box(made: tuple[Path, bytes, PlaneSamples]) -> None:
    path, _, samples = made
    first, *sounds = run_mp4box(path)
    assert (first["type"], first["codec"], first["count"]) == ("video", "mp4v", len(samples.planes))
    found = first["samples"]
    assert [sample["digest"] for sample in found] == [sha256(plane).hexdigest() for plane in samples.planes]
    assert [sample["sync"] for sample in found] == samples.sync.tolist()
    assert [Fraction(sample["duration"], first["timescale"]) for sample in found] == durations(samples)
    assert [sound["codec"] for sound in sounds] == ["mp4a.40.2"] * ("sound" in path.name)


@needs_mp4box
def test_mp4box_cuts_the_file_into_segments(made: tuple[Path, bytes, PlaneSamples], tmp_path: Path) -> None:
    """Which are read here: a writer of fragments that is not ours."""
    path, stream, samples = made
    run_mp4box(path, tmp_path / "segments.mp4")
    read = read_mp4((tmp_path / "segments.mp4").read_bytes())
    assert read.planes == len(samples.planes)
    assert read.fragmented
    assert fba.decode(read.stream) == fba.decode(stream)


def run_mp4box(path: Path, *segments: Path) -> list[dict[str, Any]]:
    program = Path(__file__).with_name("read_mp4box.mjs")
    command = ["node", str(program), str(MP4BOX), str(path), *map(str, segments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found: list[dict[str, Any]] = json.loads(done.stdout.splitlines()[-1])
    return found
