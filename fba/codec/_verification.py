"""Check a stream in an archive: is it complete, is it undamaged, does it still have the same values?"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from fractions import Fraction
from hashlib import sha256
from typing import Any

import numpy as np

from fba.animation import Animation
from fba.codec._decoder import read_blocks, reader_for
from fba.codec._frame_buffers import CompactBuffer
from fba.codec._stream.damage import Damage
from fba.errors import BitstreamError, FbaWarning
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BAP_COUNT, EXPRESSION_FIELDS, FAP_COUNT, VISEME_FIELDS, BapTable

_CHUNK_FRAMES = 4096
"""Frames of which the digest is computed at once, to limit the memory."""


@dataclass(frozen=True)
class Verification:
    """The result of a check of a stream.

    size: bytes. frames: number of decoded frames. duration: seconds. ended: an end code closes the stream.
    damage: what was lost. doubtful: number of planes that may be wrong, because damage came soon after them,
    or because they depend on what was lost. warnings: their texts. digest: SHA-256 of the decoded values, see
    `digest`.
    """

    size: int
    frames: int
    rate: Fraction
    duration: Fraction
    ended: bool
    damage: tuple[Damage, ...]
    doubtful: int
    warnings: tuple[str, ...]
    digest: str

    @property
    def intact(self) -> bool:
        """Whether nothing is missing and nothing is in doubt, as far as the syntax shows."""
        return self.ended and not self.damage and not self.doubtful

    @property
    def frames_lost(self) -> int | None:
        """Total of lost frames, partly estimated; None if it is unknown for any damage."""
        counts = [damage.frames_lost for damage in self.damage if damage.frames_lost is not None]
        return sum(counts) if len(counts) == len(self.damage) else None

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers and strings, for JSON."""
        return {
            "intact": self.intact,
            "size": self.size,
            "frames": self.frames,
            "rate": str(self.rate),
            "duration": float(self.duration),
            "ended": self.ended,
            "frames_lost": self.frames_lost,
            "doubtful": self.doubtful,
            "damage": [damage.to_dict() for damage in self.damage],
            "warnings": list(self.warnings),
            "digest": self.digest,
        }


def verify_stream(
    data: bytes | bytearray | memoryview,
    *,
    bap_steps: BapTable | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Verification:
    """Check an FBA stream: decode all that can be decoded, and return the findings.

    bap_steps: as for `fba.decode`; it changes the digest of a stream with a body. Raises BitstreamError if no
    plane can be decoded, LimitError beyond `limits`.
    """
    view = memoryview(data)
    reader = reader_for(view, bap_steps=bap_steps, on_error="salvage", limits=limits)
    frames = CompactBuffer(limits, len(view))
    doubtful: set[int] = set()
    with warnings.catch_warnings(record=True, action="always", category=FbaWarning) as odd:
        for block in read_blocks(reader, view):
            frames.add(block)
            if block.doubtful:
                doubtful.update(range(block.number, block.number + len(block.index)))
    for damage in reader.damage:
        doubtful.update(damage.doubtful)
    if not frames.frames:
        if reader.damage:
            raise reader.damage[0].error
        raise BitstreamError("the object has no plane", plane=0, bit=32)
    animation = frames.animation(reader.wrong)
    return Verification(
        len(view), len(animation), animation.rate, animation.duration, reader.objects.ended,
        tuple(reader.damage), len(doubtful), tuple(str(given.message) for given in odd), digest(animation),
    )  # fmt: skip


def digest(animation: Animation) -> str:
    """Return the SHA-256 digest of an animation's frame rate, times and values, as hexadecimal digits.

    It depends on the content alone, not on how it is coded: first the text "fba 1", the rate as a fraction,
    and "face" and "body" if there are such tracks, separated by spaces, and a line feed. Then for each frame
    its index (int64), of the face 68 masks (bytes 0 or 1), 68 values (int32), 4 viseme fields and 6
    expression fields (int16), and of the body 296 masks and 296 values; all little-endian.
    """
    tracks = {"face": animation.face, "body": animation.body}
    words = ["fba", "1", str(animation.rate), *(name for name, track in tracks.items() if track is not None)]
    result = sha256(f"{' '.join(words)}\n".encode())
    fields: list[tuple[str, str, tuple[int, ...]]] = [("index", "<i8", ())]
    if animation.face is not None:
        fields += [("face_mask", "u1", (FAP_COUNT,)), ("face_values", "<i4", (FAP_COUNT,))]
        fields += [("viseme", "<i2", (len(VISEME_FIELDS),)), ("expression", "<i2", (len(EXPRESSION_FIELDS),))]
    if animation.body is not None:
        fields += [("body_mask", "u1", (BAP_COUNT,)), ("body_values", "<i4", (BAP_COUNT,))]
    for start in range(0, len(animation), _CHUNK_FRAMES):
        part = animation[start : start + _CHUNK_FRAMES]
        records = np.zeros(len(part), dtype=fields)
        records["index"] = part.index
        if part.face is not None:
            records["face_mask"], records["face_values"] = part.face.mask, part.face.values
            records["viseme"], records["expression"] = part.face.viseme, part.face.expression
        if part.body is not None:
            records["body_mask"], records["body_values"] = part.body.mask, part.body.values
        result.update(records.tobytes())
    return result.hexdigest()
