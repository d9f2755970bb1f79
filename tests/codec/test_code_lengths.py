"""Code lengths are those of the coder; quantised values are those of the decoder."""

import numpy as np
import pytest

import fba
from fba import Animation, BodyTrack, EncoderOptions, FaceTrack
from fba.codec import Encoder, coarsest_quantisers, count_rounded, exact_quantisers, quantise
from fba.parameters import bap_steps, faps
from fba.planning._code_lengths import code_lengths


def test_estimated_lengths_are_those_of_the_coder() -> None:
    rng = np.random.default_rng(5)
    step = np.array([0, 0, *(one.step for one in faps()[2:])])
    moving = rng.random(68) < 0.7
    values = np.cumsum(rng.integers(-2, 3, (800, 68)), axis=0) * step * moving
    sent = FaceTrack(values.astype(np.int32), np.broadcast_to(values.any(axis=0), values.shape))
    options = EncoderOptions()
    estimated = code_lengths(sent, np.array([0, 800]), options)[:, 0, 1].sum() / 8
    planes = 799 * 6 / 8  # a header of 4 bits, and 2 that end the segment
    length = len(fba.encode(Animation(25, np.arange(800), sent), options))
    assert length == pytest.approx(estimated + planes, rel=0.01)


def test_estimates_between_cuts_equal_those_of_these_frames_alone() -> None:
    rng = np.random.default_rng(6)
    values = np.cumsum(rng.integers(-9, 10, (90, 296)), axis=0).astype(np.int32) * 128
    values[:, 20:] = 0
    cuts = np.array([0, 17, 40, 90])
    options = EncoderOptions(bap_quant=3)
    all_bits = code_lengths(BodyTrack(values, values != 0), cuts, options)
    assert not all_bits[20:].any()
    for a in range(3):
        for b in range(a + 1, 4):
            part = values[cuts[a] : cuts[b]]
            alone = code_lengths(BodyTrack(part, part != 0), np.array([0, len(part)]), options)
            assert alone[:20, 0, 1] == pytest.approx(all_bits[:20, a, b])


def test_changes_that_no_p_plane_carries_count_as_an_i_plane() -> None:
    values = np.zeros((40, 68), dtype=np.int32)
    values[20:, 13] = 1860  # thrust_jaw, from -1860
    values[:20, 13] = -1860
    track = FaceTrack(values, np.tile(np.arange(68) == 13, (40, 1)))
    bits = code_lengths(track, np.array([0, 20, 40]), EncoderOptions())[13]
    assert bits[0, 2] > bits[0, 1] + bits[1, 2] + 400


