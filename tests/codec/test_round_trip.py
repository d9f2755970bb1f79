"""Whatever an animation holds comes back; planes as they are told to be; settings that do not fit."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codec_streams import BAP_GROUPS, animations, steps
from fba import Animation, BodyTrack, Decoder, EncoderOptions, FaceTrack, RangeError, decode, encode, probe
from fba.codec import Encoder, FrameBuffer, FrameRate, PartSettings, PlaneSettings, encode_planes
from fba_conformance._values import plane_records
from fba_conformance.trace import decode_values
from tools import synthetic_motion as motion

QUANTS = st.one_of(st.sampled_from([0, 1, 2]), st.integers(0, 31))
PERIODS = st.sampled_from([None, None, Fraction(1, 100), Fraction(1, 5), 2.5])


def check_values(
    source: npt.NDArray[np.int32], got: npt.NDArray[np.int32], step: npt.NDArray[np.int64]
) -> None:
    """The standard's rule: nearest multiple of the step, so off by half a step at most."""
    assert (2 * np.abs(got.astype(np.int64) - source) <= step).all()
    whole = source % step == 0
    assert np.array_equal(got[whole], source[whole])
    assert not (got % step).any()


def check_amounts(source: npt.NDArray[np.int16], got: npt.NDArray[np.int16], quant: int) -> None:
    """Blends and intensities have a step of fap_quant."""
    assert (2 * np.abs(got.astype(int) - source) <= max(quant, 1)).all()


@given(st.data(), QUANTS, QUANTS, PERIODS, st.booleans(), st.sampled_from(["keep", "interpolate"]))
@settings(max_examples=150)
def test_any_animation(
    data: st.DataObject,
    fap_quant: int,
    bap_quant: int,
    period: Fraction | float | None,
    start_codes: bool,
    unsent: str,
) -> None:
    table = data.draw(st.sampled_from(["iso", "visage"]))
    source = data.draw(animations(fap_quant, bap_quant, table))
    options = EncoderOptions(
        fap_quant=fap_quant,
        bap_quant=bap_quant,
        intra_period=period,
        start_codes=start_codes,
        unsent=unsent,
        bap_steps=table,
    )
    got = decode(encode(source, options), bap_steps=table)
    assert got.rate == source.rate
    assert np.array_equal(got.index, source.index)
    assert (got.face is None, got.body is None) == (source.face is None, source.body is None)
    if source.face is not None and got.face is not None:
        assert np.array_equal(got.face.mask, source.face.mask)
        check_values(source.face.values, got.face.values, steps("face", fap_quant))
        assert np.array_equal(got.face.viseme[:, [0, 1, 3]], source.face.viseme[:, [0, 1, 3]])
        check_amounts(source.face.viseme[:, 2], got.face.viseme[:, 2], fap_quant)
        assert np.array_equal(got.face.expression[:, [0, 2, 4, 5]], source.face.expression[:, [0, 2, 4, 5]])
        check_amounts(source.face.expression[:, [1, 3]], got.face.expression[:, [1, 3]], fap_quant)
    if source.body is not None and got.body is not None:
        assert np.array_equal(got.body.mask, source.body.mask)
        check_values(source.body.values, got.body.values, steps("body", bap_quant, table))


@given(st.data(), QUANTS, QUANTS, PERIODS)
@settings(max_examples=12)
def test_the_independent_reader_agrees(
    data: st.DataObject, fap_quant: int, bap_quant: int, period: Fraction | None
) -> None:
    source = data.draw(animations(fap_quant, bap_quant))[:6]
    coded = encode(source, EncoderOptions(fap_quant=fap_quant, bap_quant=bap_quant, intra_period=period))
    decoder = Decoder()
    frames = decoder.push(coded) + decoder.finish()
    theirs = decode_values(coded)
    for frame, plane in zip(frames, theirs, strict=True):  # a time code need not fall on a frame
        assert abs(frame.time - plane["time"]) * source.rate <= Fraction(1, 2)
    assert [f.plane.bit for f in frames] == [p["bit"] for p in theirs]
    for ours, plane in zip(plane_records(frames), theirs, strict=True):
        assert ours["bits"] == plane["bits"]
        assert ours["fap"] == {str(number): value for number, value in plane["fap"].items()}
        assert ours["bap"] == {str(number): value for number, value in plane["bap"].items()}
        assert (ours["viseme"], ours["expression"]) == (plane["viseme"], plane["expression"])


