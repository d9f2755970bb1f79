"""Loads shader programs from `shaders/` and sets their uniforms."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

import numpy as np

from fba.arrays import Array


def load_program(context: Any, name: str, *defined: str) -> Any:
    """The program of shaders/NAME.vert and NAME.frag on a moderngl context. defined: names to
    define for the preprocessor."""
    folder = files(__package__) / "shaders"
    lighting = (folder / "lighting.glsl").read_text(encoding="utf-8")
    sources = {
        stage: (folder / f"{name}.{suffix}")
        .read_text(encoding="utf-8")
        .replace("//include lighting.glsl", "".join(f"#define {word}\n" for word in defined) + lighting)
        for stage, suffix in (("vertex_shader", "vert"), ("fragment_shader", "frag"))
    }
    return context.program(**sources)


def set_uniform(program: Any, name: str, value: Any) -> None:
    """Set a uniform of a program; bytes are written as they are, unknown names are ignored.

    Setting the same value again costs nothing.
    """
    if program.extra is None:
        program.extra = {}
    if program.extra.get(name) == value:
        return
    program.extra[name] = value
    member = program.get(name, None)
    if member is None:
        return
    if isinstance(value, bytes):
        member.write(value)
    else:
        member.value = value


def matrix_bytes(matrix: Array) -> bytes:
    """A matrix as OpenGL stores it: float32, column by column."""
    return np.ascontiguousarray(matrix.T, dtype="f4").tobytes()
