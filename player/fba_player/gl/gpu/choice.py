"""Whether figures are deformed on the graphics card or by the processor: as wished, or as was measured."""

from __future__ import annotations

import csv
import hashlib
import os
from collections.abc import Callable
from functools import cache
from importlib.resources import files
from statistics import median
from typing import Any

import numpy as np

from fba.cache import kept

DEFORM = ("auto", "cpu", "gpu")
"""What one may wish."""
VARIABLE = "FBA_DEFORM"
"""The environment variable by which one may wish it."""
ROUNDS = 9
"""Pictures drawn in each way to find out which is faster; the first two of them do not count."""
BETTER = 0.95
"""The graphics card does it where it takes less than this share of the time."""
MEASURING = "1"
"""Counts up with every change of what is measured."""
Trial = Callable[[bool], float]

_preferred: list[str] = []


def prefer(wish: str) -> None:
    """What "auto" stands for from now on in this program; "auto" for what it stood for."""
    _preferred[:] = [] if checked(wish) == "auto" else [wish]


def checked(wish: str) -> str:
    """The same word; ValueError where it is none of `DEFORM`."""
    if wish not in DEFORM:
        raise ValueError(f"no way to deform {wish!r}; there are {', '.join(DEFORM)}")
    return wish


def wished(wish: str) -> str:
    """The same where it is no "auto"; else what was preferred or the environment says."""
    if checked(wish) != "auto":
        return wish
    found = _preferred[0] if _preferred else os.environ.get(VARIABLE, "").strip().lower()
    return found if found in DEFORM else "auto"


class Choice:
    """Makes up its mind for each size of model, and says why.

    info: as moderngl's context has it. wish: one of `DEFORM`.
    """

    def __init__(self, info: dict[str, Any], wish: str = "auto") -> None:
        self.wish = wished(wish)
        self.reason = "nothing was drawn yet"
        self._name = tuple(str(info.get(f"GL_{word}", "")) for word in ("VENDOR", "RENDERER", "VERSION"))
        self._failed = ""
        self._found: dict[int, tuple[bool, str]] = {}

    def on_gpu(self, count: int, trial: Trial) -> bool:
        """Whether the graphics card is to do it for figures of so many vertices.

        trial: draws a picture, on the graphics card or not; the seconds that it took, infinite where it
        failed. It is called only where that is not known from before.
        """
        if self._failed:
            return False
        if count not in self._found:
            self._found[count] = self._made(count, trial)
        chosen, self.reason = self._found[count]
        return chosen

    def give_up(self, reason: str) -> None:
        """The graphics card cannot do it: it is not asked again."""
        self._failed = self.reason = f"the graphics card cannot do it: {reason}"

    def _made(self, count: int, trial: Trial) -> tuple[bool, str]:
        if self.wish != "auto":
            return self.wish == "gpu", "as wished"
        if not count:
            return False, "there is nothing that a graphics card could deform"
        if is_software(self._name[1]):
            return False, f"{self._name[1]} is no graphics card"
        words = "\n".join((MEASURING, *self._name, str(count)))
        digest = hashlib.sha256(words.encode()).hexdigest()[:32]
        cpu, gpu = kept(f"deform-{digest}", ((2,),), lambda: [measured(trial)], np.float64)[0].tolist()
        if gpu >= FAILED:
            return False, "it came out wrong on the graphics card"
        return gpu < BETTER * cpu, f"measured: {cpu * 1e3:.2f} ms, on the graphics card {gpu * 1e3:.2f} ms"


FAILED = 1e6
"""Seconds: what stands for a trial that failed."""


def measured(trial: Trial) -> Any:
    """float64 (2,): seconds that a picture takes, without the graphics card and with it."""
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(ROUNDS):
        for on_gpu in (False, True):
            times[on_gpu].append(min(trial(on_gpu), FAILED))
            if times[on_gpu][-1] >= FAILED:
                return np.array([0.0, FAILED])
    return np.array([median(row[2:]) for row in times])


def is_software(renderer: str) -> bool:
    """Whether a GL_RENDERER is the processor."""
    return any(word in renderer.lower() for word in _software())


@cache
def _software() -> tuple[str, ...]:
    text = (files(__package__) / "software.csv").read_text(encoding="utf-8")
    return tuple(row["name"] for row in csv.DictReader(text.splitlines()))
