"""The points of the syntax that vectors are to reach, and those that a stream reaches, from its trace."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import pairwise

from fba.parameters import (
    BAP_COUNT,
    BAP_STEP_TABLES,
    EXPRESSION_SELECT_MAX,
    FAP_COUNT,
    VISEME_SELECT_MAX,
    BapTable,
    bap_groups,
    baps,
    fap_groups,
    faps,
)
from fba_conformance.trace import Element, Levels

_LISTS = ("i_new_max", "i_new_min", "p_new_max", "p_new_min")
_CODES = 32
_ZEROS = 22
"""Zeros behind which a 1 is inserted."""
_AHEAD = 14
"""Bits behind a segment that a decoder with 16 bits in its register has read."""
_FLAGS = ("viseme_def", "init_face", "expression_def")
_SEGMENTS = ("viseme segment", "expression segment", "faps segment", "baps segment")
_PLANE_CODES = ("fba_object_plane_start_code", "fba_object_plane_start_code (old)")
_OBJECT_CODES = ("fba_object_start_code", "fba_object_start_code (old)")
_KINDS = ("I", "P")


@cache
def all_points() -> tuple[str, ...]:
    """Return the names of all points."""
    return tuple(dict.fromkeys(_all_points()))


def _all_points() -> Iterator[str]:
    yield from (*_OBJECT_CODES, "headers before the object", "trailing data")
    yield from (
        f"ended by {one}" for one in ("visual_object_sequence_end_code", "another start code", "the data")
    )
    for code in _PLANE_CODES:
        yield from (f"{code} before {article} plane" for article in ("an I", "a P"))
    yield from ("plane start code behind the object's", "plane start code twice", "damage")
    for what in ("a plane start code", "the end of the object"):
        yield from (f"stuffing of {bits} bits before {what}" for bits in range(9))
    yield from (f"is_intra {value}" for value in (0, 1))
    yield from (f"fba_object_mask {value}, {kind} plane" for value in (1, 2, 3) for kind in _KINDS)
    yield "fba_object_mask 0"
    for name, values in (
        ("is_frame_rate", (0, 1)), ("frequency_offset", (0, 1)), ("is_time_code", (0, 1)),
        ("seconds", range(16)),
        ("frame_rate", (0, 25, 255)), ("time_code_hours", (0, 31)), ("time_code_minutes", (0, 59)),
        ("time_code_seconds", (0, 59)), ("marker_bit (plane)", (0, 1)),
    ):  # fmt: skip
        yield from (f"{name} {value}" for value in values if (name, value) not in _NOT_SENT)
    yield from (f"skip_frames {value}, {kind} plane" for value in (0, 1) for kind in _KINDS)
    yield from (f"number_of_frames_to_skip of {words} words" for words in ("1", "2", "3", "more"))
    yield from (f"number_of_frames_to_skip word {word}" for word in (0, 1, 14, 15))
    for half, groups, types, count in (
        ("fap", fap_groups(), (0, 1, 2, 3), FAP_COUNT), ("bap", bap_groups(), (0, 1, 3), BAP_COUNT)
    ):  # fmt: skip
        yield from (f"fap_quant {quant}" for quant in range(_CODES) if half == "fap")
        for table in BAP_STEP_TABLES if half == "bap" else ():
            yield from (f"bap_quant {quant}, steps {table}" for quant in range(_CODES))
        for group in range(1, len(groups) + 1):
            yield from (f"{half}_mask_type {mask_type} of group {group}" for mask_type in types)
        for number in range(1, count + 1):
            yield from (f"{half}_group_mask {flag} for {half.upper()} {number}" for flag in (0, 1))
        yield from (f"suggested_gender {value} ({half})" for value in (0, 1))
        yield from (f"object_coding_type {value} ({half})" for value in (0, 1))
        yield from (f"range lists {value:04b} ({half})" for value in range(16))
        yield from (
            f"{name} code {code} ({half})"
            for name in _LISTS
            for code in range(_CODES)
            if half == "fap" or code in {0, 31}
        )
        labels = [one.label for one in (faps()[2:] if half == "fap" else baps())]
        yield from (f"{name} {label}" for name in _LISTS for label in labels)
        yield from (f"{label} in {kind} planes" for label in labels for kind in _KINDS)
    yield "bap_mask_type 2"
    yield from (f"{flag} {value} in {kind} planes" for flag in _FLAGS for value in (0, 1) for kind in _KINDS)
    for name in _SEGMENTS:
        yield from (f"{name} in {kind} planes" for kind in _KINDS)
        if name in {"faps segment", "baps segment"}:
            yield from (f"{name} without a symbol in {kind} planes" for kind in _KINDS)
            yield f"{name} with inserted bits in I planes"
        yield f"{name} with inserted bits in P planes"
        yield from (f"{name} closed by {bits}" for bits in ("01", "10"))
    for name, most in (("viseme", VISEME_SELECT_MAX), ("expression", EXPRESSION_SELECT_MAX)):
        for which in ("select1", "select2"):
            yield from (f"{name}_{which} {value}" for value in range(most + 1))
    for name in ("viseme_blend", "expression_intensity1", "expression_intensity2"):
        yield from (f"{name} {value}" for value in (0, 63, "above 63"))
    yield from (f"a 1 inserted {where} the closing bits" for where in ("before", "within"))
    yield from ("22 zeros at the end of a segment", "22 zeros across the end of a segment, then a 1")
    yield "value beyond 16 bits"


_NOT_SENT = {("frame_rate", 0)}
"""0 with seconds 0 would be no rate; rate_slowest has it with seconds 1."""


def points(elements: Sequence[Element], data: bytes, bap_steps: BapTable, *, damaged: bool) -> set[str]:
    """Return the points that a stream reaches. damaged: the trace ended with an error."""
    return set(_points(elements, data, bap_steps, damaged=damaged)).intersection(all_points())


def _points(elements: Sequence[Element], data: bytes, bap_steps: BapTable, *, damaged: bool) -> Iterator[str]:
    if damaged:
        yield "damage"
    kind = ""
    before = ""
    lists = ""
    words: list[int] = []
    for element, following in [*pairwise(elements), *((one, None) for one in elements[-1:])]:
        name, value = element.name, element.value
        if element.section == "object":
            yield from _object_points(element, following, before)
        elif name == "is_intra":
            kind = "I" if value else "P"
            yield f"is_intra {value}"
            if before in _PLANE_CODES:
                yield f"{before} before {'an I' if value else 'a P'} plane"
        elif name == "fba_object_mask":
            yield from (f"fba_object_mask {value}, {kind} plane", f"fba_object_mask {value}")
        elif name == "skip_frames":
            words = []
            yield f"skip_frames {value}, {kind} plane"
        elif name == "number_of_frames_to_skip":
            assert isinstance(value, int)
            words.append(value)
            yield f"number_of_frames_to_skip word {value}"
            if value < _CODES // 2 - 1:
                yield f"number_of_frames_to_skip of {len(words) if len(words) < 4 else 'more'} words"
        elif isinstance(value, Levels):
            yield from _segment_points(element, value, kind, data)
        elif element.section == "plane":
            yield f"{name} {value}" if name != "marker_bit" else f"{name} (plane) {value}"
        elif name in _FLAGS:
            yield f"{name} {value} in {kind} planes"
        else:
            lists = (lists + str(value))[-4:] if name.startswith("is_") else lists
            yield from _header_points(element, bap_steps, lists)
        before = name


def _object_points(element: Element, following: Element | None, before: str) -> Iterator[str]:
    """Yield points of start codes and stuffing."""
    name = element.name
    yield name
    at_plane = name in _PLANE_CODES
    if at_plane:
        yield from ("plane start code behind the object's" for _ in range(1) if before in _OBJECT_CODES)
        yield from ("plane start code twice" for _ in range(1) if before in _PLANE_CODES)
    is_code = at_plane or name in {"start_code", "visual_object_sequence_end_code"}
    if is_code and before != "alignment stuffing" and before not in (*_OBJECT_CODES, *_PLANE_CODES):
        yield f"stuffing of 0 bits before {'a plane start code' if at_plane else 'the end of the object'}"
    if name == "alignment stuffing":
        what = (
            "a plane start code" if following and following.name in _PLANE_CODES else "the end of the object"
        )
        yield f"stuffing of {element.bits} bits before {what}"
        if following is None:
            yield "ended by the data"
    elif name == "start_code":
        yield "ended by another start code"
    elif name == "visual_object_sequence_end_code":
        yield f"ended by {name}"


def _header_points(element: Element, bap_steps: BapTable, lists: str) -> Iterator[str]:
    """Yield points of the FAP or the BAP half of an I plane's header. lists: the last four list flags."""
    name, value, half = element.name, element.value, element.section[:3]
    groups = fap_groups() if half == "fap" else bap_groups()
    if name == "fap_quant":
        yield f"fap_quant {value}"
    elif name == "bap_quant":
        yield f"bap_quant {value}, steps {bap_steps}"
    elif name.endswith("_mask_type"):
        yield from (f"{name} {value} of {element.section[4:]}", f"{name} {value}")
    elif name.endswith("_group_mask"):
        numbers = groups[int(element.section.rpartition(" ")[2]) - 1]
        for number, flag in zip(numbers, str(value), strict=True):
            yield f"{name} {flag} for {half.upper()} {number}"
    elif name in {"suggested_gender", "object_coding_type"}:
        yield f"{name} {value} ({half})"
    elif name == "is_p_new_min":
        yield f"range lists {lists} ({half})"
    elif name.startswith(_LISTS):
        yield from (name, f"{name.partition(' ')[0]} code {value} ({half})")


