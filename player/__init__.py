"""The player: animations in a window, as pictures, and as films.

    player.play(fba.read("talk.fba"))                       # opens a window
    player.render(fba.read("talk.fba"), "talk.mp4")         # needs no display
    with player.Offscreen(fba.read("talk.fba")) as view:
        pixels = view.frame(1.5)                            # uint8 (720, 1280, 4)

Importing this costs next to nothing; OpenGL is loaded where a picture is made.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from player.audio import Audio, open_audio
    from player.camera import Camera, Subject
    from player.compare import CompareScene
    from player.contact_sheet import contact_sheet
    from player.display import check_display
    from player.film_sheet import film_sheet
    from player.live import LiveAnimation, LiveTimeline
    from player.notebook import Preview
    from player.offscreen import Offscreen
    from player.playing import play
    from player.pyrender_bridge import to_pyrender
    from player.recorder import Recorder
    from player.recording import record, render
    from player.renderer import Renderer
    from player.scene import Scene, default_camera
    from player.timeline import Timeline
    from player.transport import Transport

_PLACES = {
    "Audio": "player.audio",
    "Camera": "player.camera",
    "CompareScene": "player.compare",
    "LiveAnimation": "player.live",
    "LiveTimeline": "player.live",
    "Offscreen": "player.offscreen",
    "Preview": "player.notebook",
    "Recorder": "player.recorder",
    "Renderer": "player.renderer",
    "Scene": "player.scene",
    "Subject": "player.camera",
    "Timeline": "player.timeline",
    "Transport": "player.transport",
    "check_display": "player.display",
    "contact_sheet": "player.contact_sheet",
    "default_camera": "player.scene",
    "film_sheet": "player.film_sheet",
    "open_audio": "player.audio",
    "play": "player.playing",
    "record": "player.recording",
    "render": "player.recording",
    "to_pyrender": "player.pyrender_bridge",
}

__all__ = [
    "Audio",
    "Camera",
    "CompareScene",
    "LiveAnimation",
    "LiveTimeline",
    "Offscreen",
    "Preview",
    "Recorder",
    "Renderer",
    "Scene",
    "Subject",
    "Timeline",
    "Transport",
    "check_display",
    "contact_sheet",
    "default_camera",
    "film_sheet",
    "open_audio",
    "play",
    "record",
    "render",
    "to_pyrender",
]


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'player' has no attribute {name!r}")
    value = getattr(import_module(_PLACES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
