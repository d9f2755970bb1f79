"""`fba serve` and `fba capture --serve`, from the command line to a viewer."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, ConnectionClosedOK
from websockets.sync.client import ClientConnection, connect

import fba
from command_line import Run
from fba.codec import Decoder, encode_animation
from joinable_streams import JOINABLE, performance
from started_programs import started
from tools.captures.face_files import datagram

LOCAL = "127.0.0.1"
STREAM = encode_animation(performance(), JOINABLE)[0]


pytestmark = pytest.mark.usefixtures("interruptible")


@contextmanager
def serving(*arguments: object, **options: Any) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Start a command; give it and the address of its streams, once it has said that."""
    with started([sys.executable, "-m", "fba", *map(str, arguments)], **options) as program:
        assert program.stderr is not None
        address = next(line.split()[-1] for line in program.stderr if "fba: open" in line)
        yield program, address.replace("http:", "ws:")


def watch(address: str, path: str = "stream") -> tuple[list[dict[str, Any]], list[bytes]]:
    """Return texts and bytes up to the end, or where the connection closes."""
    texts: list[dict[str, Any]] = []
    data: list[bytes] = []
    with connect(address + path, compression=None, proxy=None) as viewer:
        while not texts or texts[-1]["event"] != "end":
            try:
                message = viewer.recv(timeout=120)
            except ConnectionClosed:
                break
            if isinstance(message, str):
                texts.append(json.loads(message))
            else:
                data.append(message)
    return texts, data


def arriving(viewer: ClientConnection, decoder: Decoder) -> Iterator[fba.Frame]:
    """Yield frames as they come, until the connection closes because the stream has ended."""
    while True:
        try:
            message = viewer.recv(timeout=120)
        except ConnectionClosedOK as closed:
            if closed.rcvd is None or closed.rcvd.code != 1000:
                raise
            return
        yield from decoder.push(message) if isinstance(message, bytes) else ()


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_files_are_shown_until_a_signal(tmp_path: Path, number: int) -> None:
    (tmp_path / "a <b>.fba").write_bytes(STREAM)
    other = fba.Animation(25, np.arange(10), performance()[:10].face)
    fba.write(tmp_path / "b.fap", other)
    with serving("serve", tmp_path / "a <b>.fba", tmp_path / "b.fap", "--port", 0) as (program, address):
        assert re.fullmatch(r"ws://127\.0\.0\.1:\d+/", address)
        texts, data = watch(address)
        assert texts[0] == {"event": "hello", "streams": ["a <b>.fba", "b.fap"], "stream": 0}
        assert [one["event"] for one in texts] == ["hello", "start", "end"]
        shown = fba.decode(b"".join(data))
        whole = fba.decode(STREAM)
        np.testing.assert_array_equal(shown.body.values, whole.body.values)
        texts, data = watch(address, "stream?n=1")
        assert texts[0]["stream"] == 1
        assert len(fba.decode(b"".join(data))) == 10
        program.send_signal(number)
        assert program.wait(60) == 0


def test_standard_input_ends_it() -> None:
    with serving("serve", "-", "--port", 0, "--host", LOCAL, stdin=subprocess.PIPE) as (program, address):
        assert re.fullmatch(r"ws://127\.0\.0\.1:\d+/[\w-]{20,}/", address)
        with connect(address + "stream", compression=None, proxy=None) as viewer:
            assert json.loads(viewer.recv(timeout=120))["streams"] == ["standard input"]
            program.stdin.buffer.write(STREAM)
            program.stdin.close()
            frames = list(arriving(viewer, Decoder()))
        assert len(frames) == len(fba.decode(STREAM))
        assert program.wait(60) == 0


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for one program")
def test_a_capture_goes_out_as_it_comes(tmp_path: Path) -> None:
    path, count = tmp_path / "a.fba", 300
    faces = [datagram([0.01 * (row % 90)] * 61, 100 + row / 64, rate=64) for row in range(count)]
    command = ["capture", "livelink", "--port", "0", "--host", LOCAL, "--serve", "0", "-o", str(path)]
    with serving(*command) as (program, address):
        assert program.stderr is not None
        port = next(int(line.split()[-1]) for line in program.stderr if "listening" in line)
        with (
            connect(address + "stream", compression=None, proxy=None) as viewer,
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
        ):
            assert json.loads(viewer.recv(timeout=120))["streams"] == ["Live Link Face"]
            for face in faces:
                sender.sendto(face, (LOCAL, port))
            decoder = Decoder()
            frames = list(islice(arriving(viewer, decoder), count // 2))
            late_texts: list[str] = []
            with connect(address + "stream", compression=None, proxy=None) as late:
                while len(late_texts) < 2:
                    message = late.recv(timeout=120)
                    late_texts += [message] if isinstance(message, str) else []
            assert json.loads(late_texts[1])["time"] >= 2  # not from the beginning
            program.send_signal(signal.SIGINT)
            frames += arriving(viewer, decoder)
        assert program.wait(60) == 0
    recorded = fba.read(path)
    values = np.concatenate([frame.face.values for frame in frames if frame.face is not None])
    np.testing.assert_array_equal(values, recorded.face.values)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["serve"], "Missing argument 'FILES...'"),
        (["serve", "-", "-"], "standard input (-) can be shown once"),
        (["capture", "livelink", "--play", "--serve-host", LOCAL], "--serve-host goes with --serve"),
        (["capture", "livelink", "--serve", "0", "--bitrate", "1500"], "--serve and --bitrate contradict"),
    ],
)
def test_mistakes(run: Run, arguments: list[str], said: str) -> None:
    assert said in run(*arguments, code=2).err


def test_ports_that_cannot_be_had_and_a_missing_package(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.fba"
    path.write_bytes(STREAM)
    with socket.create_server((LOCAL, 0)) as taken:
        port = taken.getsockname()[1]
        result = run("serve", path, "--port", port, code=1)
        assert f"127.0.0.1, port {port}: cannot be listened on: " in result.err
        assert "give another port" in result.err
    result = run("serve", path, "--host", "no.such.host.invalid", code=1)
    assert "give an address of this computer" in result.err
    (tmp_path / "b.fba").write_bytes(b"hello")
    run("serve", tmp_path / "b.fba", "--from", "fba", code=1)
    monkeypatch.setitem(sys.modules, "websockets.asyncio.server", None)
    assert "[serve]" in run("serve", path, code=1).err
