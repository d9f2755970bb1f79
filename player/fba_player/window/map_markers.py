"""`map_markers`: a window in which captured markers are mapped onto a head, and play on it."""

from __future__ import annotations

from fba_player.scene.marker_editing import MarkerEditing
from fba_player.scene.markers_scene import MarkersScene
from fba_player.window._window import Window
from fba_player.window.display import check_page

NOTICE_SECONDS = 8.0
"""Seconds for which the first notice is shown."""
WITHOUT = (
    "Without a window, `fba markers CAPTURE -o FILE.toml` writes the proposed mapping, to be changed in an "
    "editor; -o FILE.png draws what it does"
)
"""What to do where no window can be opened."""


def check_window() -> None:
    """Raise DisplayError, which says how to do without, if the page cannot be shown."""
    check_page("markers", WITHOUT)


def map_markers(editing: MarkerEditing, title: str, *, size: tuple[int, int] = (1280, 800)) -> None:
    """Show a capture and a head in a window until it is closed; the user maps markers and saves them.

    Raises DisplayError without a display, OpenGL or imgui.
    """
    with open_markers(editing, title, size=size) as window:
        window.run()


def open_markers(editing: MarkerEditing, title: str, *, size: tuple[int, int] = (1280, 800)) -> Window:
    """Return the window for mapping markers, opened but not yet shown: `run` shows it until it is closed."""
    window = Window(MarkersScene(editing, title), title=f"{title}: markers", size=size)
    window.session.open.add("markers")
    names = editing.motion.names
    count = sum(name in editing.placed for name in names)
    text = f"{count} of {len(names)} markers are on the head: check them"
    window.session.say(text, seconds=NOTICE_SECONDS)
    return window
