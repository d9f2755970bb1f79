"""Run this codec over test vectors: decoded values and encoded bytes must be exact."""

from __future__ import annotations

import time
import warnings
from dataclasses import replace

from fba.animation import Animation, Frame
from fba.codec import Block, Decoder, PlaneSettings, encode_planes
from fba.errors import BitstreamError, FbaError, FbaWarning, FormatError, UnsupportedError
from fba.parameters import BapTable
from fba_conformance._values import Listing, block_values, trace_values
from fba_conformance.suite.index import Vector
from fba_conformance.suite.result import Result
from fba_conformance.trace import planes


def check(vector: Vector) -> Result:
    """Decode a vector and, if its bytes can be reproduced, encode it again."""
    begin = time.perf_counter()
    try:
        with warnings.catch_warnings(action="ignore", category=FbaWarning):
            result = _check_damaged(vector) if vector.damaged else _check_valid(vector)
    except (FbaError, OSError) as error:
        result = Result(vector.name, False, None, str(error))
    return replace(result, group=vector.group, optional=vector.optional, seconds=time.perf_counter() - begin)


def expected_listing(vector: Vector) -> Listing:
    """Return what a decoder must find in a vector.

    That is the listing beside the stream; without one, what this codec finds, if its digest is that of the
    index (or if it agrees with the files that the index names), or else the independent decoder. Raises
    FormatError if nothing agrees.
    """
    listing = vector.listing()
    if listing is not None:
        return listing
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        try:
            listing = _codec_listing(vector)
        except FbaError:
            listing = None
        if "values" not in vector.entry:
            result = check(vector)
            if listing is None or not result.decoded:
                raise FormatError(f"this codec does not decode it: {result.message}", path=vector.name)
            return Listing([plane.without_time() for plane in listing.planes])
        if listing is not None and listing.digest() == vector.entry["values"]:
            return listing
        if not vector.damaged:
            listing = independent_listing(vector)
            if listing.digest() == vector.entry["values"]:
                return listing
    raise FormatError("no decoder here finds the values whose digest is in index.json", path=vector.name)


def independent_listing(vector: Vector) -> Listing:
    """Return what the independent decoder finds in a valid stream. Raises as `trace` does."""
    found = planes(vector.data(), bap_steps=vector.bap_steps)
    return Listing(trace_values(found, times=vector.times))


def decode_blocks(data: bytes, bap_steps: BapTable) -> tuple[list[Block], FbaError | None]:
    """Return the planes before the first damage, and its error; None if the stream is whole."""
    decoder = Decoder(bap_steps=bap_steps)
    blocks: list[Block] = []
    try:
        blocks += decoder.push_blocks(data)
        blocks += decoder.finish_blocks()
    except (BitstreamError, UnsupportedError) as error:
        held = error.blocks if isinstance(error, BitstreamError) else ()
        return [*blocks, *held], error
    return blocks, None


def salvage_blocks(data: bytes, bap_steps: BapTable) -> list[Block]:
    """Return the planes that a salvaging decoder finds."""
    decoder = Decoder(bap_steps=bap_steps, on_error="salvage")
    return [*decoder.push_blocks(data), *decoder.finish_blocks()]


def _codec_listing(vector: Vector) -> Listing:
    """Return what this codec decodes from a vector."""
    if vector.damaged:
        blocks = salvage_blocks(vector.data(), vector.bap_steps)
        return Listing(block_values(blocks, times=vector.times), vector.planes_before)
    blocks, error = decode_blocks(vector.data(), vector.bap_steps)
    if error is not None:
        raise error
    return Listing(block_values(blocks, times=vector.times))


