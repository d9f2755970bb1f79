"""`Capture`: makes frames of datagrams as they arrive, and counts faults."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import NamedTuple

from fba.animation import Animation
from fba.live._faces import FaceConversion
from fba.live._order import SampleOrder
from fba.live._people import PersonConversion
from fba.live._protocols.kinds import Kind
from fba.live._protocols.sample import DatagramError, DatagramReader, Sample
from fba.live._summary import Summary
from fba.live.recording import stream_rate
from fba.tracks import BodyTrack, FaceTrack

MIN_RATE = Fraction(10)
"""Assumed frame rate of a sender until its rate is known."""
MAX_HOSTS = 32
"""Largest number of addresses whose datagrams are read."""


class Sender(NamedTuple):
    """A sender: its address, its device, and the name of the person it shows."""

    host: str
    device: bytes
    subject: str

    @property
    def label(self) -> str:
        """Name and address, without the device's id, which would identify somebody's phone."""
        return f"{self.subject!r} ({self.host})" if self.subject else self.host


class Capture:
    """Turns the datagrams of one sender into frames.

    kind: the protocol. push: called with complete frames. sender: subject's name or address of the sender to
    use; by default the first that sends a sample. rate: frames per second of the stream; by default the
    sender's. swap, neutral: see `FaceConversion`. say: called with a line of text about each event.

    `receive` and `newest` may be called from different threads.
    """

    def __init__(
        self,
        kind: Kind,
        push: Callable[[Animation], None],
        *,
        sender: str | None = None,
        rate: Fraction | None = None,
        swap: bool = False,
        neutral: float | None = None,
        say: Callable[[str], None] = lambda _line: None,
    ) -> None:
        self.kind = kind
        self.summary = Summary()
        self._push = push
        self._wanted = sender
        self._given_rate = rate
        self._swap = swap
        self._neutral = neutral
        self._say = say
        self._lock = threading.RLock()
        self._readers: dict[str, DatagramReader] = {}
        self._sender: Sender | None = None
        self._order: SampleOrder | None = None
        self._conversion: FaceConversion | PersonConversion | None = None

    def receive(self, data: bytes, host: str, now: float) -> None:
        """Process a datagram from an address. now: arrival time in seconds of a monotonic clock.

        Raises only what `push` raises.
        """
        with self._lock:
            self.summary.received += 1
            self.summary.bytes += len(data)
            try:
                for sample in self._read(data, host, now):
                    self._take(sample, host, now)
            except DatagramError as error:
                self.summary.refuse(str(error))

    def settle(self) -> None:
        """Pass on the complete frames of bodies, once all datagrams at hand have been received.

        Several frames together take hardly longer than one.
        """
        with self._lock:
            if self._conversion is not None:
                self._pass_on(self._conversion.settle())

    def finish(self) -> Summary:
        """Pass on the remaining frames, and return the summary."""
        with self._lock:
            if self._order is not None and self._conversion is not None:
                self._convert(self._order.finish())
                self._pass_on(self._conversion.finish())
                for name in ("doubled", "late", "reordered", "strayed", "jumps"):
                    setattr(self.summary, name, getattr(self._order, name))
            return self.summary

    def newest(self) -> tuple[FaceTrack | None, BodyTrack | None]:
        """Return face and body in the newest datagram, tracks of one frame; None where absent."""
        with self._lock:
            if self._sender is None or self._conversion is None:
                return None, None
            sample = self._readers[self._sender.host].newest()
            return (None, None) if sample is None else self._conversion.show(sample)

    def _read(self, data: bytes, host: str, now: float) -> list[Sample]:
        if len(data) > self.kind.longest:
            raise DatagramError(f"longer than {self.kind.longest} bytes")
        if host not in self._readers:
            if len(self._readers) >= MAX_HOSTS:
                raise DatagramError(f"of more than {MAX_HOSTS} addresses")
            self._readers[host] = self.kind.reader()
        return self._readers[host].read(data, now)

    def _take(self, sample: Sample, host: str, now: float) -> None:
        sender = Sender(host, sample.device, sample.subject)
        if self._sender is None and self._wanted in (None, sample.subject, host):
            self._begin(sender, sample)
        if sender != self._sender or self._order is None:
            if self.summary.leave_out(sender.label):
                self._say(f"{sender.label} also sends, and is left out")
            return
        self._convert(self._order.push(sample, now))

    def _begin(self, sender: Sender, sample: Sample) -> None:
        """Begin with the first sample of the sender that is used."""
        sent_rate = sample.rate or self.kind.rate or MIN_RATE
        self._sender = sender
        self.summary.sender = sender.label
        self._order = SampleOrder(sent_rate)
        self._conversion = self._make_conversion(sent_rate)
        self._say(f"receiving from {sender.label}")

    def _make_conversion(self, sent_rate: Fraction) -> FaceConversion | PersonConversion:
        if self.kind.bodies:
            rate = self._given_rate or self.kind.rate
            return PersonConversion(rate, t_pose=self._neutral is not None, summary=self.summary)
        return FaceConversion(
            self._given_rate or stream_rate(sent_rate), sent_rate, swap=self._swap, neutral=self._neutral,
            summary=self.summary,
        )  # fmt: skip

    def _convert(self, ready: list[tuple[float, Sample]]) -> None:
        assert self._conversion is not None
        for timed in ready:
            self.summary.seconds = timed[0]
            self._pass_on(self._conversion.push(timed))

    def _pass_on(self, frames: Iterator[Animation]) -> None:
        for animation in frames:
            self.summary.frames += len(animation)
            self._push(animation)
