"""A stream as samples, a plane each with its start code, and samples as a stream again."""

from __future__ import annotations

import struct
import warnings
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fba.arrays import Bool, Int64
from fba.codec import StreamPlanes, decode, marked_table, read_planes, recode, write_opening
from fba.errors import FbaError, FbaWarning, UnsupportedError
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BapTable

SEQUENCE_CODE, VISUAL_CODE, OBJECT_CODE = b"\0\0\1\xb0", b"\0\0\1\xb5", b"\0\0\1\xba"
OLD_OBJECT_CODE = b"\0\0\1\1"
PLANE_CODE, END_CODE = b"\0\0\1\xbb", b"\0\0\1\xb1"
_STUFFING = 0x7F
FACE_PROFILE, BODY_PROFILE = 0x61, 0x64
"""profile_and_level_indication: Simple Face Animation, level 1; Simple FBA, level 2."""
FBA_OBJECT = 4
"""visual_object_type."""

_KEPT, _UNCODED, _CODED_INTRA, _CODED_LATER = range(4)
"""How a stream was coded: as the samples are; without start codes; with those before I planes, or before all
planes, after the first."""
_ORIGINAL = struct.Struct(">BBII")
_ORIGINAL_VERSION = 1


@dataclass(frozen=True, eq=False)
class PlaneSamples:
    """A stream as samples.

    planes: bytes of each, from its start code to the next, with the stuffing between. sync: bool (T,), True
    for I planes. index: int64 (T,); a plane is shown at index / rate. configuration: what a decoder needs
    before the first. original: how to make the same bytes of the stream again; b"" if that is not possible.
    """

    planes: tuple[bytes, ...]
    sync: Bool
    index: Int64
    rate: Fraction
    configuration: bytes
    original: bytes


def split_samples(
    data: bytes, *, bap_steps: BapTable | None = None, limits: Limits = DEFAULT_LIMITS
) -> PlaneSamples:
    """Return a stream as samples.

    Planes of a stream without a start code before each are coded again with them; all values stay the same.
    bap_steps: the table of BAP steps that the configuration is to name; None for that of the stream's mark.

    Raises BitstreamError, UnsupportedError, LimitError.
    """
    planes = read_planes(data, bap_steps=bap_steps, limits=limits)
    cut = _cut(data, planes)
    if cut is not None:
        head, pieces, tail = cut
        original = _pack(_KEPT, len(pieces), head, tail)
    else:
        pieces, original = _code_again(data, planes, bap_steps, limits)
    named = marked_table(data)
    if bap_steps is not None and bap_steps != named:
        original = b""  # the stream does not say with which table it is to be read
    body = [plane.body for plane in planes.settings if plane.body is not None]
    table = bap_steps or named if any(part.quant for part in body) else None
    animation = planes.animation
    return PlaneSamples(
        pieces,
        planes.intra,
        animation.index,
        animation.rate,
        _configuration(table, with_body=bool(body)),
        original,
    )


def join_samples(
    configuration: bytes, planes: list[bytes], original: bytes = b"", limits: Limits = DEFAULT_LIMITS
) -> bytes:
    """Return the stream of samples: as it was before, if `original` says how, else with all start codes."""
    stream = _plain_stream(configuration, planes)
    try:
        return _restore(stream, planes, original, limits) or stream
    except FbaError:  # damaged planes: whoever decodes the stream finds them
        return stream


def is_configuration(data: bytes) -> bool:
    """Whether the configuration of a decoder is that of an FBA stream."""
    at = data.find(VISUAL_CODE)
    if at >= 0:
        bits = int.from_bytes(data[at + 4 : at + 6].ljust(2, b"\0"), "big")
        with_identifier = bits >> 15
        kind = bits >> 4 if with_identifier else bits >> 11
        return kind & 15 == FBA_OBJECT
    return OBJECT_CODE in data or OLD_OBJECT_CODE in data


def _configuration(table: BapTable | None, *, with_body: bool) -> bytes:
    """Return the configuration of a decoder: all that stands before the first plane."""
    if table is not None:
        return write_opening(table) + OBJECT_CODE
    profile = BODY_PROFILE if with_body else FACE_PROFILE
    return SEQUENCE_CODE + bytes([profile]) + VISUAL_CODE + bytes([FBA_OBJECT << 3 | 3]) + OBJECT_CODE


