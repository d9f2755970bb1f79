"""Streams over networks: `StreamSender` sends planes, `StreamReceiver` receives a stream while it arrives."""

from __future__ import annotations

import contextlib
import secrets
import select
import socket
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Self

from fba.carriage.payloads import PayloadKind
from fba.carriage.receiving import DELAY, DatagramReader, PacketReader, RtpReader
from fba.carriage.rtp import Counts, FrameReader, write_frame
from fba.carriage.sdp import Session
from fba.carriage.sending import END_COPIES, DatagramWriter, PacketWriter, RtpWriter
from fba.errors import FbaError
from fba.live.addresses import StreamAddress
from fba.live.receiver import MAX_DATAGRAM, open_udp
from fba.parameters import BapTable
from fba.serving import Pace, Plane, listen, paced

CHECK = 0.1
"""Longest wait before `stop` is noticed, seconds."""
BATCH = 256
"""Datagrams that are read before those of their planes that are complete are given out."""
MOST_CONNECTIONS = 8
"""Connections of senders at once; the first that sends planes is used."""
PATIENCE = 10.0
"""Seconds that a receiver has to accept a connection, and to take what is sent."""


class StreamSender:
    """Sends planes to an address; a context manager.

    kind, planes_per_packet: as of `RtpWriter`. Over TCP, packets are those of RTP, each behind its length
    (RFC 4571); over UDP without RTP, those of `DatagramWriter`.

    Raises FbaError for an address that cannot be reached.
    """

    def __init__(
        self, address: StreamAddress, *, kind: PayloadKind = "3640", planes_per_packet: int = 1
    ) -> None:
        self.address = address
        self.packets = self.bytes = 0
        self._writer: PacketWriter
        if address.scheme == "udp":
            self._writer = DatagramWriter(planes_per_packet)
        else:
            self._writer = RtpWriter(
                kind=kind, planes_per_packet=planes_per_packet, ssrc=secrets.randbits(32),
                sequence=secrets.randbits(16), timestamp=secrets.randbits(32),
                end_copies=1 if address.scheme == "tcp" else END_COPIES,
            )  # fmt: skip
        self._socket: socket.socket
        self._target: Any = None

    def __enter__(self) -> Self:
        host, port = self.address.host or "localhost", self.address.port
        try:
            if self.address.scheme == "tcp":
                self._socket = socket.create_connection((host, port), timeout=PATIENCE)
                self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                return self
            family, _, _, _, self._target = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(family, socket.SOCK_DGRAM)
        except OSError as error:
            raise self._error(error) from error
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def send(self, plane: Plane, seconds: float) -> None:
        """Send a plane, or keep it for the next packet. seconds: its time, which grows."""
        self._send(self._writer.push(plane, seconds))

    def finish(self) -> None:
        """Send what is left, and that the stream has ended."""
        self._send(self._writer.finish())

    def _send(self, packets: Iterable[bytes]) -> None:
        try:
            for packet in packets:
                if self.address.scheme == "tcp":
                    self._socket.sendall(write_frame(packet))
                else:
                    self._socket.sendto(packet, self._target)
                self.packets += 1
                self.bytes += len(packet)
        except OSError as error:
            raise self._error(error) from None  # its cause would be taken for a reader who has seen enough

    def _error(self, error: OSError) -> FbaError:
        reason, remedy = error.strerror or str(error), "give the address of a computer, such as 192.168.0.20"
        if isinstance(error, ConnectionRefusedError):
            remedy = f"start a receiver first, such as `fba play {self.address}`"
        elif isinstance(error, ConnectionError):
            reason, remedy = "the receiver has closed the connection", "start both again"
        elif isinstance(error, TimeoutError):
            reason, remedy = f"no answer for {PATIENCE:g} s", "check address, port and firewalls"
        return FbaError(f"{self.address}: cannot be sent to: {reason}; {remedy}")