@pytest.mark.parametrize("quants", [(1, 1), (3, 4), (31, 31), (0, 0)])
def test_quantised_values_are_those_of_the_decoder(quants: tuple[int, int]) -> None:
    rng = np.random.default_rng(9)
    face = rng.integers(-900, 900, (12, 68)).astype(np.int32)
    face[:, :2] = 0
    viseme = np.stack([np.full(12, 3), np.full(12, 4), rng.integers(0, 64, 12), np.zeros(12)], axis=1)
    body = (rng.integers(-7, 8, (12, 296)) * bap_steps("iso") // 2).astype(np.int32)
    animation = Animation(
        25,
        np.arange(12),
        FaceTrack(face, np.ones((12, 68), dtype=bool), viseme.astype(np.int16)),
        BodyTrack(body, np.ones((12, 296), dtype=bool)),
    )
    options = EncoderOptions(fap_quant=quants[0], bap_quant=quants[1])
    expected = quantise(animation, options)
    assert quantise(expected, options) == expected
    assert fba.decode(fba.encode(expected, options)) == expected
    first = fba.decode(fba.encode(animation[:1], options))  # an I plane: each value by itself
    assert first == expected[:1]


def test_coarsest_quantisers_keep_all_values() -> None:
    values = np.zeros((5, 296), dtype=np.int32)
    values[:, 0] = np.arange(5) * bap_steps("iso")[0] * 14  # scale 14 is bap_quant 8
    body = BodyTrack(values, np.tile(np.arange(296) == 0, (5, 1)))
    options = coarsest_quantisers(Animation(25, np.arange(5), None, body), EncoderOptions())
    assert (options.fap_quant, options.bap_quant) == (1, 8)
    still = coarsest_quantisers(Animation(25, np.arange(2), FaceTrack.empty(2)), EncoderOptions(fap_quant=2))
    assert still.fap_quant == 2
    unquantised = EncoderOptions(fap_quant=0)
    assert coarsest_quantisers(Animation(25, np.arange(2), FaceTrack.empty(2)), unquantised) == unquantised


def test_values_between_steps_are_counted_and_kept_where_planes_can_carry_them() -> None:
    values = np.zeros((4, 68), dtype=np.int32)
    values[:, 2] = [0, 4, 7, 8]  # open_jaw has steps of 4
    values[:, 13] = [0, 1, 2, 3]
    mask = np.tile(np.isin(np.arange(68), (2, 13)), (4, 1))
    body = np.zeros((4, 296), dtype=np.int32)
    body[:, 0] = [0, 1, 2, 3]
    animation = Animation(25, np.arange(4), FaceTrack(values, mask), BodyTrack(body, body >= 0))
    options = EncoderOptions()
    rounded = count_rounded(animation, options)
    assert (rounded["face"], rounded["body"]) == (1, 3)
    exact = exact_quantisers(animation, options)
    assert (exact.fap_quant, exact.bap_quant) == (0, 0)
    assert count_rounded(animation, exact) == {}
    assert fba.decode(fba.encode(animation, exact)) == animation
    assert exact_quantisers(animation, options, parts=("face",)).bap_quant == options.bap_quant
    values[3, 2] = 5001  # no plane carries that change as it is
    far = Animation(25, np.arange(4), FaceTrack(values, mask))
    assert exact_quantisers(far, options) == options
    assert count_rounded(Animation(25, np.arange(4), FaceTrack.empty(4)), options) == {}


def test_prices_of_the_next_plane() -> None:
    values = np.zeros((12, 68), dtype=np.int32)
    values[:, 13] = [0] + [5] * 10 + [8]
    animation = Animation(25, np.arange(12), FaceTrack(values, np.tile(np.arange(68) == 13, (12, 1))))
    encoder = Encoder()
    encoder.push_animation(animation[:11])
    encoder.settle(11)
    before = encoder.bits
    plane = encoder.next_plane(animation[11:12])
    assert plane.levels(np.ones(364), 0.0).tolist() == [3]
    assert plane.levels(np.full(364, np.inf), np.inf).tolist() == [3]
    assert plane.levels(np.ones(364), np.inf).tolist() == [0]
    cheap, dear = (plane.levels(np.full(364, weight), 1.0) for weight in (100.0, 1e-3))
    assert cheap.tolist() == [3]
    assert dear.tolist() == [0]  # what is still stays still
    assert plane.with_levels(np.array([2])).face.values[0, 13] == 7  # type: ignore[union-attr]
    bits = plane.bits(np.array([3]))
    assert encoder.bits == before  # nothing was written
    encoder.push_animation(animation[11:12])
    encoder.settle(12)
    assert encoder.bits - before == bits
    more = FaceTrack(values, np.tile(np.isin(np.arange(68), (13, 14)), (12, 1)))  # another FAP: an I plane
    assert encoder.next_plane(Animation(25, np.arange(12), more)[11:12]) is None


def test_a_segment_begins_with_an_i_plane_and_new_ranges() -> None:
    values = np.zeros((60, 68), dtype=np.int32)
    values[:, 13] = np.where(np.arange(60) < 30, np.arange(60) % 2 * 900, np.arange(60) % 2)
    animation = Animation(25, np.arange(60), FaceTrack(values, np.tile(np.arange(68) == 13, (60, 1))))
    encoder = Encoder()
    data = encoder.push_segment(animation[:30]) + encoder.push_segment(animation[30:]) + encoder.finish()
    planes = [frame.plane for frame in fba.Decoder().push(data)]
    assert [number for number, plane in enumerate(planes) if plane.settings.intra] == [0, 30]
    ranges = [planes[number].settings.face.ranges for number in (0, 30)]
    assert [int(one.p_max[13]) for one in ranges] == [15, 1]
    assert fba.decode(data) == animation


@pytest.mark.parametrize("cuts", [[0, 4], [-1, 3], [0, 2, 2], [3, 0]])
def test_cuts_outside_the_frames_are_refused(cuts: list[int]) -> None:
    track = BodyTrack(np.ones((3, 296), dtype=np.int32), np.ones((3, 296), dtype=bool))
    with pytest.raises(ValueError, match="cuts must increase from 0 to 3 frames"):
        code_lengths(track, np.array(cuts), EncoderOptions())
