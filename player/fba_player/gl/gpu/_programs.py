"""Shader programs that deform: some draw a pixel a vertex into a texture, others write vertices into
buffers."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

from fba_player.gl.programs import set_uniform

DRAWING = {"face_moved": "gpu_face", "body_moved": "gpu_body", "past_limbs": "gpu_past"}
"""Programs that draw into a texture, and their fragment shaders."""
WRITING = {
    "face": ("gpu_face", (), ("position", "normal")),
    "carried": ("gpu_face", ("CARRIED",), ("position", "normal")),
    "face_lit": ("gpu_face", ("LIT",), ("position", "normal", "light")),
    "carried_lit": ("gpu_face", ("CARRIED", "LIT"), ("position", "normal", "light")),
    "body": ("gpu_body", (), ("position", "normal")),
    "body_lit": ("gpu_body", ("LIT",), ("position", "normal", "light")),
}
"""Programs that write buffers: vertex shader, names that the preprocessor is to know, what is written."""
UNITS = ("moved", "triangles", "parts", "pose", "rest", "spans", "entries", "shifts", "tracks", "joints",
         "weights", "wring", "past", "capsules", "at", "around", "numbers", "modelled", "visible",
         "wide")  # fmt: skip
"""Places of textures, by the names that shaders have for them."""
FIRST = 4
"""The first of them: those before it are used by what draws between two parts that are written."""


def deforming_program(context: Any, name: str) -> Any:
    """One of `DRAWING` or `WRITING` on a moderngl context."""
    if name in DRAWING:
        fragment = _source(f"{DRAWING[name]}.frag")
        program = context.program(vertex_shader=_source("smooth.vert"), fragment_shader=fragment)
    else:
        shader, words, written = WRITING[name]
        program = context.program(
            vertex_shader=_source(f"{shader}.vert", *words),
            varyings=written,
            varyings_capture_mode="separate",
        )
    for place, unit in enumerate(UNITS, FIRST):
        set_uniform(program, unit, place)
    return program


def use(**textures: Any) -> None:
    """Bind textures, by the names that programs have for them."""
    for name, texture in textures.items():
        texture.use(FIRST + UNITS.index(name))


def _source(name: str, *words: str) -> str:
    folder = files("fba_player.gl") / "shaders"
    lines = []
    for line in (folder / name).read_text(encoding="utf-8").splitlines():
        included = line.startswith("//include ")
        lines.append((folder / line.split()[1]).read_text(encoding="utf-8") if included else line)
        if line.startswith("#version"):
            lines += [f"#define {word}" for word in words]
    return "\n".join(lines)
