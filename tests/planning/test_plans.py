"""Plans: nothing that is sent or shown changes, and streams become smaller."""

import warnings
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import fba
from fba import Animation, BodyTrack, EncoderOptions, FaceTrack
from fba.codec import (
    Encoder,
    coarsest_quantisers,
    count_rounded,
    encode_animation,
    exact_quantisers,
    quantise,
)
from fba.encoder_options import PRESETS
from fba.errors import FbaWarning, OptionError
from fba.face import resolve, shown_faps
from fba.parameters import faps
from fba.planning import encode_planned, plan_compact, plan_exact
from fba.planning._segments import Cuts, cheapest_segments, find_cuts
from made_motion import LENGTH, MATES, made_animation, made_face, made_options


def held(values: np.ndarray, mask: np.ndarray) -> np.ndarray:
    last = np.maximum.accumulate(np.where(mask, np.arange(1, len(mask) + 1)[:, None], 0), axis=0)
    return np.take_along_axis(np.concatenate([np.zeros_like(values[:1]), values]), last, axis=0)


@pytest.mark.parametrize("seed", range(24))
@pytest.mark.parametrize("preset", ["exact", "compact"])
def test_a_face_shows_the_same_and_a_body_has_the_same_values(seed: int, preset: str) -> None:
    animation = made_animation(seed)
    rng = np.random.default_rng(seed)
    options = made_options(rng)
    expected = quantise(animation, options)
    assert animation.face is not None
    assert expected.face is not None
    data, _ = encode_planned(animation, options, preset=preset)
    decoded = fba.decode(data)
    assert decoded.face is not None
    assert np.array_equal(decoded.index - decoded.index[0], animation.index - animation.index[0])
    assert np.array_equal(resolve(decoded.face), resolve(expected.face))
    if preset == "exact":
        sent = decoded.face.mask
        assert np.array_equal(decoded.face.values[sent], expected.face.values[sent])
        assert not expected.face.values[animation.face.mask & ~sent].any()
    if expected.body is not None:
        assert np.array_equal(
            held(decoded.body.values, decoded.body.mask), held(expected.body.values, expected.body.mask)
        )
    assert len(data) <= len(fba.encode(animation, options))


def test_what_a_player_derives_is_not_sent() -> None:
    values = np.zeros((50, 68), dtype=np.int32)
    smile = np.arange(50) % 7 * 8
    for number in (12, 13, 59, 60):
        values[:, number - 1] = smile
    values[:, 19 - 1] = np.arange(50) % 5 * 16  # the left lid alone
    values[:25, 20 - 1] = values[:25, 19 - 1]
    mask = np.ones((50, 68), dtype=bool)
    mask[:, :2] = False
    plan = plan_compact(Animation(25, np.arange(50), FaceTrack(values, mask)))
    sent = plan.animation.face.mask
    assert sent[0].sum() == sent[0, [11, 12, 58, 59]].sum() + sent[0, [18, 19]].sum() == 3
    assert sent[-1, [18, 19]].all()
    decoded = fba.decode(plan.encode()[0]).face
    assert decoded is not None
    assert np.array_equal(shown_faps(decoded).values, values)


def test_sides_that_differ_late_get_an_i_plane() -> None:
    rng = np.random.default_rng(3)
    values = np.zeros((600, 68), dtype=np.int32)
    for one, other in MATES:
        values[:, one] = np.cumsum(rng.integers(-1, 2, 600)) * faps()[one].step
        values[:300, other] = values[:300, one]
        values[300:, other] = -values[300:, one]
    mask = np.tile(values.any(axis=0), (600, 1))
    plan = plan_compact(Animation(25, np.arange(600), FaceTrack(values, mask)))
    assert len(plan.segments) == 2
    assert abs(plan.segments[1].start - 300) <= 15
    assert plan.animation.face.mask[200].sum() * 2 == plan.animation.face.mask[400].sum()


