"""Pictures become a film while they are made: they go in one by one, a thread of its own encodes them."""

from __future__ import annotations

import atexit
import contextlib
import math
import queue
import sys
import threading
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Protocol

import numpy as np

from fba.arrays import UInt8
from fba.atomic import PathLike
from fba.errors import UnsupportedError
from fba_player.sound.soundtrack import FilmedSound

WAITING = 6
"""Pictures that may wait for the encoder,"""
WAITING_BYTES = 96 << 20
"""and bytes of them: of large pictures fewer wait, but two."""
FASTEST = 1000
"""Frames a second that no film exceeds."""
FILMS = (".mp4", ".gif")
TURN = 0.0005
"""Seconds after which a thread that works hands over to one that waits: a tenth of Python's own choice."""


class PromptThreads:
    """While it is entered, once or several times, from any thread, Python's threads take turns more often.

    A thread that encodes asks for its turn four times a picture: at 5 ms each it would be slower than the
    drawing, with a processor idle. read, change: the seconds of a turn, which are the whole process's.
    """

    def __init__(
        self,
        read: Callable[[], float] = sys.getswitchinterval,
        change: Callable[[float], None] = sys.setswitchinterval,
    ) -> None:
        self._read, self._change = read, change
        self._lock = threading.Lock()
        self._users = 0
        self._before = 0.0

    def __enter__(self) -> PromptThreads:
        with self._lock:
            if not self._users:
                self._before = self._read()
                self._change(min(TURN, self._before))
            self._users += 1
        return self

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._users -= 1
            if not self._users:
                self._change(self._before)


PROMPT_THREADS = PromptThreads()
"""The process's own."""


class Sink(Protocol):
    """Where the thread puts pictures: MP4, GIF, numbered files."""

    stopped: bool
    """Set from outside: `finish` is to come to an end without a result."""

    def write(self, pixels: UInt8, number: int) -> None:
        """A picture, uint8 (H, W, 4) of the size it was opened with, at number / rate seconds."""

    def finish(self, count: int) -> Path:
        """All is written, and lasts count / rate seconds; returns where it is."""

    def abort(self) -> None:
        """Leave nothing half-written; safe to call at any time, more than once."""


