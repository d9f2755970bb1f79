"""The part of an audio file that is about to be heard, in memory: decoded ahead by a thread of its own."""

from __future__ import annotations

import contextlib
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterable

import numpy as np

from fba.arrays import Int16
from fba.errors import FbaError
from fba_player.sound.audio_file import CHANNELS, SoundFile

SECONDS = 0.5
"""Length of a block."""
KEPT = 64
"""Blocks in memory, half a minute: 6 MB at 48 kHz."""
PAUSE = 0.03
"""Seconds between looks at what is wanted."""


class SoundBlocks:
    """Samples of a sound file, there at once where they were wanted before.

    file: closed with this. wanted: gives the samples, by number, that will be heard soon, the most urgent
    first; asked for all the time by the thread that decodes.
    """

    def __init__(self, file: SoundFile, wanted: Callable[[], Iterable[int]]) -> None:
        self._file = file
        self._wanted = wanted
        self._size = max(round(SECONDS * file.rate), 1)
        self._blocks: OrderedDict[int, Int16] = OrderedDict()
        self._closing = threading.Event()
        self._lock = threading.Lock()
        self.load()
        self._thread = threading.Thread(target=self._run, name="fba sound", daemon=True)
        self._thread.start()

    def take(self, start: int, count: int) -> Int16:
        """Samples int16 (count, 2); silence outside, and where none are there yet."""
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
        """Decode the most urgent block that is wanted and not here. False where all of them are."""
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
            while len(self._blocks) > KEPT:
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
            found = False
            with contextlib.suppress(FbaError, OSError):  # a file that went away is silent
                found = self.load()
            if not found:
                self._closing.wait(PAUSE)
