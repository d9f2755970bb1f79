"""`place_points`: a window in which the feature points of a head are placed by hand."""

from __future__ import annotations

from pathlib import Path

from fba.atomic import PathLike
from fba.face.importers.head_surface import HeadSurface
from fba_player.scene._placement_scene import PlacementScene
from fba_player.scene._point_placement import PointPlacement
from fba_player.window._window import Window
from fba_player.window.display import check_page

NOTICE_SECONDS = 8.0
"""Seconds for which the first notice is shown."""
BY_HAND = (
    "Without a window, write the file by hand: lines 'name,vertex' (vertices of the mesh, counted from 0) "
    "or 'name,x,y,z' (in its unit), for instance '9.3,297' for the tip of the nose"
)
"""What to do where no window can be opened."""


def check_window() -> None:
    """Raise DisplayError, which says how to write the points by hand, if the page cannot be shown."""
    check_page("points", BY_HAND)


def place_points(
    surface: HeadSurface, path: PathLike, *, size: tuple[int, int] = (1280, 800)
) -> PointPlacement:
    """Show a head in a window until it is closed; the user places its points and saves them as `path`.

    Returns the points; `written` says whether they were saved. Raises DisplayError without a display, OpenGL
    or imgui.
    """
    placement = PointPlacement(surface, Path(path))
    with open_placement(placement, size=size) as window:
        window.run()
    return placement


def open_placement(placement: PointPlacement, *, size: tuple[int, int] = (1280, 800)) -> Window:
    """Return the window for placing points, opened but not yet shown: `run` shows it until it is closed."""
    scene = PlacementScene(placement)
    window = Window(scene, title=f"{scene.title}: feature points", size=size)
    window.session.open.add("points")
    known = len(placement.names) - len(placement.missing)
    if known:
        text = f"{known} of {len(placement.names)} points {placement.surface.origin}: check them, too"
        window.session.say(text, seconds=NOTICE_SECONDS)
    return window
