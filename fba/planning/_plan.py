"""Plans, made by `plan_exact` and `plan_compact`: what of an animation is sent, and where I planes come."""

from __future__ import annotations

import warnings
from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64, Int32, Int64
from fba.codec import (
    Encoder,
    EncoderOptions,
    EncoderStatistics,
    coarsest_quantisers,
    count_rounded,
    decode,
    encode_animation,
    quantise,
)
from fba.encoder_options import PLANNED, REFERENCE, PlannedPreset
from fba.errors import FbaWarning
from fba.face import FaceSettings, known_faps, resolve
from fba.limits import Limits
from fba.parameters import FAP_COUNT, fap_steps
from fba.planning._code_lengths import INTRA_BITS, code_lengths
from fba.planning._derived_faps import (
    Choice,
    choose_faps,
    find_fit_faps,
    interpolated_faps,
    related_faps,
    table_columns,
)
from fba.planning._segments import Cuts, cheapest_segments, find_cuts
from fba.tracks import BodyTrack, FaceTrack

NO_LIMITS = Limits(frames=1 << 62, bytes=1 << 62)
"""For streams that this program made itself."""


@dataclass(frozen=True, eq=False)
class Plan:
    """How an animation is to be coded.

    animation: with what is sent, and nothing else. segments: the frames of each segment; each begins with an
    I plane. options: with quantisers that may be coarser than asked for, where that changes no value.
    """

    animation: Animation
    segments: tuple[slice, ...]
    options: EncoderOptions

    def encode(self) -> tuple[bytes, EncoderStatistics]:
        """Return the stream, and the encoder's statistics. Raises as `fba.encode` does."""
        encoder = Encoder(self.options)
        chunks = [encoder.push_segment(self.animation[frames]) for frames in self.segments]
        chunks.append(encoder.finish())
        return b"".join(chunks), encoder.statistics


def encode_planned(
    animation: Animation,
    options: EncoderOptions | None = None,
    *,
    preset: PlannedPreset = "exact",
    keep_masks: Collection[str] = (),
    model: FaceSettings | None = None,
) -> tuple[bytes, EncoderStatistics]:
    """Return the shortest of the planned streams and the unplanned stream, and the encoder's statistics.

    preset: "exact" or "compact", the plans. Exact plans have the values of the unplanned stream. Compact
    plans may instead have the values that each frame has by itself, if rounding depends on earlier frames.
    keep_masks: parts, "face" and "body", of which nothing is left out, so that a decoder returns their masks,
    too; compact plans leave out FAPs all the same. model: see `plan_compact`. Raises as `fba.encode` does,
    ValueError for another preset.
    """
    if preset not in PLANNED:
        raise ValueError(f"preset must be one of {', '.join(PLANNED)}, not {preset!r}")
    options = replace(options or EncoderOptions(), preset=REFERENCE)
    unplanned = encode_animation(animation, options)
    given = _as_coded(animation, options, *unplanned)
    if preset == "exact":
        plans = [_plan_exact(given, options, keep_masks)]
    else:
        plans = [_plan_compact(given, options, keep_masks, model)]
        by_itself = quantise(animation, options)
        if by_itself != given:
            plans.append(_plan_compact(by_itself, options, keep_masks, model))
    planned = [stream for stream in (plan.encode() for plan in plans) if not stream[1].clamped]
    best, statistics = min([unplanned, *planned], key=lambda stream: len(stream[0]))
    statistics.clamped_parameters = unplanned[1].clamped_parameters
    return best, statistics


def _as_coded(
    animation: Animation, options: EncoderOptions, data: bytes, statistics: EncoderStatistics
) -> Animation:
    """Return an animation with the values that its stream has. statistics: of the encoder."""
    if not statistics.clamped and not count_rounded(animation, options):
        return animation
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        coded = decode(data, bap_steps=options.bap_steps, limits=NO_LIMITS)
    face, body = animation.face, animation.body
    if face is not None and coded.face is not None:
        new = coded.face
        face = FaceTrack(new.values, face.mask, new.viseme, new.expression, face.interpolated)
    if body is not None and coded.body is not None:
        body = BodyTrack(coded.body.values, body.mask)
    return replace(animation, face=face, body=body)


def plan_exact(animation: Animation, options: EncoderOptions | None = None) -> Plan:
    """Return a plan that keeps every value that is sent, with the quantisers in `options`.

    Parameters that are always 0 are left out if a player shows the same without them. ValueError for an
    animation without frames.
    """
    options = options or EncoderOptions()
    return _plan_exact(quantise(animation, options), options, ())


def plan_compact(
    animation: Animation,
    options: EncoderOptions | None = None,
    *,
    model: FaceSettings | None = None,
    intra_bits: float = INTRA_BITS,
) -> Plan:
    """Return a plan that keeps every value that is shown, with the quantisers in `options`.

    It leaves out FAPs that a player interpolates by the standard's rules, because they equal their left/right
    mate or their counterpart on the other contour of the lips; each segment has its own choice of them. On a
    face without an interpolation table, `fba.face.resolve` gives the same for the decoded stream as for the
    animation. model: the face that every receiver has; FAPs that its table gives exactly are left out, too.
    intra_bits: bits counted for an I plane besides those of its FAPs: the more, the fewer segments.
    ValueError for an animation without frames.
    """
    options = options or EncoderOptions()
    return _plan_compact(quantise(animation, options), options, (), model, intra_bits)


def _plan_exact(given: Animation, options: EncoderOptions, keep_masks: Collection[str]) -> Plan:
    """Return the exact plan of a quantised animation."""
    return _plan_as_sent(_without_unmoved(given, keep_masks), coarsest_quantisers(given, options))


