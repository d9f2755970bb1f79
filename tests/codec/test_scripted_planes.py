"""Planes encoded as they are told to be, and what settings that do not fit are answered with."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from codec_streams import BAP_GROUPS
from fba import Animation, BodyTrack, FaceTrack, RangeError, decode, probe
from fba.codec import Decoder, Encoder, FrameBuffer, FrameRate, PartSettings, PlaneSettings, encode_planes

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
