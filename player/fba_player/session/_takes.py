"""Takes: recordings of the values that are shown, sampled at a frame rate and saved as .fba files."""

from __future__ import annotations

import os
from fractions import Fraction
from pathlib import Path

import numpy as np

from fba.animation import Animation
from fba.arrays import Float32, Float64
from fba.errors import FormatError, RangeError
from fba.parameters import BAP_COUNT, FAP_COUNT, FIRST_LOW_LEVEL_FAP, BapTable
from fba.tracks import BodyTrack, FaceTrack

DEFAULT_TAKE_RATE = Fraction(25)
"""Frames per second of a take where the rate of the animation is outside of `TAKE_RATES`."""
TAKE_RATES = (5, 120)
MAX_TAKE_SECONDS = 3600.0
"""Longest duration of a take."""
HOLD_SECONDS = 0.2
"""Seconds without a picture after which values are held, not interpolated, until the next one."""
ROOT_BAPS = slice(180, 186)
"""BAPs of the root, which a take with a body always sends."""


def take_rate(rate: Fraction) -> Fraction:
    """Return the frame rate of a take over an animation with this rate."""
    return rate if TAKE_RATES[0] <= rate <= TAKE_RATES[1] else DEFAULT_TAKE_RATE


class TakeRecorder:
    """Records the values of pictures as a take: `add` those of each picture, then call `take`.

    rate: frames per second. face, body: whether the take has one. Values are interpolated between pictures,
    so that the take does not depend on how often pictures were drawn.
    """

    def __init__(self, rate: Fraction, *, face: bool = True, body: bool = False) -> None:
        if not (face or body):
            raise ValueError("a take needs a face, a body, or both")
        self.rate = rate
        self.seconds = 0.0
        self.full = False
        self._face, self._body = face, body
        self._faps: list[Float32] = []
        self._baps: list[Float64] = []
        self._last: tuple[float, Float32, Float64] | None = None

    def __len__(self) -> int:
        return len(self._faps)

    def add(self, seconds: float, faps: Float32, baps: Float64) -> None:
        """Add FAPs (68,) and BAPs (296,) shown `seconds` after the take began.

        After `MAX_TAKE_SECONDS` nothing more is added, and `full` is set. Raises ValueError if times go back.
        """
        before = self._last or (0.0, faps, baps)
        if seconds < before[0]:
            raise ValueError(f"times of a take must not go back: {seconds} after {before[0]}")
        self.full = self.full or seconds > MAX_TAKE_SECONDS
        seconds = min(seconds, MAX_TAKE_SECONDS)
        since = before[0] if seconds - before[0] <= HOLD_SECONDS else seconds
        while (at := float(len(self._faps) / self.rate)) <= seconds + 1e-9:
            share = min((at - since) / (seconds - since), 1.0) if at >= since and seconds > since else 0.0
            if at >= seconds - 1e-9:
                share = 1.0
            self._faps.append(before[1] + (faps - before[1]) * np.float32(share))
            self._baps.append(before[2] + (baps - before[2]) * share)
        self._last = (seconds, faps.copy(), baps.copy())
        self.seconds = seconds

    def take(self, name: str = "take") -> Animation:
        """Return the recording as an animation. Raises ValueError if nothing was recorded.

        All FAPs are sent in every frame, because a face fills in those that are not sent. BAPs are 0 unless
        sent, so only those that ever moved are.
        """
        if not self._faps:
            raise ValueError("nothing was recorded")
        count = len(self._faps)
        face = body = None
        if self._face:
            values = np.rint(np.stack(self._faps)).astype(np.int32)
            values[:, : FIRST_LOW_LEVEL_FAP - 1] = 0
            sent = np.arange(FAP_COUNT) >= FIRST_LOW_LEVEL_FAP - 1
            face = FaceTrack(values, np.tile(sent, (count, 1)))
        if self._body:
            turned = np.rint(np.stack(self._baps)).astype(np.int32)
            sent = np.zeros(BAP_COUNT, bool)
            sent[ROOT_BAPS] = True
            body = BodyTrack(turned, np.tile(sent | turned.any(axis=0), (count, 1)))
        return Animation(self.rate, np.arange(count), face, body, name)


class Takes:
    """The takes of a session in order. folder: where they are saved; by default the current one."""

    def __init__(self, folder: str | os.PathLike[str] | None = None) -> None:
        self.folder = Path(folder) if folder is not None else Path()
        self._takes: list[Animation] = []

    def __len__(self) -> int:
        return len(self._takes)

    @property
    def last(self) -> Animation | None:
        """The last take that was not undone; None without one."""
        return self._takes[-1] if self._takes else None

    def add(self, take: Animation) -> None:
        """Add a take as the last one."""
        self._takes.append(take)

    def undo(self) -> Animation | None:
        """Remove and return the last take; saved files stay."""
        return self._takes.pop() if self._takes else None

    def path(self, name: str) -> Path:
        """Return the path for a name: in the folder, with the suffix .fba; FormatError for an empty name."""
        name = name.strip()
        if not name or name.endswith(("/", os.sep)) or name in (".", ".."):
            raise FormatError("is not a file name; give one, such as take.fba", path=name or "take")
        path = self.folder / name
        return path if path.suffix.lower() == ".fba" else path.with_name(path.name + ".fba")

    def free_name(self, name: str = "take") -> str:
        """Return `name`, or `name-2` and so on: the first that no file has yet."""
        number, free = 2, name
        while self.path(free).exists():
            free, number = f"{name}-{number}", number + 1
        return free

    def save(self, name: str, *, bap_steps: BapTable = "iso") -> tuple[Path, str]:
        """Write the last take; return its path, and the table of BAP steps that readers need.

        If the steps of the standard ("iso") cannot code a turn of a joint, "visage" are used. Raises
        FormatError if a file of that name exists, nothing was recorded or the file cannot be written,
        RangeError for values that no stream can code.
        """
        path = self.path(name)
        if self.last is None:
            raise FormatError("nothing was recorded that could be saved", path=path)
        if path.exists():
            free = self.free_name(path.stem)
            text = f"exists already, and is not overwritten; choose another name, such as {free}"
            raise FormatError(text, path=path)
        import fba

        try:
            fba.write(path, self.last, bap_steps=bap_steps)
        except RangeError:
            if self.last.body is None or bap_steps == "visage":
                raise
            bap_steps = "visage"
            fba.write(path, self.last, bap_steps=bap_steps)
        return path, bap_steps
