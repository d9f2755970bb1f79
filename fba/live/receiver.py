"""`Receiver`: a UDP port whose datagrams go to a `Capture`."""

from __future__ import annotations

import contextlib
import errno
import ipaddress
import select
import socket
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

from fba.errors import FbaError
from fba.live._capture import Capture

MAX_DATAGRAM = 65_536
"""Size of the longest possible datagram, bytes."""
BUFFER = 4 << 20
"""Size of the receive buffer that is requested, bytes."""
WAIT = 0.1
"""Longest wait for a datagram before `stop` is checked, seconds."""
BATCH = 256
"""Number of datagrams that are processed before `stop` is checked."""
MAX_UNREAD = 1 << 16
"""Largest number of datagrams counted at the end: more than a buffer has room for."""
SO_MEMINFO = 55
"""Linux's socket option for counts of 32 bits each."""
DROPS = 8
"""Index of the count of dropped datagrams."""


class Receiver:
    """Receives datagrams and requests them from the sender; a context manager.

    host: local address to listen on; "" for all. port: by default that of the kind; 0 for any free port. ask:
    address, with or without ":port", of a phone that sends only on request. clock: monotonic, in seconds.

    Raises FbaError, on entering, where the port cannot be opened.
    """

    def __init__(
        self,
        capture: Capture,
        *,
        host: str = "",
        port: int | None = None,
        ask: str | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.capture = capture
        self.port = capture.kind.port if port is None else port
        self._host = host
        self._ask = ask
        self._clock = clock
        self._socket: socket.socket | None = None
        self._next_ask = 0.0
        self._stop = threading.Event()

    def __enter__(self) -> Receiver:
        opened = open_udp(self._host, self.port)
        self._socket = opened
        self.port = int(opened.getsockname()[1])
        return self

    def __exit__(self, *_: object) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def run(self, seconds: float | None = None) -> None:
        """Receive until `stop` is called or the given time has passed."""
        begun = self._clock()
        while not self._stop.is_set():
            left = WAIT if seconds is None else min(WAIT, begun + seconds - self._clock())
            if left <= 0:
                break
            self._ask_sender()
            if self._socket is None:
                return
            with contextlib.suppress(ValueError):  # closed meanwhile
                select.select([self._socket], [], [], left)
            self.drain()
        self.drain()
        self.capture.summary.unread += sum(1 for _ in self._arrived(MAX_UNREAD))

    def drain(self) -> None:
        """Process the datagrams that have arrived, without waiting."""
        for data, address in self._arrived(BATCH):
            self.capture.receive(data, str(address[0]), self._clock())
        if self._socket is not None:
            dropped = _dropped(self._socket)
            if dropped is not None:
                self.capture.summary.dropped = dropped
        self.capture.settle()

    def _arrived(self, most: int) -> Iterator[tuple[bytes, tuple[Any, ...]]]:
        """Yield at most `most` datagrams that have arrived, with their senders' addresses."""
        for _ in range(most):
            opened = self._socket
            if opened is None:
                return
            try:
                yield opened.recvfrom(MAX_DATAGRAM)
            except ConnectionError:  # on Windows: nobody listens at the address we asked
                continue
            except OSError:
                return

    def stop(self) -> None:
        """End `run`, from any thread or a signal handler."""
        self._stop.set()

    def _ask_sender(self) -> None:
        """Request data from the sender, if it needs requests and the next is due."""
        kind, now = self.capture.kind, self._clock()
        if self._ask is None or not kind.asked_port or now < self._next_ask or self._socket is None:
            return
        self._next_ask = now + kind.ask_every
        host, port = split_address(self._ask, kind.asked_port)
        try:
            self._socket.sendto(kind.ask(self.port), (host, port))
        except OSError as error:
            raise FbaError(
                f"{self._ask}: cannot be asked for data: {error.strerror or error}; give the address that "
                "the app shows, such as 192.168.0.20"
            ) from error


def open_udp(host: str, port: int) -> socket.socket:
    """Return a socket that receives datagrams, without blocking. host: own address, or a group; "" for all.

    Raises FbaError where it cannot be opened.
    """
    where = f"{host or 'any address'}, UDP port {port}"
    try:
        found = socket.getaddrinfo(host or "0.0.0.0", port, type=socket.SOCK_DGRAM, flags=socket.AI_PASSIVE)
        family, _, _, _, address = found[0]
        opened = socket.socket(family, socket.SOCK_DGRAM)
        try:
            _bind(opened, address)
        except BaseException:
            opened.close()
            raise
    except (OSError, OverflowError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        remedy = (
            "give an address of this machine, or none for all"
            if isinstance(error, socket.gaierror) or getattr(error, "errno", 0) == errno.EADDRNOTAVAIL
            else "close the program that uses it, or give another port here and in the sender"
        )
        raise FbaError(f"{where}: cannot be listened on: {reason}; {remedy}") from error
    with contextlib.suppress(OSError):  # a smaller buffer will do
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
    opened.setblocking(False)
    return opened


def _bind(opened: socket.socket, address: tuple[Any, ...]) -> None:
    """Bind a socket to an address; join the group if it is one."""
    group = ipaddress.ip_address(address[0].partition("%")[0])
    if not group.is_multicast:
        opened.bind(address)
        return
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    opened.bind(("", address[1]) if sys.platform == "win32" else address)
    if group.version == 4:
        opened.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group.packed + bytes(4))
    else:
        interface = struct.pack("=I", address[3])
        opened.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_JOIN_GROUP, group.packed + interface)


def _dropped(opened: socket.socket) -> int | None:
    """Return the number of datagrams that the system dropped; None where it does not say."""
    if sys.platform != "linux":
        return None
    try:
        counts = opened.getsockopt(socket.SOL_SOCKET, SO_MEMINFO, 4 * (DROPS + 1))
    except OSError:  # closed meanwhile, or a Linux before 4.12
        return None
    return int(struct.unpack_from("=I", counts, 4 * DROPS)[0]) if len(counts) > 4 * DROPS else None


def split_address(text: str, port: int) -> tuple[str, int]:
    """Return host and port of "host" or "host:port"; FbaError for an impossible port."""
    host, mark, number = text.rpartition(":")
    if not mark or ":" in host:
        return text, port
    if not number.isdecimal() or not 0 < int(number) < 65_536:
        raise FbaError(f"{text}: {number!r} is not a port; expected 1 to 65535")
    return host, int(number)
