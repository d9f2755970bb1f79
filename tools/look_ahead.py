"""Do readers that look ahead for start codes in another way find the same planes in our streams?

Encodes random animations of few parameters, with values that jump between round numbers, because these make
planes of many zeros. An independent reader reads each stream as `fba.decode` does, and looks before each
plane in the byte-aligned way, too: where both see the same before every plane, both read the same planes.
`python -m tools.look_ahead --planes 1000000` tries as many planes.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Iterator
from fractions import Fraction
from random import Random

import numpy as np

from fba import Animation, BodyTrack, Encoder, EncoderOptions, FaceTrack, FbaError, FbaWarning
from fba.parameters import BAP_COUNT, FAP_COUNT, bap_steps, baps, faps
from fba_conformance.trace import Walker

_JUMPS = (0, 0, 0, 0, 1, 1, -1, 31, 60, 100, 300, 600, 900, -600, -900)
"""Levels of values, in steps of the parameter's table."""


def random_animation(random: Random) -> Animation:
    """Return 2 to 40 frames of a face, a body or both, with skips, and masks that change now and then."""
    count = random.randint(2, 40)
    parts = random.choice((1, 1, 2, 2, 3))
    index = np.cumsum([random.choice((1, 1, 1, 1, 2, 16, 17, 31, 300)) for _ in range(count)])
    face = _face(random, count) if parts & 1 else None
    body = _body(random, count) if parts & 2 else None
    return Animation(Fraction(25), index - index[0], face, body)


def random_options(random: Random) -> EncoderOptions:
    """Return options that vary all that moves planes by some bits."""
    return EncoderOptions(
        fap_quant=random.choice((0, 1, 1, 1, 4, 31)),
        bap_quant=random.choice((0, 1, 1, 1, 4, 31)),
        intra_period=random.choice((None, None, Fraction(1, 25), Fraction(3, 25))),
        start_codes=random.random() < 0.3,
        clamp=True,
        mark=False,
    )


def encoded(animation: Animation, options: EncoderOptions, random: Random) -> bytes:
    """Return the stream, encoded in pieces of random length."""
    encoder = Encoder(options)
    pieces = []
    start = 0
    while start < len(animation):
        stop = start + random.choice((1, 1, 2, 5, 40))
        pieces.append(encoder.push_animation(animation[start:stop]))
        start = stop
    pieces.append(encoder.finish())
    return b"".join(pieces)


def planes_read(data: bytes, *, byte_aligned: bool) -> Iterator[tuple[object, ...]]:
    """Yield what the independent reader finds in each plane."""
    walker = Walker(data, byte_aligned=byte_aligned)
    before = 0
    while walker.step():
        walker.reader.drain()
        if walker.count > before:
            before = walker.count
            record = walker.record
            yield tuple(
                record[name] for name in ("bit", "bits", "fap", "viseme", "expression", "bap", "skip")
            )


def difference(seed: str) -> tuple[int, str]:
    """Return the number of planes of one random stream, and how its readings differ: "" if they do not."""
    random = Random(seed)
    animation = random_animation(random)
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        data = encoded(animation, random_options(random), random)
    walker = Walker(data)
    try:
        while walker.step():
            walker.reader.drain()
    except FbaError as error:
        return len(animation), str(error)
    if walker.count != len(animation):
        return len(animation), f"{len(animation)} frames, {walker.count} planes"
    if walker.reader.disputed is not None:
        return len(animation), f"bit {walker.reader.disputed} reads otherwise at the byte boundary"
    return len(animation), ""


def compare(planes: int, seed: int = 0) -> tuple[int, int, list[str]]:
    """Compare the readings of random streams with that many planes in all.

    Returns the numbers of streams and planes, and a line for each stream that is read in two ways.
    """
    streams = count = 0
    lines = []
    while count < planes:
        name = f"{seed} {streams}"
        found, reason = difference(name)
        streams += 1
        count += found
        if reason:
            lines.append(f"stream {name}: {reason}")
    return streams, count, lines


def main() -> None:
    """Compare, and print what differs; exit status 1 if anything does."""
    parser = argparse.ArgumentParser(prog="python -m tools.look_ahead", description=__doc__)
    parser.add_argument("--planes", type=int, default=10_000, help="number of planes (default 10000)")
    parser.add_argument("--seed", type=int, default=0, help="number of the series of streams (default 0)")
    arguments = parser.parse_args()
    streams, planes, lines = compare(arguments.planes, arguments.seed)
    for line in [*lines, f"{streams} streams, {planes} planes: {len(lines)} differ"]:
        sys.stdout.write(f"{line}\n")
    raise SystemExit(bool(lines))


def _face(random: Random, count: int) -> FaceTrack:
    """Return a face that sends a few FAPs; now and then viseme and expression, and now and then nothing."""
    columns = random.sample(range(2, FAP_COUNT), random.choice((0, 1, 1, 2, 3, 5)))
    values = np.zeros((count, FAP_COUNT), dtype=np.int32)
    for column in columns:
        step = faps()[column].step
        values[:, column] = [random.choice(_JUMPS) * step for _ in range(count)]
    mask = np.zeros((count, FAP_COUNT), dtype=bool)
    mask[:, columns] = True
    viseme, expression = np.zeros((count, 4), dtype=np.int16), np.zeros((count, 6), dtype=np.int16)
    if random.random() < 0.3:
        mask[:, 0] = True
        viseme[:, 2] = [random.choice((0, 0, 63)) for _ in range(count)]
    if random.random() < 0.3:
        mask[:, 1] = True
        expression[:, 1] = [random.choice((0, 0, 63)) for _ in range(count)]
    if random.random() < 0.3:
        mask[random.randrange(count) :] = False
    return FaceTrack(values, mask, viseme, expression)


def _body(random: Random, count: int) -> BodyTrack:
    """Return a body that sends a few BAPs; now and then nothing."""
    columns = random.sample([bap.number - 1 for bap in baps()[:186]], random.choice((0, 1, 1, 2, 3, 5)))
    values = np.zeros((count, BAP_COUNT), dtype=np.int32)
    step = bap_steps("iso")
    for column in columns:
        values[:, column] = [random.choice(_JUMPS) * int(step[column]) for _ in range(count)]
    mask = np.zeros((count, BAP_COUNT), dtype=bool)
    mask[:, columns] = True
    if random.random() < 0.3:
        mask[random.randrange(count) :] = False
    return BodyTrack(values, mask)


if __name__ == "__main__":
    main()