def test_faps_that_come_later_are_not_sent_before() -> None:
    rng = np.random.default_rng(4)
    values = np.cumsum(rng.integers(-1, 2, (200, 68)), axis=0).astype(np.int32) * 2
    values[:, :2] = 0
    mask = np.zeros((200, 68), dtype=bool)
    mask[:, 4 - 1] = mask[100:, 14 - 1] = True
    track = plan_compact(Animation(25, np.arange(200), FaceTrack(values, mask))).animation.face
    assert np.array_equal(track.mask, mask)


def test_a_still_side_beside_one_that_moves_is_sent() -> None:
    values = np.zeros((20, 68), dtype=np.int32)
    values[:, 31 - 1] = np.arange(20) * 4  # raise_l_i_eyebrow
    mask = np.zeros((20, 68), dtype=bool)
    mask[:, [30, 31]] = True
    for make in (plan_exact, plan_compact):
        track = make(Animation(25, np.arange(20), FaceTrack(values, mask))).animation.face
        assert track.mask[:, [30, 31]].all()


def test_a_fap_at_0_that_overrides_a_viseme_is_sent() -> None:
    mask = np.zeros((20, 68), dtype=bool)
    mask[:, [0, 2]] = True  # the viseme, and open_jaw
    viseme = np.tile(np.array([10, 0, 63, 0], dtype=np.int16), (20, 1))
    face = FaceTrack(np.zeros((20, 68), dtype=np.int32), mask, viseme)
    for make in (plan_exact, plan_compact):
        assert make(Animation(25, np.arange(20), face)).animation.face.mask[:, [0, 2]].all()


def test_a_viseme_that_shows_nothing_is_left_out() -> None:
    mask = np.zeros((20, 68), dtype=bool)
    mask[:, [0, 1, 30]] = True
    values = np.zeros((20, 68), dtype=np.int32)
    values[:, 30] = np.arange(20)
    track = plan_exact(Animation(25, np.arange(20), FaceTrack(values, mask))).animation.face
    assert np.flatnonzero(track.mask.any(axis=0)).tolist() == [30]


def test_segments_are_the_cheapest_of_all() -> None:
    rng = np.random.default_rng(7)
    for _ in range(50):
        bits = rng.integers(1, 40, (6, 6)).astype(float)
        needed = rng.random(6) < 0.3
        cuts = Cuts(np.arange(6), needed)
        inner = [
            [0, *(i for i in range(1, 5) if chosen >> i & 1), 5]
            for chosen in range(0, 32, 2)
            if all(chosen >> i & 1 for i in range(1, 5) if needed[i])
        ]
        least = min(sum(bits[a, b] for a, b in pairwise(one)) for one in inner)  # all ways to divide
        assert sum(bits[a, b] for a, b in cheapest_segments(bits, cuts)) == least


def test_cuts_are_few_and_include_all_needed() -> None:
    needed = np.zeros(100_000, dtype=bool)
    needed[[7, 77_777]] = True
    cuts = find_cuts(needed)
    assert {0, 7, 77_777, 100_000} <= set(cuts.frames.tolist())
    assert len(cuts.frames) < 60
    assert cuts.frames[cuts.needed].tolist() == [0, 7, 77_777]
    assert find_cuts(np.ones(1000, dtype=bool)) is None


def test_masks_that_change_all_the_time_are_coded_as_they_are() -> None:
    rng = np.random.default_rng(8)
    face = made_face(rng)
    flickering = FaceTrack(face.values, face.mask & (rng.random(face.mask.shape) < 0.5))
    animation = Animation(25, np.arange(LENGTH), flickering)
    for preset in ("exact", "compact"):
        decoded = fba.decode(encode_planned(animation, preset=preset)[0]).face
        assert decoded is not None
        assert np.array_equal(resolve(decoded), resolve(flickering))


