"""A context of OpenGL for tests that draw with parts of the renderer."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

import graphics
from fba_player.gl._context import offscreen_context


@pytest.fixture(scope="module")
def context() -> Iterator[Any]:
    if (reason := graphics.missing_opengl()) is not None:
        graphics.skip(reason)
    made = offscreen_context()
    with made:
        yield made
    made.release()
