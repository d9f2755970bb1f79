"""The sound of a film of the window: as it is heard during the recording, with pauses and jumps."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fba.arrays import Int16
from fba.atomic import PathLike
from fba_player.playback.transport import Transport
from fba_player.sound._mixer import SoundMixer
from fba_player.sound._pyav import import_av
from fba_player.sound.audio_file import CHANNELS, SoundFile
from fba_player.sound.soundtrack import AAC_FRAME, AAC_RATES, make_frame

PIECE_SECONDS = 1.0
"""Most seconds mixed at once."""


class FilmSound:
    """Samples for a film that follow a transport; a `fba_player.sound.soundtrack.FilmedSound`.

    path: an audio file. transport: what is played. offset: returns the seconds by which the sound begins
    after the first frame. muted: returns whether it is silent now.

    The window's thread calls `advance` and `end`, the encoder's `frames`. It needs no sound device. Raises
    FormatError where the file cannot be read.
    """

    def __init__(
        self,
        path: PathLike,
        transport: Transport,
        *,
        offset: Callable[[], float] = lambda: 0.0,
        muted: Callable[[], bool] = lambda: False,
    ) -> None:
        self.path = Path(path)
        self._av = import_av()
        self._file = SoundFile(path, rates=AAC_RATES)
        self.rate = self._file.rate
        self.channels, self.layout = CHANNELS, "stereo"
        self._transport, self._offset, self._muted = transport, offset, muted
        self._mixer = SoundMixer(self._take, self.rate, lambda: transport.motion, transport.start)
        self._mixed: deque[Int16] = deque()
        self._lock = threading.Lock()
        self._done = 0
        self._ended = False

    def advance(self, seconds: float) -> None:
        """Mix the sound up to a length of the film in seconds, which the transport has reached now."""
        now = self._transport.clock
        self._mixer.origin = self._transport.start + self._offset()
        self._mixer.muted = self._muted()
        missing = round(seconds * self.rate) - self._done
        while missing > 0:
            count = min(missing, round(PIECE_SECONDS * self.rate))
            samples = self._mixer.fill(now - missing / self.rate, count)
            with self._lock:
                self._mixed.append(samples)
            self._done += count
            missing -= count

    def end(self) -> None:
        """End the sound: the rest of the film is silent."""
        self._ended = True

    def frames(self, samples: int) -> Iterator[Any]:
        """Yield the next samples as far as they are mixed, as `av.AudioFrame`s ("fltp") without times."""
        while samples > 0:
            most = min(samples, AAC_FRAME)
            with self._lock:
                part = self._mixed.popleft() if self._mixed else None
                if part is not None and len(part) > most:
                    self._mixed.appendleft(part[most:])
            if part is None:
                if not self._ended:
                    return
                part = np.zeros((most, CHANNELS), dtype=np.int16)
            part = part[:most]
            samples -= len(part)
            block = np.ascontiguousarray(part.T, dtype=np.float32) / np.float32(32768)
            yield make_frame(self._av, block, self.layout, self.rate)

    def close(self) -> None:
        """Close the file; safe to call twice."""
        self._file.close()

    def _take(self, start: int, count: int) -> Int16:
        """Return the samples int16 (count, 2) of the file; zeros outside."""
        taken = np.zeros((count, CHANNELS), dtype=np.int16)
        first = min(max(-start, 0), count)
        samples = self._file.read(start + first, count - first)
        taken[first : first + len(samples)] = samples
        return taken
