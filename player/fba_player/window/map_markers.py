"""`map_markers`: a window in which captured markers are mapped onto a head, and play on it."""

from __future__ import annotations

from fba.errors import DisplayError
from fba_player.gl.context import cure
from fba_player.scene.marker_editing import MarkerEditing
from fba_player.scene.markers_scene import MarkersScene
from fba_player.window._window import Window
from fba_player.window.display import check_display

SECONDS = 8.0
"""For which the window says what was found."""
WITHOUT = (
    "Without a window, `fba markers CAPTURE -o FILE.toml` writes the proposed mapping, to be changed in an "
    "editor; -o FILE.png draws what it does"
)
"""What to do where no window can be opened."""


def check_window() -> None:
    """Raise DisplayError, which says how to do without, if the page cannot be shown."""
    try:
        import imgui_bundle  # noqa: F401 - the page is made with it
    except ImportError as error:
        raise DisplayError(
            f"the page for markers needs imgui: {error}. {cure(error, 'mpeg4-fba[player]')}. {WITHOUT}"
        ) from error
    check_display(WITHOUT)


def map_markers(editing: MarkerEditing, title: str, *, size: tuple[int, int] = (1280, 800)) -> None:
    """Show a capture and a head in a window until it is closed; the user maps markers and saves them.

    Raises DisplayError without a display, OpenGL or imgui.
    """
    with open_markers(editing, title, size=size) as window:
        window.run()


def open_markers(editing: MarkerEditing, title: str, *, size: tuple[int, int] = (1280, 800)) -> Window:
    """The window for mapping markers, opened but not yet shown: `run` shows it until it is closed."""
    window = Window(MarkersScene(editing, title), title=f"{title}: markers", size=size)
    window.session.open.add("markers")
    names = editing.motion.names
    window.session.say(
        f"{sum(name in editing.mapping.markers for name in names)} of {len(names)} markers are on the head: "
        "check them",
        seconds=SECONDS,
    )
    return window
