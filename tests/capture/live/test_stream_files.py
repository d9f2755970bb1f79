"""Files that are written live: complete at any moment, also where the program is killed."""

import io
import os
import random
import signal
import socket
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import pytest

import fba
from fba.animation import Animation
from fba.capture.live import widest_faces
from fba.codec import write_opening
from fba.errors import FbaError, FormatError
from fba.live import StreamFile, StreamRecorder
from fba.live.recording import StreamPipe
from fba.tracks import BodyTrack, FaceTrack
from started_programs import started
from tools.captures.face_files import datagram

FRAMES = 40


def performance(seed: int = 2) -> Animation:
    """A face and a body that move so much that ranges grow on the way."""
    rows = np.random.default_rng(seed).integers(-400, 400, (FRAMES, 68)).astype(np.int32)
    rows[FRAMES // 2 :] *= 20
    rows[:, :2] = 0
    mask = np.broadcast_to(np.arange(68) > 1, rows.shape)
    turns = np.zeros((FRAMES, 296), np.int32)
    turns[:, :20] = rows[:, 2:22] * 10
    return Animation(
        30, np.arange(FRAMES) * 2, FaceTrack(rows, mask), BodyTrack(turns, turns != 0 * turns + 7)
    )


@pytest.mark.parametrize("parts", [("face",), ("body",), ("face", "body")])
def test_a_file_holds_all_frames_but_the_last_at_any_moment(parts: tuple[str, ...], tmp_path: Path) -> None:
    whole = performance()
    whole = Animation(whole.rate, whole.index, *(getattr(whole, one) if one in parts else None
                                                  for one in ("face", "body")))  # fmt: skip
    path = tmp_path / "a.fba"
    recorder = StreamRecorder([StreamFile(path)])
    for frame in range(FRAMES):
        recorder.push(whole[frame : frame + 1])
        assert path.exists() == (frame > 0)
        if frame:
            with warnings.catch_warnings(action="error"):  # as for one that was cut off
                assert len(fba.read(path)) == frame
    recorder.finish()
    at_once = fba.Encoder(recorder.options)
    at_once.expect(widest_faces())
    assert path.read_bytes() == at_once.push_animation(whole) + at_once.finish()
    assert recorder.size == path.stat().st_size


def test_an_older_file_stays_until_there_are_frames(tmp_path: Path) -> None:
    path = tmp_path / "a.fba"
    path.write_bytes(b"x" * 100_000)
    recorder = StreamRecorder([StreamFile(path)])
    recorder.finish()
    assert path.stat().st_size == 100_000
    recorder = StreamRecorder([StreamFile(path)])
    recorder.push(performance()[:3])
    assert len(fba.read(path)) == 2
    recorder.finish()
    with pytest.raises(FormatError, match="cannot be written"):
        StreamFile(tmp_path / "no/folder.fba")


SENDS = 200


def _frames_in(path: Path) -> int:
    """Return the frames of a stream that is being written; 0 before there are any."""
    try:
        return len(fba.read(path))
    except FbaError:
        return 0


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGKILL")
def test_a_killed_program_leaves_a_stream_of_all_frames_but_the_last(tmp_path: Path) -> None:
    sent = [datagram([0.01 * (row % 90)] * 61, 100 + row / 64, rate=64) for row in range(SENDS)]
    path, count = tmp_path / "a.fba", random.randint(30, SENDS)
    command = [sys.executable, "-m", "fba", "capture", "livelink", "--port", "0", "--host", "127.0.0.1"]
    command += ["-o", str(path)]
    with started(command) as program:
        assert program.stderr is not None
        port = next((int(line.split()[-1]) for line in program.stderr if "listening" in line), None)
        assert port is not None
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for one in sent[:count]:
                sender.sendto(one, ("127.0.0.1", port))
        while program.poll() is None and _frames_in(path) != count - 1:
            time.sleep(0.02)
        assert program.poll() is None
        program.send_signal(signal.SIGKILL)
    with warnings.catch_warnings(action="error"):  # as for a file that was cut off
        assert len(fba.read(path)) == count - 1


def test_a_pipe_gets_what_is_complete() -> None:
    whole, target = performance(), io.BytesIO()
    recorder = StreamRecorder([StreamPipe(target)])
    for frame in range(FRAMES):
        recorder.push(whole[frame : frame + 1])
    recorder.finish()
    at_once = fba.Encoder(recorder.options)
    at_once.expect(widest_faces())
    stream = at_once.push_animation(whole) + at_once.finish()
    assert target.getvalue() == write_opening("visage") + stream


@pytest.mark.parametrize("size", [1, 1000])
def test_a_pipe_names_the_steps_before_a_body_and_a_file_does_not(tmp_path: Path, size: int) -> None:
    body = BodyTrack(np.full((4, 296), 170, np.int32), np.arange(296) == np.full((4, 1), 31))
    whole, target = Animation(25, np.arange(4), None, body), io.BytesIO()
    recorder = StreamRecorder([StreamPipe(target), StreamFile(tmp_path / "live.fba")])
    for frame in range(4):
        recorder.push(whole[frame : frame + 1])
    recorder.finish()
    file = (tmp_path / "live.fba").read_bytes()
    assert target.getvalue() == write_opening("visage") + file
    decoder, data = fba.Decoder(), target.getvalue()
    with warnings.catch_warnings(action="error"):
        frames = [f for at in range(0, len(data), size) for f in decoder.push(data[at : at + size])]
        frames += decoder.finish()
    assert [int(frame.body.values[0, 31]) for frame in frames if frame.body is not None] == [170] * 4


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no full device")
def test_a_full_disk() -> None:
    recorder = StreamRecorder([StreamFile("/dev/full")])
    recorder.push(performance()[:1])
    with pytest.raises(FormatError, match="could not be written"):
        recorder.push(performance()[1:9])
    for target in recorder.targets:
        target.close()
