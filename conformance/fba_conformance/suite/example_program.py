"""Our decoders and our encoder as programs that the suite tests: examples for programs of your own.

::

    fba conformance --decoder 'python -m fba_conformance.suite.example_program decode {in} {out}'

Add --textbook for the independent decoder. docs/test-a-codec.md has the encoder's command.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Iterable, Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np

from fba.animation import Animation, BodyTrack, FaceTrack
from fba.codec import Damage, Decoder, EncoderOptions, encode_animation
from fba.errors import FbaError, FbaWarning
from fba.parameters import BAP_COUNT, BAP_STEP_TABLES, EXPRESSION_FIELDS, FAP_COUNT, VISEME_FIELDS, BapTable
from fba_conformance._values import HEADER, Listing, PlaneValues, block_values, read_values, trace_values
from fba_conformance.trace import planes


def decode_textbook(data: bytes, bap_steps: BapTable) -> Iterator[str]:
    """Yield the lines of a listing from the independent decoder, which stops at damage."""
    yield HEADER
    try:
        for plane in planes(data, bap_steps=bap_steps):
            yield from trace_values([plane])[0].lines()
    except FbaError as error:
        yield f"error {error}"
    yield "end"


def decode_codec(data: bytes, bap_steps: BapTable) -> Iterator[str]:
    """Yield the lines of a listing from this codec, which goes on behind damage."""
    decoder = Decoder(bap_steps=bap_steps, on_error="salvage")
    damages: list[Damage] = []
    yield HEADER
    try:
        for start in range(len(data)):  # byte by byte, so that damage is listed where it is
            blocks = decoder.push_blocks(data[start : start + 1])
            yield from _damage_lines(decoder, damages)
            yield from _lines(block_values(blocks))
        blocks = decoder.finish_blocks()
        yield from _damage_lines(decoder, damages)
        yield from _lines(block_values(blocks))
    except FbaError as error:
        yield f"error {error}"
    yield "end"


def _damage_lines(decoder: Decoder, damages: list[Damage]) -> Iterator[str]:
    """Yield a line for each damage that is not in a list yet, and add it."""
    new = decoder.damage[len(damages) :]
    damages += new
    yield from (f"error {' '.join(str(damage.error).split())}" for damage in new)


def _lines(values: Iterable[PlaneValues]) -> Iterator[str]:
    for plane in values:
        yield from plane.lines()


def animation_of(listing: Listing, rate: Fraction) -> Animation:
    """Return the animation that a listing describes; a plane shows until the next."""
    count = len(listing.planes)
    index = [round((plane.time or Fraction(0)) * rate) for plane in listing.planes]
    face_values, face_mask = np.zeros((count, FAP_COUNT), np.int32), np.zeros((count, FAP_COUNT), bool)
    viseme = np.zeros((count, len(VISEME_FIELDS)), np.int16)
    expression = np.zeros((count, len(EXPRESSION_FIELDS)), np.int16)
    body_values, body_mask = np.zeros((count, BAP_COUNT), np.int32), np.zeros((count, BAP_COUNT), bool)
    for row, plane in enumerate(listing.planes):
        for column, fields, high in ((0, plane.viseme, viseme), (1, plane.expression, expression)):
            if fields is not None:
                face_mask[row, column], high[row] = True, fields
        for number, value in plane.fap.items():
            face_mask[row, number - 1], face_values[row, number - 1] = True, value
        for number, value in plane.bap.items():
            body_mask[row, number - 1], body_values[row, number - 1] = True, value
    body = BodyTrack(body_values, body_mask) if body_mask.any() else None
    face = FaceTrack(face_values, face_mask, viseme, expression) if face_mask.any() or body is None else None
    return Animation(rate, np.array(index), face, body)


def main() -> None:
    """Decode or encode a file; exit status 1 where that fails."""
    parser = argparse.ArgumentParser(
        prog="python -m fba_conformance.suite.example_program", description=__doc__
    )
    commands = parser.add_subparsers(dest="command", required=True)
    for name in ("decode", "encode"):
        command = commands.add_parser(name)
        command.add_argument("input", type=Path)
        command.add_argument("output", type=Path)
        command.add_argument("--bap-steps", choices=BAP_STEP_TABLES, default="iso")
        if name == "decode":
            command.add_argument("--textbook", action="store_true", help="the independent decoder")
        else:
            command.add_argument("--rate", type=Fraction, default=Fraction(25))
            command.add_argument("--fap-quant", type=int, default=1)
            command.add_argument("--bap-quant", type=int, default=1)
    arguments = parser.parse_args()
    warnings.simplefilter("ignore", FbaWarning)
    if arguments.command == "decode":
        decode = decode_textbook if arguments.textbook else decode_codec
        lines = decode(arguments.input.read_bytes(), arguments.bap_steps)
        arguments.output.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
        return
    options = EncoderOptions(
        fap_quant=arguments.fap_quant,
        bap_quant=arguments.bap_quant,
        bap_steps=arguments.bap_steps,
        mark=False,
    )
    try:
        animation = animation_of(read_values(arguments.input.read_text(encoding="utf-8")), arguments.rate)
        arguments.output.write_bytes(encode_animation(animation, options)[0])
    except FbaError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
