"""The part of an audio file that will be heard soon, decoded ahead by a thread."""

from __future__ import annotations

import contextlib
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator

import numpy as np

from fba.arrays import Int16
from fba.audio import CHANNELS, SoundFile
from fba.errors import FbaError
from fba_player.playback._playhead import Motion

BLOCK_SECONDS = 0.5
"""Length of a block, in seconds."""
AHEAD_SECONDS = 2.5
"""Seconds ahead of now whose samples are decoded in advance."""
CACHED_BLOCKS = 64
"""Blocks in memory, half a minute: 6 MB at 48 kHz."""
PAUSE_SECONDS = 0.03
"""Seconds between checks of which samples are wanted."""


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