def test_quantisers_are_as_coarse_as_the_values() -> None:
    values = np.zeros((40, 68), dtype=np.int32)
    values[:, [30, 31]] = np.arange(40)[:, None] % 9 * 12
    mask = np.tile(np.arange(68) == 30, (40, 1))
    animation = Animation(25, np.arange(40), FaceTrack(values, mask))
    options = EncoderOptions()
    assert coarsest_quantisers(animation, options).fap_quant == 6  # of steps of 2
    planned = encode_planned(animation, options)[0]
    assert np.array_equal(shown_faps(fba.decode(planned).face).values, values)  # type: ignore[arg-type]
    assert len(planned) <= len(fba.encode(animation, EncoderOptions(fap_quant=6)))
    with_viseme = replace(
        animation,
        face=FaceTrack(
            values, mask | (np.arange(68) == 0), np.tile(np.array([1, 2, 63, 0], dtype=np.int16), (40, 1))
        ),
    )
    assert coarsest_quantisers(with_viseme, options).fap_quant == 3  # 63 = 21 x 3


@pytest.mark.parametrize("make", [plan_exact, plan_compact])
def test_no_frames_and_one(make) -> None:  # type: ignore[no-untyped-def]
    empty = Animation(25, np.zeros(0, dtype=np.int64), FaceTrack.empty(0))
    with pytest.raises(ValueError, match="no frame to encode"):
        make(empty)
    one = Animation(25, np.arange(1), FaceTrack.empty(1))
    assert len(fba.decode(make(one).encode()[0])) == 1


def test_presets_of_options_are_those_of_plans() -> None:
    animation = made_animation(1)
    sizes = []
    for preset in PRESETS:
        options = EncoderOptions(preset=preset)
        data = fba.encode(animation, options)
        if preset != "reference":
            assert data == encode_planned(animation, preset=preset)[0]
        sizes.append(len(data))
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[2] < sizes[0]
    assert fba.encode(animation) == encode_animation(animation)[0]
    with pytest.raises(OptionError, match=r"the preset 'compact' needs all frames.*fba\.encode"):
        Encoder(EncoderOptions(preset="compact"))


def test_values_that_a_plan_clamps_are_reported() -> None:
    values = np.zeros((3, 68), dtype=np.int32)
    values[1, 2] = 1 << 24
    animation = Animation(25, np.arange(3), FaceTrack(values, np.ones_like(values, dtype=bool)))
    with pytest.warns(FbaWarning, match="values limited to what their ranges carry"):
        fba.encode(animation, EncoderOptions(preset="exact", clamp=True))


def test_unknown_preset() -> None:
    with pytest.raises(ValueError, match="preset must be one of exact, compact, not 'best'"):
        encode_planned(made_animation(1), preset="best")


def test_real_streams(shared: Path) -> None:
    options = EncoderOptions(bap_steps="visage", mark=False)
    before = exact = seconds = compact = 0
    for path in sorted((shared / "vectors/real").glob("*.fba")):
        data = path.read_bytes()
        with warnings.catch_warnings(action="ignore"):
            animation = fba.decode(data, bap_steps="visage")
        planned = encode_planned(animation, options)[0]
        assert len(planned) <= len(data)
        before, exact = before + len(data), exact + len(planned)
        if animation.face is None or not animation.face.values.any():
            continue
        face = Animation(animation.rate, animation.index, animation.face)
        small = encode_planned(face, options, preset="compact")[0]
        decoded = fba.decode(small).face
        assert decoded is not None
        assert np.array_equal(resolve(decoded), resolve(animation.face))
        seconds += len(animation) / float(animation.rate)
        compact += 8 * len(small)
    assert exact <= 0.314 * before
    assert compact <= 1816 * seconds


def test_values_between_steps_become_those_of_the_reference_encoder() -> None:
    rng = np.random.default_rng(9)
    values = np.cumsum(rng.integers(-9, 10, (80, 68)), axis=0).astype(np.int32)
    values[:, :2] = 0
    mask = np.tile(np.arange(68) > 1, (80, 1))
    animation = Animation(25, np.arange(80), FaceTrack(values, mask))
    expected = fba.encode(animation)
    data, _ = encode_planned(animation)
    assert len(data) <= len(expected)
    face, reference = fba.decode(data).face, fba.decode(expected).face
    assert not np.array_equal(reference.values, quantise(animation, EncoderOptions()).face.values)  # type: ignore[union-attr]
    assert np.array_equal(face.values, reference.values)


