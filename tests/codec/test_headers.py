"""Every header element: written from settings, read by the independent reader and by the decoder."""

from fractions import Fraction

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codec_streams import BAP_GROUPS, FAP_GROUP_SIZES
from fba import Animation, BodyTrack, Decoder, FaceTrack, FbaWarning
from fba.codec import FrameRate, PartSettings, PlaneSettings, RangeLists, TimeCode, encode_planes
from fba.parameters import bap_groups, baps, fap_groups, faps
from fba_conformance.trace import trace

LISTS = ("i_new_max", "i_new_min", "p_new_max", "p_new_min")
FLUSH = 2


def groups(kind: str) -> tuple[tuple[int, ...], ...]:
    return fap_groups() if kind == "fap" else bap_groups()


@st.composite
def part_settings(draw: st.DrawFn, kind: str) -> PartSettings:
    """Any header of a half: mask types, masks, quantiser, range lists (for BAPs all)."""
    count = 68 if kind == "fap" else 296
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    types = [int(random.choice([0, 1, 2, 3] if kind == "fap" else [0, 1, 3])) for _ in groups(kind)]
    mask = np.zeros(count, dtype=bool)
    for mask_type, group in zip(types, groups(kind), strict=True):
        columns = np.array(group) - 1
        mask[columns] = mask_type == 3 if mask_type in {0, 3} else random.random(len(group)) < 0.5
    sent = [True] * 4 if draw(st.booleans()) or kind == "bap" else [draw(st.booleans()) for _ in range(4)]
    codes = [random.integers(0, 32, count).astype(np.uint8) if one else None for one in sent]
    return PartSettings(
        tuple(types), mask, draw(st.integers(0, 31)), draw(st.integers(0, 1)), 0, RangeLists(*codes)
    )


@st.composite
def plane_settings(draw: st.DrawFn, first: bool) -> PlaneSettings:
    halves = draw(st.integers(1, 3))
    rate = FrameRate(draw(st.integers(1, 255)), draw(st.integers(0, 15)), draw(st.integers(0, 1)))
    code = TimeCode(draw(st.integers(0, 31)), draw(st.integers(0, 59)), draw(st.integers(0, 59)))
    return PlaneSettings(
        True,
        face_frame=0 if halves & 1 else None,
        body_frame=0 if halves & 2 else None,
        face=draw(part_settings("fap")) if halves & 1 else None,
        body=draw(part_settings("bap")) if halves & 2 else None,
        frame_rate=rate if first or draw(st.booleans()) else None,
        time_code=code if draw(st.booleans()) else None,
        skip=draw(st.sampled_from([0, 1, 14, 15, 16, 30, 31, 100])),
        start_code=not first and draw(st.booleans()),
    )


def expected_part(kind: str, part: PartSettings) -> list[tuple[str, object]]:
    """The elements of one half of an I plane by the syntax table, arithmetic segments by name only."""
    labels = [one.label for one in (faps() if kind == "fap" else baps())]
    elements: list[tuple[str, object]] = [(f"{kind}_quant", part.quant)]
    for mask_type, group in zip(part.mask_types, groups(kind), strict=True):
        elements += [("marker_bit", 1), (f"{kind}_mask_type", mask_type)]
        if mask_type in {1, 2}:
            bits = "".join(str(int(part.mask[number - 1])) for number in group)
            elements.append((f"{kind}_group_mask", bits))
    elements += [("suggested_gender", part.gender), ("object_coding_type", 0)]
    elements += [
        (f"is_{name}", int(codes is not None)) for name, codes in zip(LISTS, part.ranges, strict=True)
    ]
    for name, codes in zip(LISTS, part.ranges, strict=True):
        if codes is None:
            continue
        for group in groups(kind)[1:] if kind == "fap" else groups(kind):
            for position, number in enumerate(group):
                if position % 4 == 0:
                    elements.append(("marker_bit", 1))
                if part.mask[number - 1]:
                    elements.append((f"{name} {labels[number - 1]}", int(codes[number - 1])))
    if kind == "fap":
        if part.mask[0]:
            elements += [("viseme segment", None), ("viseme_def", 0)]
        if part.mask[1]:
            elements += [("expression segment", None), ("init_face", 0), ("expression_def", 0)]
    elements.append((f"{kind}s segment", None))
    return elements


