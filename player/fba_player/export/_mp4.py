"""Films as MP4: H.264 and AAC through PyAV."""

from __future__ import annotations

import contextlib
import os
from fractions import Fraction
from pathlib import Path
from typing import Any

from fba.arrays import UInt8
from fba.atomic import PathLike, atomic_path, write_error
from fba.audio import av_version, import_av
from fba.errors import DisplayError
from fba_player.sound.soundtrack import FilmedSound, Soundtrack

ENCODERS = ("libx264", "libopenh264", "h264")
QUALITY = "18"
"""Constant rate factor of x264."""
PRESET = "veryfast"
"""Speed preset of x264."""
MOTION = "subme=1:me=dia"
"""Motion search: a third less work than that of the preset, for 5 % more bytes."""
THREADS = 4
"""Encoder threads, the same on every machine: their number changes the bits."""
BT709 = 1
SRGB_CURVE = 13
STUDIO_RANGE = 1
"""Code points of ISO/IEC 23091-2: colours of HD video, the curve of sRGB, and the range 16..235."""


class Mp4:
    """A `Sink` that writes MP4: H.264 in yuv420p with exact frame times, and AAC.

    The arguments are those of `Recorder`.
    """

    def __init__(
        self,
        path: PathLike,
        size: tuple[int, int],
        rate: Fraction,
        audio: PathLike | FilmedSound | None = None,
        audio_start: float | Fraction = 0,
    ) -> None:
        self._av = import_av()
        width, height = self._size = size[0] // 2 * 2, size[1] // 2 * 2
        if width < 2 or height < 2:
            raise ValueError(f"a film must have at least 2x2 pixels, not {size[0]}x{size[1]}")
        self.stopped = False
        self._path, self._rate = Path(path), rate
        self._cleanup = contextlib.ExitStack()
        self._container: Any = None
        with contextlib.ExitStack() as undo:
            undo.callback(self.abort)
            if isinstance(audio, str | os.PathLike):
                audio = Soundtrack(audio, Fraction(audio_start))
            if audio is not None:
                self._cleanup.callback(audio.close)
            name = _choose_encoder(self._av)
            temporary = self._cleanup.enter_context(atomic_path(path))
            with self._convert_errors():
                options = {"movflags": "+faststart"}  # so that it plays while it is still loading
                self._container = self._av.open(str(temporary), "w", format="mp4", options=options)
                self._stream = _video_stream(self._container, name, rate, self._size)
                self._audio = None if audio is None else _AudioTrack(self._container, audio)
            self._reformatter = self._av.video.reformatter.VideoReformatter()
            version, frames = av_version(self._av), self._av.VideoFrame
            # Versions before 14 have to copy the pixels.
            self._framed = frames.from_numpy_buffer if version >= 14 else frames.from_ndarray
            self._conversion: dict[str, Any] = {
                "format": "yuv420p",
                "dst_colorspace": "ITU709",  # by name: version 14 takes no numbers here
                "dst_color_range": "MPEG",
            }
            if version >= 17:  # before, there is one thread, and no argument for it
                self._conversion["threads"] = 1
            undo.pop_all()

    def write(self, pixels: UInt8, number: int) -> None:
        width, height = self._size
        with self._convert_errors():
            shown = self._framed(pixels[:height, :width], format="rgba")
            picture = self._reformatter.reformat(shown, **self._conversion)
            picture.pts, picture.time_base = number, 1 / self._rate
            self._container.mux(self._stream.encode(picture))
            if self._audio is not None:
                self._audio.encode_until(number / self._rate)

    def finish(self, count: int) -> Path:
        with self._convert_errors():
            self._container.mux(self._stream.encode(None))
            if self._audio is not None:
                self._audio.encode_until(count / self._rate)
                self._audio.finish()
            self._container.close()
        if self.stopped:
            self.abort()
        self._cleanup.close()
        return self._path

    def abort(self) -> None:
        with contextlib.suppress(Exception):
            if self._container is not None:
                self._container.close()
        with contextlib.suppress(InterruptedError), self._cleanup:
            raise InterruptedError  # so that the blocks remove their files

    @contextlib.contextmanager
    def _convert_errors(self) -> Any:
        try:
            yield
        except self._av.error.FFmpegError as error:
            if isinstance(error, OSError) and error.errno and 0 < error.errno < 200:
                raise write_error(self._path, error) from error
            width, height = self._size
            raise DisplayError(
                f"{self._path}: the encoder failed at {width}x{height}, {self._rate} frames/s: {error}"
            ) from error


class _AudioTrack:
    """The AAC track of a film, encoded as far as its pictures."""

    def __init__(self, container: Any, soundtrack: FilmedSound) -> None:
        self._container, self._soundtrack = container, soundtrack
        self._stream = container.add_stream("aac", rate=soundtrack.rate)
        self._stream.codec_context.layout = soundtrack.layout
        self._stream.codec_context.format = "fltp"
        self._stream.bit_rate = 96_000 * soundtrack.channels
        self._done = 0

    def encode_until(self, time: Fraction) -> None:
        stop = round(time * self._soundtrack.rate)
        if stop <= self._done:
            return
        for frame in self._soundtrack.frames(stop - self._done):
            frame.pts, frame.time_base = self._done, Fraction(1, self._soundtrack.rate)
            self._done += frame.samples
            self._container.mux(self._stream.encode(frame))

    def finish(self) -> None:
        self._container.mux(self._stream.encode(None))


def _choose_encoder(av: Any) -> str:
    name = next((name for name in ENCODERS if name in av.codec.codecs_available), None)
    if name is not None:
        return name
    raise DisplayError(
        "this build of PyAV has no H.264 encoder; install the wheel of av from the package index"
    )


def _video_stream(container: Any, name: str, rate: Fraction, size: tuple[int, int]) -> Any:
    options = {}
    if name == "libx264":
        options = {"crf": QUALITY, "preset": PRESET, "threads": str(THREADS), "x264-params": MOTION}
    stream = container.add_stream(name, rate=rate, options=options)
    stream.width, stream.height, stream.pix_fmt = *size, "yuv420p"
    context = stream.codec_context
    context.time_base = 1 / rate
    context.colorspace = context.color_primaries = BT709
    context.color_trc, context.color_range = SRGB_CURVE, STUDIO_RANGE
    return stream