@pytest.mark.parametrize("quant", range(32))
def test_every_value_at_every_quantiser(quant: int) -> None:
    """FAP 48 (step 170, even) and FAP 3 (step 4): a sweep, as I planes and as differences."""
    largest = 1860 // max(quant, 1) * (170 * quant or 1)
    sweep = np.linspace(-largest, largest, 400).astype(np.int32)
    half = 170 * quant // 2
    sweep[:6] = [0, min(half, largest), -min(half, largest), min(half + 1, largest), largest, -largest]
    values = np.zeros((400, 68), dtype=np.int32)
    mask = np.zeros((400, 68), dtype=bool)
    mask[:, 47] = True
    values[:, 47] = sweep
    track = FaceTrack(values, mask)
    step = np.array([170 * quant or 1])
    for period in (None, Fraction(1, 25)):
        source = Animation(Fraction(25), np.arange(400), track)
        got = decode(encode(source, EncoderOptions(fap_quant=quant, intra_period=period)))
        check_values(values[:, 47:48], got.face.values[:, 47:48], step)
        if period is not None:  # I planes round halves toward 0 once, then away from it
            assert got.face.values[1, 47] == 0


def test_a_part_that_returns_behind_a_start_code() -> None:
    """A reader that joined at the start code has never seen the body: its return must be an I plane."""
    face, body = motion.face(12, faps_sent=(3,)), motion.body(12, baps_sent=(1,))
    mask = body.mask.copy()
    mask[3:8] = False
    source = Animation(Fraction(25), np.arange(12), face, BodyTrack(body.values, mask))
    coded = encode(source, EncoderOptions(intra_period=Fraction(5, 25), start_codes=True, mark=False))
    at = coded.index(b"\0\0\1\xbb")
    decoder = Decoder()
    joined = decoder.push(coded[:4] + coded[at:]) + decoder.finish()
    whole = Decoder().push(coded)
    assert len(joined) == len([f for f in whole if f.plane.bit >= 8 * at - 8])
    for frame, same in zip(reversed(joined), reversed(whole), strict=False):
        assert (frame.face, frame.body) == (same.face, same.body)


def test_parts_that_send_nothing_cost_no_plane() -> None:
    """A face at rest with no mask bit: planes without FAPs, but the stream says that there is a face."""
    face, body = FaceTrack.empty(5), motion.body(5)
    source = Animation(Fraction(25), np.arange(5), face, body)
    decoder = Decoder()
    frames = decoder.push(encode(source)) + decoder.finish()
    assert [f.face is not None for f in frames] == [True, False, False, False, False]
    assert decode(encode(source)).face == face


def test_masks_that_come_and_go_within_an_encoder() -> None:
    """A part that pauses goes on as P planes: the models and last values outlive the pause."""
    face = motion.face(9, faps_sent=(3, 5))
    mask = face.mask.copy()
    mask[3:6] = False
    source = Animation(Fraction(25), np.arange(9), FaceTrack(face.values, mask), motion.body(9))
    decoder = Decoder()
    frames = decoder.push(encode(source)) + decoder.finish()
    assert [f.plane.settings.intra for f in frames] == [True] + [False] * 8
    assert [f.face is not None for f in frames] == [True] * 3 + [False] * 3 + [True] * 3


OPEN_JAW = 2
"""Column of FAP 3, in group 2."""


def jaw(*values: int) -> Animation:
    """A face that sends FAP 3 with these values, from frame 10 on."""
    columns = np.zeros((len(values), 68), dtype=np.int32)
    columns[:, OPEN_JAW] = values
    mask = np.zeros(columns.shape, dtype=bool)
    mask[:, OPEN_JAW] = True
    return Animation(Fraction(25), np.arange(10, 10 + len(values)), FaceTrack(columns, mask), None)


def bodies(frames: int) -> BodyTrack:
    return BodyTrack(np.zeros((frames, 296), dtype=np.int32), np.ones((frames, 296), dtype=bool))


def face(quant: int = 1) -> PartSettings:
    mask = np.zeros(68, dtype=bool)
    mask[OPEN_JAW] = True
    return PartSettings((0, 1, *[0] * 8), mask, quant)


def body() -> PartSettings:
    mask = np.zeros(296, dtype=bool)
    mask[0] = True
    return PartSettings((1, *[0] * (BAP_GROUPS - 1)), mask, 1)


INTRA = PlaneSettings(True, 10, face=face(), frame_rate=FrameRate(25))


def predicted(frame: int, part: PartSettings | None = INTRA.face) -> PlaneSettings:
    return PlaneSettings(False, frame, face=part)


