"""Merge a face (.fap) and a body (.bap) into one animation."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
import numpy.typing as npt

from fba.animation import Animation, BodyTrack, FaceTrack
from fba.arrays import Intp
from fba.errors import FormatError, Remedy

Scalar = TypeVar("Scalar", bound=np.generic)


def merge(face_animation: Animation, body_animation: Animation) -> Animation:
    """Return the face of one animation with the body of the other, joined by frame number.

    The result has every frame number that occurs in either; a part that has no such frame is not sent in
    it. The name is that of the face, else that of the body. Raises FormatError if a part is missing or the
    frame rates differ.
    """
    if face_animation.face is None:
        raise FormatError(f"nothing to join: {_name(face_animation)} has no face")
    if body_animation.body is None:
        raise FormatError(f"nothing to join: {_name(body_animation)} has no body")
    if face_animation.rate != body_animation.rate:
        raise FormatError(
            f"{_name(face_animation)} has {face_animation.rate} frames/s, {_name(body_animation)} "
            f"{body_animation.rate}"
        ).with_remedies(
            Remedy(
                "rate", "resample one of them first, with {}", f"{face_animation.rate}", "Animation.resample"
            )
        )
    index = np.union1d(face_animation.index, body_animation.index)
    face, body = face_animation.face, body_animation.body
    rows = np.searchsorted(index, face_animation.index)
    joined_face = FaceTrack(
        _spread(face.values, rows, len(index)),
        _spread(face.mask, rows, len(index)),
        _spread(face.viseme, rows, len(index)),
        _spread(face.expression, rows, len(index)),
        _spread(face.interpolated, rows, len(index)) if face.interpolated is not None else None,
    )
    rows = np.searchsorted(index, body_animation.index)
    joined_body = BodyTrack(_spread(body.values, rows, len(index)), _spread(body.mask, rows, len(index)))
    name = face_animation.name or body_animation.name
    return Animation(face_animation.rate, index, joined_face, joined_body, name)


def _spread(values: npt.NDArray[Scalar], rows: Intp, count: int) -> npt.NDArray[Scalar]:
    """Return an array (count, columns) with values (K, columns) in rows (K,), zeros (False) elsewhere."""
    spread = np.zeros((count, values.shape[1]), dtype=values.dtype)
    spread[rows] = values
    return spread


def _name(animation: Animation) -> str:
    return repr(animation.name) if animation.name else "the animation"
