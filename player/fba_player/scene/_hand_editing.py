"""The base of what is placed by hand: the current item, next and previous, undoing, saving."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection
from copy import copy
from pathlib import Path
from typing import ClassVar, Generic, TypeVar

from fba.errors import OptionError

State = TypeVar("State")


class HandEditing(ABC, Generic[State]):
    """Named items that a user places on a head or a picture one by one.

    state: all that is edited; a change replaces it. current: the name of the item that the next click places.
    path: the file to write; None if none was named. written: whether the file was written. item, subject:
    what messages call one item and all of them.
    """

    item: ClassVar[str]
    subject: ClassVar[str]

    def __init__(self, state: State, current: str, path: Path | None) -> None:
        self.state = state
        self.current = current
        self.path = path
        self.written = False
        self._saved = copy(state)
        self._undo_stack: list[tuple[str, State]] = []
        self._last_gesture: tuple[str, str] | None = None

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of all items, in the order in which next and previous visit them."""

    @property
    @abstractmethod
    def placed(self) -> Collection[str]:
        """Names of the items that have a place."""

    @abstractmethod
    def remove(self) -> None:
        """Take the current item away."""

    @abstractmethod
    def _write(self, path: Path) -> None:
        """Write the state to a file. Raises OSError, FbaError if it cannot be written."""

    @property
    def missing(self) -> tuple[str, ...]:
        """Names of the items without a place, in order."""
        placed = self.placed
        return tuple(name for name in self.names if name not in placed)

    @property
    def changed(self) -> bool:
        """Whether there are changes that were not saved."""
        return self.state != self._saved

    def choose(self, name: str) -> None:
        """Make an item the current one. Raises ValueError for a name that is not among `names`."""
        if name not in self.names:
            raise ValueError(f"there is no {self.item} {name!r} to place")
        self.current = name

    def step(self, by: int) -> None:
        """Make the item `by` places further current; after the last comes the first."""
        names = self.names
        self.current = names[(names.index(self.current) + by) % len(names)]

    def next_missing(self) -> bool:
        """Go to the next item without a place; return False if all have one."""
        names, placed = self.names, self.placed
        after = names.index(self.current) + 1
        for name in (*names[after:], *names[:after]):
            if name not in placed:
                self.current = name
                return True
        return False

    def undo(self) -> bool:
        """Take back the last change, with the item that was current then; return False without a change."""
        if not self._undo_stack:
            return False
        self.current, self.state = self._undo_stack.pop()
        self._last_gesture = None
        return True

    def save(self) -> None:
        """Write the file.

        Raises OptionError if no file was named, OSError or FbaError if it cannot be written.
        """
        if self.path is None:
            raise OptionError(f"no file was named for {self.subject}")
        self._write(self.path)
        self._saved, self.written = copy(self.state), True

    def _change(self, state: State, gesture: str = "") -> None:
        """Replace the state, as one step to undo.

        gesture: changes of one item with the same gesture, such as the drag of a slider, are one step.
        """
        if state == self.state:
            return
        this_gesture = (gesture, self.current) if gesture else None
        if this_gesture is None or this_gesture != self._last_gesture:
            self._undo_stack.append((self.current, self.state))
        self._last_gesture = this_gesture
        self.state = state
