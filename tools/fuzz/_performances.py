"""Random performances, encoded in every manner and decoded again: what an encoder promises for any motion.

The decoder takes what was written; a stream that keeps everything has every value within a quantiser step; a
stream at a bit rate takes the bits that were counted for it.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np

import fba
from fba.animation import Animation, Frame
from fba.arrays import Bool, Int32
from fba.codec import Decoder, Encoder, EncoderOptions
from fba.errors import FbaWarning, RangeError
from fba.parameters import BAP_COUNT, FAP_COUNT, bap_steps, fap_steps
from fba.planning import LiveEncoder, Tolerance, encode_planned, encode_within_tolerance
from fba.planning.rate import LeakyBucket, RateEncoder, encode_at_rate
from fba.tracks import BodyTrack, FaceTrack
from tools.fuzz._outcome import ContractError, Outcome

AMPLITUDES = 1, 30, 300, 1860, 20_000, 2_000_000_000
"""Most that values differ from 0: within a step, in speech, at the limits of ranges, beyond all of them, and
near those of an int32.
"""
MOST_FRAMES = 60
FEW_FRAMES = 4
"""Frames of those that search on a head or a body: each frame takes them long."""
SEARCHED = 0.02
"""Share of performances that are encoded within a tolerance, and of those whose quantisers are searched."""


SKIP_WORD = 4
"""Bits of one word of number_of_frames_to_skip: no plane takes so few."""
GUARD = range(33, 41)
"""Bits of a start code and its alignment that keep a plane from being taken for one: there is room."""


class Counted(LeakyBucket):
    """A bucket that lists the bits of the planes that were put into it, without those of their skips."""

    def __init__(self, rate: float, size: float) -> None:
        super().__init__(rate, size)
        self.planes: list[float] = []

    def add(self, bits: float) -> None:
        """Add the bits of a plane, or of a skip."""
        if bits != SKIP_WORD:
            self.planes.append(bits)
        super().add(bits)


def check_face(data: bytes, _folder: Path) -> Outcome:
    """Encode and decode the face that these random bytes make."""
    return _check(data, face=True, body=False)


def check_body(data: bytes, _folder: Path) -> Outcome:
    """Encode and decode the body that these random bytes make."""
    return _check(data, face=False, body=True)


def check_both(data: bytes, _folder: Path) -> Outcome:
    """Encode and decode the face and the body that these random bytes make."""
    return _check(data, face=True, body=True)


def _check(data: bytes, *, face: bool, body: bool) -> Outcome:
    """Encode a performance as a whole, and in one manner more; refused is what no range carries."""
    rng = np.random.default_rng([*data, len(data)])
    options = _options(rng)
    searched = rng.random() < SEARCHED
    count = int(rng.integers(1, (FEW_FRAMES if searched else MOST_FRAMES) + 1))
    animation = _animation(rng, count, face, body)
    manners = (_within_tolerance, _at_best) if searched else _MANNERS
    manner = manners[int(rng.integers(len(manners)))]
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        accepted = [_encoded(one, animation, options, rng) for one in (_whole, manner)]
    return Outcome(all(accepted))


Manner = Callable[[Animation, EncoderOptions, np.random.Generator], None]


def _encoded(manner: Manner, animation: Animation, options: EncoderOptions, rng: np.random.Generator) -> bool:
    """Encode in a manner, which raises ContractError for a wrong stream; return whether it could."""
    try:
        manner(animation, options, rng)
    except RangeError:
        return False
    return True


def _whole(animation: Animation, options: EncoderOptions, _rng: np.random.Generator) -> None:
    encoder = Encoder(options)
    encoder.expect(animation)
    data = encoder.push_animation(animation) + encoder.finish()
    _compare(animation, _decoded(data, options, len(animation)), options, encoder.statistics.clamped > 0)


def _streaming(animation: Animation, options: EncoderOptions, rng: np.random.Generator) -> None:
    """Frames one by one, with ranges that grow; after one of them, all that would end the stream there."""
    encoder, data, asked = Encoder(options), b"", int(rng.integers(len(animation)))
    for number, frame in enumerate(animation):
        data += encoder.push(frame)
        if number == asked and number:
            _decoded(data + encoder.ending(), options, number)
    data += encoder.finish()
    _compare(animation, _decoded(data, options, len(animation)), options, encoder.statistics.clamped > 0)


def _live(animation: Animation, options: EncoderOptions, _rng: np.random.Generator) -> None:
    encoder = LiveEncoder(options)
    data = b"".join(encoder.push(frame) for frame in animation) + encoder.finish()
    _decoded(data, options, len(animation))


def _exact(animation: Animation, options: EncoderOptions, rng: np.random.Generator) -> None:
    kept = {part for part in ("face", "body") if rng.random() < 0.3}
    _decoded(encode_planned(animation, options, preset="exact", keep_masks=kept)[0], options, len(animation))


def _compact(animation: Animation, options: EncoderOptions, rng: np.random.Generator) -> None:
    kept = {part for part in ("face", "body") if rng.random() < 0.3}
    _decoded(
        encode_planned(animation, options, preset="compact", keep_masks=kept)[0], options, len(animation)
    )


def _at_rate(animation: Animation, options: EncoderOptions, rng: np.random.Generator) -> None:
    """At a bit rate: planes take the bits that their trials counted, and none is more than fits."""
    options = replace(options, intra_period=None)  # I planes come where the buffer has room
    rate, buffer = float(rng.uniform(500, 30_000)), float(rng.uniform(0.5, 3))
    encoder = RateEncoder(rate, buffer, options, choose_quantisers=bool(rng.random() < 0.7))
    bucket = encoder.bucket = Counted(rate, rate * buffer)
    if rng.random() < 0.3:
        encoder.expect(animation, exactly=bool(rng.random() < 0.5))
    data = b"".join(encoder.push(frame) for frame in animation) + encoder.finish()
    if encoder.statistics.over:
        raise ContractError(f"{encoder.statistics.over} planes are larger than the buffer")
    decoder = Decoder(bap_steps=options.bap_steps)
    frames = [*decoder.push(data), *decoder.finish()]
    if len(frames) != len(bucket.planes):
        raise ContractError(f"{len(frames)} planes decoded, {len(bucket.planes)} encoded")
    indices = [frame.index for frame in frames]
    begin, before = 0, 0.0  # the object's start code counts for the first plane
    for frame, counted, gap in zip(frames, bucket.planes, [*np.diff(indices) - 1, 0], strict=True):
        plane = frame.plane
        end = plane.bit + plane.bits
        more = end - begin - counted - SKIP_WORD * (int(gap) // 15 + 1) * (gap > 0)
        guarded = plane.settings.start_code and not (options.start_codes and plane.settings.intra)
        # Its trial does not know of frames that are skipped behind it: without them it needs a guard.
        spared = gap > 0 and -more in GUARD
        # A start code may hide the plane before it, which then gets a guard, counted with the later plane.
        paid = more == -before
        if more != 0 and not spared and not paid and not (guarded and more in GUARD):
            raise ContractError(f"the planes take other bits than counted: plane {plane.number} {more:+.0f}")
        begin, before = end, more


def _within_tolerance(animation: Animation, options: EncoderOptions, rng: np.random.Generator) -> None:
    size = float(rng.choice([0.3, 1, 10]))
    tolerance = Tolerance(0.0005 * size, 0.1 * size, size, 0.01 * size, 0.005 * size)
    data, _ = encode_within_tolerance(animation, tolerance, options, every_frame=bool(rng.random() < 0.5))
    _decoded(data, options)


def _at_best(animation: Animation, options: EncoderOptions, rng: np.random.Generator) -> None:
    options = replace(options, intra_period=None)
    data = encode_at_rate(
        animation, float(rng.uniform(1000, 50_000)), float(rng.uniform(0.5, 2)), options
    ).data
    _decoded(data, options)


_MANNERS: tuple[Manner, ...] = (_streaming, _live, _exact, _compact, _at_rate, _at_rate)


def _decoded(data: bytes, options: EncoderOptions, count: int | None = None) -> Animation:
    """Return the animation in a stream; ContractError if it is damaged or has another number of frames."""
    decoder = Decoder(bap_steps=options.bap_steps, on_error="salvage")
    frames: list[Frame] = [*decoder.push(data), *decoder.finish()]
    if decoder.damage:
        raise ContractError(f"the stream is damaged: {decoder.damage[0]}")
    if count is not None and len(frames) != count:
        raise ContractError(f"{len(frames)} frames decoded, {count} encoded")
    return fba.decode(data, bap_steps=options.bap_steps)


def _compare(source: Animation, decoded: Animation, options: EncoderOptions, clamped: bool) -> None:
    """Raise ContractError where a value is more than half a quantiser step off, unless some were clamped."""
    if clamped:
        return
    for name, first, steps, quant in (
        ("face", 2, fap_steps(), options.fap_quant),
        ("body", 0, bap_steps(options.bap_steps), options.bap_quant),
    ):
        before, after = getattr(source, name), getattr(decoded, name)
        if before is None or (after is None and not before.mask.any()):
            continue
        if after is None:
            raise ContractError(f"the {name} is missing")
        step = 1 if not quant else fba.codec.step_scale(options, body=name == "body") * np.asarray(steps)
        off = np.abs(after.values.astype(np.int64) - before.values) * before.mask
        if name == "body" and options.clamp:  # which may choose another turn
            continue
        if (off[:, first:] * 2 > np.broadcast_to(step, off.shape)[:, first:] + 1).any():
            frame, column = np.argwhere(off * 2 > np.broadcast_to(step, off.shape) + 1)[0].tolist()
            raise ContractError(
                f"{name}: frame {frame}, parameter {column + 1} is off by more than half a step"
            )


def _options(rng: np.random.Generator) -> EncoderOptions:
    """Return options, each of them at random."""
    options = EncoderOptions(
        fap_quant=int(rng.choice([0, 1, 1, 1, int(rng.integers(32))])),
        bap_quant=int(rng.choice([0, 1, 1, 1, int(rng.integers(32))])),
        bap_steps="visage" if rng.choice(["iso", "visage"]) == "visage" else "iso",
        unsent="interpolate" if rng.choice(["keep", "interpolate"]) == "interpolate" else "keep",
        gender=int(rng.integers(2)),
        clamp=bool(rng.random() < 0.7),
        mark=bool(rng.random() < 0.5),
    )
    if rng.random() < 0.3:
        options = replace(
            options,
            intra_period=float(rng.uniform(0.04, 1)),
            start_codes=bool(rng.random() < 0.5),
            time_codes=bool(rng.random() < 0.5),
        )
    return options


def _animation(rng: np.random.Generator, count: int, face: bool, body: bool) -> Animation:
    """Return a face, a body or both that send other parameters from time to time."""
    gaps = rng.integers(1, rng.choice([2, 2, 5, 200]), count)
    rate = Fraction(int(rng.choice([25, 25, 30, 120])))
    return Animation(
        rate,
        np.cumsum(gaps) - gaps[0],
        _face(rng, count) if face else None,
        _body(rng, count) if body else None,
    )


def _face(rng: np.random.Generator, count: int) -> FaceTrack:
    mask = _mask(rng, count, FAP_COUNT)
    mask[:, :2] &= rng.random(2) < 0.3
    values = _values(rng, count, FAP_COUNT)
    values[:, :2] = 0
    viseme = np.zeros((count, 4), dtype=np.int16)
    expression = np.zeros((count, 6), dtype=np.int16)
    viseme[:, :2], viseme[:, 2] = rng.integers(0, 15, (count, 2)), rng.integers(0, 64, count)
    expression[:, [0, 2]] = rng.integers(0, 7, (count, 2))
    expression[:, [1, 3]] = rng.integers(0, 64, (count, 2))
    viseme[:, 3], expression[:, 4:] = rng.random(count) < 0.1, rng.random((count, 2)) < 0.1
    return FaceTrack(
        np.where(mask, values, 0).astype(np.int32), mask, viseme * mask[:, :1], expression * mask[:, 1:2]
    )


def _body(rng: np.random.Generator, count: int) -> BodyTrack:
    mask = _mask(rng, count, BAP_COUNT)
    mask[:, 186:] &= rng.random() < 0.1  # extension BAPs have no ranges of their own
    return BodyTrack(np.where(mask, _values(rng, count, BAP_COUNT), 0).astype(np.int32), mask)


def _values(rng: np.random.Generator, count: int, columns: int) -> Int32:
    """Return values of one amplitude, or of one for each parameter, that rest, swing, jump or are noise."""
    amplitude = rng.choice(
        AMPLITUDES, columns if rng.random() < 0.2 else 1, p=(0.05, 0.25, 0.35, 0.25, 0.05, 0.05)
    )
    shape = (count, columns)
    kind = rng.integers(5)
    if kind == 0:
        motion = rng.uniform(-1, 1, shape)
    elif kind == 1:
        motion = np.sin(np.cumsum(rng.normal(0, 0.3, shape), axis=0))
    elif kind == 2:
        motion = np.where(rng.random(shape) < 0.1, rng.choice([-1, 1], shape), 0)
    elif kind == 3:
        motion = np.repeat(rng.uniform(-1, 1, (1, columns)), count, axis=0)
    else:
        motion = np.clip(np.cumsum(rng.normal(0, 0.05, shape), axis=0), -1, 1)
    still = rng.random(columns) < rng.choice([0, 0.5, 0.95])
    values: Int32 = np.rint(np.where(still, 0, motion) * amplitude).astype(np.int32)
    return values


def _mask(rng: np.random.Generator, count: int, columns: int) -> Bool:
    """Return which parameters are sent: some always, others from a frame on, until the next change."""
    mask = np.zeros((count, columns), dtype=np.bool_)
    starts = [0, *np.flatnonzero(rng.random(count) < rng.choice([0, 0.05, 0.3]))]
    for start in starts:
        mask[start:] = rng.random(columns) < rng.choice([0.02, 0.3, 1])
    if rng.random() < 0.2:  # frames without this part
        mask[rng.random(count) < 0.3] = False
    return mask
