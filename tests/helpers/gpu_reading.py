"""Vertices as the graphics card makes them, read back from its buffers."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import numpy.typing as npt

from fba_player.figure.body_light import LitPart
from fba_player.figure.face_light import LitFacePart
from fba_player.gl.context import offscreen_context
from fba_player.gl.gpu._deformer import GpuDeformer
from fba_player.mesh.lazy_vertices import Places, Whole
from fba_player.view.view import FaceMesh

Float32 = npt.NDArray[np.float32]


class Reader:
    """Reads what a `GpuDeformer` writes."""

    def __init__(self, context: object) -> None:
        self._gl = context
        self._bound = context.simple_framebuffer((4, 4))  # type: ignore[attr-defined]
        self.deformer = GpuDeformer(context)

    def lit(self, meshes: list[FaceMesh]) -> list[Float32]:
        """Light (V, 4) on parts of faces and bodies."""
        gl, found = self._gl, []
        wholes = {id(mesh.places.whole): mesh.places.whole for mesh in meshes}
        limbs = {
            id(mesh.places.whole): mesh.reaching.body.capsules
            for mesh in meshes
            if isinstance(mesh.reaching, LitPart)
        }
        self.deformer.prepare(list(wholes.values()), limbs)
        self._bound.use()
        for mesh in meshes:
            count = len(mesh.places)
            light = mesh.reaching if isinstance(mesh.reaching, LitFacePart) else None
            assert light is not None or self.deformer.is_lit(mesh.places.whole)
            rows = self.deformer.rows(mesh.places, lit=True)
            buffers = [gl.buffer(reserve=size * count) for size in (12, 12, 16)]  # type: ignore[attr-defined]
            self.deformer.write(mesh.places, rows, buffers, light)
            found.append(np.frombuffer(buffers[2].read(), np.float32).reshape(-1, 4))
            for part in (*rows, *buffers):
                part.release()
        assert gl.error == "GL_NO_ERROR"  # type: ignore[attr-defined]
        return found

    def __call__(self, places: list[Places]) -> list[tuple[Float32, Float32]]:
        """Positions and normals (V, 3) of all of these; they are in one picture."""
        gl, found = self._gl, []
        wholes: dict[int, Whole] = {id(one.whole): one.whole for one in places}
        self.deformer.prepare(list(wholes.values()))
        self._bound.use()
        for one in places:
            rows = self.deformer.rows(one)
            buffers = [gl.buffer(reserve=12 * len(one)) for _ in range(2)]  # type: ignore[attr-defined]
            self.deformer.write(one, rows, buffers)
            found.append(tuple(np.frombuffer(b.read(), np.float32).reshape(-1, 3) for b in buffers))
            for part in (*rows, *buffers):
                part.release()
        assert gl.error == "GL_NO_ERROR"  # type: ignore[attr-defined]
        return found  # type: ignore[return-value]


@contextmanager
def reading() -> Iterator[Reader]:
    """A reader on a context of its own."""
    context = offscreen_context()
    with context:
        reader = Reader(context)
        yield reader
        reader.deformer.close()
    context.release()


def off(one: Float32, other: Float32) -> float:
    """The largest distance between rows."""
    return float(np.linalg.norm(one.astype(np.float64) - other, axis=1).max(initial=0.0))
