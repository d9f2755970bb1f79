"""The part of a recorded sound that goes with a stream: when it was recorded, and a WAV file of that part."""

from __future__ import annotations

import wave
from fractions import Fraction
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from fba.arrays import Int16
from fba.atomic import PathLike
from fba.audio import import_av, open_sound
from fba.formats.time_codes import parse_time_code
from fba_player.sound.soundtrack import AAC_FRAME, Soundtrack

FULL = 32767
"""The largest sample of 16 bits."""


def read_time_of_day(path: PathLike) -> float | None:
    """Return when a sound was recorded: the time of day of its first sample, in seconds.

    That is the time reference of a broadcast WAV file (EBU Tech 3285, chunk "bext") or the time code of a
    film. None if absent; a reference of 0, which programs write that know no time, counts as absent.
    Raises FormatError for a file that is no sound.
    """
    container, stream = open_sound(import_av("sound needs"), Path(path))
    try:
        tags = dict(container.metadata)
        film = [other for other in container.streams if other.type in ("video", "data")]
        code = tags.get("timecode") or next((other.metadata.get("timecode") for other in film), None)
        reference = str(tags.get("time_reference", ""))
        if code:
            return parse_time_code(code, _film_rate(film))
        if reference.isdecimal() and int(reference) and stream.rate:
            return int(reference) / float(stream.rate)
        return None
    finally:
        container.close()


def write_clip(file: BinaryIO, path: PathLike, start: Fraction, seconds: Fraction) -> None:
    """Write a part of a sound as a WAV file, 16 bits, at its own rate where AAC has it, else 48 kHz.

    start: seconds in the sound; if negative, silence comes first, as it does after its end. seconds: length
    of the part. Raises FormatError for a file that is no sound, or damaged.
    """
    source = Soundtrack(path, start)
    try:
        with wave.open(file, "wb") as target:
            target.setnchannels(source.channels)
            target.setsampwidth(2)
            target.setframerate(source.rate)
            missing = round(seconds * source.rate)
            target.setnframes(missing)
            while missing > 0:
                count = min(missing, AAC_FRAME)
                target.writeframes(_samples(source.take(count)).tobytes())
                missing -= count
    finally:
        source.close()


def _samples(block: Any) -> Int16:
    """Return samples of 16 bits (N, channels) of float ones (channels, N), -1..1."""
    return np.asarray(np.rint(np.clip(block.T, -1.0, 1.0) * FULL).astype("<i2"))


def _film_rate(streams: list[Any]) -> Fraction | None:
    """Return the frames in a second of the first stream of pictures; None without one."""
    rates = (stream.average_rate for stream in streams if stream.type == "video")
    return next((Fraction(rate) for rate in rates if rate), None)
