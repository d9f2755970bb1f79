"""What is said where the system libraries of OpenGL are missing."""

from __future__ import annotations

import ctypes
import sys
from typing import Any

import pytest

import graphics
from fba.animation import Animation
from fba.errors import DisplayError
from fba.player import Offscreen
from fba_player.gl._context import PACKAGES, cure, missing_libraries


def take_away(monkeypatch: pytest.MonkeyPatch, *names: str) -> None:
    """These libraries cannot be loaded; all others can."""

    def load(name: str, *_: Any) -> None:
        if name in names:
            raise OSError(f"{name}: cannot open shared object file: No such file or directory")

    monkeypatch.setattr(ctypes, "CDLL", load)
    monkeypatch.setattr(sys, "platform", "linux")


def test_those_that_cannot_be_loaded_are_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    take_away(monkeypatch, "libGL.so.1")
    assert missing_libraries() == ["libGL.so.1"]
    assert missing_libraries(PACKAGES) == ["libGL.so.1"]
    monkeypatch.setattr(sys, "platform", "darwin")  # it has OpenGL of its own
    assert missing_libraries() == []


def test_a_picture_without_opengl_names_libraries_and_packages(
    talking: Animation, monkeypatch: pytest.MonkeyPatch
) -> None:
    moderngl = graphics.imported("moderngl")

    def refuse(**_: Any) -> None:
        raise ImportError("(detect) libGL.so: cannot open shared object file: No such file or directory")

    monkeypatch.setattr(moderngl, "create_context", refuse)
    take_away(monkeypatch, "libGL.so.1", "libEGL.so.1")
    with pytest.raises(DisplayError) as told:
        Offscreen(talking, (16, 12))
    assert str(told.value) == (
        "pictures need OpenGL, but the system libraries libEGL.so.1 and libGL.so.1 cannot be loaded. "
        "Install with: sudo apt-get install libegl1 libgl1 (Debian, Ubuntu), "
        "or: sudo dnf install mesa-libEGL mesa-libGL mesa-dri-drivers (Fedora)"
    )


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (
            "libX11.so.6: cannot open shared object file: No such file or directory",
            "apt-get install libx11-6 (",
        ),
        (
            "libice.so.9: cannot open shared object file: No such file or directory",
            "system library libice.so.9",
        ),
        ("No module named 'imgui_bundle'", 'pip install "mpeg4-fba[player]"'),
    ],
)
def test_a_package_is_blamed_only_where_it_is_to_blame(error: str, said: str) -> None:
    assert said in cure(ImportError(error), "mpeg4-fba[player]")
