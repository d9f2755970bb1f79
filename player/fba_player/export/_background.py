"""Exports that another process makes while a window goes on: films, pictures, streams and other files."""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
import warnings
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from fba.animation import Animation
from fba.arrays import Array, Bool
from fba.atomic import PathLike
from fba.errors import FbaError, FbaWarning
from fba.parameters import BapTable
from fba.tracks import hold
from fba_player.export.image_files import PICTURES, is_film
from fba_player.export.render import render
from fba_player.view._camera import Camera
from fba_player.view.protocols import Closing

STOP_SECONDS = 5.0
"""Seconds in which a cancelled export may end by itself."""


@dataclass(frozen=True, kw_only=True)
class ExportOptions:
    """What of a scene is exported.

    size: of pictures, in pixels. camera: as it is now. time: of a picture, seconds. start, end: of films and
    files, seconds; None for the whole. follow: what the camera follows, see `Timed.follow`.
    audio, audio_offset: the sound of an MP4. bap_steps: of a stream.
    """

    size: tuple[int, int]
    camera: Camera
    time: float
    start: float | None = None
    end: float | None = None
    follow: str | None = None
    audio: PathLike | None = None
    audio_offset: float = 0.0
    bap_steps: BapTable = "iso"


class Export(Closing):
    """A file that another process makes from a scene; the suffix of its name says what.

    .mp4, .gif, .png, .jpg: drawn as `fba_player.export.render.render` does; any other format that can be
    written (.fba, .fap, .bap, .bvh, .glb): the animation, of the first figure where there are several.

    The file appears when it is complete. `poll` updates `done`, `total`, `notes` and, at the end, `finished`;
    `problem` is the text of an error then. Raises FbaError where the scene cannot be handed on.
    """

    def __init__(self, scene: Any, path: PathLike, options: ExportOptions) -> None:
        self.path = Path(path)
        self.done, self.total = 0, 0
        self.finished = self.cancelled = False
        self.problem = ""
        self.notes: list[str] = []
        context = multiprocessing.get_context("spawn")  # a copy would share the window's OpenGL
        self._pipe, other = context.Pipe()
        self._process = context.Process(
            target=_export, args=(other, scene, os.fspath(self.path), options), name="fba export", daemon=True
        )
        try:
            self._process.start()
        except (TypeError, AttributeError) as error:
            raise FbaError(f"this scene cannot be exported from the window: {error}") from error
        finally:
            other.close()

    @property
    def share(self) -> float:
        """How much is done, 0 to 1."""
        return self.done / self.total if self.total else 0.0

    def poll(self) -> None:
        """Take over what the other process has said since."""
        if self.cancelled:
            self.finished = not self._process.is_alive()
            return
        try:
            while not self.finished and self._pipe.poll():
                kind, value = self._pipe.recv()
                if kind == "progress":
                    self.done, self.total = value
                elif kind == "note":
                    self.notes.append(value)
                else:
                    self.problem, self.finished = value, True
        except (EOFError, OSError):
            self.problem, self.finished = "the process that exports has ended", True
        if self.finished:
            self._process.join(5.0)

    def cancel(self) -> None:
        """Ask it to stop, without a file; `poll` sets `finished` when it has. Safe to call twice."""
        self.cancelled = True
        self._pipe.close()  # it stops at its next frame at the latest
        if os.name == "posix" and self._process.is_alive():
            self._process.terminate()

    def close(self) -> None:
        """Cancel it if it is not finished, and wait for its end; no file is left then. Safe to call twice."""
        self.cancel()
        self._process.join(STOP_SECONDS)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self.finished = True


def _export(pipe: Connection, scene: Any, path: str, options: ExportOptions) -> None:
    """Export a scene, in the other process; tell the window how far it is, and what goes wrong."""

    stopped = False

    def stop(*_: object) -> None:
        nonlocal stopped
        stopped = True
        raise InterruptedError

    signal.signal(signal.SIGTERM, stop)  # so that the blocks remove their files

    def tell(done: int, total: int) -> None:
        if pipe.poll():  # the window has closed its end
            raise InterruptedError
        pipe.send(("progress", (done, total)))

    try:
        with warnings.catch_warnings(record=True, action="always", category=FbaWarning) as caught:
            write(scene, path, options, tell)
        for warning in caught:
            if issubclass(warning.category, FbaWarning):
                pipe.send(("note", str(warning.message)))
        pipe.send(("end", ""))
    except (BrokenPipeError, ConnectionResetError, InterruptedError):
        pass  # cancelled
    except (FbaError, OSError, ValueError) as error:
        pipe.send(("end", str(error) or type(error).__name__))
    except RuntimeError:
        if not stopped:  # a compiler that is interrupted says this
            raise


def write(scene: Any, path: str, options: ExportOptions, progress: Any = None) -> None:
    """Write a file from a scene; see `Export`."""
    suffix = Path(path).suffix.lower()
    scene.follow = options.follow
    if suffix in PICTURES:
        render(scene, path, size=options.size, camera=options.camera, time=options.time, progress=progress)
    elif is_film(path):
        audio = options.audio if suffix == ".mp4" else None
        render(
            scene, path, size=options.size, camera=options.camera, start=options.start, end=options.end,
            audio=audio, audio_offset=options.audio_offset if audio is not None else 0.0, progress=progress,
        )  # fmt: skip
    else:
        from fba.formats import write as write_animation

        animation: Animation = scene.animation
        if options.start is not None or options.end is not None:
            animation = part(animation, options.start, options.end)
        given: dict[str, Any] = {"bap_steps": options.bap_steps} if suffix == ".fba" else {}
        write_animation(Path(path), animation, **given)


def part(animation: Animation, start: float | None, end: float | None) -> Animation:
    """Return the frames between two times, seconds; the first also sends what was in force before it.

    Raises ValueError where no frame lies between them.
    """
    low, high = -math.inf if start is None else start, math.inf if end is None else end
    cut = animation.between(low, high)
    if not len(cut):
        raise ValueError(f"no frame lies between {low:g} s and {high:g} s")
    first = int(np.searchsorted(animation.times, low))
    if not first:
        return cut
    face, body = cut.face, cut.body
    if animation.face is not None and face is not None:
        track = animation.face[: first + 1]
        values, mask = face.values.copy(), face.mask.copy()
        viseme, expression = face.viseme.copy(), face.expression.copy()
        values[0] = _in_force(track.values, track.mask)
        viseme[0] = _in_force(track.viseme, track.mask[:, :1])
        expression[0] = _in_force(track.expression, track.mask[:, 1:2])
        mask[0] = track.mask.any(axis=0)
        face = replace(face, values=values, mask=mask, viseme=viseme, expression=expression)
    if animation.body is not None and body is not None:
        before = animation.body[: first + 1]
        turned, sent = body.values.copy(), body.mask.copy()
        turned[0], sent[0] = _in_force(before.values, before.mask), before.mask.any(axis=0)
        body = replace(body, values=turned, mask=sent)
    return Animation(cut.rate, cut.index, face, body, cut.name)


def _in_force(values: Array, mask: Bool) -> Array:
    """Return the values (N,) in force at the last frame of (T, N)."""
    return np.asarray(hold(values, mask, np.zeros_like(values[0]))[-1])