def _check_damaged(vector: Vector) -> Result:
    """Return the result of a damaged stream: the error must be the expected one, and so what is salvaged."""
    expected = vector.entry["error"]
    blocks, error = decode_blocks(vector.data(), vector.bap_steps)
    before = sum(len(block.index) for block in blocks)
    if error is None:
        return Result(vector.name, False, None, f"no error, expected one in plane {expected['plane']}")
    kind = "unsupported" if isinstance(error, UnsupportedError) else "damaged"
    assert isinstance(error, BitstreamError | UnsupportedError)
    if (kind, error.plane, before) != (expected["kind"], expected["plane"], expected["plane"]):
        text = f"{before} planes, then {kind} in plane {error.plane}, expected {expected['kind']} in plane"
        return Result(vector.name, False, None, f"{text} {expected['plane']}: {error}")
    return _check_digest(vector, _codec_listing(vector))


def _check_valid(vector: Vector) -> Result:
    """Return the result of a valid stream."""
    data = vector.data()
    blocks, error = decode_blocks(data, vector.bap_steps)
    if error is not None:
        raise error
    if "values" in vector.entry:
        result = _check_digest(vector, Listing(block_values(blocks, times=vector.times)))
        if not result.decoded:
            return result
    else:
        frames = [frame for block in blocks for frame in block.frames()]
        wrong = _check_files(vector, frames)
        if wrong:
            return Result(vector.name, False, None, wrong)
    if not vector.entry.get("same_bytes", False):
        return Result(vector.name, True, None)
    again = _encode(vector, [frame for block in blocks for frame in block.frames()])
    if again == data:
        return Result(vector.name, True, True)
    pairs = enumerate(zip(again, data, strict=False))
    position = next((i for i, (ours, theirs) in pairs if ours != theirs), min(len(again), len(data)))
    text = f"{len(again)} bytes, expected {len(data)}; they differ from byte {position} on"
    return Result(vector.name, True, False, text)


def _check_digest(vector: Vector, found: Listing) -> Result:
    """Return the result of decoded values against the digest in the index."""
    if found.digest() == vector.entry["values"]:
        return Result(vector.name, True, None)
    text = f"{len(found.planes)} planes, expected {vector.entry['planes']}"
    if len(found.planes) == vector.entry["planes"]:
        text = "the decoded values differ"
        if not vector.damaged:
            text = independent_listing(vector).difference(found) or text
    return Result(vector.name, False, None, text)


def _check_files(vector: Vector, frames: list[Frame]) -> str:
    """Return how decoded frames differ from the files of another decoder, or ""."""
    from fba.formats.text.bap import read_bap
    from fba.formats.text.fap import read_fap

    animation = Animation.from_frames(frames)
    for key, reader in (("decoded_fap", read_fap), ("decoded_bap", read_bap)):
        path = vector.path(key)
        if path is None:
            continue
        expected = reader(path)
        ours, theirs = (
            (animation.face, expected.face) if key == "decoded_fap" else (animation.body, expected.body)
        )
        if ours is None or theirs is None or len(ours) != len(theirs):
            return f"{0 if ours is None else len(ours)} planes, expected {len(expected)} ({path.name})"
        if ours != theirs:
            return f"the decoded values differ from {path.name}"
    return ""


def _encode(vector: Vector, frames: list[Frame]) -> bytes:
    """Return the stream encoded again, from its EPF file and source or from the decoded planes."""
    from fba.formats import merge
    from fba.formats.epf.epf import read_epf
    from fba.formats.text.bap import read_bap
    from fba.formats.text.fap import read_fap

    script, fap, bap = vector.path("epf"), vector.path("source_fap"), vector.path("source_bap")
    if script is None:
        settings: list[PlaneSettings] = [frame.plane.settings for frame in frames]
        return encode_planes(Animation.from_frames(frames), settings, bap_steps=vector.bap_steps)
    face = read_fap(fap) if fap is not None else None
    body = read_bap(bap) if bap is not None else None
    animation = merge(face, body) if face is not None and body is not None else face or body
    if animation is None:
        raise FormatError("the index names an EPF file, but no source to encode", path=script)
    return encode_planes(animation, read_epf(script), bap_steps=vector.bap_steps)
