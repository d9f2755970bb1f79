"""Fuzz the decoder with mutated streams.

`python -m fba_conformance.fuzz --count 100000 --seed 7 [STREAM.fba ...]` mutates small streams made here (or
the files named) and checks the contract of the decoder, in both modes:

- it raises an `FbaError` or returns an animation that is valid; it never raises another exception;
- frames and errors do not depend on the chunks in which the stream comes;
- in salvage mode it returns all frames before the damage, and lists damage in order, within the stream;
- sometimes: its values are those of the independent reader (`fba_conformance.trace`).

A stream depends on the seed and its number only: a finding prints the command that repeats it.
"""

from __future__ import annotations

import argparse
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import NamedTuple

import numpy as np

from fba.animation import Animation, FaceTrack
from fba.codec import Block, Decoder, EncoderOptions, encode, probe_stream
from fba.errors import FbaError, FbaWarning
from fba_conformance import _motion as motion
from fba_conformance.runner import plane_records
from fba_conformance.trace import planes as independent_planes

START_CODES = (
    b"\0\0\1\xba",
    b"\0\0\1\xbb",
    b"\0\0\1\xb1",
    b"\0\0\1\x01",
    b"\0\0\1\x03",
    b"\0\0\1\xb3",
    b"\0\0\1",
)
COMPARED_BYTES = 600
"""Largest stream that is compared: the independent reader takes a second for a few kilobytes."""


class ContractError(AssertionError):
    """The decoder broke its contract; the text says how."""


@dataclass(frozen=True)
class Finding:
    """A stream for which the decoder broke its contract. seed and number reproduce it."""

    seed: int
    number: int
    data: bytes
    reason: str


@dataclass
class Report:
    """Counts of a run. slowest: number of the stream that took longest, `worst` seconds."""

    count: int = 0
    decoded: int = 0
    refused: int = 0
    salvaged: int = 0
    compared: int = 0
    worst: float = 0.0
    slowest: int = -1
    findings: list[Finding] = field(default_factory=list)

    def line(self) -> str:
        """Return the counts in one line."""
        return (
            f"{self.count} streams: {self.decoded} decoded whole, {self.refused} refused, of these "
            f"{self.salvaged} salvaged in part; {self.compared} compared with the independent reader; "
            f"slowest {1000 * self.worst:.0f} ms (number {self.slowest}); {len(self.findings)} findings"
        )


def base_streams() -> list[bytes]:
    """Return small streams, tens to hundreds of bytes, that together have every element of the syntax."""
    few_faps = (3, 5, 19, 20, 48)
    face = motion.face(5, faps_sent=few_faps)
    talking = motion.face(4, faps_sent=(3, 4), high_level=True)
    body = motion.body(5, baps_sent=(1, 19, 124, 181, 186))
    mask = face.mask.copy()
    mask[2:4] = False
    gaps = FaceTrack(face.values, mask)
    make = motion.animation
    every_other: dict[str, object] = {"intra_period": Fraction(2, 25), "start_codes": True}
    made: list[tuple[Animation, dict[str, object]]] = [
        (make(face), {}),
        (make(talking), {"fap_quant": 9}),
        (make(None, body), {"bap_quant": 3}),
        (make(motion.face(5, faps_sent=few_faps, high_level=True), body), every_other),
        (make(gaps, body), every_other),
        (make(gaps, body), {}),
        (make(motion.face(6, faps_sent=(3,))), every_other),
        (make(motion.face(4, faps_sent=())), {"intra_period": Fraction(1, 25)}),
        (make(face, rate=Fraction(30000, 1001), index=[0, 1, 16, 17, 300]), {"unsent": "interpolate"}),
        (make(face, index=[75, 76, 77, 80, 81]), {"gender": 1, "fap_quant": 31}),
        (make(None, motion.body(3, baps_sent=(187, 208, 296))), {"bap_quant": 0}),
        (make(FaceTrack(np.zeros_like(face.values), face.mask)), every_other),
    ]
    streams = [encode(animation, EncoderOptions(**options)) for animation, options in made]  # type: ignore[arg-type]
    streams.append(streams[0] + streams[2])
    streams.append(streams[0].removesuffix(START_CODES[2]))
    streams.append(b"\0\0\1\x01\0\0\1\x03" + streams[1][4:])
    return streams


