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
from typing import TYPE_CHECKING, Any

import fba_player
from fba_player import __all__

if TYPE_CHECKING:
    from fba_player import *  # noqa: F403 - those of its `__all__`


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'fba.player' has no attribute {name!r}")
    globals()[name] = value = getattr(fba_player, name)
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