def _segment_points(element: Element, content: Levels, kind: str, data: bytes) -> Iterator[str]:
    """Yield points of an arithmetic segment and of what it codes."""
    name = element.name
    yield f"{name} in {kind} planes"
    if not content.parameters:
        yield f"{name} without a symbol in {kind} planes"
    if content.inserted:
        yield f"{name} with inserted bits in {kind} planes"
    for label, value in zip(content.parameters, content.values, strict=True):
        if label.startswith(("viseme", "expression")):
            yield f"{label} {value}"
            yield from (f"{label} above 63" for _ in range(1) if value > 63)
        else:
            yield f"{label} in {kind} planes"
        if abs(value) > 0xFFFF:
            yield "value beyond 16 bits"
    yield from _closing_points(
        _bits(data, element.bit, element.bit + element.bits + _AHEAD + 1), element.bits, name
    )


def _closing_points(bits: Sequence[int], length: int, name: str) -> Iterator[str]:
    """Yield points of the end of a segment. bits: of the segment and of what follows it."""
    zeros = 0
    logical = []  # positions of the bits that were not inserted
    inserted = []
    for position, bit in enumerate(bits):
        if zeros == _ZEROS:
            zeros = 0
            inserted.append(position)
            if position >= length and bit:
                yield "22 zeros across the end of a segment, then a 1"
            if position == length:
                yield "22 zeros at the end of a segment"
            continue
        zeros = 0 if bit else zeros + 1
        logical.append(position)
    closing = [position for position in logical if position < length][-2:]
    yield f"{name} closed by {''.join(str(bits[position]) for position in closing)}"
    for position in inserted:
        if position == closing[0] - 1:
            yield "a 1 inserted before the closing bits"
        elif closing[0] < position < closing[1]:
            yield "a 1 inserted within the closing bits"


def _bits(data: bytes, start: int, stop: int) -> list[int]:
    """Return bits of data, as far as it goes."""
    return [data[bit >> 3] >> (7 - bit & 7) & 1 for bit in range(start, min(stop, 8 * len(data)))]
