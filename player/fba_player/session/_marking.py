"""Clicks and keys of a window in which markers are mapped onto a head."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fba_player.scene.marker_editing import MarkerEditing
from fba_player.scene.markers_scene import MarkersScene
from fba_player.session._page import Page

if TYPE_CHECKING:
    from fba_player.session._session import Session

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


def editing_of(session: Session) -> MarkerEditing | None:
    """Return the virtual markers that the session's window is for; None if it is for something else."""
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
    MARKING.note_unsaved(session, scene.editing)


def _fix(_: Session, editing: MarkerEditing) -> None:
    marker = editing.marker
    editing.fix(marker is None or not marker.fixed)


def _over(session: Session, editing: MarkerEditing) -> None:
    editing.beside = not editing.beside
    session.viewpoint.reset()


def _weights(_: Session, editing: MarkerEditing) -> None:
    editing.shows_weights = not editing.shows_weights


def _tell_saved(session: Session, editing: MarkerEditing) -> None:
    session.say(f"{len(editing.mapping.markers)} markers saved as {editing.path}", about="marking")


MARKING: Page[MarkerEditing] = Page(
    panel="markers",
    topic="marking",
    plays=True,
    find=editing_of,
    click=click_on_picture,
    keeps=lambda action: not action.startswith(("panel", "points", "camera body", "follow")),
    all_placed="All markers are on the head: Ctrl+S saves them",
    tell_saved=_tell_saved,
    actions={"fix": _fix, "over": _over, "weights": _weights},
    keys={"x": "fix", "o": "over", "w": "weights"},
)
