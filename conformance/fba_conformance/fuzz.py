"""Seeded damage: mutated streams against what a decoder owes to bad input.

`python -m fba_conformance.fuzz --count 100000 --seed 7 [STREAM.fba ...]` mutates small streams made here (or
the files named) and holds the decoder to its contract, in both modes:

- an `FbaError`, or an animation that its own constructor accepts; never another exception;
- the same frames and the same error whatever the chunks that the stream comes in;
- in salvage mode all frames before the damage, and damage listed in order, within the stream;
- now and then, the values that the independent reader (`fba_conformance.trace`) finds.

Every stream is made from the seed and its number alone: a finding names the command that repeats it.
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
"""Larger streams are not read by the independent reader, which takes a second for some kilobytes."""


class ContractError(AssertionError):
    """The decoder did something that it must not do; the text says what."""


@dataclass(frozen=True)
class Finding:
    """A stream that broke the contract. number: of the mutation, with its seed enough to make it again."""

    seed: int
    number: int
    data: bytes
    reason: str


@dataclass
class Report:
    """What became of the streams. slowest: number of that which took longest, `worst` seconds."""

    count: int = 0
    decoded: int = 0
    refused: int = 0
    salvaged: int = 0
    compared: int = 0
    worst: float = 0.0
    slowest: int = -1
    findings: list[Finding] = field(default_factory=list)

    def line(self) -> str:
        """The counts in one line."""
        return (
            f"{self.count} streams: {self.decoded} decoded whole, {self.refused} refused, of these "
            f"{self.salvaged} salvaged in part; {self.compared} compared with the independent reader; "
            f"slowest {1000 * self.worst:.0f} ms (number {self.slowest}); {len(self.findings)} findings"
        )


def base_streams() -> list[bytes]:
    """Small streams, tens to hundreds of bytes, which together have every element of the syntax."""
    some = (3, 5, 19, 20, 48)
    face = motion.face(5, faps_sent=some)
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
        (make(motion.face(5, faps_sent=some, high_level=True), body), every_other),
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


def mutated(streams: Sequence[bytes], random: Random) -> bytes:
    """One of the streams after one to four of: bits flipped, bytes changed, put in, taken out or doubled,
    start codes put in, the end cut off, another stream's end put on."""
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
    at = random.randrange(len(data) + 1)
    byte = random.choice((0, 0xFF, random.randrange(256)))
    data[at:at] = bytes([byte]) * random.choice((1, 1, 2, 3, 40))


def _delete(data: bytearray, random: Random, _: Sequence[bytes]) -> None:
    at = random.randrange(len(data) + 1)
    del data[at : at + random.choice((1, 1, 2, 5, 30))]


def _double(data: bytearray, random: Random, _: Sequence[bytes]) -> None:
    at = random.randrange(len(data) + 1)
    piece = data[at : at + random.choice((1, 2, 4, 8, 50))]
    to = random.randrange(len(data) + 1)
    data[to:to] = piece * random.choice((1, 1, 3))


def _truncate(data: bytearray, random: Random, _: Sequence[bytes]) -> None:
    del data[random.randrange(len(data) + 1) :]


def _splice(data: bytearray, random: Random, streams: Sequence[bytes]) -> None:
    other = random.choice(streams)
    data[random.randrange(len(data) + 1) :] = other[random.randrange(len(other) + 1) :]


def _start_code(data: bytearray, random: Random, _: Sequence[bytes]) -> None:
    at = random.randrange(len(data) + 1)
    data[at : at + random.choice((0, 0, 4))] = random.choice(START_CODES)


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
    """Check mutations number first..first + count of a seed. compare_every: how often with the
    independent reader; 0 for never."""
    streams = base_streams() if streams is None else streams
    report = Report()
    for number in range(first, first + count):
        random = Random(f"{seed} {number}")
        data = mutated(streams, random)
        begin = time.perf_counter()
        try:
            whole, salvaged = check(data, random)
            report.decoded += whole
            report.refused += not whole
            report.salvaged += salvaged
            if compare_every and number % compare_every == 0 and len(data) <= COMPARED_BYTES:
                report.compared += 1
                compare(data)
        except Exception:  # whatever it is: finding it is what this is for
            report.findings.append(Finding(seed, number, data, traceback.format_exc(limit=-4)))
        seconds = time.perf_counter() - begin
        if seconds > report.worst:
            report.worst, report.slowest = seconds, number
        report.count += 1
    return report


