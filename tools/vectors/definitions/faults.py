"""Vectors of damaged streams: what a decoder must report, and what it may salvage.

Damage is where a decoder must see it, so that no plane before it is in doubt. Most streams have a plane start
code, a time code and all ranges every five planes, where decoding may go on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from typing import Any

from fba_conformance.trace import Element, trace
from tools.vectors.definitions._targets import RATE_25, bodies, edited, faces, script
from tools.vectors.definitions.case import Fault
from tools.vectors.stream_writer import PLANE, Header, Plane, write_stream

_PERIOD = 5
_PLANES = 15
_RATE = (5, 0, 0)


def faults() -> Iterator[Fault]:
    """Yield all damaged streams."""
    yield from _beginnings()
    yield from _headers()
    yield from _segments()
    yield from _cuts()
    yield from _resumptions()


def _script(*, body: bool = False) -> list[Plane]:
    """Return 15 planes of a face, or of a face and a body, that decoding can begin at every fifth of."""
    planes = script(
        faces(_PLANES, (3, 4, 48)),
        bodies(_PLANES, (1, 19, 124)) if body else None,
        intra=range(0, _PLANES, _PERIOD),
        rate=_RATE,
    )
    codes = {
        number: {"start_code": PLANE, "rate": _RATE, "time_code": (0, 0, 1, number // _PERIOD)}
        for number in range(_PERIOD, _PLANES, _PERIOD)
    }
    return edited(planes, codes)


@cache
def _stream(*, body: bool = False) -> bytes:
    return write_stream(_script(body=body))


def _from_plane(number: int, *, body: bool = False) -> bytes:
    """Return an object of the planes from a restart point on."""
    return write_stream(_script(body=body)[number:])


@cache
def _elements(data: bytes) -> tuple[Element, ...]:
    return tuple(trace(data))


def _element(data: bytes, plane: int, name: str, place: int = 0) -> Element:
    """Return an element of a plane; place: of several with that name, negative from the last on."""
    return [one for one in _elements(data) if one.plane == plane and one.name == name][place]


def _with_bits(data: bytes, bit: int, bits: str) -> bytes:
    """Return data with other bits from a position on."""
    length = 8 * len(data)
    text = f"{int.from_bytes(data, 'big'):0{length}b}"
    return int(text[:bit] + bits + text[bit + len(bits) :], 2).to_bytes(len(data), "big")


def _changed(
    plane: int, name: str, bits: str, *, place: int = 0, skipped: int = 0, body: bool = False
) -> bytes:
    """Return the stream with other bits in an element. skipped: bits of the element before them."""
    data = _stream(body=body)
    return _with_bits(data, _element(data, plane, name, place).bit + skipped, bits)


def _closing(plane: int, name: str, *, body: bool = False) -> bytes:
    """Return the stream with the last bit of a segment changed."""
    data = _stream(body=body)
    element = _element(data, plane, name)
    last = element.bit + element.bits - 1
    bit = data[last // 8] >> (7 - last % 8) & 1
    return _with_bits(data, last, str(1 - bit))


def _cut(plane: int, name: str, kept: int, *, place: int = 0) -> bytes:
    """Return the stream up to bits of an element, in whole bytes."""
    data = _stream()
    return data[: (_element(data, plane, name, place).bit + kept) // 8]


def _code_position(data: bytes, place: int = 0) -> int:
    """Return where a plane start code is: the byte."""
    codes = [one.bit for one in _elements(data) if one.name == "fba_object_plane_start_code"]
    return codes[place] // 8


def _beginnings() -> Iterator[Fault]:
    """Yield streams that do not begin as an object does."""
    later = partial(_from_plane, _PERIOD)
    yield Fault("empty", "no byte at all", lambda: b"", 0)
    yield Fault("text", "text instead of a stream", lambda: b"#FBA? 68 FAPs, 25 frames/s\n0 1 1 0\n", 0)
    yield Fault("only_zeros", "64 bytes of 0", lambda: bytes(64), 0)
    yield Fault(
        "no_object_code",
        "a stream that begins with a plane start code: somebody joined in the middle",
        lambda: _stream()[_code_position(_stream()) :],
        0,
        later,
        times=True,
    )
    yield Fault(
        "no_object_code_bytes",
        "a stream that begins within a plane",
        lambda: _stream()[_code_position(_stream()) - 9 :],
        0,
        later,
        times=True,
    )
    yield Fault(
        "object_code_damaged",
        "another start code in place of the object's",
        lambda: b"\x00\x00\x01\xc5" + _stream()[4:],
        0,
        later,
        times=True,
    )
    yield Fault(
        "predicted_first",
        "an object whose first plane is a P plane",
        lambda: _changed(0, "is_intra", "0"),
        0,
        later,
        times=True,
    )


def _headers() -> Iterator[Fault]:
    """Yield streams with damaged headers."""
    first, last = partial(_from_plane, _PERIOD), partial(_from_plane, 2 * _PERIOD)
    last_both = partial(_from_plane, 2 * _PERIOD, body=True)
    made: tuple[tuple[str, str, Callable[[], bytes], int, Callable[[], bytes]], ...] = (
        (
            "mask_0_intra",
            "fba_object_mask 0 in an I plane",
            partial(_changed, 5, "fba_object_mask", "00"),
            5,
            last,
        ),
        (
            "mask_0_predicted",
            "fba_object_mask 0 in a P plane",
            partial(_changed, 2, "fba_object_mask", "00"),
            2,
            first,
        ),
        (
            "mask_other_half",
            "a P plane with BAPs, which no I plane has sent",
            partial(_changed, 2, "fba_object_mask", "11"),
            2,
            first,
        ),
        (
            "marker_group",
            "a marker bit of 0 before an fap_mask_type",
            partial(_changed, 5, "marker_bit", "0", place=3),
            5,
            last,
        ),
        ("marker_group_body", "a marker bit of 0 before a bap_mask_type", _body_marker, 5, last_both),
        (
            "marker_range",
            "a marker bit of 0 in a range list",
            partial(_changed, 5, "marker_bit", "0", place=-1),
            5,
            last,
        ),
        (
            "bap_mask_type_2",
            "bap_mask_type 2, which BAPs do not have",
            partial(_changed, 5, "bap_mask_type", "10", place=4, body=True),
            5,
            last_both,
        ),
    )
    for name, tests, make, before, after in made:
        yield Fault(name, tests, make, before, after, times=True)
    for name, half, body in (("dct_face", "FAPs", False), ("dct_body", "BAPs", True)):
        yield Fault(
            name,
            f"object_coding_type 1 of {half}: DCT segments, whose tables are in no public source",
            partial(_changed, 5, "object_coding_type", "1", place=-1, body=body),
            5,
            partial(_from_plane, 2 * _PERIOD, body=body),
            kind="unsupported",
            times=True,
        )
    yield Fault(
        "extension_without_ranges", "an extension BAP for which no range was ever sent", _without_ranges, 2
    )


def _segments() -> Iterator[Fault]:
    """Yield streams with damage in arithmetic segments and in the values that they give."""
    first, last = partial(_from_plane, _PERIOD), partial(_from_plane, 2 * _PERIOD)
    yield Fault(
        "closing_bits_intra",
        "an I plane's segment that does not end with its closing bits",
        partial(_closing, 5, "faps segment"),
        5,
        last,
        times=True,
    )
    yield Fault(
        "closing_bits_predicted",
        "a P plane's segment that does not end with its closing bits",
        partial(_closing, 3, "faps segment"),
        3,
        first,
        times=True,
    )
    yield Fault(
        "closing_bits_body",
        "a BAP segment that does not end with its closing bits",
        partial(_closing, 7, "baps segment", body=True),
        7,
        partial(_from_plane, 10, body=True),
        times=True,
    )
    yield Fault("inserted_bit_0", "a 0 in place of the 1 inserted behind 22 zeros", _guard_zero, 1)
    yield Fault(
        "viseme_above",
        "viseme_select1 becomes 15 through a difference",
        lambda: _select({1: (15, 0, 0, 0)}),
        3,
    )
    yield Fault(
        "viseme_below",
        "viseme_select2 becomes -1 through a difference",
        lambda: _select({1: (0, -1, 0, 0)}),
        3,
    )
    yield Fault(
        "expression_above",
        "expression_select1 becomes 7 through a difference",
        lambda: _select({2: (7, 0, 0, 0, 0, 0)}),
        3,
    )
    yield Fault(
        "expression_below",
        "expression_select2 becomes -1 through a difference",
        lambda: _select({2: (0, 0, -1, 0, 0, 0)}),
        3,
    )


def _cuts() -> Iterator[Fault]:
    """Yield streams that break off."""
    for name, tests, plane, element, kept, place in (
        ("cut_masks", "cut within the masks of an I plane", 5, "fap_mask_type", 1, 5),
        ("cut_ranges", "cut within a range list", 5, "p_new_max FAP 48 head_pitch", 2, 0),
        ("cut_intra_segment", "cut within the segment of an I plane", 10, "faps segment", 12, 0),
        ("cut_predicted_segment", "cut within the segment of a P plane", 13, "faps segment", 9, 0),
        ("cut_time_code", "cut within a time code", 10, "time_code_minutes", 5, 0),
    ):
        yield Fault(name, tests, partial(_cut, plane, element, kept, place=place), plane, times=True)
    yield Fault("cut_skip", "cut within number_of_frames_to_skip", _cut_skip, 4, times=True)


def _resumptions() -> Iterator[Fault]:
    """Yield streams in which it matters where decoding goes on."""
    last = partial(_from_plane, 2 * _PERIOD)
    yield Fault("zeros", "20 bytes of 0 from a P plane on", _zeros, 2, partial(_from_plane, 10), times=True)
    yield Fault(
        "two_damages",
        "damage in two places; five planes between them are whole",
        _two,
        2,
        _between,
        times=True,
    )
    yield Fault(
        "code_before_predicted",
        "behind damage, a start code before a P plane, where decoding cannot go on",
        _with_predicted_code,
        2,
        partial(_from_plane, _PERIOD),
        times=True,
    )
    for name, tests, code in (
        ("foreign_code", "an unknown start code (00 00 01 00) in place of a plane's; planes follow", 0x00),
        ("end_code_within", "an end code in place of a plane's start code; planes follow", 0xB1),
    ):
        yield Fault(name, tests, partial(_other_code, code), _PERIOD, last, times=True)
    yield Fault(
        "last_plane",
        "damage in the last plane: nothing behind it",
        partial(_changed, 14, "fba_object_mask", "00"),
        14,
        times=True,
    )
    yield Fault(
        "second_object",
        "damage in an object without start codes; another object behind it",
        lambda: _first_of_two() + _stream(),
        3,
        _stream,
    )
    yield Fault(
        "without_time_codes",
        "planes lost where no time code says how many: times behind it are in doubt",
        _timeless_damage,
        2,
        lambda: write_stream(_timeless()[_PERIOD:]),
    )


def _body_marker() -> bytes:
    """Return the stream of both halves with the marker before the mask type of BAP group 3 cleared."""
    data = _stream(body=True)
    bit = _element(data, 5, "bap_mask_type", 2).bit - 1
    return _with_bits(data, bit, "0")


def _without_ranges() -> bytes:
    header = Header(lists="0000")
    planes = script(None, [{1: 64}, {1: 128}])
    return write_stream([*planes, Plane(None, {1: 64, 187: 5}, True, bap_header=header)])


def _guard_zero() -> bytes:
    """Return I planes of the highest levels, with the first inserted bit of the second cleared."""
    header = Header(code=17)
    planes = script([{3: 2**40, 4: 2**40}] * 2, intra=(0, 1), fap=header)
    data = write_stream(planes)
    segment = _element(data, 1, "faps segment")
    return _with_bits(data, segment.bit + 22, "0")


def _select(values: Mapping[int, tuple[int, ...]]) -> bytes:
    """Return planes at rest, and one with other selects, which the writer does not check."""
    rest: dict[int, int | tuple[int, ...]] = {1: (0, 0, 0, 0), 2: (0, 0, 0, 0, 0, 0)}
    # A difference of P planes is at most the largest select, so two planes go there.
    half = {
        number: tuple(value - value // 8 * 4 if value > 0 else 0 for value in one)
        for number, one in values.items()
    }
    return write_stream(script([rest, rest, {**rest, **half}, {**rest, **values}, rest]))


def _other_code(code: int) -> bytes:
    """Return the stream with another last byte in its first plane start code."""
    data = bytearray(_stream())
    data[_code_position(bytes(data)) + 3] = code
    return bytes(data)


def _cut_skip() -> bytes:
    planes = script(faces(5, (3,)))
    data = write_stream(edited(planes, {4: {"skip": 15 * 30}}), end_code=None)
    return data[: (_element(data, 4, "number_of_frames_to_skip", 9).bit + 2) // 8]


def _zeros() -> bytes:
    """Return the stream with zeros from a plane's first bit to behind the next restart point."""
    data = _stream()
    bit = _element(data, 2, "is_intra").bit
    assert bit + 160 > 8 * _code_position(data)
    return _with_bits(data, bit, "0" * 160)


def _two() -> bytes:
    data = _changed(2, "fba_object_mask", "00")
    return _with_bits(data, _element(_stream(), 7, "fba_object_mask").bit, "00")


def _between() -> bytes:
    planes = _script()
    return write_stream([*planes[5:7], *planes[10:]])


def _with_predicted_code() -> bytes:
    planes = edited(_script(), {3: {"start_code": PLANE}})
    data = write_stream(planes)
    return _with_bits(data, _element(data, 2, "fba_object_mask").bit, "00")


def _first_of_two() -> bytes:
    data = write_stream(script(faces(6, (3,))))
    return _with_bits(data, _element(data, 3, "fba_object_mask").bit, "00")


def _timeless() -> list[Plane]:
    edits: dict[int, dict[str, Any]] = {
        n: {"time_code": None, "rate": RATE_25} for n in range(0, _PLANES, _PERIOD)
    }
    return edited(_script(), edits)


def _timeless_damage() -> bytes:
    data = write_stream(_timeless())
    return _with_bits(data, _element(data, 2, "fba_object_mask").bit, "00")