def expected(plane: PlaneSettings) -> list[tuple[str, object]]:
    elements: list[tuple[str, object]] = [
        ("is_intra", 1),
        ("fba_object_mask", (plane.face is not None) + 2 * (plane.body is not None)),
        ("is_frame_rate", int(plane.frame_rate is not None)),
    ]
    if plane.frame_rate is not None:
        rate = plane.frame_rate
        elements += [("frame_rate", rate.frame_rate), ("seconds", rate.seconds)]
        elements.append(("frequency_offset", rate.frequency_offset))
    elements.append(("is_time_code", int(plane.time_code is not None)))
    if plane.time_code is not None:
        code = plane.time_code
        elements += [("time_code_hours", code.hours), ("time_code_minutes", code.minutes)]
        elements += [("marker_bit", 1), ("time_code_seconds", code.seconds)]
    elements.append(("skip_frames", int(plane.skip > 0)))
    if plane.skip:
        words = [15] * (plane.skip // 15) + [plane.skip % 15]
        elements += [("number_of_frames_to_skip", word) for word in words]
    for kind, part in (("fap", plane.face), ("bap", plane.body)):
        if part is not None:
            elements += expected_part(kind, part)
    return elements


def resting() -> Animation:
    """One frame at rest, which any ranges hold."""
    face = FaceTrack(np.zeros((1, 68), dtype=np.int32), np.zeros((1, 68), dtype=bool))
    body = BodyTrack(np.zeros((1, 296), dtype=np.int32), np.zeros((1, 296), dtype=bool))
    return Animation(Fraction(25), np.array([0]), face, body)


@given(plane_settings(True), plane_settings(False))
@settings(max_examples=40)
def test_the_independent_reader_reads_the_written_elements(one: PlaneSettings, two: PlaneSettings) -> None:
    data = encode_planes(resting(), [one, two])
    elements = list(trace(data))
    position = 0
    for element in elements:
        assert element.bit == position
        position += element.bits
    assert position == 8 * len(data)
    assert [e.name for e in elements[-2:]] == ["alignment stuffing", "visual_object_sequence_end_code"]
    for number, plane in enumerate((one, two)):
        found = [e for e in elements if e.plane == number]
        wanted = expected(plane)
        assert [e.name for e in found] == [name for name, _ in wanted]
        for element, (name, value) in zip(found, wanted, strict=True):
            assert value is None or element.value == value, name
    codes = [e.name for e in elements if e.plane is None and "code" in e.name]
    plane_code = ["fba_object_plane_start_code"] * two.start_code
    assert codes == ["fba_object_start_code", *plane_code, "visual_object_sequence_end_code"]


def same_part(one: PartSettings | None, other: PartSettings | None) -> bool:
    if one is None or other is None:
        return one is other
    mask = one.mask.copy()
    if len(mask) == 68:
        mask[:2] = False
    return (
        (one.mask_types, one.quant, one.gender, one.coding_type)
        == (other.mask_types, other.quant, other.gender, other.coding_type)
        and np.array_equal(one.mask, other.mask)
        and all(same_codes(a, b, mask) for a, b in zip(one.ranges, other.ranges, strict=True))
    )


def same_codes(
    one: npt.NDArray[np.uint8] | None, other: npt.NDArray[np.uint8] | None, mask: npt.NDArray[np.bool_]
) -> bool:
    if one is None or other is None:
        return one is other
    return np.array_equal(one[mask], other[mask])


@given(plane_settings(True), plane_settings(False))
@settings(max_examples=60)
@pytest.mark.filterwarnings("ignore::fba.FbaWarning")  # time codes that go back, rates that change
def test_the_decoder_reports_what_was_written(one: PlaneSettings, two: PlaneSettings) -> None:
    decoder = Decoder()
    data = encode_planes(resting(), [one, two])
    frames = decoder.push(data) + decoder.finish()
    assert len(frames) == 2
    for frame, plane in zip(frames, (one, two), strict=True):
        got = frame.plane.settings
        assert (got.intra, got.frame_rate, got.time_code) == (True, plane.frame_rate, plane.time_code)
        assert (got.skip, got.start_code) == (plane.skip, plane.start_code)
        assert same_part(got.face, plane.face)
        assert same_part(got.body, plane.body)
        for kind, track in (("face", frame.face), ("body", frame.body)):
            part = getattr(plane, kind)
            assert (track is None) == (part is None)
            if track is not None:
                assert np.array_equal(track.mask[0], part.mask)
                assert not track.values.any()
    assert frames[1].plane.bit == frames[0].plane.bit + frames[0].plane.bits


def test_sizes_of_the_groups() -> None:
    assert tuple(len(group) for group in fap_groups()) == FAP_GROUP_SIZES
    assert len(bap_groups()) == BAP_GROUPS
    assert sum(len(group) for group in bap_groups()) == 296


def test_time_codes_with_warnings() -> None:
    """Time codes that a second plane puts back are told of by the decoder (the settings keep them)."""
    part = PartSettings((0,) * 10, np.zeros(68, dtype=bool))
    planes = [
        PlaneSettings(True, 0, face=part, frame_rate=FrameRate(25), time_code=TimeCode(1, 0, 0)),
        PlaneSettings(True, 0, face=part, time_code=TimeCode(0, 59, 59)),
    ]
    decoder = Decoder()
    with pytest.warns(FbaWarning, match="plane 1, bit [0-9]+: time code 0:59:59 lies before"):
        frames = decoder.push(encode_planes(resting(), planes))
    assert frames[1].plane.settings.time_code == TimeCode(0, 59, 59)
