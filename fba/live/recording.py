"""Recording of a live stream to a file that is a complete stream at any moment."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import BinaryIO, Protocol

from fba.animation import Animation
from fba.atomic import PathLike, check_target, write_error
from fba.capture.live import widest_faces
from fba.codec import Encoder, EncoderOptions, FrameRate, write_opening
from fba.errors import OptionError
from fba.planning import LiveEncoder
from fba.planning.rate import RateEncoder

RATE_RANGE = Fraction(1), Fraction(240)
"""Smallest and largest frame rate of a stream."""


class Target(Protocol):
    """The destination of a stream."""

    def begin(self, opening: bytes) -> None:
        """Begin the stream. opening: bytes before it, for readers that read it as it grows."""

    def write(self, data: bytes, ending: bytes) -> None:
        """Add bytes. ending: bytes that end the stream for now; the next bytes replace them."""

    def close(self) -> None:
        """Close the target."""


class StreamFile:
    """A file that is always a complete stream: each write replaces the end by new frames and a new end.

    The file is created, or overwritten, by the first write. Pipes and devices get the frames without ends.

    Raises FormatError where it cannot be written.
    """

    def __init__(self, path: PathLike) -> None:
        self.path = path
        self._in_place = not check_target(path).direct
        self._file: BinaryIO | None = None
        self._size = 0  # without the end
        self._opening = self._ending = b""

    def begin(self, opening: bytes) -> None:
        """Keep the opening for a pipe or a device; see `Target`."""
        self._opening = b"" if self._in_place else opening

    def write(self, data: bytes, ending: bytes) -> None:
        """Add bytes; see `Target`."""
        if not data and ending == self._ending:
            return
        try:
            if self._file is None:
                self._file = open(self.path, "wb", buffering=0)  # noqa: SIM115 - open for as long as it lasts
            if self._in_place:
                self._file.seek(self._size)
                _write_all(self._file, data + ending)
                if len(data) + len(ending) < len(self._ending):
                    self._file.truncate()
            else:
                _write_all(self._file, self._opening + data)
                self._opening = b""
        except OSError as error:
            raise write_error(self.path, error) from error
        self._size += len(data)
        self._ending = ending

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()


class StreamPipe:
    """A stream for a program that reads it as it grows: an open binary file, flushed with every frame."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._opening = b""

    def begin(self, opening: bytes) -> None:
        """Keep the opening; see `Target`."""
        self._opening = opening

    def write(self, data: bytes, ending: bytes) -> None:
        """Add bytes; see `Target`."""
        if data:
            self._file.write(self._opening + data)
            self._opening = b""
            self._file.flush()

    def close(self) -> None:
        """Leave the file open, as its owner will close it."""


class StreamRecorder:
    """Encodes frames as they come and writes them to targets immediately.

    options: by default those of captures: clamp, and the finer BAP steps, named after the end and, in pipes,
    before the object. bit_rate: limit, bits a second, with a buffer of `buffer` seconds; see
    `fba.planning.rate.RateEncoder`. compact: whether parameters are left out that players derive from others;
    see `fba.planning.LiveEncoder`. frames, size: written so far. rate: frames per second; 0 before the first.

    Raises OptionError for compact with bit_rate.
    """

    def __init__(
        self,
        targets: Sequence[Target],
        options: EncoderOptions | None = None,
        *,
        bit_rate: float | None = None,
        buffer: float = 1.0,
        compact: bool = False,
        prompt: bool = False,
    ) -> None:
        if compact and bit_rate is not None:
            raise OptionError("compact and bit_rate contradict each other: the bit rate decides what is sent")
        self.options = options or EncoderOptions(clamp=True, bap_steps="visage")
        self.frames = self.size = 0
        self.rate = Fraction(0)
        self.encoder: Encoder | RateEncoder | LiveEncoder
        if compact:
            self.encoder = LiveEncoder(self.options)  # it chooses its ranges itself
        else:
            rated = None if bit_rate is None else RateEncoder(bit_rate, buffer, self.options)
            self.encoder = rated or Encoder(self.options)
            self.encoder.expect(widest_faces())
        self.targets = tuple(targets)
        self._prompt = prompt

    def push(self, animation: Animation) -> None:
        """Add frames. Raises FormatError where a target cannot be written."""
        if not self.frames and animation.body is not None and self.options.mark and self.options.bap_quant:
            for target in self.targets:
                target.begin(write_opening(self.options.bap_steps))
        self.frames += len(animation)
        self.rate = animation.rate
        data = self.encoder.push_animation(animation)
        if self._prompt and isinstance(self.encoder, Encoder):
            data += self.encoder.settle(int(animation.index[-1]) + 1)
        self._write(data, self.encoder.ending())

    def finish(self) -> None:
        """End the stream, if it has any frame, and close the targets."""
        if self.frames:
            self._write(self.encoder.finish(), b"")
        for target in self.targets:
            target.close()

    def _write(self, data: bytes, ending: bytes) -> None:
        self.size += len(data)
        for target in self.targets:
            target.write(data, ending)


def stream_rate(rate: Fraction) -> Fraction:
    """Return the frame rate of a stream, 1 to 240, nearest to that of a sender."""
    near = min(max(rate, RATE_RANGE[0]), RATE_RANGE[1])
    return near if FrameRate.from_fraction(near) is not None else Fraction(round(16 * near), 16)


def _write_all(file: BinaryIO, data: bytes) -> None:
    """Write bytes to an unbuffered file, which may accept them in parts."""
    view = memoryview(data)
    while view:
        view = view[file.write(view) :]


def warm_up(
    targets: Sequence[Target] = (), *, bodies: bool = False, rated: bool = False, compact: bool = False
) -> None:
    """Compile the encoder of faces, and of bodies, since datagrams that come meanwhile would be lost.

    targets: get a stream of three frames. rated: for a bit rate. compact: as of `StreamRecorder`.
    """
    import numpy as np

    from fba.body import BapSolver
    from fba.tracks import BodyTrack, FaceTrack

    values = np.zeros((3, 68), np.int32)
    values[1, 2:] = 100
    values[2, 2:] = 30_000
    face = FaceTrack(values, np.broadcast_to(np.arange(68) > 1, values.shape))
    turns = np.zeros((3, 296), np.int32)
    body = BodyTrack(turns, np.ones(turns.shape, bool)) if bodies else None
    if bodies:
        solver = BapSolver()
        solver.solve(solver.pose(turns))
    recorder = StreamRecorder(targets, bit_rate=1e6 if rated else None, compact=compact)
    for frame in range(3):
        part = slice(frame, frame + 1)
        shown = None if body is None else body[part]
        recorder.push(Animation(Fraction(60), np.array([frame]), face[part], shown))
    recorder.finish()
