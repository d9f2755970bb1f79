"""Sound in step with the picture: the transport follows the clock of the sound device.

The samples that a device has played are the clock of the transport. The samples that it asks for next will be
heard at a known reading of that clock, so it gets those of the time that the transport will show then.
Pausing, seeking, looping and speeds need no code of their own, and nothing can drift.
"""

from __future__ import annotations

import contextlib
import os
import sys
import time as wall
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

from fba.atomic import PathLike
from fba.audio import CHANNELS, SoundFile
from fba.errors import FbaWarning
from fba_player.gl._context import cure
from fba_player.playback._transport import Transport
from fba_player.sound._mixer import SoundMixer
from fba_player.sound._read_ahead import SoundBlocks, samples_ahead
from fba_player.sound.soundtrack import find_sound_beside
from fba_player.view.protocols import Closing

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
