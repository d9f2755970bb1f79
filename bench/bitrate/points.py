"""Operating points: each a setting of this encoder, and what a receiver of its stream shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from bench.bitrate.errors import ROOT, TURN
from bench.bitrate.subjects import BODY, FACE, Subject
from fba.arrays import Float64, Int64
from fba.codec import EncoderOptions, decode, encode_animation, probe_stream
from fba.encoder_options import PlannedPreset
from fba.face import known_faps, resolve
from fba.planning import LiveEncoder, Tolerance, encode_planned, encode_within_tolerance, plan_compact
from fba.planning.rate import RateEncoder

QUANTISERS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 31)
UNPLANNED = "FBA, nothing known"
"""A live encoder that knows nothing before a frame comes."""
KNOWN = "FBA, ranges known"
"""A live encoder that knows how far values go, and which FAPs are equal."""
RATES = {FACE: (2.0, 3.0, 4.0), BODY: (6.0, 12.0, 24.0)}
"""Mean rates, kbit/s, that a live encoder holds."""
NO_SPARE_INTRA = 1e9
"""Price of an I plane, bits, where only necessary I planes are wanted."""
TOLERANCES = {FACE: (0.2, 0.5, 1.0, 2.0), BODY: (10.0, 20.0)}
"""Millimetres by which vertices of the face, or points 3 cm off joints of the body, may be off."""
WITH_RIVALS = {FACE: (1, 2, 6, 12, 24), BODY: (1, 2, 4, 6, 12)}
"""Quantisers at which rivals code the same numbers."""


class Point(NamedTuple):
    """A setting of this encoder.

    method, setting: its name. encode: returns the stream of a subject. rivals: whether the others code the
    values that come of it, too.
    """

    method: str
    setting: str
    encode: Callable[[Subject], bytes]
    rivals: bool = False


@dataclass(frozen=True, eq=False)
class Coded:
    """A subject's stream and what comes of it.

    size: bytes of the stream. plane_bytes: int64 (P,), of each plane, a packet by itself, in whole bytes.
    shown: float64 (T, 68 or 296), at every frame of the source. values: int64 (P, 68 or 296), what a decoder
    knows with each plane. used: columns that the stream carries.
    """

    size: int
    plane_bytes: Int64
    shown: Float64
    values: Int64
    used: Int64


def decode_subject(subject: Subject, data: bytes) -> Coded:
    """Return what a receiver of a subject's stream shows.

    Over frames that the stream leaves out, it goes straight from one plane to the next.
    """
    info = probe_stream(data)
    assert info.plane_bits is not None
    received = decode(data, bap_steps=subject.bap_steps)
    if subject.kind == FACE:
        assert received.face is not None
        shown = resolve(received.face).astype(np.float64)
        values = known_faps(received.face)[0]
        mask = received.face.mask
    else:
        assert received.body is not None
        shown = received.body.values.astype(np.float64)
        values, mask = received.body.values, received.body.mask
    index = subject.animation.index - subject.animation.index[0]
    own = received.index - received.index[0]
    if len(own) != len(index) or (own != index).any():
        if subject.kind == BODY:  # the short way, as players go
            shown[:, : ROOT.start] = np.unwrap(shown[:, : ROOT.start], axis=0, period=TURN)
            shown[:, ROOT.stop :] = np.unwrap(shown[:, ROOT.stop :], axis=0, period=TURN)
        shown = np.stack([np.interp(index, own, column) for column in shown.T], axis=1)
    return Coded(
        len(data), -(-info.plane_bits // 8), shown, values.astype(np.int64), np.flatnonzero(mask.any(axis=0))
    )


def options_for(subject: Subject, quant: int) -> EncoderOptions:
    """Return the options of an encoder for a subject, with one quantiser, and no mark, which others lack."""
    return EncoderOptions(
        fap_quant=quant, bap_quant=quant, bap_steps=subject.bap_steps, clamp=True, mark=False
    )


def encode_with_preset(subject: Subject, preset: PlannedPreset, quant: int) -> bytes:
    """Return the stream of a preset, planned with the whole recording known."""
    return encode_planned(subject.animation, options_for(subject, quant), preset=preset)[0]


def encode_with_known_ranges(subject: Subject) -> bytes:
    """Return the stream of a live encoder that knows how far values go, and which FAPs players derive.

    It has one I plane where what is sent stays the same.
    """
    options = options_for(subject, 1)
    if subject.kind == FACE:
        return plan_compact(subject.animation, options, intra_bits=NO_SPARE_INTRA).encode()[0]
    return encode_animation(subject.animation, options)[0]


def encode_live(subject: Subject) -> bytes:
    """Return the stream of an encoder that gets one frame at a time and knows nothing of the next but one."""
    encoder = LiveEncoder(options_for(subject, 1))
    return b"".join(encoder.push(frame) for frame in subject.animation) + encoder.finish()


def encode_near(subject: Subject, millimetres: float) -> bytes:
    """Return a stream that keeps every vertex or joint within a distance, standing feet within half.

    RangeError where none does.
    """
    limit = 1e-3 * millimetres
    tolerance = Tolerance(face=limit) if subject.kind == FACE else Tolerance(joint=limit, foot=limit / 2)
    return encode_within_tolerance(subject.animation, tolerance, options_for(subject, 1))[0]


def encode_live_at_rate(subject: Subject, rate: float) -> bytes:
    """Return the stream of a live encoder that holds a mean rate, in kbit/s, and knows nothing before.

    RangeError where its buffer of a second is too small for an I plane.
    """
    encoder = RateEncoder(1e3 * rate, options=options_for(subject, 1))
    return b"".join(encoder.push(frame) for frame in subject.animation) + encoder.finish()


def operating_points(kind: str) -> tuple[Point, ...]:
    """Return all settings for a face or a body, those without loss first."""
    preset: PlannedPreset = "compact" if kind == FACE else "exact"
    found = [
        Point(
            f"FBA {preset}",
            f"quantiser {quant}",
            partial(encode_with_preset, preset=preset, quant=quant),
            quant in WITH_RIVALS[kind],
        )
        for quant in QUANTISERS
    ]
    found.append(Point(KNOWN, "quantiser 1", encode_with_known_ranges))
    found.append(Point(UNPLANNED, "quantiser 1", encode_live))
    found += [
        Point(UNPLANNED, f"{rate:g} kbit/s", partial(encode_live_at_rate, rate=rate)) for rate in RATES[kind]
    ]
    if kind == FACE:
        found.append(Point("FBA exact", "quantiser 1", partial(encode_with_preset, preset="exact", quant=1)))
    found += [
        Point("FBA tolerance", f"{limit:g} mm", partial(encode_near, millimetres=limit), True)
        for limit in TOLERANCES[kind]
    ]
    return tuple(found)
