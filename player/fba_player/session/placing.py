"""Clicks and keys of a window in which feature points are placed by hand."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from fba.errors import FbaError
from fba_player.scene.placement_scene import PlacementScene
from fba_player.scene.point_placement import PointPlacement

if TYPE_CHECKING:
    from fba_player.session.session import Session

KEYS = (
    ("Click", "place the point here"),
    ("Drag", "turn the head (right button: move)"),
    ("Space, Enter", "next point without a place"),
    ("Down, Up", "next point, previous point"),
    ("M", "mirror to the other side"),
    ("Ctrl+M", "mirror all that the other side lacks"),
    ("Ctrl+Z", "undo"),
    ("Delete", "remove the point"),
    ("Ctrl+S", "save"),
    ("1, 2, 3, R", "from the front, three-quarter, profile, reset"),
    ("F", "full screen"),
    ("Esc", "close"),
)
"""For the panel."""
KEPT_ACTIONS = ("camera", "reset_view", "screenshot", "fullscreen", "escape", "close")
"""First words of the actions of the table of keys that keep their keys."""
UNSAVED = "the points"
"""Name of points that are not saved, in the warning before the window closes."""
LONG = 8.0
"""Seconds for which errors are shown."""


def placement_of(session: Session) -> PointPlacement | None:
    """The points that the session's window is for; None where it shows something else."""
    return session.scene.placement if isinstance(session.scene, PlacementScene) else None


def click_on_head(session: Session, x: float, y: float) -> None:
    """Place the current point at what is seen at this pixel."""
    scene = session.scene
    assert isinstance(scene, PlacementScene)
    vertex = scene.vertex_under(session.camera(session.transport.time), x, y, session.size)
    if vertex is None:
        session.say("Click on the head to place the point", "warning", about="placing")
        return
    scene.placement.place(vertex)
    _note_unsaved(session, scene.placement)


def press_key(session: Session, name: str) -> bool:
    """Do what a key means here; returns False if it has no meaning. name: as in the table of keys."""
    placement = placement_of(session)
    if placement is None or name not in _ACTIONS:
        return False
    session.touched()
    act_on(session, placement, _ACTIONS[name])
    return True


def act_on(session: Session, placement: PointPlacement, action: str) -> None:
    """Do an action: "next", "previous", "missing", "mirror", "mirror all", "undo", "remove" or "save"."""
    _DOERS[action](session, placement)
    _note_unsaved(session, placement)


def _missing(session: Session, placement: PointPlacement) -> None:
    if not placement.next_missing():
        session.say("All points have a place: Ctrl+S saves them", about="placing")


def _mirror(session: Session, placement: PointPlacement) -> None:
    current, placed = placement.current, placement.mirror()
    if placed is None:
        session.say(f"{current} has no place or no other side: nothing to mirror", "warning", about="placing")
    else:
        session.say(f"{placed} placed at the mirror image", about="placing")


def _mirror_all(session: Session, placement: PointPlacement) -> None:
    count = placement.mirror_all()
    session.say(f"{count} point{'' if count == 1 else 's'} mirrored", about="placing")


def _undo(session: Session, placement: PointPlacement) -> None:
    if not placement.undo():
        session.say("There is nothing to undo", "warning", about="placing")


def _save(session: Session, placement: PointPlacement) -> None:
    try:
        placement.save()
    except (FbaError, OSError) as error:
        session.say(f"Not saved: {error}", "error", LONG, about="placing")
        return
    missing = placement.missing_units
    rest = f"; no face can be made without {', '.join(missing)}" if missing else ""
    kind = "warning" if missing else "done"
    session.say(
        f"{len(placement.places)} points saved as {placement.path}{rest}", kind, LONG, about="placing"
    )


def _note_unsaved(session: Session, placement: PointPlacement) -> None:
    if placement.changed:
        session.unsaved.add(UNSAVED)
    else:
        session.unsaved.discard(UNSAVED)


_DOERS: dict[str, Callable[[Session, PointPlacement], None]] = {
    "next": lambda _, placement: placement.step(1),
    "previous": lambda _, placement: placement.step(-1),
    "missing": _missing,
    "mirror": _mirror,
    "mirror all": _mirror_all,
    "undo": _undo,
    "remove": lambda _, placement: placement.remove(),
    "save": _save,
}
_ACTIONS = {
    "down": "next", "right": "next", "up": "previous", "left": "previous", "space": "missing",
    "enter": "missing", "m": "mirror", "ctrl+m": "mirror all", "ctrl+z": "undo", "delete": "remove",
    "backspace": "remove", "ctrl+s": "save",
}  # fmt: skip