class Pacer:
    """The clock by which a stream is sent: it can be stopped from any thread or a signal handler.

    seconds: after which it stops by itself.
    """

    def __init__(self, seconds: float | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self.clock = clock
        self._stopped = threading.Event()
        self._end = None if seconds is None else clock() + seconds

    def wait(self, seconds: float) -> bool:
        """Wait for so long; return True, at once, where it is stopped."""
        left = seconds if self._end is None else min(seconds, self._end - self.clock())
        stopped = self._stopped.wait(max(left, 0.0))
        return stopped or left < seconds

    def stop(self) -> None:
        """End the sending."""
        self._stopped.set()


def repeated(planes: list[Plane], pace: Pace, *, loop: bool = False) -> Iterator[tuple[Plane, float]]:
    """Yield planes of a file, each at its time, with the seconds since the first. loop: again and again."""
    begun = 0.0
    while True:
        for plane in paced(planes, pace):
            yield plane, begun + plane.time - planes[0].time
        if not loop or pace.wait(1 / planes[-1].rate):  # for as long as the last frame is shown
            return
        begun += planes[-1].time - planes[0].time + 1 / planes[-1].rate


class StreamReceiver:
    """Receives a stream at an address of this computer; a context manager.

    source: an address, or a session by its description. delay: seconds that a packet waits for one before it.
    wait: seconds within which the stream must begin. clock: monotonic, in seconds.

    say: an attribute, called with a few words when planes are missing, and when it goes on.

    Raises FbaError, on entering, where the port cannot be opened, and from `read1` where no stream comes.
    """

    def __init__(
        self,
        source: StreamAddress | Session,
        *,
        delay: float = DELAY,
        wait: float | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._reader: PacketReader
        if isinstance(source, Session):
            self.address = StreamAddress("rtp", source.host, source.port)
            self._reader = RtpReader(
                payload_type=source.payload_type, kind=source.kind, table=source.table,
                configuration=source.configuration, delay=delay,
            )  # fmt: skip
        else:
            self.address = source
            self._reader = DatagramReader() if source.scheme == "udp" else RtpReader(delay=delay)
        self._wait = wait
        self._clock = clock
        self._stop = threading.Event()
        self._ended = False
        self._sockets: dict[socket.socket, FrameReader | None] = {}
        self._followed: socket.socket | None = None  # the connection that sends planes
        self._holding = False
        self.say: Callable[[str], None] = lambda _text: None

    @property
    def counts(self) -> Counts:
        """What came, and what was left out."""
        return self._reader.counts

    @property
    def table(self) -> BapTable | None:
        """The table of BAP steps that the stream names, once it has begun."""
        return self._reader.table

    def __enter__(self) -> Self:
        host, port = self.address.host, self.address.port
        if self.address.scheme == "tcp":
            self._entrance: socket.socket | None = listen(host or "0.0.0.0", port)
            self._entrance.setblocking(False)
        else:
            self._entrance = None
            self._sockets[open_udp(host, port)] = None
        self._begun = self._clock()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop, and close the port."""
        self.stop()
        for opened in [*self._sockets, *([] if self._entrance is None else [self._entrance])]:
            opened.close()
        self._sockets.clear()

    def stop(self) -> None:
        """End `read1`, from any thread or a signal handler."""
        self._stop.set()

    def read1(self, size: int = -1, /) -> bytes:
        """Return the next planes of the stream, after waiting for them; b"" at its end. size: not regarded.

        Raises FbaError if none has come after `wait` seconds.
        """
        while not self._stop.is_set():
            now = self._clock()
            parts = self._reader.settle(now)
            if not parts and not self._ended and not self._reader.ended:
                if not self.counts.planes and self._wait is not None and now - self._begun >= self._wait:
                    raise FbaError(self.nothing())
                parts = self._receive(self._patience(now))
            self._tell()
            if parts:
                return b"".join(parts)
            if self._ended or self._reader.ended:
                break
        return b""

    def _tell(self) -> None:
        """Say that the pose is held, or no longer."""
        if self._reader.holding == self._holding:
            return
        self._holding = self._reader.holding
        counts = self.counts
        lost = f"packets lost, {counts.lost} so far" if counts.lost else "the stream broke off"
        self.say(f"{lost}: {'the pose is held' if self._holding else 'it goes on'}")

    def nothing(self) -> str:
        """Return the reason why there is no stream."""
        if not self.counts.packets:
            return (
                f"{self.address}: no stream came; check that the sender sends to an address of this computer "
                "and to this port, and that no firewall is between them"
            )
        return f"{self.address}: no stream came, of which decoding could begin: " + "; ".join(
            self.counts.lines()
        )

    def _patience(self, now: float) -> float:
        """Return how long to wait for packets, seconds."""
        due = self._reader.due
        return CHECK if due is None else min(CHECK, max(due - now, 0.0))

    def _receive(self, seconds: float) -> list[bytes]:
        """Wait for packets; return the planes that they complete."""
        entrance = [] if self._entrance is None else [self._entrance]
        try:
            ready, _, _ = select.select([*self._sockets, *entrance], [], [], seconds)
        except (OSError, ValueError):  # closed meanwhile
            return []
        parts: list[bytes] = []
        for opened in ready:
            if opened is self._entrance:
                self._accept()
            elif self._sockets[opened] is None:
                parts += self._read_datagrams(opened)
            else:
                parts += self._read_connection(opened)
        return parts

    def _accept(self) -> None:
        assert self._entrance is not None
        with contextlib.suppress(OSError):  # gone again
            opened, _ = self._entrance.accept()
            if len(self._sockets) >= MOST_CONNECTIONS:
                opened.close()
                return
            opened.setblocking(False)
            self._sockets[opened] = FrameReader()

    def _read_datagrams(self, opened: socket.socket) -> list[bytes]:
        parts: list[bytes] = []
        for _ in range(BATCH):
            try:
                data, sender = opened.recvfrom(MAX_DATAGRAM)
            except ConnectionError:  # on Windows: nobody listens at an address of ours
                continue
            except OSError:
                break
            parts += self._reader.receive(data, sender, self._clock())
        return parts

    def _read_connection(self, opened: socket.socket) -> list[bytes]:
        try:
            data = opened.recv(MAX_DATAGRAM)
        except BlockingIOError:
            return []
        except OSError:
            data = b""
        frames = self._sockets[opened]
        assert frames is not None
        if not data:
            del self._sockets[opened]
            opened.close()
            self._ended |= opened is self._followed
            return []
        now = self._clock()
        parts = [part for packet in frames.push(data) for part in self._reader.receive(packet, opened, now)]
        if parts:
            self._followed = opened
        return parts
