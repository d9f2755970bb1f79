"""Vectors of what planes carry: masks, groups, parts that come and go, I planes, flags of headers."""

from __future__ import annotations

from collections.abc import Iterator

from fba.parameters import BAP_GROUP_COUNT, FAP_GROUP_COUNT, bap_groups, fap_groups
from tools.vectors.definitions._targets import (
    EXTENSION_BAPS,
    FEW_BAPS,
    FEW_FAPS,
    LOW_LEVEL,
    RATE_25,
    STANDARD_BAPS,
    bodies,
    edited,
    faces,
    only,
    script,
    scripted,
)
from tools.vectors.definitions.case import Case
from tools.vectors.stream_writer import Header, Plane, Values, write_stream


def mask_cases() -> Iterator[Case]:
    """Yield streams of all mask types and masks."""
    yield Case(
        "mask_type_1", "some FAPs of every group, the others keep their values", scripted(faces(8, FEW_FAPS))
    )
    yield Case(
        "mask_type_2",
        "some FAPs of every group, the others are to be interpolated",
        scripted(faces(8, FEW_FAPS), fap=Header(mask_types=dict.fromkeys(range(2, FAP_GROUP_COUNT + 1), 2))),
    )
    yield Case("fap_mask_types", "every FAP group with every mask type, one after the other", _fap_mask_types)
    yield Case("bap_mask_types", "every BAP group with mask types 0, 1 and 3", _bap_mask_types)
    yield Case(
        "masks_full",
        "mask type 1 with all flags 1, and with all flags 0",
        lambda: write_stream(
            edited(
                script(faces(8, (*range(3, 31),)), intra=(0, 4)),
                {
                    0: {"fap_header": Header(mask_types={2: 1, 3: 2, 4: 1, 5: 2})},
                    4: {"fap_header": Header(mask_types={2: 2, 3: 1, 10: 1})},
                },
            )
        ),
    )
    yield Case(
        "faps_in_turn",
        "each of 20 planes sends other FAPs, all of them in the end",
        lambda: _in_turn(LOW_LEVEL),
    )
    yield Case(
        "baps_in_turn",
        "each of 20 planes sends other BAPs, in the order of their groups",
        lambda: _in_turn(STANDARD_BAPS),
    )
    yield Case(
        "extension_baps_in_turn",
        "each of 20 planes sends other user-defined BAPs",
        lambda: _in_turn(EXTENSION_BAPS),
    )
    yield Case(
        "mask_body",
        "some BAPs of many groups: coded in the order of groups, not of numbers",
        scripted(None, bodies(10, FEW_BAPS)),
    )
    yield Case(
        "high_level_only",
        "viseme and expression without a low-level FAP: the last segment is empty",
        scripted(only(faces(12, (), viseme=True, expression=True), (1, 2))),
    )
    yield Case(
        "mask_nothing",
        "mask type 0 in every group, FAPs and BAPs: planes of a header and two empty segments",
        scripted([{}] * 6, [{}] * 6, intra=(0, 3)),
    )
    yield Case("masks_change", "masks that change in I planes; P planes go by the last one", _masks_change)
    yield Case("viseme_comes_and_goes", "FAP 1 and FAP 2 sent, not sent, and sent again", _high_level_changes)


def plane_cases() -> Iterator[Case]:
    """Yield streams of planes with one half or both, and of I planes."""
    yield Case("object_masks", "fba_object_mask 3, 1, 2 and 3 again in P planes", _object_masks)
    yield Case(
        "body_joins",
        "a face alone; an I plane with both; later I planes with one half do not touch the other",
        _body_joins,
    )
    yield Case("all_intra", "I planes only", scripted(faces(8, FEW_FAPS), intra=range(8)))
    yield Case(
        "intra_period",
        "every third plane is an I plane: counts start again, values do not depend on those before",
        scripted(faces(18, FEW_FAPS), bodies(18, FEW_BAPS), intra=range(0, 18, 3)),
    )
    yield Case("one_plane", "a single I plane", scripted(faces(1, FEW_FAPS), bodies(1, FEW_BAPS)))
    yield Case(
        "gender",
        "suggested_gender 1 for the face, for the body, and for both",
        lambda: write_stream(
            edited(
                script(faces(6, (3,)), bodies(6, (1,)), intra=(0, 2, 4)),
                {
                    0: {"fap_header": Header(gender=1)},
                    2: {"bap_header": Header(gender=1)},
                    4: {"fap_header": Header(gender=1), "bap_header": Header(gender=1)},
                },
            )
        ),
    )
    yield Case(
        "flags",
        "viseme_def, init_face and expression_def in all combinations, in I and P planes",
        scripted([_flags(frame) for frame in range(16)], intra=(0, 8)),
    )


