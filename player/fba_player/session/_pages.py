"""Windows for one task on a head or photographs, in which clicks and keys have meanings of their own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from fba.errors import FbaError
from fba_player.scene._hand_editing import HandEditing
from fba_player.scene._photo_scene import PhotoEditing, PhotoScene
from fba_player.scene._placement_scene import PlacementScene
from fba_player.scene._point_placement import PointPlacement
from fba_player.scene.marker_editing import MarkerEditing
from fba_player.scene.markers_scene import MarkersScene

if TYPE_CHECKING:
    from fba_player.session._session import Session

Edited = TypeVar("Edited", bound=HandEditing[Any])

NOTICE_SECONDS = 8.0
"""Seconds for which an error is shown, and what was saved: it may name what is missing."""
COMMON_KEYS = {
    "down": "next", "up": "previous", "enter": "missing", "ctrl+z": "undo", "delete": "remove",
    "backspace": "remove", "ctrl+s": "save",
}  # fmt: skip
"""Keys of the actions that all pages have."""


@dataclass(frozen=True, eq=False)
class Page(Generic[Edited]):
    """A window in which items are placed on a head or on photographs by hand.

    panel: name of the panel that belongs to it. topic: what its notices are about. plays: whether the
    timeline and the buttons of panels are shown. find: returns what a session's window edits, None for other
    windows. click: does what a click at a pixel means. keeps: whether an action of the table of keys keeps
    its key. all_placed: the notice where no item is missing. tell_saved: tells that the file was written.
    actions, keys: the actions of this page and their keys, besides those that all pages have.

    Pages whose items are dragged show a flat picture, which does not turn, and have three functions more.
    grab: takes hold of what is at a pixel, and returns whether there was anything. drag: moves it to a pixel.
    drop: lets go of it.
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
    grab: Callable[[Session, float, float], bool] | None = None
    drag: Callable[[Session, float, float], None] | None = None
    drop: Callable[[Session], None] | None = None

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
            session.say(f"Not saved: {error}", "error", NOTICE_SECONDS, about=self.topic)
        else:
            self.tell_saved(session, edited)


# --- Feature points -----------------------------------------------------------------------------------

POINT_KEYS = (
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
"""Keys of the page for points, for its panel."""


def _click_on_head(session: Session, x: float, y: float) -> None:
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


def _tell_points_saved(session: Session, placement: PointPlacement) -> None:
    missing = placement.missing_units
    rest = f"; no face can be made without {', '.join(missing)}" if missing else ""
    text = f"{len(placement.places)} points saved as {placement.path}{rest}"
    session.say(text, "warning" if missing else "done", NOTICE_SECONDS, about="placing")


PLACING: Page[PointPlacement] = Page(
    panel="points",
    topic="placing",
    plays=False,
    find=lambda session: session.scene.placement if isinstance(session.scene, PlacementScene) else None,
    click=_click_on_head,
    keeps=lambda action: (
        action.split()[0] in ("camera", "reset_view", "screenshot", "fullscreen", "escape", "close")
    ),
    all_placed="All points have a place: Ctrl+S saves them",
    tell_saved=_tell_points_saved,
    actions={"mirror": _mirror, "mirror all": _mirror_all},
    keys={"right": "next", "left": "previous", "space": "missing", "m": "mirror", "ctrl+m": "mirror all"},
)


# --- Markers ------------------------------------------------------------------------------------------

MARKER_KEYS = (
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
"""Keys of the page for markers, for its panel."""


def _click_on_marker_or_head(session: Session, x: float, y: float) -> None:
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
        text = "Click on a marker to choose it, or on the head to put it there"
        session.say(text, "warning", about="marking")
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


def _tell_markers_saved(session: Session, editing: MarkerEditing) -> None:
    session.say(f"{len(editing.mapping.markers)} markers saved as {editing.path}", about="marking")


MARKING: Page[MarkerEditing] = Page(
    panel="markers",
    topic="marking",
    plays=True,
    find=lambda session: session.scene.editing if isinstance(session.scene, MarkersScene) else None,
    click=_click_on_marker_or_head,
    keeps=lambda action: not action.startswith(("panel", "points", "camera body", "follow")),
    all_placed="All markers are on the head: Ctrl+S saves them",
    tell_saved=_tell_markers_saved,
    actions={"fix": _fix, "over": _over, "weights": _weights},
    keys={"x": "fix", "o": "over", "w": "weights"},
)


# --- Photographs --------------------------------------------------------------------------------------

PHOTO_KEYS = (
    ("Drag", "a point: move it; elsewhere: move the picture"),
    ("Wheel", "nearer, further"),
    ("Click", "place the current point here"),
    ("Down, Up", "next point, previous point"),
    ("Space, Enter", "next point without a place"),
    ("Ctrl+Z", "undo"),
    ("Delete", "remove the point"),
    ("Ctrl+S", "save"),
    ("R", "all of the pictures"),
    ("Esc", "close"),
)
"""Keys of the page for photographs, for its panel."""


def _photo_scene(session: Session) -> PhotoScene:
    assert isinstance(session.scene, PhotoScene)
    return session.scene


def _spot(session: Session, x: float, y: float) -> tuple[float, float]:
    """Return what a pixel shows of the current point's photograph."""
    scene = _photo_scene(session)
    return scene.spot_under(session.camera(0.0), x, y, session.size, scene.editing.current)


def _click_on_photo(session: Session, x: float, y: float) -> None:
    editing = _photo_scene(session).editing
    editing.move(_spot(session, x, y))
    PHOTOS.note_unsaved(session, editing)


def _grab_point(session: Session, x: float, y: float) -> bool:
    scene = _photo_scene(session)
    item = scene.item_under(session.camera(0.0), x, y, session.size)
    if item is not None:
        scene.editing.choose(item)
    return item is not None


def _drag_point(session: Session, x: float, y: float) -> None:
    editing = _photo_scene(session).editing
    editing.move(_spot(session, x, y), "drag")
    PHOTOS.note_unsaved(session, editing)


def _drop_point(session: Session) -> None:
    _photo_scene(session).editing.end_gesture()


def _tell_photos_saved(session: Session, editing: PhotoEditing) -> None:
    text = f"{len(editing.state)} points saved as {editing.path}; close the window to make the head"
    session.say(text, "done", NOTICE_SECONDS, about="photos")


PHOTOS: Page[PhotoEditing] = Page(
    panel="photos",
    topic="photos",
    plays=False,
    find=lambda session: session.scene.editing if isinstance(session.scene, PhotoScene) else None,
    click=_click_on_photo,
    keeps=PLACING.keeps,
    all_placed="All points have a place: Ctrl+S saves them",
    tell_saved=_tell_photos_saved,
    actions={},
    keys={"right": "next", "left": "previous", "space": "missing"},
    grab=_grab_point,
    drag=_drag_point,
    drop=_drop_point,
)


PAGES: tuple[Page[Any], ...] = (PLACING, MARKING, PHOTOS)


def page_of(session: Session) -> Page[Any] | None:
    """Return the page that the session's window is; None for a player of performances."""
    return next((page for page in PAGES if page.find(session) is not None), None)