def _plain_stream(configuration: bytes, planes: list[bytes]) -> bytes:
    first = planes[0] if planes else b""
    if not any(
        code in head for code in (OBJECT_CODE, OLD_OBJECT_CODE) for head in (configuration, first[:64])
    ):
        configuration += OBJECT_CODE
    return b"".join((configuration, *planes, END_CODE))


def _cut(data: bytes, planes: StreamPlanes) -> tuple[bytes, tuple[bytes, ...], bytes] | None:
    """Return what stands before the planes, the planes with their start codes, and what stands behind.

    None if a plane has no start code, an old one, or something else between it and the plane before.
    """
    if not planes.coded.all() or (planes.begins[1:] != planes.ends[:-1]).any():
        return None
    starts = [_aligned(data, bit) for bit in planes.begins.tolist()]
    stop = _aligned(data, int(planes.ends[-1]))
    if any(data[at : at + 4] != PLANE_CODE for at in starts):
        return None
    pieces = tuple(data[at:to] for at, to in zip(starts, [*starts[1:], stop], strict=True))
    return data[: starts[0]], pieces, data[stop:]


def _aligned(data: bytes, bit: int) -> int:
    """Return the byte after the stuffing that begins at a bit: a whole byte only before a start code."""
    at = (bit + 7) // 8
    whole = bit % 8 == 0 and data[at : at + 4] == bytes([_STUFFING, 0, 0, 1])
    return at + 1 if whole else at


def _code_again(
    data: bytes, planes: StreamPlanes, bap_steps: BapTable | None, limits: Limits
) -> tuple[tuple[bytes, ...], bytes]:
    """Return the planes with start codes, and how to make the bytes of the stream again."""
    coded = recode(planes, np.ones(len(planes.settings), dtype=np.bool_))
    again = read_planes(coded, bap_steps=planes.bap_steps, limits=limits)
    cut = _cut(coded, again)
    same = again.animation == planes.animation
    if data.count(OBJECT_CODE) > 1:  # each may have its own table of BAP steps
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FbaWarning)  # whoever read the stream got them
            same = same and again.animation == decode(data, bap_steps=bap_steps, limits=limits)
    if not same or cut is None:
        raise UnsupportedError(
            "the objects of this stream do not fit into one track; make one object of them first: "
            "fba convert IN.fba ONE.fba",
            what="several FBA objects in a track",
        )
    count = len(planes.settings)
    intra, codes = planes.intra, planes.coded
    kinds = (_UNCODED, _CODED_INTRA, _CODED_LATER)
    kind = next((each for each in kinds if np.array_equal(_codes(each, intra), codes)), None)
    if kind is None:
        return cut[1], b""
    head, tail = data[: int(planes.begins[0]) // 8], data[_aligned(data, int(planes.ends[-1])) :]
    restored = head + recode(planes, planes.coded)[len(OBJECT_CODE) : -len(END_CODE)] + tail
    return cut[1], _pack(kind, count, head, tail) if restored == data else b""


def _codes(kind: int, intra: Bool) -> Bool:
    """Return which planes have a start code, bool (T,)."""
    codes = {_UNCODED: np.zeros_like(intra), _CODED_INTRA: intra.copy()}.get(kind, np.ones_like(intra))
    codes[0] = False
    return codes


def _pack(kind: int, planes: int, head: bytes, tail: bytes) -> bytes:
    return _ORIGINAL.pack(_ORIGINAL_VERSION, kind, planes, len(head)) + head + tail


def _restore(stream: bytes, planes: list[bytes], original: bytes, limits: Limits) -> bytes:
    """Return the stream as it was before it became samples; b"" if nothing says how."""
    if len(original) < _ORIGINAL.size:
        return b""
    version, kind, count, length = _ORIGINAL.unpack_from(original)
    head, tail = original[_ORIGINAL.size :][:length], original[_ORIGINAL.size + length :]
    if version != _ORIGINAL_VERSION or count != len(planes) or len(head) < length or kind > _CODED_LATER:
        return b""  # a later program, or another has changed the samples
    if kind == _KEPT:
        return b"".join((head, *planes, tail))
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        read = read_planes(stream, limits=limits)
        if len(read.settings) != count:
            return b""
        return head + recode(read, _codes(kind, read.intra))[len(OBJECT_CODE) : -len(END_CODE)] + tail
