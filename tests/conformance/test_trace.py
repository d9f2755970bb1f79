"""The trace of streams made by hand, bit by bit from the syntax tables."""

import json
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from codec_streams import FAP_GROUP_SIZES, fap_masks, flipped, segment
from fba import BitstreamError, FbaError, FbaWarning, UnsupportedError
from fba_conformance._textbook import FrequencyTable, encode_segment
from fba_conformance.trace import Element, Levels, decode_values, element_dict, format_trace, trace

OBJECT, PLANE, END = (f"{code:032b}" for code in (0x1BA, 0x1BB, 0x1B1))
OLD_OBJECT, OLD_PLANE = (f"{code:032b}" for code in (0x101, 0x103))
NO_BAPS = "1" + "00"
I_FAPS, P_FAPS, I_BAPS, P_BAPS = "1" + "01", "0" + "01", "1" + "10", "0" + "10"
NO_RATE, NO_TIME, NO_SKIP = "0", "0", "0"
GENDER_CODING = "0" + "0"
NO_LISTS = "0000"


def stuffed(bits: str) -> str:
    """Alignment stuffing: a 0, then 1s to the byte boundary, 1 to 8 bits."""
    return bits + "0" + "1" * ((7 - len(bits)) % 8)


def as_bytes(bits: str) -> bytes:
    assert len(bits) % 8 == 0
    return int("1" + bits, 2).to_bytes(len(bits) // 8 + 1, "big")[1:]


def intra(quant: int, masks: str, *segments: str, time: str = NO_RATE + NO_TIME + NO_SKIP) -> str:
    return I_FAPS + time + f"{quant:05b}" + masks + GENDER_CODING + NO_LISTS + "".join(segments)


JAW = fap_masks(3)
JAW_LIMITS = [(-1080, 1080)]
JAW_PLANE = intra(1, JAW, segment([5], JAW_LIMITS))


def one_object(*planes: str) -> bytes:
    return as_bytes(stuffed(OBJECT + "".join(planes)) + END)


def contiguous(elements: list[Element]) -> bool:
    ends = [0] + [e.bit + e.bits for e in elements]
    return [e.bit for e in elements] == ends[:-1]


def test_every_element_of_an_intra_plane() -> None:
    """Names, positions and lengths of everything that a FAP plane can hold."""
    ranged = [n for size in FAP_GROUP_SIZES[1:] for n in range(size)]  # position in its group of FAP 3..68
    parts: list[tuple[str, str]] = [
        ("fba_object_start_code", OBJECT),
        ("is_intra", "1"),
        ("fba_object_mask", "01"),
        ("is_frame_rate", "1"),
        ("frame_rate", f"{29:08b}"),
        ("seconds", f"{15:04b}"),
        ("frequency_offset", "1"),
        ("is_time_code", "1"),
        ("time_code_hours", f"{23:05b}"),
        ("time_code_minutes", f"{59:06b}"),
        ("marker_bit", "1"),
        ("time_code_seconds", f"{58:06b}"),
        ("skip_frames", "1"),
        ("number_of_frames_to_skip", "1111"),
        ("number_of_frames_to_skip", "0010"),
        ("fap_quant", f"{3:05b}"),
    ]
    for group, size in enumerate(FAP_GROUP_SIZES, 1):
        mask_type = {1: 3, 2: 1, 9: 2}.get(group, 0)
        parts += [("marker_bit", "1"), ("fap_mask_type", f"{mask_type:02b}")]
        if mask_type in {1, 2}:
            parts.append(("fap_group_mask", ("1" + "0" * 20)[:size]))  # FAPs 3 and 61
    parts += [("suggested_gender", "1"), ("object_coding_type", "0")]
    flags = ("i_new_max", "i_new_min", "p_new_max", "p_new_min")
    parts += [(f"is_{name}", "1") for name in flags]
    for name, code in zip(flags, (7, 1, 2, 0), strict=True):
        for number, position in enumerate(ranged, 3):
            if position % 4 == 0:
                parts.append(("marker_bit", "1"))
            if number in {3, 61}:
                label = {3: "FAP 3 open_jaw", 61: "FAP 61 stretch_l_nose"}[number]
                parts.append((f"{name} {label}", f"{code:05b}"))
    # Blends and intensities to (63 + 3 // 2) // 3 = 21, ranges 420 // 3 and 60 // 3.
    parts += [
        ("viseme segment", segment([14, 2, 21], [(0, 14), (0, 14), (0, 21)])),
        ("viseme_def", "1"),
        ("expression segment", segment([6, 20, 1, 0], [(0, 6), (0, 21), (0, 6), (0, 21)])),
        ("init_face", "0"),
        ("expression_def", "1"),
        ("faps segment", segment([-20, 140], [(-20, 140)] * 2)),
    ]
    written = "".join(bits for _, bits in parts)
    stuffing = stuffed(written)[len(written) :]
    parts += [("alignment stuffing", stuffing), ("visual_object_sequence_end_code", END)]
    parts.append(("trailing data", f"{0xABCD:016b}"))
    data = as_bytes("".join(bits for _, bits in parts))

    elements = list(trace(data))
    assert [(e.name, e.bits) for e in elements] == [(name, len(bits)) for name, bits in parts]
    assert contiguous(elements)
    for element, (_, bits) in zip(elements, parts, strict=True):
        if isinstance(element.value, int):
            assert element.value == int(bits, 2)
    assert {e.plane for e in elements[1:-3]} == {0}
    assert [e.plane for e in (elements[0], *elements[-3:])] == [None] * 4

    (plane,) = decode_values(data)
    assert plane["fap"] == {3: -20 * 4 * 3, 61: 140 * 1 * 3}
    assert (plane["viseme"], plane["expression"]) == ([14, 2, 63, 1], [6, 60, 1, 0, 0, 1])
    assert plane["rate"] == Fraction(479_000, 16_016)  # 29 15/16, times 1000/1001
    assert plane["time"] == (23 * 60 + 59) * 60 + 58
    assert (plane["skip"], plane["frame_rate"]) == (17, (29, 15, 1))
    assert plane["fap_mask_types"] == (3, 1, 0, 0, 0, 0, 0, 0, 2, 0)


@pytest.mark.parametrize(
    ("number", "quant", "intra_limit", "p_limit", "step"),
    [
        (3, 1, 1080, 360, 4),  # unidirectional, and yet symmetric
        (47, 1, 1080, 420, 512),  # not what the table says
        (63, 1, 720, 180, 1),  # 680 rounded out to a multiple of 60
        (63, 7, 102, 25, 7),
        (4, 0, 600, 180, 1),  # quantiser 0: the value itself
    ],
)
def test_default_ranges_of_faps(number: int, quant: int, intra_limit: int, p_limit: int, step: int) -> None:
    table = FrequencyTable(2 * p_limit + 1)
    moves = [-p_limit, 3]
    predicted = [P_FAPS + NO_SKIP + encode_segment([move + p_limit], [table], learn=True) for move in moves]
    first = intra(quant, fap_masks(number), segment([intra_limit], [(-intra_limit, intra_limit)]))
    planes = decode_values(one_object(first, *predicted))
    levels = [intra_limit, intra_limit - p_limit, intra_limit - p_limit + 3]
    assert [p["fap"] for p in planes] == [{number: level * step} for level in levels]


def bap_masks(group: int, mask: str) -> str:
    return NO_BAPS * (group - 1) + "1" + "01" + mask + NO_BAPS * (24 - group)


def test_baps_go_by_their_table_and_their_own_order() -> None:
    """Group 1: sacroiliac, steps 64 (iso) and 170 (visage); bap_quant 4 scales by 5; limits -960..960."""
    plane = (
        I_BAPS + NO_RATE + NO_TIME + NO_SKIP + f"{4:05b}" + bap_masks(1, "101") + GENDER_CODING + NO_LISTS
        + segment([192, -192], [(-192, 192)] * 2)
    )  # fmt: skip
    data = one_object(plane)
    assert decode_values(data)[0]["bap"] == {1: 192 * 64 * 5, 3: -192 * 64 * 5}
    assert decode_values(data, bap_steps="visage")[0]["bap"] == {1: 192 * 170 * 5, 3: -192 * 170 * 5}


def test_extension_baps_need_their_ranges() -> None:
    start = I_BAPS + NO_RATE + NO_TIME + NO_SKIP + f"{1:05b}" + bap_masks(20, "1" + "0" * 21) + GENDER_CODING
    with pytest.raises(BitstreamError, match=r"BAP 187 .*range was never sent"):
        decode_values(one_object(start + NO_LISTS + segment([0], [(-60, 60)])))


def test_ranges_persist_and_are_divided_by_the_new_quantiser() -> None:
    """List i_max alone in plane 0; plane 1 has no list, quantiser 7: 1860 // 7, and -1080 // 7 toward 0."""
    i_max = "".join("1" * (position % 4 == 0) + "11111" * (number == 3) for number, position in FAP_POSITIONS)
    time = NO_RATE + NO_TIME + NO_SKIP
    first = (
        I_FAPS + time + f"{1:05b}" + JAW + GENDER_CODING + "1000" + i_max + segment([1860], [(-1080, 1860)])
    )
    second = intra(7, JAW, segment([-154], [(-154, 265)]))
    planes = decode_values(one_object(first, second))
    assert [p["fap"][3] for p in planes] == [1860 * 4, -154 * 4 * 7]
    assert [p["fap_lists"] for p in planes] == ["1000", "0000"]


FAP_POSITIONS = list(enumerate((n for size in FAP_GROUP_SIZES[1:] for n in range(size)), 3))


def test_time_runs_on_over_skips_rates_and_time_codes() -> None:
    p_plane = P_FAPS + NO_SKIP + encode_segment([360], [FrequencyTable(721)], learn=True)
    rate_10 = "1" + f"{10:08b}" + "0000" + "0"
    code = "1" + f"{1:05b}{2:06b}" + "1" + f"{3:06b}"
    planes = decode_values(
        one_object(
            intra(1, JAW, segment([5], JAW_LIMITS), time=rate_10 + NO_TIME + "1" + "0100"),  # 4 skipped
            p_plane,
            intra(1, JAW, segment([5], JAW_LIMITS), time=NO_RATE + code + NO_SKIP),
            intra(1, JAW, segment([5], JAW_LIMITS)),
        )
    )
    hour = 3723
    assert [p["time"] for p in planes] == [0, Fraction(5, 10), hour, hour + Fraction(1, 10)]
    assert decode_values(one_object(JAW_PLANE, JAW_PLANE))[1]["time"] is None  # no rate was ever said


def test_time_code_with_marker_0_is_read_with_a_warning() -> None:
    time = NO_RATE + "1" + f"{1:05b}{2:06b}" + "0" + f"{3:06b}" + NO_SKIP
    with pytest.warns(FbaWarning, match="plane 0, bit 48: the marker bit of the time code is 0"):
        (plane,) = decode_values(one_object(intra(1, JAW, segment([5], JAW_LIMITS), time=time)))
    assert plane["time_code"] == (1, 2, 0, 3)


def test_start_codes_between_planes_old_and_new() -> None:
    bits = stuffed(OBJECT) + PLANE + JAW_PLANE  # aligned already: a whole byte 0x7F
    bits = stuffed(bits) + OLD_PLANE + JAW_PLANE
    data = as_bytes(stuffed(bits) + END)
    names = [e.name for e in trace(data) if "code" in e.name and e.plane is None]
    assert names == [
        "fba_object_start_code",
        "fba_object_plane_start_code",
        "fba_object_plane_start_code (old)",
        "visual_object_sequence_end_code",
    ]
    assert [p["start_code"] for p in decode_values(data)] == [0x1BB, 0x103]
    old = as_bytes(stuffed(OLD_OBJECT + OLD_PLANE + JAW_PLANE) + END)  # and without stuffing
    assert [p["fap"] for p in decode_values(old)] == [{3: 20}]


def test_plane_behind_a_start_code_may_look_like_another() -> None:
    """P plane, FAPs and BAPs, skip 15: 0 11 1 1111 is 0x7F; then 0000 and 19 zeros of levels, and a 1."""
    both = "1" + "11" + NO_RATE + NO_TIME + NO_SKIP
    no_baps = f"{1:05b}" + NO_BAPS * 24 + GENDER_CODING + NO_LISTS + "01"
    levels = segment([0, 0], [(-1080, 1080), (-600, 600)])
    first = both + f"{1:05b}" + fap_masks(3, 4) + GENDER_CODING + NO_LISTS + levels + no_baps
    highest = encode_segment([720, 360], [FrequencyTable(721), FrequencyTable(361)], learn=True)
    assert highest == "0" * 19 + "1"
    second = "0" + "11" + "1" + "1111" + "0000" + highest + "01"
    planes = decode_values(as_bytes(stuffed(stuffed(OBJECT + first) + PLANE + second) + END))
    assert [p["fap"] for p in planes] == [{3: 0, 4: 0}, {3: 360 * 4, 4: 180 * 2}]


@pytest.mark.parametrize("end", ["", OBJECT, f"{0x1B0:032b}"])
def test_any_other_start_code_or_the_end_of_the_data_ends_the_object(end: str) -> None:
    data = as_bytes(stuffed(OBJECT + JAW_PLANE) + end)
    assert [p["fap"] for p in decode_values(data)] == [{3: 20}]


UP_TO_QUANT = I_FAPS + NO_RATE + NO_TIME + NO_SKIP + "00001"


@pytest.mark.parametrize(
    ("bits", "plane", "bit", "text"),
    [
        ("", None, 0, "an FBA object starts with 000001ba or 00000101, found 00000000"),
        (OBJECT + "100" + "00000", 0, 33, "fba_object_mask is 0"),
        (OBJECT + P_FAPS + "00000", 0, 33, "no I plane carried them"),
        (OBJECT + JAW_PLANE + P_BAPS + "00000", 1, 32 + len(JAW_PLANE) + 1, "BAPs in a predicted plane"),
        (OBJECT + UP_TO_QUANT + "000" + "0" * 40, 0, 43, "marker_bit in fap group 1 is 0"),
        (OBJECT + I_BAPS + "000" + "00001" + "110" + "0" * 40, 0, 44, "bap_mask_type of group 1 is 2"),
        (OBJECT + UP_TO_QUANT + "10010", 0, 47, "fap_mask_type: needs 2 bits, but the data ends after 1"),
        (
            OBJECT + intra(1, fap_masks(1), segment([9, 0, 0], [(0, 14), (0, 14), (0, 63)]), "0", "01")
            + P_FAPS + NO_SKIP
            + encode_segment([28, 14, 63], [FrequencyTable(n) for n in (29, 29, 127)], learn=True) + "0" * 9,
            1, None, "viseme_select1 becomes 23, expected 0..14",
        ),
    ],
    ids=["start code", "mask 0", "P first", "BAPs in P first", "marker", "BAP mask type", "cut", "select"],
)  # fmt: skip
def test_damage_names_element_plane_and_bit(bits: str, plane: int | None, bit: int | None, text: str) -> None:
    with pytest.raises(BitstreamError, match=text) as caught:
        list(trace(as_bytes(bits[: len(bits) // 8 * 8] or "0" * 32)))
    assert caught.value.plane == plane
    if bit is not None:
        assert caught.value.bit == bit


def collect(data: bytes) -> tuple[list[Element], FbaError | None]:
    """The elements up to the end, or up to the error."""
    elements: list[Element] = []
    try:
        elements.extend(trace(data))
    except FbaError as error:
        return elements, error
    return elements, None


def test_elements_before_damage_are_given() -> None:
    data = as_bytes(OBJECT + JAW_PLANE + "0" * (-len(JAW_PLANE) % 8) + "0" * 64)
    elements, error = collect(data)
    assert isinstance(error, BitstreamError)
    assert [e.plane for e in elements if e.name == "faps segment"] == [0]
    assert [e.name for e in elements if e.plane == 1] == ["is_intra", "fba_object_mask"]
    assert contiguous(elements)


def test_dct_segments_are_unsupported() -> None:
    data = as_bytes(stuffed(OBJECT + UP_TO_QUANT + JAW + "0" + "1"))
    with pytest.raises(UnsupportedError, match="DCT") as caught:
        list(trace(data))
    bit = 32 + len(UP_TO_QUANT) + len(JAW) + 1
    assert (caught.value.plane, caught.value.bit) == (0, bit)


def test_unknown_steps_are_refused() -> None:
    with pytest.raises(ValueError, match="iso, visage"):
        next(trace(b"", bap_steps="other"))


def check_hostile(data: bytes) -> None:
    """Only FbaError, and elements without gaps up to the damage."""
    elements, error = collect(data)
    assert contiguous(elements)
    if error is None:
        assert sum(e.bits for e in elements) == len(data) * 8
    else:
        assert isinstance(error, BitstreamError | UnsupportedError)
        assert error.bit is not None
        assert 0 <= error.bit <= len(data) * 8


RICH = one_object(
    intra(
        2,
        fap_masks(1, 2, 3, 48, 49),
        segment([1, 2, 9], [(0, 14), (0, 14), (0, 32)]) + "0",
        segment([1, 2, 3, 4], [(0, 6), (0, 32), (0, 6), (0, 32)]) + "00",
        segment([5, -6, 7], [(-540, 540), (-930, 930), (-930, 930)]),
    ),
    intra(1, JAW, segment([5], JAW_LIMITS)),
)


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_rich_stream_is_good_and_survives_cuts_and_flips() -> None:
    assert [p["fap"] for p in decode_values(RICH)] == [{3: 40, 48: -6 * 2 * 170, 49: 7 * 2 * 170}, {3: 20}]
    for length in range(len(RICH)):
        check_hostile(RICH[:length])
    for bit in range(len(RICH) * 8):
        check_hostile(flipped(RICH, bit))


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
@given(st.binary(max_size=300))
def test_arbitrary_bytes(noise: bytes) -> None:
    check_hostile(noise)
    check_hostile(OBJECT_BYTES + noise)


OBJECT_BYTES = as_bytes(OBJECT)


def test_listing_has_a_line_per_element() -> None:
    elements = list(trace(RICH))
    lines = list(format_trace(elements))
    assert len(lines) == 1 + len(elements)
    assert lines[0].split() == ["bit", "bits", "plane", "element"]
    assert lines[1].split() == ["0", "32", "fba_object_start_code", "=", "0x000001ba"]
    assert lines[2].split() == ["32", "1", "0", "is_intra", "=", "1"]
    jaw = next(line for line in lines if "faps segment" in line)
    assert jaw.endswith(
        "faps segment = 3 levels, 3 not 0: FAP 3 open_jaw +5, FAP 48 head_pitch -6, FAP 49 head_yaw +7"
    )
    assert lines[-1].endswith("visual_object_sequence_end_code = 0x000001b1")
    detailed = list(format_trace(elements, values=True))
    assert "FAP 48 head_pitch: level -6, value -2040" in [line.strip() for line in detailed]


def test_elements_as_json() -> None:
    records = [json.loads(json.dumps(element_dict(element))) for element in trace(RICH)]
    assert records[1] == {
        "bit": 32, "bits": 1, "plane": 0, "section": "plane", "name": "is_intra", "value": 1,
    }  # fmt: skip
    segment = next(r for r in records if r["name"] == "viseme segment")
    assert segment["value"] == {
        "inserted_bits": 0,
        "levels": {"viseme_select1": 1, "viseme_select2": 2, "viseme_blend": 9},
        "values": {"viseme_select1": 1, "viseme_select2": 2, "viseme_blend": 18},
    }
    assert isinstance(next(e for e in trace(RICH) if e.name == "viseme segment").value, Levels)


def test_an_object_behind_another_may_begin_with_a_plane_start_code() -> None:
    """Only the first object is read, and a plane start code in the second is none outside of an object."""
    second = as_bytes(stuffed(OBJECT + PLANE + JAW_PLANE) + END)
    data = as_bytes(stuffed(OBJECT + JAW_PLANE)) + second
    assert [plane["number"] for plane in decode_values(data)] == [0]
    with pytest.raises(BitstreamError, match="a plane start code behind the end of the object"):
        decode_values(one_object(JAW_PLANE) + second[4:])
