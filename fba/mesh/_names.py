"""Unique names of parts."""

from __future__ import annotations

from collections.abc import Iterable


class UniqueNames:
    """Gives names, numbered where they are taken: "skin", "skin 2", "skin 3".

    taken: names that are not given. The time for each name does not grow with the number of equal ones.
    """

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._last = dict.fromkeys(taken, 1)

    def __call__(self, name: str) -> str:
        """Return the name, or the name with the next free number; it is taken from now on."""
        number = self._last.get(name, 0) + 1
        unique = name
        if number > 1:
            while (unique := f"{name} {number}") in self._last:
                number += 1
            self._last[unique] = 1
        self._last[name] = number
        return unique
