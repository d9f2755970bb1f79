"""Clicks and keys of a window in which feature points are placed by hand."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fba_player.scene._placement_scene import PlacementScene
from fba_player.scene._point_placement import PointPlacement
from fba_player.session._page import Page

if TYPE_CHECKING:
    from fba_player.session._session import Session

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
SAVED_SECONDS = 8.0
"""Seconds for which the notice of a saved file is shown: it may name what is missing."""


def placement_of(session: Session) -> PointPlacement | None:
    """Return the points that the session's window is for; None if it is for something else."""
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
    PLACING.note_unsaved(session, scene.placement)


def _mirror(session: Session, placement: PointPlacement) -> None:
    current, placed = placement.current, placement.mirror()
    if placed is None:
        session.say(f"{current} has no place or no other side: nothing to mirror", "warning", about="placing")
    else:
        session.say(f"{placed} placed at the mirror image", about="placing")


def _mirror_all(session: Session, placement: PointPlacement) -> None:
    count = placement.mirror_all()
    session.say(f"{count} point{'' if count == 1 else 's'} mirrored", about="placing")


def _tell_saved(session: Session, placement: PointPlacement) -> None:
    missing = placement.missing_units
    rest = f"; no face can be made without {', '.join(missing)}" if missing else ""
    text = f"{len(placement.places)} points saved as {placement.path}{rest}"
    session.say(text, "warning" if missing else "done", SAVED_SECONDS, about="placing")


PLACING: Page[PointPlacement] = Page(
    panel="points",
    topic="placing",
    plays=False,
    find=placement_of,
    click=click_on_head,
    keeps=lambda action: (
        action.split()[0] in ("camera", "reset_view", "screenshot", "fullscreen", "escape", "close")
    ),
    all_placed="All points have a place: Ctrl+S saves them",
    tell_saved=_tell_saved,
    actions={"mirror": _mirror, "mirror all": _mirror_all},
    keys={"right": "next", "left": "previous", "space": "missing", "m": "mirror", "ctrl+m": "mirror all"},
)
