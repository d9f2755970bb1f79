"""A renderer of Dear ImGui with moderngl, OpenGL 3.3, for whatever framebuffer is bound.

It follows the protocol of Dear ImGui 1.92 for dynamic textures: before drawing, it creates, updates and
destroys textures as the library asks.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from imgui_bundle import imgui

from fba.arrays import Array, UInt8
from fba_player.gl._resources import load_program

VERTEX_BYTES = 20
"""Size of a Dear ImGui vertex: position and texture coordinates, two float32 each, and four bytes."""
INDEX = np.dtype(np.uint32)
BYTE = np.dtype(np.uint8)


class ImguiRenderer:
    """Draws the lists of the current imgui context on a moderngl context; `close` releases its resources.

    Raises RuntimeError if imgui was built with another layout of vertices or indices.
    """

    def __init__(self, context: Any) -> None:
        if (VERTEX_BYTES, INDEX.itemsize) != (imgui.VERTEX_SIZE, imgui.INDEX_SIZE):
            raise RuntimeError(
                f"this build of imgui has vertices of {imgui.VERTEX_SIZE} bytes and indices of "
                f"{imgui.INDEX_SIZE}; expected {VERTEX_BYTES} and {INDEX.itemsize}: install another "
                "version of imgui-bundle"
            )
        self._gl = context
        self._program = load_program(context, "panels")
        self._textures: dict[int, Any] = {}
        self._named_textures: dict[str, int] = {}
        self._vertices: Any = None
        self._indices: Any = None
        self._array: Any = None
        self._reserve(1 << 16, 1 << 16)
        io = imgui.get_io()
        io.backend_flags |= imgui.BackendFlags_.renderer_has_textures
        largest = int(context.info["GL_MAX_TEXTURE_SIZE"])
        platform = imgui.get_platform_io()
        platform.renderer_texture_max_width = platform.renderer_texture_max_height = largest

    def draw(self, data: imgui.ImDrawData) -> None:
        """Draw into the bound framebuffer; sets the viewport to all of it."""
        for texture in data.textures:
            if texture.status != imgui.ImTextureStatus.ok:
                self._update(texture)
        scale_x, scale_y = data.framebuffer_scale
        wide, high = round(data.display_size.x * scale_x), round(data.display_size.y * scale_y)
        if wide < 1 or high < 1 or not data.total_idx_count:
            return
        commands = self._upload(data)
        gl = self._gl
        gl.viewport = (0, 0, wide, high)
        gl.enable_only(gl.BLEND)
        gl.blend_func = (gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA)
        self._program["size"].value = (data.display_size.x, data.display_size.y)
        bound = 0
        for clip, number, first, count in commands:
            left, top = max(int(clip[0] * scale_x), 0), max(int(clip[1] * scale_y), 0)
            right, bottom = min(round(clip[2] * scale_x), wide), min(round(clip[3] * scale_y), high)
            if right <= left or bottom <= top or number not in self._textures:
                continue
            if number != bound:
                self._textures[number].use(0)
                bound = number
            gl.scissor = (left, high - bottom, right - left, bottom - top)
            self._array.render(gl.TRIANGLES, vertices=count, first=first)
        gl.scissor = None
        gl.blend_func = gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA

    def set_picture(self, name: str, pixels: UInt8) -> imgui.ImTextureRef:
        """Upload a picture, uint8 (H, W, 4), for imgui to draw; it replaces the last of this name."""
        height, width = pixels.shape[:2]
        made = self._make_texture((width, height), np.ascontiguousarray(pixels).tobytes())
        if name in self._named_textures:
            self._textures.pop(self._named_textures[name]).release()
        self._named_textures[name] = made.glo
        return imgui.ImTextureRef(made.glo)

    def close(self) -> None:
        """Release its resources, and tell imgui that its textures are gone."""
        for texture in imgui.get_platform_io().textures:
            if texture.tex_id in self._textures:
                texture.set_tex_id(0)
                texture.set_status(imgui.ImTextureStatus.destroyed)
        for part in (*self._textures.values(), self._array, self._vertices, self._indices, self._program):
            part.release()
        self._textures.clear()

    def _upload(self, data: imgui.ImDrawData) -> list[tuple[tuple[float, ...], int, int, int]]:
        """Upload all lists to one pair of buffers; return (clip, texture, first index, count) to draw.

        Neighbours with the same texture and clip rectangle are merged: a call costs more than its triangles.
        """
        vertices, indices = data.total_vtx_count, data.total_idx_count
        self._reserve(vertices * VERTEX_BYTES, indices * INDEX.itemsize)
        commands: list[tuple[tuple[float, ...], int, int, int]] = []
        base = before = 0
        corner_x, corner_y = data.display_pos
        for drawn in data.cmd_lists:
            count, length = drawn.vtx_buffer.size(), drawn.idx_buffer.size()
            if not length:
                continue
            part = slice(base * VERTEX_BYTES, (base + count) * VERTEX_BYTES)
            self._vertex_memory[part] = _view(drawn.vtx_buffer, count * VERTEX_BYTES, BYTE)
            into = self._index_memory[before : before + length]
            np.add(_view(drawn.idx_buffer, length, INDEX), np.uint32(base), out=into)
            for command in drawn.cmd_buffer:
                count_here = command.elem_count
                if not count_here:
                    continue
                x0, y0, x1, y1 = command.clip_rect
                clip = (x0 - corner_x, y0 - corner_y, x1 - corner_x, y1 - corner_y)
                first, number = before + command.idx_offset, command.get_tex_id()
                if commands and commands[-1][:2] == (clip, number) and sum(commands[-1][2:]) == first:
                    commands[-1] = (clip, number, commands[-1][2], commands[-1][3] + count_here)
                else:
                    commands.append((clip, number, first, count_here))
            base += count
            before += length
        self._vertices.orphan()
        self._vertices.write(self._vertex_memory[: base * VERTEX_BYTES])
        self._indices.orphan()
        self._indices.write(self._index_memory[:before])
        return commands

    def _reserve(self, vertex_bytes: int, index_bytes: int) -> None:
        if self._array is not None:
            if self._vertices.size >= vertex_bytes and self._indices.size >= index_bytes:
                return
            for part in (self._array, self._vertices, self._indices):
                part.release()
        gl = self._gl
        self._vertices = gl.buffer(reserve=max(2 * vertex_bytes, 1 << 16), dynamic=True)
        self._indices = gl.buffer(reserve=max(2 * index_bytes, 1 << 16), dynamic=True)
        self._vertex_memory = np.zeros(self._vertices.size, BYTE)
        self._index_memory = np.zeros(self._indices.size // INDEX.itemsize, INDEX)
        self._array = gl.vertex_array(
            self._program,
            [(self._vertices, "2f 2f 4f1", "in_place", "in_texture", "in_colour")],
            index_buffer=self._indices,
            index_element_size=INDEX.itemsize,
        )

    def _make_texture(self, size: tuple[int, int], data: bytes) -> Any:
        made = self._gl.texture(size, 4, data)
        made.filter = (self._gl.LINEAR, self._gl.LINEAR)
        made.repeat_x = made.repeat_y = False
        self._textures[made.glo] = made
        return made

    def _update(self, texture: imgui.ImTextureData) -> None:
        status = imgui.ImTextureStatus
        if texture.status == status.want_create:
            made = self._make_texture((texture.width, texture.height), texture.get_pixels_array().tobytes())
            texture.set_tex_id(made.glo)
            texture.set_status(status.ok)
        elif texture.status == status.want_updates:
            pixels = texture.get_pixels_array().reshape(texture.height, texture.width, 4)
            for part in texture.updates:
                block = np.ascontiguousarray(pixels[part.y : part.y + part.h, part.x : part.x + part.w])
                self._textures[texture.tex_id].write(block, viewport=(part.x, part.y, part.w, part.h))
            texture.set_status(status.ok)
        elif texture.status == status.want_destroy and texture.unused_frames > 0:
            self._textures.pop(texture.tex_id).release()
            texture.set_tex_id(0)
            texture.set_status(status.destroyed)


def _view(vector: Any, count: int, dtype: np.dtype[Any]) -> Array:
    """Return the memory of an imgui vector as an array, without a copy; valid until the next frame."""
    memory = (ctypes.c_char * (count * dtype.itemsize)).from_address(vector.data_address())
    return np.frombuffer(memoryview(memory).cast("B"), dtype)
