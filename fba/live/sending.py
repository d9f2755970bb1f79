"""Sending of a face in the protocol of Live Link Face, in real time."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator

from fba.animation import Animation
from fba.capture import to_blendshapes
from fba.errors import FbaError
from fba.formats.face_tables.livelink_udp import join_values, write_packet
from fba.formats.time_codes import DAY

DEVICE = "00000000-0000-0000-0000-000000000000"
"""Used in place of a phone's id."""


def make_datagrams(animation: Animation, subject: str, start: float = 0.0) -> Iterator[tuple[float, bytes]]:
    """Yield a datagram for each frame, with its time: seconds from the first.

    subject: name of the face for the receiver. start: time of day of the first frame, seconds. Raises
    ModelError for an animation without a face.
    """
    motion = to_blendshapes(animation)
    for at, values in zip(motion.times.tolist(), join_values(motion), strict=True):
        yield at, write_packet(subject, DEVICE, (start + at) % DAY, motion.rate, values)


def send(
    animation: Animation,
    address: tuple[str, int],
    *,
    subject: str = "fba",
    loop: bool = False,
    seconds: float | None = None,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> int:
    """Send a face to an address, a datagram for each frame at its time; return the number of datagrams.

    loop: repeat until `seconds` have passed. Raises ModelError for an animation without a face, FbaError for
    an address that cannot be reached.
    """
    begun, passed, count = clock(), 0.0, 0
    with socket.socket(socket.AF_INET6 if ":" in address[0] else socket.AF_INET, socket.SOCK_DGRAM) as opened:
        while True:
            for at, data in make_datagrams(animation, subject, passed):
                if seconds is not None and passed + at >= seconds:
                    return count
                sleep(max(begun + passed + at - clock(), 0.0))
                try:
                    opened.sendto(data, address)
                except OSError as error:
                    raise FbaError(
                        f"{address[0]}: cannot be sent to: {error.strerror or error}; give the address of a "
                        "computer, such as 192.168.0.20"
                    ) from error
                count += 1
            passed += float(animation.duration)
            if not loop:
                return count
