"""What the decoder promises for any bytes at all: the contract that fuzzing checks.

- It raises an `FbaError` or returns an animation that is valid; it never raises another exception.
- Frames and errors do not depend on the chunks in which the stream comes.
- In salvage mode it returns all frames before the damage, and lists damage in order, within the stream.
- Sometimes: its values are those of the independent reader (`fba_conformance.trace`).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import NamedTuple
from zlib import crc32

import numpy as np

from fba.animation import Animation, Frame
from fba.codec import Block, Decoder, probe_stream
from fba.errors import FbaError, FbaWarning
from fba_conformance._values import plane_records
from fba_conformance.trace import BAP_BIT, FAP_BIT
from fba_conformance.trace import planes as independent_planes
from tools.fuzz._outcome import ContractError, Outcome

COMPARED_BYTES = 600
"""Largest stream that is compared: the independent reader takes a second for a few kilobytes."""
COMPARED_SHARE = 0.01


def check_stream(data: bytes, _folder: Path | None = None) -> Outcome:
    """Check the decoder's contract on one stream; raise ContractError.

    Where the stream is divided into chunks depends on its content.
    """
    random = Random(crc32(data))
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        ours, error, _ = _decode(data, [len(data)], "raise")
        cuts = sorted(random.randrange(len(data) + 1) for _ in range(random.choice((1, 2, 8))))
        if random.random() < 0.5:  # the salvaging decoder always gets chunks
            chunked, chunked_error, _ = _decode(data, [*cuts, len(data)], "raise")
            if _error_position(error) != _error_position(chunked_error):
                raise ContractError(f"in chunks {cuts}: {chunked_error}; at once: {error}")
            if ours != chunked:
                raise ContractError(f"other frames in chunks {cuts} than at once")
        rest, fatal, decoder = _decode(data, [*cuts, len(data)], "salvage")
        if fatal is not None and (rest or not decoder.damage):
            raise ContractError(f"a salvaging decoder raised {fatal!r}")
        earlier = rest and ours and rest[0].bit < ours[0].bit  # began without an object start code
        if (
            decoder.damage
        ):  # strictly, an unknown start code ends the object, and the next one is read as well
            ours = [frame for frame in ours if frame.end < 8 * decoder.damage[0].start + 8]
        if _without_times(rest[: len(ours)]) != _without_times(ours) and not earlier:
            raise ContractError(
                f"{len(rest)} frames salvaged that do not begin with the {len(ours)} good ones"
            )
        lost_to = 0
        for damage in decoder.damage:
            if not lost_to <= damage.start <= damage.stop <= len(data):
                raise ContractError(f"damage {damage} out of order or out of the stream ({len(data)} bytes)")
            lost_to = damage.stop
        if error is not None and not decoder.damage:
            raise ContractError(f"{error} went unmentioned by the salvaging decoder")
        if random.random() < 0.2:
            _check_probe(data, len(rest))
        if random.random() < COMPARED_SHARE and len(data) <= COMPARED_BYTES:
            compare(data)
        ends = *(frame.end for frame in rest), *(8 * damage.stop for damage in decoder.damage)
        return Outcome(error is None, bool(rest) and error is not None, ends)


def _check_probe(data: bytes, expected: int) -> None:
    """Raise ContractError if `probe_stream` counts another number of frames."""
    try:
        frames = probe_stream(data).frames
    except FbaError:
        frames = 0
    if frames != expected:
        raise ContractError(f"probe counts {frames} frames, the decoder {expected}")


def compare(data: bytes) -> None:
    """Compare the decoder's planes with those of the independent reader, as far as both read.

    Raises ContractError.
    """
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        ours = plane_records(_good_frames(data))
        reader = independent_planes(data)
        for number, record in enumerate(ours):
            try:
                other = next(reader, None)
            except FbaError as error:
                if "object_mask" in str(error) and number:  # a second object, which it does not read
                    return
                raise ContractError(f"the independent reader stops at plane {number}: {error}") from error
            if other is None:
                return  # it reads only one object, and checks alignment more strictly
            expected = {
                "intra": other["intra"],
                "skip": other["skip"],
                "bits": other["bits"],
                "fap": {str(number): value for number, value in other["fap"].items()},
                "viseme": other["viseme"],
                "expression": other["expression"],
                "bap": {str(number): value for number, value in other["bap"].items()},
            }
            mine = {name: record[name] for name in expected}
            if mine != expected:
                wrong = [name for name in expected if mine[name] != expected[name]]
                raise ContractError(f"plane {number}: {wrong} differ from the independent reader's")


def _good_frames(data: bytes) -> list[Frame]:
    """Return the frames before the first damage."""
    decoder = Decoder()
    frames: list[Frame] = []
    try:
        frames += decoder.push(data)
        frames += decoder.finish()
    except FbaError as error:
        frames += [frame for block in getattr(error, "blocks", None) or [] for frame in block.frames()]
    return frames


def _error_position(error: FbaError | None) -> tuple[object, ...]:
    """Return type, plane and bit of an error."""
    return type(error), getattr(error, "plane", None), getattr(error, "bit", None)


def _decode(
    data: bytes, stops: Sequence[int], mode: str
) -> tuple[list[_DecodedFrame], FbaError | None, Decoder]:
    """Decode data in chunks that end at `stops`; return the frames, the error and the decoder."""
    decoder = Decoder(on_error=mode)  # type: ignore[arg-type]
    frames: list[_DecodedFrame] = []
    start = 0
    try:
        for stop in stops:
            frames += _frames(decoder.push_blocks(data[start:stop]))
            start = stop
        frames += _frames(decoder.finish_blocks())
    except FbaError as error:
        frames += _frames(getattr(error, "blocks", None) or [])
        return frames, error, decoder
    return frames, None, decoder


class _DecodedFrame(NamedTuple):
    """A decoded frame: its first bit in the stream, the bit behind it, its time, and a digest of the rest."""

    bit: int
    end: int
    shown: tuple[int, Fraction]
    content: int


def _without_times(frames: list[_DecodedFrame]) -> list[tuple[int, int, int]]:
    """Return the frames without their times: salvaging, it may not believe time codes and rates."""
    return [(frame.bit, frame.end, frame.content) for frame in frames]


def _frames(blocks: list[Block]) -> list[_DecodedFrame]:
    """Return the frames, independent of their division into blocks.

    Constructs the data model, which checks the values.
    """
    frames: list[_DecodedFrame] = []
    for block in blocks:
        Animation(block.rate, block.index, block.face, block.body)
        tracks: list[tuple[int, np.ndarray]] = []
        if block.face is not None:
            face = block.face
            tracks += [(FAP_BIT, one) for one in (face.values, face.mask, face.viseme, face.expression)]
        if block.body is not None:
            tracks += [(BAP_BIT, one) for one in (block.body.values, block.body.mask)]
        parts, borders = block.parts.tolist(), block.borders.tolist()
        for position, index in enumerate(block.index.tolist()):
            carried = parts[position]
            values = tuple((part, track[position].tobytes()) for part, track in tracks if carried & part)
            content = hash((carried, values))
            frames.append(
                _DecodedFrame(borders[position], borders[position + 1], (index, block.rate), content)
            )
    return frames
