"""The player: shows animations in a window, and renders them as pictures and films.

    from fba.player import Offscreen, play, render
    play(fba.read("talk.fba"))                       # opens a window
    render(fba.read("talk.fba"), "talk.mp4")         # needs no display
    with Offscreen(fba.read("talk.fba")) as view:
        pixels = view.frame(1.5)                     # uint8 (720, 1280, 4)

These are the public names of the package `fba_player`. Each is imported when it is first used, and OpenGL
when a picture is made. Once this module is imported in a notebook, a cell that ends in an `Animation` shows a
film.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fba_player.export.contact_sheet import contact_sheet
    from fba_player.export.film_sheet import film_sheet
    from fba_player.export.notebook import Preview
    from fba_player.export.offscreen import Offscreen
    from fba_player.export.pyrender_bridge import to_pyrender
    from fba_player.export.recorder import Recorder
    from fba_player.export.render import record, render
    from fba_player.export.side_by_side import draw_side_by_side
    from fba_player.gl.renderer import Renderer
    from fba_player.playback.live import LiveAnimation, LiveTimeline
    from fba_player.playback.timeline import Timeline
    from fba_player.playback.transport import Transport
    from fba_player.scene.compare import CompareScene
    from fba_player.scene.scene import Scene, default_camera
    from fba_player.session.puppet import Expression, Puppet
    from fba_player.session.takes import TakeRecorder
    from fba_player.sound.player import Audio, open_audio
    from fba_player.view.camera import Camera, Subject
    from fba_player.window.display import check_display
    from fba_player.window.play import play

_MODULE_OF = {
    "Expression": "fba_player.session.puppet",
    "Puppet": "fba_player.session.puppet",
    "TakeRecorder": "fba_player.session.takes",
    "Audio": "fba_player.sound.player",
    "Camera": "fba_player.view.camera",
    "CompareScene": "fba_player.scene.compare",
    "LiveAnimation": "fba_player.playback.live",
    "LiveTimeline": "fba_player.playback.live",
    "Offscreen": "fba_player.export.offscreen",
    "Preview": "fba_player.export.notebook",
    "Recorder": "fba_player.export.recorder",
    "Renderer": "fba_player.gl.renderer",
    "Scene": "fba_player.scene.scene",
    "Subject": "fba_player.view.camera",
    "Timeline": "fba_player.playback.timeline",
    "Transport": "fba_player.playback.transport",
    "check_display": "fba_player.window.display",
    "contact_sheet": "fba_player.export.contact_sheet",
    "default_camera": "fba_player.scene.scene",
    "draw_side_by_side": "fba_player.export.side_by_side",
    "film_sheet": "fba_player.export.film_sheet",
    "open_audio": "fba_player.sound.player",
    "play": "fba_player.window.play",
    "record": "fba_player.export.render",
    "render": "fba_player.export.render",
    "to_pyrender": "fba_player.export.pyrender_bridge",
}

__all__ = [
    "Audio",
    "Camera",
    "CompareScene",
    "Expression",
    "LiveAnimation",
    "LiveTimeline",
    "Offscreen",
    "Preview",
    "Puppet",
    "Recorder",
    "Renderer",
    "Scene",
    "Subject",
    "TakeRecorder",
    "Timeline",
    "Transport",
    "check_display",
    "contact_sheet",
    "default_camera",
    "draw_side_by_side",
    "film_sheet",
    "open_audio",
    "play",
    "record",
    "render",
    "to_pyrender",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'fba.player' has no attribute {name!r}")
    value = getattr(import_module(_MODULE_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def _show_in_notebook() -> None:
    """Make a notebook show animations as films; does nothing elsewhere."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    if shell is not None:
        from fba_player.export.notebook import show_animations

        show_animations(shell)


_show_in_notebook()
