"""Streams at a bit rate: every plane fits the buffer, and what is lost falls as the rate rises."""

import re
from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np
import pytest

import fba
from fba import Animation, BodyTrack, EncoderOptions, FaceTrack
from fba.capture.live import widest_faces
from fba.codec import Encoder
from fba.errors import OptionError, RangeError
from fba.face import resolve
from fba.parameters import bap_steps, fap_steps
from fba.planning.rate import LeakyBucket, RateEncoder, encode_at_rate, measure_errors
from fba.planning.rate._encoder import TUNING
from fba.planning.rate._errors import error_weights

VISAGE = EncoderOptions(bap_steps="visage", clamp=True, mark=False)
FACE = [3, 4, 5, 6, 7, 12, 13, 14, 19, 20, 23, 24, 31, 32, 48, 49, 50]
BODY = [8, 9, 16, 17, 28, 29, 38, 39, 48, 49, 50, 184]


def moving_face(rng: np.random.Generator, length: int, kind: str) -> FaceTrack:
    """Return FAPs that speak, rest, or jump."""
    mask = np.zeros((length, 68), dtype=bool)
    mask[:, np.array(FACE) - 1] = True
    steps = np.asarray(fap_steps())
    values = np.zeros((length, 68))
    if kind != "silence":
        strength = 60 if kind in ("noise", "shock") else 8
        speed = rng.normal(0, strength, (length, 68))
        if kind == "bursts":
            speed *= (np.arange(length) // 15 % 3 == 0)[:, None] * 4
        values = 200 * np.sin(np.cumsum(speed, axis=0) / 200)
    if kind == "shock":
        values[: length // 2] = 0
    if kind == "jumps":
        values = np.where((np.arange(length) // 20 % 2)[:, None], values + 900, values)
    values = np.rint(values) * steps
    viseme = np.zeros((length, 4), dtype=np.int16)
    if kind == "visemes":
        mask[:, 0] = True
        viseme[:, 0], viseme[:, 2] = rng.integers(0, 15, length), rng.integers(0, 64, length)
    values[~mask] = 0
    values[:, :2] = 0
    return FaceTrack(values.astype(np.int32), mask, viseme)


def moving_body(rng: np.random.Generator, length: int) -> BodyTrack:
    mask = np.zeros((length, 296), dtype=bool)
    mask[:, np.array(BODY) - 1] = True
    walk = np.cumsum(rng.normal(0, 4, (length, 296)), axis=0)
    return BodyTrack((np.rint(walk) * bap_steps("visage") * mask).astype(np.int32), mask)


def made(kind: str, length: int = 90, fps: Fraction | int = 25, seed: int = 1) -> Animation:
    rng = np.random.default_rng(seed)
    face = moving_face(rng, length, kind) if kind != "body" else None
    body = moving_body(rng, length) if kind in ("body", "both") else None
    gaps = rng.integers(1, 5, length) if kind == "gaps" else np.ones(length, dtype=np.int64)
    return Animation(Fraction(fps), np.cumsum(gaps) - gaps[0], face, body)


def levels(data: bytes, rate: float) -> list[float]:
    """Return how full a buffer that drains at a rate is after each plane, by where planes lie in a stream."""
    decoder = fba.Decoder(bap_steps="visage")
    frames = [*decoder.push(data), *decoder.finish()]
    result: list[float] = []
    level, before, end = 0.0, Fraction(0), 0
    first = frames[0].time
    for frame in frames:
        now = frame.time - first
        stop = frame.plane.bit + frame.plane.bits
        if frame is frames[-1]:
            stop = 8 * len(data)
        level = max(0.0, level - rate * float(now - before)) + stop - end
        before, end = now, stop
        result.append(level)
    return result


def coded(animation: Animation, rate: float, buffer: float = 1.0) -> tuple[bytes, RateEncoder]:
    encoder = RateEncoder(rate, buffer, VISAGE)
    return encoder.push_animation(animation) + encoder.finish(), encoder


@pytest.mark.parametrize(
    ("kind", "fps", "rate", "buffer"),
    [
        ("speech", 25, 1500, 1.0),
        ("speech", 25, 700, 1.5),
        ("speech", 5, 700, 1.4),
        ("speech", 120, 1200, 0.8),
        ("noise", 25, 900, 1.0),
        ("noise", 60, 20_000, 0.1),
        ("silence", 25, 700, 1.4),
        ("shock", 25, 900, 0.9),
        ("bursts", 25, 1000, 1.0),
        ("jumps", Fraction(30000, 1001), 1000, 1.0),
        ("gaps", 25, 800, 1.0),
        ("visemes", 25, 1500, 1.0),
        ("body", 25, 2000, 1.0),
        ("both", 25, 3000, 0.6),
    ],
)
def test_every_plane_fits_the_buffer(kind: str, fps: Fraction | int, rate: float, buffer: float) -> None:
    animation = made(kind, fps=fps)
    data, encoder = coded(animation, rate, buffer)
    assert max(levels(data, rate)) <= rate * buffer
    assert encoder.statistics.over == 0
    decoded = fba.decode(data, bap_steps="visage")
    assert set((decoded.index - decoded.index[0]).tolist()) <= set(
        (animation.index - animation.index[0]).tolist()
    )
    assert len(decoded) == encoder.statistics.planes
    assert encoder.statistics.left_out == len(animation) - len(decoded)
    if kind == "visemes":
        there = np.isin(animation.index - animation.index[0], decoded.index - decoded.index[0])
        assert np.array_equal(decoded.face.viseme[:, 0], animation.face.viseme[there, 0])


@pytest.mark.parametrize("kind", ["shock", "noise"])
def test_planes_fit_even_if_hardly_any_error_is_allowed(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    generous = replace(TUNING, max_error=1e-9, full_share=10.0)
    monkeypatch.setattr("fba.planning.rate._encoder.TUNING", generous)
    animation = made(kind)
    encoder = RateEncoder(950, 1.0, VISAGE, finest=0)
    data = encoder.push_animation(animation) + encoder.finish()
    assert max(levels(data, 950)) <= 950
    assert encoder.statistics.over == 0


@pytest.mark.parametrize("seed", range(24))
def test_masks_that_change_at_any_amplitude(seed: int) -> None:
    """Each change of the mask is an I plane that is tried first: with the models that the plane will have."""
    rng = np.random.default_rng(seed)
    amplitude, rate = int(rng.integers(200, 1801)), float(rng.uniform(2000, 20_000))
    values, mask = rng.integers(-amplitude, amplitude + 1, (60, 68)), np.zeros((60, 68), dtype=bool)
    starts = np.cumsum(rng.integers(3, 15, 20))
    for start in [0, *starts[starts < 60]]:
        mask[start:, 2:] = rng.random(66) < rng.uniform(0.2, 1)
    animation = Animation(Fraction(25), np.arange(60), FaceTrack(np.where(mask, values, 0), mask))
    encoder = RateEncoder(rate, 2.0, EncoderOptions(clamp=True))
    data = encoder.push_animation(animation) + encoder.finish()
    assert encoder.statistics.over == 0
    level = levels(data, rate)
    assert max(level) <= 2 * rate
    assert max(level[:-1], default=0) <= encoder.bucket.peak + 1e-6  # the end of the stream is spare
    assert len(fba.decode(data)) == encoder.statistics.planes


@cache
def one_by_one() -> bytes:
    encoder = RateEncoder(900, 1.0, VISAGE)
    return b"".join(encoder.push(frame) for frame in made("bursts")) + encoder.finish()


def test_frames_one_by_one_and_all_at_once_give_the_same_stream() -> None:
    assert coded(made("bursts"), 900)[0] == one_by_one()


def test_a_plane_comes_with_the_frame_after_it() -> None:
    encoder = RateEncoder(9000, 1.0, VISAGE)
    so_far = b""
    for number, frame in enumerate(made("speech", 12)):
        so_far += encoder.push(frame)
        complete = so_far + encoder.ending()
        assert len(fba.decode(complete) if complete else ()) == number


def test_more_bits_lose_less() -> None:
    animation = made("speech", 150)
    losses = []
    for rate in (900, 1500, 3000, 8000):
        found = encode_at_rate(animation, rate, 1.0, VISAGE)
        assert max(levels(found.data, rate)) <= rate
        errors = measure_errors(animation, found.shown)
        losses.append(errors.face.largest)
        assert bool(errors.parameters) == bool(losses[-1])
    assert losses == sorted(losses, reverse=True)
    assert losses[-1] == 0  # enough for all of it
    assert losses[0] > 4 * losses[2]


def test_what_players_derive_is_not_sent() -> None:
    animation = made("speech")
    values, mask = animation.face.values.copy(), animation.face.mask.copy()
    values[:, 13 - 1] = values[:, 12 - 1]
    values[:, 59 - 1] = values[:, 60 - 1] = values[:, 12 - 1]
    mask[:, [59 - 1, 60 - 1]] = True
    twins = Animation(animation.rate, animation.index, FaceTrack(values, mask))
    found = encode_at_rate(twins, 9000, 1.0, VISAGE)
    assert found.shown.face.mask[0, [11, 12, 58, 59]].sum() == 1
    assert np.array_equal(resolve(found.shown.face), resolve(FaceTrack(values, mask)))


@pytest.mark.parametrize("whole", [True, False])
def test_an_error_names_a_buffer_that_an_i_plane_fits(whole: bool) -> None:
    animation = made("speech", 30)

    def encode(rate: float, buffer: float) -> bytes:
        if whole:
            return encode_at_rate(animation, rate, buffer, VISAGE).data
        return coded(animation, rate, buffer)[0]

    with pytest.raises(RangeError, match=r"an I plane takes .* bits, more than the buffer") as caught:
        encode(100, 1.0)
    rate, buffer = (
        float(re.search(rf"{name}=([\d.]+)", str(caught.value))[1]) for name in ("rate", "buffer")
    )  # type: ignore[index]
    assert encode(rate * (1 if whole else 1.05), 1.0)
    assert encode(100, buffer * (1 if whole else 1.05))


def test_a_still_face_takes_less_than_the_rate() -> None:
    data, encoder = coded(made("silence", 250), 2000)
    assert 8 * len(data) < 0.7 * 2000 * 10
    assert encoder.statistics.left_out == 0


@pytest.mark.parametrize("kind", ["speech", "body", "both"])
def test_one_frame(kind: str) -> None:
    animation = made(kind, 1)
    data, _ = coded(animation, 3000)
    decoded = fba.decode(data, bap_steps="visage")
    assert len(decoded) == 1
    assert len(encode_at_rate(animation, 3000, 1.0, VISAGE).shown) == 1


def test_no_frames() -> None:
    with pytest.raises(ValueError, match="no frame"):
        RateEncoder(1500).finish()
    with pytest.raises(ValueError, match="no frame"):
        encode_at_rate(made("speech")[:0], 1500)


@pytest.mark.parametrize(
    ("rate", "size"), [(0, 1), (-5, 1), (float("nan"), 1), (1500, 0), (1500, float("inf"))]
)
def test_rates_and_buffers_are_positive(rate: float, size: float) -> None:
    with pytest.raises(ValueError, match="positive"):
        RateEncoder(rate, size)


def test_a_bit_rate_decides_where_i_planes_come() -> None:
    """Its bucket would not count those of a period."""
    with pytest.raises(OptionError, match="leave intra_period out"):
        RateEncoder(900, 1.0, EncoderOptions(intra_period=1))


def test_an_angle_that_continues_past_half_a_turn_takes_the_short_way() -> None:
    animation = made("body", 60)
    values = animation.body.values.copy()
    values[:, 183] = np.rint(np.linspace(250_000, 400_000, 60))
    values[values[:, 183] > 314_159, 183] -= 628_319
    turning = Animation(animation.rate, animation.index, None, BodyTrack(values, animation.body.mask))
    data, _ = coded(turning, 20_000)
    decoded = fba.decode(data, bap_steps="visage")
    shown = np.interp(animation.index, decoded.index, decoded.body.values[:, 183])
    off = (shown - values[:, 183] + 314_159) % 628_319 - 314_159
    assert np.abs(off).max() < 2000


def test_still_parameters_stay_still() -> None:
    animation = made("noise", 150)
    values = animation.face.values.copy()
    still = [6, 18, 31, 48]
    values[:, still] = values[0, still]
    half_still = Animation(animation.rate, animation.index, FaceTrack(values, animation.face.mask))
    decoded = fba.decode(coded(half_still, 1000, 1.5)[0])
    assert len(decoded) > 40
    for column in still:
        shown = decoded.face.values[:, column]
        assert (np.diff(np.abs(shown - values[0, column])) <= 0).all(), column  # nearer, never away


def test_a_live_blink_is_seen() -> None:
    """Nothing is known but how far lids go: ranges must leave room for how fast they do."""
    animation = made("speech", 60)
    values = animation.face.values.copy()
    values[:, 18:20] = 0
    values[40:43, 18:20] = np.array([500, 1000, 400])[:, None]
    blinking = Animation(animation.rate, animation.index, FaceTrack(values, animation.face.mask))
    encoder = RateEncoder(6000, 1.0, VISAGE)
    encoder.expect(widest_faces())
    decoded = fba.decode(encoder.push_animation(blinking) + encoder.finish())
    shown = np.interp(blinking.index, decoded.index, decoded.face.values[:, 18])
    assert np.abs(shown - values[:, 18]).max() < 100


def test_parameters_that_come_later_are_sent_once_there_is_room() -> None:
    animation = made("speech", 120)
    mask = animation.face.mask.copy()
    mask[:40, 47:50] = False
    later = Animation(
        animation.rate, animation.index, FaceTrack(np.where(mask, animation.face.values, 0), mask)
    )
    data, encoder = coded(later, 1000)
    assert max(levels(data, 1000)) <= 1000
    assert encoder.statistics.intra_planes == 2
    decoded = fba.decode(data)
    assert decoded.face.mask[-1, 47:50].all()


def test_parameters_that_come_later_and_never_fit_are_not_sent() -> None:
    animation = made("speech", 60)
    mask = animation.face.mask.copy()
    mask[:20, 10:] = False
    later = Animation(
        animation.rate, animation.index, FaceTrack(np.where(mask, animation.face.values, 0), mask)
    )
    data, encoder = coded(later, 600)
    assert max(levels(data, 600)) <= 600
    assert encoder.statistics.not_sent
    decoded = fba.decode(data)
    assert np.array_equal(decoded.face.mask, np.broadcast_to(mask[0], decoded.face.mask.shape))
    assert decoded.face.values[-1, 2:10].any()


def test_the_next_plane_at_no_price_and_at_any() -> None:
    animation = made("noise", 3)
    encoder = Encoder(VISAGE)
    encoder.begin_segment(animation)
    encoder.push_animation(animation[:1])
    encoder.settle(1)
    plane = encoder.next_plane(animation[1:2])
    still = plane.with_levels(plane.levels(error_weights(), np.inf))
    assert np.array_equal(still.face.values[0], animation.face.values[0])
    levels = plane.levels(error_weights(), 0.0)
    exact = plane.with_levels(levels)
    assert exact == animation[1:2]
    before, plane_bits = encoder.bits, plane.bits(levels)
    encoder.push_animation(exact)
    encoder.settle(2)
    assert encoder.bits - before == plane_bits


def test_a_leaky_bucket() -> None:
    bucket = LeakyBucket(100, 50)
    bucket.add(40)
    assert (bucket.room, bucket.level_at(0.1)) == (10, 30)
    bucket.drain(0.3)
    assert bucket.level == 10
    bucket.add(5)
    assert bucket.level == 15
    bucket.drain(5)
    assert bucket.level == 0
    bucket.add(1)
    assert bucket.peak == 40


@pytest.mark.parametrize("share", [0.9, 0.95, 0.99, 0.999])
def test_the_last_frame_is_left_out_where_the_buffer_has_no_room(share: float) -> None:
    """A first I plane fills most of the buffer, and the stream ends before it has drained."""
    values = np.zeros((3, 68), dtype=np.int32)
    values[:, 2:] = np.random.default_rng(1).integers(-1800, 1801, (3, 66))
    face = FaceTrack(values, np.broadcast_to(np.arange(68) >= 2, values.shape))
    animation = Animation(25, np.arange(3), face)
    first = RateEncoder(1e6, 1.0, EncoderOptions(clamp=True), choose_quantisers=False)
    first.push_animation(animation[:1])
    size = first.bucket.peak / share + 100
    encoder = RateEncoder(size / 10, 10.0, EncoderOptions(clamp=True), choose_quantisers=False)
    data = encoder.push_animation(animation) + encoder.finish()
    assert encoder.statistics.over == 0
    assert encoder.bucket.peak <= size
    assert len(fba.decode(data)) == encoder.statistics.planes < 3
