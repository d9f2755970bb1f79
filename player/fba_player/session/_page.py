"""A window for one task on a head, in which clicks and keys have meanings of their own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from fba.errors import FbaError
from fba_player.scene._hand_editing import HandEditing

if TYPE_CHECKING:
    from fba_player.session._session import Session

Edited = TypeVar("Edited", bound=HandEditing[Any])

ERROR_SECONDS = 8.0
"""Seconds for which an error is shown."""


@dataclass(frozen=True, eq=False)
class Page(Generic[Edited]):
    """A window in which items are placed on a head by hand.

    panel: name of the panel that belongs to it. topic: what its notices are about. plays: whether the
    timeline and the buttons of panels are shown. find: returns what a session's window edits, None for other
    windows. click: does what a click at a pixel means. keeps: whether an action of the table of keys keeps
    its key. all_placed: the notice where no item is missing. tell_saved: tells that the file was written.
    actions, keys: the actions of this page and their keys, besides those that all pages have.
    """

    panel: str
    topic: str
    plays: bool
    find: Callable[[Session], Edited | None]
    click: Callable[[Session, float, float], None]
    keeps: Callable[[str], bool]
    all_placed: str
    tell_saved: Callable[[Session, Edited], None]
    actions: Mapping[str, Callable[[Session, Edited], None]]
    keys: Mapping[str, str]

    def press_key(self, session: Session, name: str) -> bool:
        """Do what a key means here; return False if it has no meaning. name: as in the table of keys."""
        edited = self.find(session)
        action = self.keys.get(name) or COMMON_KEYS.get(name)
        if edited is None or action is None:
            return False
        session.touched()
        self.act(session, edited, action)
        return True

    def act(self, session: Session, edited: Edited, action: str) -> None:
        """Do an action: one of `actions`, or "next", "previous", "missing", "undo", "remove" or "save"."""
        if action in self.actions:
            self.actions[action](session, edited)
        elif action in ("next", "previous"):
            edited.step(1 if action == "next" else -1)
        elif action == "missing":
            if not edited.next_missing():
                session.say(self.all_placed, about=self.topic)
        elif action == "undo":
            if not edited.undo():
                session.say("There is nothing to undo", "warning", about=self.topic)
        elif action == "remove":
            edited.remove()
        elif action == "save":
            self._save(session, edited)
        else:
            raise ValueError(f"this page has no action {action!r}")
        self.note_unsaved(session, edited)

    def note_unsaved(self, session: Session, edited: Edited) -> None:
        """Tell the session whether there are changes to save, for the warning before the window closes."""
        if edited.changed:
            session.unsaved.add(edited.subject)
        else:
            session.unsaved.discard(edited.subject)

    def _save(self, session: Session, edited: Edited) -> None:
        try:
            edited.save()
        except (FbaError, OSError) as error:
            session.say(f"Not saved: {error}", "error", ERROR_SECONDS, about=self.topic)
        else:
            self.tell_saved(session, edited)


COMMON_KEYS = {
    "down": "next", "up": "previous", "enter": "missing", "ctrl+z": "undo", "delete": "remove",
    "backspace": "remove", "ctrl+s": "save",
}  # fmt: skip
"""Keys of the actions that all pages have."""
