"""The way that the vertices of figures take: made here and sent, or made on the graphics card."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np
import numpy.typing as npt

from fba_player.figure.body_light import LitPart
from fba_player.figure.face_light import LitFacePart
from fba_player.gl.gpu._deformer import GpuDeformer
from fba_player.gl.gpu.choice import FAILED, Choice
from fba_player.gl.lod import same
from fba_player.mesh.lazy_vertices import Places, Whole, spare
from fba_player.view.view import ChosenLight, FaceMesh

WRONG = 1e-4
"""By this share of its size a figure on the graphics card may be off."""
CLEARLY, FEW = 0.05, 0.01
"""Its normals and its light may be off by more than the first in no more than the second of all places, where
a rounding decides what they are."""
Parts = dict[str, Any]


class Way:
    """Brings vertices into buffers. Owns what it allocates on the moderngl context; `close` gives it back.

    wish: one of `fba_player.gl.gpu.choice.DEFORM`. What goes wrong on the graphics card is done without it.
    """

    def __init__(self, context: Any, wish: str = "auto") -> None:
        self._gl = context
        self._choice = Choice(context.info, wish)
        self._deformer: GpuDeformer | None = None
        self._proven: set[int] = set()
        self.on_gpu = False
        """Whether the graphics card makes the vertices of the picture that was prepared last."""

    @property
    def reason(self) -> str:
        """Why it does, or does not."""
        return self._choice.reason

    def prepare(self, meshes: list[FaceMesh], draw: Callable[[list[FaceMesh]], None]) -> None:
        """Before anything of a picture: everything that is then drawn. draw: draws it into what is bound, to
        find out how long that takes; called for the first picture of a kind alone."""
        count = sum(whole.count for whole in _wholes(meshes) if whole.moves)
        on_gpu = count > 0 and self._choice.on_gpu(count, lambda gpu: self._trial(meshes, draw, gpu))
        self._prepared(meshes, on_gpu)
        if self.on_gpu and count not in self._proven:
            if self._is_right(meshes):
                self._proven.add(count)
            else:
                if self.on_gpu:
                    self._give_up("vertices come out wrong")
                self._prepared(meshes, False)

    def write(self, mesh: FaceMesh, parts: Parts) -> None:
        """Positions, normals and light of a part into its buffers, which parts has by these names; it keeps
        what else that needs."""
        if self.on_gpu and mesh.places.whole.moves and self._deformer is not None:
            try:
                light = _light(mesh)
                lit = light is not None or (
                    _limbs(mesh) is not None and self._deformer.is_lit(mesh.places.whole)
                )
                self._written(self._deformer, mesh.places, parts, lit, light)
                if not lit:
                    _send_light(mesh, parts)
                return
            except Exception as error:  # whatever a driver cannot do, the processor can
                self._give_up(_said(error))
        parts["made"] = None
        _send(parts["positions"], mesh.positions)
        _send(parts["normals"], mesh.normals)
        _send_light(mesh, parts)

    def close(self) -> None:
        """Free everything allocated on the graphics card."""
        spare(self, False)
        if self._deformer is not None:
            self._deformer.close()
            self._deformer = None

    def _prepared(self, meshes: list[FaceMesh], on_gpu: bool) -> None:
        wholes = _wholes(meshes)
        self.on_gpu = on_gpu
        if on_gpu:
            target, viewport = self._gl.fbo, self._gl.viewport
            try:
                if self._deformer is None:
                    self._deformer = GpuDeformer(self._gl)
                capsules = {id(m.places.whole): rows for m in meshes if (rows := _limbs(m)) is not None}
                self._deformer.prepare([whole for whole in wholes if whole.moves], capsules)
            except Exception as error:  # as above
                self._give_up(_said(error))
            target.use()
            self._gl.viewport = viewport
        spare(self, self.on_gpu)
        for whole in wholes:
            if not (self.on_gpu and whole.moves):
                _ = whole.arrays

    def _give_up(self, reason: str) -> None:
        self._choice.give_up(reason)
        self.on_gpu = False
        self.close()

    def _written(
        self, deformer: GpuDeformer, places: Places, parts: Parts, lit: bool, light: LitFacePart | None
    ) -> None:
        whole = places.whole
        if parts.get("made") == (whole, lit, light):  # drawn a second time
            return
        of = (id(deformer), places.start, id(places.chosen), type(whole.motion), whole.count, lit)
        if parts.get("rows_of") != of:
            release(parts)
            parts["rows"], parts["rows_of"] = deformer.rows(places, lit=lit), of
        buffers = [parts[name] for name in ("positions", "normals", "light")]
        if lit:
            parts["lit"] = None
        deformer.write(places, parts["rows"], buffers if lit else buffers[:2], light)
        parts["made"] = (whole, lit, light)

    def _trial(self, meshes: list[FaceMesh], draw: Callable[[list[FaceMesh]], None], on_gpu: bool) -> float:
        """Seconds that a picture takes; more than any where the graphics card cannot do it."""
        made: dict[int, Whole] = {}
        again = [mesh.afresh(made) for mesh in meshes]
        self._gl.finish()
        start = perf_counter()
        self._prepared(again, on_gpu)
        if self.on_gpu != on_gpu:
            return FAILED
        draw(again)
        self._gl.finish()
        return perf_counter() - start if self.on_gpu == on_gpu else FAILED

    def _is_right(self, meshes: list[FaceMesh]) -> bool:
        """Whether the graphics card makes of the figures what the processor does."""
        for mesh in meshes:
            count = len(mesh.places)
            if not mesh.places.whole.moves or not count:
                continue
            wanted = {"positions": mesh.positions, "normals": mesh.normals, "light": mesh.light}
            rooms: Parts = {name: self._gl.buffer(reserve=4 * array.size) for name, array in wanted.items()}
            self.write(mesh, rooms)
            found = {name: np.frombuffer(rooms[name].read(), dtype=np.float32) for name in wanted}
            release(rooms)
            for name in wanted:
                rooms[name].release()
            size = float(np.abs(mesh.positions).max(initial=1e-9))
            for name, most in (("positions", WRONG * size), ("normals", CLEARLY), ("light", CLEARLY)):
                off = ~(np.abs(found[name] - wanted[name].reshape(-1)) <= most)  # so that NaN is off
                if not self.on_gpu or off.mean() > (0.0 if name == "positions" else FEW):
                    return False
        return True


def release(parts: Parts) -> None:
    """Free what `Way.write` keeps with a part."""
    for part in parts.pop("rows", ()):
        part.release()
    parts.pop("rows_of", None)
    parts["made"] = None


def _limbs(mesh: FaceMesh) -> npt.NDArray[np.float32] | None:
    """What may be in the light's way to the body that a mesh is a part of: see
    `fba_player.figure.body_light`."""
    reaching = _reaching(mesh)
    return reaching.body.capsules if isinstance(reaching, LitPart) else None


def _light(mesh: FaceMesh) -> LitFacePart | None:
    """The light on a face, where a graphics card knows how to work it out: a tongue that is out is rare."""
    reaching = _reaching(mesh)
    return reaching if isinstance(reaching, LitFacePart) and reaching.outside is None else None


def _reaching(mesh: FaceMesh) -> Any:
    return mesh.reaching.of if isinstance(mesh.reaching, ChosenLight) else mesh.reaching


def _send_light(mesh: FaceMesh, parts: Parts) -> None:
    light = mesh.light
    if parts.get("lit") is None or not same(parts["lit"], light):
        parts["lit"] = light
        _send(parts["light"], light)


def _send(buffer: Any, array: npt.NDArray[np.float32]) -> None:
    buffer.orphan()
    buffer.write(np.ascontiguousarray(array, dtype="f4"))


def _said(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _wholes(meshes: list[FaceMesh]) -> list[Whole]:
    found = {id(mesh.places.whole): mesh.places.whole for mesh in meshes}
    return list(found.values())
