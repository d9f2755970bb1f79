"""Shader programs and their uniforms, buffers, textures, and a cache of such OpenGL objects."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from importlib.resources import files
from typing import Any, Generic, TypeVar

import numpy as np
import numpy.typing as npt

from fba.arrays import Array, UInt8

Value = TypeVar("Value")


def load_program(context: Any, name: str, *defined: str) -> Any:
    """Return the program of shaders/NAME.vert and NAME.frag. defined: names for the preprocessor."""
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


def set_uniforms(program: Any, **values: Any) -> None:
    """Set uniforms of a program by name, as `set_uniform` does."""
    for name, value in values.items():
        set_uniform(program, name, value)


def matrix_bytes(matrix: Array) -> bytes:
    """Return a matrix as OpenGL stores it: float32, column by column."""
    return np.ascontiguousarray(matrix.T, dtype="f4").tobytes()


def make_buffer(context: Any, array: npt.ArrayLike, kind: str = "f4") -> Any:
    """Return a buffer with the content of an array, as float32 or another `kind`."""
    return context.buffer(np.ascontiguousarray(array, dtype=kind).tobytes())


def write_buffer(buffer: Any, array: Array) -> None:
    """Write an array as float32 into a buffer, orphaned first, so that nothing waits for draws."""
    buffer.orphan()
    buffer.write(np.ascontiguousarray(array, dtype="f4"))


def make_texture(context: Any, pixels: UInt8, *, smooth: bool = True) -> Any:
    """Return a texture of pixels, uint8 (H, W, components). smooth: whether to interpolate between them."""
    height, width, components = pixels.shape
    texture = context.texture((width, height), components, np.ascontiguousarray(pixels).tobytes())
    texture.filter = (context.LINEAR,) * 2 if smooth else (context.NEAREST,) * 2
    return texture


class RecentlyUsed(Generic[Value]):
    """Cache of the most recently used values. most: how many it holds. release: frees a dropped value."""

    def __init__(self, most: int, release: Callable[[Value], object]) -> None:
        self._most = most
        self._release = release
        self._values: dict[Hashable, Value] = {}

    def get(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return the value of a key, made if it is not in the cache."""
        value = self._values.pop(key) if key in self._values else make()
        self._values[key] = value  # the least recently used stands first
        while len(self._values) > self._most:
            self._release(self._values.pop(next(iter(self._values))))
        return value

    def clear(self) -> None:
        for value in self._values.values():
            self._release(value)
        self._values.clear()