def mutate(streams: Sequence[bytes], random: Random) -> bytes:
    """Return one of the streams with one to four mutations.

    Mutations flip a bit, change, insert, delete or repeat bytes, insert a start code, cut the end off, or
    append the end of another stream.
    """
    data = bytearray(random.choice(streams))
    for _ in range(random.choice((1, 1, 1, 2, 2, 3, 4))):
        random.choice(_MUTATIONS)(data, random, streams)
    return bytes(data)


def _flip(data: bytearray, random: Random, _: Sequence[bytes]) -> None:
    if data:
        bit = random.randrange(8 * len(data))
        data[bit >> 3] ^= 128 >> (bit & 7)


def _change(data: bytearray, random: Random, _: Sequence[bytes]) -> None:
    if data:
        data[random.randrange(len(data))] = random.choice((0, 0xFF, 0x7F, 0x80, 1, random.randrange(256)))


def _insert(data: bytearray, random: Random, _: Sequence[bytes]) -> None:
    position = random.randrange(len(data) + 1)
    byte = random.choice((0, 0xFF, random.randrange(256)))
    data[position:position] = bytes([byte]) * random.choice((1, 1, 2, 3, 40))


def _delete(data: bytearray, random: Random, _: Sequence[bytes]) -> None:
    position = random.randrange(len(data) + 1)
    del data[position : position + random.choice((1, 1, 2, 5, 30))]


def _double(data: bytearray, random: Random, _: Sequence[bytes]) -> None:
    position = random.randrange(len(data) + 1)
    piece = data[position : position + random.choice((1, 2, 4, 8, 50))]
    target = random.randrange(len(data) + 1)
    data[target:target] = piece * random.choice((1, 1, 3))


def _truncate(data: bytearray, random: Random, _: Sequence[bytes]) -> None:
    del data[random.randrange(len(data) + 1) :]


def _splice(data: bytearray, random: Random, streams: Sequence[bytes]) -> None:
    other = random.choice(streams)
    data[random.randrange(len(data) + 1) :] = other[random.randrange(len(other) + 1) :]


def _start_code(data: bytearray, random: Random, _: Sequence[bytes]) -> None:
    position = random.randrange(len(data) + 1)
    data[position : position + random.choice((0, 0, 4))] = random.choice(START_CODES)


_MUTATIONS: tuple[Callable[[bytearray, Random, Sequence[bytes]], None], ...] = (
    _flip, _flip, _flip, _change, _insert, _delete, _double, _truncate, _splice, _start_code,
)  # fmt: skip


def fuzz(
    count: int,
    seed: int = 0,
    *,
    streams: Sequence[bytes] | None = None,
    first: int = 0,
    compare_every: int = 50,
) -> Report:
    """Check the mutations first..first + count of a seed.

    compare_every: compare every `compare_every`-th one with the independent reader; 0 for none.
    """
    streams = base_streams() if streams is None else streams
    report = Report()
    for number in range(first, first + count):
        random = Random(f"{seed} {number}")
        data = mutate(streams, random)
        begin = time.perf_counter()
        try:
            complete, salvaged = check(data, random)
            report.decoded += complete
            report.refused += not complete
            report.salvaged += salvaged
            if compare_every and number % compare_every == 0 and len(data) <= COMPARED_BYTES:
                report.compared += 1
                compare(data)
        except Exception:  # any other exception is a finding
            report.findings.append(Finding(seed, number, data, traceback.format_exc(limit=-4)))
        seconds = time.perf_counter() - begin
        if seconds > report.worst:
            report.worst, report.slowest = seconds, number
        report.count += 1
    return report


