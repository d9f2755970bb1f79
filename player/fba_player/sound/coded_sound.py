"""The sound of any file as coded packets, for MP4 files: copied where they are AAC or Opus, else coded."""

from __future__ import annotations

import io
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fba.arrays import Int64
from fba.atomic import PathLike
from fba.audio import SoundFile, import_av, open_sound
from fba.carriage.mp4 import SoundTrack
from fba.errors import DisplayError, FormatError
from fba_player.sound.soundtrack import AAC_FRAME, AAC_RATES, make_frame

Coding = Literal["aac", "opus"]
OPUS_RATE = 48_000
_ENCODERS: dict[Coding, tuple[str, tuple[int, ...], int]] = {
    "aac": ("aac", AAC_RATES, 96_000),
    "opus": ("libopus", (OPUS_RATE,), 48_000),
}
"""Name of the encoder, samples a second that it takes, and bits a second of a channel."""
_OPUS_HEAD = b"OpusHead"
MOST_BYTES = 1 << 30
"""Most bytes of coded sound: a day of AAC."""


def read_coded_sound(path: PathLike, coding: Coding | None = None) -> SoundTrack:
    """Return the first sound of a file as packets.

    path: anything that FFmpeg reads. coding: "aac" or "opus"; None to keep what the file has, and for AAC in
    place of any other. AAC in MP4 and Opus in MP4 and Ogg are copied as they are.

    Raises FormatError for a file without sound, or with more than `MOST_BYTES` of it, DisplayError without
    PyAV or without the encoder.
    """
    av, path = import_av("sound in MP4 needs"), Path(path)
    container, stream = open_sound(av, path)
    try:
        copied = _read_packets(av, container, stream, path, coding)
    finally:
        container.close()
    if copied is not None:
        return copied
    coded = io.BytesIO(_encode(av, path, coding or "aac"))
    with av.open(coded) as container:
        read = _read_packets(av, container, container.streams.audio[0], path, coding)
    assert read is not None  # as this has just been coded
    return read


def _read_packets(
    av: Any, container: Any, stream: Any, path: Path, coding: Coding | None
) -> SoundTrack | None:
    """Return the packets of a stream; None if they are to be coded anew."""
    context = stream.codec_context
    name, configuration = context.name, bytes(context.extradata or b"")
    found: Coding | None = None
    if name == "aac" and configuration:
        found, rate = "aac", context.sample_rate
    elif name == "opus" and configuration.startswith(_OPUS_HEAD) and len(configuration) >= 19:
        found, rate = "opus", OPUS_RATE
    if found is None or coding not in (None, found) or stream.time_base != Fraction(1, rate):
        return None
    packets: list[bytes] = []
    times: list[int] = []
    last = size = 0
    try:
        for packet in container.demux(stream):
            if packet.size and packet.pts is not None:
                packets.append(bytes(packet))
                times.append(packet.pts)
                last, size = packet.duration or 0, size + packet.size
            if size > MOST_BYTES:
                raise FormatError(
                    f"holds more than {MOST_BYTES >> 20} MB of coded sound; cut the part that goes with the "
                    "stream out of it",
                    path=path,
                )
    except av.error.FFmpegError:
        return None  # damaged: decoding leaves out the damaged part
    all_times: Int64 = np.array([*times, times[-1] + last if times else 0], dtype=np.int64)
    durations = all_times[1:] - all_times[:-1]
    if not packets or (durations <= 0).any() or (durations >= 1 << 32).any():
        return None
    skipped = max((stream.start_time or 0) - times[0], 0)
    return SoundTrack(found, configuration, rate, context.channels, tuple(packets), durations, int(skipped))


def _encode(av: Any, path: Path, coding: Coding) -> bytes:
    """Return an MP4 file with the sound of a file alone."""
    encoder, rates, bits = _ENCODERS[coding]
    target = io.BytesIO()
    with SoundFile(path, rates) as sound:
        layout = "mono" if sound.mono else "stereo"
        try:
            with av.open(target, "w", format="mp4") as container:
                stream = container.add_stream(encoder, rate=sound.rate)
                stream.codec_context.layout = layout
                stream.bit_rate = bits * (1 if sound.mono else 2)
                done = 0
                while len(samples := sound.read(done, AAC_FRAME)):
                    kept = samples[:, :1] if sound.mono else samples
                    block = np.ascontiguousarray(kept.T, dtype=np.float32) / np.float32(32768)
                    frame = make_frame(av, block, layout, sound.rate)
                    frame.pts, frame.time_base = done, Fraction(1, sound.rate)
                    container.mux(stream.encode(frame))
                    done += len(samples)
                    if target.tell() > MOST_BYTES:
                        raise FormatError(
                            f"becomes more than {MOST_BYTES >> 20} MB of coded sound", path=path
                        )
                container.mux(stream.encode(None))
        except (av.error.FFmpegError, av.codec.codec.UnknownCodecError) as error:
            raise DisplayError(f"{path}: the sound cannot be coded as {coding}: {error}") from error
    return target.getvalue()
