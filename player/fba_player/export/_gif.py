"""Films as GIF: one palette for the film, and dithering that does not flicker where nothing moves."""

from __future__ import annotations

import contextlib
import math
import tempfile
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from fba.arrays import UInt8
from fba.atomic import PathLike, atomic_path, write_error
from fba.audio import import_av

MAX_DEFAULT_RATE = Fraction(25)
"""Largest default frame rate; some browsers slow down above 50."""
IN_MEMORY = 64 << 20
"""Bytes of pictures kept in memory until the palette is made; further ones go to disk."""
TICKS_PER_SECOND = 100
"""A GIF's times are hundredths of a second."""
DITHER = "paletteuse=dither=sierra2_4a:diff_mode=rectangle"


def gif_rate(rate: Fraction) -> Fraction:
    """Return the frame rate of a GIF: that of the film, divided by an integer so that it is at most 25."""
    return rate / math.ceil(rate / MAX_DEFAULT_RATE)


class Gif:
    """A `Sink` that writes a GIF which loops for ever. Pictures are stored until the last has been added.

    The arguments are those of `Recorder`.
    """

    def __init__(self, path: PathLike, size: tuple[int, int], rate: Fraction) -> None:
        self._av = import_av()
        if min(size) < 1 or max(size) > 65535:
            raise ValueError(f"a GIF has 1x1 to 65535x65535 pixels, not {size[0]}x{size[1]}")
        if rate > TICKS_PER_SECOND:
            raise ValueError(f"a GIF has at most {TICKS_PER_SECOND} frames a second, not {rate}")
        self.stopped = False
        self._path, self._size, self._rate = Path(path), size, rate
        self._numbers: list[int] = []
        self._cleanup = contextlib.ExitStack()
        self._temporary = self._cleanup.enter_context(atomic_path(path))
        self._pictures = self._cleanup.enter_context(tempfile.SpooledTemporaryFile(IN_MEMORY))  # noqa: SIM115
        self._colours, self._into, self._palette = self._graph("palettegen=stats_mode=full", 1)

    def write(self, pixels: UInt8, number: int) -> None:
        try:
            self._pictures.write(np.ascontiguousarray(pixels[..., :3]).data)
        except OSError as error:
            raise write_error(self._path, error, "its pictures could not be stored") from error
        self._into[0].push(self._frame(pixels, "rgba", number))
        self._numbers.append(number)

    def finish(self, count: int) -> Path:
        self._into[0].push(None)
        palette = self._palette.pull()
        times = [round(number / self._rate * TICKS_PER_SECOND) for number in (*self._numbers, count)]
        last = max(times[-1] - times[-2], 1)
        options = {"loop": "0", "final_delay": str(last)}
        try:
            with self._av.open(str(self._temporary), "w", format="gif", options=options) as container:
                self._encode(container, palette, times)
        except self._av.error.FFmpegError as error:
            raise write_error(self._path, error) from error
        if self.stopped:
            self.abort()
        self._cleanup.close()
        return self._path

    def abort(self) -> None:
        with contextlib.suppress(InterruptedError), self._cleanup:
            raise InterruptedError

    def _encode(self, container: Any, palette: Any, times: list[int]) -> None:
        width, height = self._size
        stream = container.add_stream("gif", rate=TICKS_PER_SECOND)
        stream.width, stream.height, stream.pix_fmt = width, height, "pal8"
        stream.codec_context.time_base = Fraction(1, TICKS_PER_SECOND)
        _graph, into, out = self._graph(DITHER, 2)
        into[1].push(palette)
        into[1].push(None)
        self._pictures.seek(0)
        at = -1
        for number, time in zip(self._numbers, times, strict=False):
            data = self._pictures.read(width * height * 3)
            if self.stopped:
                return
            if time <= at:
                continue  # a second picture within a hundredth of a second
            at = time
            pixels = np.frombuffer(data, dtype=np.uint8).reshape(height, width, 3)
            into[0].push(self._frame(pixels, "rgb24", number))
            reduced = out.pull()
            reduced.pts, reduced.time_base = time, Fraction(1, TICKS_PER_SECOND)
            container.mux(stream.encode(reduced))
        container.mux(stream.encode(None))

    def _frame(self, pixels: UInt8, layout: str, number: int) -> Any:
        frame = self._av.VideoFrame.from_ndarray(pixels, format=layout)
        frame.pts, frame.time_base = number, Fraction(1, 1000)
        return frame

    def _graph(self, description: str, inputs: int) -> tuple[Any, list[Any], Any]:
        """Return (graph, inputs, output) of a filter for pictures of the film; input 2 is a palette."""
        name, _, options = description.partition("=")
        graph = self._av.filter.Graph()
        width, height = self._size
        tick = Fraction(1, 1000)
        pixels = "rgba" if inputs == 1 else "rgb24"
        sources = [graph.add_buffer(width=width, height=height, format=pixels, time_base=tick)]
        if inputs == 2:
            sources.append(graph.add_buffer(width=16, height=16, format="bgra", time_base=tick))
        step, end = graph.add(name, options), graph.add("buffersink")
        for number, source in enumerate(sources):
            source.link_to(step, 0, number)
        step.link_to(end)
        graph.configure()
        return graph, sources, end
