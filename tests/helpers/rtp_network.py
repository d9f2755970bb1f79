"""Streams in packets, a network that loses, overtakes and doubles them, and what a receiver makes of it."""

import random
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

import fba
from fba.carriage.receiving import RtpReader
from fba.carriage.sending import RtpWriter
from fba.codec import EncoderOptions, encode_animation
from fba.serving import Plane, split_stream
from joinable_streams import performance

PERIOD = EncoderOptions(intra_period=1, start_codes=True, bap_steps="visage")
END = b"\0\0\1\xb1"
Packets = list[tuple[float, bytes]]
"""Packets with the seconds at which they are sent, or come."""


def stream(frames: int = 250, options: EncoderOptions = PERIOD, *, body: bool = False) -> bytes:
    return encode_animation(performance(frames, body=body), options)[0]


def planes_of(data: bytes, *, body: bool = False) -> list[Plane]:
    return split_stream(data, "visage" if body else None)[0]


def packets_of(
    planes: Iterable[Plane], *, finish: bool = True, start: float = 0.0, **settings: Any
) -> Packets:
    writer = RtpWriter(**{"ssrc": 7, "sequence": 65_000, "timestamp": 2**32 - 90_000, **settings})
    packets, last = [], 0.0
    for plane in planes:
        last = start + plane.time
        packets += [(last, one) for one in writer.push(plane, plane.time)]
    return packets + ([(last, one) for one in writer.finish()] if finish else [])


def disturbed(
    packets: Packets, seed: int, *, loss: float = 0.0, late: float = 0.0, doubled: float = 0.0
) -> Packets:
    """Return packets as they come: shares of them are lost, up to 80 ms late, or come twice."""
    chance = random.Random(seed)
    arrived = []
    for sent, data in packets:
        copies = 1 + (chance.random() < doubled) - (chance.random() < loss)
        for _ in range(copies):
            delay = chance.uniform(0.0, 0.08) if chance.random() < late else 0.001
            arrived.append((sent + delay, data))
    return sorted(arrived, key=lambda one: one[0])


def received(reader: RtpReader, packets: Packets, sender: object = "a") -> list[bytes]:
    parts = [part for now, data in packets for part in reader.receive(data, sender, now)]
    return parts + reader.settle(packets[-1][0] + 10)


def decoded(parts: list[bytes]) -> fba.Animation:
    return fba.decode(b"".join([*parts, END]))


def frames_differ(shown: fba.Animation, sent: fba.Animation) -> Iterator[int]:
    """Yield the frames that are shown at a time at which others were sent, or with other values."""
    places = {index: place for place, index in enumerate(sent.index.tolist())}
    for place, index in enumerate(shown.index.tolist()):
        for part in ("face", "body"):
            one, other = getattr(shown, part), getattr(sent, part)
            if one is not None and not (
                index in places and np.array_equal(one.values[place], other.values[places[index]])
            ):
                yield index
