"""`Capture`: makes frames of datagrams as they arrive, and counts faults."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64
from fba.capture.live import LiveBlendshapes
from fba.live._order import SampleOrder, Timed
from fba.live._people import PersonConversion
from fba.live._protocols.kinds import Kind
from fba.live._protocols.sample import DatagramError, DatagramReader, Sample
from fba.live._summary import Summary
from fba.live.recording import stream_rate
from fba.sampling import GAP
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


SWAPPED = {
    "mouthLeft": "mouthRight", "mouthRight": "mouthLeft", "jawLeft": "jawRight", "jawRight": "jawLeft",
}  # fmt: skip

Row = tuple[Float64, Float64, Float64]
"""Weights (N,), angles of the head (3,) and of the eyes (4,); angles that a sender lacks are 0."""


class FaceConversion:
    """Converts samples with weights to frames.

    rate: frames per second. sent_rate: the sender's. swap: exchanges mouthLeft and mouthRight, jawLeft and
    jawRight. neutral: seconds from the first face; their median is the neutral face, which is subtracted, and
    no frame comes out before they are over. By default nothing is subtracted. summary: counts events.
    """

    def __init__(
        self, rate: Fraction, sent_rate: Fraction, *, swap: bool, neutral: float | None, summary: Summary
    ) -> None:
        self._rate = rate
        self._sent_rate = sent_rate
        self._swap = swap
        self._neutral_seconds = neutral
        self._summary = summary
        self._frames: LiveBlendshapes | None = None
        self._neutral: Row | None = None
        self._waiting: list[tuple[float, Row]] = []
        self._last: float | None = None

    def push(self, timed: Timed) -> Iterator[Animation]:
        """Add a sample; yield the frames that are complete."""
        time, sample = timed
        if sample.weights is None:
            self._summary.unseen += 1
            return
        self._summary.used += 1
        if self._last is not None and (time - self._last) * float(self._sent_rate) >= GAP:
            self._summary.gaps += 1
            self._summary.longest_gap = max(self._summary.longest_gap, time - self._last)
        self._last = time
        frames, row = self._begun(sample), self._row(sample)
        if self._neutral_seconds is None or self._neutral is not None:
            yield from frames.push(time, *self._without_neutral(row))
            return
        self._waiting.append((time, row))
        if time - self._waiting[0][0] >= self._neutral_seconds:
            yield from self._find_neutral(frames)

    def settle(self) -> Iterator[Animation]:
        """Yield nothing: `push` has already yielded all complete frames."""
        yield from ()

    def finish(self) -> Iterator[Animation]:
        """Yield the remaining frames."""
        if self._frames is not None:
            if self._waiting:
                yield from self._find_neutral(self._frames)
            yield from self._frames.finish()

    def show(self, sample: Sample) -> tuple[FaceTrack | None, None]:
        """Return the FAPs of a sample, a track of one frame; None without a face."""
        if sample.weights is None or self._frames is None or self._waiting:
            return None, None
        return self._frames.show(*self._without_neutral(self._row(sample))), None

    def _begun(self, sample: Sample) -> LiveBlendshapes:
        """Return the converter, made for the names in the first sample."""
        if self._frames is None:
            names = [SWAPPED.get(name, name) for name in sample.names] if self._swap else list(sample.names)
            if self._swap:
                self._summary.notes.append("mouthLeft/mouthRight and jawLeft/jawRight changed places")
            self._frames = LiveBlendshapes(names, self._rate)
        return self._frames

    def _row(self, sample: Sample) -> Row:
        weights = sample.weights
        if weights is None or len(weights) != len(self._begun(sample).names):
            raise DatagramError("with other shapes than the first")
        return (
            weights,
            np.zeros(3) if sample.head is None else sample.head,
            np.zeros(4) if sample.eyes is None else sample.eyes,
        )

    def _find_neutral(self, frames: LiveBlendshapes) -> Iterator[Animation]:
        """Set the neutral face to the median of the waiting samples, and yield their frames."""
        waiting, self._waiting = self._waiting, []
        weights, head, eyes = (
            np.median(parts, axis=0) for parts in zip(*(row for _, row in waiting), strict=True)
        )
        self._neutral = (weights, head, eyes)
        self._summary.notes.append(
            f"the median of the first {waiting[-1][0] - waiting[0][0]:.2f} s is the neutral face, subtracted"
        )
        for time, row in waiting:
            yield from frames.push(time, *self._without_neutral(row))

    def _without_neutral(self, row: Row) -> Row:
        if self._neutral is None:
            return row
        weights, head, eyes = (part - still for part, still in zip(row, self._neutral, strict=True))
        return np.maximum(weights, 0.0), head, eyes
