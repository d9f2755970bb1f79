"""Clicks and keys of a window in which markers are mapped onto a head."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from fba.errors import FbaError
from fba_player.scene.marker_editing import MarkerEditing
from fba_player.scene.markers_scene import MarkersScene

if TYPE_CHECKING:
    from fba_player.session.session import Session

KEYS = (
    ("Click", "on a marker: choose it; on the head: put it there"),
    ("Drag", "turn the head (right button: move)"),
    ("Space", "play, pause"),
    ("Down, Up", "next marker, previous marker"),
    ("Enter", "next marker without a vertex"),
    ("X", "fixed, or moved by the face"),
    ("O", "cloud over the head, or beside it"),
    ("W", "colours of its reach, or the face's own"),
    ("Ctrl+Z", "undo"),
    ("Delete", "remove from the head"),
    ("Ctrl+S", "save"),
    ("1, 2, 3, R", "from the front, three-quarter, profile, reset"),
    ("Esc", "close"),
)
"""For the panel."""
OTHER_ACTIONS = ("panel", "points", "camera body", "follow")
"""Beginnings of the actions of the table of keys that mean nothing here; all others keep their keys."""
UNSAVED = "the mapping"
"""Name of a mapping that is not saved, in the warning before the window closes."""
LONG = 8.0
"""Seconds for which errors are shown."""


def editing_of(session: Session) -> MarkerEditing | None:
    """The virtual markers that the session's window is for; None where it shows something else."""
    return session.scene.editing if isinstance(session.scene, MarkersScene) else None


def click_on_picture(session: Session, x: float, y: float) -> None:
    """Choose the marker at this pixel, else put the current one on the vertex that is seen there."""
    scene, time = session.scene, session.transport.time
    assert isinstance(scene, MarkersScene)
    camera = session.camera(time)
    name = scene.marker_under(camera, x, y, session.size, time)
    if name is not None:
        scene.editing.choose(name)
        return
    vertex = scene.vertex_under(camera, x, y, session.size, time)
    if vertex is None:
        session.say(
            "Click on a marker to choose it, or on the head to put it there", "warning", about="marking"
        )
        return
    scene.editing.place(vertex)
    session.say(f"{scene.editing.current} on vertex {vertex}", about="marking")
    note_unsaved(session, scene.editing)


def press_key(session: Session, name: str) -> bool:
    """Do what a key means here; returns False if it has no meaning. name: as in the table of keys."""
    editing = editing_of(session)
    if editing is None or name not in _ACTIONS:
        return False
    session.touched()
    act_on(session, editing, _ACTIONS[name])
    return True


def act_on(session: Session, editing: MarkerEditing, action: str) -> None:
    """Do an action: "next", "previous", "missing", "fix", "over", "weights", "undo", "remove" or "save"."""
    _DOERS[action](session, editing)
    note_unsaved(session, editing)


def note_unsaved(session: Session, editing: MarkerEditing) -> None:
    """Tell the session whether there is something to save."""
    if editing.changed:
        session.unsaved.add(UNSAVED)
    else:
        session.unsaved.discard(UNSAVED)


def _missing(session: Session, editing: MarkerEditing) -> None:
    if not editing.next_missing():
        session.say("All markers are on the head: Ctrl+S saves them", about="marking")


def _fix(session: Session, editing: MarkerEditing) -> None:
    marker = editing.marker
    editing.fix(marker is None or not marker.fixed)


def _over(session: Session, editing: MarkerEditing) -> None:
    editing.beside = not editing.beside
    session.viewpoint.reset()


def _weights(session: Session, editing: MarkerEditing) -> None:
    editing.shows_weights = not editing.shows_weights


def _undo(session: Session, editing: MarkerEditing) -> None:
    if not editing.undo():
        session.say("There is nothing to undo", "warning", about="marking")


def _save(session: Session, editing: MarkerEditing) -> None:
    try:
        editing.save()
    except (FbaError, OSError) as error:
        session.say(f"Not saved: {error}", "error", LONG, about="marking")
        return
    session.say(f"{len(editing.mapping.markers)} markers saved as {editing.path}", about="marking")


_DOERS: dict[str, Callable[[Session, MarkerEditing], None]] = {
    "next": lambda _, editing: editing.step(1),
    "previous": lambda _, editing: editing.step(-1),
    "missing": _missing,
    "fix": _fix,
    "over": _over,
    "weights": _weights,
    "undo": _undo,
    "remove": lambda _, editing: editing.remove(),
    "save": _save,
}
_ACTIONS = {
    "down": "next", "up": "previous", "enter": "missing", "x": "fix", "o": "over", "w": "weights",
    "ctrl+z": "undo", "delete": "remove", "backspace": "remove", "ctrl+s": "save",
}  # fmt: skip
