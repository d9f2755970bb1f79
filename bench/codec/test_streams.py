"""Streams over a network: how late frames are, and the processor time of a sender of 200 streams."""

from __future__ import annotations

import heapq
import socket
import statistics
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

import fba
from fba.codec import Decoder, EncoderOptions, encode_animation
from fba.live.addresses import StreamAddress
from fba.live.streams import Pacer, StreamReceiver, StreamSender, repeated
from fba.serving import Plane, split_stream

SAMPLE = Path(__file__).parents[2] / "fba" / "samples" / "hello.fap"
LOCAL = "127.0.0.1"
STREAMS = 200
SECONDS = 10
OPTIONS = EncoderOptions(clamp=True, start_codes=True, intra_period=1)


@pytest.fixture(scope="module")
def planes() -> list[Plane]:
    """A face of 25 frames a second."""
    return split_stream(encode_animation(fba.read(SAMPLE), OPTIONS)[0])[0]


def free_port() -> int:
    with socket.socket(type=socket.SOCK_DGRAM) as opened:
        opened.bind((LOCAL, 0))
        return int(opened.getsockname()[1])


@pytest.mark.parametrize("scheme", ["rtp", "tcp"])
def test_a_frame(benchmark: Any, planes: list[Plane], scheme: Any, report: Callable[[str], None]) -> None:
    """From a plane that is handed to the sender to the decoded frame, over the loopback."""
    sent: list[float] = []
    late: list[float] = []
    address = StreamAddress(scheme, LOCAL, free_port())

    def send() -> None:
        with StreamSender(address) as sender:
            for plane, seconds in repeated(planes, Pacer()):
                sent.append(time.monotonic())
                sender.send(plane, seconds)
            sender.finish()

    def measure() -> None:
        sent.clear()
        late.clear()
        decoder = Decoder()
        with StreamReceiver(address, wait=60) as receiver:
            thread = threading.Thread(target=send)
            thread.start()
            while part := receiver.read1():
                frames = decoder.push(part)
                late.extend(time.monotonic() - sent[frame.index] for frame in frames)
            thread.join()

    benchmark.pedantic(measure, rounds=1, iterations=1)
    slow = sorted(late)[int(0.95 * len(late))]
    benchmark.extra_info.update(median=statistics.median(late), slow=slow)
    report(
        f"{scheme}, 25 planes a second: {1000 * statistics.median(late):.1f} ms from a plane to its frame, "
        f"{1000 * slow:.1f} ms in 95 % of them"
    )


def test_many_streams(benchmark: Any, planes: list[Plane], report: Callable[[str], None]) -> None:
    """The share of a core that a process takes to send streams that begin at different moments."""
    shares: list[float] = []
    packets: list[float] = []

    def shifted(number: int) -> Iterator[tuple[float, int, Plane]]:
        for round_ in range(1 + SECONDS * 25 // len(planes)):
            for plane in planes:
                yield plane.time + round_ * 9.6 + number / STREAMS, number, plane

    def send() -> None:
        with ExitStack() as stack:
            target = stack.enter_context(socket.socket(type=socket.SOCK_DGRAM))
            target.bind((LOCAL, 0))  # it takes what it has room for
            address = StreamAddress("rtp", LOCAL, int(target.getsockname()[1]))
            senders = [stack.enter_context(StreamSender(address)) for _ in range(STREAMS)]
            merged = heapq.merge(*map(shifted, range(STREAMS)), key=lambda one: one[:2])
            before, begun = time.process_time(), time.monotonic()
            for seconds, number, plane in merged:
                if seconds > SECONDS:
                    break
                if (pause := begun + seconds - time.monotonic()) > 0:
                    time.sleep(pause)
                senders[number].send(plane, seconds)
            passed = time.monotonic() - begun
            shares.append((time.process_time() - before) / passed)
            packets.append(sum(sender.packets for sender in senders) / passed)

    benchmark.pedantic(send, rounds=1, iterations=1)
    benchmark.extra_info.update(share=shares[0], packets=packets[0])
    report(f"{STREAMS} streams: {100 * shares[0]:.0f} % of a core, {packets[0]:.0f} packets a second")
