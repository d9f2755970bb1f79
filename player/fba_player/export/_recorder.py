"""Records films: pictures are added one by one, and a thread encodes them."""

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
from typing import TYPE_CHECKING, Protocol

import numpy as np

from fba.arrays import UInt8
from fba.atomic import PathLike
from fba.errors import UnsupportedError

if TYPE_CHECKING:
    from fba_player.sound.soundtrack import FilmedSound

MAX_WAITING_PICTURES = 6
"""Largest number of pictures that wait for the encoder."""
MAX_WAITING_BYTES = 96 << 20
"""Most bytes of them; at least two pictures, however large."""
MAX_FILM_RATE = 1000
"""Largest rate of a film in frames per second."""
FILMS = (".mp4", ".gif")
SWITCH_INTERVAL = 0.0005
"""Seconds after which a running thread yields to a waiting one: a tenth of Python's default."""


class PromptThreads:
    """A context manager in which Python's threads take turns more often; several threads may enter it.

    The encoding thread waits for its turn four times per picture: at 5 ms each it would be slower than the
    drawing, with a processor idle. read, change: get and set the switch interval of the process, in seconds.
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
                self._change(min(SWITCH_INTERVAL, self._before))
            self._users += 1
        return self

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._users -= 1
            if not self._users:
                self._change(self._before)


PROMPT_THREADS = PromptThreads()
"""The one instance: the switch interval belongs to the process."""


class Sink(Protocol):
    """An encoder that takes pictures: MP4, GIF, numbered files."""

    stopped: bool
    """Set from outside to make `finish` stop early, without a result."""

    def write(self, pixels: UInt8, number: int) -> None:
        """Add a picture, uint8 (H, W, 4) of the film's size, at number / rate seconds."""

    def finish(self, count: int) -> Path:
        """Finish the film, count / rate seconds long; return its path."""

    def abort(self) -> None:
        """Remove unfinished files; safe to call at any time, more than once."""


class Recorder:
    """Writes a film from pictures that are added one by one.

    path: .mp4 (H.264, with sound) or .gif. size: width and height in pixels; MP4 needs even ones, and cuts
    the last column or row of odd ones. rate: frames per second. audio: a sound file (MP4 only), used from
    audio_start seconds in it (if negative, silence comes first) for the length of the film; or a
    `fba_player.sound.soundtrack.FilmedSound`, which is closed with the film. sink: where pictures go in place
    of a new file; then `path` is for messages.

    Use it as a context manager: it closes at the end, and aborts if an exception leaves the block. The file
    appears under its name when it is complete.

    Raises UnsupportedError for another suffix, ValueError for an impossible size or rate, DisplayError
    without an encoder, FormatError if it cannot be written or the sound cannot be read.
    """

    def __init__(
        self,
        path: PathLike,
        size: tuple[int, int],
        *,
        rate: Fraction | int | str = 30,
        audio: PathLike | FilmedSound | None = None,
        audio_start: float | Fraction = 0,
        sink: Sink | None = None,
    ) -> None:
        self.path, self.rate = Path(path), exact_rate(rate)
        self.size = width, height = (int(size[0]), int(size[1]))
        self._sink = sink or _open_sink(self.path, self.size, self.rate, audio, audio_start)
        self.dropped = 0
        """Number of pictures that were left out because the encoder was busy."""
        self._last = -1
        self._error: BaseException | None = None
        self._result: Path | None = None
        self._closed = self._stop = False
        self._free: queue.SimpleQueue[UInt8] = queue.SimpleQueue()
        self._full: queue.SimpleQueue[tuple[UInt8, int] | None] = queue.SimpleQueue()
        for _ in range(min(max(MAX_WAITING_BYTES // (width * height * 4 or 1), 2), MAX_WAITING_PICTURES)):
            self._free.put(np.zeros((height, width, 4), dtype=np.uint8))
        self._thread = threading.Thread(target=self._encode, name="fba recorder", daemon=True)
        self._thread.start()
        atexit.register(self.abort)  # no temporary file stays if `close` is forgotten

    @property
    def frames(self) -> int:
        """Frames of the film so far, including those that repeat a picture."""
        return self._last + 1

    @property
    def seconds(self) -> Fraction:
        """Length of the film so far, exact."""
        return self.frames / self.rate

    def wants(self, time: float | Fraction) -> bool:
        """Return whether a picture at a time (seconds from the film's start) would become a new frame.

        Ask before reading a picture back from the graphics card: a window draws more often than its film.
        """
        return self._number(time) > self._last

    def add(self, pixels: UInt8, time: float | Fraction | None = None, *, wait: bool = True) -> bool:
        """Add a picture; it is copied at once.

        pixels: uint8 (H, W, 4 or 3), sRGB, top row first; another size than that of the film is fitted into
        it, with bars. time: seconds from the start of the film, rounded to its frames; by default one frame
        after the last. Times may skip frames: a picture is shown until the next. wait: whether to wait for
        the encoder if it lags behind; False leaves the picture out instead.

        Returns False if the picture was left out, or if its frame has one already. Raises the errors of the
        encoder (FormatError for a full disk, DisplayError), ValueError after `close`.
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
        """Finish the film; return its path, or None if no picture was added.

        Raises the errors of the encoder; no file is left then. Safe to call twice.
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
        """Discard the film; an older file of that name stays. Safe to call at any time."""
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
        """The encoding thread. After an error it releases a buffer, so that `add` does not wait for ever."""
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
    """Return the frame rate as MP4 can store it. Raises ValueError unless it is above 0 and at most 1000."""
    exact = Fraction(rate)
    if not 0 < exact <= MAX_FILM_RATE:
        raise ValueError(f"a film's frame rate must lie above 0 and at most at {MAX_FILM_RATE}, not {exact}")
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
        from fba_player.export._mp4 import Mp4

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
    """Return the picture scaled to fit, centred, with black bars."""
    from PIL import Image, ImageOps

    picture = Image.fromarray(np.ascontiguousarray(pixels)).convert("RGBA")
    return np.asarray(ImageOps.pad(picture, size, Image.Resampling.BILINEAR, color=(0, 0, 0, 255)))
