"""Windows for one task: feature points on a head or on photographs, captured markers on a head."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Literal

from fba.atomic import PathLike
from fba.errors import DisplayError
from fba.face.fitting import Photograph
from fba.face.importers.head_surface import HeadSurface
from fba_player.gl._context import cure
from fba_player.scene._photo_scene import PhotoEditing, PhotoScene, Spot
from fba_player.scene._placement_scene import PlacementScene
from fba_player.scene._point_placement import PointPlacement
from fba_player.scene.marker_editing import MarkerEditing
from fba_player.scene.markers_scene import MarkersScene
from fba_player.window._display import check_display
from fba_player.window._window import Window

Subject = Literal["points", "markers", "photos"]

SIZE = (1280, 800)
"""Width and height of a window, by default."""
NOTICE_SECONDS = 8.0
"""Seconds for which the first notice is shown."""
INSTEAD: dict[Subject, str] = {
    "points": (
        "Without a window, write the file by hand: lines 'name,vertex' (vertices of the mesh, counted from "
        "0) or 'name,x,y,z' (in its unit), for instance '9.3,297' for the tip of the nose"
    ),
    "markers": (
        "Without a window, `fba markers CAPTURE -o FILE.toml` writes the proposed mapping, to be changed in "
        "an editor; -o FILE.png draws what it does"
    ),
    "photos": (
        'Without a window, write the file by hand: {"front": {"points": {"3.5": [x, y], ...}}}, in pixels '
        "from the top left of the picture, and run `fba model photos FRONT --points FILE`"
    ),
}
"""What to do where no window can be opened."""


def check_page(subject: Subject) -> None:
    """Raise DisplayError, which ends with what to do instead, if the page for a subject cannot be shown."""
    try:
        import_module("imgui_bundle")  # pages are made with it
    except ImportError as error:
        raise DisplayError(
            f"the page for {subject} needs imgui: {error}. {cure(error, 'mpeg4-fba[player]')}. "
            f"{INSTEAD[subject]}"
        ) from error
    check_display(INSTEAD[subject])


def place_points(surface: HeadSurface, path: PathLike, *, size: tuple[int, int] = SIZE) -> PointPlacement:
    """Show a head in a window until it is closed; the user places its points and saves them as `path`.

    Returns the points; `written` says whether they were saved. Raises DisplayError without a display, OpenGL
    or imgui.
    """
    placement = PointPlacement(surface, Path(path))
    with open_placement(placement, size=size) as window:
        window.run()
    return placement


def open_placement(placement: PointPlacement, *, size: tuple[int, int] = SIZE) -> Window:
    """Return the window for placing points, opened but not yet shown: `run` shows it until it is closed."""
    scene = PlacementScene(placement)
    window = Window(scene, title=f"{scene.title}: feature points", size=size)
    window.session.open.add("points")
    placed = len(placement.names) - len(placement.missing)
    if placed:
        text = f"{placed} of {len(placement.names)} points {placement.surface.origin}: check them, too"
        window.session.say(text, seconds=NOTICE_SECONDS)
    return window


def map_markers(editing: MarkerEditing, title: str, *, size: tuple[int, int] = SIZE) -> None:
    """Show a capture and a head in a window until it is closed; the user maps markers and saves them.

    Raises DisplayError without a display, OpenGL or imgui.
    """
    with open_markers(editing, title, size=size) as window:
        window.run()


def open_markers(editing: MarkerEditing, title: str, *, size: tuple[int, int] = SIZE) -> Window:
    """Return the window for mapping markers, opened but not yet shown: `run` shows it until it is closed."""
    window = Window(MarkersScene(editing, title), title=f"{title}: markers", size=size)
    window.session.open.add("markers")
    names = editing.motion.names
    count = sum(name in editing.placed for name in names)
    text = f"{count} of {len(names)} markers are on the head: check them"
    window.session.say(text, seconds=NOTICE_SECONDS)
    return window


def place_photo_points(
    photographs: Sequence[Photograph],
    places: Mapping[str, Mapping[str, Spot]],
    path: PathLike,
    *,
    size: tuple[int, int] = SIZE,
) -> PhotoEditing:
    """Show photographs in a window until it is closed; the user drags points and saves them as `path`.

    places: the first positions by view, "front" and "side", and name of the point. Returns the points;
    `written` says whether they were saved. Raises DisplayError without a display, OpenGL or imgui.
    """
    editing = PhotoEditing(photographs, places, Path(path))
    with open_photos(editing, size=size) as window:
        window.run()
    return editing


def open_photos(editing: PhotoEditing, *, size: tuple[int, int] = SIZE) -> Window:
    """Return the window for points on photographs, opened but not yet shown: `run` shows it."""
    scene = PhotoScene(editing)
    window = Window(scene, title=f"{scene.title}: points", size=size)
    window.session.open.add("photos")
    window.session.say("Drag the points to where they belong; Ctrl+S saves them", seconds=NOTICE_SECONDS)
    return window
