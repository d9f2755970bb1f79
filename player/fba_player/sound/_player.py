"""Sound in step with the picture: the transport follows the clock of the sound device.

The samples that a device has played are the clock of the transport. The samples that it asks for next will be
heard at a known reading of that clock, so it gets those of the time that the transport will show then.
Pausing, seeking, looping and speeds need no code of their own, and nothing can drift.

`SoundBlocks` holds the part of an audio file that will be heard soon, decoded ahead by a thread.
"""

from __future__ import annotations

import contextlib
import os
import sys
import threading
import time as wall
import warnings
from collections import OrderedDict, deque
from collections.abc import Callable, Generator, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fba.arrays import Int16
from fba.atomic import PathLike
from fba.audio import CHANNELS, SoundFile
from fba.errors import FbaError, FbaWarning
from fba_player.gl._context import cure
from fba_player.playback._transport import Motion, Transport
from fba_player.sound._mixer import SoundMixer
from fba_player.sound.soundtrack import find_sound_beside
from fba_player.view.protocols import Closing

BLOCK_SECONDS = 0.5
"""Length of a block, in seconds."""
AHEAD_SECONDS = 2.5
"""Seconds ahead of now whose samples are decoded in advance."""
CACHED_BLOCKS = 64
"""Blocks in memory, half a minute: 6 MB at 48 kHz."""
PAUSE_SECONDS = 0.03
"""Seconds between checks of which samples are wanted."""


__all__ = ["Audio", "find_sound_beside", "open_audio"]

PERIOD = 0.04
"""Seconds of sound that a device asks for at a time."""
PERIODS = 3
"""Number of periods that a device buffers."""
CLOCK_GAIN = 0.05
"""Share of the measured error by which each call of the device corrects the clock: calls are irregular."""
CLOCK_CALLS = 10
"""Number of latest calls of which the earliest is used: a busy machine answers late, never early."""
CLOCK_STOP = 0.05
"""Seconds of error, in the earliest call, beyond which the device must have stopped for a while."""


class NoDeviceError(Exception):
    """No sound can be played on this machine; the text says why."""


class Audio(Closing):
    """Plays an audio file in step with a transport; a context manager.

    path: anything that FFmpeg reads. transport: follows the device's clock from now on. offset: seconds by
    which the sound begins after the first frame; before it if negative. backend: "null" for a silent device,
    for tests; None for the system's default.

    Raises FormatError where the file cannot be read or holds no sound, NoDeviceError where there is no sound
    device; `open_audio` goes on without sound then.
    """

    def __init__(
        self, path: PathLike, transport: Transport, *, offset: float = 0.0, backend: str | None = None
    ) -> None:
        self.path = Path(path)
        self.transport = transport
        file = SoundFile(path)
        self.duration = file.duration
        self.rate = file.rate
        self.clock = SoundClock(file.rate, (PERIODS - 1) * PERIOD)
        self._offset = offset
        self._muted = self._held = False
        self._blocks = SoundBlocks(file, self._samples_ahead)
        self._mixer = SoundMixer(self._blocks.take, file.rate, lambda: transport.motion, self._origin)
        self._device: Any = None
        try:
            self._device = _open_device(file.rate, backend)
            self.backend = str(self._device.backend)
            samples_for_device = self._device_samples()
            next(samples_for_device)
            self._device.start(samples_for_device)
        except Exception as error:
            self.close()
            raise NoDeviceError(", ".join(map(str, error.args)) or type(error).__name__) from error
        transport.use_clock(self.clock, self.clock.latency)

    @property
    def offset(self) -> float:
        """Seconds by which the sound begins after the first frame; it may be set while it plays."""
        return self._offset

    @offset.setter
    def offset(self, offset: float) -> None:
        self._offset = float(offset)
        self._mixer.origin = self._origin

    @property
    def _origin(self) -> float:
        return self.transport.start + self._offset

    @property
    def volume(self) -> float:
        """Loudness, 0 to 1."""
        return self._mixer.volume

    @volume.setter
    def volume(self, volume: float) -> None:
        self._mixer.volume = min(max(float(volume), 0.0), 1.0)

    @property
    def muted(self) -> bool:
        """Whether it is silent, whatever the volume."""
        return self._muted

    @muted.setter
    def muted(self, muted: bool) -> None:
        self._muted = bool(muted)
        self._mixer.muted = self._muted or self._held

    @property
    def held(self) -> bool:
        """Whether it is silent for as long as the transport follows another clock than the device's."""
        return self._held

    @held.setter
    def held(self, held: bool) -> None:
        self._held = bool(held)
        self._mixer.muted = self._muted or self._held

    def close(self) -> None:
        """Stop the sound; the transport goes on with the wall clock. Safe to call twice."""
        if self._device is not None:
            self._device.close()
            self._device = None
            self.transport.use_clock(wall.monotonic)
        self._blocks.close()

    def _device_samples(self) -> Generator[bytes, int, None]:
        """Yield the samples for the device as bytes; runs in its thread."""
        samples = yield b""
        while True:
            first = self.clock.take(samples)
            samples = yield self._mixer.fill(first, samples).tobytes()

    def _samples_ahead(self) -> Iterator[int]:
        return samples_ahead(self.transport.motion, self.clock(), self._origin, self.rate)


