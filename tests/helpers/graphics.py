"""What tests of pictures and windows need of the machine: OpenGL, imgui, a virtual display.

Where something is missing they are skipped, and the end of the run says how many, and why. With the
environment variable FBA_REQUIRE_GRAPHICS set, as in continuous integration, they fail instead.
"""

import os
from functools import cache
from importlib import import_module
from typing import Any, NoReturn

import pytest

from fba.errors import DisplayError
from fba_player.gl._context import offscreen_context

REQUIRED = "FBA_REQUIRE_GRAPHICS"
MARK = "graphics: "
"""Reasons of such skips begin with it."""


def skip(reason: object) -> NoReturn:
    """Skip the test, or at import the whole module; fail where graphics are required."""
    if os.environ.get(REQUIRED):
        pytest.fail(f"{MARK}{reason} ({REQUIRED} is set)", pytrace=False)
    pytest.skip(f"{MARK}{reason}", allow_module_level=True)


def imported(name: str) -> Any:
    """A module that the player needs; skips where it, or a system library below it, is missing."""
    try:
        return import_module(name)
    except ImportError as error:
        skip(f"{name} cannot be imported: {error}")


@cache
def missing_opengl() -> str | None:
    """Why no picture can be drawn without a display; None where it can."""
    try:
        context = offscreen_context()
    except DisplayError as error:
        return str(error)
    with context:
        pass  # leaves no context current, which a window's would collide with
    context.release()
    return None
