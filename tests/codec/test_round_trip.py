"""Whatever an animation holds, encoding and decoding gives it back, each value to the nearest step."""

from fractions import Fraction

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codec_streams import animations, steps
from fba import Animation, BodyTrack, Decoder, EncoderOptions, FaceTrack, decode, encode
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