def check(data: bytes, random: Random) -> tuple[bool, bool]:
    """Hold the decoder to its contract on one stream: (decoded whole, else: salvaged in part)."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FbaWarning)
        blocks, error, _ = _decoded(data, [len(data)], "raise")
        ours = _flat(blocks)
        cuts = sorted(random.randrange(len(data) + 1) for _ in range(random.choice((1, 2, 8))))
        if random.random() < 0.5:  # the salvaging decoder gets the chunks anyway
            chunked, chunked_error, _ = _decoded(data, [*cuts, len(data)], "raise")
            if _place(error) != _place(chunked_error):
                raise ContractError(f"in chunks {cuts}: {chunked_error}; at once: {error}")
            if ours != _flat(chunked):
                raise ContractError(f"other frames in chunks {cuts} than at once")
        salvaged, fatal, decoder = _decoded(data, [*cuts, len(data)], "salvage")
        if fatal is not None and (salvaged or not decoder.damage):
            raise ContractError(f"a salvaging decoder raised {fatal!r}")
        rest = _flat(salvaged)
        earlier = rest and ours and rest[0].bit < ours[0].bit  # joined where no object start code stands
        if rest[: len(ours)] != ours and not earlier:
            raise ContractError(
                f"{len(rest)} frames salvaged that do not begin with the {len(ours)} good ones"
            )
        at = 0
        for damage in decoder.damage:
            if not at <= damage.start <= damage.stop <= len(data):
                raise ContractError(f"damage {damage} out of order or out of the stream ({len(data)} bytes)")
            at = damage.stop
        if error is not None and not decoder.damage:
            raise ContractError(f"{error} went unmentioned by the salvaging decoder")
        if salvaged:
            _animation(salvaged)
        if random.random() < 0.2:
            _check_probe(data, len(rest))
        return error is None, bool(rest) and error is not None


def _check_probe(data: bytes, expected: int) -> None:
    try:
        frames = probe_stream(data).frames
    except FbaError:
        frames = 0
    if frames != expected:
        raise ContractError(f"probe counts {frames} frames, the decoder {expected}")


def compare(data: bytes) -> None:
    """Hold the decoder's planes against those of the independent reader, as far as both go."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FbaWarning)
        blocks, _, _ = _decoded(data, [len(data)], "raise")
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
                return  # it reads one object, and stricter alignment
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


def _place(error: FbaError | None) -> tuple[object, ...]:
    return type(error), getattr(error, "plane", None), getattr(error, "bit", None)


def _decoded(data: bytes, stops: Sequence[int], mode: str) -> tuple[list[Block], FbaError | None, Decoder]:
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


class _Seen(NamedTuple):
    """Everything about a frame that was decoded; its first bit in the stream."""

    bit: int
    content: tuple[object, ...]


def _flat(blocks: list[Block]) -> list[_Seen]:
    """The frames, however the blocks are cut."""
    frames: list[_Seen] = []
    for block in blocks:
        tracks = []
        if block.face is not None:
            tracks += [block.face.values, block.face.mask, block.face.viseme, block.face.expression]
        if block.body is not None:
            tracks += [block.body.values, block.body.mask]
        for position, index in enumerate(block.index.tolist()):
            after = int(block.borders[position + 1])
            values = tuple(track[position].tobytes() for track in tracks)
            frames.append(_Seen(int(block.borders[position]), (index, block.rate, after, *values)))
    return frames


def _animation(blocks: list[Block]) -> None:
    """Whether the blocks' frames are what the constructors of the data model accept."""
    for block in blocks:
        face, body = block.face, block.body
        if face is not None:
            FaceTrack(face.values.copy(), face.mask.copy(), face.viseme.copy(), face.expression.copy())
        if body is not None:
            type(body)(body.values.copy(), body.mask.copy())
        Animation(block.rate, block.index, face, body)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line; 1 where there were findings."""
    parser = argparse.ArgumentParser(
        prog="python -m fba_conformance.fuzz", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("--count", type=int, default=20_000, help="mutations (default 20000)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, metavar="NUMBER", help="number of the first mutation")
    parser.add_argument(
        "--compare-every", type=int, default=50, metavar="N", help="with the independent reader"
    )
    parser.add_argument("--save", type=Path, metavar="FOLDER", help="where to keep streams that were found")
    parser.add_argument("streams", nargs="*", type=Path, help="streams to mutate instead of those made here")
    chosen = parser.parse_args(arguments)
    streams = [path.read_bytes() for path in chosen.streams] or None
    report = fuzz(
        chosen.count, chosen.seed, streams=streams, first=chosen.first, compare_every=chosen.compare_every
    )
    for finding in report.findings:
        sys.stdout.write(
            f"\n{finding.reason}\nto repeat: python -m fba_conformance.fuzz --seed {finding.seed} "
            f"--first {finding.number} --count 1 --compare-every 1 {' '.join(map(str, chosen.streams))}\n"
        )
        if chosen.save:
            chosen.save.mkdir(parents=True, exist_ok=True)
            (chosen.save / f"seed{finding.seed}_{finding.number}.fba").write_bytes(finding.data)
    sys.stdout.write(report.line() + "\n")
    return 1 if report.findings else 0


if __name__ == "__main__":
    raise SystemExit(main())
