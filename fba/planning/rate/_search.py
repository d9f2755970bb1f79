"""`encode_at_rate`: a whole animation at a mean rate, with the quantiser that gives the least errors."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Int16
from fba.codec import EncoderOptions, decode, quantise
from fba.errors import FbaWarning, RangeError
from fba.face import known_faps, resolve
from fba.planning._code_lengths import code_lengths
from fba.planning._derived_faps import choose_faps, interpolated_faps
from fba.planning._plan import NO_LIMITS, plan_compact
from fba.planning._segments import Cuts
from fba.planning.rate._encoder import RateEncoder, RateStatistics
from fba.planning.rate._errors import mean_distance
from fba.planning.rate._expectations import TUNING
from fba.tracks import BodyTrack, FaceTrack, hold

QUANTISERS = (1, 2, 3, 4, 6, 8)
"""Quantisers that are tried."""
FINEST_ERRORS = (0.05, 0.0, 0.1)
"""Millimetres, see `RateEncoder`: the first is tried with all quantisers, the others with the best."""
TRIED_SECONDS = 30
"""Length of the beginning on which settings are tried."""


@dataclass(frozen=True, eq=False)
class RatedStream:
    """A stream at a bit rate.

    data: its bytes. shown: the decoded animation. options: with the chosen quantisers. statistics: of the
    encoder. rate: bits a second over the whole length.
    """

    data: bytes
    shown: Animation
    options: EncoderOptions
    statistics: RateStatistics
    rate: float


def encode_at_rate(
    animation: Animation, bit_rate: float, buffer: float = 1.0, options: EncoderOptions | None = None
) -> RatedStream:
    """Return the stream with the least errors at a bit rate.

    bit_rate: bits a second. buffer: seconds of that rate; every plane fits a `LeakyBucket` of this size. FAPs
    that players derive by the standard's rules are not sent, as in `plan_compact`, but with the same choice
    for all frames. Quantisers are tried on the first half minute; those in `options` are ignored.

    A stream that needs less than the rate takes less. Raises RangeError for a buffer that no I plane fits,
    ValueError for an animation without frames and for a rate or a buffer that is not positive.
    """
    if not len(animation):
        raise ValueError("there is no frame to encode")
    options = options or EncoderOptions()
    sent = _to_send(quantise(animation, replace(options, fap_quant=1, bap_quant=1)), options)
    beginning = sent[: max(1, math.ceil(TRIED_SECONDS * float(animation.rate)))]
    stride = max(1, int(TUNING.gap * float(sent.rate)))
    coarse = [_Setting(quantiser, FINEST_ERRORS[0], stride) for quantiser in QUANTISERS]
    best = _best_setting(beginning, sent, bit_rate, buffer, coarse, options)
    finer = [_Setting(best.quantiser, finest, stride) for finest in FINEST_ERRORS]
    if stride > 1:
        finer += [setting._replace(stride=1) for setting in finer]
    best = _best_setting(beginning, sent, bit_rate, buffer, finer, options)
    return _encode(sent, sent, bit_rate, buffer, best, options)


class _Setting(NamedTuple):
    """A quantiser, the `finest` error of a `RateEncoder`, and how many frames apart ranges allow changes."""

    quantiser: int
    finest: float
    stride: int


def _best_setting(
    animation: Animation, expected: Animation, rate: float, buffer: float, settings: list[_Setting],
    options: EncoderOptions,
) -> _Setting:  # fmt: skip
    """Return the setting with the least errors. Raises the last RangeError if no setting fits."""
    best, least = None, math.inf
    for setting in settings:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", FbaWarning)  # given with the stream itself
                rated = _encode(animation, expected, rate, buffer, setting, options)
        except RangeError as error:
            failure = error
            continue
        distance = mean_distance(animation, rated.shown)
        if distance < least:
            best, least = setting, distance
    if best is None:
        raise failure
    return best


def _encode(
    animation: Animation, expected: Animation, rate: float, buffer: float, setting: _Setting,
    options: EncoderOptions,
) -> RatedStream:  # fmt: skip
    """Return the stream of an animation with a setting. expected: holds all values and changes."""
    options = replace(options, fap_quant=setting.quantiser, bap_quant=setting.quantiser)
    encoder = RateEncoder(rate, buffer, options, choose_quantisers=False, finest=setting.finest)
    encoder.expect(_changes_over(expected, setting.stride), exactly=True)
    data = encoder.push_animation(animation) + encoder.finish()
    shown = decode(data, bap_steps=options.bap_steps, limits=NO_LIMITS)
    seconds = float((animation.index[-1] - animation.index[0] + 1) / animation.rate)
    return RatedStream(data, shown, options, encoder.statistics, 8 * len(data) / seconds)


def _changes_over(animation: Animation, stride: int) -> Animation:
    """Return an animation, followed by every `stride`-th of its frames backwards, with larger changes."""
    order = np.arange(len(animation))
    if stride > 1:
        order = np.concatenate([order, order[::-1][::stride]])
    face, body = animation.face, animation.body
    if face is not None:
        face = FaceTrack(face.values[order], face.mask[order], face.viseme[order], face.expression[order])
    if body is not None:
        body = BodyTrack(body.values[order], body.mask[order])
    return Animation(animation.rate, np.arange(len(order)), face, body)


def _to_send(animation: Animation, options: EncoderOptions) -> Animation:
    """Return an animation that sends, in all frames, the parameters with which a player shows the same."""
    face, body = animation.face, animation.body
    if body is not None:
        values = hold(body.values, body.mask, np.zeros_like(body.values[0]))
        body = BodyTrack(values, np.broadcast_to(values.any(axis=0), values.shape))
    if face is not None:
        thin = _face_to_send(face, options)
        if not np.array_equal(resolve(thin), resolve(face)):  # visemes and expressions
            by_plan = plan_compact(replace(animation, body=None), options).animation.face
            assert by_plan is not None
            thin = by_plan
        face = thin
    return replace(animation, face=face, body=body)


def _face_to_send(face: FaceTrack, options: EncoderOptions) -> FaceTrack:
    """Return a face that sends the same FAPs in every frame, without those derived from others."""
    values, known = known_faps(face)
    known = np.broadcast_to(known.any(axis=0), known.shape)
    shown = FaceTrack(values, known)
    cuts = Cuts(np.array([0, len(face)]), np.array([True, False]))
    choice = choose_faps(values, known, code_lengths(shown, cuts.frames, options), cuts)
    mask = np.broadcast_to(choice.sent[:, 0, 1] & values.any(axis=0), known.shape).copy()
    moves = known & values.any(axis=0)
    mask[:, :2] = face.mask[:, :2].any(axis=0) & np.array([face.viseme.any(), face.expression.any()])
    return FaceTrack(
        np.where(mask, values, 0), mask, _in_force(face.viseme, face.mask[:, :1]),
        _in_force(face.expression, face.mask[:, 1:2]), interpolated_faps(mask, moves),
    )  # fmt: skip


def _in_force(fields: Int16, mask: Bool) -> Int16:
    """Return the fields of a viseme or an expression in force at every frame."""
    return hold(fields, mask, np.zeros_like(fields[0]))