class SoundClock:
    """Seconds of sound that have been heard; call it for a reading.

    It counts the samples that the device takes, and follows the wall clock in between, which evens out the
    irregular times of its calls. It never goes back. Where the device stops taking samples, it goes on with
    the wall clock, and the samples that were not taken in time are never heard.

    rate: samples per second. latency: seconds from handing over samples to hearing them. monotonic: the wall
    clock, for tests. `take` is for the device's thread, reading the clock for any.
    """

    def __init__(self, rate: int, latency: float, *, monotonic: Callable[[], float] = wall.monotonic) -> None:
        self.rate = rate
        self.latency = latency
        self._monotonic = monotonic
        self._ahead: float | None = None  # this clock minus the wall clock
        self._samples = 0
        self._lost = 0.0  # seconds for which the device took nothing
        self._called = 0.0
        self._recent: deque[float] = deque(maxlen=CLOCK_CALLS)  # by how much calls were early
        self._filling = True
        self._last = -latency

    def __call__(self) -> float:
        """Return the seconds; 0 when the first sample is heard, before that negative."""
        ahead = self._ahead
        if ahead is not None:
            self._last = max(self._last, self._monotonic() + ahead)
        return self._last

    def take(self, samples: int) -> float:
        """Count samples that the device takes; return the reading at which the first of them is heard."""
        now = self._monotonic()
        if self._ahead is None:
            # A device fills its buffers at once when it starts, and begins to play then.
            self._ahead = -now
        elif self._filling:
            self._filling = now - self._called < 0.5 * samples / self.rate
        if not self._filling:
            here = self._samples / self.rate + self._lost - self.latency
            self._recent.append(here - now)
            off = max(self._recent) - self._ahead
            if off < -CLOCK_STOP and len(self._recent) == CLOCK_CALLS:
                self._lost -= off
                self._recent.clear()
            elif off > CLOCK_STOP:
                self._ahead += off
            elif off > -CLOCK_STOP:
                self._ahead += CLOCK_GAIN * off
        self._called = now
        first = self._samples / self.rate + self._lost
        self._samples += samples
        return first


def open_audio(
    path: PathLike, transport: Transport, *, offset: float = 0.0, backend: str | None = None
) -> Audio | None:
    """Open an audio file as `Audio`; None, with an FbaWarning, where there is no sound device.

    The transport then goes on with the wall clock.

    Raises FormatError where the file cannot be read or holds no sound.
    """
    try:
        return Audio(path, transport, offset=offset, backend=backend)
    except NoDeviceError as error:
        warnings.warn(
            f"{os.path.basename(os.fspath(path))} is not heard: no sound device can be used ({error}); "
            "the picture follows the wall clock",
            FbaWarning,
            stacklevel=2,
        )
        return None


