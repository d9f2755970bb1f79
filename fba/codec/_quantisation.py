"""Quantised values, as a decoder returns them, and the coarsest quantisers that keep them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Any

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Int32, Int64
from fba.codec._plane import quantiser, slots
from fba.codec.settings import RANGE_CODE_MAX, RANGE_UNIT
from fba.compiled import compiled
from fba.encoder_options import QUANT_MAX, EncoderOptions
from fba.parameters import INTENSITY_MAX
from fba.tracks import BodyTrack, FaceTrack


def step_scale(options: EncoderOptions, *, body: bool) -> int:
    """Return how many table steps the quantiser of BAPs, or of FAPs, takes: the divisor of range limits."""
    part = slots.BODY_BIT if body else slots.FACE_BIT
    return quantiser.scale(part, slots.quantiser_of(options, part))


@compiled
def range_limit(level: int, scale: int) -> int:
    """Return the limit of the tightest range that contains a level from 0 up, in levels.

    Of a level beyond all ranges, the limit of the widest. scale: `step_scale` of the part.
    """
    code = min(-(-level * scale // RANGE_UNIT), RANGE_CODE_MAX)
    return RANGE_UNIT * code // scale


def levels(track: FaceTrack | BodyTrack, options: EncoderOptions) -> Int64:
    """Return the levels of a track's values: int64 (T, 68) or (T, 296), values in quantiser steps.

    0 for FAPs 1 and 2, which have fields instead of a value.
    """
    return quantiser.levels(track.values, _steps(track, options))


def quantise(animation: Animation, options: EncoderOptions) -> Animation:
    """Return an animation with every FAP and BAP as a decoder returns it: a multiple of its step.

    Each value is rounded by itself, as in an I plane, so that equal values stay equal. Masks do not change.
    """
    face, body = animation.face, animation.body
    if face is not None:
        face = _quantised_face(face, options)
    if body is not None:
        body = BodyTrack(_quantised(body, options), body.mask)
    return replace(animation, face=face, body=body)


def coarsest_quantisers(animation: Animation, options: EncoderOptions) -> EncoderOptions:
    """Return options with the coarsest quantisers that keep every value of a quantised animation.

    Limits of ranges are multiples of 60 table steps, whatever the quantiser: the coarser it is, the fewer
    symbols a range has that never occur. Parts without quantisation (fap_quant or bap_quant 0) stay so.
    """
    chosen: dict[str, Any] = {}
    for part, name, track in (
        (slots.FACE_BIT, "fap_quant", animation.face),
        (slots.BODY_BIT, "bap_quant", animation.body),
    ):
        given = slots.quantiser_of(options, part)
        if track is None or not given:
            continue
        scale, coded = quantiser.scale(part, given), levels(track, options)
        divisor = int(np.gcd.reduce(coded, axis=None)) * scale
        if isinstance(track, FaceTrack):
            divisor = int(np.gcd.reduce(_amounts(track), initial=divisor))
        largest = int(np.abs(coded).max(initial=0)) * scale
        chosen[name] = max(
            quant
            for quant in range(given, QUANT_MAX + 1)
            if quant == given or _keeps(divisor, largest, quantiser.scale(part, quant))
        )
    return replace(options, **chosen)


def exact_quantisers(
    animation: Animation, options: EncoderOptions, parts: Collection[str] = ("face", "body")
) -> EncoderOptions:
    """Return options without the quantisers of those parts, "face" and "body", that they would round.

    A part stays quantised if all its values are multiples of its steps, or if planes cannot carry all of them
    without a quantiser.
    """
    rounded = count_rounded(animation, options)
    tracks = {"face": animation.face, "body": animation.body}
    sent = [track.mask for track in tracks.values() if track is not None]
    intra = np.append(True, np.logical_or.reduce([(mask[1:] != mask[:-1]).any(axis=1) for mask in sent]))
    names = {"face": "fap_quant", "body": "bap_quant"}
    chosen: dict[str, Any] = {
        names[part]: 0
        for part, track in tracks.items()
        if part in parts and part in rounded and track is not None and _fits_unquantised(track, intra)
    }
    return replace(options, **chosen)


def _fits_unquantised(track: FaceTrack | BodyTrack, intra: Bool) -> bool:
    """Whether planes carry all values of a track as they are. intra: bool (T,), frames that are I planes."""
    values = track.values.astype(np.int64)
    values[1:] -= np.where(intra[1:, None], 0, values[:-1])
    return bool(np.abs(values[track.mask]).max(initial=0) <= RANGE_CODE_MAX * RANGE_UNIT)


def count_rounded(animation: Animation, options: EncoderOptions) -> dict[str, int]:
    """Return how many sent values lie between the quantiser's steps, by "face" and "body".

    Parts without such values are absent. Blends and intensities count, too.
    """
    after, result = quantise(animation, options), {}
    if animation.face is not None and after.face is not None:
        before, sent = animation.face, animation.face.mask
        result["face"] = int(
            ((before.values != after.face.values) & sent).sum()
            + ((before.viseme != after.face.viseme) & sent[:, :1]).sum()
            + ((before.expression != after.face.expression) & sent[:, 1:2]).sum()
        )
    if animation.body is not None and after.body is not None:
        result["body"] = int(((animation.body.values != after.body.values) & animation.body.mask).sum())
    return {part: count for part, count in result.items() if count}


def _keeps(divisor: int, largest: int, scale: int) -> bool:
    """Return whether multiples of `divisor` table steps up to `largest` are exact with steps x `scale`."""
    return divisor > 0 and divisor % scale == 0 and largest <= RANGE_CODE_MAX * RANGE_UNIT // scale * scale


def _amounts(face: FaceTrack) -> Int64:
    """Return the blends and intensities that are sent; the quantiser of FAPs rounds them, too."""
    fields = [face.viseme[face.mask[:, 0], 2:3], face.expression[face.mask[:, 1]][:, [1, 3]]]
    amounts: Int64 = np.concatenate([values.ravel() for values in fields]).astype(np.int64)
    return amounts


def _steps(track: FaceTrack | BodyTrack, options: EncoderOptions) -> Int64:
    """Return the quantiser steps of a track's columns."""
    if isinstance(track, BodyTrack):
        return quantiser.steps(slots.BODY_BIT, options.bap_quant, options.bap_steps)
    steps = quantiser.steps(slots.FACE_BIT, options.fap_quant, options.bap_steps)
    return np.concatenate([np.ones(2, dtype=np.int64), steps[slots.FAPS]])


def _quantised(track: FaceTrack | BodyTrack, options: EncoderOptions) -> Int32:
    """Return the values of a track as multiples of their steps, int32."""
    values: Int32 = (levels(track, options) * _steps(track, options)).astype(np.int32)
    return values


def _quantised_face(face: FaceTrack, options: EncoderOptions) -> FaceTrack:
    """Return a face with quantised values, and with its blend and intensities rounded as FAPs are."""
    step = np.array(max(options.fap_quant, 1), dtype=np.int64)
    viseme, expression = face.viseme.copy(), face.expression.copy()
    for fields, columns in ((viseme, [2]), (expression, [1, 3])):
        fields[:, columns] = quantiser.levels(np.clip(fields[:, columns], 0, INTENSITY_MAX), step) * step
    return FaceTrack(_quantised(face, options), face.mask, viseme, expression, face.interpolated)
