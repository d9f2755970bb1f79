"""Descriptions of streams: `StreamInfo`, and `probe_stream`, which stores no values."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Int64
from fba.codec._coded_frames import Block
from fba.codec._decoder import read_blocks, reader_for
from fba.codec._plane import header_loops
from fba.codec._stream.damage import Damage
from fba.codec.settings import PartSettings
from fba.errors import BitstreamError
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BapTable

_MASK_NAMES = {
    header_loops.MASK_NONE: "none",
    header_loops.MASK_KEEP: "keep",
    header_loops.MASK_INTERPOLATE: "interpolate",
    header_loops.MASK_ALL: "all",
}


@dataclass(frozen=True)
class PartInfo:
    """The FAPs or the BAPs of a stream.

    parameters: numbers of those ever sent, ascending. frames: frames that carry the part. For FBA
    streams also quants (all fap_quant or bap_quant values used), mask_types (names of those used) and
    genders (suggested_gender values).
    """

    parameters: tuple[int, ...]
    frames: int
    quants: tuple[int, ...] = ()
    mask_types: tuple[str, ...] = ()
    genders: tuple[int, ...] = ()


@dataclass(frozen=True)
class StreamInfo:
    """Description of a stream or file, as `fba info` prints it.

    format: name of the file format, "fba" for streams. size: bytes. rate: frames per second. frames: number
    of frames (planes). duration, start: seconds, exact; duration runs from the first frame to one period
    after the last. skipped: frames left out between frames. bits_per_second: size over duration.

    For FBA streams also intra_planes and start_codes (numbers of I planes, and of planes after a start code),
    plane_bits int64 (T,), plane_intra bool (T,), frame_index int64 (T,), damage that was skipped, and
    bap_steps, the table that the mark behind the stream names (None without a mark).
    """

    format: str
    size: int
    rate: Fraction
    frames: int
    duration: Fraction
    start: Fraction
    skipped: int
    face: PartInfo | None
    body: PartInfo | None
    intra_planes: int | None = None
    start_codes: int | None = None
    plane_bits: Int64 | None = field(default=None, repr=False)
    plane_intra: Bool | None = field(default=None, repr=False)
    frame_index: Int64 | None = field(default=None, repr=False)
    damage: tuple[Damage, ...] = ()
    bap_steps: BapTable | None = None

    @property
    def bits_per_second(self) -> float:
        """Mean bit rate; 0 for a stream without duration."""
        return float(8 * self.size / self.duration) if self.duration else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers and strings, for JSON."""

        def part(info: PartInfo | None) -> dict[str, Any] | None:
            if info is None:
                return None
            return {name: list(v) if isinstance(v, tuple) else v for name, v in asdict(info).items()}

        return {
            "format": self.format,
            "size": self.size,
            "rate": str(self.rate),
            "frames_per_second": float(self.rate),
            "frames": self.frames,
            "duration": float(self.duration),
            "start": float(self.start),
            "skipped": self.skipped,
            "bits_per_second": round(self.bits_per_second, 3),
            "face": part(self.face),
            "body": part(self.body),
            "intra_planes": self.intra_planes,
            "start_codes": self.start_codes,
            "bap_steps": self.bap_steps,
            "damage": [d.to_dict() for d in self.damage],
        }

    @classmethod
    def of_animation(cls, animation: Animation, format: str, size: int) -> StreamInfo:
        """Return the description of a file of another format, from the animation in it."""
        parts: list[PartInfo | None] = []
        for track in (animation.face, animation.body):
            if track is None:
                parts.append(None)
                continue
            sent = np.flatnonzero(track.mask.any(axis=0)) + 1
            parts.append(PartInfo(tuple(sent.tolist()), int(track.mask.any(axis=1).sum())))
        frames = len(animation)
        first, last = (int(animation.index[0]), int(animation.index[-1])) if frames else (0, -1)
        return cls(
            format=format,
            size=size,
            rate=animation.rate,
            frames=frames,
            duration=animation.duration,
            start=Fraction(first) / animation.rate,
            skipped=last - first + 1 - frames,
            face=parts[0],
            body=parts[1],
        )


class _PartCount:
    """Collects a `PartInfo`."""

    def __init__(self) -> None:
        self.settings: dict[int, PartSettings] = {}
        self.frames = 0

    def add(self, settings: PartSettings | None, frames: int) -> None:
        """Count frames with these settings; None for planes without the part."""
        if settings is not None:
            self.settings[id(settings)] = settings
            self.frames += frames

    def info(self) -> PartInfo | None:
        """Return the description, or None if no plane carried the part."""
        if not self.settings:
            return None
        all_settings = list(self.settings.values())
        sent = np.logical_or.reduce([settings.mask for settings in all_settings])
        kinds = sorted({kind for settings in all_settings for kind in settings.mask_types})
        return PartInfo(
            tuple((np.flatnonzero(sent) + 1).tolist()),
            self.frames,
            tuple(sorted({settings.quant for settings in all_settings})),
            tuple(_MASK_NAMES[kind] for kind in kinds),
            tuple(sorted({settings.gender for settings in all_settings})),
        )


def probe_stream(
    data: bytes | bytearray | memoryview,
    *,
    bap_steps: BapTable | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> StreamInfo:
    """Return the description of an FBA stream: planes, rates, parameters, bits.

    Decodes it, because only the arithmetic decoder finds the ends of planes, but stores no values. Skips
    damage and lists it. Raises BitstreamError if no plane can be decoded.
    """
    view = memoryview(data)
    reader = reader_for(view, bap_steps=bap_steps, on_error="salvage", limits=limits)
    face, body = _PartCount(), _PartCount()
    bits: list[Int64] = []
    intra: list[Bool] = []
    index: list[Int64] = []
    start_codes = 0
    first: Block | None = None
    block: Block | None = None
    for block in read_blocks(reader, view):
        first = first or block
        count = len(block.index)
        face.add(block.settings.face, count)
        body.add(block.settings.body, count)
        bits.append(np.diff(block.borders))
        intra.append(np.full(count, block.settings.intra))
        index.append(block.index)
        start_codes += block.settings.start_code
    if first is None or block is None:
        if reader.damage:
            raise reader.damage[0].error
        raise BitstreamError("the object has no plane", plane=0, bit=32)
    all_index = np.concatenate(index)
    end = block.start + Fraction(int(block.index[-1] - block.index[0]) + 1) / block.rate
    all_intra = np.concatenate(intra)
    return StreamInfo(
        format="fba",
        size=len(data),
        rate=first.rate,
        frames=len(all_index),
        duration=end - first.start,
        start=first.start,
        skipped=int(all_index[-1] - all_index[0]) + 1 - len(all_index),
        face=face.info(),
        body=body.info(),
        intra_planes=int(all_intra.sum()),
        start_codes=start_codes,
        plane_bits=np.concatenate(bits),
        plane_intra=all_intra,
        frame_index=all_index,
        damage=tuple(reader.damage),
        bap_steps=reader.objects.mark,
    )