def _open_device(rate: int, backend: str | None) -> Any:
    try:
        import miniaudio
    except ImportError as error:
        raise NoDeviceError(
            f"it needs the Python package miniaudio, which cannot be imported: {error}. "
            + cure(error, "mpeg4-fba[player]")
        ) from error
    with _silence_stderr():
        device = miniaudio.PlaybackDevice(
            output_format=miniaudio.SampleFormat.SIGNED16,
            nchannels=CHANNELS,
            sample_rate=rate,
            buffersize_msec=round(PERIOD * 1000),
            callback_periods=PERIODS,
            backends=[miniaudio.Backend.NULL] if backend == "null" else None,
            app_name="fba",
        )
    if backend != "null" and str(device.backend).lower() == "null":
        device.close()
        raise NoDeviceError("the system has none")
    return device


@contextlib.contextmanager
def _silence_stderr() -> Iterator[None]:
    """Silence standard error: sound libraries on Linux write pages to it where there is no device."""
    if not sys.platform.startswith("linux"):
        yield
        return
    try:
        saved = os.dup(2)
    except OSError:  # there is no standard error
        yield
        return
    try:
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, 2)
        os.close(null)
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)


def samples_ahead(motion: Motion, now: float, origin: float, rate: int) -> Iterator[int]:
    """Return the numbers of samples that will be heard soon, the next one first, in steps of a block.

    motion: of the transport. now: seconds of its clock. origin: time at which the sound begins, seconds. The
    last number lies a block behind the present position, for a start after a pause.
    """
    for ahead in np.arange(0.0, AHEAD_SECONDS + BLOCK_SECONDS / 2, BLOCK_SECONDS):
        yield int((motion.time(now + float(ahead)) - origin) * rate)
    yield int((motion.here - origin + BLOCK_SECONDS) * rate)


class SoundBlocks:
    """Samples of a sound file, in blocks that a thread decodes before they are needed.

    file: closed together with this. wanted: returns the numbers of samples that will be heard soon, the most
    urgent first; the decoding thread calls it all the time.
    """

    def __init__(self, file: SoundFile, wanted: Callable[[], Iterable[int]]) -> None:
        self._file = file
        self._wanted = wanted
        self._size = max(round(BLOCK_SECONDS * file.rate), 1)
        self._blocks: OrderedDict[int, Int16] = OrderedDict()
        self._closing = threading.Event()
        self._lock = threading.Lock()
        self.load()
        self._thread = threading.Thread(target=self._run, name="fba sound", daemon=True)
        self._thread.start()

    def take(self, start: int, count: int) -> Int16:
        """Return the samples int16 (count, 2); zeros outside of the file, and where it is not decoded yet."""
        taken = np.zeros((count, CHANNELS), dtype=np.int16)
        for number in range(max(start, 0) // self._size, (start + count - 1) // self._size + 1):
            block = self._blocks.get(number)
            if block is None:
                continue
            first = number * self._size - start
            part = block[max(-first, 0) : max(count - first, 0)]
            taken[max(first, 0) : max(first, 0) + len(part)] = part
        return taken

    def load(self) -> bool:
        """Decode the most urgent block that is not in memory; return False where all wanted ones are."""
        for sample in self._wanted():
            number = sample // self._size
            if number < 0:
                continue
            if number in self._blocks:
                self._blocks.move_to_end(number)
                continue
            with self._lock:
                if self._closing.is_set():
                    return False
                block = self._file.read(number * self._size, self._size)
            self._blocks[number] = block
            while len(self._blocks) > CACHED_BLOCKS:
                self._blocks.popitem(last=False)
            return True
        return False

    def close(self) -> None:
        """End the thread and close the file; safe to call twice."""
        self._closing.set()
        self._thread.join(5.0)
        with self._lock:
            self._file.close()

    def _run(self) -> None:
        while not self._closing.is_set():
            loaded = False
            with contextlib.suppress(FbaError, OSError):  # a file that went away is silent
                loaded = self.load()
            if not loaded:
                self._closing.wait(PAUSE_SECONDS)
