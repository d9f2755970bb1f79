"""The player: animations in a window, as pictures and films. Users import its names from `fba.player`."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fba_player.export._offscreen import Offscreen
    from fba_player.export._pyrender_bridge import to_pyrender
    from fba_player.export._recorder import Recorder
    from fba_player.export.contact_sheet import contact_sheet
    from fba_player.export.film_sheet import film_sheet
    from fba_player.export.notebook import Preview
    from fba_player.export.render import record, render
    from fba_player.export.side_by_side import draw_side_by_side
    from fba_player.gl._renderer import Renderer
    from fba_player.playback._timeline import Timeline
    from fba_player.playback._transport import Transport
    from fba_player.playback.live import LiveAnimation, LiveTimeline
    from fba_player.scene.compare import CompareScene
    from fba_player.scene.scene import Scene, default_camera
    from fba_player.session._puppet import Expression, Puppet
    from fba_player.session._takes import TakeRecorder
    from fba_player.sound._player import Audio, open_audio
    from fba_player.view._camera import Camera, Subject
    from fba_player.window._display import check_display
    from fba_player.window._play import play
    from fba_player.window.surface import Surface

_NAMES = {
    "export.contact_sheet": ("contact_sheet",),
    "export.film_sheet": ("film_sheet",),
    "export.notebook": ("Preview",),
    "export._offscreen": ("Offscreen",),
    "export._pyrender_bridge": ("to_pyrender",),
    "export._recorder": ("Recorder",),
    "export.render": ("record", "render"),
    "export.side_by_side": ("draw_side_by_side",),
    "gl._renderer": ("Renderer",),
    "playback.live": ("LiveAnimation", "LiveTimeline"),
    "playback._timeline": ("Timeline",),
    "playback._transport": ("Transport",),
    "scene.compare": ("CompareScene",),
    "scene.scene": ("Scene", "default_camera"),
    "session._puppet": ("Expression", "Puppet"),
    "session._takes": ("TakeRecorder",),
    "sound._player": ("Audio", "open_audio"),
    "view._camera": ("Camera", "Subject"),
    "window._display": ("check_display",),
    "window._play": ("play",),
    "window.surface": ("Surface",),
}
"""Public names by the module that they are imported from, on first use."""

__all__ = [
    "Audio", "Camera", "CompareScene", "Expression", "LiveAnimation", "LiveTimeline", "Offscreen",
    "Preview", "Puppet", "Recorder", "Renderer", "Scene", "Subject", "Surface", "TakeRecorder", "Timeline",
    "Transport", "check_display", "contact_sheet", "default_camera", "draw_side_by_side", "film_sheet",
    "open_audio", "play", "record", "render", "to_pyrender",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    module = next((module for module, names in _NAMES.items() if name in names), None)
    if module is None:
        raise AttributeError(f"module 'fba_player' has no attribute {name!r}")
    globals()[name] = value = getattr(import_module(f"fba_player.{module}"), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