def _fap_mask_types() -> bytes:
    """Group g of I plane t has type (g + t) % 4; of a masked group, its first FAP is sent."""
    planes: list[Plane] = []
    for turn in range(4):
        types = {group: (group + turn) % 4 for group in range(1, FAP_GROUP_COUNT + 1)}
        sent = [
            number
            for (group, mask_type), numbers in zip(types.items(), fap_groups(), strict=True)
            for number in (numbers if mask_type == 3 else numbers[: int(mask_type > 0)])
        ]
        low_level = [number for number in sent if number > 2]
        values = faces(3, low_level, seed=turn + 5, viseme=1 in sent, expression=2 in sent)
        header = Header(mask_types=types)
        planes += [Plane(one, None, place == 0, header, rate=RATE_25) for place, one in enumerate(values)]
    return write_stream(planes)


def _bap_mask_types() -> bytes:
    planes: list[Plane] = []
    for turn in range(3):
        types = {group: (0, 1, 3)[(group + turn) % 3] for group in range(1, BAP_GROUP_COUNT + 1)}
        sent = [
            number
            for (group, mask_type), numbers in zip(types.items(), bap_groups(), strict=True)
            for number in (numbers if mask_type == 3 else numbers[-int(mask_type > 0) :] if mask_type else ())
        ]
        values = bodies(3, sent, seed=turn + 5)
        header = Header(mask_types=types)
        planes += [
            Plane(None, one, place == 0, bap_header=header, rate=RATE_25) for place, one in enumerate(values)
        ]
    return write_stream(planes)


def _in_turn(numbers: tuple[int, ...]) -> bytes:
    """Return a stream of 10 I planes, each followed by a P plane, that send every tenth parameter."""
    is_face = numbers is LOW_LEVEL
    planes: list[Plane] = []
    for turn in range(10):
        sent = numbers[turn::10]
        values = faces(2, sent, seed=turn) if is_face else bodies(2, sent, seed=turn)
        planes += script(values if is_face else None, None if is_face else values)
    return write_stream(planes)


def _masks_change() -> bytes:
    values = faces(15, LOW_LEVEL, seed=4)
    masks = (LOW_LEVEL, LOW_LEVEL[::3], (3, 4, 5), (), LOW_LEVEL[40:])
    planes = [{number: one[number] for number in masks[frame // 3]} for frame, one in enumerate(values)]
    return write_stream(script(planes, intra=range(0, 15, 3)))


def _high_level_changes() -> bytes:
    values = faces(16, (3, 4), viseme=True, expression=True)
    masks = ((1, 2, 3, 4), (1, 3, 4), (2, 3, 4), (1, 2, 3, 4))
    planes = [{number: one[number] for number in masks[frame // 4]} for frame, one in enumerate(values)]
    return write_stream(script(planes, intra=range(0, 16, 4)))


def _object_masks() -> bytes:
    planes = script(faces(12, FEW_FAPS), bodies(12, FEW_BAPS))
    without: dict[str, Values | None] = {}
    edits = {}
    for frame in range(1, 12):
        without = {} if frame % 4 in {0, 3} else {"bap": None} if frame % 4 == 1 else {"fap": None}
        edits[frame] = without
    return write_stream(edited(planes, edits))


def _body_joins() -> bytes:
    planes = script(faces(15, FEW_FAPS), bodies(15, FEW_BAPS), intra=(0, 4, 8, 11))
    edits: dict[int, dict[str, Values | None]] = {frame: {"bap": None} for frame in range(4)}
    edits[8] = {"bap": None}
    edits[11] = {"fap": None}
    return write_stream(edited(planes, edits))


def _flags(frame: int) -> Values:
    return {1: (2, 3, 40, frame % 2), 2: (1, 20, 2, 30, frame // 2 % 2, frame // 4 % 2)}
