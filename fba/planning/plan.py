"""`Plan`: what of an animation is sent, and where I planes come; `plan_exact` and `plan_compact` make one."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64, Int32
from fba.codec import (
    INTRA_BITS,
    Encoder,
    EncoderOptions,
    EncoderStatistics,
    coarsest_quantisers,
    code_lengths,
    encode_with_statistics,
    quantise,
)
from fba.errors import FbaWarning
from fba.face.resolve import known_faps, resolve
from fba.planning.derived_faps import Choice, choose_faps, interpolated_faps, related_faps
from fba.planning.segments import Cuts, cheapest_segments, find_cuts
from fba.tracks import BodyTrack, FaceTrack

PRESETS = ("exact", "compact")


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
        """Return the stream, and what the encoder counted. Raises as `fba.codec.encode` does."""
        encoder = Encoder(self.options)
        chunks = [encoder.push_segment(self.animation[frames]) for frames in self.segments]
        chunks.append(encoder.finish())
        return b"".join(chunks), encoder.statistics


def encode_planned(
    animation: Animation, options: EncoderOptions | None = None, *, preset: str = "exact"
) -> tuple[bytes, EncoderStatistics]:
    """Return the shorter of the stream of a plan and that of `fba.encode`, and what the encoder counted.

    preset: "exact" or "compact", the plan (see `plan_exact` and `plan_compact`).
    Raises as `fba.codec.encode` does, ValueError for another preset.
    """
    if preset not in PRESETS:
        raise ValueError(f"preset must be one of {', '.join(PRESETS)}, not {preset!r}")
    animation = quantise(animation, options or EncoderOptions())  # so that both have the same values
    unplanned = encode_with_statistics(animation, options)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FbaWarning)  # given above
        planned = (plan_exact if preset == "exact" else plan_compact)(animation, options).encode()
    # Plans rest on estimates, and on ranges that no value is limited by.
    better = len(planned[0]) < len(unplanned[0]) and planned[1].clamped <= unplanned[1].clamped
    return planned if better else unplanned


def plan_exact(animation: Animation, options: EncoderOptions | None = None) -> Plan:
    """Return a plan that keeps every value that is sent, with the quantisers in `options`.

    What stays at 0 throughout is left out where a player shows the same without it.
    ValueError for an animation without frames.
    """
    sent, options = _prepare(animation, options)
    return _plan_as_sent(sent, options)


def plan_compact(animation: Animation, options: EncoderOptions | None = None) -> Plan:
    """Return a plan that keeps every value that is shown, with the quantisers in `options`.

    Left out is what a player fills in by the standard's rules: a FAP that equals its left/right mate or its
    counterpart on the other contour of the lips. Which ones is decided anew at every I plane. On a face
    without an interpolation table of its own, `fba.face.resolve` gives the same for the decoded stream
    as for the animation. ValueError for an animation without frames.
    """
    sent, options = _prepare(animation, options)
    if sent.face is None:
        return _plan_as_sent(sent, options)
    values, known = known_faps(sent.face)
    high_level = sent.face.mask[:, :2]
    cuts = find_cuts(_changes(known) | _changes(high_level) | _changes(_body_mask(sent)))
    if cuts is None:
        return _plan_as_sent(sent, options)
    choice = choose_faps(values, known, code_lengths(FaceTrack(values, known), cuts.frames, options), cuts)
    bits = choice.bits + _code_lengths(sent.body, cuts, options)
    borders = cheapest_segments(bits + INTRA_BITS, cuts)
    face = _face_to_send(sent.face, values, known, choice, borders, cuts)
    if not np.array_equal(resolve(face), resolve(sent.face)):
        return _plan_as_sent(sent, options)  # definitions of visemes or expressions depend on what is sent
    return Plan(replace(sent, face=face), tuple(cuts.segment(*one) for one in borders), options)


def _prepare(animation: Animation, options: EncoderOptions | None) -> tuple[Animation, EncoderOptions]:
    """Return the animation as a decoder returns it, without what never moves, and quantisers for it."""
    if not len(animation):
        raise ValueError("there is no frame to encode")
    options = options or EncoderOptions()
    sent = quantise(animation, options)
    face = None if sent.face is None else _without_unmoved_faps(sent.face)
    body = None if sent.body is None else BodyTrack(sent.body.values, _body_mask(sent))
    return replace(sent, face=face, body=body), coarsest_quantisers(sent, options)


def _plan_as_sent(sent: Animation, options: EncoderOptions) -> Plan:
    """Return a plan that sends everything, in segments that take the fewest bits."""
    face = sent.face.mask if sent.face is not None else np.zeros((len(sent), 0), dtype=np.bool_)
    cuts = find_cuts(_changes(face) | _changes(_body_mask(sent)))
    if cuts is None:
        return Plan(sent, (slice(0, len(sent)),), options)
    bits = _code_lengths(sent.face, cuts, options) + _code_lengths(sent.body, cuts, options)
    borders = cheapest_segments(bits + INTRA_BITS, cuts)
    return Plan(sent, tuple(cuts.segment(*one) for one in borders), options)


def _without_unmoved_faps(face: FaceTrack) -> FaceTrack:
    """Return a face that does not send what is 0 throughout, as far as a player shows the same.

    With a viseme or an expression in force, a FAP that is sent as 0 holds against it. And 0 must be sent
    beside a mate that moves, which a player would copy.
    """
    mask = face.mask.copy()
    used = face.viseme.any(), face.expression.any()
    mask[:, :2] &= used
    if not any(used):
        moves = np.asarray(face.values.any(axis=0))
        for related in related_faps():
            mask[:, related] &= moves[list(related)].any()
    interpolated = face.interpolated
    if interpolated is not None:  # what is left out must not end the interpolation of its group
        interpolated = interpolated_faps(mask, mask | interpolated)
    return FaceTrack(face.values, mask, face.viseme, face.expression, interpolated)


def _body_mask(animation: Animation) -> Bool:
    """Return bool (T, 296), or (T, 0): BAPs that are sent and move; one never sent is 0, too."""
    if animation.body is None:
        return np.zeros((len(animation), 0), dtype=np.bool_)
    mask: Bool = animation.body.mask & animation.body.values.any(axis=0)
    return mask


def _changes(mask: Bool) -> Bool:
    """Return bool (T,): where a row differs from the one before."""
    changes = np.zeros(len(mask), dtype=np.bool_)
    changes[1:] = (mask[1:] != mask[:-1]).any(axis=1)
    return changes


def _code_lengths(track: FaceTrack | BodyTrack | None, cuts: Cuts, options: EncoderOptions) -> Float64:
    """Return the bits of a track from one cut to another: float64 (C, C)."""
    count = len(cuts.frames)
    if track is None:
        return np.zeros((count, count))
    lengths: Float64 = code_lengths(track, cuts.frames, options).sum(axis=0)
    return lengths


def _face_to_send(
    face: FaceTrack, values: Int32, known: Bool, choice: Choice, borders: list[tuple[int, int]], cuts: Cuts
) -> FaceTrack:
    """Return a face that sends the FAPs chosen for each segment, and asks for the others."""
    mask = face.mask.copy()
    for first, last in borders:
        mask[cuts.segment(first, last), 2:] = choice.sent[2:, first, last]
    return FaceTrack(values, mask, face.viseme, face.expression, interpolated_faps(mask, known))
