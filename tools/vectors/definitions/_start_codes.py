"""Vectors of start codes, stuffing, and what stands before and behind an object."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import replace
from functools import partial

from tools.vectors.definitions._targets import FEW_BAPS, FEW_FAPS, RATE_25, bodies, edited, faces, script
from tools.vectors.definitions.case import Case
from tools.vectors.stream_writer import (
    END,
    OBJECT,
    OLD_OBJECT,
    OLD_PLANE,
    PLANE,
    WIDEST,
    Header,
    Plane,
    StreamWriter,
    write_stream,
)

_SEQUENCE, _VISUAL_OBJECT, _SEQUENCE_END, _USER_DATA = 0x1B0, 0x1B5, 0x1B7, 0x1B2
_LIBERAL = (
    "a decoder that looks for start codes at byte boundaries only reads it otherwise; a writer avoids it"
)


def start_code_cases() -> Iterator[Case]:
    """Yield streams of start codes and stuffing."""
    yield from _code_place_cases()
    yield from _stuffing_cases()
    yield from _old_code_cases()
    yield from _hidden_plane_cases()


def _code_place_cases() -> Iterator[Case]:
    """Yield streams with start codes before planes."""
    yield Case(
        "code_before_intra", "a plane start code before every I plane", lambda: _coded(lambda n: n % 4 == 0)
    )
    yield Case(
        "code_before_every_plane",
        "a plane start code before every plane, P planes, too",
        lambda: _coded(lambda n: True),
    )
    yield Case(
        "code_before_some",
        "plane start codes before some P planes, with BAPs",
        lambda: _coded(lambda n: n % 3 == 1, body=True),
    )
    yield Case(
        "code_first",
        "a plane start code right behind the object's, without stuffing between",
        lambda: write_stream(
            edited(script(faces(6, FEW_FAPS)), {0: {"start_code": PLANE, "stuffing": False}})
        ),
        encodes=False,
    )
    yield Case(
        "code_first_stuffed",
        "the same with a byte of stuffing between",
        lambda: write_stream(edited(script(faces(6, FEW_FAPS)), {0: {"start_code": PLANE}})),
    )


def _stuffing_cases() -> Iterator[Case]:
    """Yield streams with stuffing before start codes, and what looks like it."""
    yield Case(
        "stuffing_lengths",
        "stuffing of 1 to 8 bits before plane start codes",
        lambda: _lengths(whole_byte=True),
    )
    yield Case(
        "no_whole_byte",
        "start codes at byte boundaries without a byte of stuffing before them",
        lambda: _lengths(whole_byte=False),
        encodes=False,
    )
    yield Case(
        "code_twice",
        "two plane start codes before a plane",
        _twice,
        encodes=False,
        optional="no writer is known to do this",
    )
    yield Case(
        "plane_like_stuffing",
        "behind a start code, a P plane that begins with 0x7F and 00 00 01",
        _like_stuffing,
        encodes=False,
    )


def _old_code_cases() -> Iterator[Case]:
    """Yield streams with the old start codes."""
    yield Case(
        "old_codes",
        "the old start codes of object (01 01) and plane (01 03)",
        lambda: write_stream(
            edited(
                script(faces(8, FEW_FAPS), intra=(0, 4)),
                {0: {"start_code": OLD_PLANE}, 4: {"start_code": OLD_PLANE}},
            ),
            object_code=OLD_OBJECT,
        ),
        encodes=False,
        optional="only one vendor's early tools wrote these codes",
    )
    yield Case(
        "old_and_new_codes",
        "the standard's object start code, and plane start codes of both kinds",
        lambda: write_stream(
            edited(
                script(faces(9, FEW_FAPS), intra=(0, 3, 6)),
                {3: {"start_code": OLD_PLANE}, 5: {"start_code": OLD_PLANE}, 6: {"start_code": PLANE}},
            )
        ),
        encodes=False,
        optional="only one vendor's early tools wrote these codes",
    )


def _hidden_plane_cases() -> Iterator[Case]:
    """Yield planes that a decoder may take for stuffing, and those with a start code before them."""
    for unsure in (False, True):
        yield Case(
            "zeros_at_boundary" + "_bare" * unsure,
            "a P plane with 23 zeros from a byte boundary on, "
            + ("without a start code before it" if unsure else "therefore with a start code before it"),
            partial(_zeros_at_boundary, None if unsure else PLANE),
            encodes=not unsure,
            optional=_LIBERAL if unsure else "",
        )
        yield Case(
            "plane_within_byte" + "_bare" * unsure,
            "a last plane of 6 bits within one byte, which an end code behind it hides, "
            + ("without a start code before it" if unsure else "therefore with a start code before it"),
            partial(_within_byte, None if unsure else PLANE),
            encodes=not unsure,
            optional=_LIBERAL if unsure else "",
        )


def surrounding_cases() -> Iterator[Case]:
    """Yield streams that end in different ways, and with other data around the object."""
    plain = script(faces(6, FEW_FAPS), bodies(6, FEW_BAPS))
    yield Case(
        "no_end_code",
        "the data ends with the last plane",
        lambda: write_stream(plain, end_code=None),
        encodes=False,
    )
    yield Case(
        "no_end_code_whole_byte", "the same, with a last byte of stuffing", _ending_with_a_byte, encodes=False
    )
    for bits in range(1, 9):
        yield Case(
            f"end_stuffing_{bits}",
            f"an end code behind {bits} bit{'s' * (bits > 1)} of stuffing",
            partial(_ending, bits),
        )
    for code, name in ((_SEQUENCE_END, "video sequence"), (_USER_DATA, "user data")):
        yield Case(
            f"ended_by_{code & 255:02x}",
            f"the object is ended by another start code (00 00 01 {code & 255:02x}, {name})",
            partial(write_stream, plain, end_code=code),
            encodes=False,
        )
    yield Case(
        "layers_around",
        "visual object sequence and visual object headers before the object",
        lambda: _code(_SEQUENCE) + b"\x61" + _code(_VISUAL_OBJECT) + b"\x41\xff" + write_stream(plain),
        encodes=False,
    )
    yield Case(
        "data_behind",
        "other data behind the end code",
        lambda: write_stream(plain) + b"FBA\x00\xff" + bytes(range(32)),
        encodes=False,
    )
    yield Case(
        "marked_steps",
        "user data behind the end code, which name the table of BAP steps",
        lambda: write_stream(plain, bap_steps="visage") + _code(_USER_DATA) + b"fba bap_steps=visage;",
        bap_steps="visage",
        encodes=False,
    )


def _ending(bits: int) -> bytes:
    """Return planes of which the last ends this number of bits before the end code."""
    writer = _begun()
    for plane in script(faces(4, (3, 4))):
        writer.write_plane(plane)
    _write_fitting(writer, Plane({3: 4, 4: 4}, None, True), 8 - bits)
    writer.write_start_code(END)
    return writer.data()


def _coded(chosen: Callable[[int], bool], *, body: bool = False) -> bytes:
    planes = script(faces(12, FEW_FAPS), bodies(12, FEW_BAPS) if body else None, intra=(0, 4, 8))
    return write_stream(edited(planes, {n: {"start_code": PLANE} for n in range(1, 12) if chosen(n)}))


def _lengths(*, whole_byte: bool) -> bytes:
    """Return I planes that end at each bit of a byte, and P planes, with a start code before each."""
    writer = _begun()
    for offset in range(8):
        code = PLANE if offset else None
        _write_fitting(
            writer,
            Plane({3: 40, 4: 20}, None, True, rate=RATE_25, start_code=code, stuffing=whole_byte),
            offset,
        )
        writer.write_plane(Plane({3: 80 * offset, 4: -20}, start_code=PLANE, stuffing=whole_byte))
    _write_fitting(writer, Plane({3: 40, 4: 20}, None, True, start_code=PLANE, stuffing=whole_byte), 0)
    writer.write_start_code(END, stuffing=whole_byte)
    return writer.data()


def _write_fitting(writer: StreamWriter, plane: Plane, offset: int) -> None:
    """Write an I plane of FAPs, with ranges of such a size that it ends at this bit of a byte."""
    for code in range(1, WIDEST + 1):
        codes = dict.fromkeys(plane.fap or (), (code, code, 10, 10))
        fitting = replace(plane, fap_header=Header(codes=codes))
        tried = deepcopy(writer)
        tried.write_plane(fitting)
        if tried.length % 8 == offset:
            writer.write_plane(fitting)
            return
    raise AssertionError(f"no plane ends at bit {offset} of a byte")


def _begun() -> StreamWriter:
    """Return a writer behind an object start code."""
    writer = StreamWriter()
    writer.write_start_code(OBJECT, stuffing=False)
    return writer


def _twice() -> bytes:
    writer = _begun()
    for number, plane in enumerate(script(faces(6, FEW_FAPS), intra=(0, 3))):
        if number in {2, 3}:
            writer.write_start_code(PLANE)
            writer.write_start_code(PLANE, stuffing=False)
        writer.write_plane(plane)
    writer.write_start_code(END)
    return writer.data()


def _like_stuffing() -> bytes:
    """P plane, FAPs and BAPs, skip 15: 0 11 1 1111 is 0x7F; then 0000, and 19 zeros of levels, and a 1."""
    header = Header(lists="0000")
    rest = [{3: 0, 4: 0}, {}]
    planes = script([rest[0]] * 5, [rest[1]] * 5, fap=header, bap=header)
    planes[1] = Plane({3: 2**40, 4: 2**40}, {}, skip=15, start_code=PLANE)
    return write_stream(planes)


def _zeros_at_boundary(code: int | None) -> bytes:
    """Return FAPs 3, 4 and 5 with the highest differences in a plane that begins at bit 5 of a byte."""
    writer = _begun()
    rest = {3: 0, 4: 0, 5: 0}
    for plane in script([rest] * 3):
        writer.write_plane(plane)
    _write_fitting(writer, Plane(rest, None, True), 5)
    writer.write_plane(Plane({3: 2400, 4: 1200, 5: 1200}, start_code=code))
    writer.write_plane(Plane(rest))
    writer.write_start_code(END)
    return writer.data()


def _within_byte(code: int | None) -> bytes:
    """Return planes that send nothing, 6 bits each, of which the last begins at bit 1 of a byte."""
    writer = _begun()
    for plane in script(faces(4, (3, 4))):
        writer.write_plane(plane)
    empty = _begun()
    empty.write_plane(Plane({}, None, True))
    _write_fitting(writer, Plane({3: 4, 4: 4}, None, True), (1 - empty.length) % 8)
    writer.write_plane(Plane({}, None, True))
    writer.write_plane(Plane({}, start_code=code))
    writer.write_start_code(END)
    return writer.data()


def _ending_with_a_byte() -> bytes:
    """Return planes that end with a byte, and a byte of stuffing."""
    writer = _begun()
    for plane in script(faces(5, (3, 4))):
        writer.write_plane(plane)
    _write_fitting(writer, Plane({3: 4, 4: 4}, None, True), 0)
    writer.write_stuffing()
    return writer.data()


def _code(code: int) -> bytes:
    return code.to_bytes(4, "big")
