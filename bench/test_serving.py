"""Live views: the processor time of a server with 200 viewers, and how late frames of a capture are."""

from __future__ import annotations

import asyncio
import json
import os
import socket
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import fba
from fba.codec import Decoder
from tools.captures import face_files

websockets = pytest.importorskip("websockets")
SAMPLE = Path(__file__).parents[1] / "fba" / "samples" / "hello.fap"
VIEWERS = 200
SECONDS = 10
RATE = 60


@contextmanager
def serving(*arguments: object) -> Iterator[tuple[subprocess.Popen[str], list[str]]]:
    """Start a command; give it and what it says until all is open."""
    command = [sys.executable, "-m", "fba", *map(str, arguments)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) as program:
        try:
            assert program.stderr is not None
            said = []
            for line in program.stderr:
                said.append(line)
                if "listening" in line or ("fba: open" in line and arguments[0] == "serve"):
                    break
            yield program, said
        finally:
            program.terminate()


def address(said: list[str]) -> str:
    return next(line.split()[-1] for line in said if "fba: open" in line).replace("http", "ws") + "stream"


def processor_seconds(number: int) -> float:
    """Return the seconds of the processor that a process has taken."""
    fields = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_many_viewers(benchmark: Any, report: Callable[[str], None]) -> None:
    """The share of a core that the server takes; frames per second are those of the file."""
    counts = [0] * VIEWERS

    async def watch(number: int, url: str) -> None:
        from websockets.asyncio.client import connect

        async with connect(url, compression=None, proxy=None) as viewer:
            async for message in viewer:
                counts[number] += isinstance(message, bytes)

    async def measure(program: subprocess.Popen[str], url: str) -> tuple[float, float]:
        viewers = [asyncio.create_task(watch(number, url)) for number in range(VIEWERS)]
        while not all(counts):
            await asyncio.sleep(0.1)
        before, begun, shown = processor_seconds(program.pid), time.monotonic(), sum(counts)
        await asyncio.sleep(SECONDS)
        passed = time.monotonic() - begun
        share = (processor_seconds(program.pid) - before) / passed
        frames = (sum(counts) - shown) / passed / VIEWERS
        for viewer in viewers:
            viewer.cancel()
        await asyncio.gather(*viewers, return_exceptions=True)
        return share, frames

    with serving("serve", SAMPLE, "--loop", "--port", 0) as (program, said):
        share, frames = benchmark.pedantic(
            lambda: asyncio.run(measure(program, address(said))), rounds=1, iterations=1
        )
    benchmark.extra_info.update(share=share, frames=frames)
    report(f"{VIEWERS} viewers: {100 * share:.0f} % of a core, {frames:.1f} frames a second each")


def test_a_frame_of_a_capture(benchmark: Any, report: Callable[[str], None]) -> None:
    """From a datagram to the decoded frame in another process, over the loopback."""
    from websockets.sync.client import connect

    Decoder().push(fba.encode(fba.read(SAMPLE)))  # or the first frames wait for compiled code
    count = SECONDS * RATE
    faces = face_files.livelink_udp({**face_files.face_weights(count), **face_files.face_angles(count)})
    late: list[float] = []

    sent: list[float] = []

    def send(port: int) -> None:
        begun = time.monotonic()
        with socket.socket(type=socket.SOCK_DGRAM) as sender:
            for number, face in enumerate(faces):
                time.sleep(max(begun + number / RATE - time.monotonic(), 0.0))
                sent.append(time.monotonic())
                sender.sendto(face, ("127.0.0.1", port))

    def measure(url: str, port: int) -> None:
        with connect(url, compression=None, proxy=None) as viewer:
            assert json.loads(viewer.recv())["event"] == "hello"
            sending = threading.Thread(target=send, args=(port,))
            sending.start()
            decoder = Decoder()
            while len(late) < count - RATE:
                message = viewer.recv(timeout=60)
                frames = decoder.push(message) if isinstance(message, bytes) else []
                late.extend(time.monotonic() - sent[frame.index] for frame in frames)
            sending.join()

    with serving("capture", "livelink", "--host", "127.0.0.1", "--port", 0, "--serve", 0) as (_, said):
        port = int(said[-1].split()[-1])
        benchmark.pedantic(lambda: measure(address(said), port), rounds=1, iterations=1)
    late = late[RATE:]  # the first second loads code
    slow = sorted(late)[int(0.95 * len(late))]
    benchmark.extra_info.update(median=statistics.median(late), slow=slow)
    report(
        f"{RATE} frames a second: {1000 * statistics.median(late):.0f} ms from a datagram to its frame, "
        f"{1000 * slow:.0f} ms in 95 % of them"
    )
