"""Windows on a virtual display, for tests."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import graphics
from fba.animation import Animation
from fba.errors import DisplayError
from fba_player.scene.scene import Scene
from fba_player.window._window import Window


def opened(animation: Animation, folder: Path, *, panels: bool, size: tuple[int, int] = (640, 480)) -> Window:
    if panels:
        graphics.imported("imgui_bundle")
    return or_skip(lambda: Window(Scene(animation), size=size, panels=panels, folder=folder))


def or_skip(open_it: Callable[[], Window]) -> Window:
    """A window; skips where the virtual display has none."""
    try:
        return open_it()
    except DisplayError as error:
        graphics.skip(f"no window on the virtual display: {error}")


def press(window: Window, key: int, modifiers: int = 0) -> None:
    """Press a key as glfw tells it."""
    window.input.on_key(window._window, key, 0, 1, modifiers)


def settle(window: Window) -> None:
    """Draw what is due, until the view has come to rest."""
    glided = False
    while window._pictures_due or window.session.viewpoint.gliding or glided:
        glided = window.session.viewpoint.gliding
        if not window.update():
            break


def until(window: Window, reached: Callable[[], bool], seconds: float = 30.0) -> None:
    """Draw until something holds."""
    begun = time.monotonic()
    while not reached():
        assert time.monotonic() - begun < seconds
        assert window.update()


def shown(window: Window) -> np.ndarray:
    width, height = window.session.size
    pixels = np.frombuffer(window._gl.screen.read((0, 0, width, height), components=3, alignment=1), np.uint8)
    return pixels.reshape(height, width, 3)[::-1].astype(int)
