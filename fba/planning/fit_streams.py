"""`encode_with_fit`: a stream that sends only what a head's interpolation table (FIT) starts from."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float32, Float64, Int32
from fba.codec import EncoderOptions, EncoderStatistics, decode
from fba.errors import ModelError, OptionError
from fba.face import Deformer, FaceModel, known_faps, resolve
from fba.face.deform.displacements import unit_motions, vertex_distances
from fba.face.learning import Spread, send_sources
from fba.face.learning.reduction import linked_columns
from fba.planning._derived_faps import interpolated_faps
from fba.planning._plan import encode_planned
from fba.tracks import FaceTrack

MAX_FIT_ERROR = 0.003
"""Metres, at the vertex that a FAP moves most: FAPs are sent for which the FIT's error is larger."""


@dataclass(frozen=True, eq=False)
class FitStream:
    """A stream for a head that computes most FAPs.

    sent: numbers of the FAPs that it sends. added: those of them that the head would compute, but with too
    large errors. distances: float64 (T,), metres by which the worst vertex of each frame is off, in the frame
    of the head, compared with all FAPs of the animation played on the same head.
    """

    data: bytes
    statistics: EncoderStatistics
    sent: tuple[int, ...]
    added: tuple[int, ...]
    distances: Float64

    @property
    def errors(self) -> Spread:
        """Distances by which the worst vertices of frames are off, in mm."""
        return Spread.measure(self.distances * 1000)


def encode_with_fit(
    animation: Animation,
    model: FaceModel,
    options: EncoderOptions | None = None,
    *,
    most_off: float = MAX_FIT_ERROR,
) -> FitStream:
    """Return a stream without the FAPs that the FIT of a head computes well enough.

    It sends the FAPs that the FIT starts from, those that no link of the FIT leads to, and those whose error
    would exceed `most_off` metres in some frame, at the vertex that the FAP moves most. A player must have
    the head (`fba play --model`); on other heads, left/right mates and lips replace some missing FAPs at
    best. The body is sent as it is.

    ModelError for a model without FIT, OptionError for an animation without a face, ValueError for a
    `most_off` that is not positive; else as `fba.encode`.
    """
    if model.fit is None:
        raise ModelError(
            f"{model.name or 'the model'} has no interpolation table (FIT) that could give FAPs; "
            "fba model learn-fit makes one"
        )
    if animation.face is None or not len(animation):
        raise OptionError("there is no face in this animation, and a FIT gives nothing but FAPs")
    if not most_off > 0:
        raise ValueError(f"most_off must be positive, not {most_off}")
    options = options or EncoderOptions()
    deformer = Deformer(model)
    wanted = resolve(animation.face, model)
    reduced = sent = send_sources(animation.face, model.fit)
    linked = linked_columns(model.fit)
    values, known = known_faps(animation.face)
    for columns in (linked, ~linked):  # FAPs of the table first: mates copy them
        missed = _missed(wanted, resolve(sent, model), deformer, most_off) & columns
        sent = _send(sent, values, missed & known.all(axis=0))
    asked = interpolated_faps(sent.mask, sent.mask | linked)
    face = FaceTrack(sent.values, sent.mask, sent.viseme, sent.expression, asked)
    data, statistics = encode_planned(
        replace(animation, face=face), options, preset="exact", keep_masks=("face",)
    )
    decoded = decode(data, bap_steps=options.bap_steps).face
    assert decoded is not None
    return FitStream(
        data,
        statistics,
        _numbers(face.mask),
        _numbers(face.mask & ~reduced.mask),
        vertex_distances(deformer, wanted, resolve(decoded, model)),
    )


def _missed(wanted: Float32, shown: Float32, deformer: Deformer, most_off: float) -> Bool:
    """Return bool (68,): FAPs that are further off than this distance in metres."""
    reach = np.linalg.norm(unit_motions(deformer), axis=2).max(axis=1, initial=0.0) / 1000
    missed: Bool = np.abs(shown - wanted).max(axis=0) * reach > most_off
    return missed


def _send(track: FaceTrack, values: Int32, added: Bool) -> FaceTrack:
    """Return a track that sends more FAPs, bool (68,), with these values, int32 (T, 68)."""
    mask = track.mask | added
    return FaceTrack(np.where(mask, values, track.values), mask, track.viseme, track.expression)


def _numbers(mask: Bool) -> tuple[int, ...]:
    """Return the numbers of the FAPs that a mask (T, 68) has in any frame."""
    return tuple((np.flatnonzero(mask.any(axis=0)) + 1).tolist())