def check(data: bytes, random: Random) -> tuple[bool, bool]:
    """Check the decoder's contract on one stream; return whether it was decoded, else whether salvaged.

    Raises ContractError.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FbaWarning)
        blocks, error, _ = _decode(data, [len(data)], "raise")
        ours = _frames(blocks)
        cuts = sorted(random.randrange(len(data) + 1) for _ in range(random.choice((1, 2, 8))))
        if random.random() < 0.5:  # the salvaging decoder always gets chunks
            chunked, chunked_error, _ = _decode(data, [*cuts, len(data)], "raise")
            if _error_position(error) != _error_position(chunked_error):
                raise ContractError(f"in chunks {cuts}: {chunked_error}; at once: {error}")
            if ours != _frames(chunked):
                raise ContractError(f"other frames in chunks {cuts} than at once")
        salvaged, fatal, decoder = _decode(data, [*cuts, len(data)], "salvage")
        if fatal is not None and (salvaged or not decoder.damage):
            raise ContractError(f"a salvaging decoder raised {fatal!r}")
        rest = _frames(salvaged)
        earlier = rest and ours and rest[0].bit < ours[0].bit  # began without an object start code
        if rest[: len(ours)] != ours and not earlier:
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
        if salvaged:
            _check_tracks(salvaged)
        if random.random() < 0.2:
            _check_probe(data, len(rest))
        return error is None, bool(rest) and error is not None


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
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FbaWarning)
        blocks, _, _ = _decode(data, [len(data)], "raise")
        ours = plane_records([frame for block in blocks for frame in block.frames()])
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


def _error_position(error: FbaError | None) -> tuple[object, ...]:
    """Return type, plane and bit of an error."""
    return type(error), getattr(error, "plane", None), getattr(error, "bit", None)


def _decode(data: bytes, stops: Sequence[int], mode: str) -> tuple[list[Block], FbaError | None, Decoder]:
    """Decode data in chunks that end at `stops`; return blocks, error and decoder."""
    decoder = Decoder(on_error=mode)  # type: ignore[arg-type]
    blocks: list[Block] = []
    start = 0
    try:
        for stop in stops:
            blocks += decoder.push_blocks(data[start:stop])
            start = stop
        blocks += decoder.finish_blocks()
    except FbaError as error:
        blocks += getattr(error, "blocks", None) or []
        return blocks, error, decoder
    return blocks, None, decoder


class _DecodedFrame(NamedTuple):
    """A decoded frame: its first bit in the stream, and everything else about it."""

    bit: int
    content: tuple[object, ...]


def _frames(blocks: list[Block]) -> list[_DecodedFrame]:
    """Return the frames, independent of their division into blocks."""
    frames: list[_DecodedFrame] = []
    for block in blocks:
        tracks = []
        if block.face is not None:
            tracks += [block.face.values, block.face.mask, block.face.viseme, block.face.expression]
        if block.body is not None:
            tracks += [block.body.values, block.body.mask]
        for position, index in enumerate(block.index.tolist()):
            after = int(block.borders[position + 1])
            values = tuple(track[position].tobytes() for track in tracks)
            frames.append(_DecodedFrame(int(block.borders[position]), (index, block.rate, after, *values)))
    return frames


def _check_tracks(blocks: list[Block]) -> None:
    """Construct the data model from copies of the blocks' frames, which checks them."""
    for block in blocks:
        face, body = block.face, block.body
        if face is not None:
            FaceTrack(face.values.copy(), face.mask.copy(), face.viseme.copy(), face.expression.copy())
        if body is not None:
            type(body)(body.values.copy(), body.mask.copy())
        Animation(block.rate, block.index, face, body)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return 1 if there were findings."""
    parser = argparse.ArgumentParser(
        prog="python -m fba_conformance.fuzz", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("--count", type=int, default=20_000, help="mutations (default 20000)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, metavar="NUMBER", help="number of the first mutation")
    parser.add_argument(
        "--compare-every",
        type=int,
        default=50,
        metavar="N",
        help="compare every N-th with the independent reader; 0: none (default 50)",
    )
    parser.add_argument("--save", type=Path, metavar="FOLDER", help="save streams with findings here")
    parser.add_argument("streams", nargs="*", type=Path, help="streams to mutate instead of those made here")
    options = parser.parse_args(arguments)
    streams = [path.read_bytes() for path in options.streams] or None
    report = fuzz(
        options.count, options.seed, streams=streams, first=options.first, compare_every=options.compare_every
    )
    for finding in report.findings:
        sys.stdout.write(
            f"\n{finding.reason}\nto repeat: python -m fba_conformance.fuzz --seed {finding.seed} "
            f"--first {finding.number} --count 1 --compare-every 1 {' '.join(map(str, options.streams))}\n"
        )
        if options.save:
            options.save.mkdir(parents=True, exist_ok=True)
            (options.save / f"seed{finding.seed}_{finding.number}.fba").write_bytes(finding.data)
    sys.stdout.write(report.line() + "\n")
    return 1 if report.findings else 0


if __name__ == "__main__":
    raise SystemExit(main())