def _plan_compact(
    given: Animation,
    options: EncoderOptions,
    keep_masks: Collection[str],
    model: FaceSettings | None,
    intra_bits: float = INTRA_BITS,
) -> Plan:
    """Return the compact plan of a quantised animation."""
    table = None if model is None else model.fit
    linked = [] if table is None else table_columns(table)
    sent = _without_unmoved(given, {"body"} & set(keep_masks), linked)
    options = coarsest_quantisers(given, options)
    if sent.face is None:
        return _plan_as_sent(sent, options)
    fit = None if table is None else find_fit_faps(sent.face, table, _fap_steps(options))
    values, known = known_faps(sent.face) if fit is None else (fit.values, fit.known)
    high_level = sent.face.mask[:, :2]
    cuts = find_cuts(_changes(known) | _changes(high_level) | _changes(_mask(sent.body, len(sent))))
    if cuts is None:
        return _plan_as_sent(sent, options)
    lengths = code_lengths(FaceTrack(values, known), cuts.frames, options)
    choice = choose_faps(values, known, lengths, cuts, None if fit is None else fit.choice(cuts))
    bits = choice.bits + _code_lengths(sent.body, cuts, options)
    borders = cheapest_segments(bits + intra_bits, cuts)
    face = _face_to_send(sent.face, values, known, choice, borders, cuts)
    if not np.array_equal(resolve(face, model), resolve(sent.face, model)):
        return _plan_as_sent(sent, options)  # definitions of visemes or expressions depend on what is sent
    return Plan(replace(sent, face=face), tuple(cuts.segment(*pair) for pair in borders), options)


def _fap_steps(options: EncoderOptions) -> Int64:
    """Return the quantiser steps of all FAPs, int64 (68,)."""
    return fap_steps() * options.fap_quant if options.fap_quant else np.ones(FAP_COUNT, dtype=np.int64)


def _without_unmoved(
    animation: Animation, keep_masks: Collection[str], linked: Collection[int] = ()
) -> Animation:
    """Return an animation that does not send what never moves. ValueError if it has no frames.

    keep_masks: parts of which all is sent. linked: columns of FAPs that are sent, too, since a FIT would give
    other values for them, or computes others from them.
    """
    if not len(animation):
        raise ValueError("there is no frame to encode")
    face, body = animation.face, animation.body
    if face is not None and "face" not in keep_masks:
        face = _without_unmoved_faps(face, linked)
    if body is not None and "body" not in keep_masks:
        body = BodyTrack(body.values, body.mask & body.values.any(axis=0))  # unsent BAPs are 0, too
    return replace(animation, face=face, body=body)


def _plan_as_sent(sent: Animation, options: EncoderOptions) -> Plan:
    """Return a plan that sends everything, in segments that take the fewest bits."""
    count = len(sent)
    cuts = find_cuts(_changes(_mask(sent.face, count)) | _changes(_mask(sent.body, count)))
    if cuts is None:
        return Plan(sent, (slice(0, count),), options)
    bits = _code_lengths(sent.face, cuts, options) + _code_lengths(sent.body, cuts, options)
    borders = cheapest_segments(bits + INTRA_BITS, cuts)
    return Plan(sent, tuple(cuts.segment(*pair) for pair in borders), options)


def _without_unmoved_faps(face: FaceTrack, linked: Collection[int]) -> FaceTrack:
    """Return a face that does not send FAPs that are always 0, if a player then shows the same.

    A FAP that is sent as 0 overrides visemes and expressions in force. And 0 must be sent if a mate moves,
    which a player would copy.
    """
    mask = face.mask.copy()
    used = face.viseme.any(), face.expression.any()
    mask[:, :2] &= np.array(used) | np.isin([0, 1], list(linked))
    if not any(used):
        moves = np.asarray(face.values.any(axis=0))
        for related in related_faps():
            mask[:, related] &= moves[list(related)].any() or not set(linked).isdisjoint(related)
    interpolated = face.interpolated
    if interpolated is not None:  # FAPs left out must not end the interpolation of their group
        interpolated = interpolated_faps(mask, mask | interpolated)
    return FaceTrack(face.values, mask, face.viseme, face.expression, interpolated)


def _mask(track: FaceTrack | BodyTrack | None, count: int) -> Bool:
    """Return the mask of a track of `count` frames, bool (T, columns)."""
    return np.zeros((count, 0), dtype=np.bool_) if track is None else track.mask


def _changes(mask: Bool) -> Bool:
    """Return bool (T,): where a row differs from the one before."""
    changes = np.zeros(len(mask), dtype=np.bool_)
    changes[1:] = (mask[1:] != mask[:-1]).any(axis=1)
    return changes


def _code_lengths(track: FaceTrack | BodyTrack | None, cuts: Cuts, options: EncoderOptions) -> Float64:
    """Return the bits of a track between any two cuts: float64 (C, C)."""
    count = len(cuts.frames)
    if track is None:
        return np.zeros((count, count))
    lengths: Float64 = code_lengths(track, cuts.frames, options).sum(axis=0)
    return lengths


def _face_to_send(
    face: FaceTrack, values: Int32, known: Bool, choice: Choice, borders: list[tuple[int, int]], cuts: Cuts
) -> FaceTrack:
    """Return a face that sends the FAPs chosen for each segment; players interpolate the others."""
    mask = face.mask.copy()
    for first, last in borders:
        mask[cuts.segment(first, last), 2:] = choice.sent[2:, first, last]
    return FaceTrack(values, mask, face.viseme, face.expression, interpolated_faps(mask, known))