def test_planes_code_the_frames_that_they_name() -> None:
    """The last plane codes a frame a second time, after two skipped frames; the step of FAP 3 is 4."""
    planes = [INTRA, predicted(12), replace(predicted(11), skip=2), predicted(11)]
    animation = decode(encode_planes(jaw(100, 108, 120), planes))
    assert animation.index.tolist() == [0, 1, 2, 5]
    assert animation.face.values[:, OPEN_JAW].tolist() == [100, 120, 108, 108]


@pytest.mark.parametrize(
    ("planes", "message"),
    [([], "no planes to encode"), ([predicted(10)], "plane 0 is a P plane before the first I plane")],
)
def test_planes_in_an_order_that_cannot_be_coded(planes: list[PlaneSettings], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        encode_planes(jaw(0), planes)


def test_a_value_outside_the_ranges() -> None:
    """By default, levels are within 1860: 1860 x 4 = 7440 for FAP 3."""
    with pytest.raises(
        RangeError, match="plane 0 codes the value 99999 as level 25000, which the ranges"
    ) as caught:
        encode_planes(jaw(99_999), [INTRA])
    assert (caught.value.value, caught.value.frame) == (99_999, 10)
    assert "3" in str(caught.value.parameter)
    with pytest.raises(RangeError, match="plane 2 codes the value -9000") as caught:
        encode_planes(jaw(0, 0, -9000), [INTRA, predicted(11), predicted(12)])
    assert caught.value.value == -9000


@pytest.mark.parametrize(
    ("planes", "message"),
    [
        (
            [replace(INTRA, face_frame=13)],
            r"plane 0 codes frame 13, .* no frame of that number \(it has 10..10\)",
        ),
        ([INTRA, predicted(9)], "plane 1 codes frame 9"),
    ],
)
def test_frames_that_the_animation_lacks(planes: list[PlaneSettings], message: str) -> None:
    with pytest.raises(RangeError, match=message):
        encode_planes(jaw(0), planes)


def test_parts_that_the_animation_lacks() -> None:
    no_face = replace(jaw(0), face=None, body=bodies(1))
    with pytest.raises(RangeError, match="carry FAPs, but the animation has no face track"):
        encode_planes(no_face, [INTRA])
    with pytest.raises(RangeError, match="carry BAPs, but the animation has no body track"):
        encode_planes(jaw(0), [PlaneSettings(True, body_frame=10, body=body(), frame_rate=FrameRate(25))])


def test_p_planes_of_a_face_alone_between_those_of_both() -> None:
    both = replace(jaw(4, 8, 12), body=bodies(3))
    part = body()
    first = replace(INTRA, body_frame=10, body=part)
    second = PlaneSettings(False, 11, 11, INTRA.face, part)
    animation = decode(encode_planes(both, [first, second, predicted(12), second]))
    assert animation.face.values[:, OPEN_JAW].tolist() == [4, 8, 12, 8]
    assert animation.body.mask[:, 0].tolist() == [True, True, False, True]


def test_frames_that_come_too_late_for_an_encoder() -> None:
    encoder = Encoder()
    first = replace(jaw(0), index=np.arange(1))
    encoder.push_animation(first)
    with pytest.raises(ValueError, match="the stream has 25 frames/s, this frame 30; resample it first"):
        encoder.push_animation(replace(first, rate=Fraction(30)))
    encoder.finish()
    with pytest.raises(ValueError, match="this encoder is finished; make a new one for another stream"):
        encoder.push_animation(first)


def test_a_description_for_json() -> None:
    planes = [replace(INTRA, skip=2), predicted(11), predicted(12)]
    stream = encode_planes(jaw(0, 4, 8), planes)
    info = probe(stream)
    assert info.bits_per_second == pytest.approx(8 * len(stream) * 25 / 5)
    plain = info.to_dict()
    assert plain["face"] == {
        "parameters": [3],
        "frames": 3,
        "quants": [1],
        "mask_types": ["none", "keep"],
        "genders": [0],
    }
    assert plain["body"] is None
    assert (plain["rate"], plain["frames_per_second"], plain["frames"]) == ("25", 25.0, 3)
    assert (plain["intra_planes"], plain["start_codes"], plain["damage"]) == (1, 0, [])


def test_a_frame_buffer_without_frames_and_with_a_late_part() -> None:
    frames = FrameBuffer()
    with pytest.raises(ValueError, match="there is no frame to make an animation of"):
        frames.decoded().animation()
    decoder = Decoder()
    (block,) = decoder.push_blocks(encode_planes(jaw(4), [INTRA])) + decoder.finish_blocks()
    frames.fix_parts()
    frames.add(block)
    now = frames.decoded()
    assert (now.face, frames.left_out, len(now.index)) == (None, "a face", 1)
