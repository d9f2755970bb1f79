"""Takes: what is shown, sampled at a stream's rate while it is performed, and kept as an .fba file."""

from __future__ import annotations

import os
from fractions import Fraction
from pathlib import Path

import numpy as np

from fba.animation import Animation
from fba.arrays import Float32, Float64
from fba.errors import FormatError, RangeError
from fba.parameters import BAP_COUNT, FAP_COUNT, FIRST_LOW_LEVEL_FAP
from fba.tracks import BodyTrack, FaceTrack

Faps = Float32
Baps = Float64

RATE = Fraction(25)
"""Frames a second where what is played has no usable rate."""
RATES = (5, 120)
LONGEST = 3600.0
"""Seconds that a take may last."""
STILL = 0.2
"""Where nothing was shown for so many seconds, nothing changed in the meantime."""
ALWAYS = slice(180, 186)
"""BAPs of the whole body, which a take with a body always sends."""


def take_rate(rate: Fraction) -> Fraction:
    """The rate at which a take over a performance of that rate is sampled."""
    return rate if RATES[0] <= rate <= RATES[1] else RATE


class TakeRecorder:
    """Samples what is shown. `add` it with its time, as often as it is drawn; `take` gives the result.

    rate: frames a second. face, body: what the take is to have. Between two pictures values are
    interpolated, so the take does not depend on how often something was drawn.
    """

    def __init__(self, rate: Fraction, *, face: bool = True, body: bool = False) -> None:
        if not (face or body):
            raise ValueError("a take needs a face, a body, or both")
        self.rate = rate
        self.seconds = 0.0
        self.full = False
        self._face, self._body = face, body
        self._faps: list[Faps] = []
        self._baps: list[Baps] = []
        self._last: tuple[float, Faps, Baps] | None = None

    def __len__(self) -> int:
        return len(self._faps)

    def add(self, seconds: float, faps: Faps, baps: Baps) -> None:
        """FAPs (68,) and BAPs (296,) shown `seconds` after the take began; times must not go back.

        What comes after `LONGEST` is left out, and `full` set.
        """
        before = self._last or (0.0, faps, baps)
        if seconds < before[0]:
            raise ValueError(f"times of a take must not go back: {seconds} after {before[0]}")
        self.full = self.full or seconds > LONGEST
        seconds = min(seconds, LONGEST)
        since = before[0] if seconds - before[0] <= STILL else seconds
        while (at := float(len(self._faps) / self.rate)) <= seconds + 1e-9:
            share = min((at - since) / (seconds - since), 1.0) if at >= since and seconds > since else 0.0
            if at >= seconds - 1e-9:
                share = 1.0
            self._faps.append(before[1] + (faps - before[1]) * np.float32(share))
            self._baps.append(before[2] + (baps - before[2]) * share)
        self._last = (seconds, faps.copy(), baps.copy())
        self.seconds = seconds

    def take(self, name: str = "take") -> Animation:
        """What was recorded; ValueError where nothing was.

        All FAPs are sent in every frame: one left out would be filled in by the face that shows it. Of BAPs,
        which are 0 where nothing is sent, only those that were ever moved.
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
            sent[ALWAYS] = True
            body = BodyTrack(turned, np.tile(sent | turned.any(axis=0), (count, 1)))
        return Animation(self.rate, np.arange(count), face, body, name)


class Takes:
    """The takes of a session, the last one on top. folder: where they are saved."""

    def __init__(self, folder: str | os.PathLike[str] | None = None) -> None:
        self.folder = Path(folder) if folder is not None else Path()
        self._takes: list[Animation] = []

    def __len__(self) -> int:
        return len(self._takes)

    @property
    def last(self) -> Animation | None:
        """The last take that was not undone."""
        return self._takes[-1] if self._takes else None

    def add(self, take: Animation) -> None:
        """Keep a take."""
        self._takes.append(take)

    def undo(self) -> Animation | None:
        """Forget the last take, and return it; files that were saved stay."""
        return self._takes.pop() if self._takes else None

    def path(self, name: str) -> Path:
        """Where a name leads: into the folder, with .fba at its end; FormatError for no name."""
        name = name.strip()
        if not name or name.endswith(("/", os.sep)) or name in (".", ".."):
            raise FormatError("is no name for a file; write one, such as take.fba", path=name or "take")
        path = self.folder / name
        return path if path.suffix.lower() == ".fba" else path.with_name(path.name + ".fba")

    def free_name(self, name: str = "take") -> str:
        """`name`, or `name-2` and so on, whichever no file has yet."""
        number, found = 2, name
        while self.path(found).exists():
            found, number = f"{name}-{number}", number + 1
        return found

    def save(self, name: str, *, bap_steps: str = "iso") -> tuple[Path, str]:
        """Write the last take; its path, and the table of BAP steps that readers need.

        Where the standard's steps ("iso") do not reach as far as a joint was turned, "visage" are used.
        Raises FormatError where there is a file of that name already, where nothing was recorded or it
        cannot be written, RangeError for values that no stream holds.
        """
        path = self.path(name)
        if self.last is None:
            raise FormatError("nothing was recorded that could be saved", path=path)
        if path.exists():
            raise FormatError(
                "exists already, and is not overwritten; choose another name, such as "
                f"{self.free_name(path.stem)}",
                path=path,
            )
        import fba

        try:
            fba.write(path, self.last, bap_steps=bap_steps)
        except RangeError:
            if self.last.body is None or bap_steps == "visage":
                raise
            bap_steps = "visage"
            fba.write(path, self.last, bap_steps=bap_steps)
        return path, bap_steps
