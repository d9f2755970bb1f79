"""`SoundTrack`: coded sound, as it goes into a file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from fba.arrays import Int64


@dataclass(frozen=True, eq=False)
class SoundTrack:
    """Coded sound.

    coding: "aac" (ISO/IEC 14496-3) or "opus" (RFC 6716). configuration: AudioSpecificConfig, or the
    identification header of Opus in Ogg (RFC 7845, 5.1). rate: ticks a second, of the samples of AAC, 48000
    for Opus. channels: their number. packets: the frames. durations: int64 (N,), ticks of each. skipped:
    ticks at the beginning that decoders leave out.
    """

    coding: Literal["aac", "opus"]
    configuration: bytes
    rate: int
    channels: int
    packets: tuple[bytes, ...]
    durations: Int64
    skipped: int = 0