def test_masks_are_kept_on_request() -> None:
    values = np.zeros((30, 68), dtype=np.int32)
    values[:, 47] = np.arange(30) * 170
    mask = np.ones((30, 68), dtype=bool)
    turn = np.zeros((30, 296), dtype=np.int32)
    turn[:, 183] = np.arange(30) * 64
    animation = Animation(
        25, np.arange(30), FaceTrack(values, mask), BodyTrack(turn, np.ones((30, 296), dtype=bool))
    )
    for kept in ((), ("face",), ("body",), ("face", "body")):
        decoded = fba.decode(encode_planned(animation, keep_masks=kept)[0])
        assert decoded.face.mask[5].sum() == (68 if "face" in kept else 1)
        assert decoded.body.mask[5].sum() == (296 if "body" in kept else 1)


def test_no_segment_begins_where_no_i_plane_carries_the_values() -> None:
    """A walk of 9 m: I planes carry 3.7, and P planes the rest."""
    values = np.zeros((600, 296), dtype=np.int32)
    values[:, 182] = np.arange(600) * 16  # HumanoidRoot_tr_frontal, in steps of 2 mm
    values[300:, 40] = np.random.default_rng(2).integers(-9, 9, 300) * 64  # begins to move in the middle
    animation = Animation(25, np.arange(600), None, BodyTrack(values, np.tile(values.any(axis=0), (600, 1))))
    options = EncoderOptions(bap_steps="visage")
    decoded = fba.decode(encode_planned(animation, options)[0], bap_steps="visage").body
    expected = fba.decode(fba.encode(animation, options), bap_steps="visage").body
    assert np.array_equal(decoded.values, expected.values)
    assert len(plan_exact(animation, options).encode()[0]) > 0


def test_the_i_plane_has_ranges_for_its_own_values_alone() -> None:
    """FAPs that begin at 0: their values take no bits, since their ranges hold nothing else."""
    values = np.zeros((30, 68), dtype=np.int32)
    values[:, 2:] = (np.arange(30) * 60)[:, None] * np.array([one.step for one in faps()[2:]])
    animation = Animation(25, np.arange(30), FaceTrack(values, np.tile(np.arange(68) > 1, (30, 1))))
    encoder = Encoder(EncoderOptions())
    data = encoder.push_segment(animation) + encoder.finish()
    bits = fba.probe(data).plane_bits[0]
    # Header 6 and frame rate 13; quantiser 5, mask types 30, gender, coding type and list flags 6; 18 markers
    # and 66 codes in each of four lists; 2 to end the empty segments of values; stuffing comes at the end.
    assert bits == 6 + 13 + 5 + 30 + 6 + 4 * (18 + 5 * 66) + 2
    assert np.array_equal(fba.decode(data).face.values, values)  # type: ignore[union-attr]


def test_quantisers_that_keep_archives() -> None:
    def body(values: list[int]) -> Animation:
        track = np.zeros((len(values), 296), dtype=np.int32)
        track[:, 100] = values
        return Animation(25, np.arange(len(values)), None, BodyTrack(track, track.any(axis=0) | (track != 0)))

    options = EncoderOptions()
    assert exact_quantisers(body([128, 256, 1280]), options).bap_quant == 1  # multiples of its step
    assert exact_quantisers(body([5, 1860, 3720]), options).bap_quant == 0  # a P plane carries the last
    assert exact_quantisers(body([5, 1860, 3721]), options).bap_quant == 1
    assert exact_quantisers(body([1861, 5, 5]), options).bap_quant == 1  # the I plane cannot
    assert exact_quantisers(body([5, 6]), options, parts=["face"]).bap_quant == 1
    mask = np.tile(np.arange(296) == 100, (3, 1))
    mask[2, 200] = True  # another mask, and so another I plane
    changed = replace(body([5, 1860, 3720]), body=BodyTrack(body([5, 1860, 3720]).body.values, mask))  # type: ignore[union-attr]
    assert exact_quantisers(changed, options).bap_quant == 1
    assert count_rounded(body([5, 128, 6]), options) == {"body": 2}