class Recorder:
    """Writes a film from pictures, as they come.

    path: .mp4 (H.264, with sound) or .gif. size: width and height in pixels; MP4 loses the last column or
    row of odd ones. rate: frames a second. audio: a file whose sound goes along (MP4 only), from
    audio_start seconds in it (it may be negative: silence first), for as long as the film lasts; or a
    `fba_player.sound.soundtrack.FilmedSound`, which the film closes.

    Use it as a context manager: it closes at the end, and aborts where an exception leaves the block. The
    film appears under its name, whole, when it is closed.

    Raises UnsupportedError for another suffix, ValueError for a size or rate that cannot be, DisplayError
    without an encoder, FormatError where it cannot be written or the sound cannot be read.
    """

    def __init__(
        self,
        path: PathLike,
        size: tuple[int, int],
        *,
        rate: Fraction | int | str = 30,
        audio: PathLike | FilmedSound | None = None,
        audio_start: float | Fraction = 0,
    ) -> None:
        width, height = (int(v) for v in size)
        self.path = Path(path)
        self.rate = exact_rate(rate)
        self._start(_open_sink(self.path, (width, height), self.rate, audio, audio_start), (width, height))

    @classmethod
    def into(cls, sink: Sink, path: PathLike, size: tuple[int, int], rate: Fraction) -> Recorder:
        """A recorder of something else than a film: a sink that is open already."""
        self = cls.__new__(cls)
        self.path, self.rate = Path(path), rate
        self._start(sink, size)
        return self

    def _start(self, sink: Sink, size: tuple[int, int]) -> None:
        self.size = size
        self.dropped = 0
        """Pictures that were left out as the encoder was busy."""
        self._last = -1
        self._sink = sink
        self._error: BaseException | None = None
        self._result: Path | None = None
        self._closed = self._stop = False
        self._free: queue.SimpleQueue[UInt8] = queue.SimpleQueue()
        self._full: queue.SimpleQueue[tuple[UInt8, int] | None] = queue.SimpleQueue()
        for _ in range(min(max(WAITING_BYTES // (size[0] * size[1] * 4 or 1), 2), WAITING)):
            self._free.put(np.zeros((size[1], size[0], 4), dtype=np.uint8))
        self._thread = threading.Thread(target=self._encode, name="fba recorder", daemon=True)
        self._thread.start()
        atexit.register(self.abort)  # whoever forgets to close leaves no temporary file

    @property
    def frames(self) -> int:
        """Frames that the film has so far, those that a late picture makes last longer among them."""
        return self._last + 1

    @property
    def seconds(self) -> Fraction:
        """How long the film is so far."""
        return self.frames / self.rate

    def wants(self, time: float | Fraction) -> bool:
        """Whether a picture at a time (seconds from the film's start) would become a new frame.

        Ask before a picture is read back from the graphics card: a window is faster than its film.
        """
        return self._number(time) > self._last

    def add(self, pixels: UInt8, time: float | Fraction | None = None, *, wait: bool = True) -> bool:
        """Add a picture; it is copied at once.

        pixels: uint8 (H, W, 4 or 3), sRGB, top row first; of another size than the film's it is fitted
        into it, with bars. time: seconds from the film's start, rounded to the film's frames; by default
        one frame after the last. A picture stays until the next: times may skip frames. wait: True waits
        for the encoder where it lags behind, False leaves the picture out instead.

        Returns whether it became a frame: not so where that moment has a picture already, or where it was
        left out. Raises what the encoder met (FormatError for a full disk, DisplayError), ValueError
        after `close`.
        """
        if self._closed:
            raise ValueError(f"{self.path}: this recording is closed")
        self._check()
        number = self._last + 1 if time is None else self._number(time)
        if number <= self._last:
            return False
        try:
            buffer = self._free.get(block=wait)
        except queue.Empty:
            self.dropped += 1
            return False
        self._check()
        if pixels.shape[:2] != buffer.shape[:2]:
            pixels = _fit(pixels, self.size)
        buffer[..., : pixels.shape[2]] = pixels
        if pixels.shape[2] == 3:
            buffer[..., 3] = 255
        self._last = number
        self._full.put((buffer, number))
        return True

    def close(self) -> Path | None:
        """Finish the film with what there is, and put it under its name.

        Returns the path; None where there was no picture, and so no film. Raises what the encoder met;
        nothing is left then. Safe to call twice.
        """
        if self._closed:
            return self._result
        if not self.frames:
            self.abort()
            return None
        self._closed = True
        atexit.unregister(self.abort)
        self._full.put(None)
        try:
            self._thread.join()
        except BaseException:  # interrupted while the last frames were encoded
            self._end()
            raise
        self._check()
        return self._result

    def abort(self) -> None:
        """Give up; nothing is left, and an older file of that name stays. Safe at any time."""
        if not self._closed:
            self._closed = True
            atexit.unregister(self.abort)
            self._end()

    def _end(self) -> None:
        self._stop = self._sink.stopped = True
        self._full.put(None)
        self._thread.join()
        self._sink.abort()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
        else:
            self.abort()

    def _number(self, time: float | Fraction) -> int:
        if not math.isfinite(time):
            raise ValueError(f"the time of a picture must be a finite number of seconds, not {time}")
        return round(Fraction(time) * self.rate)

    def _check(self) -> None:
        if self._error is not None:
            self._closed = True
            atexit.unregister(self.abort)
            self._thread.join()
            raise self._error

    def _encode(self) -> None:
        """The thread. After an error it goes on taking pictures, so that nobody waits for it."""
        try:
            with PROMPT_THREADS:
                while (item := self._full.get()) is not None:
                    if not self._stop:
                        self._sink.write(*item)
                    self._free.put(item[0])
            if not self._stop:
                self._result = self._sink.finish(self._last + 1)
        except BaseException as error:
            with contextlib.suppress(Exception):
                self._sink.abort()
            self._error = error
            self._free.put(np.zeros((self.size[1], self.size[0], 4), dtype=np.uint8))


def exact_rate(rate: Fraction | int | str) -> Fraction:
    """A film's frame rate as MP4 can carry it. Raises ValueError beyond 0..1000."""
    exact = Fraction(rate)
    if not 0 < exact <= FASTEST:
        raise ValueError(f"a film's frame rate must lie above 0 and at most at {FASTEST}, not {exact}")
    return exact.limit_denominator(1001) if exact.denominator > 100_000 else exact


def _open_sink(
    path: Path,
    size: tuple[int, int],
    rate: Fraction,
    audio: PathLike | FilmedSound | None,
    audio_start: float | Fraction,
) -> Sink:
    suffix = path.suffix.lower()
    if suffix == ".mp4":
        from fba_player.export.mp4 import Mp4

        return Mp4(path, size, rate, audio, audio_start)
    if suffix == ".gif":
        from fba_player.export._gif import Gif

        if audio is not None:
            raise UnsupportedError(f"{path}: a GIF has no sound; write an .mp4", what="sound in a GIF")
        return Gif(path, size, rate)
    raise UnsupportedError(
        f"{path}: films are written as {' or '.join(FILMS)}, not as {suffix or 'a bare name'}",
        what=f"a film as {suffix or 'no suffix'}",
    )


def _fit(pixels: UInt8, size: tuple[int, int]) -> UInt8:
    """As large as fits, in the middle, with black around it."""
    from PIL import Image, ImageOps

    picture = Image.fromarray(np.ascontiguousarray(pixels)).convert("RGBA")
    return np.asarray(ImageOps.pad(picture, size, Image.Resampling.BILINEAR, color=(0, 0, 0, 255)))
