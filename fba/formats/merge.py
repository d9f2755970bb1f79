"""One performance from two files: a face (.fap) and a body (.bap)."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
import numpy.typing as npt

from fba.animation import Animation, BodyTrack, FaceTrack
from fba.arrays import Intp
from fba.errors import FormatError, Remedy

Scalar = TypeVar("Scalar", bound=np.generic)


def merge(face_animation: Animation, body_animation: Animation) -> Animation:
    """The face of one and the body of the other, joined by frame number.

    The result has every frame number that occurs in either; where one has no such frame, nothing of
    that part is sent. Its name is the face's, else the body's. Raises FormatError where a part is
    missing or the frame rates differ.
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
    at = np.searchsorted(index, face_animation.index)
    joined_face = FaceTrack(
        _spread(face.values, at, len(index)),
        _spread(face.mask, at, len(index)),
        _spread(face.viseme, at, len(index)),
        _spread(face.expression, at, len(index)),
        _spread(face.interpolated, at, len(index)) if face.interpolated is not None else None,
    )
    at = np.searchsorted(index, body_animation.index)
    joined_body = BodyTrack(_spread(body.values, at, len(index)), _spread(body.mask, at, len(index)))
    name = face_animation.name or body_animation.name
    return Animation(face_animation.rate, index, joined_face, joined_body, name)


def _spread(rows: npt.NDArray[Scalar], at: Intp, count: int) -> npt.NDArray[Scalar]:
    """These rows at these places among `count`, zeros (False) elsewhere."""
    spread = np.zeros((count, rows.shape[1]), dtype=rows.dtype)
    spread[at] = rows
    return spread


def _name(animation: Animation) -> str:
    return repr(animation.name) if animation.name else "the animation"
